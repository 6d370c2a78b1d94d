//! The state of a machine, and what is done to it.

use opentmcl_motion::servo::{PERIOD_TICKS, Power, Senses};

use super::bridge::Legs;
use super::sensing::count;
use super::sensors::{Faults, Memory};
use super::step::{Dynamics, Inputs};
use super::thermal::Temperatures;
use super::{Influence, SECONDS_PER_TICK, Setup, WINDOW_TICKS};
use crate::axis::{Contact, SwitchInput};

/// Positions farther away, in fine steps, are none to which a hand moves a rotor.
const FARTHEST: f64 = 1e12;

/// All that changes.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct State {
    /// In ticks.
    pub(super) now: u64,
    pub(super) dynamics: Dynamics,
    pub(super) inputs: Inputs,
    /// Position of the stage in fine steps.
    pub(super) stage: f64,
    /// Left, right, home.
    contacts: [Contact; 3],
    has_switches: bool,
    temperatures: Temperatures,
    faults: Faults,
    memory: Memory,
    /// When the sensors were asked last, in ticks.
    sensed: u64,
}

impl State {
    pub(super) fn new(setup: &Setup) -> Self {
        let machine = &setup.plan.machine;
        let (stage, switches) = (&machine.stage, &machine.switches);
        let (lowest, highest) = setup.plan.shaft.limits;
        let start = stage.start.max(lowest).min(highest);
        let contact = |switch| Contact::new(switch, start, stage.circle);
        let all = [switches.left, switches.right, switches.home];
        let mut state = Self {
            now: 0,
            dynamics: Dynamics {
                current: [0.0; 2],
                position: start,
                speed: 0.0,
                bus: machine.supply.voltage,
                bus_current: 0.0,
                field: [0.0; 2],
            },
            inputs: Inputs {
                legs: Legs::new(),
                chopper: false,
                friction: 0.0,
                external: 0.0,
                blocked: false,
                source: machine.supply.voltage,
            },
            stage: start,
            contacts: all.map(contact),
            has_switches: all.iter().any(Option::is_some),
            temperatures: Temperatures::new(machine.thermal.ambient),
            faults: Faults::default(),
            memory: setup.sensors.memory(start, start),
            sensed: 0,
        };
        setup.plan.look_ahead(&mut state.dynamics);
        state.drive(setup, &Power::default());
        state
    }

    /// Moves on to a time.
    #[inline(always)]
    pub(super) fn come_to(&mut self, setup: &Setup, now: u64) {
        while now > self.now {
            let ticks = (now - self.now).min(PERIOD_TICKS);
            self.step(setup, ticks);
        }
    }

    #[inline(always)]
    fn step(&mut self, setup: &Setup, ticks: u64) {
        let square = if ticks == PERIOD_TICKS {
            setup.plan.period(&mut self.dynamics, &self.inputs)
        } else {
            let seconds = ticks as f64 * SECONDS_PER_TICK;
            setup.plan.part(&mut self.dynamics, &self.inputs, seconds)
        };
        self.now += ticks;
        self.temperatures.collected += square;
        self.temperatures.pass(&setup.plan.heat, self.now);
        self.follow(setup);
    }

    /// The stage follows the rotor, and the switches the stage.
    #[inline(always)]
    fn follow(&mut self, setup: &Setup) {
        let stage = &setup.plan.machine.stage;
        let rotor = self.dynamics.position;
        self.stage = if stage.backlash == 0.0 {
            rotor
        } else {
            let play = stage.backlash / 2.0;
            self.stage.max(rotor - play).min(rotor + play)
        };
        if self.has_switches {
            for contact in &mut self.contacts {
                contact.pass(self.stage, stage.circle, self.now);
            }
        }
    }

    #[inline(always)]
    pub(super) fn sense(&mut self, setup: &Setup) -> Senses {
        let currents = setup.plan.winding.wiring.currents(self.dynamics.current);
        let mut senses = Senses {
            currents: setup.converters.read(currents, &self.inputs.legs, self.now / PERIOD_TICKS),
            supply: count(self.dynamics.bus * 100.0),
            driver_fault: self.inputs.legs.fault,
            ..Senses::default()
        };
        let ticks = self.now - self.sensed;
        let at = (self.dynamics.position, self.stage);
        setup.sensors.read(&mut self.memory, at, self.faults, ticks, &mut senses);
        self.sensed = self.now;
        senses
    }

    #[inline(always)]
    pub(super) fn drive(&mut self, setup: &Setup, power: &Power) {
        let plan = &setup.plan;
        self.inputs.legs.drive(plan.winding.wiring, &power.legs);
        self.inputs.chopper = power.chopper;
        let held = plan.machine.brake.filter(|brake| power.brake < brake.release_duty);
        self.inputs.friction = plan.shaft.friction + held.map_or(0.0, |brake| brake.torque);
    }

