//! The axes of a board, with the chips that its module has.

use opentmcl_catalog::{Module, Motion};
use opentmcl_plant::axis::{Axis, Influence, SwitchInput, View};
use opentmcl_plant::machine::Machine;
use opentmcl_plant::servo;
use opentmcl_plant::steppers::{DRIVER, Steppers};
use opentmcl_plant::tmc26x::LOW_SENSE_VOLTAGE;
use opentmcl_plant::tmc5160::registers::DRV_STATUS;
use opentmcl_wire::Instant;

use crate::scenario::{MachineSetup, ServoSetup};
use crate::servo::{ServoAxis, translated};

/// What moves.
#[derive(Clone, Debug)]
pub(crate) enum Axes {
    /// A TMC5160 for each axis.
    Tmc5160(Vec<Axis>),
    /// A TMC429 for each three axes, and a TMC26x for each.
    Tmc429(Steppers),
    /// The regulators are in the firmware; here is what they regulate.
    Servo(Box<ServoAxis>),
}

impl Axes {
    /// The axes of a module, with these machines behind them by number. Stepper axes without one follow every step,
    /// a servo axis without one has its usual one; machines with a motor of the other kind count as none.
    pub(crate) fn new(model: &Module, machines: Vec<Option<MachineSetup>>) -> Self {
        if model.motion.is_servo() {
            let servo = machines.into_iter().flatten().find_map(|machine| match machine {
                MachineSetup::Servo(servo) => Some(*servo),
                MachineSetup::Stepper(_) => None,
            });
            let servo = servo.unwrap_or_else(|| ServoSetup::usual(model.motion));
            return Self::Servo(Box::new(ServoAxis::new(model, servo)));
        }
        let stepper = |machine| match machine {
            Some(MachineSetup::Stepper(machine)) => Some(*machine),
            _ => None,
        };
        let mut machines: Vec<Option<Machine>> = machines.into_iter().map(stepper).collect();
        machines.resize(usize::from(model.axes), None);
        let full_scale = f64::from(model.peak_current_ma) / 1000.0;
        let axis = |machine: Option<Machine>| match machine {
            Some(machine) => Axis::with_machine(machine, full_scale),
            None => Axis::new(),
        };
        if model.motion == Motion::Tmc429 {
            // The module's currents are those with the low sense voltage.
            let full_scale = full_scale * 256.0 / f64::from(LOW_SENSE_VOLTAGE);
            return Self::Tmc429(Steppers::with_machines(machines, full_scale));
        }
        Self::Tmc5160(machines.into_iter().map(axis).collect())
    }

    pub(crate) fn next_event(&mut self, axis: u8, now: Instant) -> Option<Instant> {
        match self {
            Self::Tmc5160(axes) => axes.get_mut(usize::from(axis))?.next_event(now),
            Self::Tmc429(steppers) => steppers.next_event(axis, now),
            // The control interrupt looks at it all the time.
            Self::Servo(_) => None,
        }
    }

    /// Axes, bit n for axis n, of which the next event may change with what is done to the machine or the switches of
    /// one of them.
    pub(crate) fn moved_with(&self, axis: u8) -> u8 {
        match self {
            Self::Tmc5160(_) | Self::Servo(_) => 1u8.checked_shl(axis.into()).unwrap_or_default(),
            Self::Tmc429(steppers) => steppers.moved_with(axis),
        }
    }

    /// The same for a write to a register of one of them.
    pub(crate) fn touched_with(&self, axis: u8, address: u8) -> u8 {
        match self {
            Self::Tmc5160(_) | Self::Servo(_) => self.moved_with(axis),
            Self::Tmc429(steppers) => steppers.touched_with(axis, address),
        }
    }

    pub(crate) fn influence(&mut self, axis: u8, influence: Influence, now: Instant) {
        match self {
            Self::Tmc5160(axes) => {
                if let Some(axis) = axes.get_mut(usize::from(axis)) {
                    axis.influence(influence, now);
                }
            }
            Self::Tmc429(steppers) => steppers.influence(axis, influence, now),
            Self::Servo(servo) => {
                if let Some(influence) = translated(influence) {
                    servo.influence(influence, now);
                }
            }
        }
    }

    pub(crate) fn hold_switch(
        &mut self,
        axis: u8,
        switch: SwitchInput,
        held: Option<bool>,
        now: Instant,
    ) {
        match self {
            Self::Tmc5160(axes) => {
                if let Some(axis) = axes.get_mut(usize::from(axis)) {
                    axis.hold_switch(switch, held, now);
                }
            }
            Self::Tmc429(steppers) => steppers.hold_switch(axis, switch, held, now),
            Self::Servo(servo) => {
                servo.influence(servo::Influence::Switch(switch, held), now);
            }
        }
    }

    pub(crate) fn home_switch(&mut self, axis: u8, now: Instant) -> bool {
        match self {
            Self::Tmc5160(axes) => {
                axes.get_mut(usize::from(axis)).is_some_and(|axis| axis.home_switch(now))
            }
            Self::Tmc429(steppers) => steppers.home_switch(axis, now),
            Self::Servo(servo) => servo.switches(now)[2],
        }
    }

    /// What a stepper axis really does.
    pub(crate) fn view(&mut self, axis: u8, now: Instant) -> Option<View> {
        match self {
            Self::Tmc5160(axes) => axes.get_mut(usize::from(axis)).map(|axis| axis.view(now)),
            Self::Tmc429(steppers) => steppers.view(axis, now),
            Self::Servo(_) => None,
        }
    }

    /// What the driver of an axis tells: the stall in bit 0, and the errors of its bits 25 to 30 in bits 1 to 6, as in
    /// [`Sense`](opentmcl_plant::driver::Sense).
    pub(crate) fn driver_flags(&mut self, axis: u8, now: Instant) -> u32 {
        let flags = match self {
            Self::Tmc5160(_) => self.read(axis, DRV_STATUS, now) >> 24,
            Self::Tmc429(_) => self.read(axis, DRIVER, now),
            Self::Servo(_) => 0,
        };
        flags & 0x7F
    }

    pub(crate) fn read(&mut self, axis: u8, address: u8, now: Instant) -> u32 {
        match self {
            Self::Tmc5160(axes) => {
                axes.get_mut(usize::from(axis)).map_or(0, |axis| axis.read(address, now))
            }
            Self::Tmc429(steppers) => steppers.read(axis, address, now),
            Self::Servo(_) => 0,
        }
    }

    pub(crate) fn write(&mut self, axis: u8, address: u8, value: u32, now: Instant) {
        match self {
            Self::Tmc5160(axes) => {
                if let Some(axis) = axes.get_mut(usize::from(axis)) {
                    axis.write(address, value, now);
                }
            }
            Self::Tmc429(steppers) => steppers.write(axis, address, value, now),
            Self::Servo(_) => {}
        }
    }

    pub(crate) fn reset(&mut self, now: Instant) {
        match self {
            Self::Tmc5160(axes) => axes.iter_mut().for_each(|axis| axis.reset(now)),
            Self::Tmc429(steppers) => steppers.reset(now),
            Self::Servo(servo) => servo.reset(now),
        }
    }

    /// The machine of a servo axis.
    #[inline]
    pub(crate) fn servo(&mut self) -> Option<&mut ServoAxis> {
        match self {
            Self::Servo(servo) => Some(servo),
            _ => None,
        }
    }
}
