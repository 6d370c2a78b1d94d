//! Speed and position: targets, ramps and their regulators.

use opentmcl_catalog::{Block, Foc, Motion, Servo as Shared};
use opentmcl_motion::servo::pi::Gains;
use opentmcl_motion::servo::ramp::braking_speed;
use opentmcl_motion::servo::saturated;
use opentmcl_motion::servo::transform::Dq;

use super::sensors::{Source, TURN};
use super::{Mode, Servo, TICKS_PER_SECOND};

/// The regulators of the speed calculate in 1/256 revolution per minute.
pub(super) const RPM: i32 = 256;

/// No speed is farther from its target than this, in 1/256 revolution per minute of the field.
const LARGEST_ERROR: i64 = 1 << 30;

impl Servo {
    /// Speed and position regulator: the torque that is asked for, in the unit of the current regulators, which is
    /// so many `milliamps`. `field_turns` are those for a turn of the shaft.
    // With constant units there is no division left in it.
    #[inline(always)]
    pub(super) fn regulate_speed(&mut self, field_turns: u32, milliamps: i32) {
        let limit = self.settings[Shared::MaxCurrent] / milliamps;
        let q = match self.mode {
            Mode::Stop => {
                self.rest_velocity();
                0
            }
            Mode::Torque => {
                self.rest_velocity();
                self.target_torque / milliamps
            }
            // The field turns by itself and takes the rotor along.
            _ if self.is_open_loop() => {
                let flux = if self.speed_ramp.speed() != 0 { self.open_loop_current() } else { 0 };
                self.demand = Dq { d: flux, q: 0 };
                return;
            }
            Mode::Velocity | Mode::Position => {
                if self.mode == Mode::Position {
                    self.regulate_position();
                }
                let wanted = i64::from(self.wanted_speed) + self.velocity_offset();
                let error = wanted - i64::from(self.filtered_speed());
                self.velocity_error = saturated(error);
                let error = error * i64::from(field_turns) / i64::from(self.integral_divisor());
                let error = error.clamp(-LARGEST_ERROR, LARGEST_ERROR) as i32;
                let gains = self.velocity_gains();
                let output = self.velocity.step(gains, error, 0, limit.saturating_mul(RPM));
                output / RPM
            }
        };
        self.demand.q = (q + self.torque_offset() / milliamps).clamp(-limit, limit);
        self.demand.d = (self.target_flux / milliamps).clamp(-limit, limit);
    }

    /// Nobody asks for a speed: the regulator begins anew with the present one.
    fn rest_velocity(&mut self) {
        self.velocity.reset();
        self.smoothed_speed = i64::from(self.speed()) << 8;
    }

    /// The measured speed, smoothed by parameter 46 of a TMCM-1636: with n the difference to the present speed falls
    /// by 1/2^n in each run of the regulator.
    fn filtered_speed(&mut self) -> i32 {
        let speed = self.speed();
        if self.motion != Motion::Foc {
            return speed;
        }
        // 8 more bits, so that no difference is too small to be taken in.
        let difference = (i64::from(speed) << 8) - self.smoothed_speed;
        self.smoothed_speed += difference >> self.settings[Foc::VelocityFilter].clamp(0, 8);
        (self.smoothed_speed >> 8) as i32
    }

    /// By how much the integral gain of the speed is smaller than the usual 1/65536 for each run. The regulator of
    /// a TMCM-1613 runs ten times as often as that of a TMCM-1636.
    fn integral_divisor(&self) -> i32 {
        if self.motion == Motion::Block { 4 } else { 1 }
    }

    /// Of errors divided by [`Servo::integral_divisor`].
    pub(super) fn velocity_gains(&self) -> Gains {
        let p = self.settings[Shared::VelocityP].saturating_mul(self.integral_divisor());
        Gains { p, i: self.settings[Shared::VelocityI] }
    }

    /// The speed that the position regulator asks for, within the limits.
    fn regulate_position(&mut self) {
        let distance = self.ramp_target().saturating_sub(self.position());
        self.position_error = saturated(distance);
        let gain = i64::from(self.settings[Shared::PositionP]);
        let by_distance = distance.saturating_mul(gain) / 256;
        let limit = self.speed_limit();
        self.wanted_speed = if self.position_ramp_is_on() {
            let speed = by_distance.saturating_add(self.fed_forward());
            speed.clamp(-limit, limit) as i32
        } else {
            self.approach = by_distance.clamp(-limit, limit) as i32;
            if self.ramp_is_on() { self.speed_ramp.speed() } else { self.approach }
        };
    }

