//! The motor of an axis, by its name or by its data.

use opentmcl_plant::machine::Motor;
use opentmcl_plant::machine::motor::PRESETS;
use toml::de::DeValue;

use super::read::{Reader, Value};
use crate::quantity::Quantity;
use crate::suggest::did_you_mean;

const KEYS: [&str; 7] = [
    "full_steps",
    "resistance",
    "inductance",
    "holding_torque",
    "rated_current",
    "inertia",
    "detent_torque",
];

pub(super) fn motor<'a>(reader: &mut Reader<'a>, value: &'a Value<'a>) -> Option<Motor> {
    if let DeValue::String(name) = value.get_ref() {
        let wanted = name.trim().to_lowercase();
        let preset = PRESETS.iter().find(|preset| preset.name == wanted);
        if preset.is_none() {
            let names = || PRESETS.iter().map(|preset| preset.name);
            let near = did_you_mean(&wanted, names());
            let all: Vec<&str> = names().collect();
            let message = format!("there is no motor {name:?}{near} (motors: {})", all.join(", "));
            reader.mistake(value.span(), message);
        }
        return preset.map(|preset| preset.motor);
    }
    let table = reader.table(value, "a motor is a name or", &KEYS)?;
    let steps = table.get("full_steps");
    let full_steps = steps.map_or(Some(200), |value| reader.integer(value, 4..10_001));
    let mut positive = |key, example, quantity| {
        let value = reader.required(&table, key, example)?;
        reader.amount(value, quantity, true)
    };
    let resistance = positive("resistance", "resistance = \"1.5 ohm\"", Quantity::Resistance);
    let inductance = positive("inductance", "inductance = \"2.8 mH\"", Quantity::Inductance);
    let holding = positive("holding_torque", "holding_torque = \"0.4 Nm\"", Quantity::Torque);
    let rated_current = positive("rated_current", "rated_current = \"1.5 A\"", Quantity::Current);
    let inertia = positive("inertia", "inertia = \"54 g cm2\"", Quantity::Inertia);
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
