//! Driver of the TMC429 with a TMC26x behind it: motion controller and motor driver of an axis, through
//! their registers.
//!
//! - [`registers`]: addresses and bit fields.
//! - [`parameters`]: what each axis parameter reads and writes.
//! - this file: register access, and the motions.
//!
//! Source: the vendor's open firmware for a sister module, for the order of writes and for what is
//! recomputed when.
//!
//! # Readings
//!
//! - The factor of braking is computed when the maximum acceleration is written, and by the first move to a
//!   position after a rotation. Writing a divisor leaves it as it is.
//! - Speeds of a rotation do not pass V_MAX, which is opened for it.

pub(crate) mod parameters;
pub(crate) mod registers;

use opentmcl_motion::TICKS_PER_SECOND;
use opentmcl_motion::interpolation::Limits;
use opentmcl_motion::ticked::{BrakingFactor, braking_factor};

use crate::axis::{AxisNumber, AxisState};
use crate::board::Board;
use crate::drive::Memory;
use registers::*;

/// The largest speed and acceleration.
const LARGEST: u32 = 2047;

/// Both chips of an axis and the way to them.
pub(crate) struct Chip<'a, B> {
    pub(crate) axis: AxisNumber,
    pub(crate) state: &'a mut Memory,
    pub(crate) board: &'a mut B,
}

