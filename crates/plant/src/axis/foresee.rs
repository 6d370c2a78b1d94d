//! When something next changes on a rig by itself.
//!
//! Within a stretch of the ramp everything is a smooth function of the time, so the moment at which a
//! condition begins to hold is looked for by halving. What can be ruled out by a bound is not looked for.

use opentmcl_motion::{Duration, Instant};

use super::Chip;
use super::rotor::{Rig, State};
use super::shaft::{CLOCK, Drive, HALF_PERIOD, Shaft};
use super::switches::Contact;
use crate::field::Field;

/// Clocks of a step of a rotor that no field guides: half a millisecond.
const COASTING_STEP: u64 = 8_000;

/// Where a load depends on the position, a stretch without end is looked at again after a second.
const HORIZON: u64 = 16_000_000;

/// Points at which a stretch is looked at for a condition that may come and go.
const SAMPLES: u64 = 32;

/// Fine steps behind a place, so that the place itself counts as passed in both directions.
const BEHIND: f64 = 1e-3;

/// What a rig knows of its future.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Foresight {
    /// When it next has to be looked at, later than now; none if nothing will happen by itself.
    pub(super) due: Option<Instant>,
    /// Whether StallGuard2 cannot come to 0 until then.
    pub(super) no_stall: bool,
}

/// What surrounds a rig while it looks ahead.
struct Scene<'a, C> {
    chip: &'a C,
    contacts: &'a [Contact; 3],
    field: Field,
    /// Whether the field moves.
    turning: bool,
}

impl Rig {
    /// When the rig next has to be looked at, and what can be said of the time until then.
    pub(super) fn foresee(
        &self,
        chip: &impl Chip,
        contacts: &[Contact; 3],
        now: Instant,
    ) -> Foresight {
        let field = chip.field(now);
        let mut next = Earliest::after(now);
        next.offer(self.stall_due);
        next.offer(chip.next_coil_change(now));
        for contact in contacts {
            next.offer(contact.next_bounce(now.as_ticks()).map(Instant::from_ticks));
        }
        let turning = field.speed != 0.0 || field.acceleration != 0.0;
        let scene = Scene { chip, contacts, field, turning };
        if matches!(self.drive, Drive::Field { .. }) {
            next.offer(field.until);
            next.offer(chip.next_threshold(now));
            if turning {
                next.offer(self.next_reading(chip, self.is_steady(&field)));
                if next.time.is_none() && !self.is_steady(&field) {
                    next.offer(Some(now + Duration::from_ticks(HORIZON)));
                }
            }
        }
        match self.state {
            State::Following if turning => self.foresee_following(&scene, &mut next),
            State::Pressed { at, forward } if turning => {
                self.foresee_pressed(at, forward, &field, &mut next);
            }
            State::Following | State::Pressed { .. } => {}
            State::Loose { at, speed } => self.foresee_loose(at, speed, &scene, &mut next),
        }
        let no_stall = !self.foresee_stall(&scene, &mut next);
        self.foresee_deviation(&scene, &mut next);
        Foresight { due: next.time, no_stall }
    }

    /// Whether load and speed stay as they are until the ramp changes.
    fn is_steady(&self, field: &Field) -> bool {
        field.acceleration == 0.0 && !self.shaft.machine.load.varies()
    }

    fn foresee_following(&self, scene: &Scene<'_, impl Chip>, next: &mut Earliest) {
        let Scene { chip, field, .. } = scene;
        let now = next.now;
        if !self.is_steady(field)
            && let Some(end) = next.time
            && self.largest_load(field, now, end) > 1.0
            && !chip.dcstep_active(now)
        {
            next.look_for(|time| self.load(field, time).abs() > 1.0);
        }
        let forward = if field.speed == 0.0 { field.acceleration > 0.0 } else { field.speed > 0.0 };
        let speed = field.speed_at(now);
        if let Some(place) = self.place_ahead(scene, forward) {
            if next.time.is_none() {
                // It cruises for ever: it is there at the latest when the field is a period farther.
                let clocks = ((place - self.rotor).abs() + 2.0 * HALF_PERIOD) / speed.abs();
                next.offer(later(now, clocks));
            }
            next.look_for_one_crossing(|time| {
                has_passed(self.motion(field, time).0, place, forward)
            });
        }
    }

