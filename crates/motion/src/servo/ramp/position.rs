//! The ramp of a position, step by step.

use super::{SPEED_PARTS, root};

/// The fastest that 1/256 revolution per minute can hold.
const MOST_RPM: u32 = (i32::MAX / 256) as u32;
const MOST_STEPS_PER_SECOND: u32 = 1_000_000;

/// A position that moves to a target with a ramp of speed, and stops on it.
///
/// In each step the speed is the highest one that differs by no more than the acceleration from that before, is
/// not above the maximum, and from which the axis still comes to rest on the target, braking step by step. So
/// near the target it follows [`super::braking_speed`] but for what a step rounds, and there is no creeping: once the
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
        let speed = i128::from(self.speed) * i128::from(SPEED_PARTS) / i128::from(self.scale);
        // No speed is above MOST_RPM or what it was put to.
        speed as i32
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
        let ahead = fraction + count / 2;
        // Division of 64 bits is the faster one, and enough but for the wildest speeds.
        let counts = match (i64::try_from(ahead), i64::try_from(count)) {
            (Ok(ahead), Ok(count)) => i128::from(ahead.div_euclid(count)),
            _ => ahead.div_euclid(count),
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

#[cfg(test)]
mod tests {
    use super::super::super::random::Random;
    use super::super::braking_speed;
    use super::*;

    /// Velocity limit, acceleration, counts per turn, steps per second.
    #[derive(Clone, Copy, Debug)]
    struct Limits(u32, u32, u32, u32);

    fn step(ramp: &mut PositionRamp, target: i32, limits: Limits) -> i32 {
        ramp.step(target, limits.0, limits.1, limits.2, limits.3)
    }

    /// Steps until the ramp rests on its target; checks that speed and acceleration keep their limits.
    fn run(ramp: &mut PositionRamp, target: i32, limits: Limits, most: u32) -> u32 {
        let Limits(velocity, acceleration, _, steps) = limits;
        // What speed() rounds, twice.
        let change = f64::from(acceleration) * 256.0 / f64::from(steps) + 2.0;
        for taken in 0..most {
            let before = ramp.speed();
            step(ramp, target, limits);
            let speed = ramp.speed();
            assert!(f64::from(speed - before).abs() <= change, "{before} {speed} {limits:?}");
            assert!(
                speed.unsigned_abs() <= (velocity * 256).max(before.unsigned_abs()),
                "{speed} {limits:?}"
            );
            if ramp.position() == target && speed == 0 && ramp.fraction == 0 {
                return taken;
            }
        }
        panic!("{ramp:?} does not reach {target} with {limits:?}");
    }

    #[test]
    fn a_move_takes_the_time_of_the_textbook_and_never_turns_back() {
        for limits in [
            Limits(4_000, 2_000, 65_536, 1_000),
            Limits(4_000, 2_000, 65_536, 20_000),
            Limits(2_000, 10_000, 24, 1_000),
            Limits(100, 100_000, 24, 1_000),
            Limits(3_000, 37, 4_096, 1_000),
        ] {
            let Limits(velocity, acceleration, counts, steps) = limits;
            for turns in [1, 30, 1_000] {
                for direction in [1, -1] {
                    let target = direction * turns * counts as i32;
                    let mut ramp = PositionRamp::default();
                    let mut copy = ramp;
                    let taken = run(&mut ramp, target, limits, 100_000_000);
                    let mut before = 0;
                    for _ in 0..taken {
                        let now = direction * step(&mut copy, target, limits);
                        assert!(now >= before && now <= target.abs());
                        before = now;
                    }
                    let (v, a) = (f64::from(velocity) / 60.0, f64::from(acceleration) / 60.0);
                    let way = f64::from(turns);
                    let time =
                        if way > v * v / a { way / v + v / a } else { 2.0 * (way / a).sqrt() };
                    let given = f64::from(taken) / f64::from(steps);
                    let off = (given - time).abs();
                    assert!(off < 5.0 / f64::from(steps), "{given} for {time}: {limits:?}");
                }
            }
        }
    }

    #[test]
    fn a_ramp_brakes_with_the_braking_speed() {
        let limits = Limits(4_000, 2_000, 4_096, 20_000);
        let mut ramp = PositionRamp::default();
        let target = 100 * 4_096;
        let mut compared = 0;
        while ramp.position() != target {
            let left = (target - ramp.position()) as u64;
            step(&mut ramp, target, limits);
            if left < 45 * 4_096 && left > 100 {
                let bound = braking_speed(left, 2_000, 4_096);
                // A step is 0.1 rpm, a count of the way up to 1 rpm at this end.
                assert!(bound.abs_diff(ramp.speed().unsigned_abs()) < 2 * 256, "{left}");
                compared += 1;
            }
        }
        assert!(compared > 10_000);
    }

    #[test]
    fn a_new_target_behind_is_reached_by_braking_first() {
        let limits = Limits(1_000, 1_000, 4_096, 1_000);
        let mut ramp = PositionRamp::default();
        for _ in 0..1_000 {
            step(&mut ramp, 1_000_000, limits);
        }
        let here = ramp.position();
        assert_eq!(ramp.speed(), 1_000 * 256);
        let mut furthest = here;
        let mut copy = ramp;
        let taken = run(&mut ramp, here, limits, 10_000);
        for _ in 0..taken {
            furthest = furthest.max(step(&mut copy, here, limits));
        }
        // One second of braking: half of 1000/60 turns.
        let overshoot = f64::from(furthest - here) / 4_096.0;
        assert!((overshoot - 500.0 / 60.0).abs() < 0.02, "{overshoot}");
        // 1 s to brake, and the way back with up to sqrt(60 * 1000 * 8.33) = 707 rpm: 2 * 0.707 s.
        assert!(taken.abs_diff(2_414) < 5, "{taken}");
    }

    #[test]
    fn a_ramp_goes_over_the_ends_of_the_counter_and_on_from_where_it_is_put() {
        let limits = Limits(1_000, 5_000, 4_096, 1_000);
        let mut ramp = PositionRamp::default();
        ramp.set(i32::MAX - 1_000, -300 * 256);
        assert_eq!((ramp.position(), ramp.speed()), (i32::MAX - 1_000, -300 * 256));
        assert!(run(&mut ramp, i32::MIN + 100_000, limits, 10_000) < 2_500);
        ramp.set(77, 0);
        assert_eq!(run(&mut ramp, 77, limits, 1), 0);
    }

    #[test]
    fn targets_that_change_on_the_way_are_reached_within_the_limits() {
        let mut random = Random::new(0x9a3b);
        for _ in 0..3_000 {
            let mut ramp = PositionRamp::default();
            ramp.set(random.signed(), (random.signed() >> 10).clamp(-500_000, 500_000));
            let mut limits = Limits(100, 100, 24, 1_000);
            for _ in 0..4 {
                limits = Limits(
                    1 + random.magnitude(13),
                    200 + random.magnitude(17),
                    1 + random.magnitude(17),
                    1_000,
                );
                for _ in 0..random.magnitude(8) {
                    step(&mut ramp, random.signed(), limits);
                }
            }
            limits.0 = limits.0.max(200);
            let way = (random.signed() >> 8) % (20 * limits.2 as i32);
            let target = ramp.position().wrapping_add(way);
            run(&mut ramp, target, limits, 1_000_000);
        }
    }

    #[test]
    fn any_input_has_an_answer() {
        let mut random = Random::new(0x3a6);
        let mut ramp = PositionRamp::default();
        for _ in 0..300_000 {
            if random.below(100) == 0 {
                ramp.set(random.signed(), random.signed());
            }
            let limits =
                Limits(random.unsigned(), random.unsigned(), random.unsigned(), random.unsigned());
            assert_eq!(step(&mut ramp, random.signed(), limits), ramp.position());
            let half = 30 * i128::from(ramp.scale).pow(2);
            assert!(i128::from(ramp.fraction).abs() <= half);
        }
    }

    #[test]
    fn the_highest_speed_is_the_last_from_which_the_way_is_enough() {
        let mut random = Random::new(0x415);
        for _ in 0..100_000 {
            let a = i64::from(random.magnitude(20)) + 1;
            let per_turn = i128::from(random.magnitude(20)) + 1;
            let step = i128::from(a) * per_turn;
            let way = step + 1 + i128::from(random.magnitude(32)) * step / 65_536;
            let enough =
                |v: i64| i128::from(v) * i128::from(v + a) * per_turn <= 2 * i128::from(a) * way;
            let speed = highest_speed(way, i64::MAX >> 20, a, per_turn);
            // What is rounded inside the root costs one unit at most.
            assert!(enough(speed) && !enough(speed + 2), "{speed} for {way}, {a}, {per_turn}");
        }
    }
}
