//! Where the rotor is: following the field, pressed against something, or loose.

use opentmcl_motion::Instant;

use super::senses::{Cooling, Temperature};
use super::shaft::{CLOCK, Drive, HALF_PERIOD, PERIOD, Shaft};
use super::switches::Contact;
use super::{Chip, CoilFault, Rotor, View};
use crate::driver::Coils;
use crate::field::Field;
use crate::machine::Machine;

/// Full steps of an electrical period.
const PERIOD_STEPS: i64 = 4;

/// Below this supply in volt the drivers do not work.
const LEAST_SUPPLY: f64 = 8.0;

/// What the rotor does.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum State {
    /// It stands where the field has it.
    Following,
    /// It stands at `at`, where something stops it, and the field is ahead in this direction.
    Pressed { at: f64, forward: bool },
    /// Nothing guides it: where and how fast (fine steps, per second) it was at [`Rig::since`].
    Loose { at: f64, speed: f64 },
}

/// The machine behind an axis in motion.
#[derive(Clone, Debug)]
pub(super) struct Rig {
    pub(super) shaft: Shaft,
    full_scale: f64,
    pub(super) supply: f64,
    pub(super) temperature: Temperature,
    pub(super) coil_faults: [Option<CoilFault>; 2],
    pub(super) drive: Drive,
    pub(super) state: State,
    /// Position of the rotor when the chip's field stood at 0.
    pub(super) origin: f64,
    /// Electrical periods by which the rotor has fallen behind the field.
    slipped: i64,
    /// The same at power-up.
    slipped_before: i64,
    /// The last moment at which anything has changed; rotor and stage then.
    pub(super) since: Instant,
    pub(super) rotor: f64,
    pub(super) speed: f64,
    pub(super) stage: f64,
    /// Where the encoder's shaft was when its index was looked at last.
    pub(super) encoder_shaft: f64,
    /// When StallGuard2 will have told a stall.
    pub(super) stall_due: Option<Instant>,
    pub(super) cooling: Option<Cooling>,
}

impl Rig {
    pub(super) fn new(machine: Machine, full_scale: f64) -> Self {
        let start = machine.stage.start;
        Self {
            shaft: Shaft::new(machine),
            full_scale,
            supply: 24.0,
            temperature: Temperature::default(),
            coil_faults: [None; 2],
            drive: Drive::Off,
            state: State::Following,
            origin: start,
            slipped: 0,
            slipped_before: 0,
            since: Instant::from_ticks(0),
            rotor: start,
            speed: 0.0,
            stage: start,
            encoder_shaft: start,
            stall_due: None,
            cooling: None,
        }
    }

    /// From now on only what is lost later counts as lost.
    pub(super) fn forget_losses(&mut self) {
        self.slipped_before = self.slipped;
    }

    /// Holds the rotor where it is, or lets it go.
    pub(super) fn block(&mut self, blocked: bool) {
        self.shaft.blocked = blocked.then_some(self.rotor);
    }

    /// Puts the rotor somewhere else, as far as the way goes.
    pub(super) fn put(&mut self, position: f64) {
        if self.shaft.blocked.is_some() {
            return;
        }
        let (lowest, highest) = self.shaft.limits();
        self.rotor = position.clamp(lowest, highest);
        self.speed = 0.0;
        self.state = State::Loose { at: self.rotor, speed: 0.0 };
        // A hand holds the stage: there is no play to be taken up.
        self.stage = self.rotor;
    }

    /// Position and speed of the rotor at a time up to which nothing has changed.
    pub(super) fn motion(&self, field: &Field, time: Instant) -> (f64, f64) {
        match self.state {
            State::Following => {
                let place = self.field_position(field, time) - Shaft::lag(self.load(field, time));
                // A load that varies along the way can push it to the end before that was foreseen.
                let (lowest, highest) = self.shaft.limits();
                (place.clamp(lowest, highest), field.speed_at(time) * CLOCK)
            }
            State::Pressed { at, .. } => (at, 0.0),
            State::Loose { at, speed } => {
                let clocks = time.as_ticks().saturating_sub(self.since.as_ticks());
                self.shaft.coast(self.drive, at, speed, clocks as f64 / CLOCK)
            }
        }
    }

    /// Position of the stage when the rotor comes to a position in one direction.
    pub(super) fn stage_at(&self, rotor: f64) -> f64 {
        let play = self.shaft.machine.stage.backlash / 2.0;
        self.stage.clamp(rotor - play, rotor + play)
    }

    /// The field at a time, in the rotor's coordinates, less the periods that the rotor has lost.
    pub(super) fn field_position(&self, field: &Field, time: Instant) -> f64 {
        self.behind(self.slipped, field, time)
    }

    fn behind(&self, periods: i64, field: &Field, time: Instant) -> f64 {
        field.position_at(time) + self.origin - periods as f64 * PERIOD
    }

    /// Part of the torque available that following takes, with its sign; infinite where there is none.
    pub(super) fn load(&self, field: &Field, time: Instant) -> f64 {
        self.load_at(self.field_position(field, time), field, time)
    }

    fn load_at(&self, position: f64, field: &Field, time: Instant) -> f64 {
        let speed = field.speed_at(time) * CLOCK;
        let acceleration = field.acceleration * CLOCK * CLOCK;
        let demand = self.shaft.demand(position, speed, acceleration);
        if demand == 0.0 { 0.0 } else { demand / self.shaft.available(self.drive, speed) }
    }

