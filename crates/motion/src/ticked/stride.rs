//! Many ramp ticks in one go, with the same result as one by one.
//!
//! Accelerating, and slowing down where nothing else follows from it, is done in closed form: the way is a sum of speeds, each rounded down to whole units. When
//! it ends follows by bisection, since an axis that may not take a speed may not take a higher one later.
//! Braking follows a curve tick by tick, in a loop without anything else in it.

use super::advance::TICK_SHIFT;
use super::{MICROSTEP, Mode, Ramp, SPEED_SHIFT, wrap};

/// The sum of `(first + i * step) / 256`, each rounded down, for `i` from 0 to `count - 1`.
fn sum_of_whole_parts(count: u64, first: u64, step: u64) -> u64 {
    let (mut count, mut first, mut step, mut unit) = (count, first, step, 1u64 << SPEED_SHIFT);
    let mut sum = 0;
    while count > 0 {
        sum += count * (count - 1) / 2 * (step / unit) + count * (first / unit);
        let last = step % unit * count + first % unit;
        // The points below the line, counted along the other axis.
        (count, first, step, unit) = (last / unit, last % unit, unit, step % unit);
        if unit == 0 {
            break;
        }
    }
    sum
}

impl Ramp {
    /// Makes several ramp ticks up to `now`, if that can be done in one go. Does nothing otherwise.
    pub(super) fn stride(&mut self, now: u64) {
        let period = TICK_SHIFT + self.settings.ramp_div;
        let whole_pulses = self.settings.ramp_div >= self.settings.pulse_div;
        let ticks = now.saturating_sub(self.time) >> period;
        if ticks < 2
            || !whole_pulses
            || self.settings.a_max == 0
            || self.time & ((1 << period) - 1) != 0
        {
            return;
        }
        let (goal, distance) = match self.settings.mode {
            Mode::Velocity => (self.goal(), self.goal()),
            Mode::Ramp => (self.settings.ceiling(), self.distance()),
            Mode::Soft | Mode::Hold => return,
        };
        let ahead = distance.signum();
        let is_velocity_mode = self.settings.mode == Mode::Velocity;
        if ahead == 0 && !is_velocity_mode || self.settings.bars(distance) {
            return;
        }
        let speed = self.velocity * ahead;
        let direction = if self.velocity == 0 { ahead } else { self.velocity.signum() };
        let (ticks, units) = if speed < 0 || ahead == 0 {
            self.slow(0, ticks)
        } else if is_velocity_mode && speed > goal.abs() {
            self.slow(goal.abs(), ticks)
        } else {
            match self.climb(goal.abs(), speed, distance, ticks) {
                (0, _) if !is_velocity_mode => self.descend(speed, distance, ticks),
                climbed => climbed,
            }
        };
        let units = units + self.fraction;
        let steps = i64::from(direction) * (units / MICROSTEP);
        self.fraction = units % MICROSTEP;
        self.travel = self.travel.wrapping_add(steps);
        self.position = wrap(i64::from(self.position).wrapping_add(steps));
        self.time += ticks << period;
    }

    /// Accelerates in ticks that each add a_max. Gives their number and the way in 1/2048 microstep.
    fn climb(&mut self, ceiling: i32, speed: i32, distance: i32, ticks: u64) -> (u64, i64) {
        let step = self.settings.a_max as i32;
        let room = u64::try_from(ceiling - speed).unwrap_or(0);
        let most = ticks.min(room.checked_div(step as u64).unwrap_or(0));
        let pulses = 1i64 << (self.settings.ramp_div - self.settings.pulse_div);
        let whole = i64::from(speed >> SPEED_SHIFT);
        let speed_at = |tick: u64| speed + tick as i32 * step;
        // The way up to the moment of a tick: one pulse less with the speed from before it.
        let way_before = |tick: u64| {
            let sum = sum_of_whole_parts(tick - 1, speed_at(1) as u64, step as u64) as i64;
            (pulses - 1) * whole + pulses * sum
        };
        let count = if self.settings.mode == Mode::Ramp {
            let way = self.way(distance);
            let possible = |tick: u64| self.may_take(speed_at(tick), way - way_before(tick));
            let (mut good, mut bad) = (0, most + 1);
            while bad - good > 1 {
                let middle = good + (bad - good) / 2;
                *(if possible(middle) { &mut good } else { &mut bad }) = middle;
            }
            good
        } else {
            most
        };
        if count == 0 {
            return (0, 0);
        }
        self.velocity = speed_at(count) * distance.signum();
        self.change = step * distance.signum();
        self.changed_at = self.time + count * self.ramp_period();
        (count, way_before(count) + i64::from(speed_at(count) >> SPEED_SHIFT))
    }

