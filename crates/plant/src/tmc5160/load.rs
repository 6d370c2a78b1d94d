//! The load measurement: StallGuard2, the amplitude of StealthChop, and the flags of DRV_STATUS.
//!
//! # Readings
//!
//! - At standstill and in StealthChop there is no measurement: SG_RESULT is 0 and the flag is not set.
//! - A driver that knows no motor measures no load: SG_RESULT is 0 and the flag is not set.

use opentmcl_motion::Instant;

use super::registers::{COOLCONF, PWMCONF};
use super::{Sense, Tmc5160, current};
use crate::driver;

const STALLED: u32 = 1 << 24;

impl Tmc5160 {
    /// What the driver measures from now on.
    pub fn set_sense(&mut self, sense: Sense, now: Instant) {
        self.settle(now);
        self.sense = Some(sense);
        self.notice_faults();
    }

    /// The error bits that the driver sees from now on, as in [`Sense`].
    pub(crate) fn set_flags(&mut self, flags: u32, now: Instant) {
        let rest = self.sense.unwrap_or(Sense::IDEAL);
        self.set_sense(Sense { flags, ..rest }, now);
    }

    /// SG_RESULT for a value before SGT is added.
    pub fn stallguard(&self, raw: u16) -> u16 {
        // Seven bits with sign.
        let threshold = (self.stored(COOLCONF) << 9).cast_signed() >> 25;
        driver::stallguard(raw, threshold)
    }

    /// Whether anything follows from readings of StallGuard2 now: a stop, or a current.
    pub fn readings_matter(&self, now: Instant) -> bool {
        self.stall_stops(now) || self.cool_active(now)
    }

    /// Clocks between two readings of StallGuard2 at the present speed: one full step, four with the
    /// filter (SFILT). None at standstill.
    pub fn reading_interval(&self, now: Instant) -> Option<u64> {
        let full_steps: u64 = if self.stored(COOLCONF) >> 24 & 1 == 1 { 4 } else { 1 };
        let speed = u64::from(self.ramp.velocity(now).unsigned_abs()) << self.microstep_shift();
        // A speed of 1 is a fine step in 2^24 clocks.
        let clocks = (full_steps << (24 + 8)).checked_div(speed)?;
        Some(clocks.max(1))
    }

    /// SG_RESULT, if there is one.
    fn result(&self, now: Instant) -> Option<u16> {
        let sense =
            self.sense.filter(|_| self.standing(now).is_none() && !self.stealthchop(now))?;
        Some(self.stallguard(sense.stallguard))
    }

    /// RAMP_STAT bit 13: the motor stalls where sg_stop could stop it.
    pub(super) fn stall_status(&self, now: Instant) -> bool {
        // The cheap questions first: this is asked whenever RAMP_STAT is read.
        self.tells_stalls()
            && self.sense.is_some_and(|sense| self.stallguard(sense.stallguard) == 0)
            && self.result(now) == Some(0)
            && self.measures_stalls(now)
    }

    pub(super) fn drv_status(&self, now: Instant) -> u32 {
        let result = self.result(now);
        let flags = self.sense.map_or(0, |sense| sense.flags & Sense::FLAGS);
        u32::from(result.unwrap_or(0))
            | u32::from(self.stealthchop(now)) << 14
            | u32::from(self.full_steps(now)) << 15
            | self.actual_current(now) << 16
            | if result == Some(0) { STALLED } else { 0 }
            | flags
            | self.shorts
            | u32::from(current::stands(self.standing(now))) << 31
    }

    /// PWM_SCALE: the amplitude that the motor needs where automatic scaling finds it out, otherwise
    /// that of the formula PWM_OFS + PWM_GRAD * 256 * fSTEP / fCLK; 0 without StealthChop.
    pub(super) fn pwm_scale(&self, now: Instant) -> u32 {
        if !self.stealthchop(now) {
            return 0;
        }
        let configuration = self.stored(PWMCONF);
        let automatic = configuration >> 18 & 1 == 1;
        if let Some(scale) = self.sense.and_then(|sense| sense.pwm_scale).filter(|_| automatic) {
            return u32::from(scale);
        }
        let (offset, gradient) = (configuration & 0xFF, configuration >> 8 & 0xFF);
        let speed = u64::from(self.ramp.velocity(now).unsigned_abs()) << self.microstep_shift();
        let back_emf = (u64::from(gradient) * 256 * speed) >> 24;
        u32::try_from(u64::from(offset) + back_emf).unwrap_or(255).min(255)
    }
}
