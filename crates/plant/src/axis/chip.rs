//! What a machine asks of the chips in front of its motor, and what it tells them.

use opentmcl_motion::Instant;

use crate::driver::{Coils, Sense};
use crate::field::Field;

/// The chips of one axis, whatever they are: something that turns a field, and a driver. They have come to the time
/// that they are asked about.
///
/// What only some have answers by default as where it is missing: changes of the coils by themselves, the stop
/// by stall, DcStep, an encoder.
pub(crate) trait Chip {
    /// The field of the stator in the stretch at `now`.
    fn field(&self, now: Instant) -> Field;

    /// What the driver does with the coils.
    fn coils(&self, now: Instant) -> Coils;

    /// When the coils next change by themselves.
    fn next_coil_change(&self, _now: Instant) -> Option<Instant> {
        None
    }

    /// When the speed next crosses a threshold within the stretch at `now`.
    fn next_threshold(&self, _now: Instant) -> Option<Instant> {
        None
    }

    /// Levels of the limit switches.
    fn set_reference_inputs(&mut self, left: bool, right: bool, now: Instant);

    /// Whether the driver may switch.
    fn set_enabled(&mut self, enabled: bool, now: Instant);

    /// All that the driver measures.
    fn set_sense(&mut self, sense: Sense, now: Instant);

    /// The error bits alone, as in [`Sense`].
    fn set_flags(&mut self, flags: u32, now: Instant);

    /// The load measurement as a register shows it, for a value before the threshold is added.
    fn stallguard(&self, raw: u16) -> u16;

    /// Clocks between two readings of StallGuard2; none at standstill.
    fn reading_interval(&self, now: Instant) -> Option<u64>;

    /// Whether CoolStep regulates the current now.
    fn cool_active(&self, now: Instant) -> bool;

    /// One reading for CoolStep.
    fn cool_reading(&mut self, result: u16, now: Instant);

    /// After how many readings of this value the current changes; none if it will not.
    fn cool_readings_to_change(&self, result: u16) -> Option<u32>;

    /// Whether a stall would stop the motor now.
    fn stall_stops(&self, _now: Instant) -> bool {
        false
    }

    /// The load measurement alone, before the threshold is added.
    fn set_stallguard(&mut self, _raw: u16) {}

    /// Stops the motor.
    fn stall(&mut self, _now: Instant) {}

    /// Whether DcStep is in use.
    fn dcstep_active(&self, _now: Instant) -> bool {
        false
    }

    /// The lowest and the highest speed of DcStep in register units.
    fn dcstep_range(&self) -> (u32, u32) {
        (0, 0)
    }

    /// Fine steps per second at a speed in register units.
    fn fine_speed(&self, _register: u32) -> f64 {
        0.0
    }

    /// The speed that the load allows in DcStep.
    fn set_speed_limit(&mut self, _limit: Option<u32>, _now: Instant) {}

    /// How far the position counter moves for one fine step of the field.
    fn microsteps_per_fine_step(&self) -> f64 {
        0.0
    }

    /// How far the position by the encoder moves for one of its counts.
    fn encoder_scale(&self) -> f64 {
        0.0
    }

    /// The count of the encoder.
    fn set_encoder_count(&mut self, _count: i64, _now: Instant) {}

    /// Whether something follows from the encoder's index.
    fn wants_index(&self) -> bool {
        false
    }

    /// The index has come, with the levels of both channels that are asked for.
    fn encoder_index(&mut self, _now: Instant) {}

    /// The largest allowed difference of the encoder and the counter, if that is watched.
    fn watches_deviation(&self) -> Option<u32> {
        None
    }

    /// That difference, with its sign.
    fn encoder_difference(&self, _now: Instant) -> i32 {
        0
    }

    /// The same without its sign.
    fn encoder_deviation(&self, _now: Instant) -> u32 {
        0
    }

    /// The encoder is too far from the counter.
    fn deviate(&mut self, _now: Instant) {}
}
