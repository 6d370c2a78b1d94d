//! Commands back to a program.

use std::fmt::Write;

use opentmcl_catalog::{Module, Unit};
use opentmcl_wire::Command;
use opentmcl_wire::opcode::{self, Field, Form, Meaning, Opcode};

use crate::builtin::module as names;

/// The column of commands.
const COMMAND_COLUMN: usize = 10;

/// The column of comments, behind nearly every command.
const COMMENT_COLUMN: usize = 52;

/// How a program is shown.
#[derive(Clone, Copy, Debug, Default)]
pub struct Disassembly<'a> {
    /// The module whose names of parameters, ports and interrupts stand in place of their numbers, with
    /// units and meanings of values as comments. The program then includes the module's names and
    /// names the module.
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
    if let Some(module) = options.module {
        let _ = writeln!(text, "// module: {}", module.name);
        let _ = writeln!(text, "#include {}", names::file_name(module));
    }
    let mut wants_blank_line = options.module.is_some();
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
            let named =
                options.module.zip(form).and_then(|(module, form)| named(command, form, module));
            write_command(&mut text, command, form, named.as_ref(), &targets);
            if let Some(named) = named {
                write_comment(&mut text, start, command, &named);
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
    named: Option<&Named>,
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
        let name = named.filter(|named| named.meaning == operand.meaning);
        let name = word.map(|&(word, _)| word).or(name.map(|named| named.constant.as_str()));
        let _ = match name {
            Some(name) => write!(text, "{name}"),
            None if label => write!(text, "Lbl{number}"),
            None => write!(text, "{number}"),
        };
    }
}

/// What a catalogue says of a number in a command.
struct Named {
    /// Which operand it is about.
    meaning: Meaning,
    /// The constant in the module's include file.
    constant: String,
    unit: Unit,
    values: &'static [(i32, &'static str)],
}

/// The parameter, port or interrupt that a command names, if the module has it.
fn named(command: Command, form: &Form, module: &'static Module) -> Option<Named> {
    let Command { kind, motor, .. } = command;
    form.operands.iter().find_map(|operand| {
        let (constant, unit, values): (_, _, &[_]) = match operand.meaning {
            Meaning::AxisParameter => {
                let row = module.axis_parameter(kind)?;
                (names::axis_parameter(row), row.unit, row.values)
            }
            Meaning::GlobalParameter => {
                // Rows for many parameters have no name for each of them.
                let row =
                    module.global_parameter(motor, kind).filter(|row| row.number == row.last)?;
                (names::global_parameter(row), row.unit, row.values)
            }
            Meaning::Port => {
                let is_output = form.opcode == Opcode::Sio;
                let find = if is_output { Module::output_port } else { Module::input_port };
                let row = find(module, motor, kind)?;
                (names::port(row), row.unit, &[])
            }
            Meaning::Interrupt => (names::interrupt(module.interrupt(kind)?), Unit::None, &[]),
            _ => return None,
        };
        Some(Named { meaning: operand.meaning, constant, unit, values })
    })
}

/// The meaning of the value that a command sets, or its unit.
fn write_comment(text: &mut String, start: usize, command: Command, named: &Named) {
    let sets = opcode::form(command.number)
        .is_some_and(|form| form.operands.iter().any(|operand| operand.field == Field::Value));
    let value = named.values.iter().find(|&&(value, _)| sets && value == command.value);
    let unit = match named.unit {
        Unit::None => "",
        Unit::Microsteps => "microsteps",
        Unit::Pps => "pps",
        Unit::Pps2 => "pps²",
        Unit::Other(unit) => unit,
    };
    let comment = value.map_or(unit, |&(_, meaning)| meaning);
    if !comment.is_empty() {
        pad(text, start, COMMENT_COLUMN, 2);
        text.push_str("// ");
        text.push_str(comment);
    }
}

/// Blanks up to a column of the line that begins at `start`, at least so many.
fn pad(text: &mut String, start: usize, column: usize, least: usize) {
    let width = text[start..].chars().count();
    let blanks = column.saturating_sub(width).max(least);
    text.extend(std::iter::repeat_n(' ', blanks));
}
