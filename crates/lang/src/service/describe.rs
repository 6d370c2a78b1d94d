//! What the catalogue and the program know of something, as text for people.

use core::fmt::Write;

use opentmcl_catalog::{Access, Command, MODULES, Mode, Module, Source, Unit};
use opentmcl_wire::opcode::Form;

use super::subject::Subject;

/// The unit of a value; nothing for plain numbers.
fn unit(unit: Unit) -> &'static str {
    match unit {
        Unit::None => "",
        Unit::Microsteps => "microsteps",
        Unit::Pps => "pps",
        Unit::Pps2 => "pps²",
        Unit::Other(name) => name,
    }
}

/// What all rows with a value have.
struct Value {
    unit: Unit,
    min: i64,
    max: i64,
    default: i32,
    default_source: Option<Source>,
    access: Access,
    values: &'static [(i32, &'static str)],
}

impl Subject {
    fn value(self) -> Option<Value> {
        Some(match self {
            Self::AxisParameter(row) => Value {
                unit: row.unit,
                min: row.min.into(),
                max: row.max.into(),
                default: row.default,
                default_source: Some(row.default_source),
                access: row.access,
                values: row.values,
            },
            Self::GlobalParameter(row) => Value {
                unit: row.unit,
                min: row.min,
                max: row.max,
                default: row.default,
                default_source: Some(row.default_source),
                access: row.access,
                values: row.values,
            },
            Self::Port(row) => Value {
                unit: row.unit,
                min: row.min.into(),
                max: row.max.into(),
                default: row.default,
                default_source: None,
                access: row.access,
                values: &[],
            },
            Self::Interrupt(_) => return None,
        })
    }

    fn description(self) -> &'static str {
        match self {
            Self::AxisParameter(row) => row.description,
            Self::GlobalParameter(row) => row.description,
            Self::Port(row) => row.description,
            Self::Interrupt(row) => row.description,
        }
    }

    /// What it is and which number it has.
    pub(super) fn place(self) -> String {
        match self {
            Self::AxisParameter(row) => format!("axis parameter {}", row.number),
            Self::GlobalParameter(row) if row.number == row.last => {
                format!("global parameter {} of bank {}", row.number, row.bank)
            }
            Self::GlobalParameter(row) => {
                format!("global parameters {} to {} of bank {}", row.number, row.last, row.bank)
            }
            Self::Port(row) => format!("port {} of bank {}", row.number, row.bank),
            Self::Interrupt(row) => format!("interrupt {}", row.number),
        }
    }

    /// Range and unit in a few words: `0..7999774 pps`.
    pub(super) fn range(self) -> Option<String> {
        let Value { min, max, unit: counted, .. } = self.value()?;
        let unit = unit(counted);
        Some(format!("{min}..{max} {unit}").trim_end().to_owned())
    }

    /// The meaning of each value, where they are few.
    pub(super) fn values(self) -> &'static [(i32, &'static str)] {
        self.value().map_or(&[], |value| value.values)
    }

    /// All of it, in Markdown.
    pub(super) fn markdown(self, module: &Module) -> String {
        let mut text = format!("**{}**, {} of {}", self.name(), self.place(), module.title);
        let _ = write!(text, "\n\n{}", self.description());
        let Some(value) = self.value() else { return text };
        let unit = unit(value.unit);
        let _ = write!(text, "\n\n- Range: {}", self.range().unwrap_or_default());
        if let Self::AxisParameter(row) = self
            && row.internal_max != row.max
        {
            let min = if row.min < 0 { -row.internal_max } else { row.min };
            let _ = write!(text, "; {min}..{} with unit mode 0", row.internal_max);
        }
        let _ = write!(text, "\n- After power-up: {} {unit}", value.default);
        text.truncate(text.trim_end().len());
        match value.default_source {
            Some(Source::OpenFirmware) => text.push_str(" (from the vendor's open firmware)"),
            Some(Source::Chosen) => text.push_str(" (chosen; the manual does not say)"),
            Some(Source::Manual) | None => {}
        }
        let _ = write!(text, "\n- Access: {}", rights(value.access));
        if let Self::AxisParameter(row) = self
            && (0..module.axes).any(|axis| !row.is_on(axis))
        {
            let axes = (0..module.axes).filter(|&axis| row.is_on(axis));
            let axes: Vec<_> = axes.map(|axis| axis.to_string()).collect();
            let _ = write!(text, "\n- Only on the axes {}", axes.join(", "));
        }
        for (number, meaning) in value.values {
            let _ = write!(text, "\n- {number}: {meaning}");
        }
        text
    }

    /// What one value of it means, in Markdown.
    pub(super) fn value_markdown(self, value: Option<i64>) -> Option<String> {
        let range = self.range()?;
        let mut text = format!("Value of **{}**, {}: {range}", self.name(), self.place());
        let meant = |&&(known, _): &&(i32, _)| Some(i64::from(known)) == value;
        if let Some((number, meaning)) = self.values().iter().find(meant) {
            let _ = write!(text, "\n\n{number}: {meaning}");
        }
        Some(text)
    }
}

/// What may be done, in words.
fn rights(access: Access) -> String {
    let rights = [
        (access.read, "read"),
        (access.write, "write"),
        (access.store, "store and restore"),
        (access.automatic, "stored by each write"),
    ];
    let words: Vec<_> = rights.iter().filter(|(has, _)| *has).map(|(_, word)| *word).collect();
    words.join(", ")
}

/// The catalogue's row of a command: of this module, or if none is known of any that has it.
pub(super) fn command(module: Option<&'static Module>, number: u8) -> Option<&'static Command> {
    match module {
        Some(module) => module.command(number),
        None => MODULES.iter().find_map(|module| module.command(number)),
    }
}

/// Whether a program on this module may use a command; on an unknown module it may use all.
pub(super) fn is_usable(module: Option<&'static Module>, number: u8) -> bool {
    let Some(module) = module else { return true };
    module.command(number).is_some_and(|row| row.unavailable.is_none() && row.mode != Mode::Direct)
}

/// A command: how it is written, its number and what it does, in Markdown.
pub(super) fn command_markdown(module: Option<&'static Module>, form: &Form) -> String {
    let number = form.opcode.number();
    let mut text = format!("```tmcl\n{form}\n```\n");
    let row = command(module, number);
    if let Some(row) = row {
        let _ = write!(text, "{}\n\n", row.description);
    }
    let _ = write!(text, "Command {number}");
    let (Some(module), row) = (module, row) else { return text };
    let Some(row) = row else {
        let _ = write!(text, "; {} does not have it", module.title);
        return text;
    };
    match row.mode {
        Mode::Both => {}
        Mode::Direct => text.push_str("; only for hosts, not in programs"),
        Mode::Standalone => text.push_str("; only in programs"),
    }
    if let Some((major, minor)) = row.since {
        let _ = write!(text, "; since firmware {major}.{minor:02}");
    }
    if let Some(why) = row.unavailable {
        let _ = write!(text, "; not available on {}: {why}", module.title);
    }
    text
}
