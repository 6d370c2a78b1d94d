//! What the driver does with the coils, and what makes it let go of them.
//!
//! # Readings
//!
//! - IHOLD = 0 without freewheeling is 1/32 of full scale, as the scale of the currents says.
//! - Freewheeling and shorted coils need IHOLD = 0, StealthChop, and a power-down that has ended
//!   (firmware manual 6.8).
//! - A short to ground of a driver that is switched on latches: the driver is off until TOFF is 0 or
//!   DRV_ENN takes it off. After that it tries again. A shut-down sets GSTAT bit 1.

use opentmcl_motion::Instant;

use super::current::Currents;
use super::registers::{CHOPCONF, GLOBAL_SCALER, GSTAT, IHOLD_IRUN, PWMCONF, TPOWERDOWN};
use super::{Coils, Tmc5160};
use crate::driver::{OVERTEMPERATURE, SHORTS};

const DRIVER_ERROR: u32 = 1 << 1;

impl Tmc5160 {
    /// What the driver does with the coils.
    pub fn coils(&self, now: Instant) -> Coils {
        let overheated = self.sense.is_some_and(|sense| sense.flags & OVERTEMPERATURE != 0);
        if !self.is_switched_on() || overheated || self.shorts != 0 {
            return Coils::Off;
        }
        let rests = self.standing(now).is_some_and(|clocks| self.currents().rests(clocks));
        if rests && self.stealthchop(now) {
            match self.freewheel() {
                0 => {}
                1 => return Coils::Off,
                _ => return Coils::Shorted,
            }
        }
        let global = match self.stored(GLOBAL_SCALER) {
            0 => 256,
            scaler => scaler as u16,
        };
        Coils::Driven { scale: self.actual_current(now) as u8 + 1, global }
    }

    /// When [`Tmc5160::coils`] next changes by itself while the axis stands: with a step of the
    /// power-down or its end. None while it moves, and if nothing is to come.
    pub fn next_coil_change(&self, now: Instant) -> Option<Instant> {
        let standing = self.standing(now)?;
        let next = self.currents().next_change(standing, self.freewheel() != 0)?;
        Some(Instant::from_ticks(now.as_ticks().saturating_add(next - standing)))
    }

    /// Pin DRV_ENN, with `true` for a driver that may switch: safe torque off takes it away.
    pub fn set_enabled(&mut self, enabled: bool, now: Instant) {
        self.settle(now);
        self.enabled = enabled;
        self.notice_faults();
    }

    /// CS_ACTUAL.
    pub(super) fn actual_current(&self, now: Instant) -> u32 {
        match self.standing(now) {
            Some(clocks) => self.currents().actual(Some(clocks)),
            None => self.run_current(now),
        }
    }

    /// Latches a short, or forgets it with the driver off. To be called when one of the two changes.
    pub(super) fn notice_faults(&mut self) {
        let flags = self.sense.map_or(0, |sense| sense.flags);
        if !self.is_switched_on() {
            self.shorts = 0;
            return;
        }
        self.shorts |= flags & SHORTS;
        if self.shorts != 0 || flags & OVERTEMPERATURE != 0 {
            self.store(GSTAT, self.stored(GSTAT) | DRIVER_ERROR);
        }
    }

    fn is_switched_on(&self) -> bool {
        self.enabled && self.stored(CHOPCONF) & 0xF != 0
    }

    fn freewheel(&self) -> u32 {
        self.stored(PWMCONF) >> 20 & 0b11
    }

    fn currents(&self) -> Currents {
        Currents::new(self.stored(IHOLD_IRUN), self.stored(TPOWERDOWN))
    }
}
