//! The chips of one axis together: its third of a controller, and its driver.

use core::num::NonZeroU64;

use opentmcl_motion::Instant;

use super::course::Course;
use crate::axis::Chip;
use crate::field::Field;
use crate::tmc26x::{Coils, Motion, Sense, Tmc26x};
use crate::tmc429::Tmc429;
use crate::tmc429::registers::{DIVISORS, IF_CONFIGURATION, of_axis};

/// IF_CONFIGURATION: the direction pins of the three axes are inverted.
const INVERT_DIRECTION: u32 = 1 << 4;

/// Binary logarithm of the clocks in which [`Motion`] counts, less that of the clocks between two pulses with
/// a speed of 1 and a pulse divisor of 0.
const RATE_SHIFT: u32 = 37 - 16;

/// What an axis has for itself: its driver, and what has come from the controller.
#[derive(Clone, Debug)]
pub(super) struct Wires {
    pub(super) driver: Tmc26x,
    /// Pulses that have been counted.
    pulses: i64,
    /// Position of the field in fine steps, as the pulses turn it.
    pub(super) counted: f64,
    /// Levels of the left and the right switch.
    levels: (bool, bool),
    /// The field in motion, for an axis with a machine.
    course: Option<Course>,
}

impl Wires {
    /// An axis at 0 that is switched on at time 0.
    pub(super) fn new(has_machine: bool) -> Self {
        Self {
            driver: Tmc26x::new(),
            pulses: 0,
            counted: 0.0,
            levels: (false, false),
            course: has_machine.then(Course::new),
        }
    }
}

/// The chips of an axis.
pub(super) struct Chips<'a> {
    pub(super) controller: &'a mut Tmc429,
    pub(super) motor: usize,
    pub(super) wires: &'a mut Wires,
}

impl Chips<'_> {
    /// Lets the driver follow what the controller has done until `now`. Must precede anything that is asked of the
    /// controller about that time.
    pub(super) fn advance(&mut self, now: Instant) {
        while let Some(end) = self.wires.course.as_ref().and_then(|course| course.ends_by(now)) {
            self.take_course(end);
        }
        self.count(now);
    }

    /// Finds out anew how the field goes on, after a change.
    pub(super) fn renew(&mut self, now: Instant) {
        self.count(now);
        if self.wires.course.is_some() {
            self.take_course(now);
        }
    }

    /// Switches the driver off and on; the controller has been.
    pub(super) fn reset_driver(&mut self, now: Instant) {
        self.count(now);
        self.wires.driver.reset(now);
        let place = self.controller.place(self.motor, now);
        if let Some(course) = &mut self.wires.course {
            course.go_to_period(place, now);
        }
        self.renew(now);
    }

    /// Fine steps by which a microstep turns the motor.
    pub(super) fn scale(&mut self, now: Instant) -> i64 {
        let is_reversed = self.controller.read(IF_CONFIGURATION, now) & INVERT_DIRECTION != 0;
        let steps = self.wires.driver.fine_steps_per_pulse();
        if is_reversed { -steps } else { steps }
    }

    /// Exponent of the clocks between two pulse ticks.
    pub(super) fn pulse_divisor(&mut self, now: Instant) -> u32 {
        self.controller.read(of_axis(self.motor as u8, DIVISORS), now) >> 12 & 0xF
    }

    fn take_course(&mut self, now: Instant) {
        let scale = self.scale(now) as f64;
        let place = self.controller.place(self.motor, now);
        let stretch = self.controller.stretch(self.motor, now);
        if let (Some(course), Some(stretch)) = (&mut self.wires.course, stretch) {
            course.set_scale(scale, place);
            course.take(&stretch, place, now);
        }
    }

    fn count(&mut self, now: Instant) {
        let scale = self.scale(now);
        let pulses = self.controller.travel(self.motor, now);
        let speed = u64::from(self.controller.velocity(self.motor, now).unsigned_abs());
        let moves = self.controller.exact_velocity(self.motor, now) != 0;
        // An axis that begins to move, or turns back, has no whole speed for a while.
        let rate = (speed << (RATE_SHIFT - self.pulse_divisor(now))).max(u64::from(moves));
        let since = self.controller.stopped_at(self.motor, now);
        let wires = &mut *self.wires;
        let new = pulses - core::mem::replace(&mut wires.pulses, pulses);
        wires.driver.step(if scale < 0 { -new } else { new } as i32);
        wires.counted += (new * scale) as f64;
        let motion = match NonZeroU64::new(rate) {
            Some(rate) => Motion::Moving { rate },
            None => Motion::Standing { since: since.unwrap_or(Instant::from_ticks(0)) },
        };
        wires.driver.set_motion(motion, now);
    }
}

impl Chip for Chips<'_> {
    fn field(&self, _now: Instant) -> Field {
        self.wires.course.as_ref().map_or_else(|| *Course::new().field(), |course| *course.field())
    }

    fn coils(&self, now: Instant) -> Coils {
        self.wires.driver.coils(now)
    }

    fn set_reference_inputs(&mut self, left: bool, right: bool, now: Instant) {
        if (left, right) != self.wires.levels {
            self.wires.levels = (left, right);
            self.controller.set_reference_inputs(self.motor, left, right, now);
            self.renew(now);
        }
    }

    fn set_enabled(&mut self, enabled: bool, now: Instant) {
        self.wires.driver.set_enabled(enabled, now);
    }

    fn set_sense(&mut self, sense: Sense, now: Instant) {
        self.wires.driver.set_sense(sense, now);
    }

    fn set_flags(&mut self, flags: u32, now: Instant) {
        self.wires.driver.set_flags(flags, now);
    }

    fn stallguard(&self, raw: u16) -> u16 {
        self.wires.driver.stallguard(raw)
    }

    fn reading_interval(&self, now: Instant) -> Option<u64> {
        self.wires.driver.reading_interval(now)
    }

    fn cool_active(&self, now: Instant) -> bool {
        self.wires.driver.cool_active(now)
    }

    fn cool_reading(&mut self, result: u16, now: Instant) {
        self.wires.driver.cool_reading(result, now);
    }

    fn cool_readings_to_change(&self, result: u16) -> Option<u32> {
        self.wires.driver.cool_readings_to_change(result)
    }
}