    fn foresee_pressed(&self, at: f64, forward: bool, field: &Field, next: &mut Earliest) {
        let ahead = |time| {
            let ahead = self.field_position(field, time) - at;
            if forward { ahead } else { -ahead }
        };
        if next.time.is_none() {
            let clocks = (ahead(next.now).abs() + 2.0 * HALF_PERIOD) / field.speed.abs();
            next.offer(later(next.now, clocks));
        }
        let lag = |time| {
            let lag = Shaft::lag(self.load(field, time));
            if forward { lag } else { -lag }
        };
        next.look_for_one_crossing(|time| {
            let ahead = ahead(time);
            ahead > HALF_PERIOD || ahead < lag(time)
        });
    }

    fn foresee_loose(
        &self,
        at: f64,
        speed: f64,
        scene: &Scene<'_, impl Chip>,
        next: &mut Earliest,
    ) {
        let field = &scene.field;
        let now = next.now;
        let driven = matches!(self.drive, Drive::Field { .. });
        if speed == 0.0 && self.shaft.stays(at) {
            if driven && scene.turning && next.time.is_some() {
                next.look_for(|time| self.caught(field, time, at, 0.0).is_some());
            }
            return;
        }
        next.offer(Some(now + Duration::from_ticks(COASTING_STEP)));
        let forward = if speed == 0.0 { self.shaft.acting(at) > 0.0 } else { speed > 0.0 };
        if let Some(place) = self.place_ahead(scene, forward) {
            next.look_for_one_crossing(|time| {
                has_passed(self.motion(field, time).0, place, forward)
            });
        }
    }

    /// Whether StallGuard2 can come to 0 in the time that is open to be looked at.
    fn may_stall(&self, chip: &impl Chip, field: &Field, next: &Earliest) -> bool {
        let (Some(end), State::Following) = (next.time, self.state) else {
            return next.time.is_some();
        };
        if self.is_steady(field) {
            // It is what it is now, which is not 0.
            return false;
        }
        // Without load the value has its least at the slowest or at the fastest.
        let free = self.free_stallguard(field, next.now).min(self.free_stallguard(field, end));
        let load = self.largest_load(field, next.now, end);
        chip.stallguard((free * (1.0 - load).max(0.0)) as u16) == 0
    }

    /// No load between two moments of a stretch is larger.
    fn largest_load(&self, field: &Field, now: Instant, end: Instant) -> f64 {
        let (from, to) = (field.speed_at(now) * CLOCK, field.speed_at(end) * CLOCK);
        let available =
            self.shaft.available(self.drive, from).min(self.shaft.available(self.drive, to));
        let demand = self.shaft.largest_demand(
            self.field_position(field, now),
            self.field_position(field, end),
            from.abs().max(to.abs()),
            field.acceleration * CLOCK * CLOCK,
        );
        if demand == 0.0 { 0.0 } else { demand / available }
    }

    /// Looks for a stall where StallGuard2 would stop the motor; false if there can be none.
    fn foresee_stall(&self, scene: &Scene<'_, impl Chip>, next: &mut Earliest) -> bool {
        let Scene { chip, field, .. } = scene;
        if !scene.turning || self.stall_due.is_some() || !chip.stall_stops(next.now) {
            return true;
        }
        let possible = self.may_stall(*chip, field, next);
        if possible {
            next.look_for(|time| chip.stallguard(self.raw_stallguard(field, time)) == 0);
        }
        possible
    }

    /// Looks for the moment at which the encoder is too far from the position counter.
    fn foresee_deviation(&self, scene: &Scene<'_, impl Chip>, next: &mut Earliest) {
        let &Scene { chip, ref field, turning, .. } = scene;
        let now = next.now;
        let Some(limit) = chip.watches_deviation() else { return };
        let limit = f64::from(limit);
        let ratio = self.encoder_ratio(chip);
        let counter = chip.microsteps_per_fine_step();
        let present = chip.encoder_difference(now);
        if f64::from(present).abs() > limit {
            return;
        }
        let rotor = self.rotor;
        let start = field.position_at(now);
        let difference = |time| {
            f64::from(present) + (self.motion(field, time).0 - rotor) * ratio
                - (field.position_at(time) - start) * counter
        };
        if let State::Following = self.state
            && let Some(end) = next.time
        {
            // The rotor moves as far as the field does, but for its lag, which is less than half a period.
            let way = (field.position_at(end) - start).abs();
            let reach = way * (ratio - counter).abs() + HALF_PERIOD * ratio.abs();
            if f64::from(present).abs() + reach <= limit {
                return;
            }
        }
        if next.time.is_none() {
            if !turning {
                return;
            }
            next.offer(Some(now + Duration::from_ticks(HORIZON)));
        }
        next.look_for(|time| difference(time).abs() > limit);
    }

