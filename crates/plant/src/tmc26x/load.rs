//! The load measurement, and the current that CoolStep makes of it.
//!
//! # Readings
//!
//! - At standstill, with the bridges off, and without knowledge of a motor there is no measurement: SG is
//!   0 and its flag is not set.
//! - The chip knows no speed below which CoolStep is off, as the TMC5160 does: it works whenever there is a
//!   measurement and SEMIN is not 0. Without a measurement the current is CS, and the count begins anew.
//! - The measurement is what the motor gives at the moment of reading; only CoolStep waits for full steps.

use opentmcl_motion::Instant;

use super::registers::{CS, Register, SEMIN, SGT};
use super::{Sense, Tmc26x};
use crate::coolstep::Settings;
use crate::driver;

impl Tmc26x {
    /// What the driver measures from now on.
    pub fn set_sense(&mut self, sense: Sense, _now: Instant) {
        self.sense = Some(sense);
        self.settle();
    }

    /// The error bits that the driver sees from now on, as in [`Sense`].
    pub(crate) fn set_flags(&mut self, flags: u32, now: Instant) {
        let rest = self.sense.unwrap_or(Sense::IDEAL);
        self.set_sense(Sense { flags, ..rest }, now);
    }

    /// SG for a value before SGT is added.
    pub fn stallguard(&self, raw: u16) -> u16 {
        driver::stallguard(raw, SGT.extract_signed(self.register(Register::SgcsConf)))
    }

    /// The output SG_TST, as the flag SG of a reply: the motor stalls.
    pub fn stalls(&self, _now: Instant) -> bool {
        self.result() == Some(0)
    }

    /// Whether CoolStep regulates the current now.
    pub fn cool_active(&self, _now: Instant) -> bool {
        self.regulates()
    }

    /// One reading of StallGuard2, as SG shows it, while CoolStep is active; otherwise without effect.
    /// Readings for which [`Tmc26x::cool_readings_to_change`] has no answer may be left out.
    pub fn cool_reading(&mut self, sg: u16, _now: Instant) {
        if self.regulates() {
            self.cool_settings().take(&mut self.cool, sg);
        }
    }

    /// After how many readings of this value the current changes; none if it will not.
    pub fn cool_readings_to_change(&self, sg: u16) -> Option<u32> {
        self.cool_settings().readings_to_change(&self.cool, sg)
    }

    /// SG, if there is one.
    pub(super) fn result(&self) -> Option<u16> {
        let sense = self.sense.filter(|_| self.moves() && self.drives())?;
        Some(self.stallguard(sense.stallguard))
    }

    /// SE: the current in 1/32 of full scale, less one.
    pub(super) fn actual_current(&self) -> u32 {
        let settings = self.cool_settings();
        settings.current - settings.lowered(&self.cool)
    }

    pub(super) fn regulates(&self) -> bool {
        self.field(SEMIN) > 0 && self.moves() && self.drives()
    }

    fn cool_settings(&self) -> Settings {
        Settings { bits: self.register(Register::SmartEn), current: self.field(CS) }
    }
}
