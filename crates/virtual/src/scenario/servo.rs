//! What only axes of servo modules have: halls, an absolute encoder, a holding brake, surroundings, noise.

use opentmcl_catalog::{Module, Motion};
use opentmcl_plant::servo::{Absolute, Halls, HoldingBrake, Machine, Motor, Noise, Supply};
use toml::de::DeValue;

use super::read::{Reader, Table, Value};
use super::scale::SERVO_TURN;
use super::{MachineSetup, ModuleSetup, ServoSetup};
use crate::quantity::Quantity;

/// Keys of an axis that those of stepper modules do not have.
pub(super) const KEYS: [&str; 5] = ["halls", "absolute", "brake", "ambient", "noise"];

/// A holding brake opens at this duty of its output, 0..=255; less than the 11 % with which the module holds
/// it open.
const RELEASE_DUTY: u8 = 20;

/// Adds to a machine what only a servo axis has.
pub(super) fn complete<'a>(
    reader: &mut Reader<'a>,
    table: &Table<'a>,
    model: &'static Module,
    mut machine: Machine,
) -> Option<ServoSetup> {
    let title = model.title;
    if model.motion == Motion::Block {
        for (key, what) in [
            ("absolute", "input for an absolute encoder"),
            ("brake", "output for a holding brake"),
            ("left", "inputs for limit switches"),
            ("right", "inputs for limit switches"),
            ("home", "input for a home switch"),
        ] {
            if let Some(value) = table.get(key) {
                reader.mistake(value.span(), format!("the {title} has no {what}; leave this out"));
            }
        }
    }
    let is_brushed = matches!(machine.motor, Motor::Brushed(_));
    let halls = match table.get("halls") {
        None => Some((!is_brushed).then(Halls::default)),
        Some(value) if is_brushed => {
            reader.mistake(value.span(), "a motor with brushes has no halls; leave this out");
            None
        }
        Some(value) => halls(reader, value),
    };
    let absolute = table.get("absolute").map(|value| absolute(reader, value));
    let brake = table.get("brake").map(|value| brake(reader, value));
    let ambient = table.get("ambient").map(|value| {
        let celsius = reader.quantity(value, Quantity::Temperature)?;
        if (-55.0..=125.0).contains(&celsius) {
            return Some(celsius);
        }
        reader.mistake(value.span(), "surroundings have a temperature from -55 °C to 125 °C");
        None
    });
    let noise = table.get("noise").map_or(Some(Noise::default()), |value| noise(reader, value));
    machine.halls = halls?;
    machine.absolute = match absolute {
        Some(absolute) => Some(absolute?),
        None => None,
    };
    machine.brake = match brake {
        Some(brake) => Some(brake?),
        None => None,
    };
    if let Some(ambient) = ambient {
        machine.thermal.ambient = ambient?;
    }
    Some(ServoSetup { machine, noise: noise? })
}

/// `halls = { … }`, or `halls = false` for a motor that has none.
fn halls<'a>(reader: &mut Reader<'a>, value: &'a Value<'a>) -> Option<Option<Halls>> {
    if let DeValue::Boolean(has) = value.get_ref() {
        return Some(has.then(Halls::default));
    }
    let table = reader.table(value, "halls are true, false or", &["offset", "inverted"])?;
    let offset = table
        .get("offset")
        .map_or(Some(0.0), |value| reader.quantity(value, Quantity::Angle))
        .filter(|offset| offset.abs() <= 3600.0);
    if offset.is_none() {
        reader.mistake(table.place("offset"), "an offset is at most 3600 electrical degrees");
    }
    let inverted = table.get("inverted").map_or(Some(false), |value| reader.boolean(value));
    Some(Some(Halls { offset: offset?, inverted: inverted? }))
}

fn absolute<'a>(reader: &mut Reader<'a>, value: &'a Value<'a>) -> Option<Absolute> {
    let table = reader.table(value, "an absolute encoder", &["offset", "reversed"])?;
    let offset =
        table.get("offset").map_or(Some(0.0), |value| reader.quantity(value, Quantity::Angle));
    let reversed = table.get("reversed").map_or(Some(false), |value| reader.boolean(value));
    let turns = offset? / 360.0;
    Some(Absolute { offset: (turns - turns.floor()) * SERVO_TURN, reversed: reversed? })
}

fn brake<'a>(reader: &mut Reader<'a>, value: &'a Value<'a>) -> Option<HoldingBrake> {
    let table = reader.table(value, "a holding brake", &["torque"])?;
    let torque = reader.required(&table, "torque", "torque = \"0.5 Nm\"");
    let torque = torque.and_then(|value| reader.amount(value, Quantity::Torque, true));
    Some(HoldingBrake { torque: torque?, release_duty: RELEASE_DUTY })
}

fn noise<'a>(reader: &mut Reader<'a>, value: &'a Value<'a>) -> Option<Noise> {
    let table = reader.table(value, "noise", &["counts", "seed"])?;
    let counts = reader
        .required(&table, "counts", "counts = 3")
        .and_then(|value| reader.number(value, 0.0, 10_000.0));
    let seed = table.get("seed").map_or(Some(0), |value| reader.integer(value, 0..1 << 32));
    Some(Noise { counts: counts?, seed: seed? })
}

/// `supply = { voltage = "24 V", … }` of a servo module, whose bus sinks and rises with what the motor takes and
/// gives. Gives the voltage in volt.
pub(super) fn supply<'a>(
    reader: &mut Reader<'a>,
    value: &'a Value<'a>,
    setup: &mut ModuleSetup,
) -> Option<f64> {
    let Some(servo) = setup.axes.iter_mut().find_map(|axis| match &mut axis.machine {
        Some(MachineSetup::Servo(servo)) => Some(servo),
        _ => None,
    }) else {
        let title = setup.model.title;
        let message = format!(
            "the supply of a {title} is ideal and has nothing but its voltage: supply = \"24 V\""
        );
        reader.mistake(value.span(), message);
        return None;
    };
    let keys = ["voltage", "resistance", "capacitance", "chopper"];
    let table = reader.table(value, "a supply", &keys)?;
    let usual = Supply::default();
    let mut amount = |key, quantity, usual| {
        table.get(key).map_or(Some(usual), |value| reader.amount(value, quantity, true))
    };
    let voltage = amount("voltage", Quantity::Voltage, usual.voltage);
    let resistance = amount("resistance", Quantity::Resistance, usual.resistance);
    let capacitance = amount("capacitance", Quantity::Capacitance, usual.capacitance);
    let chopper = match table.get("chopper") {
        Some(value) if matches!(value.get_ref(), DeValue::Boolean(false)) => Some(f64::INFINITY),
        _ => amount("chopper", Quantity::Resistance, usual.chopper),
    };
    let (voltage, resistance) = (voltage?, resistance?);
    servo.machine.supply = Supply {
        voltage,
        resistance,
        capacitance: capacitance?,
        chopper: chopper?,
        ..servo.machine.supply
    };
    Some(voltage)
}
