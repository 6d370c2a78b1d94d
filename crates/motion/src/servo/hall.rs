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

#[cfg(test)]
mod tests {
    use super::super::random::Random;
    use super::*;

    /// Levels at an electrical angle in degrees: line k is high from 120 k - 30 on for half a turn.
    fn levels(degrees: i32) -> u8 {
        (0..3).fold(0, |levels, line| {
            let high = (degrees - (120 * line - 30)).rem_euclid(360) < 180;
            levels | u8::from(high) << line
        })
    }

    #[test]
    fn the_sector_is_the_one_around_the_angle() {
        for degrees in 0..360 {
            let expected = ((degrees + 30) / 60 % 6) as u8;
            assert_eq!(sector(levels(degrees), false), Some(expected), "{degrees}");
            assert_eq!(sector(!levels(degrees), true), Some(expected), "{degrees}");
            let centre = f64::from(sector_angle(expected)) * 360.0 / 65_536.0;
            assert!((centre - f64::from(expected) * 60.0).abs() < 0.003);
        }
        for invalid in [0, 7] {
            assert_eq!(sector(invalid, false), None);
            assert_eq!(sector(invalid, true), None);
        }
        assert_eq!(sector_angle(7), sector_angle(1));
    }

    #[test]
    fn neighbours_are_steps_and_all_else_is_an_error() {
        for from in 0..6 {
            for to in 0..6 {
                let mut counter = HallCounter::default();
                assert_eq!(counter.step(Some(from)), HallStep::Same);
                let expected = match (6 + to - from) % 6 {
                    0 => HallStep::Same,
                    1 => HallStep::Right,
                    5 => HallStep::Left,
                    _ => HallStep::Error,
                };
                assert_eq!(counter.step(Some(to)), expected, "{from} {to}");
                assert_eq!(counter.step(None), HallStep::Error);
                assert_eq!(counter.step(Some(to)), HallStep::Same);
                assert_eq!(counter.sector(), Some(to));
            }
        }
    }

    #[test]
    fn an_angle_without_a_known_edge_is_the_centre() {
        let mut counter = HallCounter::default();
        assert_eq!(counter.angle(5, 1 << 20), 0);
        counter.step(Some(2));
        assert_eq!(counter.angle(5, 1 << 20), sector_angle(2));
        for jump in 2..=4 {
            counter.step(Some(2));
            counter.step(Some(3));
            assert_ne!(counter.angle(0, 1 << 20), sector_angle(3));
            counter.step(Some(3 + jump));
            assert_eq!(counter.angle(5, 1 << 20), sector_angle(3 + jump));
        }
    }

    #[test]
    fn the_angle_follows_an_even_turn() {
        // 10 units in a period, 1092 periods in a sector.
        for direction in [1, -1] {
            let mut counter = HallCounter::default();
            let mut since = 0;
            for period in 0..30_000 {
                let angle = (direction * period * 10) as u16;
                let now = (((u32::from(angle) + 5_461) * 6) >> 16) as u8 % 6;
                match counter.step(Some(now)) {
                    HallStep::Same => since += 1,
                    HallStep::Error => panic!("jumped"),
                    _ => since = 0,
                }
                if period > 1_100 {
                    let off = counter.angle(since, direction * 10 * 65_536).wrapping_sub(angle);
                    assert!((off as i16).abs() <= 12, "{off} off at {angle}");
                }
            }
        }
    }

    #[test]
    fn the_angle_stays_in_its_sector() {
        let mut random = Random::new(0x4a11);
        let mut counter = HallCounter::default();
        for _ in 0..200_000 {
            let now = (random.below(8) != 0).then(|| random.next() as u8);
            counter.step(if random.below(2) == 0 { now } else { now.map(|sector| sector % 6) });
            let angle = counter.angle(random.unsigned(), random.signed());
            let centre = sector_angle(counter.sector().unwrap_or(0));
            assert!((angle.wrapping_sub(centre) as i16).unsigned_abs() <= 5_462);
        }
        // Entered from below, at the lower edge; later at the upper one, 30° further than the centre.
        let mut counter = HallCounter::default();
        counter.step(Some(0));
        counter.step(Some(1));
        assert_eq!(counter.angle(0, i32::MAX), 5_461);
        assert_eq!(counter.angle(7, -1_000_000), 5_461);
        assert_eq!(counter.angle(u32::MAX, i32::MAX), 16_384);
    }
}
