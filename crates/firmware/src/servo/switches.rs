//! Reference switches of a TMCM-1636 (parameters 209 to 213).
//!
//! # Readings
//!
//! - The contacts switch the inputs to ground, and pull-ups hold them high otherwise. Bit 0 of parameter 210 makes
//!   the right one active when it is high, bit 1 the left one; the home switch is always active low.
//! - An active right switch stops motion to the right at once, the left one motion to the left. The other direction
//!   stays free.

use opentmcl_catalog::{Foc, Motion};

use super::{Mode, Servo, Surroundings};

/// Bits of parameters 209 and 210.
const RIGHT: i32 = 1 << 0;
const LEFT: i32 = 1 << 1;

/// Which switches are active.
#[derive(Clone, Copy, Debug)]
pub(super) struct Switches {
    pub(super) left: bool,
    pub(super) right: bool,
}

impl Servo {
    pub(super) fn switches(&self, around: &Surroundings) -> Switches {
        let (left, right) = self.active_switches(around.left, around.right);
        Switches { left, right }
    }

    /// Which of the left and the right switch is active, with the contacts closed or not.
    pub(crate) fn active_switches(&self, left: bool, right: bool) -> (bool, bool) {
        let active_high =
            |bit: i32| self.motion == Motion::Foc && self.settings[Foc::SwitchPolarity] & bit != 0;
        (left != active_high(LEFT), right != active_high(RIGHT))
    }

    /// Stops the axis at a switch, each millisecond.
    pub(super) fn step_switches(&mut self, around: &Surroundings) {
        if self.motion != Motion::Foc || self.settings[Foc::SwitchEnable] == 0 {
            return;
        }
        let switches = self.switches(around);
        let enabled = self.settings[Foc::SwitchEnable];
        let direction = self.direction();
        let stops_right = enabled & RIGHT != 0 && switches.right && direction > 0;
        let stops_left = enabled & LEFT != 0 && switches.left && direction < 0;
        if stops_right || stops_left {
            self.turn(0);
            self.speed_ramp.set(0);
            self.wanted_speed = 0;
        }
    }

    /// Where the axis is asked to go: to the right above 0.
    fn direction(&self) -> i64 {
        match self.mode {
            Mode::Stop => 0,
            Mode::Torque => i64::from(self.target_torque),
            Mode::Velocity => i64::from(self.target_velocity),
            Mode::Position => self.internal(self.target_position).saturating_sub(self.position()),
        }
    }
}
