//! Ramps of speed and of position, in steps of equal time.
//!
//! Both are exact: what is less than a unit is carried on to the next step.

/// Parts of a revolution per minute in which a [`SpeedRamp`] counts.
const FINE: i64 = 65_536;
/// Speeds outside are given in 1/256 revolution per minute.
const SPEED_PARTS: i64 = 256;
/// The fastest that 1/256 revolution per minute can hold.
const MOST_RPM: u32 = (i32::MAX / 256) as u32;
const MOST_STEPS_PER_SECOND: u32 = 1_000_000;

const fn saturated(value: i128) -> i32 {
    if value > i32::MAX as i128 {
        i32::MAX
    } else if value < i32::MIN as i128 {
        i32::MIN
    } else {
        value as i32
    }
}

/// The integer square root, the quick way if 64 bits are enough.
fn root(value: u128) -> u64 {
    match u64::try_from(value) {
        Ok(value) => value.isqrt(),
        // Half the bits of the value.
        Err(_) => value.isqrt() as u64,
    }
}

/// A speed that changes by an acceleration.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct SpeedRamp {
    /// In 1/65536 revolution per minute.
    speed: i64,
    /// What is left of the acceleration so far, in 1/65536 revolution per minute and 1/steps per second.
    remainder: u64,
}

impl SpeedRamp {
    /// One of `steps_per_second` (0 acts as 1) steps toward a speed in revolutions per minute, with an
    /// acceleration in revolutions per minute and second; with acceleration 0 the speed stays. Returns the
    /// speed in 1/256 revolution per minute.
    #[inline]
    pub fn step(&mut self, target_rpm: i32, acceleration: u32, steps_per_second: u32) -> i32 {
        let way = i64::from(target_rpm) * FINE - self.speed;
        if way == 0 {
            self.remainder = 0;
            return self.speed();
        }
        let steps = u64::from(steps_per_second.max(1));
        let total = u64::from(acceleration) * FINE as u64 + self.remainder;
        let most = (total / steps) as i64;
        self.remainder = total % steps;
        self.speed += way.clamp(-most, most);
        self.speed()
    }

    /// Puts the speed to this, in 1/256 revolution per minute.
    pub fn set(&mut self, speed: i32) {
        *self = Self { speed: i64::from(speed) * (FINE / SPEED_PARTS), remainder: 0 };
    }

    /// The speed in 1/256 revolution per minute, toward zero.
    #[inline]
    pub fn speed(&self) -> i32 {
        super::saturated(self.speed / (FINE / SPEED_PARTS))
    }
}

/// The speed in 1/256 revolution per minute from which an axis stops within `distance` counts if it brakes with
/// this many revolutions per minute and second: the root of 120 * acceleration * distance / counts per turn.
///
/// It is rounded down and saturates; 0 counts per turn act as 1.
pub fn braking_speed(distance: u64, acceleration: u32, counts_per_turn: u32) -> u32 {
    const FACTOR: u64 = 120 * (SPEED_PARTS * SPEED_PARTS) as u64;
    let per_turn = counts_per_turn.max(1);
    let quick = u64::from(acceleration).checked_mul(FACTOR).and_then(|f| f.checked_mul(distance));
    let square = match quick {
        Some(product) => u128::from(product / u64::from(per_turn)),
        None => {
            let product = u128::from(acceleration) * u128::from(FACTOR);
            product * u128::from(distance) / u128::from(per_turn)
        }
    };
    u32::try_from(root(square)).unwrap_or(u32::MAX)
}

/// A position that moves to a target with a ramp of speed, and stops on it.
///
/// In each step the speed is the highest one that differs by no more than the acceleration from that before, is
/// not above the maximum, and from which the axis still comes to rest on the target, braking step by step. So
/// near the target it follows [`braking_speed`] but for what a step rounds, and there is no creeping: once the
/// rest is no more than what the acceleration gives in one step, the next step is on the target. An axis
/// that is too fast for its target, or moves away from it, brakes, and comes back.
///
/// Counts wrap, and the way to a target is the shorter one.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct PositionRamp {
    position: i32,
    /// What the axis is ahead of its position, at most half a count: in 1/(60 * scale²) count.
    fraction: i64,
    /// In 1/scale revolution per minute. With steps per second as the scale, the speed changes by the plain
    /// acceleration in a step, and moves the axis by speed * counts per turn fractions.
    speed: i64,
    scale: u32,
}

