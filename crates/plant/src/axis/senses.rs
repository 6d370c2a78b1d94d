//! What comes back from the machine to the chip: StallGuard2, CoolStep, the encoder, faults.

use opentmcl_motion::{Duration, Instant};

use super::rotor::{Rig, State};
use super::shaft::{CLOCK, Drive};
use super::{Chip, CoilFault};
use crate::driver::Sense;
use crate::field::Field;

/// StallGuard2 value towards which a motor without load goes as its back EMF grows.
const STALLGUARD_TOP: f64 = 800.0;

/// From this part of the supply on the back EMF spoils the measurement.
const EMF_LIMIT: f64 = 0.75;

/// Temperatures of the driver in degrees Celsius: warning, and shut-down until the warning ends.
const WARNING: f64 = 120.0;
const SHUT_DOWN: f64 = 150.0;

const FLAG_SHUT_DOWN: u32 = 1 << 25;
const FLAG_WARNING: u32 = 1 << 26;
const FLAG_SHORT: [u32; 2] = [1 << 27, 1 << 28];
const FLAG_OPEN: [u32; 2] = [1 << 29, 1 << 30];

/// The most readings that can come to nothing before one changes the current.
const READINGS: u64 = 64;

/// Temperature of a driver.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Temperature {
    warning: bool,
    shut_down: bool,
}

/// CoolStep readings under way.
#[derive(Clone, Copy, Debug)]
pub(super) struct Cooling {
    /// When the last one was taken.
    last: Instant,
    /// Clocks between two.
    interval: u64,
    /// SG_RESULT of those to come.
    result: u16,
}

impl Rig {
    pub(super) fn set_temperature(&mut self, celsius: f64) {
        self.temperature.warning = celsius >= WARNING;
        self.temperature.shut_down =
            celsius >= SHUT_DOWN || self.temperature.shut_down && self.temperature.warning;
    }

    /// StallGuard2 value without the threshold: falls linearly with the load to 0 where the motor is at its
    /// end.
    pub(super) fn raw_stallguard(&self, field: &Field, time: Instant) -> u16 {
        if matches!(self.state, State::Loose { .. }) {
            return 0;
        }
        let value = self.free_stallguard(field, time) * (1.0 - self.felt_load(field, time));
        libm::floor(value + 0.5) as u16
    }

    /// The same without load: it grows with the back EMF against the ohmic voltage.
    pub(super) fn free_stallguard(&self, field: &Field, time: Instant) -> f64 {
        let Drive::Field { amplitude, supply } = self.drive else { return 0.0 };
        let speed = self.shaft.radians_per_second(field.speed_at(time) * CLOCK).abs();
        let motor = &self.shaft.machine.motor;
        let emf = motor.torque_constant() * speed;
        if emf == 0.0 {
            return 0.0;
        }
        let rise = emf / (emf + motor.resistance * amplitude);
        let spoiled = ((supply - emf) / (supply * (1.0 - EMF_LIMIT))).clamp(0.0, 1.0);
        STALLGUARD_TOP * rise * spoiled
    }

    /// The error bits of the driver at `now`.
    pub(super) fn flags(&self, field: &Field, now: Instant) -> u32 {
        let mut flags = 0;
        if self.temperature.shut_down {
            flags |= FLAG_SHUT_DOWN;
        }
        if self.temperature.warning {
            flags |= FLAG_WARNING;
        }
        let turning = field.speed_at(now) != 0.0;
        for (coil, fault) in self.coil_faults.iter().enumerate() {
            match fault {
                Some(CoilFault::ShortToGround) => flags |= FLAG_SHORT[coil],
                // Seen by the chopper events that do not come while the polarity changes.
                Some(CoilFault::Open) if turning => flags |= FLAG_OPEN[coil],
                _ => {}
            }
        }
        flags
    }

    /// Tells the chip all that it measures at `now`.
    pub(super) fn sense(&self, chip: &mut impl Chip, now: Instant) {
        let field = chip.field(now);
        let pwm_scale = match self.drive {
            Drive::Field { amplitude, supply } => {
                let speed = self.shaft.radians_per_second(field.speed_at(now) * CLOCK);
                let load = self.felt_load(&field, now);
                let volts = self.shaft.machine.motor.phase_voltage(speed, amplitude, load);
                Some(libm::floor(volts / supply * 255.0 + 0.5).min(255.0) as u8)
            }
            Drive::Off | Drive::Shorted => Some(0),
        };
        let stallguard = self.raw_stallguard(&field, now);
        chip.set_sense(Sense { stallguard, pwm_scale, flags: self.flags(&field, now) }, now);
    }

    /// Count of the encoder with the rotor and the stage there.
    fn count_at(&self, rotor: f64, stage: f64) -> Option<i64> {
        let encoder = self.shaft.machine.encoder?;
        // It counts from where it stood when the module was switched on first.
        let shaft = if encoder.on_stage { stage } else { rotor } - self.origin;
        let counts = shaft / self.shaft.turn() * encoder.counts;
        Some(libm::floor(if encoder.reversed { -counts } else { counts }) as i64)
    }

    /// Tells the chip where the encoder is at `now`.
    pub(super) fn count(&self, chip: &mut impl Chip, now: Instant) {
        if self.shaft.machine.encoder.is_some() {
            let (rotor, _) = self.motion(&chip.field(now), now);
            if let Some(count) = self.count_at(rotor, self.stage_at(rotor)) {
                chip.set_encoder_count(count, now);
            }
        }
    }

