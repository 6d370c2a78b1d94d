//! What the driver does with the coils, and what makes it let go of them.
//!
//! # Readings
//!
//! - A short to ground of a driver that is switched on latches: the driver is off until TOFF is 0 or the
//!   enable pin takes it off. After that it tries again. While it is off, and with DISS2G, it sees no short.
//! - Both bridges go off with a short in one of them.
//! - Overtemperature takes the driver off as long as it lasts.
//! - Full scale with VSENSE is 165/310 of that without: 136/256.
//! - Open load is told only while the motor turns; at standstill the chip cannot see it.

use opentmcl_motion::Instant;

use super::registers::{DISS2G, OLA, OLB, TOFF, VSENSE};
use super::{Coils, Sense, Tmc26x};
use crate::driver::{OVERTEMPERATURE, SHORTS};

/// Full scale of the sense voltage in mV, without and with VSENSE.
const SENSE_VOLTAGES: [u16; 2] = [310, 165];

/// What VSENSE leaves of full scale, in 1/256.
pub const LOW_SENSE_VOLTAGE: u16 = 256 * SENSE_VOLTAGES[1] / SENSE_VOLTAGES[0];

/// Flags of a reply stand in the same order as in [`Sense::flags`], 24 bits below.
const FLAGS_SHIFT: u32 = 24;

impl Tmc26x {
    /// What the driver does with the coils. It changes with what is told to the chip, never by itself.
    pub fn coils(&self, _now: Instant) -> Coils {
        if !self.drives() {
            return Coils::Off;
        }
        let global = if self.field(VSENSE) == 1 { LOW_SENSE_VOLTAGE } else { 256 };
        Coils::Driven { scale: self.actual_current() as u8 + 1, global }
    }

    /// Pin ENN, with `true` for a driver that may switch.
    pub fn set_enabled(&mut self, enabled: bool, _now: Instant) {
        self.enabled = enabled;
        self.settle();
    }

    /// Whether current flows.
    pub(super) fn drives(&self) -> bool {
        self.is_switched_on() && self.shorts == 0 && self.senses() & OVERTEMPERATURE == 0
    }

    /// Latches a short, or forgets it with the driver off.
    pub(super) fn notice_faults(&mut self) {
        if !self.is_switched_on() {
            self.shorts = 0;
        } else if self.field(DISS2G) == 0 {
            self.shorts |= self.senses() & SHORTS;
        }
    }

    /// Bits 1 to 6 of a reply.
    pub(super) fn fault_flags(&self) -> u32 {
        let flags = (self.senses() & !SHORTS | self.shorts) >> FLAGS_SHIFT;
        if self.moves() { flags } else { flags & !(OLA | OLB) }
    }

    fn is_switched_on(&self) -> bool {
        self.enabled && self.field(TOFF) != 0
    }

    fn senses(&self) -> u32 {
        self.sense.map_or(0, |sense| sense.flags & Sense::FLAGS)
    }
}
