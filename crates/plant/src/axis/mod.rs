//! One axis: a motion chip and, if it has one, the machine that its motor turns.
//!
//! The chip tells where the field stands and how strong it is; the machine tells where the rotor then
//! is, and what of it comes back: switches, encoder, load. Between two events all of that is a function
//! of the time, so that asking changes nothing and an hour of cruising costs as much as a second.
//!
//! - `shaft`: torques, and how a shaft moves without a field.
//! - `rotor`: whether the rotor follows, is pressed against something, or is loose.
//! - `foresee`: when that next changes.
//! - `senses`: what comes back to the chip: StallGuard2, CoolStep, the encoder, faults.
//! - `switches`: contacts.
//!
//! # What is approximated
//!
//! - A rotor that follows the field does so at once, with the load angle at which the motor's torque is
//!   what the motion takes: `sin(angle) = demand / available`. It does not swing.
//! - A rotor that has lost the field gets no torque from it on average. It is caught again as soon as its
//!   swing in the field would stay within one period, and then loses whole electrical periods, which
//!   are four full steps each.
//! - A rotor without a field is moved on in steps of half a millisecond.
//! - A rotor that runs against something stays there until the field is half a period ahead, then falls
//!   back by a period and comes again if the field is slow enough to take it along.
//! - An open coil leaves no torque: half a motor holds, but does not turn.

mod foresee;
mod rotor;
mod senses;
mod shaft;
mod switches;

use opentmcl_motion::Instant;

use crate::machine::Machine;
use crate::tmc5160::{Tmc5160, registers};
use foresee::Foresight;
use rotor::Rig;
use switches::Contact;

/// A switch input of an axis.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum SwitchInput {
    /// Left limit switch.
    Left,
    /// Right limit switch.
    Right,
    /// Home switch.
    Home,
}

/// A coil of a motor.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Coil {
    /// Phase A.
    A,
    /// Phase B.
    B,
}

/// What is wrong with the wires of a coil.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum CoilFault {
    /// One of them is off.
    Open,
    /// One of them touches ground.
    ShortToGround,
}

/// How the rotor relates to the field.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Rotor {
    /// It follows the field.
    Following,
    /// Something stops it; the field presses it there.
    Pressed,
    /// It has lost the field: the motor has stalled.
    Slipping,
    /// There is no field; only friction, detent torque or shorted coils hold it.
    Free,
}

/// What an axis really does, which no register tells.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct View {
    /// Position of the rotor in fine steps (1/256 full step).
    pub rotor: f64,
    /// Position of the stage in fine steps: the rotor's, less the play.
    pub stage: f64,
    /// Speed of the rotor in fine steps per second.
    pub speed: f64,
    /// Angle by which the rotor lags behind the field, in electrical degrees, against the direction of
    /// the torque; 90 is the most that a motor can bear. 0 while it does not follow.
    pub load_angle: f64,
    /// Part of the torque available that the load takes, 0..1; 1 when it takes more.
    pub load: f64,
    /// StallGuard2 value, SG_RESULT.
    pub stallguard: u16,
    /// Amplitude of the phase currents in ampere.
    pub current: f64,
    /// Full steps that have been lost since power-up: the field's less the rotor's.
    pub lost_steps: i64,
    /// Whether and how the rotor follows.
    pub state: Rotor,
    /// Levels of the left, right and home input.
    pub switches: [bool; 3],
}

/// A motion chip and its machine.
///
/// Times must not run backwards from one call to the next.
#[derive(Clone, Debug)]
pub struct Axis {
    chip: Tmc5160,
    /// Left, right, home.
    contacts: [Contact; 3],
    rig: Option<Box<Rig>>,
    /// What happens on the rig by itself.
    foresight: Foresight,
}

impl Default for Axis {
    fn default() -> Self {
        Self::new()
    }
}

