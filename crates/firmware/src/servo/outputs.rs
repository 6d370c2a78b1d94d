//! The outputs beside the bridge: holding brake and brake chopper.

use opentmcl_catalog::{Foc, Motion};

use super::Servo;

/// The output for the holding brake.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(super) struct Brake {
    /// Duty, 0..=255.
    pub(super) duty: u8,
    /// Milliseconds since the brake was released, as far as they count.
    released: i32,
}

impl Servo {
    /// The brake output, each millisecond: pulled in with one duty, then held with another.
    pub(super) fn step_brake(&mut self) {
        if self.motion != Motion::Foc {
            return;
        }
        if self.settings[Foc::BrakeRelease] == 0 {
            self.brake.released = 0;
        }
        let percent = if self.settings[Foc::BrakeEnable] == 0 {
            0
        } else {
            let percent = if self.settings[Foc::BrakeRelease] == 0 {
                0
            } else if self.brake.released < self.settings[Foc::BrakePullInTime] {
                self.brake.released += 1;
                self.settings[Foc::BrakePullInDuty]
            } else {
                self.settings[Foc::BrakeHoldDuty]
            };
            if self.settings[Foc::BrakeInvert] != 0 { 100 - percent } else { percent }
        };
        self.brake.duty = (percent.clamp(0, 100) * 255 / 100) as u8;
    }

    /// Whether the duty of the brake output will change by itself.
    pub(super) fn brake_moves(&self) -> bool {
        self.motion == Motion::Foc
            && self.settings[Foc::BrakeRelease] != 0
            && self.settings[Foc::BrakeEnable] != 0
            && self.brake.released < self.settings[Foc::BrakePullInTime]
    }

    /// Whether the brake chopper is on: from its limit on, until the supply is below the hysteresis again.
    #[inline]
    pub(super) fn chops(&self) -> bool {
        if self.motion != Motion::Foc || self.settings[Foc::ChopperEnable] == 0 {
            return false;
        }
        let supply = i32::from(self.senses.supply);
        let limit = self.settings[Foc::ChopperLimit] * 10;
        if self.power.chopper {
            supply >= limit - self.settings[Foc::ChopperHysteresis] * 10
        } else {
            supply > limit
        }
    }
}
