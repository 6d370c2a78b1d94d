//! CoolStep: the current follows the load.
//!
//! Source: datasheet, chapter 14. Each reading of StallGuard2 below SEMIN * 32 raises the current by
//! SEUP, up to IRUN. Readings of (SEMIN + SEMAX + 1) * 32 and more are counted, and every 32nd, 8th, 2nd or
//! each (SEDN) lowers it by one step, down to a half or a quarter (SEIMIN).
//!
//! # Readings
//!
//! - A half of IRUN is (IRUN + 1) / 2 - 1, rounded down and at least 0; a quarter likewise.
//! - Readings between the limits, and those that cannot change the current, leave the count as it is.
//! - Outside the range of speeds for CoolStep the current is IRUN, and the count begins anew.

use opentmcl_motion::Instant;

use super::Tmc5160;
use super::registers::{COOLCONF, IHOLD_IRUN};

/// What CoolStep has done to the current.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Cool {
    /// Steps below IRUN.
    lowered: u32,
    /// Readings counted for the next step down.
    counted: u32,
}

impl Cool {
    pub(super) fn release(&mut self) {
        *self = Self::default();
    }
}

/// What a reading asks for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Demand {
    More,
    Less,
    Nothing,
}

impl Tmc5160 {
    /// One reading of StallGuard2, as SG_RESULT shows it, while CoolStep is active; otherwise without
    /// effect. Readings for which [`Tmc5160::cool_readings_to_change`] has no answer may be left out.
    pub fn cool_reading(&mut self, sg_result: u16, now: Instant) {
        self.settle(now);
        self.mark(now);
        if !self.cool_active(now) {
            return;
        }
        match self.demand(sg_result) {
            Demand::Nothing => {}
            Demand::More => {
                let step = 1 << (self.stored(COOLCONF) >> 5 & 0b11);
                self.cool = Cool { lowered: self.lowered().saturating_sub(step), counted: 0 };
            }
            Demand::Less => {
                self.cool.counted += 1;
                if self.cool.counted >= self.readings_per_step() {
                    self.cool = Cool { lowered: self.lowered() + 1, counted: 0 };
                }
            }
        }
    }

    /// After how many readings of this value the current changes; none if it will not.
    pub fn cool_readings_to_change(&self, sg_result: u16) -> Option<u32> {
        match self.demand(sg_result) {
            Demand::Nothing => None,
            Demand::More => Some(1),
            Demand::Less => Some(self.readings_per_step().saturating_sub(self.cool.counted).max(1)),
        }
    }

    /// CS_ACTUAL of a moving axis.
    pub(super) fn run_current(&self, now: Instant) -> u32 {
        match self.lowered() {
            lowered if lowered > 0 && self.cool_throughout(now) => self.irun() - lowered,
            _ => self.irun(),
        }
    }

    fn demand(&self, sg_result: u16) -> Demand {
        let (semin, semax) = (self.stored(COOLCONF) & 0xF, self.stored(COOLCONF) >> 8 & 0xF);
        let reading = u32::from(sg_result);
        if reading < semin * 32 && self.lowered() > 0 {
            Demand::More
        } else if reading >= (semin + semax + 1) * 32 && self.lowered() < self.lowest() {
            Demand::Less
        } else {
            Demand::Nothing
        }
    }

    fn readings_per_step(&self) -> u32 {
        match self.stored(COOLCONF) >> 13 & 0b11 {
            0 => 32,
            1 => 8,
            2 => 2,
            _ => 1,
        }
    }

    fn irun(&self) -> u32 {
        self.stored(IHOLD_IRUN) >> 8 & 0x1F
    }

    /// The steps below IRUN, as far as the present settings allow them.
    fn lowered(&self) -> u32 {
        self.cool.lowered.min(self.lowest())
    }

    /// The most steps below IRUN.
    fn lowest(&self) -> u32 {
        let part = if self.stored(COOLCONF) >> 15 & 1 == 1 { 4 } else { 2 };
        self.irun() - ((self.irun() + 1) / part).saturating_sub(1)
    }
}
