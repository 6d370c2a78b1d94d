//! A module, its start and its ports.

use std::path::PathBuf;

use opentmcl_catalog::MODULES;
use toml::Spanned;
use toml::de::DeValue;

use super::read::{Reader, Table, Value};
use super::{ModuleSetup, PortKind, PortSetup, axis, plan, servo};
use crate::quantity::Quantity;
use crate::suggest::did_you_mean;
use crate::world::Action;

const KEYS: [&str; 10] =
    ["name", "model", "supply", "temperature", "start", "eeprom", "axis", "at", "wave", "port"];

/// All modules of a scenario.
pub(super) fn modules<'a>(reader: &mut Reader<'a>, root: &Table<'a>) -> Vec<ModuleSetup> {
    let Some(list) = reader.required(root, "module", "[[module]] and model = \"tmcm-6214\"") else {
        return Vec::new();
    };
    let list = match list.get_ref() {
        // One pair of brackets is as good as two where there is one module.
        DeValue::Table(_) => std::slice::from_ref(list),
        _ => reader.list(list, "[[module]]"),
    };
    let mut modules: Vec<ModuleSetup> = Vec::new();
    for value in list {
        let Some(table) = reader.table(value, "a module", &KEYS) else { continue };
        let Some(module) = module(reader, &table) else { continue };
        if modules.iter().any(|other| other.name == module.name) {
            let message =
                format!("a second module has the name {:?}; give it another", module.name);
            reader.mistake(table.place("name"), message);
        }
        modules.push(module);
    }
    if list.is_empty() {
        reader.mistake(root.place("module"), "a scenario has at least one module");
    }
    modules
}

/// Elements of a list of tables; none if there is no such key.
pub(super) fn tables<'a>(
    reader: &mut Reader<'a>,
    table: &Table<'a>,
    key: &str,
    example: &str,
) -> &'a [Value<'a>] {
    table.get(key).map_or(&[], |value| reader.list(value, example))
}

fn module<'a>(reader: &mut Reader<'a>, table: &Table<'a>) -> Option<ModuleSetup> {
    let model = reader.required(table, "model", "model = \"tmcm-6214\"")?;
    let name = reader.text(model, "\"tmcm-6214\"")?;
    let Some(found) = opentmcl_catalog::find(name) else {
        let known: Vec<&str> = MODULES.iter().map(|module| module.name).collect();
        let near = did_you_mean(name, known.iter().copied());
        let message = format!("there is no module {name:?}{near} (modules: {})", known.join(", "));
        reader.mistake(model.span(), message);
        return None;
    };
    let mut setup = ModuleSetup::new(found);
    if let Some(value) = table.get("name")
        && let Some(name) = module_name(reader, value)
    {
        setup.name = name;
    }
    axis::axes(reader, table, &mut setup);
    if let Some(value) = table.get("supply")
        && let Some(volts) = match value.get_ref() {
            DeValue::Table(_) => servo::supply(reader, value, &mut setup),
            _ => reader.amount(value, Quantity::Voltage, true),
        }
    {
        plan::action(reader, value.span(), &format!("supply {volts} V"), &mut setup, None);
    }
    if let Some(value) = table.get("temperature")
        && let Some(celsius) = reader.quantity(value, Quantity::Temperature)
    {
        plan::action(
            reader,
            value.span(),
            &format!("temperature board {celsius}"),
            &mut setup,
            None,
        );
    }
    for value in tables(reader, table, "start", "start = [\"input 3 high\"]") {
        if let Some(text) = reader.text(value, "\"input 3 high\"") {
            plan::action(reader, value.span(), text, &mut setup, None);
        }
    }
    plan::timeline(reader, table, &mut setup);
    plan::waves(reader, table, &mut setup);
    if let Some(value) = table.get("eeprom") {
        setup.eeprom = path(reader, value, "\"xy.eeprom\"");
    }
    ports(reader, table, &mut setup);
    Some(setup)
}

fn module_name<'a>(reader: &mut Reader<'a>, value: &'a Value<'a>) -> Option<String> {
    let name = reader.text(value, "\"xy\"")?;
    let is_word = name.chars().all(|letter| letter.is_alphanumeric() || "-_.".contains(letter));
    if name.is_empty() || name.len() > 64 || !is_word {
        reader.mistake(value.span(), "a name has 1 to 64 letters, digits, hyphens, dots or _");
        return None;
    }
    Some(name.to_owned())
}

fn path<'a>(reader: &mut Reader<'a>, value: &'a Value<'a>, example: &str) -> Option<PathBuf> {
    let text = reader.text(value, example)?;
    if text.is_empty() || text.contains('\0') {
        reader.mistake(value.span(), format!("this is the path of a file: {example}"));
        return None;
    }
    Some(PathBuf::from(text))
}

fn ports<'a>(reader: &mut Reader<'a>, table: &Table<'a>, setup: &mut ModuleSetup) {
    for value in tables(reader, table, "port", "[[module.port]]") {
        let keys = ["name", "pty", "tcp", "faults"];
        let Some(port) = reader.table(value, "a port", &keys) else { continue };
        let Some(kind) = port_kind(reader, &port) else { continue };
        let name = match port.get("name") {
            Some(value) => module_name(reader, value),
            None => Some(match kind {
                PortKind::Pty(_) => "pty".to_owned(),
                PortKind::Tcp(_) => "tcp".to_owned(),
            }),
        };
        let faults = port.get("faults").and_then(|value| reader.text(value, "\"drop 0.01\""));
        let Some(name) = name else { continue };
        if setup.ports.iter().any(|other| other.name == name) {
            let message = format!("a second port has the name {name:?}; give it another");
            reader.mistake(port.place("name"), message);
        }
        let line = reader.line(&port.span);
        setup.ports.push(PortSetup { name, kind, faults: faults.map(str::to_owned), line });
    }
}

fn port_kind<'a>(reader: &mut Reader<'a>, port: &Table<'a>) -> Option<PortKind> {
    match (port.get("pty"), port.get("tcp")) {
        (Some(value), None) => match value.get_ref() {
            DeValue::Boolean(true) => Some(PortKind::Pty(None)),
            _ => path(reader, value, "pty = \"/tmp/xy\" (or true)")
                .map(|link| PortKind::Pty(Some(link))),
        },
        (None, Some(value)) => reader
            .text(value, "\"127.0.0.1:4016\"")
            .map(|address| PortKind::Tcp(address.to_owned())),
        (pty, _) => {
            let place = pty.map_or_else(|| port.span.clone(), Spanned::span);
            let message = "a port has either pty = \"/tmp/xy\" or tcp = \"127.0.0.1:4016\"";
            reader.mistake(place, message);
            None
        }
    }
}

/// An action that fits the module, or what is wrong with it.
pub(super) fn fitting(text: &str, setup: &ModuleSetup) -> Result<Action, String> {
    let action: Action = text.parse().map_err(|error: crate::ActionError| error.to_string())?;
    setup.check(&action).map_err(|error| error.to_string())?;
    Ok(action)
}
