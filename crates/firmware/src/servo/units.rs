//! The unit of speeds (parameter 27): revolutions of the shaft or of the field of a TMCM-1636.
//!
//! # Readings
//!
//! - The unit is that of all speeds in revolutions per minute, read or written, and of accelerations, which are
//!   such speeds in a second. What has been set keeps its number when the unit changes.

use opentmcl_catalog::{Foc, Motion};
use opentmcl_motion::servo::saturated;

use super::Servo;
use super::slow::RPM;

impl Servo {
    /// Revolutions of what the speeds count in a turn of the shaft.
    fn counted_turns(&self) -> i64 {
        if self.motion == Motion::Foc && self.settings[Foc::VelocityUnit] != 0 {
            i64::from(self.reading.pole_pairs.max(1))
        } else {
            1
        }
    }

    /// A speed of the shaft in 1/256 revolution per minute, from one in the unit of the parameters.
    #[inline]
    pub(super) fn shaft_speed(&self, speed: i32) -> i32 {
        saturated(i64::from(speed) * i64::from(RPM) / self.counted_turns())
    }

    /// A speed or an acceleration of the shaft in revolutions per minute (and second), from one in the unit of the
    /// parameters; at least 1 unless it is 0.
    pub(super) fn shaft_limit(&self, limit: i32) -> u32 {
        let limit = i64::from(limit.unsigned_abs());
        let least = limit.min(1);
        (limit / self.counted_turns()).max(least) as u32
    }

    /// A speed in the unit of the parameters, rounded, from one of the shaft in 1/256 revolution per minute.
    pub(super) fn counted_speed(&self, speed: i32) -> i32 {
        let speed = i64::from(speed) * self.counted_turns();
        saturated((speed + i64::from(RPM / 2)).div_euclid(i64::from(RPM)))
    }

    /// How fast the shaft turns in the unit of the parameters, rounded down.
    pub(super) fn counted_rpm(&self) -> u32 {
        let speed = i64::from(self.speed().unsigned_abs()) * self.counted_turns();
        (speed / i64::from(RPM)).min(i64::from(u32::MAX)) as u32
    }
}