    /// The next position of the rotor in one direction at which something happens: an end of the way, an
    /// edge of a switch, an index that somebody waits for.
    fn place_ahead(&self, scene: &Scene<'_, impl Chip>, forward: bool) -> Option<f64> {
        let stage = &self.shaft.machine.stage;
        let play = stage.backlash / 2.0;
        let by_stage = |place: f64| if forward { place + play } else { place - play };
        let mut nearest = if forward { f64::INFINITY } else { f64::NEG_INFINITY };
        let mut offer = |place: f64| {
            nearest = if forward { nearest.min(place) } else { nearest.max(place) };
        };
        let (lowest, highest) = self.shaft.limits();
        offer(if forward { highest } else { lowest });
        for contact in scene.contacts {
            if let Some(edge) = contact.edge_ahead(self.stage, forward, stage.circle) {
                offer(by_stage(edge));
            }
        }
        if scene.chip.wants_index()
            && let Some(encoder) = self.shaft.machine.encoder
        {
            let shaft = if encoder.on_stage { self.stage } else { self.rotor };
            if let Some((below, above)) = self.index_around(shaft) {
                let index = if forward { above } else { below - BEHIND };
                offer(if encoder.on_stage { by_stage(index) } else { index });
            }
        }
        nearest.is_finite().then_some(nearest)
    }
}

/// Whether a rotor has come to a place, moving in one direction.
fn has_passed(rotor: f64, place: f64, forward: bool) -> bool {
    if forward { rotor >= place } else { rotor <= place }
}

fn later(now: Instant, clocks: f64) -> Option<Instant> {
    // A place that is farther than the clock counts is never reached.
    (clocks < 1e18).then(|| now + Duration::from_ticks(clocks as u64 + 1))
}

/// The earliest of several moments, all later than `now`.
struct Earliest {
    now: Instant,
    time: Option<Instant>,
}

impl Earliest {
    const fn after(now: Instant) -> Self {
        Self { now, time: None }
    }

    fn offer(&mut self, time: Option<Instant>) {
        let soonest = self.now + Duration::from_ticks(1);
        if let Some(time) = time {
            let time = time.max(soonest);
            self.time = Some(self.time.map_or(time, |earliest| earliest.min(time)));
        }
    }

    /// Offers the first moment at which a condition holds, if it holds at the end of the time that is open
    /// to be looked at, before which it changes once.
    fn look_for_one_crossing(&mut self, holds: impl Fn(Instant) -> bool) {
        if let Some(end) = self.time
            && holds(end)
        {
            self.time = Some(first(self.now, end, holds));
        }
    }

    /// Offers the first moment at which a condition holds, as far as it holds at one of the samples.
    fn look_for(&mut self, holds: impl Fn(Instant) -> bool) {
        let Some(end) = self.time else { return };
        let clocks = end.as_ticks() - self.now.as_ticks();
        let mut before = self.now;
        for sample in 1..=SAMPLES {
            let part = u128::from(clocks) * u128::from(sample) / u128::from(SAMPLES);
            let time = self.now + Duration::from_ticks(part as u64);
            if time > before && holds(time) {
                self.time = Some(first(before, time, holds));
                return;
            }
            before = time;
        }
    }
}

/// The first moment after `before` at which a condition holds that holds at `end`.
fn first(before: Instant, end: Instant, holds: impl Fn(Instant) -> bool) -> Instant {
    let (mut not_yet, mut already) = (before.as_ticks(), end.as_ticks());
    while already - not_yet > 1 {
        let middle = not_yet.midpoint(already);
        if holds(Instant::from_ticks(middle)) { already = middle } else { not_yet = middle }
    }
    Instant::from_ticks(already)
}
