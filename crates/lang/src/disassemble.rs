//! Commands back to a program.

use std::fmt::Write;

use opentmcl_catalog::{Module, Unit};
use opentmcl_wire::Command;
use opentmcl_wire::opcode::{self, Field, Form, Meaning, Opcode};

/// The column of commands.
const COMMAND_COLUMN: usize = 10;

/// The column of comments, behind nearly every command.
const COMMENT_COLUMN: usize = 36;

/// How a program is shown.
#[derive(Clone, Copy, Debug, Default)]
pub struct Disassembly<'a> {
    /// The module whose names of parameters, ports and interrupts stand as comments behind the
    /// commands; without it there are none.
    pub module: Option<&'static Module>,
    /// A comment at the top. The vendor's tools have `TMCL disassembly at` and the time here.
    pub title: Option<&'a str>,
}

/// A program that assembles to exactly these commands, whatever they are, when no STOP is appended.
///
/// The layout is that of the vendor's tools: commands from column 10, `Lbl31:` and a blank line in
/// front of the places that commands lead to, a blank line behind RSUB. It differs in two points: there
/// are no blanks behind commands without operands, and never two blank lines in a row. What a mnemonic
/// cannot show (an unknown command, a field that the command does not use) is written by numbers:
/// `200 1, 2, 3`. So is an address outside of the program.
pub fn disassemble(commands: &[Command], options: &Disassembly<'_>) -> String {
    let targets = targets(commands);
    let mut text = String::with_capacity(commands.len() * 32);
    if let Some(title) = options.title {
        for line in title.split(['\n', '\r']) {
            text.push_str("//");
            text.push_str(line.trim_end());
            text.push('\n');
        }
    }
    let mut wants_blank_line = false;
    for (address, &is_target) in targets.iter().enumerate() {
        let command = commands.get(address).copied();
        if !is_target && command.is_none() {
            break;
        }
        if (wants_blank_line || is_target) && !text.is_empty() {
            text.push('\n');
        }
        let start = text.len();
        if is_target {
            // Writing to a string cannot fail.
            let _ = write!(text, "Lbl{address}:");
        }
        if let Some(command) = command {
            let separator = usize::from(is_target);
            pad(&mut text, start, COMMAND_COLUMN, separator);
            let form = mnemonic_form(command);
            write_command(&mut text, command, form, &targets);
            if let Some((module, form)) = options.module.zip(form) {
                write_names(&mut text, start, command, form, module);
            }
        }
        text.push('\n');
        wants_blank_line = command.is_some_and(|it| it.number == Opcode::Rsub.number());
    }
    text
}

/// For each address, that behind the last command included, whether a command leads there.
fn targets(commands: &[Command]) -> Vec<bool> {
    let mut targets = vec![false; commands.len() + 1];
    for &command in commands {
        let leads = mnemonic_form(command).is_some_and(|form| {
            form.operands.iter().any(|operand| operand.meaning == Meaning::Address)
        });
        let target = usize::try_from(command.value).ok().filter(|_| leads);
        if let Some(target) = target.and_then(|address| targets.get_mut(address)) {
            *target = true;
        }
    }
    targets
}

/// The form of a command that shows all of it.
fn mnemonic_form(command: Command) -> Option<&'static Form> {
    opcode::form(command.number).filter(|form| form.shows_all_of(command))
}

fn write_command(
    text: &mut String,
    command: Command,
    form: Option<&'static Form>,
    targets: &[bool],
) {
    let Some(form) = form else {
        let _ = write!(text, "{command}");
        return;
    };
    text.push_str(form.mnemonic);
    for (at, operand) in form.operands.iter().enumerate() {
        text.push_str(if at == 0 { " " } else { ", " });
        let number = match operand.field {
            Field::Kind => i32::from(command.kind),
            Field::Motor => i32::from(command.motor),
            Field::Value => command.value,
        };
        let word = operand.words.iter().find(|&&(_, value)| i32::from(value) == number);
        let label = operand.meaning == Meaning::Address
            && usize::try_from(number).is_ok_and(|address| address < targets.len());
        let _ = match word {
            Some((word, _)) => write!(text, "{word}"),
            None if label => write!(text, "Lbl{number}"),
            None => write!(text, "{number}"),
        };
    }
}

/// What the module calls the parameter, port or interrupt of a command, as a comment.
fn write_names(
    text: &mut String,
    start: usize,
    command: Command,
    form: &'static Form,
    module: &'static Module,
) {
    for operand in form.operands {
        let named = match operand.meaning {
            Meaning::AxisParameter => module.axis_parameter(command.kind).map(|row| Named {
                name: row.name,
                unit: row.unit,
                values: row.values,
            }),
            Meaning::GlobalParameter => module
                .global_parameter(command.motor, command.kind)
                // The name of a row for many parameters says less than the number.
                .filter(|row| row.number == row.last)
                .map(|row| Named { name: row.name, unit: row.unit, values: row.values }),
            Meaning::Port => {
                let is_output = form.opcode == Opcode::Sio;
                let find = if is_output { Module::output_port } else { Module::input_port };
                find(module, command.motor, command.kind).map(|row| Named {
                    name: row.name,
                    unit: row.unit,
                    values: &[],
                })
            }
            Meaning::Interrupt => module.interrupt(command.kind).map(|row| Named {
                name: row.name,
                unit: Unit::None,
                values: &[],
            }),
            _ => None,
        };
        let Some(named) = named else { continue };
        pad(text, start, COMMENT_COLUMN, 2);
        text.push_str("// ");
        text.push_str(named.name);
        let sets = form.operands.iter().any(|operand| operand.field == Field::Value);
        let value = named.values.iter().find(|&&(value, _)| sets && value == command.value);
        let unit = match named.unit {
            Unit::None => "",
            Unit::Microsteps => "microsteps",
            Unit::Pps => "pps",
            Unit::Pps2 => "pps²",
            Unit::Other(unit) => unit,
        };
        let _ = match value {
            Some((_, meaning)) => write!(text, ": {meaning}"),
            None if unit.is_empty() => Ok(()),
            None => write!(text, ", {unit}"),
        };
        return;
    }
}

/// What a catalogue says of a number.
struct Named {
    name: &'static str,
    unit: Unit,
    values: &'static [(i32, &'static str)],
}

/// Blanks up to a column of the line that begins at `start`, at least so many.
fn pad(text: &mut String, start: usize, column: usize, least: usize) {
    let width = text[start..].chars().count();
    let blanks = column.saturating_sub(width).max(least);
    text.extend(std::iter::repeat_n(' ', blanks));
}
