//! ROR ROL MST MVP and their forms with accumulator and X.

use opentmcl_motion::interpolation::Axes;
use opentmcl_wire::{Opcode, Status};

use super::{Execution, Outcome};
use crate::axis::{AxisNumber, PerAxis};
use crate::board::Board;
use crate::module::Module;

const ABSOLUTE: u8 = 0;
const RELATIVE: u8 = 1;
const COORDINATE: u8 = 2;

/// Bits of the motor field of MVP COORD above the axes.
const WITHOUT_INTERPOLATION: u8 = 0x80;
const WITH_INTERPOLATION: u8 = 0x40;

impl<B: Board> Module<B> {
    /// The axes that a motion command to one axis means: itself, and those with its group index.
    pub(super) fn group(&self, axis: AxisNumber) -> impl Iterator<Item = AxisNumber> + use<B> {
        let index = self.axes[axis].group_index;
        let mut members = axis.bit();
        for other in AxisNumber::all(self.model.axes) {
            if index != 0 && self.axes[other].group_index == index {
                members |= other.bit();
            }
        }
        AxisNumber::all(self.model.axes).filter(move |axis| members & axis.bit() != 0)
    }

    /// Turns with a speed in the axis' units, positive to the right.
    pub(super) fn rotate(&mut self, axis: AxisNumber, speed: i64) -> Execution {
        let row = self.model.target_speed().ok_or(Status::NOT_AVAILABLE)?;
        self.check_range(axis, row, speed)?;
        for axis in self.group(axis) {
            self.write_axis_parameter(axis, row, speed as i32)?;
        }
        Ok(Outcome::Done)
    }

    pub(super) fn stop(&mut self, axis: AxisNumber) -> Execution {
        for axis in self.group(axis) {
            self.begin_motion(axis);
            self.stop_axis(axis);
        }
        Ok(Outcome::Done)
    }

    /// Stops one axis with its ramp and ends its reference search.
    pub(crate) fn stop_axis(&mut self, axis: AxisNumber) {
        self.end_search(axis);
        self.give_up_target(axis);
        let (mut drive, state) = self.drive(axis);
        drive.rotate(state, 0);
        self.touch_guarded(axis);
    }

    pub(super) fn move_to(&mut self, kind: u8, motor: u8, value: i32) -> Execution {
        match kind {
            ABSOLUTE => {
                for axis in self.group(self.axis(motor)?) {
                    self.move_axis(axis, value);
                }
                Ok(Outcome::Done)
            }
            RELATIVE => {
                let asked = self.axis(motor)?;
                let mut reply = value;
                for axis in self.group(asked) {
                    let (mut drive, state) = self.drive(axis);
                    let start = match state.relative_positioning_option {
                        0 => drive.target(),
                        1 => drive.position(),
                        _ => drive.encoder_position(),
                    };
                    // Beyond the range the position wraps, as the chip's counter does.
                    let target = start.wrapping_add(value);
                    self.move_axis(axis, target);
                    if axis == asked {
                        reply = target;
                    }
                }
                Ok(Outcome::Reply(reply))
            }
            // Modules without coordinates have no such type of a move.
            COORDINATE if self.is_known(Opcode::Sco.number()) => {
                self.move_to_coordinate(motor, value)
            }
            _ => Err(Status::WRONG_TYPE),
        }
    }

    fn move_axis(&mut self, axis: AxisNumber, position: i32) {
        self.begin_motion(axis);
        let (mut drive, state) = self.drive(axis);
        drive.move_to(state, position);
        self.give_up_target(axis);
        self.depart(axis, true);
    }

    fn move_to_coordinate(&mut self, motor: u8, coordinate: i32) -> Execution {
        if motor & (WITHOUT_INTERPOLATION | WITH_INTERPOLATION) == 0 {
            let axis = self.axis(motor)?;
            let position = self.coordinate(axis, coordinate)?;
            for axis in self.group(axis) {
                self.move_axis(axis, position);
            }
            return Ok(Outcome::Done);
        }
        let axes = motor & !(WITHOUT_INTERPOLATION | WITH_INTERPOLATION);
        let existing = AxisNumber::all(self.model.axes).fold(0, |mask, axis| mask | axis.bit());
        if axes == 0 || axes & !existing != 0 {
            return Err(Status::INVALID_VALUE);
        }
        let mut targets = PerAxis::new(|| 0);
        for axis in AxisNumber::all(self.model.axes) {
            targets[axis] = self.coordinate(axis, coordinate)?;
        }
        let chosen = AxisNumber::all(self.model.axes).filter(move |axis| axes & axis.bit() != 0);
        if motor & WITH_INTERPOLATION != 0 {
            self.move_together(chosen, &targets);
        } else {
            for axis in chosen {
                self.move_axis(axis, targets[axis]);
            }
        }
        Ok(Outcome::Done)
    }

    /// Moves several axes so that all arrive at the same time, each within its own limits.
    fn move_together(
        &mut self,
        chosen: impl Iterator<Item = AxisNumber> + Clone,
        targets: &PerAxis<i32>,
    ) {
        let mut distances = PerAxis::new(|| 0);
        let mut axes = Axes::default();
        for axis in chosen.clone() {
            let (mut drive, _) = self.drive(axis);
            distances[axis] = targets[axis].wrapping_sub(drive.position()).unsigned_abs();
            axes.add(distances[axis], drive.settings());
        }
        let profile = axes.profile();
        for axis in chosen {
            let limits = profile.for_distance(distances[axis]);
            self.begin_motion(axis);
            let (mut drive, state) = self.drive(axis);
            drive.move_to_within(state, targets[axis], limits);
            self.give_up_target(axis);
            self.depart(axis, true);
        }
    }
}
