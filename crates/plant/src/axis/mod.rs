//! One axis: a motion chip and, if it has one, the machine that its motor turns.

use opentmcl_motion::Instant;

use crate::machine::Machine;
use crate::tmc5160::Tmc5160;

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
    /// Angle by which the rotor lags behind the field, in electrical degrees; 90 is the most that a motor
    /// can bear. 0 while it does not follow.
    pub load_angle: f64,
    /// Part of the torque available that the load takes, 0..1; 0 while it does not follow.
    pub load: f64,
    /// StallGuard2 value.
    pub stallguard: u16,
    /// Amplitude of the phase currents in ampere.
    pub current: f64,
    /// Full steps that have been lost since power-up, with their sign: the counter less the rotor.
    pub lost_steps: i64,
    /// Whether and how the rotor follows.
    pub state: Rotor,
    /// Levels of the left, right and home input.
    pub switches: [bool; 3],
}

/// A motion chip and its machine.
///
/// Times must not run backwards from one call to the next.
#[derive(Clone, Debug, Default)]
pub struct Axis {
    chip: Tmc5160,
    machine: Option<Box<Machine>>,
}

#[allow(unused_variables, missing_docs)]
impl Axis {
    /// A chip with a motor that follows every step, in empty space.
    pub fn new() -> Self {
        Self::default()
    }

    /// A chip whose motor turns this machine.
    pub fn with_machine(machine: Machine) -> Self {
        Self { machine: Some(Box::new(machine)), ..Self::default() }
    }

    pub fn machine(&self) -> Option<&Machine> {
        self.machine.as_deref()
    }

    pub fn reset(&mut self, now: Instant) {
        self.chip.reset(now);
    }

    pub fn read(&mut self, address: u8, now: Instant) -> u32 {
        self.chip.read(address, now)
    }

    pub fn write(&mut self, address: u8, value: u32, now: Instant) {
        self.chip.write(address, value, now);
    }

    pub fn next_event(&mut self, now: Instant) -> Option<Instant> {
        self.chip.next_event(now)
    }

    /// Level of the home switch input.
    pub fn home_switch(&mut self, now: Instant) -> bool {
        false
    }

    pub fn view(&mut self, now: Instant) -> View {
        View {
            rotor: 0.0,
            stage: 0.0,
            speed: 0.0,
            load_angle: 0.0,
            load: 0.0,
            stallguard: 0,
            current: 0.0,
            lost_steps: 0,
            state: Rotor::Following,
            switches: [false; 3],
        }
    }

    /// Supply voltage in volt.
    pub fn set_supply(&mut self, volts: f64, now: Instant) {}
    /// Temperature of the driver in degrees Celsius.
    pub fn set_driver_temperature(&mut self, celsius: f64, now: Instant) {}
    /// Whether torque is allowed (safe torque off).
    pub fn set_torque_allowed(&mut self, allowed: bool, now: Instant) {}
    /// A further torque in Nm at the shaft, positive towards positive positions; replaces the last one.
    pub fn set_external_torque(&mut self, torque: f64, now: Instant) {}
    /// Holds the rotor where it is, or lets it go.
    pub fn set_blocked(&mut self, blocked: bool, now: Instant) {}
    /// Holds a switch actuated or not actuated, or leaves it to the stage again.
    pub fn hold_switch(&mut self, switch: SwitchInput, held: Option<bool>, now: Instant) {}
    /// Breaks or mends the wires of a coil.
    pub fn set_coil(&mut self, coil: Coil, fault: Option<CoilFault>, now: Instant) {}
    /// Moves the stage by hand to this position in fine steps.
    pub fn set_position(&mut self, fine_steps: f64, now: Instant) {}
}