impl Axis {
    /// A chip with a motor that follows every step, in empty space.
    pub fn new() -> Self {
        Self {
            chip: Tmc5160::new(),
            contacts: [Contact::new(None, 0.0, None); 3],
            rig: None,
            foresight: Foresight::default(),
        }
    }

    /// A chip whose motor turns this machine. `full_scale` is the amplitude of the phase currents in
    /// ampere that the driver gives at most.
    pub fn with_machine(machine: Machine, full_scale: f64) -> Self {
        let stage = &machine.stage;
        let switches = &machine.switches;
        let contact = |switch| Contact::new(switch, stage.start, stage.circle);
        let mut axis = Self {
            chip: Tmc5160::new(),
            contacts: [contact(switches.left), contact(switches.right), contact(switches.home)],
            rig: Some(Box::new(Rig::new(machine, full_scale))),
            foresight: Foresight::default(),
        };
        axis.settle(Instant::from_ticks(0));
        axis
    }

    /// The machine; none for an axis in empty space.
    pub fn machine(&self) -> Option<&Machine> {
        self.rig.as_ref().map(|rig| &rig.shaft.machine)
    }

    /// Switches the chip off and on. The machine stays where it is.
    pub fn reset(&mut self, now: Instant) {
        self.change(now, |axis| {
            axis.chip.reset(now);
            if let Some(rig) = &mut axis.rig {
                rig.forget_losses();
            }
        });
    }

    /// Reads a register of the chip.
    pub fn read(&mut self, address: u8, now: Instant) -> u32 {
        self.run(now);
        if let Some(rig) = &mut self.rig {
            match address {
                registers::DRV_STATUS | registers::PWM_SCALE => rig.sense(&mut self.chip, now),
                registers::RAMP_STAT if self.chip.tells_stalls() && !self.foresight.no_stall => {
                    let raw = rig.raw_stallguard(&self.chip.field(now), now);
                    self.chip.set_stallguard(raw);
                }
                registers::X_ENC => rig.count(&mut self.chip, now),
                _ => {}
            }
        }
        self.chip.read(address, now)
    }

    /// Writes a register of the chip.
    pub fn write(&mut self, address: u8, value: u32, now: Instant) {
        if self.chip.plans_with(address, value) {
            // A move writes registers that hold its limits already; nothing follows from that.
            return;
        }
        self.change(now, |axis| {
            axis.chip.write(address, value, now);
        });
    }

    /// When something next happens on this axis that a register or a switch shows, as far as it can be
    /// foreseen; later than `now`.
    pub fn next_event(&mut self, now: Instant) -> Option<Instant> {
        self.run(now);
        let ramp = self.chip.next_event(now);
        match (ramp, self.foresight.due) {
            (Some(ramp), Some(due)) => Some(ramp.min(due)),
            (ramp, due) => ramp.or(due),
        }
    }

    /// Level of the home switch input.
    pub fn home_switch(&mut self, now: Instant) -> bool {
        self.run(now);
        let [_, _, home] = &self.contacts;
        home.level(now.as_ticks())
    }

    /// What the axis really does.
    pub fn view(&mut self, now: Instant) -> View {
        self.run(now);
        let switches = self.levels(now);
        match &self.rig {
            Some(rig) => rig.view(&self.chip, now, switches),
            None => {
                let field = self.chip.field(now);
                let rotor = field.position_at(now);
                View {
                    rotor,
                    stage: rotor,
                    speed: field.speed_at(now) * shaft::CLOCK,
                    load_angle: 0.0,
                    load: 0.0,
                    stallguard: 0,
                    current: 0.0,
                    lost_steps: 0,
                    state: Rotor::Following,
                    switches,
                }
            }
        }
    }

    /// Supply voltage of the driver in volt.
    pub fn set_supply(&mut self, volts: f64, now: Instant) {
        self.change_rig(now, |rig| rig.supply = volts.max(0.0));
    }

