//! From one tick to the next, and over all those at which nothing changes.

use super::{MICROSTEP, Ramp, SPEED_SHIFT, wrap};
use crate::Instant;

/// Binary logarithm of the clocks between two ticks with a divisor of 0.
pub(super) const TICK_SHIFT: u32 = 5;

impl Ramp {
    /// Lets everything happen up to this time, including it. An earlier time than the last one counts as
    /// that one.
    pub fn advance(&mut self, now: Instant) {
        let now = now.as_ticks();
        loop {
            let tick = self.next_change();
            if tick > now || tick == u64::MAX {
                break;
            }
            self.step(tick);
            self.stride(now);
        }
        self.run(now);
    }

    /// Goes to a ramp tick and lets it happen. The velocity must be constant up to there.
    pub(super) fn step(&mut self, tick: u64) {
        self.run(tick.saturating_sub(1));
        let velocity = self.next_velocity();
        self.time = tick;
        if velocity != self.velocity {
            self.change = velocity - self.velocity;
            self.changed_at = tick;
        }
        self.assume(velocity);
        // A pulse tick of the same time comes after the ramp tick.
        if tick & (self.pulse_period() - 1) == 0 {
            self.pulse(1);
        }
    }

    /// The next ramp tick at which the velocity may change; `u64::MAX` if there is none.
    pub(super) fn next_change(&self) -> u64 {
        if self.next_velocity() != self.velocity {
            return self.ramp_tick_after(self.time);
        }
        let Some(way) = self.way_at_change() else { return u64::MAX };
        let speed = u64::from(self.velocity.unsigned_abs() >> SPEED_SHIFT);
        let ahead = u64::try_from(way.now - way.then).unwrap_or(0);
        if ahead == 0 {
            return self.ramp_tick_after(self.time);
        }
        if speed == 0 {
            return u64::MAX;
        }
        let pulses = ahead.div_ceil(speed);
        let period = TICK_SHIFT + self.settings.pulse_div;
        self.ramp_tick_after(nth_tick((self.time >> period).saturating_add(pulses), period))
    }

    pub(super) fn ramp_tick_after(&self, time: u64) -> u64 {
        let period = TICK_SHIFT + self.settings.ramp_div;
        nth_tick((time >> period) + 1, period)
    }

    /// Clocks between two ramp ticks.
    pub(super) fn ramp_period(&self) -> u64 {
        1 << (TICK_SHIFT + self.settings.ramp_div)
    }

    /// Clocks between two pulse ticks.
    pub(super) fn pulse_period(&self) -> u64 {
        1 << (TICK_SHIFT + self.settings.pulse_div)
    }

    /// Runs at the present velocity up to this time, or to the target if the axis stops there.
    pub(super) fn run(&mut self, to: u64) {
        if to <= self.time {
            return;
        }
        let period = TICK_SHIFT + self.settings.pulse_div;
        let pulses = (to >> period) - (self.time >> period);
        let from = self.time;
        self.time = to;
        if let Some(arrival) = self.pulse(pulses) {
            self.stopped_at = Some(nth_tick((from >> period).saturating_add(arrival), period));
        }
    }

    /// Makes a number of pulse ticks. Gives the number of the one with which the axis came to its target
    /// and stopped, if it did.
    fn pulse(&mut self, pulses: u64) -> Option<u64> {
        let speed = u128::from(self.velocity.unsigned_abs() >> SPEED_SHIFT);
        if speed == 0 || pulses == 0 {
            return None;
        }
        let direction = i64::from(self.velocity.signum());
        let units = u128::from(pulses) * speed + self.fraction as u128;
        if self.stops_on_target() {
            let ahead = self.microsteps_ahead(direction);
            if units >= ahead * MICROSTEP as u128 {
                let needed = ahead * MICROSTEP as u128 - self.fraction as u128;
                let arrival = needed.div_ceil(speed);
                self.fraction = (arrival * speed - needed) as i64;
                self.travel += direction * ahead as i64;
                self.position = self.settings.target;
                self.jump_to(0);
                return Some(arrival as u64);
            }
        }
        let steps = direction * (units / MICROSTEP as u128) as i64;
        self.fraction = (units % MICROSTEP as u128) as i64;
        self.travel = self.travel.wrapping_add(steps);
        self.position = wrap(i64::from(self.position).wrapping_add(steps));
        None
    }

    /// Microsteps to the target in this direction, 1..=2^24.
    fn microsteps_ahead(&self, direction: i64) -> u128 {
        let distance = direction * (i64::from(self.settings.target) - i64::from(self.position));
        ((distance - 1) & 0xFF_FFFF) as u128 + 1
    }

    /// When the axis will stop on its target if its velocity stays as it is.
    pub(super) fn arrival(&self) -> Option<u64> {
        let speed = u128::from(self.velocity.unsigned_abs() >> SPEED_SHIFT);
        if speed == 0 || !self.stops_on_target() {
            return None;
        }
        let ahead = self.microsteps_ahead(self.velocity.signum().into());
        let pulses = (ahead * MICROSTEP as u128 - self.fraction as u128).div_ceil(speed) as u64;
        let period = TICK_SHIFT + self.settings.pulse_div;
        Some(nth_tick((self.time >> period).saturating_add(pulses), period))
    }
}

/// The time of a tick by its number; the end of time for those that lie behind it.
fn nth_tick(number: u64, period: u32) -> u64 {
    number.saturating_mul(1 << period)
}
