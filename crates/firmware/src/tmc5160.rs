//! Driver of the TMC5160: the motion controller and motor driver of an axis, through its registers.
//!
//! - [`registers`]: addresses and bit fields.
//! - [`parameters`]: what each axis parameter reads and writes.
//! - this file: register access with a memory of what the chip cannot read back, and the motions.
//!
//! Source: TMC5160 datasheet; the order of writes as in the vendor's open firmware.

pub(crate) mod parameters;
pub(crate) mod registers;

use opentmcl_motion::interpolation::Limits;

use crate::axis::{AxisNumber, AxisState};
use crate::board::Board;
use crate::drive::{Memory, REGISTERS};
use registers::*;

/// The largest value of an acceleration register.
const STRONGEST: u32 = 0xFFFF;

/// One chip and the way to it.
pub(crate) struct Chip<'a, B> {
    pub(crate) axis: AxisNumber,
    pub(crate) state: &'a mut Memory,
    pub(crate) board: &'a mut B,
}

impl<B: Board> Chip<'_, B> {
    /// A register's value, or the value last written if the chip does not give it.
    pub(crate) fn read(&mut self, address: u8) -> u32 {
        let address = address % REGISTERS as u8;
        if is_readable(address) {
            self.board.read_register(self.axis.get(), address)
        } else {
            self.state.written(address)
        }
    }

    pub(crate) fn write(&mut self, address: u8, value: u32) {
        let address = address % REGISTERS as u8;
        self.state.note(address, value);
        self.board.write_register(self.axis.get(), address, value);
    }

    pub(crate) fn read_field(&mut self, field: Field) -> u32 {
        field.extract(self.read(field.register))
    }

    pub(crate) fn write_field(&mut self, field: Field, value: u32) {
        let rest = self.read(field.register);
        self.write(field.register, field.insert(rest, value));
    }

    /// Writes what no parameter sets, with the values of the vendor's open firmware.
    pub(crate) fn initialize(&mut self) {
        self.state.forget();
        for (address, value) in INITIAL {
            self.write(address, value);
        }
    }

    pub(crate) fn position(&mut self) -> i32 {
        self.read(XACTUAL) as i32
    }

    pub(crate) fn set_position(&mut self, position: i32) {
        self.write(XACTUAL, position as u32);
    }

    pub(crate) fn target(&mut self) -> i32 {
        self.read(XTARGET) as i32
    }

    pub(crate) fn encoder_position(&mut self) -> i32 {
        self.read(X_ENC) as i32
    }

    pub(crate) fn velocity(&mut self) -> i32 {
        sign_extend(self.read(VACTUAL), 24)
    }

    pub(crate) fn is_positioning(&mut self) -> bool {
        self.read(RAMPMODE) == RAMPMODE_POSITION
    }

    /// Whether target and actual position are equal.
    pub(crate) fn position_reached(&mut self) -> bool {
        self.read_field(RAMP_STAT_POSITION_REACHED) != 0
    }

    /// Left and right, after swapping and polarity.
    pub(crate) fn limit_switches(&mut self) -> (bool, bool) {
        let status = self.read(RAMP_STAT);
        (RAMP_STAT_STOP_LEFT.extract(status) != 0, RAMP_STAT_STOP_RIGHT.extract(status) != 0)
    }

    /// Keeps the limit switches from stopping the axis; what to give back afterwards.
    pub(crate) fn suspend_stops(&mut self) -> u32 {
        let stops = self.read(SW_MODE);
        self.write_field(STOP_LEFT_ENABLE, 0);
        self.write_field(STOP_RIGHT_ENABLE, 0);
        stops
    }

    pub(crate) fn restore_stops(&mut self, stops: u32) {
        self.write_field(STOP_LEFT_ENABLE, STOP_LEFT_ENABLE.extract(stops));
        self.write_field(STOP_RIGHT_ENABLE, STOP_RIGHT_ENABLE.extract(stops));
    }

    /// Whether the axis stands and will not move by itself: nothing to reach, or held by a switch.
    pub(crate) fn is_at_rest(&mut self) -> bool {
        if self.velocity() != 0 {
            return false;
        }
        let status = self.read(RAMP_STAT);
        EVENT_STOP_SWITCH.extract(status) != 0
            || if self.is_positioning() {
                RAMP_STAT_POSITION_REACHED.extract(status) != 0
            } else {
                RAMP_STAT_VELOCITY_REACHED.extract(status) != 0
            }
    }

    /// Whether the encoder has deviated too far while the axis moves or is about to.
    pub(crate) fn deviates_in_motion(&mut self) -> bool {
        self.read(ENC_STATUS) & ENC_STATUS_DEVIATION != 0 && !self.is_at_rest()
    }

    /// Clocks for which a moving axis is sure not to get slower than it is; none if it will not without a
    /// further command. Braking takes V^2 / (2^8 A) microsteps (V per 2^24 clocks, A per 2^41 clocks^2).
    pub(crate) fn ticks_until_slower(&mut self) -> Option<u64> {
        let (velocity, fastest) = (self.velocity(), self.read(VMAX));
        if velocity.unsigned_abs() > fastest {
            return Some(0);
        }
        let way = match self.read(RAMPMODE) {
            RAMPMODE_POSITION => self.target().wrapping_sub(self.position()),
            RAMPMODE_VELOCITY_POSITIVE => 1,
            _ => -1,
        };
        if way.signum() != velocity.signum() {
            return Some(0);
        }
        if !self.is_positioning() {
            return None;
        }
        let fastest = u64::from(fastest);
        // Those that hold now: an interpolated move has its own.
        let limits = [AMAX, DMAX, D1].map(|address| self.read(address));
        let weakest = limits.into_iter().filter(|&a| a != 0).min().unwrap_or(1);
        let braking = fastest * fastest / 256 / u64::from(weakest) + 1;
        let before_braking = u64::from(way.unsigned_abs()).saturating_sub(braking);
        Some((before_braking << 24).checked_div(fastest).unwrap_or(0))
    }

    /// Clocks for which the speed is sure to stay on the side of a threshold where it is. A changes V by
    /// A / 2^17 per clock; a move begins and ends with a jump.
    pub(crate) fn ticks_until_speed(&mut self, threshold: u32) -> u64 {
        let jump = self.read(VSTART).max(self.read(VSTOP));
        let accelerations = [AMAX, DMAX, A1, D1].map(|address| self.read(address));
        let strongest = accelerations.into_iter().fold(1, u32::max);
        let distance = self.velocity().unsigned_abs().abs_diff(threshold).saturating_sub(jump);
        (u64::from(distance) << 17) / u64::from(strongest)
    }

    /// Stops with the largest deceleration there is, until the next motion command.
    pub(crate) fn stop_hard(&mut self, axis: &mut AxisState) {
        axis.scaled_limits = true;
        self.write(AMAX, STRONGEST);
        self.write(VMAX, 0);
        self.write(RAMPMODE, RAMPMODE_VELOCITY_POSITIVE);
    }

    /// Turns with this speed, positive to the right. Only the maximum acceleration counts.
    pub(crate) fn rotate(&mut self, axis: &mut AxisState, velocity: i32) {
        self.restore_limits(axis);
        self.write(VMAX, velocity.unsigned_abs());
        let mode =
            if velocity > 0 { RAMPMODE_VELOCITY_POSITIVE } else { RAMPMODE_VELOCITY_NEGATIVE };
        self.write(RAMPMODE, mode);
    }

    /// Moves to a position with the limits set by parameters.
    pub(crate) fn move_to(&mut self, axis: &mut AxisState, position: i32) {
        self.restore_limits(axis);
        self.write(VMAX, self.state.settings.v_max);
        self.write(XTARGET, position as u32);
        self.write(RAMPMODE, RAMPMODE_POSITION);
    }

    /// Moves to a position with other limits, which hold until the next motion command.
    pub(crate) fn move_to_within(&mut self, axis: &mut AxisState, position: i32, limits: Limits) {
        axis.scaled_limits = true;
        self.write_limits(limits);
        self.write(VMAX, limits.v_max);
        self.write(XTARGET, position as u32);
        self.write(RAMPMODE, RAMPMODE_POSITION);
    }

    fn restore_limits(&mut self, axis: &mut AxisState) {
        if core::mem::take(&mut axis.scaled_limits) {
            self.write_limits(self.state.settings);
        }
    }

    fn write_limits(&mut self, limits: Limits) {
        self.write(AMAX, limits.a_max);
        self.write(DMAX, limits.d_max);
        self.write(V1, limits.v1);
        self.write(A1, limits.a1);
        self.write(D1, limits.d1);
    }
}
