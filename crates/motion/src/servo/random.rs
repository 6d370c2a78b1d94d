//! Random inputs for the tests of this module.

/// Xorshift: a seed gives the same values on every platform.
pub(crate) struct Random(u64);

impl Random {
    /// Any seed but 0, which would give nothing but zeros, and acts as 1.
    pub(crate) fn new(seed: u64) -> Self {
        Self(seed.max(1))
    }

    pub(crate) fn next(&mut self) -> u64 {
        self.0 ^= self.0 << 13;
        self.0 ^= self.0 >> 7;
        self.0 ^= self.0 << 17;
        self.0
    }

    /// 0 to `end` - 1. The upper bits, as they are the better ones.
    pub(crate) fn below(&mut self, end: u32) -> u32 {
        (((self.next() >> 32) * u64::from(end)) >> 32) as u32
    }

    /// Up to `bits` bits, all magnitudes alike.
    pub(crate) fn magnitude(&mut self, bits: u32) -> u32 {
        let width = self.below(bits + 1);
        ((self.next() >> 32) & ((1 << width) - 1)) as u32
    }

    /// Any magnitude with both signs, and often the ends of the range.
    pub(crate) fn signed(&mut self) -> i32 {
        let value = self.magnitude(32) as i32;
        match self.below(10) {
            0 => i32::MIN,
            1 => i32::MAX,
            2..=5 => value,
            _ => value.wrapping_neg(),
        }
    }

    /// Any magnitude, and often the ends of the range.
    pub(crate) fn unsigned(&mut self) -> u32 {
        match self.below(10) {
            0 => 0,
            1 => u32::MAX,
            _ => self.magnitude(32),
        }
    }
}
