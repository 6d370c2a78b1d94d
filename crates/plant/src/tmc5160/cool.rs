//! CoolStep of the TMC5160: the arithmetic is in [`crate::coolstep`], here is where it applies.
//!
//! # Readings
//!
//! - Outside the range of speeds for CoolStep the current is IRUN, and the count begins anew.

use opentmcl_motion::Instant;

use super::Tmc5160;
use super::registers::{COOLCONF, IHOLD_IRUN};
use crate::coolstep::Settings;

impl Tmc5160 {
    /// One reading of StallGuard2, as SG_RESULT shows it, while CoolStep is active; otherwise without
    /// effect. Readings for which [`Tmc5160::cool_readings_to_change`] has no answer may be left out.
    pub fn cool_reading(&mut self, sg_result: u16, now: Instant) {
        self.settle(now);
        self.mark(now);
        if self.cool_active(now) {
            self.cool_settings().take(&mut self.cool, sg_result);
        }
    }

    /// After how many readings of this value the current changes; none if it will not.
    pub fn cool_readings_to_change(&self, sg_result: u16) -> Option<u32> {
        self.cool_settings().readings_to_change(&self.cool, sg_result)
    }

    /// CS_ACTUAL of a moving axis.
    pub(super) fn run_current(&self, now: Instant) -> u32 {
        let settings = self.cool_settings();
        match settings.lowered(&self.cool) {
            lowered if lowered > 0 && self.cool_throughout(now) => settings.current - lowered,
            _ => settings.current,
        }
    }

    fn cool_settings(&self) -> Settings {
        Settings { bits: self.stored(COOLCONF), current: self.stored(IHOLD_IRUN) >> 8 & 0x1F }
    }
}