    /// Slows down to a speed in ticks that each take away a_max, away from the target if there is one.
    /// Gives their number and the way in 1/2048 microstep.
    fn slow(&mut self, lowest: i32, ticks: u64) -> (u64, i64) {
        let (step, speed) = (self.settings.a_max as i32, self.velocity.abs());
        // The last step may be a shorter one, or one after which the axis stands.
        let count = ticks.min(((speed - lowest - 1).max(0) / step) as u64);
        let pulses = 1i64 << (self.settings.ramp_div - self.settings.pulse_div);
        let speed_at = |tick: u64| speed - tick as i32 * step;
        let last = i64::from(speed_at(count) >> SPEED_SHIFT);
        let sum = sum_of_whole_parts(count, speed_at(count) as u64, step as u64) as i64;
        let way = (pulses - 1) * i64::from(speed >> SPEED_SHIFT) + pulses * (sum - last) + last;
        // Half way round, the target would be in front of it again.
        let comes_round = self.settings.is_position_mode()
            && i64::from(self.distance().abs()) + way / MICROSTEP + 1 >= 1 << 23;
        if count == 0 || comes_round {
            return (0, 0);
        }
        self.velocity = speed_at(count) * self.velocity.signum();
        self.change = -step * self.velocity.signum();
        self.changed_at = self.time + count * self.ramp_period();
        (count, way)
    }

    /// Brakes, or keeps its speed, as long as it is above v_min and in front of the target. Gives the
    /// number of ticks and the way in 1/2048 microstep.
    fn descend(&mut self, speed: i32, distance: i32, ticks: u64) -> (u64, i64) {
        let settings = &self.settings;
        let (step, floor) = (settings.a_max as i32, settings.floor());
        let pulses = settings.ramp_div - settings.pulse_div;
        let (start, ceiling) = (self.way(distance), settings.ceiling());
        let slowest = (settings.v_min.max(1) as i32 * 2) << SPEED_SHIFT;
        let (mut way, mut now, mut count, mut last_brake) = (start, speed, 0, 0);
        while count < ticks && now > slowest.max(floor + step) && now <= ceiling {
            let whole = i64::from(now >> SPEED_SHIFT);
            let before = way - ((whole << pulses) - whole);
            if before <= MICROSTEP {
                break;
            }
            if !settings.stops_within(now, before - (whole << pulses)) {
                // Nor may it take a higher speed.
                count += 1;
                last_brake = count;
                now -= step;
            } else if self.may_take((now + step).min(ceiling), before) {
                break;
            } else {
                count += 1;
            }
            way = before - i64::from(now >> SPEED_SHIFT);
        }
        if last_brake > 0 {
            self.velocity = now * distance.signum();
            self.change = -step * distance.signum();
            self.changed_at = self.time + last_brake * self.ramp_period();
        }
        (count, start - way)
    }
}

#[cfg(test)]
mod tests {
    use super::sum_of_whole_parts;

    #[test]
    fn a_sum_of_whole_parts_is_what_adding_gives() {
        for step in [0, 1, 7, 255, 256, 257, 500, 2047] {
            for first in [0, 1, 255, 256, 1000, 400_000] {
                let mut sum = 0;
                for count in 0..300 {
                    assert_eq!(sum_of_whole_parts(count, first, step), sum, "{step} {first}");
                    sum += (first + count * step) / 256;
                }
            }
        }
    }
}
