//! Writes the tables as Rust: the enums of all effects and one `Module` per file. What is written
//! uses nothing but `core` and the types of `src/lib.rs`.

use std::collections::BTreeMap;
use std::fmt::Write;

use crate::data::{self, File, rooms, variant};

/// The text of `modules.rs`, for checked modules in the order in which they shall be listed.
pub(crate) fn generate(modules: &[File]) -> std::result::Result<String, std::fmt::Error> {
    let mut out = String::new();
    write_enums(&mut out, modules)?;
    for module in modules {
        write_module(&mut out, module)?;
    }
    let names = modules.iter().map(|module| format!("&{}", static_name(module)));
    let list = names.collect::<Vec<_>>().join(", ");
    writeln!(out, "/// All modules, by name.\npub static MODULES: &[&Module] = &[{list}];")?;
    Ok(out)
}

type Result = std::fmt::Result;

/// The effects that a table names in one room: for each effect the rows that name it, in the order
/// of their numbers.
type Effects = Vec<(String, Vec<String>)>;

const DERIVES: &str = "#[derive(Clone, Copy, Debug, PartialEq, Eq)]\n";

fn write_enums(out: &mut String, modules: &[File]) -> Result {
    let (mut axis, mut global) = (Vec::new(), Vec::new());
    let (mut interrupt, mut port) = (Vec::new(), Vec::new());
    for module in modules {
        let title = &module.module.title;
        for row in sorted_axis_parameters(module) {
            let text = format!("{title} axis parameter {} ({})", row.number, row.name);
            axis.extend(row.behaviour.as_deref().map(|effect| (effect, text)));
        }
        for row in sorted_global_parameters(module) {
            let text =
                format!("{title} global parameter {}/{} ({})", row.bank, row.number, row.name);
            global.extend(row.behaviour.as_deref().map(|effect| (effect, text)));
        }
        for row in sorted_interrupts(module) {
            let text = format!("{title} interrupt {} ({})", row.number, row.name);
            interrupt.push((row.behaviour.as_str(), text));
        }
        for row in sorted_ports(module) {
            let text = format!("{title} port {}/{} ({})", row.bank, row.number, row.name);
            port.push((row.behaviour.as_str(), text));
        }
    }
    write_rooms(out, "an axis parameter", rooms::AXIS, &axis)?;
    write_sum(out, "AxisBehaviour", "an axis parameter", rooms::AXIS)?;
    write_rooms(out, "a global parameter", rooms::GLOBAL, &global)?;
    write_sum(out, "GlobalBehaviour", "a global parameter", rooms::GLOBAL)?;
    write_rooms(out, "an interrupt", rooms::INTERRUPT, &interrupt)?;
    write_rooms(out, "a port", rooms::PORT, &port)
}

/// One enum per room, with a variant for each effect.
fn write_rooms(
    out: &mut String,
    what: &str,
    rooms: &[(&str, &str)],
    rows: &[(&str, String)],
) -> Result {
    for (room, name) in rooms {
        writeln!(out, "/// Effects of {what} in the room `{room}`.")?;
        writeln!(out, "{DERIVES}pub enum {name} {{")?;
        for (effect, rows) in effects(room, rows) {
            let more = match rows.len() {
                0 | 1 => String::new(),
                count => format!(" and {} more", count - 1),
            };
            let first = rows.first().map_or("", String::as_str);
            writeln!(out, "    /// {first}{more}.\n    {},", variant(&effect))?;
        }
        writeln!(out, "}}\n")?;
    }
    Ok(())
}

fn effects(room: &str, rows: &[(&str, String)]) -> Effects {
    let mut effects = Effects::new();
    for (behaviour, row) in rows {
        let Some(effect) = in_room(behaviour, room) else { continue };
        match effects.iter_mut().find(|(known, _)| known == effect) {
            Some((_, rows)) => rows.push(row.clone()),
            None => effects.push((effect.to_owned(), vec![row.clone()])),
        }
    }
    effects
}

fn in_room<'a>(behaviour: &'a str, room: &str) -> Option<&'a str> {
    behaviour.split_once('.').filter(|(name, _)| *name == room).map(|(_, effect)| effect)
}

/// The enum of a table: one variant per room, and one for rows without effect.
fn write_sum(out: &mut String, name: &str, what: &str, rooms: &[(&str, &str)]) -> Result {
    writeln!(out, "/// What follows from {what}.\n{DERIVES}pub enum {name} {{")?;
    for (room, inner) in rooms {
        let variant = variant(room);
        writeln!(out, "    /// An effect in the room `{room}`.\n    {variant}({inner}),")?;
    }
    writeln!(out, "    /// Kept, but nothing follows from it; the reason.")?;
    writeln!(out, "    Stored(&'static str),\n}}\n")
}

