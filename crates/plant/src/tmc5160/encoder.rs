//! The encoder interface: the counter X_ENC, the latch at the index, and the watch over the deviation.
//!
//! Source: datasheet 6.4. The counter is kept exactly: a factor that is no whole number leaves its
//! fraction, so that nothing drifts however the counts come.

use opentmcl_motion::Instant;

use super::Tmc5160;
use super::registers::{ENC_CONST, ENC_DEVIATION, ENC_LATCH, ENC_STATUS, ENCMODE, X_ENC, XLATCH};

/// Parts of one count of X_ENC that are exact in both the binary and the decimal mode.
const PARTS: i128 = 65_536 * 10_000;

const N_EVENT: u32 = 1 << 0;
const DEVIATION: u32 = 1 << 1;

/// The counter behind X_ENC.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Counter {
    /// Counts of the encoder as they came last.
    pub(super) count: i64,
    /// X_ENC in parts, when the encoder stood at `origin`.
    base: i128,
    origin: i64,
    /// Whether the next index event is the one that clr_once waits for.
    armed: bool,
}

impl Counter {
    /// The state after a reset with the encoder where it is.
    pub(super) fn at(count: i64) -> Self {
        Self { count, origin: count, ..Self::default() }
    }

    fn parts(&self, factor: i128) -> i128 {
        self.base + i128::from(self.count.wrapping_sub(self.origin)) * factor
    }

    fn rebase(&mut self, parts: i128) {
        self.base = parts;
        self.origin = self.count;
    }
}

impl Tmc5160 {
    /// Where the encoder stands, in counts from wherever it began to count. X_ENC moves by ENC_CONST for
    /// each count of the difference to the last call.
    pub fn set_encoder_count(&mut self, count: i64, now: Instant) {
        self.settle(now);
        self.encoder.count = count;
    }

    /// The index of the encoder passes, with these levels of channels A and B.
    ///
    /// It counts as an event if the levels are those of pol_A and pol_B, or ignore_AB is set. A pulse of
    /// the polarity pol_N is taken as one event; which of its edges counts makes no difference.
    pub fn encoder_index(&mut self, a: bool, b: bool, now: Instant) {
        self.settle(now);
        let mode = self.stored(ENCMODE);
        let levels = u32::from(a) | u32::from(b) << 1;
        if mode >> 3 & 1 == 0 && levels != mode & 0b11 {
            return;
        }
        self.store(ENC_STATUS, self.stored(ENC_STATUS) | N_EVENT);
        if !self.latches_at_index() {
            return;
        }
        self.encoder.armed = false;
        self.store(ENC_LATCH, self.encoder_position().cast_unsigned());
        if mode >> 9 & 1 == 1 {
            self.store(XLATCH, self.ramp.position(now).cast_unsigned());
        }
        if mode >> 8 & 1 == 1 {
            self.encoder.rebase(0);
        }
    }

    /// Whether an index event would change a register now.
    pub fn wants_index(&self) -> bool {
        self.stored(ENC_STATUS) & N_EVENT == 0 || self.latches_at_index()
    }

    /// How far X_ENC and XACTUAL are from each other, the short way round.
    pub fn encoder_deviation(&self, now: Instant) -> u32 {
        self.encoder_position().wrapping_sub(self.ramp.position(now)).unsigned_abs()
    }

    /// The deviation above which ENC_STATUS bit 1 is to be set; none if it is not watched.
    pub fn watches_deviation(&self) -> Option<u32> {
        Some(self.stored(ENC_DEVIATION)).filter(|&limit| limit != 0)
    }

    /// The deviation has become larger than the limit: sets ENC_STATUS bit 1.
    pub fn deviate(&mut self, now: Instant) {
        self.settle(now);
        self.store(ENC_STATUS, self.stored(ENC_STATUS) | DEVIATION);
    }

    /// X_ENC: whole counts, the fraction cut off downward.
    pub(super) fn encoder_position(&self) -> i32 {
        self.encoder.parts(self.factor()).div_euclid(PARTS) as i32
    }

    /// Writes one of the registers on which X_ENC depends; what has been counted stays.
    pub(super) fn set_encoder(&mut self, address: u8, value: u32) {
        self.encoder.rebase(self.encoder.parts(self.factor()));
        self.store(address, value);
        match address {
            X_ENC => self.encoder.rebase(i128::from(value.cast_signed()) * PARTS),
            ENCMODE => self.encoder.armed = value >> 5 & 1 == 1,
            _ => {}
        }
    }

    fn latches_at_index(&self) -> bool {
        self.stored(ENCMODE) >> 4 & 1 == 1 || self.encoder.armed
    }

    /// ENC_CONST in parts: 16 bits with sign, and a fraction of 65536 or of 10000 above them.
    fn factor(&self) -> i128 {
        let constant = self.stored(ENC_CONST);
        if self.stored(ENCMODE) >> 10 & 1 == 0 {
            return i128::from(constant.cast_signed()) * 10_000;
        }
        let whole = i128::from(constant.cast_signed() >> 16);
        let fraction = i128::from(constant & 0xFFFF);
        (whole * 10_000 + fraction) * 65_536
    }
}