impl Default for PositionRamp {
    /// At rest at position 0.
    fn default() -> Self {
        Self { position: 0, fraction: 0, speed: 0, scale: SPEED_PARTS as u32 }
    }
}

impl PositionRamp {
    /// One of `steps_per_second` (1 to a million) steps toward a target in counts: with at most `max_velocity`
    /// revolutions per minute (at most 8388607) and `acceleration` revolutions per minute and second (0 acts as
    /// 1, so that a ramp can always end). 0 counts per turn act as 1. Returns the new position.
    #[inline]
    pub fn step(
        &mut self,
        target: i32,
        max_velocity: u32,
        acceleration: u32,
        counts_per_turn: u32,
        steps_per_second: u32,
    ) -> i32 {
        if self.speed == 0 && self.fraction == 0 && self.position == target {
            return target;
        }
        self.set_scale(steps_per_second.clamp(1, MOST_STEPS_PER_SECOND));
        let count = 60 * i128::from(self.scale) * i128::from(self.scale);
        let per_turn = i128::from(counts_per_turn.max(1));
        let acceleration = i64::from(acceleration.max(1));
        let fastest = i64::from(max_velocity.min(MOST_RPM)) * i64::from(self.scale);

        let way =
            i128::from(target.wrapping_sub(self.position)) * count - i128::from(self.fraction);
        let toward: i64 = if way < 0 { -1 } else { 1 };
        let before = self.speed * toward;
        let goal = fastest.min(before + acceleration);
        let goal = highest_speed(way.abs(), goal, acceleration, per_turn);
        let speed = goal.clamp(before - acceleration, before + acceleration);
        self.speed = speed * toward;

        let travel = i128::from(speed) * per_turn;
        if travel >= way.abs() && speed <= acceleration {
            (self.position, self.fraction) = (target, 0);
        } else {
            self.advance(i128::from(self.fraction) + travel * i128::from(toward), count);
        }
        self.position
    }

    /// Speed in 1/256 revolution per minute, toward zero. On the target this is still the speed of the step
    /// that led there, then 0.
    #[inline]
    pub fn speed(&self) -> i32 {
        saturated(i128::from(self.speed) * i128::from(SPEED_PARTS) / i128::from(self.scale))
    }

    /// Position in counts, rounded.
    #[inline]
    pub fn position(&self) -> i32 {
        self.position
    }

    /// Puts the axis to this position and a speed in 1/256 revolution per minute.
    pub fn set(&mut self, position: i32, speed: i32) {
        *self = Self { position, speed: i64::from(speed), ..Self::default() };
    }

    /// A change of the scale costs the part of a count, which is what another time base may.
    fn set_scale(&mut self, scale: u32) {
        if self.scale != scale {
            let speed = i128::from(self.speed) * i128::from(scale) / i128::from(self.scale);
            (self.speed, self.scale, self.fraction) = (speed as i64, scale, 0);
        }
    }

    /// Carries whole counts from a fraction to the position.
    fn advance(&mut self, fraction: i128, count: i128) {
        let half = count / 2;
        let counts = if -half <= fraction && fraction < half {
            0
        } else {
            (fraction + half).div_euclid(count)
        };
        self.position = self.position.wrapping_add(counts as i32);
        self.fraction = (fraction - counts * count) as i64;
    }
}

/// The highest speed up to `goal` with which one may go for one step and then brake step by step to rest within
/// `way`.
///
/// From speed v braking takes v + (v - a) + (v - 2a) + ... = v (v + a) / 2a steps' travel, the step with v
/// included. The rest, less than a step of acceleration, is made in one step.
fn highest_speed(way: i128, goal: i64, acceleration: i64, per_turn: i128) -> i64 {
    let a = i128::from(acceleration);
    let needed = i128::from(goal) * (i128::from(goal) + a) * per_turn;
    if goal <= 0 || needed <= 2 * a * way {
        return goal;
    }
    if way <= a * per_turn {
        // Rounded up, so that the target is in this step.
        return goal.min(((way + per_turn - 1) / per_turn) as i64);
    }
    // v² + a v = 2 a way
    let square = a * a + 8 * a * way / per_turn;
    // Not above `goal`, which has 64 bits.
    ((root(square.unsigned_abs()) as i64 - acceleration) / 2).min(goal)
}