    /// Microsteps of the encoder position for a fine step of the rotor.
    pub(super) fn encoder_ratio(&self, chip: &impl Chip) -> f64 {
        let Some(encoder) = self.shaft.machine.encoder else { return 0.0 };
        let ratio = encoder.counts / self.shaft.turn() * chip.encoder_scale();
        if encoder.reversed { -ratio } else { ratio }
    }

    /// The positions of the index next to a position of encoder's shaft: not above it, and above it.
    pub(super) fn index_around(&self, shaft: f64) -> Option<(f64, f64)> {
        let encoder = self.shaft.machine.encoder?;
        let turn = self.shaft.turn();
        let turns = libm::floor((shaft - encoder.index) / turn);
        let below = encoder.index + turns * turn;
        Some((below, below + turn))
    }

    /// The chip feels what the rotor does at `now`.
    pub(super) fn feel(&mut self, chip: &mut impl Chip, field: &Field, now: Instant) {
        self.feel_encoder(chip, now);
        self.feel_stall(chip, field, now);
        self.feel_cooling(chip, field, now);
        self.feel_dcstep(chip, field, now);
    }

    fn feel_encoder(&mut self, chip: &mut impl Chip, now: Instant) {
        let Some(encoder) = self.shaft.machine.encoder else { return };
        let shaft = if encoder.on_stage { self.stage } else { self.rotor };
        let before = core::mem::replace(&mut self.encoder_shaft, shaft);
        if chip.wants_index()
            && let Some((below, above)) = self.index_around(before)
            && !(below..above).contains(&shaft)
        {
            let index = if shaft >= above { above } else { below };
            if let Some(count) = self.count_at(index, index) {
                chip.set_encoder_count(count, now);
            }
            chip.encoder_index(now);
        }
        if let Some(limit) = chip.watches_deviation() {
            self.count(chip, now);
            if chip.encoder_deviation(now) > limit {
                chip.deviate(now);
            }
        }
    }

    fn feel_stall(&mut self, chip: &mut impl Chip, field: &Field, now: Instant) {
        if !chip.stall_stops(now) {
            self.stall_due = None;
            return;
        }
        // Whether the rotor follows has been decided since the driver was told what it measures.
        let raw = self.raw_stallguard(field, now);
        chip.set_stallguard(raw);
        if chip.stallguard(raw) != 0 {
            self.stall_due = None;
            return;
        }
        // The driver takes a reading with each full step.
        let interval = chip.reading_interval(now).unwrap_or_default();
        let due = *self.stall_due.get_or_insert(now + Duration::from_ticks(interval));
        if due <= now {
            self.stall_due = None;
            chip.stall(now);
        }
    }

    fn feel_cooling(&mut self, chip: &mut impl Chip, field: &Field, now: Instant) {
        if let Some(cooling) = &mut self.cooling {
            let elapsed = now.as_ticks().saturating_sub(cooling.last.as_ticks());
            let readings = elapsed / cooling.interval.max(1);
            for _ in 0..readings.min(READINGS) {
                chip.cool_reading(cooling.result, now);
            }
            cooling.last += Duration::from_ticks(readings * cooling.interval);
        }
        let interval = chip.reading_interval(now).filter(|_| chip.cool_active(now));
        self.cooling = interval.map(|interval| Cooling {
            last: self.cooling.map_or(now, |cooling| cooling.last),
            interval,
            result: chip.stallguard(self.raw_stallguard(field, now)),
        });
    }

    /// When the next CoolStep reading comes that matters. Where nothing changes, readings that come to
    /// nothing are passed over.
    pub(super) fn next_reading(&self, chip: &impl Chip, steady: bool) -> Option<Instant> {
        let cooling = self.cooling?;
        let readings = match chip.cool_readings_to_change(cooling.result) {
            Some(readings) if steady => u64::from(readings.max(1)),
            None if steady => return None,
            _ => 1,
        };
        Some(cooling.last + Duration::from_ticks(cooling.interval.max(1) * readings))
    }

    /// With DcStep the field waits for a rotor that cannot follow.
    fn feel_dcstep(&self, chip: &mut impl Chip, field: &Field, now: Instant) {
        let active = chip.dcstep_active(now);
        let limit = active.then(|| self.fastest_with_dcstep(chip, field, now)).flatten();
        chip.set_speed_limit(limit, now);
    }

    /// Whether DcStep is on, and the motor can follow at its lowest speed.
    pub(super) fn dcstep_copes(&self, chip: &impl Chip, field: &Field, now: Instant) -> bool {
        chip.dcstep_active(now) && self.copes(chip, field, now, chip.dcstep_range().0)
    }

    /// The highest speed in register units that the load allows; none if it does not slow the motor down.
    fn fastest_with_dcstep(&self, chip: &impl Chip, field: &Field, now: Instant) -> Option<u32> {
        let (lowest, nominal) = chip.dcstep_range();
        if self.copes(chip, field, now, nominal) {
            return None;
        }
        let (mut fits, mut too_fast) = (lowest, nominal);
        while too_fast.saturating_sub(fits) > 1 {
            let middle = fits.midpoint(too_fast);
            if self.copes(chip, field, now, middle) { fits = middle } else { too_fast = middle }
        }
        Some(fits)
    }

    /// Whether the motor can keep up this speed in register units in the present direction.
    fn copes(&self, chip: &impl Chip, field: &Field, now: Instant, register: u32) -> bool {
        let speed = chip.fine_speed(register) * field.speed_at(now).signum();
        let demand = self.shaft.demand(self.rotor, speed, 0.0).abs();
        demand <= self.shaft.available(self.drive, speed)
    }
}
