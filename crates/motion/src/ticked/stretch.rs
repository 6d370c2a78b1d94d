//! An axis as something that moves evenly: stretches of constant acceleration in place of ticks.
//!
//! A motor does not feel single ticks, and what follows from its motion is easier told of a few long stretches
//! than of thousands of short ones. The generator tells where the axis is at both ends of a stretch; in
//! between whoever asks draws a curve without steps through these places.

use super::advance::TICK_SHIFT;
use super::{DIVISOR_MAX, Ramp, SPEED_SHIFT};
use crate::Instant;

/// Binary logarithm of the units of a place in a microstep: 2048 in the accumulator, each in 2^18 clocks, the
/// longest time between two pulse ticks.
pub const PLACE_SHIFT: u32 = 11 + PULSE_SHIFT_MAX;

const PULSE_SHIFT_MAX: u32 = TICK_SHIFT + DIVISOR_MAX;

/// Binary logarithm of the units of the accumulator in a microstep.
const MICROSTEP_SHIFT: u32 = 11;

/// Half a microstep.
const HALF: i128 = 1 << (PLACE_SHIFT - 1);

/// Ramp ticks that one stretch has at most.
const TICKS_AHEAD: u64 = 1 << 16;

/// A velocity in 1/256 that is so low that the part of it that makes no way, up to one unit, changes the form of the
/// curve.
const SLOW: i32 = 8 << SPEED_SHIFT;

/// The same while an axis is slow, and where its velocity does not change with each of them, so that a curve through
/// the ends of the stretch does not stray.
const UNEVEN_TICKS_AHEAD: u64 = 32;

/// How an axis moves from the time to which it was advanced last.
///
/// Places count 2^-[`PLACE_SHIFT`] microsteps since the beginning, as [`Ramp::travel`] does. On an axis that moves the
/// place follows what is in the accumulator and what it will get with the next pulse tick: when a microstep is made
/// the place is half a microstep before it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Stretch {
    /// When the stretch ends, after it has begun; none if the velocity stays until the axis is given
    /// something else to do.
    pub until: Option<Instant>,
    /// Velocity at the beginning in 1/256 of a register unit. It is at one side of zero all the time.
    pub velocity: i32,
    /// Binary logarithm of the clocks in which an axis with a velocity of 1 makes a microstep.
    pub rate_shift: u32,
    /// By how many 1/256 the velocity changes in all, evenly from ramp tick to ramp tick.
    pub change: i32,
    /// Clocks in which it changes that much.
    pub clocks: u64,
    /// The way that the axis makes, with its direction.
    pub way: i128,
    /// The place where it then is.
    pub end: i128,
    /// Whether it stands then.
    pub stops: bool,
}

impl Ramp {
    /// The place of the axis at the time to which it was advanced last. On an axis that stands it is a whole
    /// microstep.
    pub fn place(&self) -> i128 {
        self.place_in(self.velocity.signum())
    }

    /// How the axis moves if nobody interferes, as far as that is the same.
    pub fn stretch(&self) -> Stretch {
        let mut ahead = self.clone();
        let tick = self.next_change();
        let mut stretch = Stretch {
            until: None,
            velocity: self.velocity,
            rate_shift: TICK_SHIFT + MICROSTEP_SHIFT + self.settings.pulse_div,
            change: 0,
            clocks: 1,
            way: 0,
            end: self.place(),
            stops: false,
        };
        // What changes behind a time of constant velocity belongs to what comes then.
        let is_ramp = self.velocity != 0 && tick == self.ramp_tick_after(self.time);
        let until = if tick != u64::MAX {
            ahead.pass(tick, is_ramp)
        } else if let Some(arrival) = self.arrival() {
            ahead.run(arrival);
            arrival
        } else {
            return stretch;
        };
        let ticks = until.saturating_sub(self.time).div_ceil(self.ramp_period()).max(1);
        if is_ramp && until >= tick {
            stretch.change = ahead.velocity - self.velocity;
        }
        let direction = self.velocity.signum();
        let forward = (ahead.place_in(direction) - self.place()) * i128::from(direction);
        stretch.clocks = ticks * self.ramp_period();
        stretch.way = forward.max(0) * i128::from(direction);
        stretch.end = ahead.place();
        stretch.stops = ahead.velocity == 0;
        stretch.until = Some(Instant::from_ticks(until));
        stretch
    }

    /// Goes to a ramp tick and, if that is asked for, on as far as the velocity changes in the same way. Gives the
    /// time of the last tick, or the time at which the axis stopped before it.
    fn pass(&mut self, tick: u64, goes_on: bool) -> u64 {
        let (before, from) = (self.velocity, self.time);
        self.step(tick);
        if self.velocity == 0 {
            return self.stopped_at.filter(|&time| time > from).unwrap_or(tick);
        }
        if !goes_on {
            return tick;
        }
        let change = self.velocity - before;
        let longest = if before.abs() < SLOW { UNEVEN_TICKS_AHEAD } else { TICKS_AHEAD };
        let (mut on, ticks) = self.after(longest);
        let more = on.velocity - self.velocity;
        let is_even = i64::from(more) == i64::from(change) * ticks.cast_signed();
        let slow_ticks = u64::from((SLOW / change.abs().max(1)).unsigned_abs()) + 1;
        if ticks > UNEVEN_TICKS_AHEAD && !is_even {
            (on, _) = self.after(UNEVEN_TICKS_AHEAD);
        } else if on.velocity.abs() < SLOW && ticks > slow_ticks {
            (on, _) = self.after(ticks - slow_ticks);
        }
        let is_same = (on.velocity - self.velocity).signum() == change.signum()
            && [on.velocity, self.velocity].map(i32::signum) == [before.signum(); 2];
        if is_same {
            *self = on;
        }
        self.time
    }

    /// The state after so many ramp ticks, or less if they cannot be made in one go; and how many.
    fn after(&self, ticks: u64) -> (Self, u64) {
        let mut on = self.clone();
        on.stride(self.time.saturating_add(self.ramp_period() * ticks));
        let made = (on.time - self.time) / self.ramp_period();
        (on, made)
    }

    fn place_in(&self, direction: i32) -> i128 {
        let speed = u128::from(self.velocity.unsigned_abs() >> SPEED_SHIFT);
        let since = u128::from(self.time & (self.pulse_period() - 1));
        let shift = DIVISOR_MAX - self.settings.pulse_div;
        let part = i128::from(self.fraction << PULSE_SHIFT_MAX)
            + i128::try_from((speed * since) << shift).unwrap_or(0)
            - HALF;
        (i128::from(self.travel) << PLACE_SHIFT) + i128::from(direction) * part
    }
}
