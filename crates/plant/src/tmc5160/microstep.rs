//! The microstep table: coil currents over one electrical period.
//!
//! The chip stores a quarter of the wave as 256 differences of one bit each. What a 0 bit is worth is
//! chosen for each of four segments of the quarter, a 1 bit is worth one more (datasheet, chapter 18).

/// Entries of an electrical period.
pub(super) const PERIOD: u32 = 1024;

const QUARTER: u32 = PERIOD / 4;

/// The table as it stands in MSLUT\[0..7\], MSLUTSEL and MSLUTSTART.
#[derive(Clone, Copy, Debug)]
pub(super) struct Table {
    pub(super) differences: [u32; 8],
    pub(super) select: u32,
    pub(super) start: u32,
}

impl Table {
    /// MSCURACT at a position in the table: phase A (sine) in bits 0-8, phase B (cosine) in bits
    /// 16-24, both with sign.
    pub(super) fn currents(&self, mscnt: u32) -> u32 {
        let sine = self.wave(mscnt);
        let cosine = self.wave(mscnt.wrapping_add(QUARTER));
        sine.cast_unsigned() & 0x1FF | (cosine.cast_unsigned() & 0x1FF) << 16
    }

    fn wave(&self, position: u32) -> i32 {
        let (quadrant, along) = (position / QUARTER % 4, position % QUARTER);
        match quadrant {
            0 => self.rising(along),
            1 => self.falling(along),
            2 => -self.rising(along),
            _ => -self.falling(along),
        }
    }

    /// The first quarter, counted up from START_SIN.
    fn rising(&self, along: u32) -> i32 {
        let start = (self.start & 0xFF).cast_signed();
        start + (0..along).map(|entry| self.difference(entry)).sum::<i32>()
    }

    /// The second quarter, counted down from START_SIN90 over the same differences.
    fn falling(&self, along: u32) -> i32 {
        let top = (self.start >> 16 & 0xFF).cast_signed();
        top - (0..along).map(|entry| self.difference(QUARTER - 1 - entry)).sum::<i32>()
    }

    fn difference(&self, entry: u32) -> i32 {
        let (x1, x2, x3) = (self.select >> 8 & 0xFF, self.select >> 16 & 0xFF, self.select >> 24);
        let segment = [x1, x2, x3].into_iter().filter(|&end| end <= entry).count() as u32;
        let base = (self.select >> (2 * segment) & 0b11).cast_signed() - 1;
        let word = self.differences.get((entry / 32) as usize).copied().unwrap_or(0);
        base + (word >> (entry % 32) & 1).cast_signed()
    }
}

#[cfg(test)]
mod tests {
    use super::Table;

    const RESET: Table = Table {
        differences: [
            0xAAAA_B554,
            0x4A95_54AA,
            0x2449_2929,
            0x1010_4222,
            0xFBFF_FFFF,
            0xB5BB_777D,
            0x4929_5556,
            0x0040_4222,
        ],
        select: 0xFFFF_8056,
        start: 0x00F7_0000,
    };

    #[test]
    fn the_table_after_reset_is_a_sine_of_amplitude_247() {
        // The differences of the quarter add up to 248, one more than START_SIN90.
        for position in 0..1024u32 {
            let angle = f64::from(position) * core::f64::consts::TAU / 1024.0;
            let current = f64::from(RESET.wave(position));
            let exact = 247.5 * angle.sin();
            assert!((current - exact).abs() < 2.5, "{current} at {position}, exactly {exact}");
        }
    }

    #[test]
    fn phase_b_is_a_quarter_ahead_and_negative_currents_have_nine_bits() {
        assert_eq!(RESET.currents(0), 247 << 16);
        assert_eq!(RESET.currents(512), (512 - 247) << 16);
        assert_eq!(RESET.currents(256) & 0x1FF, 247);
        assert_eq!(RESET.currents(768) & 0x1FF, 512 - 247);
    }
}