    /// Temperature of the driver in degrees Celsius.
    pub fn set_driver_temperature(&mut self, celsius: f64, now: Instant) {
        self.change_rig(now, |rig| rig.set_temperature(celsius));
    }

    /// Whether torque is allowed (safe torque off).
    pub fn set_torque_allowed(&mut self, allowed: bool, now: Instant) {
        self.change(now, |axis| axis.chip.set_enabled(allowed, now));
    }

    /// A further torque in Nm at the shaft, positive towards positive positions; replaces the last one.
    pub fn set_external_torque(&mut self, torque: f64, now: Instant) {
        self.change_rig(now, |rig| rig.shaft.external = torque);
    }

    /// Holds the rotor where it is, or lets it go.
    pub fn set_blocked(&mut self, blocked: bool, now: Instant) {
        self.change_rig(now, |rig| rig.block(blocked));
    }

    /// Holds a switch actuated or not actuated, or leaves it to the stage again.
    pub fn hold_switch(&mut self, switch: SwitchInput, held: Option<bool>, now: Instant) {
        self.change(now, |axis| {
            let [left, right, home] = &mut axis.contacts;
            match switch {
                SwitchInput::Left => left.hold(held),
                SwitchInput::Right => right.hold(held),
                SwitchInput::Home => home.hold(held),
            }
        });
    }

    /// Breaks or mends the wires of a coil.
    pub fn set_coil(&mut self, coil: Coil, fault: Option<CoilFault>, now: Instant) {
        self.change_rig(now, |rig| match coil {
            Coil::A => rig.coil_faults[0] = fault,
            Coil::B => rig.coil_faults[1] = fault,
        });
    }

    /// Moves the rotor by hand to this position in fine steps, as far as the way goes.
    pub fn set_position(&mut self, fine_steps: f64, now: Instant) {
        self.change_rig(now, |rig| rig.put(fine_steps));
    }

    fn change_rig(&mut self, now: Instant, change: impl FnOnce(&mut Rig)) {
        self.change(now, |axis| {
            if let Some(rig) = &mut axis.rig {
                change(rig);
            }
        });
    }

    /// Changes something at `now`, and lets the rest follow.
    fn change(&mut self, now: Instant, change: impl FnOnce(&mut Self)) {
        self.run(now);
        if let Some(rig) = &mut self.rig {
            rig.come_to(&self.chip, now);
            rig.count(&mut self.chip, now);
        }
        change(self);
        self.settle(now);
    }

    /// Does what happens by itself until `now`.
    fn run(&mut self, now: Instant) {
        while let Some(due) = self.foresight.due.filter(|&due| due <= now) {
            if let Some(rig) = &mut self.rig {
                rig.come_to(&self.chip, due);
            }
            self.settle(due);
        }
    }

    /// Brings chip and machine into accord with each other at `now`, and finds out when that ends.
    fn settle(&mut self, now: Instant) {
        // A switch stops the field, which changes the load angle, which can move the stage off the switch;
        // a load changes the current, which changes the load angle.
        // That ends at once in practice; the bound is for what nobody has thought of.
        const ROUNDS: usize = 8;
        let Some(rig) = &mut self.rig else {
            let [left, right, _] = self.levels(now);
            self.chip.set_reference_inputs(left, right, now);
            return;
        };
        for _ in 0..ROUNDS {
            let before = (self.chip.field(now), self.chip.coils(now));
            rig.settle(&mut self.chip, &mut self.contacts, now);
            let [left, right, _] =
                self.contacts.each_ref().map(|contact| contact.level(now.as_ticks()));
            self.chip.set_reference_inputs(left, right, now);
            if (self.chip.field(now), self.chip.coils(now)) == before {
                break;
            }
            rig.come_to(&self.chip, now);
        }
        self.foresight = rig.foresee(&self.chip, &self.contacts, now);
    }

    fn levels(&self, now: Instant) -> [bool; 3] {
        self.contacts.each_ref().map(|contact| contact.level(now.as_ticks()))
    }
}
