//! Whether an action can be done to a module.

use opentmcl_catalog::{Module, Motion, PortBehaviour};
use opentmcl_plant::servo::Motor;

use super::action::{Action, AnalogLevel, Place, Push, letter};
use crate::scenario::{AxisSetup, StageUnit};

/// Says why an action cannot be done, and what could be.
pub(crate) fn check(
    action: &Action,
    model: &'static Module,
    axes: &[AxisSetup],
) -> Result<(), String> {
    let axis = |number: u8| {
        axes.get(usize::from(number)).ok_or_else(|| {
            let last = model.axes.saturating_sub(1);
            format!("the {} has no axis {number}; its axes are 0 to {last}", model.title)
        })
    };
    let machine = |number: u8| {
        let axis = axis(number)?;
        // A servo module has a motor whatever is said.
        if axis.machine.is_some() || matches!(model.motion, Motion::Foc | Motion::Block) {
            return Ok(axis);
        }
        Err(format!(
            "axis {number} has no machine and follows every step; describe it in a scenario with \
             [[module.axis]]"
        ))
    };
    let title = model.title;
    let servo = |number: u8| {
        let machine = axis(number)?.machine.as_ref().and_then(|machine| machine.servo());
        machine.map(|servo| &servo.machine).ok_or_else(|| {
            format!("axis {number} of the {title} drives a stepper motor; this is for servo motors")
        })
    };
    let input = |behaviour, kind: &str, number: u8| {
        if model.port(behaviour, number).is_some() {
            return Ok(());
        }
        let rows = model.ports.iter().filter(|row| row.behaviour == behaviour);
        let numbers: Vec<String> = rows.map(|row| row.number.to_string()).collect();
        let numbers = numbers.join(", ");
        Err(format!("the {} has no {kind} {number}; there are {numbers}", model.title))
    };
    match *action {
        Action::Switch { .. } if model.motion == Motion::Block => {
            Err(format!("the {title} has no inputs for switches"))
        }
        Action::Coil { axis: number, .. } if model.motion.is_servo() => Err(format!(
            "axis {number} of the {title} drives a servo motor, which has phases; write for example \
             disconnect phase A axis {number}"
        )),
        Action::Switch { axis: number, .. }
        | Action::Coil { axis: number, .. }
        | Action::DriverTemperature { axis: Some(number), .. } => axis(number).map(drop),
        Action::DriverFault { axis: number, .. }
        | Action::MotorTemperature { axis: Some(number), .. } => servo(number).map(drop),
        Action::MotorTemperature { axis: None, .. } | Action::AmbientTemperature(_) => {
            servo(0).map(drop)
        }
        Action::Hall { axis: number, .. } => match servo(number)?.halls {
            Some(_) => Ok(()),
            None => Err(format!("the motor of axis {number} has no halls")),
        },
        Action::Phase { axis: number, phase, .. } => match servo(number)?.motor {
            Motor::Brushed(_) if phase == 2 => Err(format!(
                "the motor of axis {number} has brushes and no phase {}; its wires are A and B",
                letter(phase)
            )),
            _ => Ok(()),
        },
        Action::BoardTemperature(celsius) if model.motion.is_servo() => Err(format!(
            "the {title} does not measure that of its board; write temperature driver {celsius}, \
             temperature motor {celsius} or temperature ambient {celsius}"
        )),
        Action::Block { axis: number, .. }
        | Action::Load { axis: number, push: Push::Torque(_) } => machine(number).map(drop),
        Action::Load { axis: number, push: Push::Force(_) } => {
            if machine(number)?.scale.is_linear() {
                return Ok(());
            }
            Err(format!("the stage of axis {number} turns; write a torque, for example 0.3 Nm"))
        }
        Action::Position { axis: number, place } => {
            let unit = machine(number)?.scale.unit();
            match (place, unit) {
                (Place::Microsteps(_), unit) if model.motion.is_servo() => {
                    let example = if unit == StageUnit::Degrees {
                        "an angle, for example 90 deg"
                    } else {
                        "a length, for example 5 mm"
                    };
                    Err(format!("a servo motor has no microsteps; write {example}"))
                }
                (Place::Millimetres(_), StageUnit::Degrees) => Err(format!(
                    "the stage of axis {number} turns; write an angle, for example 90 deg"
                )),
                (Place::Degrees(_), StageUnit::Millimetres) => Err(format!(
                    "the stage of axis {number} moves along a line; write a length, for example 5 mm"
                )),
                _ => Ok(()),
            }
        }
        Action::Input { input: number, .. } => {
            input(PortBehaviour::DigitalInput, "digital input", number)
        }
        Action::Analog { input: number, level } => {
            input(PortBehaviour::AnalogInput, "analog input", number)?;
            match level {
                AnalogLevel::Volts(volts) if volts.abs() > 100.0 => {
                    Err(format!("{volts} V are too much for an analog input"))
                }
                _ => Ok(()),
            }
        }
        Action::Torque { input, .. } => {
            let inputs = model.ports.iter().filter(|row| row.behaviour == PortBehaviour::StoInput);
            let mut numbers = inputs.map(|row| row.index);
            if numbers.clone().any(|index| index == input) {
                return Ok(());
            }
            let Some(last) = numbers.next_back() else {
                return Err(format!("the {title} has no safe-torque-off inputs"));
            };
            Err(format!("there is no safe-torque-off input {input}; they are 0 to {last}"))
        }
        Action::Supply(_)
        | Action::BoardTemperature(_)
        | Action::DriverTemperature { axis: None, .. }
        | Action::PowerCycle
        | Action::Power(_)
        | Action::Faults { .. } => Ok(()),
    }
}
