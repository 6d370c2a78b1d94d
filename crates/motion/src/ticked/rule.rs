//! What a ramp tick does to the speed.

use super::{MICROSTEP, Mode, Ramp, SPEED_SHIFT, Settings};

/// Exponent in the denominator of p', apart from pdiv.
const FACTOR_SHIFT: u32 = 3;

impl Settings {
    /// Highest speed in 1/256.
    pub(super) fn ceiling(&self) -> i32 {
        (self.v_max << SPEED_SHIFT) as i32
    }

    /// Speed in 1/256 with which a target is approached in the end.
    pub(super) fn floor(&self) -> i32 {
        (self.v_min.min(self.v_max) << SPEED_SHIFT) as i32
    }

    /// Whether an axis must not move in the direction of this velocity or distance.
    pub(super) fn bars(&self, direction: i32) -> bool {
        direction < 0 && self.barred.negative || direction > 0 && self.barred.positive
    }

    /// The way in 1/2048 microstep that an axis makes at this speed until the next ramp tick. With less
    /// than a pulse tick per ramp tick, its mean.
    fn way_per_ramp_tick(&self, speed: i32) -> i64 {
        (i64::from(speed >> SPEED_SHIFT) << self.ramp_div) >> self.pulse_div
    }

    /// Whether an axis can stop from this speed on this way (1/2048 microstep), by p'.
    pub(super) fn stops_within(&self, speed: i32, way: i64) -> bool {
        let speed = i64::from(speed);
        let factor_shift = FACTOR_SHIFT + u32::from(self.factor.pdiv);
        // v² <= 2048 p' d with v in 1/256 and d in 1/2048; 57 and 58 bits at most.
        (speed * speed) << factor_shift <= (i64::from(self.factor.pmul) * way) << (2 * SPEED_SHIFT)
    }

    /// The longest way (1/2048 microstep) on which an axis cannot stop from this speed.
    fn too_short_for(&self, speed: i32) -> i64 {
        let speed = i64::from(speed);
        let factor_shift = FACTOR_SHIFT + u32::from(self.factor.pdiv);
        let needed = (speed * speed) << factor_shift;
        let unit = i64::from(self.factor.pmul) << (2 * SPEED_SHIFT);
        needed.div_ceil_by(unit) - 1
    }

    /// Speed in 1/256 with which the soft mode wants to be on this way (1/2048 microstep):
    /// p' d / 2, between the lowest and the highest speed.
    fn soft_speed(&self, way: i64) -> i32 {
        let shift = FACTOR_SHIFT + 4 + u32::from(self.factor.pdiv);
        let speed = (i64::from(self.factor.pmul) * way) >> shift;
        speed.clamp(self.floor().into(), self.ceiling().into()) as i32
    }

    /// The longest way on which the soft mode wants less than the highest speed.
    fn too_short_for_soft_ceiling(&self) -> i64 {
        let shift = FACTOR_SHIFT + 4 + u32::from(self.factor.pdiv);
        (i64::from(self.ceiling()) << shift).div_ceil_by(self.factor.pmul.into()) - 1
    }
}

/// Division of a number that is not negative, rounded up.
trait DivCeilBy {
    fn div_ceil_by(self, divisor: i64) -> i64;
}

impl DivCeilBy for i64 {
    fn div_ceil_by(self, divisor: i64) -> i64 {
        self.cast_unsigned().div_ceil(divisor.cast_unsigned().max(1)).cast_signed()
    }
}

fn approach(velocity: i32, goal: i32, step: i32) -> i32 {
    velocity + (goal - velocity).clamp(-step, step)
}

impl Ramp {
    /// Way to the target in 1/2048 microstep, as far as it is in the direction of the target.
    pub(super) fn way(&self, distance: i32) -> i64 {
        let whole = i64::from(distance.unsigned_abs()) * MICROSTEP;
        let moves_away = i64::from(self.velocity) * i64::from(distance) < 0;
        if moves_away { whole } else { whole - self.fraction }
    }

