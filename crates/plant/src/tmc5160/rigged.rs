//! The chip as a machine behind its motor sees it.

use opentmcl_motion::Instant;

use super::registers::{ENCMODE, VDCMIN, VMAX};
use super::{Coils, Field, Sense, Tmc5160};
use crate::axis::Chip;

impl Chip for Tmc5160 {
    fn field(&self, now: Instant) -> Field {
        Self::field(self, now)
    }

    fn coils(&self, now: Instant) -> Coils {
        Self::coils(self, now)
    }

    fn next_coil_change(&self, now: Instant) -> Option<Instant> {
        Self::next_coil_change(self, now)
    }

    fn next_threshold(&self, now: Instant) -> Option<Instant> {
        Self::next_threshold(self, now)
    }

    fn set_reference_inputs(&mut self, left: bool, right: bool, now: Instant) {
        Self::set_reference_inputs(self, left, right, now);
    }

    fn set_enabled(&mut self, enabled: bool, now: Instant) {
        Self::set_enabled(self, enabled, now);
    }

    fn set_sense(&mut self, sense: Sense, now: Instant) {
        Self::set_sense(self, sense, now);
    }

    fn set_flags(&mut self, flags: u32, now: Instant) {
        Self::set_flags(self, flags, now);
    }

    fn stallguard(&self, raw: u16) -> u16 {
        Self::stallguard(self, raw)
    }

    fn reading_interval(&self, now: Instant) -> Option<u64> {
        Self::reading_interval(self, now)
    }

    fn cool_active(&self, now: Instant) -> bool {
        Self::cool_active(self, now)
    }

    fn cool_reading(&mut self, result: u16, now: Instant) {
        Self::cool_reading(self, result, now);
    }

    fn cool_readings_to_change(&self, result: u16) -> Option<u32> {
        Self::cool_readings_to_change(self, result)
    }

    fn stall_stops(&self, now: Instant) -> bool {
        Self::stall_stops(self, now)
    }

    fn set_stallguard(&mut self, raw: u16) {
        Self::set_stallguard(self, raw);
    }

    fn stall(&mut self, now: Instant) {
        Self::stall(self, now);
    }

    fn dcstep_active(&self, now: Instant) -> bool {
        Self::dcstep_active(self, now)
    }

    fn dcstep_range(&self) -> (u32, u32) {
        (self.stored(VDCMIN), self.stored(VMAX))
    }

    fn fine_speed(&self, register: u32) -> f64 {
        Self::fine_speed(self, register)
    }

    fn set_speed_limit(&mut self, limit: Option<u32>, now: Instant) {
        Self::set_speed_limit(self, limit, now);
    }

    fn microsteps_per_fine_step(&self) -> f64 {
        Self::microsteps_per_fine_step(self)
    }

    fn encoder_scale(&self) -> f64 {
        Self::encoder_scale(self)
    }

    fn set_encoder_count(&mut self, count: i64, now: Instant) {
        Self::set_encoder_count(self, count, now);
    }

    fn wants_index(&self) -> bool {
        Self::wants_index(self)
    }

    fn encoder_index(&mut self, now: Instant) {
        // The pulse is as wide as a cycle of both channels: it meets the levels that are asked for.
        let mode = self.stored(ENCMODE);
        Self::encoder_index(self, mode & 1 == 1, mode >> 1 & 1 == 1, now);
    }

    fn watches_deviation(&self) -> Option<u32> {
        Self::watches_deviation(self)
    }

    fn encoder_difference(&self, now: Instant) -> i32 {
        Self::encoder_difference(self, now)
    }

    fn encoder_deviation(&self, now: Instant) -> u32 {
        Self::encoder_deviation(self, now)
    }

    fn deviate(&mut self, now: Instant) {
        Self::deviate(self, now);
    }
}
