//! What the motion controller does at the pins STEP and DIR.
//!
//! # Readings
//!
//! - With DEDGE each pulse is two microsteps, one for each edge.
//! - A resolution above 8 counts as 8, full steps. Another resolution leaves MSTEP where it is.
//! - Interpolation (INTPOL) makes the motor run smoother, not elsewhere: MSTEP shows no steps between pulses.
//! - STST follows the pin: in SPI mode (SDOFF) as well, in which the pulses do nothing else.
//! - An axis that creeps with less than one pulse in 2^20 clocks does not count as standing.

use core::num::NonZeroU64;

use opentmcl_motion::Instant;

use super::Tmc26x;
use super::registers::{DEDGE, MRES, SDOFF, SFILT};
use crate::driver::STANDSTILL;

/// Microsteps of an electrical period at the highest resolution.
const PERIOD: i64 = 1024;

/// Binary logarithm of the microsteps of a full step at the highest resolution.
const FULL_STEP_SHIFT: u32 = 8;

/// Binary logarithm of the clocks in which a rate is counted.
const RATE_SHIFT: u32 = 37;

/// Whether step pulses come in.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Motion {
    /// None since the last one.
    Standing {
        /// When that was.
        since: Instant,
    },
    /// A steady stream of them.
    Moving {
        /// Pulses in 2^37 clocks, in either direction. With that the speeds of a TMC429 are whole numbers:
        /// v is v * 2^(21 - PULSE_DIV).
        rate: NonZeroU64,
    },
}

impl Tmc26x {
    /// How pulses come in from now on.
    pub fn set_motion(&mut self, motion: Motion, _now: Instant) {
        self.motion = motion;
        self.settle();
    }

    /// So many pulses have come in since this was told last; negative ones turn back.
    ///
    /// This moves MSTEP alone: whether the axis moves says [`Tmc26x::set_motion`].
    pub fn step(&mut self, pulses: i32) {
        let fine_steps = i64::from(pulses) * self.fine_steps_per_pulse();
        self.mstep = (self.mstep + fine_steps).rem_euclid(PERIOD);
    }

    /// Clocks between two readings of StallGuard2 at the present speed: one full step, four with the
    /// filter (SFILT). None at standstill.
    pub fn reading_interval(&self, _now: Instant) -> Option<u64> {
        let Motion::Moving { rate } = self.motion else { return None };
        if !self.heeds_pulses() {
            return None;
        }
        let full_steps: u128 = if self.field(SFILT) == 1 { 4 } else { 1 };
        let microsteps = full_steps << (FULL_STEP_SHIFT - self.resolution());
        let rate = u128::from(rate.get()) * self.microsteps_per_pulse().unsigned_abs() as u128;
        let clocks = (microsteps << RATE_SHIFT) / rate;
        Some(u64::try_from(clocks).unwrap_or(u64::MAX).max(1))
    }

    /// When STST is next set without another pulse; none if it is set already, and while the axis moves.
    pub fn next_event(&self, now: Instant) -> Option<Instant> {
        let clocks = self.standing(now)?;
        let left = STANDSTILL.checked_sub(clocks).filter(|left| *left > 0)?;
        Some(Instant::from_ticks(now.as_ticks().saturating_add(left)))
    }

    /// Whether the motor is asked to turn.
    pub(super) fn moves(&self) -> bool {
        self.heeds_pulses() && matches!(self.motion, Motion::Moving { .. })
    }

    /// STST.
    pub(super) fn stands(&self, now: Instant) -> bool {
        self.standing(now).is_some_and(|clocks| clocks >= STANDSTILL)
    }

    /// Clocks since the last pulse, or since power-up if there has been none; none while they come.
    fn standing(&self, now: Instant) -> Option<u64> {
        let Motion::Standing { since } = self.motion else { return None };
        let since = since.as_ticks().max(self.powered_at.as_ticks());
        Some(now.as_ticks().saturating_sub(since))
    }

    /// Whether pulses mean anything to the sequencer.
    fn heeds_pulses(&self) -> bool {
        self.field(SDOFF) == 0
    }

    fn microsteps_per_pulse(&self) -> i64 {
        1 + i64::from(self.field(DEDGE))
    }

    /// By how many 1/256 steps a pulse turns the field.
    pub(crate) fn fine_steps_per_pulse(&self) -> i64 {
        if self.heeds_pulses() { self.microsteps_per_pulse() << self.resolution() } else { 0 }
    }

    /// Binary logarithm of the 1/256 steps in one microstep.
    fn resolution(&self) -> u32 {
        self.field(MRES).min(FULL_STEP_SHIFT)
    }
}
