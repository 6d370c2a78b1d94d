//! What is behind the chips of an axis: its switches and, if it has one, its machine, and what happens there by
//! itself.

use opentmcl_motion::Instant;

use super::chip::Chip;
use super::foresee::Foresight;
use super::rotor::Rig;
use super::switches::Contact;
use super::{Coil, Influence, SwitchInput, View};
use crate::machine::Machine;

/// Switches and machine of an axis. The chips are given with each call, always the same ones.
#[derive(Clone, Debug)]
pub(crate) struct Body {
    /// Left, right, home.
    contacts: [Contact; 3],
    rig: Option<Box<Rig>>,
    /// What happens on the rig by itself.
    foresight: Foresight,
}

impl Body {
    /// A motor that follows every step, in empty space.
    pub(crate) fn new() -> Self {
        Self {
            contacts: [Contact::new(None, 0.0, None); 3],
            rig: None,
            foresight: Foresight::default(),
        }
    }

    /// A motor that turns a machine; to be settled before anything else. `full_scale` is the amplitude of the
    /// phase currents in ampere that the driver gives at most.
    pub(crate) fn with_machine(machine: Machine, full_scale: f64) -> Self {
        let stage = &machine.stage;
        let switches = &machine.switches;
        let contact = |switch| Contact::new(switch, stage.start, stage.circle);
        Self {
            contacts: [contact(switches.left), contact(switches.right), contact(switches.home)],
            rig: Some(Box::new(Rig::new(machine, full_scale))),
            foresight: Foresight::default(),
        }
    }

    /// The machine; none for an axis in empty space.
    pub(crate) fn machine(&self) -> Option<&Machine> {
        self.rig.as_ref().map(|rig| &rig.shaft.machine)
    }

    /// When the machine next has to be looked at.
    pub(crate) fn due(&self) -> Option<Instant> {
        self.foresight.due
    }

    /// Whether StallGuard2 cannot come to 0 until then.
    pub(crate) fn cannot_stall(&self) -> bool {
        self.foresight.no_stall
    }

    /// From now on only what is lost later counts as lost.
    pub(crate) fn forget_losses(&mut self) {
        if let Some(rig) = &mut self.rig {
            rig.forget_losses();
        }
    }

    /// The chip learns all that its driver measures.
    pub(crate) fn sense(&self, chip: &mut impl Chip, now: Instant) {
        if let Some(rig) = &self.rig {
            rig.sense(chip, now);
        }
    }

    /// The chip learns the value of StallGuard2.
    pub(crate) fn sense_load(&self, chip: &mut impl Chip, now: Instant) {
        if let Some(rig) = &self.rig {
            let raw = rig.raw_stallguard(&chip.field(now), now);
            chip.set_stallguard(raw);
        }
    }

    /// The chip learns where the encoder is.
    pub(crate) fn count(&self, chip: &mut impl Chip, now: Instant) {
        if let Some(rig) = &self.rig {
            rig.count(chip, now);
        }
    }

    /// What the axis really does, with a machine.
    pub(crate) fn view(&self, chip: &impl Chip, now: Instant) -> Option<View> {
        Some(self.rig.as_ref()?.view(chip, now, self.levels(now)))
    }

    /// Levels of the left, right and home input.
    pub(crate) fn levels(&self, now: Instant) -> [bool; 3] {
        self.contacts.each_ref().map(|contact| contact.level(now.as_ticks()))
    }

    /// Holds a switch actuated or not actuated, or leaves it to the stage again. To be done within a change.
    pub(crate) fn hold_switch(&mut self, switch: SwitchInput, held: Option<bool>) {
        let [left, right, home] = &mut self.contacts;
        match switch {
            SwitchInput::Left => left.hold(held),
            SwitchInput::Right => right.hold(held),
            SwitchInput::Home => home.hold(held),
        }
    }

    /// Does something to the machine. To be done within a change.
    pub(crate) fn influence(&mut self, chip: &mut impl Chip, influence: Influence, now: Instant) {
        if let Influence::TorqueAllowed(allowed) = influence {
            chip.set_enabled(allowed, now);
        }
        let Some(rig) = &mut self.rig else { return };
        match influence {
            Influence::TorqueAllowed(_) => {}
            Influence::Supply(volts) => rig.supply = volts.max(0.0),
            Influence::DriverTemperature(celsius) => rig.set_temperature(celsius),
            Influence::Torque(torque) => rig.shaft.external = torque,
            Influence::Blocked(blocked) => rig.block(blocked),
            Influence::Position(fine_steps) => rig.put(fine_steps),
            Influence::Coil(Coil::A, fault) => rig.coil_faults[0] = fault,
            Influence::Coil(Coil::B, fault) => rig.coil_faults[1] = fault,
        }
    }

    /// Does what happens by itself until `now`.
    pub(crate) fn run(&mut self, chip: &mut impl Chip, now: Instant) {
        while let Some(due) = self.foresight.due.filter(|&due| due <= now) {
            self.come_to(chip, due);
            self.settle(chip, due);
        }
    }

    /// Brings the machine to `now`, before which nothing happens any more.
    pub(crate) fn come_to(&mut self, chip: &impl Chip, now: Instant) {
        if let Some(rig) = &mut self.rig {
            rig.come_to(chip, now);
        }
    }

    /// Prepares a change of anything at `now`, after which comes [`Body::settle`].
    pub(crate) fn before_change(&mut self, chip: &mut impl Chip, now: Instant) {
        if let Some(rig) = &mut self.rig {
            rig.come_to(chip, now);
            rig.count(chip, now);
        }
    }

    /// Brings chip and machine into accord with each other at `now`, and finds out when that ends.
    pub(crate) fn settle(&mut self, chip: &mut impl Chip, now: Instant) {
        // A switch stops the field, which changes the load angle, which can move the stage off the switch;
        // a load changes the current, which changes the load angle.
        // That ends at once in practice; the bound is for what nobody has thought of.
        const ROUNDS: usize = 8;
        let Some(rig) = &mut self.rig else {
            let [left, right, _] = self.levels(now);
            chip.set_reference_inputs(left, right, now);
            return;
        };
        for _ in 0..ROUNDS {
            let before = (chip.field(now), chip.coils(now));
            rig.settle(chip, &mut self.contacts, now);
            let [left, right, _] =
                self.contacts.each_ref().map(|contact| contact.level(now.as_ticks()));
            chip.set_reference_inputs(left, right, now);
            if (chip.field(now), chip.coils(now)) == before {
                break;
            }
            rig.come_to(chip, now);
        }
        self.foresight = rig.foresee(chip, &self.contacts, now);
    }
}