    /// The velocity after a ramp tick at this moment.
    pub(super) fn next_velocity(&self) -> i32 {
        let settings = &self.settings;
        let step = settings.a_max as i32;
        match settings.mode {
            Mode::Hold | Mode::Velocity if settings.bars(settings.v_target) => {
                approach(self.velocity, 0, step)
            }
            Mode::Hold => settings.v_target << SPEED_SHIFT,
            Mode::Velocity => approach(self.velocity, self.goal(), step),
            Mode::Ramp | Mode::Soft => self.next_to_target(step),
        }
    }

    fn next_to_target(&self, step: i32) -> i32 {
        let settings = &self.settings;
        let distance = self.distance();
        if distance == 0 || settings.bars(distance) {
            let velocity = approach(self.velocity, 0, step);
            let stands = distance == 0 && velocity.unsigned_abs() <= settings.v_min << SPEED_SHIFT;
            return if stands { 0 } else { velocity };
        }
        let direction = distance.signum();
        let (speed, way) = (self.velocity * direction, self.way(distance));
        let speed = if settings.mode == Mode::Soft {
            approach(speed, settings.soft_speed(way), step)
        } else {
            self.next_ramp_speed(speed, way, step)
        };
        speed * direction
    }

    /// The rule of the ramp mode, for a speed toward the target.
    fn next_ramp_speed(&self, speed: i32, way: i64, step: i32) -> i32 {
        let settings = &self.settings;
        let faster = approach(speed, settings.ceiling(), step);
        if self.may_take(faster, way) {
            faster
        } else if speed > settings.floor() && speed < faster && self.may_take(speed, way) {
            speed
        } else {
            approach(speed, settings.floor(), step)
        }
    }

    /// Whether the axis can still stop after a period at this speed.
    pub(super) fn may_take(&self, speed: i32, way: i64) -> bool {
        let left = way - self.settings.way_per_ramp_tick(speed.max(0));
        speed <= 0 || self.settings.stops_within(speed, left)
    }

    /// The velocity that the generator has in view.
    pub(super) fn goal(&self) -> i32 {
        let settings = &self.settings;
        let distance = self.distance();
        match settings.mode {
            Mode::Velocity => {
                (settings.v_target << SPEED_SHIFT).clamp(-settings.ceiling(), settings.ceiling())
            }
            Mode::Hold => settings.v_target << SPEED_SHIFT,
            _ if distance == 0 || settings.bars(distance) => 0,
            Mode::Soft => settings.soft_speed(self.way(distance)) * distance.signum(),
            Mode::Ramp => {
                let speed = self.velocity * distance.signum();
                let faster = approach(speed, settings.ceiling(), settings.a_max as i32);
                let brakes = !self.may_take(faster, self.way(distance));
                let goal = if brakes { settings.floor() } else { settings.ceiling() };
                goal * distance.signum()
            }
        }
    }

    /// How much way there will be left, at most, when the velocity changes that is now constant; none if
    /// it does not change before the axis stops on its target or is given something else to do.
    ///
    /// To be asked only if a ramp tick at this moment would not change the velocity.
    pub(super) fn way_at_change(&self) -> Option<WayLeft> {
        let settings = &self.settings;
        let distance = self.distance();
        let idle = distance == 0 || settings.bars(distance) || settings.a_max == 0;
        if !settings.is_position_mode() || idle {
            return None;
        }
        let (speed, way) = (self.velocity.abs(), self.way(distance));
        let cruises = speed == settings.ceiling();
        let limit = match settings.mode {
            Mode::Soft if settings.soft_speed(way) == settings.floor() => return None,
            Mode::Soft if cruises => settings.too_short_for_soft_ceiling(),
            Mode::Ramp if cruises && self.may_take(speed, way) => {
                settings.too_short_for(speed) + settings.way_per_ramp_tick(speed)
            }
            Mode::Ramp if speed == settings.floor() => return None,
            _ => return Some(WayLeft { now: way, then: way }),
        };
        Some(WayLeft { now: way, then: limit.min(way) })
    }
}

/// Ways to the target in 1/2048 microstep.
pub(super) struct WayLeft {
    pub(super) now: i64,
    pub(super) then: i64,
}
