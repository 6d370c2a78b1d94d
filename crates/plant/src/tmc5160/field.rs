//! The magnetic field that the driver turns: where it points, which MSCNT tells modulo one period.
//!
//! The position counter is a number; the field is a thing. Writing XACTUAL, another microstep resolution,
//! another direction of the shaft and the wrap of the counter change the one and leave the other where
//! it is. The field counts 1/256 full steps ("fine steps") and never wraps.
//!
//! Between two microsteps it moves evenly, as with the interpolation of the chip. The last half of a
//! microstep before a target it takes at once, as the ramp does.

use opentmcl_motion::Instant;
use opentmcl_motion::ramp::Stretch;

use super::microstep::PERIOD;
use super::{Field, Tmc5160, registers};

/// Exact units in a microstep and in a fine step, as in [`Stretch`]: 2^42.
const EXACT: f64 = (1u64 << 42) as f64;

const EXACT_SHIFT: u32 = 42;

/// Where the field is while the position counter stands at 0.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Origin {
    /// What MSCNT counts, in fine steps.
    count: i64,
    /// By how much the field is off this count, in exact units: the part of a microstep that the ramp
    /// had on its way when the counter or its scale was changed.
    part: i128,
}

/// The field at a time, kept over a change of the counter.
#[derive(Clone, Copy, Debug)]
pub(super) struct Place {
    count: i64,
    exact: i128,
}

impl Tmc5160 {
    /// The field of the stator in the stretch of the ramp at `now`.
    pub fn field(&self, now: Instant) -> Field {
        let stretch = self.ramp.stretch(now);
        let scale = (self.direction() << self.microstep_shift()) as f64 / EXACT;
        Field {
            from: stretch.from,
            until: stretch.until,
            position: self.exact_field(stretch.position) as f64 / EXACT,
            // A stretch covers 2 v n + a n² exact units of the counter.
            speed: 2.0 * stretch.velocity as f64 * scale,
            acceleration: 2.0 * f64::from(stretch.acceleration) * scale,
        }
    }

    /// MSCNT: the place of the field in the table of one electrical period.
    pub(super) fn mscnt(&self, now: Instant) -> u32 {
        self.counted_field(now).rem_euclid(i64::from(PERIOD)) as u32
    }

    pub(super) fn place(&self, now: Instant) -> Place {
        let exact = self.exact_field(self.exact_counter(now));
        Place { count: self.counted_field(now), exact }
    }

    /// Leaves the field where it was before the counter or its scale was changed.
    pub(super) fn keep_field(&mut self, place: Place, now: Instant) {
        self.origin = Origin::default();
        let new = self.place(now);
        let count = place.count - new.count;
        let part = place.exact - new.exact - (i128::from(count) << EXACT_SHIFT);
        self.origin = Origin { count, part };
    }

    /// Lets the field jump to the nearest place at which MSCNT is 0, as it does with the power.
    pub(super) fn nearest_period(&self, now: Instant) -> Origin {
        let period = i64::from(PERIOD);
        let count = self.counted_field(now) + period / 2;
        Origin { count: count - count.rem_euclid(period), part: 0 }
    }

    /// -1 while GCONF.shaft turns the motor the other way.
    fn direction(&self) -> i64 {
        if self.stored(registers::GCONF) >> 4 & 1 == 1 { -1 } else { 1 }
    }

    fn counted_field(&self, now: Instant) -> i64 {
        let half = 1 << (EXACT_SHIFT - 1);
        let microsteps = ((self.exact_counter(now) + half) >> EXACT_SHIFT) as i64;
        self.origin.count + self.direction() * (microsteps << self.microstep_shift())
    }

    /// The exact position counter, not wrapped within one plan.
    fn exact_counter(&self, now: Instant) -> i128 {
        let Stretch { from, position, velocity, acceleration, .. } = self.ramp.stretch(now);
        let clocks = i128::from(now.as_ticks().saturating_sub(from.as_ticks()));
        position + (2 * i128::from(velocity) + i128::from(acceleration) * clocks) * clocks
    }

    fn exact_field(&self, position: i128) -> i128 {
        let counter = (i128::from(self.direction()) * position) << self.microstep_shift();
        (i128::from(self.origin.count) << EXACT_SHIFT) + self.origin.part + counter
    }
}