    pub(super) fn influence(&mut self, setup: &Setup, influence: Influence) {
        let heat = &setup.plan.heat;
        match influence {
            Influence::SourceVoltage(number)
            | Influence::Ambient(number)
            | Influence::DriverTemperature(number)
            | Influence::WindingTemperature(number)
            | Influence::Torque(number)
            | Influence::Position(number)
                if !number.is_finite() => {}
            Influence::SourceVoltage(volts) => self.inputs.source = volts.max(0.0),
            Influence::Ambient(celsius) => self.temperatures.set_ambient(celsius, heat, self.now),
            Influence::DriverTemperature(celsius) => {
                self.temperatures.set_driver(celsius, heat, self.now);
            }
            Influence::WindingTemperature(celsius) => {
                self.temperatures.set_winding(celsius, heat, self.now);
            }
            Influence::Torque(torque) => self.inputs.external = torque,
            Influence::Blocked(blocked) => {
                self.inputs.blocked = blocked;
                if blocked {
                    self.dynamics.speed = 0.0;
                }
            }
            Influence::Position(fine_steps) => self.put(setup, fine_steps),
            Influence::HallLine(line, fault) => self.faults.set(line, fault),
            Influence::DriverFault(fault) => self.inputs.legs.fault = fault,
            Influence::PhaseOpen(phase, open) => {
                if let Some(phase) = self.inputs.legs.cut.get_mut(usize::from(phase)) {
                    *phase = open;
                }
            }
            Influence::Switch(switch, held) => self.hold(switch, held),
        }
        // What follows from faults, wires that are off, position and speed.
        let legs = &mut self.inputs.legs;
        legs.drive(setup.plan.winding.wiring, &legs.told.clone());
        setup.plan.look_ahead(&mut self.dynamics);
    }

    fn hold(&mut self, switch: SwitchInput, held: Option<bool>) {
        let [left, right, home] = &mut self.contacts;
        let contact = match switch {
            SwitchInput::Left => left,
            SwitchInput::Right => right,
            SwitchInput::Home => home,
        };
        contact.hold(held);
        self.has_switches = true;
    }

    fn put(&mut self, setup: &Setup, position: f64) {
        if self.inputs.blocked {
            return;
        }
        let (lowest, highest) = setup.plan.shaft.limits;
        let position = position.clamp(-FARTHEST, FARTHEST).max(lowest).min(highest);
        self.dynamics.position = position;
        self.dynamics.speed = 0.0;
        // A hand holds the stage: there is no play to be taken up.
        self.stage = position;
        self.follow(setup);
    }

    pub(super) fn has_switches(&self) -> bool {
        self.has_switches
    }

    pub(super) fn switches(&self) -> [bool; 3] {
        self.contacts.each_ref().map(|contact| contact.level(self.now))
    }

    pub(super) fn temperatures(&self, setup: &Setup, now: u64) -> [f64; 2] {
        self.temperatures.at(&setup.plan.heat, now)
    }

    pub(super) fn is_still(&self, setup: &Setup) -> bool {
        let bounces = self.contacts.iter().any(|contact| contact.next_bounce(self.now).is_some());
        if bounces || setup.converters.is_noisy() || self.dynamics.speed != 0.0 {
            return false;
        }
        // What is the same after a step, and whose losses are the same after a window, will be so after any number.
        let mut ahead = *self;
        ahead.step(setup, PERIOD_TICKS);
        ahead.sense(setup);
        if (ahead.dynamics, ahead.stage, ahead.memory) != (self.dynamics, self.stage, self.memory) {
            return false;
        }
        let end = self.now + WINDOW_TICKS;
        while ahead.now < end {
            ahead.step(setup, PERIOD_TICKS);
        }
        // Whether the sensors have been asked meanwhile does not matter.
        ahead.sensed = end - (self.now - self.sensed);
        ahead == self.later(WINDOW_TICKS)
    }

    pub(super) fn skip(&mut self, setup: &Setup, now: u64) {
        let windows = now.saturating_sub(self.now) / WINDOW_TICKS;
        if windows > 1 && self.is_still(setup) {
            *self = self.later(windows * WINDOW_TICKS);
        }
        while now > self.now {
            let ticks = (now - self.now).min(PERIOD_TICKS);
            self.step(setup, ticks);
            self.sense(setup);
        }
    }

    /// The same state at another time.
    fn later(&self, ticks: u64) -> Self {
        Self {
            now: self.now + ticks,
            sensed: self.sensed + ticks,
            temperatures: self.temperatures.later(ticks),
            ..*self
        }
    }
}