fn write_module(out: &mut String, module: &File) -> Result {
    let head = &module.module;
    let parameters = sorted_axis_parameters(module);
    writeln!(out, "/// {}: {}", head.title, head.description)?;
    writeln!(out, "pub static {}: Module = Module {{", static_name(module))?;
    writeln!(out, "    name: {:?},\n    title: {:?},", head.name, head.title)?;
    writeln!(out, "    description: {:?},\n    number: {},", head.description, head.number)?;
    writeln!(out, "    firmware: {:?},\n    version: *b{:?},", head.firmware, head.version)?;
    writeln!(out, "    axes: {},\n    motion: Motion::{:?},", head.axes, head.motion)?;
    writeln!(out, "    peak_current_ma: {},", head.peak_current_ma)?;
    writeln!(out, "    ratings: &[")?;
    for row in &module.rating {
        writeln!(out, "        Rating {{ name: {:?}, value: {:?} }},", row.name, row.value)?;
    }
    writeln!(out, "    ],\n    axis_parameters: &[")?;
    for row in &parameters {
        write_axis_parameter(out, row, head.axes)?;
    }
    writeln!(out, "    ],\n    axis_parameter_index: &{:?},", index(&parameters))?;
    writeln!(out, "    global_parameters: &[")?;
    for row in sorted_global_parameters(module) {
        write_global_parameter(out, row)?;
    }
    writeln!(out, "    ],\n    interrupts: &[")?;
    for row in sorted_interrupts(module) {
        write_interrupt(out, row)?;
    }
    writeln!(out, "    ],\n    ports: &[")?;
    for row in sorted_ports(module) {
        write_port(out, row)?;
    }
    writeln!(out, "    ],\n    commands: &[")?;
    for row in sorted_commands(module) {
        write_command(out, row)?;
    }
    writeln!(out, "    ],\n}};\n")
}

fn write_axis_parameter(out: &mut String, row: &data::AxisParameter, axes: u8) -> Result {
    let effect = effect(row.behaviour.as_deref(), row.stored.as_deref(), rooms::AXIS);
    let all = || (0..i64::from(axes)).collect();
    let mask: u8 = row.axes.clone().unwrap_or_else(all).iter().map(|axis| 1 << axis).sum();
    write!(out, "        AxisParameter {{ number: {}, ", row.number)?;
    write_names(out, &row.id, &row.name, &row.unit)?;
    write!(out, "min: {}, max: {}, ", row.min, row.max)?;
    write!(out, "internal_max: {}, ", row.internal_max.unwrap_or(row.max))?;
    write!(out, "default: {}, default_source: Source::{:?}, ", row.default, row.default_source)?;
    write!(out, "access: {}, axes: {mask}, ", access(&row.access))?;
    write!(out, "behaviour: AxisBehaviour::{effect}, description: {:?}, ", row.description)?;
    write_origin(out, row.since, row.certainty, row.source.as_deref())?;
    writeln!(out, "values: &{:?} }},", values(&row.values))
}

fn write_global_parameter(out: &mut String, row: &data::GlobalParameter) -> Result {
    let effect = effect(row.behaviour.as_deref(), row.stored.as_deref(), rooms::GLOBAL);
    write!(out, "        GlobalParameter {{ bank: {}, number: {}, ", row.bank, row.number)?;
    write!(out, "last: {}, ", row.last.unwrap_or(row.number))?;
    write_names(out, &row.id, &row.name, &row.unit)?;
    write!(out, "min: {}, max: {}, default: {}, ", row.min, row.max, row.default)?;
    write!(out, "default_source: Source::{:?}, ", row.default_source)?;
    write!(out, "access: {}, behaviour: GlobalBehaviour::{effect}, ", access(&row.access))?;
    write!(out, "description: {:?}, ", row.description)?;
    write_origin(out, row.since, row.certainty, row.source.as_deref())?;
    writeln!(out, "values: &{:?} }},", values(&row.values))
}

fn write_interrupt(out: &mut String, row: &data::Interrupt) -> Result {
    write!(out, "        Interrupt {{ number: {}, ", row.number)?;
    write!(out, "id: {:?}, name: {:?}, ", row.id, row.name)?;
    write!(out, "behaviour: {}, ", flat_effect(&row.behaviour, rooms::INTERRUPT))?;
    write_origin(out, row.since, row.certainty, row.source.as_deref())?;
    writeln!(out, "index: {}, description: {:?} }},", row.index, row.description)
}