    /// Whether the field catches a rotor that it does not guide, and how many periods that rotor then is
    /// behind: of all positions of rest the field has, the nearest one takes it.
    pub(super) fn caught(
        &self,
        field: &Field,
        time: Instant,
        rotor: f64,
        speed: f64,
    ) -> Option<i64> {
        let periods =
            libm::floor(self.behind(0, field, time) / PERIOD - rotor / PERIOD + 0.5) as i64;
        let load = self.load_at(self.behind(periods, field, time), field, time);
        let field_speed = field.speed_at(time) * CLOCK;
        let available = self.shaft.available(self.drive, field_speed);
        self.shaft.catches(available, load, field_speed, speed).then_some(periods)
    }

    /// The load as the driver feels it, 0..=1, in whatever state.
    pub(super) fn felt_load(&self, field: &Field, time: Instant) -> f64 {
        match self.state {
            State::Following => self.load(field, time).abs().min(1.0),
            State::Pressed { at, .. } => {
                let ahead = (self.field_position(field, time) - at).abs();
                let quarter = PERIOD / 4.0;
                if ahead >= quarter {
                    1.0
                } else {
                    libm::sin(ahead / quarter * core::f64::consts::FRAC_PI_2)
                }
            }
            State::Loose { .. } => 1.0,
        }
    }

    /// Moves everything to `now`, which nothing has changed on the way to.
    pub(super) fn come_to(&mut self, chip: &impl Chip, now: Instant) {
        let (rotor, speed) = self.motion(&chip.field(now), now);
        self.stage = self.stage_at(rotor);
        self.rotor = rotor;
        self.speed = speed;
        if let State::Loose { at, speed } = &mut self.state {
            (*at, *speed) = (self.rotor, self.speed);
        }
        self.since = now;
    }

    /// Draws the consequences of whatever has changed at `now`.
    pub(super) fn settle(
        &mut self,
        chip: &mut impl Chip,
        contacts: &mut [Contact; 3],
        now: Instant,
    ) {
        chip.set_flags(self.flags(&chip.field(now), now), now);
        let field = chip.field(now);
        self.drive = self.drive_of(chip.coils(now));
        self.decide(chip, &field, now);
        let (rotor, speed) = self.motion(&field, now);
        (self.rotor, self.speed) = (rotor, speed);
        self.stage = self.stage_at(rotor);
        let circle = self.shaft.machine.stage.circle;
        for contact in contacts {
            contact.pass(self.stage, circle, now.as_ticks());
        }
        self.feel(chip, &field, now);
        // A switch may latch the encoder.
        self.count(chip, now);
    }

    fn drive_of(&self, coils: Coils) -> Drive {
        let broken = self.coil_faults.iter().any(Option::is_some);
        match coils {
            _ if self.supply < LEAST_SUPPLY => Drive::Off,
            Coils::Driven { .. } if broken => Drive::Off,
            Coils::Driven { scale, global } => Drive::Field {
                amplitude: self.full_scale * f64::from(scale) / 32.0 * f64::from(global) / 256.0,
                supply: self.supply,
            },
            Coils::Off => Drive::Off,
            Coils::Shorted if broken => Drive::Off,
            Coils::Shorted => Drive::Shorted,
        }
    }

    /// Whether the rotor, which is at [`Rig::rotor`], follows from now on.
    fn decide(&mut self, chip: &impl Chip, field: &Field, now: Instant) {
        let loose = State::Loose { at: self.rotor, speed: self.speed };
        if !matches!(self.drive, Drive::Field { .. }) {
            self.state = loose;
            return;
        }
        let apart = self.field_position(field, now) - self.rotor;
        let held = !matches!(self.state, State::Loose { .. }) && apart.abs() <= HALF_PERIOD;
        if held {
            let is_pressed = matches!(self.state, State::Pressed { .. });
            if is_pressed
                || self.load(field, now).abs() <= 1.0
                || self.dcstep_copes(chip, field, now)
            {
                self.take_place(field, now);
            } else {
                self.state = loose;
            }
            return;
        }
        match self.caught(field, now, self.rotor, self.speed) {
            Some(periods) => {
                self.slipped = periods;
                self.take_place(field, now);
            }
            None => self.state = loose,
        }
    }

    /// The rotor goes where the field has it, or as far as it can.
    fn take_place(&mut self, field: &Field, now: Instant) {
        let place = self.field_position(field, now) - Shaft::lag(self.load(field, now));
        let (lowest, highest) = self.shaft.limits();
        self.state = if place > highest {
            State::Pressed { at: highest, forward: true }
        } else if place < lowest {
            State::Pressed { at: lowest, forward: false }
        } else {
            State::Following
        };
    }

    /// What the axis really does at `now`.
    pub(super) fn view(&self, chip: &impl Chip, now: Instant, switches: [bool; 3]) -> View {
        let field = chip.field(now);
        let (rotor, speed) = self.motion(&field, now);
        let load = self.felt_load(&field, now);
        let driven = matches!(self.drive, Drive::Field { .. });
        let (load, load_angle, state) = match self.state {
            State::Following => (load, libm::asin(load).to_degrees(), Rotor::Following),
            State::Pressed { .. } => (load, libm::asin(load).to_degrees(), Rotor::Pressed),
            State::Loose { .. } if driven => (1.0, 0.0, Rotor::Slipping),
            State::Loose { .. } => (0.0, 0.0, Rotor::Free),
        };
        View {
            rotor,
            stage: self.stage_at(rotor),
            speed,
            load_angle,
            load,
            stallguard: chip.stallguard(self.raw_stallguard(&field, now)),
            current: match self.drive {
                Drive::Field { amplitude, .. } => amplitude,
                Drive::Off | Drive::Shorted => 0.0,
            },
            lost_steps: (self.slipped - self.slipped_before) * PERIOD_STEPS,
            state,
            switches,
        }
    }
}