    /// The position that the regulator follows.
    fn ramp_target(&self) -> i64 {
        if self.position_ramp_is_on() {
            i64::from(self.position_ramp.position())
        } else {
            self.internal(self.target_position)
        }
    }

    fn fed_forward(&self) -> i64 {
        let on = self.motion == Motion::Foc && self.settings[Foc::VelocityFeedForward] != 0;
        if on { i64::from(self.position_ramp.speed()) } else { 0 }
    }

    /// Largest speed in 1/256 revolution per minute.
    fn speed_limit(&self) -> i64 {
        i64::from(self.shaft_speed(self.settings[Shared::MaxVelocity]))
    }

    pub(super) fn ramp_is_on(&self) -> bool {
        self.settings[Shared::RampEnable] != 0
    }

    /// A TMCM-1636 moves a position along a ramp and follows it; a TMCM-1613 sends the speed that its position
    /// regulator asks for through the ramp of the velocity mode.
    pub(super) fn position_ramp_is_on(&self) -> bool {
        self.motion == Motion::Foc && self.ramp_is_on()
    }

    /// The ramps, each millisecond.
    pub(super) fn step_ramps(&mut self) {
        let acceleration = self.shaft_limit(self.settings[Shared::Acceleration]);
        let limit = self.settings[Shared::MaxVelocity];
        let actual = saturated(self.position());
        match self.mode {
            Mode::Stop | Mode::Torque => {
                self.speed_ramp.set(self.speed());
                self.position_ramp.set(actual, self.speed());
            }
            Mode::Velocity => {
                let target = self.shaft_speed(self.target_velocity.clamp(-limit, limit));
                if self.ramp_is_on() {
                    self.speed_ramp.step(target, acceleration, TICKS_PER_SECOND);
                } else {
                    self.speed_ramp.set(target);
                }
                self.wanted_speed = self.speed_ramp.speed();
                self.position_ramp.set(actual, self.wanted_speed);
            }
            Mode::Position if self.position_ramp_is_on() => {
                let (target, limit) =
                    (self.internal(self.target_position), self.shaft_limit(limit));
                let turn = TURN as u32;
                let target = saturated(target);
                self.position_ramp.step(target, limit, acceleration, turn, TICKS_PER_SECOND);
                self.speed_ramp.set(self.position_ramp.speed());
            }
            Mode::Position if self.ramp_is_on() => {
                let distance = self.internal(self.target_position).saturating_sub(self.position());
                let braking = braking_speed(distance.unsigned_abs(), acceleration, TURN as u32);
                let braking = braking.min(i32::MAX as u32) as i32;
                let target = self.approach.clamp(-braking, braking);
                self.speed_ramp.step(target, acceleration, TICKS_PER_SECOND);
            }
            Mode::Position => {
                self.speed_ramp.set(self.wanted_speed);
                self.position_ramp.set(actual, self.wanted_speed);
            }
        }
    }

    fn velocity_offset(&self) -> i64 {
        match self.motion {
            Motion::Foc => i64::from(self.shaft_speed(self.settings[Foc::VelocityOffset])),
            _ => 0,
        }
    }

    fn torque_offset(&self) -> i32 {
        if self.motion == Motion::Foc { self.settings[Foc::TorqueOffset] } else { 0 }
    }

    /// Actual speed in 1/256 revolution per minute, filtered.
    #[inline]
    pub(super) fn speed(&self) -> i32 {
        if self.velocity_source() == Source::OpenLoop {
            return self.speed_ramp.speed();
        }
        self.sensors.speed()
    }

    /// Actual position in 1/65536 turn.
    pub(super) fn position(&self) -> i64 {
        self.sensors.position(self.position_source(), self.reading.pole_pairs)
    }

    /// Units of the position parameters in a turn.
    pub(super) fn units_per_turn(&self) -> i64 {
        match self.motion {
            Motion::Foc => i64::from(self.settings[Foc::PositionScaler].max(1)),
            _ => i64::from(3 * self.settings[Block::MotorPoles].max(2)),
        }
    }

    /// A position in 1/65536 turn, from one in the unit of the parameters. Rounded down, as the sensor's own
    /// counts are, so that both are equal where they mean the same.
    pub(super) fn internal(&self, position: i32) -> i64 {
        (i64::from(position) * TURN).div_euclid(self.units_per_turn())
    }

    /// A position in the unit of the parameters, from one in 1/65536 turn.
    pub(super) fn external(&self, position: i64) -> i32 {
        let scaled = i128::from(position) * i128::from(self.units_per_turn());
        let rounded = (scaled + i128::from(TURN / 2)) >> 16;
        rounded.clamp(i32::MIN.into(), i32::MAX.into()) as i32
    }
}
