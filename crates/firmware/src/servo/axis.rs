//! The servo axis as one of the things that can move an axis ([`crate::drive::Drive`]).

use opentmcl_motion::interpolation::Limits;
use opentmcl_wire::Instant;

use super::{SERVO_AXIS, Servo};
use crate::axis::AxisState;
use crate::board::Board;

/// The regulators and the way to their hardware.
pub(crate) struct Axis<'a, B> {
    pub(crate) servo: &'a mut Servo,
    pub(crate) board: &'a mut B,
    pub(crate) now: Instant,
}

impl<B: Board> Axis<'_, B> {
    /// Everything has its default from the catalogue.
    pub(crate) fn initialize(&mut self) {}

    pub(crate) fn position(&mut self) -> i32 {
        self.servo.counts()
    }

    pub(crate) fn set_position(&mut self, position: i32) {
        self.servo.wake(self.now);
        self.servo.set_position(position);
    }

    pub(crate) fn target(&mut self) -> i32 {
        self.servo.target()
    }

    pub(crate) fn velocity(&mut self) -> i32 {
        self.servo.rpm()
    }

    pub(crate) fn position_reached(&mut self) -> bool {
        self.servo.has_arrived()
    }

    /// Levels of the left and the right limit switch.
    pub(crate) fn limit_switches(&mut self) -> (bool, bool) {
        let (left, right) = self.board.limit_switches(SERVO_AXIS);
        self.servo.active_switches(left, right)
    }

    pub(crate) fn rotate(&mut self, _: &mut AxisState, velocity: i32) {
        self.servo.wake(self.now);
        if velocity == 0 {
            self.servo.stop();
        } else {
            self.servo.rotate(velocity);
        }
    }

    pub(crate) fn move_to(&mut self, _: &mut AxisState, position: i32) {
        self.servo.wake(self.now);
        self.servo.move_to(position);
    }

    /// One axis alone arrives together with itself.
    pub(crate) fn move_to_within(&mut self, axis: &mut AxisState, position: i32, _: Limits) {
        self.move_to(axis, position);
    }

    pub(crate) fn stop_hard(&mut self, _: &mut AxisState) {
        self.servo.wake(self.now);
        self.servo.stop();
    }

    /// No command suspends the stops of a servo axis.
    pub(crate) fn suspend_stops(&mut self) -> u32 {
        0
    }

    pub(crate) fn restore_stops(&mut self, _: u32) {}
}
