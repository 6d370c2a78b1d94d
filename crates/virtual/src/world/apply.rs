//! Actions upon a module.

use embedded_storage::nor_flash::NorFlash;
use opentmcl_catalog::PortBehaviour;
use opentmcl_plant::axis::{Coil, Influence};
use opentmcl_plant::servo;
use opentmcl_wire::Instant;

use super::action::{Action, Place, Push};
use super::check::check;
use super::hands::Hands;
use super::parse::ActionError;
use super::schedule::Schedule;
use crate::module::VirtualModule;
use crate::scenario::{AxisSetup, ModuleSetup};

/// What an action asks of whoever serves the module.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Effect {
    /// Faults of a line from now on; both as they were written.
    Faults {
        /// Name of the port.
        port: String,
        /// What the line does.
        spec: String,
    },
}

/// What is around a module, and what will happen there.
#[derive(Clone, Debug)]
pub(crate) struct World {
    pub(crate) axes: Vec<AxisSetup>,
    pub(crate) hands: Vec<Hands>,
    pub(crate) schedule: Schedule,
    pub(crate) effects: Vec<Effect>,
    pub(crate) powered: bool,
}

impl ModuleSetup {
    /// Looks whether an action can be done to the module.
    ///
    /// # Errors
    /// When there is no such axis or input, or the axis has no machine for it.
    pub fn check(&self, action: &Action) -> Result<(), ActionError> {
        check(action, self.model, &self.axes).map_err(ActionError)
    }
}

impl World {
    pub(crate) fn new(setup: &ModuleSetup) -> Self {
        Self {
            axes: setup.axes.clone(),
            hands: vec![Hands::default(); setup.axes.len()],
            schedule: Schedule::new(setup.timeline.clone(), setup.waves.clone()),
            effects: Vec::new(),
            powered: true,
        }
    }
}

impl<F: NorFlash> VirtualModule<F> {
    /// Does something to the module, now.
    ///
    /// # Errors
    /// When there is no such axis or input, or the axis has no machine for it.
    pub fn act(&mut self, action: &Action) -> Result<(), ActionError> {
        check(action, self.model(), &self.world().axes).map_err(ActionError)?;
        self.settle();
        self.apply(action);
        Ok(())
    }

    /// What actions have asked for since the last call, for whoever serves the module.
    pub fn take_effects(&mut self) -> Vec<Effect> {
        std::mem::take(&mut self.world_mut().effects)
    }

    /// When something happens next by the scenario.
    pub fn next_scheduled(&self) -> Option<Instant> {
        self.world().schedule.next_time()
    }

    /// Does what is due by the scenario at the module's time; all before has been done.
    pub(crate) fn apply_due(&mut self) {
        while let Some(action) = self.next_due() {
            self.apply(&action);
        }
    }

    fn next_due(&mut self) -> Option<Action> {
        let now = self.now();
        self.world_mut().schedule.pop(now)
    }

    /// An action that fits the module.
    pub(crate) fn apply(&mut self, action: &Action) {
        match *action {
            Action::PowerCycle => {
                self.switch_off();
                self.switch_on();
            }
            Action::Power(true) => self.switch_on(),
            Action::Power(false) => self.switch_off(),
            Action::Faults { ref port, ref spec } => {
                let effect = Effect::Faults { port: port.clone(), spec: spec.clone() };
                self.world_mut().effects.push(effect);
            }
            _ => {
                self.touch_board(action);
                self.pins_changed();
            }
        }
    }

    fn hands(&mut self, axis: u8) -> Option<&mut Hands> {
        self.world_mut().hands.get_mut(usize::from(axis))
    }

    fn touch_board(&mut self, action: &Action) {
        match *action {
            Action::Switch { switch, axis, held } => {
                if let Some(hands) = self.hands(axis) {
                    *hands.held_mut(switch) = held;
                }
                self.hardware().hold_switch(axis, switch, held);
            }
            Action::Load { axis, push } => {
                let torque = match push {
                    Push::Torque(torque) => torque,
                    Push::Force(force) => self.scale(axis).torque(force),
                };
                if let Some(hands) = self.hands(axis) {
                    hands.torque = torque;
                }
                self.hardware().influence(axis, Influence::Torque(torque));
            }
            Action::Block { axis, blocked } => {
                if let Some(hands) = self.hands(axis) {
                    hands.blocked = blocked;
                }
                self.hardware().influence(axis, Influence::Blocked(blocked));
            }
            Action::Supply(volts) => self.hardware().set_supply(volts),
            Action::DriverTemperature { axis, celsius } => {
                for number in 0..self.model().axes {
                    if axis.is_none_or(|axis| axis == number) {
                        if let Some(hands) = self.hands(number) {
                            hands.driver_temperature = celsius;
                        }
                        self.hardware().influence(number, Influence::DriverTemperature(celsius));
                    }
                }
            }
            Action::MotorTemperature { celsius, .. } => {
                self.hardware().influence_servo(servo::Influence::WindingTemperature(celsius));
            }
            Action::AmbientTemperature(celsius) => {
                self.hardware().set_temperature(celsius);
                self.hardware().influence_servo(servo::Influence::Ambient(celsius));
            }
            Action::BoardTemperature(celsius) => self.hardware().set_temperature(celsius),
            Action::Input { input, high } => {
                if let Some(row) = self.model().port(PortBehaviour::DigitalInput, input) {
                    self.hardware().set_digital_input(row.index, high);
                }
            }
            Action::Analog { input, level } => {
                if let Some(row) = self.model().port(PortBehaviour::AnalogInput, input) {
                    self.hardware().set_analog_level(row.index, level);
                }
            }
            Action::Coil { axis, coil, fault } => {
                if let Some(hands) = self.hands(axis) {
                    let [a, b] = &mut hands.coils;
                    *match coil {
                        Coil::A => a,
                        Coil::B => b,
                    } = fault;
                }
                self.hardware().influence(axis, Influence::Coil(coil, fault));
            }
            Action::Hall { axis, line, fault } => {
                if let Some(hands) = self.hands(axis)
                    && let Some(hall) = hands.halls.get_mut(usize::from(line))
                {
                    *hall = fault;
                }
                self.hardware().influence_servo(servo::Influence::HallLine(line, fault));
            }
            Action::Phase { axis, phase, open } => {
                if let Some(hands) = self.hands(axis)
                    && let Some(wire) = hands.open_phases.get_mut(usize::from(phase))
                {
                    *wire = open;
                }
                self.hardware().influence_servo(servo::Influence::PhaseOpen(phase, open));
            }
            Action::DriverFault { axis, fault } => {
                if let Some(hands) = self.hands(axis) {
                    hands.driver_fault = fault;
                }
                self.hardware().influence_servo(servo::Influence::DriverFault(fault));
            }
            Action::Position { axis, place } => {
                let fine = match place {
                    Place::Millimetres(value) | Place::Degrees(value) => {
                        self.scale(axis).to_fine(value)
                    }
                    Place::Microsteps(value) => value,
                };
                self.hardware().influence(axis, Influence::Position(fine));
            }
            Action::Torque { input, allowed } => self.hardware().set_torque_input(input, allowed),
            Action::PowerCycle | Action::Power(_) | Action::Faults { .. } => {}
        }
    }
}
