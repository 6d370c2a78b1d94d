//! Motion commands of a servo axis.
//!
//! # Readings
//!
//! - While the bridge may not be on, be it without commutation or without supply, a motion command is accepted and
//!   has no effect, as in open firmware for a sister module; the flags tell why. So is a torque in open loop, where
//!   nothing regulates it.

use opentmcl_catalog::{Foc, Motion, Servo as Shared};
use opentmcl_motion::servo::{PERIODS_PER_SECOND, saturated};

use super::init::Forced;
use super::sensors::TURN;
use super::slow::RPM;
use super::{Mode, Servo};

impl Servo {
    /// Turns with a speed in revolutions per minute.
    pub(crate) fn rotate(&mut self, velocity: i32) {
        if self.is_ready() {
            self.turn(velocity);
        }
    }

    /// As [`Servo::rotate`], whoever asks for it.
    pub(super) fn turn(&mut self, velocity: i32) {
        self.set_mode(Mode::Velocity);
        self.target_velocity = velocity;
    }

    /// Moves to a position in the unit of the parameters.
    pub(crate) fn move_to(&mut self, position: i32) {
        if self.is_ready() {
            self.status.reached = false;
            self.set_mode(Mode::Position);
            self.target_position = position;
        }
    }

    /// Gives a torque, as a current in mA.
    pub(super) fn pull(&mut self, torque: i32) {
        if self.is_ready() && !self.is_open_loop() {
            self.set_mode(Mode::Torque);
            self.target_torque = torque;
        }
    }

    /// Stops with the ramp.
    pub(crate) fn stop(&mut self) {
        self.target_velocity = 0;
        if self.is_ready() {
            self.turn(0);
        }
    }

    /// Another mode begins where the motor is.
    pub(super) fn set_mode(&mut self, mode: Mode) {
        if mode == self.mode {
            return;
        }
        self.mode = mode;
        self.status.reached = false;
        if mode == Mode::Stop {
            self.target_velocity = 0;
            self.wanted_speed = 0;
        }
    }

    /// The position counter takes a value; the motor does not move.
    pub(crate) fn set_position(&mut self, position: i32) {
        let internal = self.internal(position);
        self.sensors.set_position(self.position_source(), self.reading.pole_pairs, internal);
        self.status.reached = false;
        if self.mode == Mode::Position {
            self.target_position = position;
        }
        self.position_ramp.set(saturated(internal), self.position_ramp.speed());
    }

    /// The position in the unit of the parameters.
    pub(crate) fn counts(&self) -> i32 {
        self.external(self.position())
    }

    /// The last target.
    pub(crate) fn target(&self) -> i32 {
        self.target_position
    }

    /// Revolutions per minute, in the unit of the parameters.
    pub(crate) fn rpm(&self) -> i32 {
        self.counted_speed(self.speed())
    }

    /// Whether the target of a move has been reached.
    pub(crate) fn has_arrived(&self) -> bool {
        self.mode == Mode::Position && self.status.reached
    }

    /// Whether the shaft turns.
    pub(crate) fn is_moving(&self) -> bool {
        let halted = self.settings[Shared::HaltedVelocity].max(1);
        self.counted_rpm() >= halted.unsigned_abs()
    }

    /// Program memory is filled, or no more: the bridge is off meanwhile.
    pub(crate) fn set_downloading(&mut self, on: bool) {
        self.status.downloading = on;
        if on {
            self.set_mode(Mode::Stop);
        }
        self.update_enabled();
    }

    /// Regulators and speed measurement begin anew (parameter 31).
    pub(super) fn reinitialize(&mut self) {
        self.set_mode(Mode::Stop);
        self.status.driver_spi = false;
        self.torque.reset();
        self.velocity.reset();
        self.sensors.restart_tachometer(self.encoder_steps(), self.reading.pole_pairs);
        self.update_enabled();
    }

    /// Another commutation (parameter 15).
    pub(super) fn set_commutation(&mut self, mode: i32) {
        let position = self.position();
        self.settings[Foc::CommutationMode] = mode;
        self.take_sensors(position);
        self.set_mode(Mode::Stop);
        self.begin_init();
        self.update_enabled();
    }

    /// The field turns by itself if it has to.
    #[inline]
    pub(super) fn turn_open_loop(&mut self) {
        let speed = match self.init.forced() {
            Some(Forced::OpenLoop) => self.shaft_speed(self.settings[Foc::EncoderInitVelocity]),
            None if self.is_open_loop() => self.speed_ramp.speed(),
            _ => return,
        };
        if speed != 0 {
            let per_second = i64::from(speed) * i64::from(self.reading.pole_pairs);
            // 1/65536 of an angle's unit in a period: 60 s and 256 parts of a revolution per minute.
            let divisor = i64::from(60 * PERIODS_PER_SECOND) * i64::from(RPM);
            self.sensors.open_loop =
                self.sensors.open_loop.wrapping_add(per_second * (TURN * TURN) / divisor);
        }
    }

    /// The null channel of the encoder has been passed.
    pub(super) fn pass_null(&mut self) {
        if self.motion != Motion::Foc {
            return;
        }
        let counts = self.senses.encoder.wrapping_sub(self.senses.index_latch) as i16;
        let reversed = self.reading.encoder_reversed != self.reading.mirrored;
        let counts = if reversed { -i32::from(counts) } else { i32::from(counts) };
        self.end_search_for_null(counts);
        if self.settings[Foc::ClearOnNull] != 0 {
            let turned = i64::from(counts) * TURN / i64::from(self.encoder_steps());
            let external = self.external(turned);
            self.set_position(external);
            if self.settings[Foc::ClearOnce] != 0 {
                self.settings[Foc::ClearOnNull] = 0;
            }
        }
    }
}
