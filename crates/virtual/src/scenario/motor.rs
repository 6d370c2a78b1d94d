//! The motor of an axis, by its name or by its data.

use opentmcl_catalog::{Module, Motion};
use opentmcl_plant::machine::Motor;
use opentmcl_plant::machine::motor::PRESETS;
use opentmcl_plant::servo;
use opentmcl_plant::servo::motor::{Brushed, Brushless, DataSheet, PRESETS as SERVO_PRESETS};
use toml::de::DeValue;

use super::read::{Reader, Table, Value};
use crate::quantity::Quantity;
use crate::suggest::did_you_mean;

const STEPPER_KEYS: [&str; 7] = [
    "full_steps",
    "resistance",
    "inductance",
    "holding_torque",
    "rated_current",
    "inertia",
    "detent_torque",
];

const BRUSHLESS_KEYS: [&str; 8] = [
    "kind",
    "pole_pairs",
    "resistance",
    "inductance",
    "torque_constant",
    "inertia",
    "rated_current",
    "friction",
];

const BRUSHED_KEYS: [&str; 6] =
    ["kind", "resistance", "inductance", "torque_constant", "inertia", "friction"];

/// Keys that only stepper motors have, and those that only servo motors have.
const ONLY_STEPPERS: [&str; 3] = ["full_steps", "holding_torque", "detent_torque"];
const ONLY_SERVOS: [&str; 3] = ["pole_pairs", "torque_constant", "kind"];

/// Friction of a motor with brushes in Nm and Nm per rad/s, as customary for bearings; data sheets do not tell it.
const FRICTION: f64 = 2.5e-3;
const VISCOUS: f64 = 1e-5;

/// The stepper motor of an axis of this module.
pub(super) fn stepper<'a>(
    reader: &mut Reader<'a>,
    value: &'a Value<'a>,
    model: &'static Module,
) -> Option<Motor> {
    if let DeValue::String(name) = value.get_ref() {
        let presets = || PRESETS.iter().map(|preset| (preset.name, preset.motor));
        let others = || SERVO_PRESETS.iter().map(|preset| preset.name);
        return by_name(reader, value, name, presets, others, || {
            format!("is a brushless motor, and the {} drives stepper motors", model.title)
        });
    }
    if has_any(value, &ONLY_SERVOS) {
        let message = format!(
            "the {} drives stepper motors, and this is none; write full_steps, resistance, inductance, \
             holding_torque, rated_current and inertia",
            model.title
        );
        reader.mistake(value.span(), message);
        return None;
    }
    let table = reader.table(value, "a motor is a name or", &STEPPER_KEYS)?;
    let steps = table.get("full_steps");
    let full_steps = steps.map_or(Some(200), |value| reader.integer(value, 4..10_001));
    let resistance = positive(reader, &table, RESISTANCE);
    let inductance = positive(reader, &table, INDUCTANCE);
    let holding = ("holding_torque", "holding_torque = \"0.4 Nm\"", Quantity::Torque);
    let holding = positive(reader, &table, holding);
    let rated_current = positive(reader, &table, RATED_CURRENT);
    let inertia = positive(reader, &table, INERTIA);
    let detent = table
        .get("detent_torque")
        .map_or(Some(0.0), |value| reader.amount(value, Quantity::Torque, false));
    Some(Motor {
        full_steps: u32::try_from(full_steps?).ok()?,
        resistance: resistance?,
        inductance: inductance?,
        holding_torque: holding?,
        rated_current: rated_current?,
        detent_torque: detent?,
        inertia: inertia?,
    })
}