impl<B: Board> Chip<'_, B> {
    /// A register of the motion controller, the answer of the driver, or what has been written to one of
    /// the driver's registers.
    pub(crate) fn read(&mut self, address: u8) -> u32 {
        if is_of_driver(address) {
            self.state.written(address)
        } else {
            self.board.read_register(self.axis.get(), address)
        }
    }

    pub(crate) fn write(&mut self, address: u8, value: u32) {
        self.state.note(address, value);
        if is_of_driver(address) {
            let datagram = u32::from(address & 0b111) << DATAGRAM_BITS | value;
            self.board.write_register(self.axis.get(), DRIVER, datagram);
        } else {
            self.board.write_register(self.axis.get(), address, value);
        }
    }

    pub(crate) fn read_field(&mut self, field: Field) -> u32 {
        field.extract(self.read(field.register))
    }

    pub(crate) fn write_field(&mut self, field: Field, value: u32) {
        let before = self.read(field.register);
        self.write(field.register, field.insert(before, value));
    }

    /// The answer of the driver with what is selected in it.
    pub(crate) fn driver_answer(&mut self, selected: u32) -> u32 {
        if self.read_field(RDSEL) != selected {
            self.write_field(RDSEL, selected);
        }
        self.read(DRIVER)
    }

    /// Writes what no parameter sets.
    pub(crate) fn initialize(&mut self) {
        self.state.forget();
        self.write_field(ENABLE_STEP_DIRECTION, 1);
        self.write_field(ENABLE_RIGHT_SWITCHES, 1);
        self.write_field(RAMP_MODE, RAMP_MODE_VELOCITY);
    }

    pub(crate) fn position(&mut self) -> i32 {
        sign_extend(self.read(X_ACTUAL), 24)
    }

    pub(crate) fn set_position(&mut self, position: i32) {
        self.write(X_ACTUAL, position as u32 & 0xFF_FFFF);
    }

    pub(crate) fn target(&mut self) -> i32 {
        sign_extend(self.read(X_TARGET), 24)
    }

    pub(crate) fn velocity(&mut self) -> i32 {
        sign_extend(self.read(V_ACTUAL), 12)
    }

    /// The speed in microsteps per second, away from zero: v * 16 MHz / 2^(16 + PULSE_DIV).
    pub(crate) fn pps(&mut self) -> i32 {
        let scaled = i64::from(self.velocity()) * TICKS_PER_SECOND as i64;
        let divisor = 1 << (16 + self.read_field(PULSE_DIV));
        (scaled / divisor + (scaled % divisor).signum()) as i32
    }

    pub(crate) fn is_positioning(&mut self) -> bool {
        self.read_field(RAMP_MODE) != RAMP_MODE_VELOCITY
    }

    pub(crate) fn position_reached(&mut self) -> bool {
        self.target() == self.position()
    }

    /// Which way the axis is asked to move: the sign of what it has to go, or of the speed.
    fn asked_direction(&mut self) -> i32 {
        if self.is_positioning() {
            self.target().wrapping_sub(self.position())
        } else {
            sign_extend(self.read(V_TARGET), 12)
        }
    }

    /// Whether the axis has a target or a speed to reach.
    pub(crate) fn is_asked_to_move(&mut self) -> bool {
        self.asked_direction() != 0
    }

    /// Whether a limit switch keeps the axis from going on.
    pub(crate) fn is_held_by_switch(&mut self) -> bool {
        let wanted = self.asked_direction();
        let (left, right) = self.limit_switches();
        wanted < 0 && left && self.read_field(DISABLE_STOP_LEFT) == 0
            || wanted > 0 && right && self.read_field(DISABLE_STOP_RIGHT) == 0
    }

    /// Whether the driver tells a stall.
    pub(crate) fn has_stalled(&mut self) -> bool {
        FLAG_STALLED.extract(self.read(DRIVER)) != 0
    }

    /// Left and right, after polarity. The three axes of a chip share a register.
    pub(crate) fn limit_switches(&mut self) -> (bool, bool) {
        let levels = self.read(SWITCHES) >> (2 * (self.axis.get() % 3));
        (levels & 2 != 0, levels & 1 != 0)
    }

    /// Turns with this speed, positive to the right.
    pub(crate) fn rotate(&mut self, axis: &mut AxisState, velocity: i32) {
        self.restore_limits(axis);
        // The mode first: in the positioning modes V_TARGET is the chip's own.
        self.write_field(RAMP_MODE, RAMP_MODE_VELOCITY);
        self.write(V_MAX, LARGEST);
        self.write(V_TARGET, velocity as u32 & 0xFFF);
    }

    /// Moves to a position with the limits set by parameters.
    pub(crate) fn move_to(&mut self, axis: &mut AxisState, position: i32) {
        self.restore_limits(axis);
        if !self.is_positioning() {
            self.compute_braking_factor();
        }
        self.approach(position, self.state.settings.v_max);
    }

    /// Moves to a position with other limits, which hold until the next motion command.
    pub(crate) fn move_to_within(&mut self, axis: &mut AxisState, position: i32, limits: Limits) {
        axis.scaled_limits = true;
        self.write(A_MAX, limits.a_max.min(LARGEST));
        self.compute_braking_factor();
        self.approach(position, limits.v_max);
    }

    fn approach(&mut self, position: i32, v_max: u32) {
        self.write(V_MAX, v_max.min(LARGEST));
        self.write(X_TARGET, position as u32 & 0xFF_FFFF);
        self.write_field(RAMP_MODE, RAMP_MODE_RAMP);
    }

    /// Stops at once, until the next motion command.
    pub(crate) fn stop_hard(&mut self, _: &mut AxisState) {
        self.write_field(RAMP_MODE, RAMP_MODE_VELOCITY);
        self.write(V_TARGET, 0);
        self.write(V_ACTUAL, 0);
    }

    /// Keeps the limit switches from stopping the axis; what to give back afterwards.
    pub(crate) fn suspend_stops(&mut self) -> u32 {
        let stops = self.read(REF_CONF);
        self.write_field(DISABLE_STOP_LEFT, 1);
        self.write_field(DISABLE_STOP_RIGHT, 1);
        stops
    }

    pub(crate) fn restore_stops(&mut self, stops: u32) {
        self.write_field(DISABLE_STOP_LEFT, DISABLE_STOP_LEFT.extract(stops));
        self.write_field(DISABLE_STOP_RIGHT, DISABLE_STOP_RIGHT.extract(stops));
    }

    /// Relates speed and distance for the present acceleration and divisors, so that braking ends on the
    /// target.
    pub(crate) fn compute_braking_factor(&mut self) {
        let (a_max, ramp) = (self.read(A_MAX), self.read_field(RAMP_DIV));
        let factor = braking_factor(a_max, ramp, self.read_field(PULSE_DIV));
        let BrakingFactor { pmul, pdiv } = factor.unwrap_or(BrakingFactor::UNFIT);
        self.write(PMUL_PDIV, u32::from(pmul) << 8 | u32::from(pdiv));
    }

    /// Without motor supply the chips do not take the settings of power-up: speed and acceleration read as
    /// -1 until they are written, and a stop is hard.
    pub(crate) fn leave_half_restored(&mut self) {
        self.state.settings.v_max = u32::MAX;
        self.state.settings.a_max = u32::MAX;
        self.write(A_MAX, LARGEST);
        self.write_field(SOFT_STOP, 0);
    }

    fn restore_limits(&mut self, axis: &mut AxisState) {
        if core::mem::take(&mut axis.scaled_limits) {
            self.write(A_MAX, self.state.settings.a_max.min(LARGEST));
            self.compute_braking_factor();
        }
    }
}

const fn is_of_driver(address: u8) -> bool {
    address >= DRVCTRL && address <= DRVCONF
}
