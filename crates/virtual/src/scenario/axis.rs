//! An axis: motor, transmission, and what its machine is made of.

use opentmcl_catalog::{AxisBehaviour, Module, Motion, Tmc5160};
use opentmcl_plant::machine::{Encoder, Machine, Motor, Switches};
use opentmcl_plant::servo;

use super::machine::{load, place, stage, switch, way};
use super::module::tables;
use super::read::{Reader, Table, Value};
use super::scale::{SERVO_TURN, Scale, stepper_turn};
use super::servo::{KEYS as SERVO_KEYS, complete};
use super::{AxisSetup, MachineSetup, ModuleSetup, motor};
use crate::quantity::Quantity;

const KEYS: [&str; 10] = [
    "axis",
    "motor",
    "transmission",
    "backlash",
    "load",
    "stage",
    "left",
    "right",
    "home",
    "encoder",
];

/// `[[module.axis]]`.
pub(super) fn axes<'a>(reader: &mut Reader<'a>, table: &Table<'a>, setup: &mut ModuleSetup) {
    let is_servo = setup.model.motion.is_servo();
    let servo_keys = SERVO_KEYS.iter().filter(|_| is_servo);
    let keys: Vec<&str> = KEYS.iter().chain(servo_keys).copied().collect();
    let mut described = vec![false; setup.axes.len()];
    for value in tables(reader, table, "axis", "[[module.axis]]") {
        let Some(table) = reader.table(value, "an axis", &keys) else { continue };
        let number = reader.required(&table, "axis", "axis = 0");
        let number = number.and_then(|value| {
            reader.integer(value, 0..u64::from(setup.model.axes)).and_then(|n| u8::try_from(n).ok())
        });
        let machine = machine(reader, &table, setup.model, number);
        let Some(number) = number.map(usize::from) else { continue };
        let (Some(place), Some(is_described)) =
            (setup.axes.get_mut(number), described.get_mut(number))
        else {
            continue;
        };
        if std::mem::replace(is_described, true) {
            reader.mistake(table.place("axis"), "this axis is described twice");
        }
        if let Some(machine) = machine {
            *place = machine;
        }
    }
}

fn machine<'a>(
    reader: &mut Reader<'a>,
    table: &Table<'a>,
    model: &'static Module,
    axis: Option<u8>,
) -> Option<AxisSetup> {
    let motor = axis_motor(reader, table, model);
    let turn = match motor {
        _ if model.motion.is_servo() => SERVO_TURN,
        Some(AxisMotor::Stepper(motor)) => stepper_turn(motor.full_steps),
        _ => stepper_turn(200),
    };
    let scale = match table.get("transmission") {
        Some(value) => transmission(reader, value, turn),
        None => Some(Scale::rotary(turn, 1.0)),
    };
    // Whether the rest is in mm or in degrees is not known; it could only be told wrong.
    let scale = scale?;
    let backlash =
        table.get("backlash").map_or(Some(0.0), |value| way(reader, value, &scale, false));
    let stage = stage(reader, table.get("stage"), &scale);
    let circular = stage.as_ref().is_some_and(|stage| stage.circle.is_some());
    let load = load(reader, table.get("load"), &scale);
    let mut switches = Switches::default();
    for (key, switch_place) in
        [("left", &mut switches.left), ("right", &mut switches.right), ("home", &mut switches.home)]
    {
        if let Some(value) = table.get(key) {
            *switch_place = switch(reader, key, value, &scale, circular);
        }
    }
    let encoder = match table.get("encoder") {
        Some(value) => {
            if let Some(axis) = axis
                && !has_encoder(model, axis)
            {
                let with: Vec<String> = (0..model.axes)
                    .filter(|&axis| has_encoder(model, axis))
                    .map(|axis| axis.to_string())
                    .collect();
                let title = model.title;
                let message = if with.is_empty() {
                    format!("the {title} has no encoder inputs; leave the encoder out")
                } else {
                    let with = with.join(", ");
                    format!("axis {axis} of the {title} has no encoder input; axes {with} have one")
                };
                reader.mistake(value.span(), message);
            }
            Some(encoder(reader, value, &scale)?)
        }
        None => None,
    };
    let mut stage = stage?;
    stage.backlash = backlash?;
    let load = load?;
    let machine = match motor? {
        AxisMotor::Stepper(motor) => {
            MachineSetup::Stepper(Box::new(Machine { motor, load, stage, switches, encoder }))
        }
        AxisMotor::Servo(motor) => {
            let bare = servo::Machine::new(motor);
            let machine = servo::Machine { load, stage, switches, encoder, ..bare };
            MachineSetup::Servo(Box::new(complete(reader, table, model, machine)?))
        }
    };
    Some(AxisSetup { machine: Some(machine), scale })
}

/// A motor of the kind that the module drives.
#[derive(Clone, Copy)]
enum AxisMotor {
    Stepper(Motor),
    Servo(servo::Motor),
}

fn axis_motor<'a>(
    reader: &mut Reader<'a>,
    table: &Table<'a>,
    model: &'static Module,
) -> Option<AxisMotor> {
    if model.motion.is_servo() {
        let value = reader.required(table, "motor", "motor = \"qbl4208-61-04-013\"")?;
        return motor::servo(reader, value, model).map(AxisMotor::Servo);
    }
    let value = reader.required(table, "motor", "motor = \"qsh4218-51-10-049\"")?;
    motor::stepper(reader, value, model).map(AxisMotor::Stepper)
}

/// Whether the catalogue gives an axis an encoder.
fn has_encoder(model: &Module, axis: u8) -> bool {
    if model.motion == Motion::Foc {
        return true;
    }
    let position = AxisBehaviour::Tmc5160(Tmc5160::EncoderPosition);
    model.axis_parameters.iter().any(|row| row.behaviour == position && row.is_on(axis))
}

fn transmission<'a>(reader: &mut Reader<'a>, value: &'a Value<'a>, turn: f64) -> Option<Scale> {
    let table = reader.table(value, "a transmission", &["gear", "screw", "belt"])?;
    let gear = table.get("gear").map_or(Some(1.0), |value| reader.number(value, 0.001, 10_000.0));
    let mut travel = |key| {
        table.get(key).map(|value| {
            let travel = reader.amount(value, Quantity::Length, true)?;
            if (0.001..=10_000.0).contains(&travel) {
                return Some(travel);
            }
            reader.mistake(value.span(), "the way of one turn is from 1 um to 10 m");
            None
        })
    };
    match (travel("screw"), travel("belt")) {
        (Some(_), Some(_)) => {
            let message =
                "a transmission has a screw or a belt, and not both; both are the way of a turn";
            reader.mistake(table.place("belt"), message);
            None
        }
        (Some(travel), None) | (None, Some(travel)) => Some(Scale::linear(turn, gear?, travel?)),
        (None, None) => Some(Scale::rotary(turn, gear?)),
    }
}

fn encoder<'a>(reader: &mut Reader<'a>, value: &'a Value<'a>, scale: &Scale) -> Option<Encoder> {
    let table = reader.table(value, "an encoder", &["counts", "index", "reversed", "on"])?;
    let counts = reader
        .required(&table, "counts", "counts = 4000")
        .and_then(|value| reader.number(value, 1.0, 1e6));
    let index = table.get("index").map_or(Some(0.0), |value| place(reader, value, scale));
    let reversed = table.get("reversed").map_or(Some(false), |value| reader.boolean(value));
    let on = table.get("on").map_or(Some("motor"), |value| reader.word(value, &["motor", "stage"]));
    Some(Encoder { counts: counts?, index: index?, reversed: reversed?, on_stage: on? == "stage" })
}
