//! The field of an axis whose velocity changes in ticks, as something that moves evenly.
//!
//! # What is approximated
//!
//! The controller changes its velocity in steps and makes whole microsteps. A motor is driven here by a field
//! without steps: its stretches of constant acceleration begin and end where the controller really is, with what it
//! has made of the next microstep. In between the field may be off by a part of a microstep, or by some of them while an
//! axis brakes in long ticks. Of the steps of the velocity, and of those of the acceleration while an axis brakes along
//! its curve, there is the mean.
//!
//! Where a write ends a stretch before its time, or an axis stops between two microsteps, the field goes on from where
//! it is, and makes up for the difference in the next stretch with an end, by at most an eighth of the way there. So it
//! can stand up to a microstep beside the counter after a stop at once. Nothing of that adds up: where an axis
//! comes to rest by itself the field is where the counter is, the last part of a microstep taken at once; and so it
//! is with what would be more than a microstep.

use opentmcl_motion::Instant;
use opentmcl_motion::ticked::{PLACE_SHIFT, Stretch};

use crate::field::Field;

/// Units of a place in a microstep.
const EXACT: f64 = (1u64 << PLACE_SHIFT) as f64;

/// Parts of a velocity of 1.
const VELOCITY: f64 = 256.0;

/// The part of the way of a stretch by which the field may make up for a difference.
const CORRECTION: f64 = 1.0 / 8.0;

/// So much less than what would bring the field to a stop within a stretch: it must not turn back.
const BELOW: f64 = 1.0 - 1e-9;

/// Fine steps in an electrical period.
const PERIOD: f64 = 1024.0;

/// How the field moves, and how it follows from the controller.
#[derive(Clone, Copy, Debug)]
pub(super) struct Course {
    field: Field,
    /// Position at the end of the stretch.
    end: f64,
    /// Where the field would be with the controller at 0, in fine steps.
    origin: f64,
    /// Fine steps in a microstep, negative if the motor turns the other way.
    scale: f64,
}

impl Course {
    /// A field at position 0 at time 0, which stands.
    pub(super) fn new() -> Self {
        let field = Field {
            from: Instant::from_ticks(0),
            until: None,
            position: 0.0,
            speed: 0.0,
            acceleration: 0.0,
        };
        Self { field, end: 0.0, origin: 0.0, scale: 0.0 }
    }

    pub(super) fn field(&self) -> &Field {
        &self.field
    }

    /// When the stretch has to be followed by another one, if that is not later than `now`.
    pub(super) fn ends_by(&self, now: Instant) -> Option<Instant> {
        self.field.until.filter(|&until| until <= now)
    }

    /// Sets the fine steps in a microstep, with the controller at this place. The field stays.
    pub(super) fn set_scale(&mut self, scale: f64, place: i128) {
        if scale != self.scale {
            self.origin = self.position_of(place) - steps(place) * scale;
            self.scale = scale;
        }
    }

    /// Lets the field jump to the nearest place at which the driver's sequencer is at its beginning.
    pub(super) fn go_to_period(&mut self, place: i128, now: Instant) {
        let nearest = libm::floor(self.field.position_at(now) / PERIOD + 0.5) * PERIOD;
        self.origin = nearest - steps(place) * self.scale;
        self.field = Field { from: now, until: None, position: nearest, ..self.field };
        (self.field.speed, self.field.acceleration) = (0.0, 0.0);
    }

    /// Goes on at `now` as the controller does from this place.
    pub(super) fn take(&mut self, stretch: &Stretch, place: i128, now: Instant) {
        let position = match self.field.until {
            Some(until) if until == now => self.end,
            _ => self.field.position_at(now),
        };
        let (exact, microstep) = (self.position_of(place), self.scale.abs());
        let position = position.clamp(exact - microstep, exact + microstep);
        let per_clock = self.scale / (1u64 << stretch.rate_shift) as f64;
        let whole = f64::from(stretch.velocity / (1 << 8));
        let mut field =
            Field { from: now, until: None, position, speed: whole * per_clock, acceleration: 0.0 };
        if let Some(until) = stretch.until {
            let clocks = until.as_ticks().saturating_sub(now.as_ticks()).max(1) as f64;
            let exact = steps(stretch.way) * self.scale;
            let missing = self.position_of(stretch.end) - position - exact;
            let most = exact.abs() * CORRECTION;
            let way = exact + missing.clamp(-most, most);
            self.end = if stretch.stops || missing.abs() <= most {
                self.position_of(stretch.end)
            } else {
                position + way
            };
            let mean = way / clocks;
            let steepest = 2.0 * mean.abs() / clocks * BELOW;
            let acceleration =
                f64::from(stretch.change) / VELOCITY * per_clock / stretch.clocks.max(1) as f64;
            field.until = stretch.until;
            field.acceleration = acceleration.clamp(-steepest, steepest);
            field.speed = mean - field.acceleration / 2.0 * clocks;
        }
        self.field = field;
    }

    /// Where the field belongs with the controller at a place.
    fn position_of(&self, place: i128) -> f64 {
        self.origin + steps(place) * self.scale
    }
}

fn steps(place: i128) -> f64 {
    place as f64 / EXACT
}
