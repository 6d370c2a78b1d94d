//! What the model of a machine knows of its chip beyond what a register tells.

use opentmcl_motion::{Instant, TICKS_PER_SECOND};

use super::Tmc5160;
use super::registers::{ENC_CONST, ENCMODE, GCONF, SW_MODE};

impl Tmc5160 {
    /// Whether RAMP_STAT shows stalls: only while sg_stop is set.
    pub(crate) fn tells_stalls(&self) -> bool {
        self.stored(SW_MODE) >> 10 & 1 == 1
    }

    /// What the load measurement gives from now on, before SGT is added.
    pub(crate) fn set_stallguard(&mut self, raw: u16) {
        if let Some(sense) = &mut self.sense {
            sense.stallguard = raw;
        }
    }

    /// Fine steps per second at a speed in register units.
    pub(crate) fn fine_speed(&self, register: u32) -> f64 {
        let microsteps = f64::from(register) * TICKS_PER_SECOND as f64 / f64::from(1 << 24);
        microsteps * f64::from(1 << self.microstep_shift())
    }

    /// How far the position counter moves for one fine step of the field.
    pub(crate) fn microsteps_per_fine_step(&self) -> f64 {
        let microsteps = 1.0 / f64::from(1 << self.microstep_shift());
        if self.stored(GCONF) >> 4 & 1 == 1 { -microsteps } else { microsteps }
    }

    /// How far X_ENC moves for one count of the encoder.
    pub(crate) fn encoder_scale(&self) -> f64 {
        let constant = self.stored(ENC_CONST);
        if self.stored(ENCMODE) >> 10 & 1 == 0 {
            f64::from(constant.cast_signed()) / 65_536.0
        } else {
            f64::from(constant.cast_signed() >> 16) + f64::from(constant & 0xFFFF) / 10_000.0
        }
    }

    /// X_ENC less XACTUAL, the short way round.
    pub(crate) fn encoder_difference(&self, now: Instant) -> i32 {
        self.encoder_position().wrapping_sub(self.ramp.position(now))
    }
}
