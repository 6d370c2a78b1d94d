//! What is held, pushed and broken at an axis at present.

use opentmcl_plant::axis::{CoilFault, SwitchInput};
use opentmcl_plant::servo::LineFault;

/// Temperature of a driver until somebody says otherwise, in degrees Celsius.
const ROOM_TEMPERATURE: f64 = 25.0;

/// What hands from outside do to one axis.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Hands {
    /// Left, right, home: held actuated or not, or left to the stage.
    pub(crate) held: [Option<bool>; 3],
    /// Whether the rotor is held.
    pub(crate) blocked: bool,
    /// What pushes at the motor's shaft, in Nm.
    pub(crate) torque: f64,
    /// Coils A and B.
    pub(crate) coils: [Option<CoilFault>; 2],
    /// Temperature of the driver in degrees Celsius.
    pub(crate) driver_temperature: f64,
    /// Hall lines A, B and C of a servo motor.
    pub(crate) halls: [LineFault; 3],
    /// Whether the wires of phases A, B and C of a servo motor are off.
    pub(crate) open_phases: [bool; 3],
    /// Whether the gate driver reports a fault.
    pub(crate) driver_fault: bool,
}

impl Default for Hands {
    fn default() -> Self {
        Self {
            held: [None; 3],
            blocked: false,
            torque: 0.0,
            coils: [None; 2],
            driver_temperature: ROOM_TEMPERATURE,
            halls: [LineFault::None; 3],
            open_phases: [false; 3],
            driver_fault: false,
        }
    }
}

impl Hands {
    pub(crate) fn held_mut(&mut self, switch: SwitchInput) -> &mut Option<bool> {
        let [left, right, home] = &mut self.held;
        match switch {
            SwitchInput::Left => left,
            SwitchInput::Right => right,
            SwitchInput::Home => home,
        }
    }
}
