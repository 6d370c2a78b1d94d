//! The ramp of a speed.

use super::SPEED_PARTS;
use crate::servo::saturated;

/// Parts of a revolution per minute in which a [`SpeedRamp`] counts.
const FINE: i64 = 65_536;

/// A speed that changes by an acceleration.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct SpeedRamp {
    /// In 1/65536 revolution per minute.
    speed: i64,
    /// What is left of the acceleration so far, in 1/65536 revolution per minute and 1/steps per second.
    remainder: u64,
}

impl SpeedRamp {
    /// One of `steps_per_second` (0 acts as 1) steps toward a speed in 1/256 revolution per minute, with
    /// an acceleration in revolutions per minute and second; with acceleration 0 the speed stays. Returns the
    /// speed in 1/256 revolution per minute.
    #[inline]
    pub fn step(&mut self, target: i32, acceleration: u32, steps_per_second: u32) -> i32 {
        let way = i64::from(target) * (FINE / SPEED_PARTS) - self.speed;
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
        saturated(self.speed / (FINE / SPEED_PARTS))
    }
}

#[cfg(test)]
mod tests {
    use super::super::super::random::Random;
    use super::*;

    #[test]
    fn a_speed_changes_by_exactly_the_acceleration_in_a_second() {
        for (acceleration, steps) in [(2_000, 20_000), (1, 20_000), (777, 1_000), (123_457, 999)] {
            for direction in [1, -1] {
                let mut ramp = SpeedRamp::default();
                let target = direction * 1_000_000 * 256;
                for _ in 0..steps {
                    ramp.step(target, acceleration, steps);
                }
                assert_eq!(ramp.speed(), direction * acceleration as i32 * 256);
            }
        }
    }

    #[test]
    fn a_speed_ends_on_its_target() {
        let mut ramp = SpeedRamp::default();
        ramp.set(-300 * 256 - 77);
        assert_eq!(ramp.speed(), -300 * 256 - 77);
        let mut steps = 0;
        while ramp.step(500 * 256, 1_600, 1_000) != 500 * 256 {
            steps += 1;
            assert!(steps < 600);
        }
        // 800.3 rpm at 1.6 rpm per step take 501 steps.
        assert_eq!(steps, 500);
        assert_eq!(ramp.step(500 * 256, 1_600, 1_000), 500 * 256);
        assert_eq!(ramp.step(900 * 256, 0, 1_000), 500 * 256, "no acceleration, no change");
    }

    #[test]
    fn any_input_leads_toward_the_target_and_not_past_it() {
        let mut random = Random::new(0x3a5);
        let mut ramp = SpeedRamp::default();
        for _ in 0..300_000 {
            if random.below(100) == 0 {
                ramp.set(random.signed());
            }
            let target = random.signed();
            let before = i64::from(ramp.speed());
            let now = i64::from(ramp.step(target, random.unsigned(), random.unsigned()));
            let goal = i64::from(target);
            assert!(now >= before.min(goal) && now <= before.max(goal));
        }
    }
}