/// The motor of the axis of this servo module.
pub(super) fn servo<'a>(
    reader: &mut Reader<'a>,
    value: &'a Value<'a>,
    model: &'static Module,
) -> Option<servo::Motor> {
    if let DeValue::String(name) = value.get_ref() {
        let presets = || SERVO_PRESETS.iter().map(|preset| (preset.name, preset.motor));
        let others = || PRESETS.iter().map(|preset| preset.name);
        let motor = by_name(reader, value, name, presets, others, || {
            format!("is a stepper motor, and the {} drives servo motors", model.title)
        });
        return motor.map(servo::Motor::Brushless);
    }
    if has_any(value, &ONLY_STEPPERS) {
        let message = format!(
            "the {} drives servo motors, and this is a stepper motor; write pole_pairs, resistance, \
             inductance, torque_constant, inertia and rated_current",
            model.title
        );
        reader.mistake(value.span(), message);
        return None;
    }
    let is_brushed = matches!(value.get_ref(), DeValue::Table(table)
        if table.get("kind").is_some_and(|kind| matches!(kind.get_ref(), DeValue::String(kind) if kind == "brushed")));
    let keys: &[&str] = if is_brushed { &BRUSHED_KEYS } else { &BRUSHLESS_KEYS };
    let table = reader.table(value, "a motor is a name or", keys)?;
    if let Some(kind) = table.get("kind") {
        reader.word(kind, &["brushless", "brushed"])?;
    }
    let resistance = positive(reader, &table, RESISTANCE);
    let inductance = positive(reader, &table, INDUCTANCE);
    let constant = ("torque_constant", "torque_constant = \"36 mNm/A\"", Quantity::TorqueConstant);
    let torque_constant = positive(reader, &table, constant);
    let inertia = positive(reader, &table, INERTIA);
    let friction = table.get("friction").map(|value| reader.amount(value, Quantity::Torque, false));
    if is_brushed {
        if model.motion == Motion::Block {
            let message = format!("the {} has no control for motors with brushes", model.title);
            reader.mistake(table.place("kind"), message);
        }
        return Some(servo::Motor::Brushed(Brushed {
            resistance: resistance?,
            inductance: inductance?,
            torque_constant: torque_constant?,
            inertia: inertia?,
            friction: friction.unwrap_or(Some(FRICTION))?,
            viscous: VISCOUS,
        }));
    }
    let pole_pairs = reader
        .required(&table, "pole_pairs", "pole_pairs = 4")
        .and_then(|value| reader.integer(value, 1..121));
    let rated_current = positive(reader, &table, RATED_CURRENT);
    let motor = Brushless::from_data_sheet(DataSheet {
        pole_pairs: u32::try_from(pole_pairs?).ok()?,
        resistance: resistance?,
        inductance: inductance?,
        torque_constant: torque_constant?,
        inertia: inertia?,
        rated_current: rated_current?,
    });
    let friction = friction.unwrap_or(Some(motor.friction))?;
    Some(servo::Motor::Brushless(Brushless { friction, ..motor }))
}

/// A key that must be there, an example of it, and what it measures.
type Required = (&'static str, &'static str, Quantity);

const RESISTANCE: Required = ("resistance", "resistance = \"1.5 ohm\"", Quantity::Resistance);
const INDUCTANCE: Required = ("inductance", "inductance = \"2.8 mH\"", Quantity::Inductance);
const RATED_CURRENT: Required = ("rated_current", "rated_current = \"1.5 A\"", Quantity::Current);
const INERTIA: Required = ("inertia", "inertia = \"54 g cm2\"", Quantity::Inertia);

fn positive<'a>(
    reader: &mut Reader<'a>,
    table: &Table<'a>,
    (key, example, quantity): Required,
) -> Option<f64> {
    let value = reader.required(table, key, example)?;
    reader.amount(value, quantity, true)
}

fn has_any(value: &Value<'_>, keys: &[&str]) -> bool {
    match value.get_ref() {
        DeValue::Table(table) => keys.iter().any(|key| table.get(*key).is_some()),
        _ => false,
    }
}

/// The motor with this name. `other` says what is wrong with one of the `others`, which the module cannot drive.
fn by_name<'a, M, P: Iterator<Item = (&'static str, M)>, O: Iterator<Item = &'static str>>(
    reader: &mut Reader<'a>,
    value: &'a Value<'a>,
    name: &str,
    presets: impl Fn() -> P,
    others: impl Fn() -> O,
    other: impl Fn() -> String,
) -> Option<M> {
    let wanted = name.trim().to_lowercase();
    let preset = presets().find(|(name, _)| *name == wanted);
    if preset.is_none() {
        let all: Vec<&str> = presets().map(|(name, _)| name).collect();
        let message = if others().any(|name| name == wanted) {
            format!("{wanted:?} {} (motors: {})", other(), all.join(", "))
        } else {
            let near = did_you_mean(&wanted, all.iter().copied());
            format!("there is no motor {name:?}{near} (motors: {})", all.join(", "))
        };
        reader.mistake(value.span(), message);
    }
    preset.map(|(_, motor)| motor)
}