fn write_port(out: &mut String, row: &data::Port) -> Result {
    write!(out, "        Port {{ bank: {}, number: {}, ", row.bank, row.number)?;
    write_names(out, &row.id, &row.name, &row.unit)?;
    write!(out, "min: {}, max: {}, default: {}, ", row.min, row.max, row.default)?;
    write!(out, "access: {}, ", access(&row.access))?;
    write!(out, "behaviour: {}, ", flat_effect(&row.behaviour, rooms::PORT))?;
    write_origin(out, row.since, row.certainty, row.source.as_deref())?;
    writeln!(out, "index: {}, description: {:?} }},", row.index, row.description)
}

fn write_command(out: &mut String, row: &data::Command) -> Result {
    write!(out, "        Command {{ number: {}, mnemonic: {:?}, ", row.number, row.mnemonic)?;
    write!(out, "mode: Mode::{:?}, unavailable: {:?}, ", row.mode, row.unavailable)?;
    write_origin(out, row.since, row.certainty, row.source.as_deref())?;
    writeln!(out, "description: {:?} }},", row.description)
}

fn write_origin(
    out: &mut String,
    since: Option<(u8, u8)>,
    certainty: data::Certainty,
    source: Option<&str>,
) -> Result {
    write!(out, "since: {since:?}, certainty: Certainty::{certainty:?}, source: {source:?}, ")
}

fn write_names(out: &mut String, id: &str, name: &str, unit: &str) -> Result {
    let unit = match unit {
        "" => "Unit::None".to_owned(),
        "usteps" => "Unit::Microsteps".to_owned(),
        "pps" => "Unit::Pps".to_owned(),
        "pps2" => "Unit::Pps2".to_owned(),
        other => format!("Unit::Other({other:?})"),
    };
    write!(out, "id: {id:?}, name: {name:?}, unit: {unit}, ")
}

fn effect(behaviour: Option<&str>, stored: Option<&str>, rooms: &[(&str, &str)]) -> String {
    let named = behaviour.and_then(|text| {
        rooms.iter().find_map(|(room, inner)| {
            in_room(text, room)
                .map(|effect| format!("{}({inner}::{})", variant(room), variant(effect)))
        })
    });
    named.unwrap_or_else(|| format!("Stored({:?})", stored.unwrap_or_default()))
}

fn flat_effect(behaviour: &str, rooms: &[(&str, &str)]) -> String {
    let effect = |(room, name): &(&str, &str)| {
        in_room(behaviour, room).map(|effect| format!("{name}::{}", variant(effect)))
    };
    rooms.iter().find_map(effect).unwrap_or_default()
}

fn access(letters: &str) -> String {
    let has = |letter| letters.contains(letter);
    format!(
        "Access {{ read: {}, write: {}, store: {}, automatic: {} }}",
        has('R'),
        has('W'),
        has('E'),
        has('A')
    )
}

fn values(values: &BTreeMap<String, String>) -> Vec<(i32, &str)> {
    let mut list: Vec<_> = values
        .iter()
        .filter_map(|(value, meaning)| Some((value.parse().ok()?, meaning.as_str())))
        .collect();
    list.sort();
    list
}

/// For each number the position of its row; 255 where there is none.
fn index(rows: &[&data::AxisParameter]) -> [u8; 256] {
    let mut index = [u8::MAX; 256];
    for (number, entry) in (0..).zip(index.iter_mut()) {
        let at = rows.iter().position(|row| row.number == number);
        *entry = at.and_then(|at| u8::try_from(at).ok()).unwrap_or(u8::MAX);
    }
    index
}

fn static_name(module: &File) -> String {
    module.module.name.to_ascii_uppercase().replace('-', "_")
}

fn sorted<T, K: Ord>(rows: &[T], key: impl Fn(&T) -> K) -> Vec<&T> {
    let mut rows: Vec<_> = rows.iter().collect();
    rows.sort_by_key(|row| key(row));
    rows
}

fn sorted_axis_parameters(module: &File) -> Vec<&data::AxisParameter> {
    sorted(&module.axis_parameter, |row| row.number)
}

fn sorted_global_parameters(module: &File) -> Vec<&data::GlobalParameter> {
    sorted(&module.global_parameter, |row| (row.bank, row.number))
}

fn sorted_interrupts(module: &File) -> Vec<&data::Interrupt> {
    sorted(&module.interrupt, |row| row.number)
}

fn sorted_ports(module: &File) -> Vec<&data::Port> {
    // Where a number has two rows, the one that can be read comes first.
    sorted(&module.port, |row| (row.bank, row.number, !row.access.contains('R')))
}

fn sorted_commands(module: &File) -> Vec<&data::Command> {
    sorted(&module.command, |row| row.number)
}
