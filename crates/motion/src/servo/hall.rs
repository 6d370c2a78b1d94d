//! The rotor's angle from three hall lines.
//!
//! The lines divide an electrical turn into six sectors. Sector k is centred at 60° times k. Line 0 is high in
//! sectors 0 to 2, which is from -30° to 150°; line 1 in sectors 2 to 4, line 2 in sectors 4, 5 and 0.

/// Sectors per electrical turn.
const SECTORS: u8 = 6;
/// Half a sector in 2^-32 turn.
const HALF_SECTOR: i64 = (1 << 32) / 12;

/// The sector 0 to 5 that the levels of the lines, bits 0 to 2, stand for. `inverted` takes the complement of
/// all three. `None` if all are alike, which a sound sensor never gives.
#[inline]
pub const fn sector(levels: u8, inverted: bool) -> Option<u8> {
    match (levels ^ if inverted { 0b111 } else { 0 }) & 0b111 {
        0b101 => Some(0),
        0b001 => Some(1),
        0b011 => Some(2),
        0b010 => Some(3),
        0b110 => Some(4),
        0b100 => Some(5),
        _ => None,
    }
}

/// Electrical angle of a sector's centre in 1/65536 turn. Sectors repeat with each turn.
#[inline]
pub const fn sector_angle(sector: u8) -> u16 {
    (((sector % SECTORS) as u32 * 65_536 + 3) / 6) as u16
}

/// What the hall lines did from one step to the next.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum HallStep {
    /// Nothing.
    Same,
    /// One sector up.
    Right,
    /// One sector down.
    Left,
    /// They were invalid, or jumped over a sector.
    Error,
}

/// Follows the sectors.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct HallCounter {
    /// The last valid sector, if there was one.
    sector: Option<u8>,
    /// Where it was entered: -1 at its lower edge, 1 at its upper edge, 0 unknown.
    entered_at: i8,
}

impl HallCounter {
    /// The next sector, as [`sector`] gives it. The first one that is valid is taken as it is. After an invalid
    /// one the last valid one counts on; after a jump the new one.
    #[inline]
    pub fn step(&mut self, sector: Option<u8>) -> HallStep {
        let Some(sector) = sector else {
            return HallStep::Error;
        };
        if self.sector == Some(sector) {
            return HallStep::Same;
        }
        let sector = sector % SECTORS;
        let ahead = self.sector.map(|before| (sector + SECTORS - before) % SECTORS);
        self.sector = Some(sector);
        let (entered_at, step) = match ahead {
            Some(0) => return HallStep::Same,
            Some(1) => (-1, HallStep::Right),
            Some(5) => (1, HallStep::Left),
            Some(_) => (0, HallStep::Error),
            None => (0, HallStep::Same),
        };
        self.entered_at = entered_at;
        step
    }

    /// The last valid sector; `None` if there was none yet.
    #[inline]
    pub fn sector(&self) -> Option<u8> {
        self.sector
    }

    /// Electrical angle in 1/65536 turn, interpolated: from the edge at which the sector was entered the rotor
    /// goes on with `speed_per_period`, in 1/65536 of 1/65536 electrical turn per control period, but never
    /// out of the sector. Where no edge is known, after the start or a jump, it is the sector's centre; without
    /// a sector it is 0.
    #[inline]
    pub fn angle(&self, periods_since_edge: u32, speed_per_period: i32) -> u16 {
        let Some(sector) = self.sector else {
            return 0;
        };
        let centre = (i64::from(sector) << 32) / i64::from(SECTORS);
        let from_centre = if self.entered_at == 0 {
            0
        } else {
            let travel = i64::from(periods_since_edge) * i64::from(speed_per_period);
            (i64::from(self.entered_at) * HALF_SECTOR)
                .saturating_add(travel)
                .clamp(-HALF_SECTOR, HALF_SECTOR)
        };
        // What is beyond a turn falls away.
        ((centre + from_centre + (1 << 15)) >> 16) as u16
    }
}
