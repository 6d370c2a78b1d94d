//! Each command of a program against what a module has.
//!
//! An error here is what the firmware refuses; `tests/refusals.rs` compares the two.

mod axes;
mod choices;
mod parameters;
mod places;

use opentmcl_catalog::{Axis, AxisBehaviour, Mode, Module};
use opentmcl_wire::Opcode;
use opentmcl_wire::opcode::Meaning;

use crate::assembly::Assembly;
use crate::diagnostic::{Code, Diagnostic};

use super::findings::Findings;
use super::subject::Subject;

/// The end mark: an empty place of program memory, which every module knows.
const END: u8 = 0;

/// What the checks of one program share.
#[derive(Clone, Copy)]
struct Rules {
    module: &'static Module,
    /// The program writes the unit mode of an axis: speeds may be in the chip's own unit.
    internal_units: bool,
}

/// Tells what the module would refuse.
pub(super) fn check(module: &'static Module, assembly: &Assembly, findings: &mut Findings<'_>) {
    let rules = Rules { module, internal_units: writes_unit_mode(module, assembly) };
    for instruction in &assembly.instructions {
        let Some(subject) = Subject::new(assembly, instruction) else { continue };
        rules.command(subject, findings);
    }
}

fn writes_unit_mode(module: &Module, assembly: &Assembly) -> bool {
    let is_unit_mode = |number| {
        let row = module.axis_parameter(number);
        row.is_some_and(|row| row.behaviour == AxisBehaviour::Axis(Axis::UnitMode))
    };
    assembly.commands().any(|command| {
        let writes = matches!(
            Opcode::from_number(command.number),
            Some(Opcode::Sap | Opcode::Sapx | Opcode::Aap | Opcode::Aapx)
        );
        writes && is_unit_mode(command.kind)
    })
}

impl Rules {
    fn command(self, subject: Subject<'_>, findings: &mut Findings<'_>) {
        if subject.command.number == END {
            return;
        }
        if let Some(diagnostic) = self.existence(subject) {
            return findings.report(diagnostic);
        }
        let Some(form) = subject.form else { return };
        let opcode = form.opcode;
        for operand in form.operands {
            let found = match operand.meaning {
                Meaning::Choice => choices::check(opcode, operand, subject),
                Meaning::Axis => self.axis(opcode, subject),
                Meaning::AxisParameter => self.axis_parameter(opcode, subject),
                Meaning::GlobalParameter => self.global_parameter(opcode, subject),
                Meaning::Port => self.port(opcode, subject),
                Meaning::Coordinate => {
                    places::coordinate(i32::from(subject.command.kind), operand, subject)
                }
                Meaning::Interrupt => self.interrupt(opcode, subject),
                Meaning::Variable => places::variable(operand, subject),
                Meaning::Ticks => places::ticks(subject),
                Meaning::Velocity => self.velocity(opcode, subject),
                Meaning::Position if axes::is_coordinate_move(opcode, subject.command) => {
                    places::coordinate(subject.command.value, operand, subject)
                }
                // A bank is looked at with what is in it, an address with the way of the program.
                Meaning::Position | Meaning::Bank | Meaning::Address | Meaning::Number => None,
            };
            let Some(diagnostic) = found else { continue };
            findings.report(diagnostic);
            if operand.meaning == Meaning::Choice {
                // What the other operands are for depends on it.
                return;
            }
        }
    }

    fn existence(self, subject: Subject<'_>) -> Option<Diagnostic> {
        let Self { module, .. } = self;
        let number = subject.command.number;
        let title = module.title;
        let name = subject.name();
        let Some(row) = module.command(number) else {
            let message = format!("the {title} has no command {name}");
            return Some(Diagnostic::new(Code::NoSuchCommand, subject.head(), message));
        };
        let why = match row.unavailable {
            Some(why) => why.to_owned(),
            None if row.mode == Mode::Direct => {
                format!("{number} is {}, which only a host may send", row.mnemonic)
            }
            None => return None,
        };
        let message = format!("the {title} refuses {name}");
        Some(Diagnostic::new(Code::CommandNotAvailable, subject.head(), message).help(why))
    }
}

/// Numbers in ascending order as people write them: `0..2, 7, 27..46`.
fn ranges(numbers: impl IntoIterator<Item = u8>) -> String {
    let mut ranges: Vec<(u8, u8)> = Vec::new();
    for number in numbers {
        match ranges.last_mut() {
            Some((_, last)) if *last == number => {}
            Some((_, last)) if last.checked_add(1) == Some(number) => *last = number,
            _ => ranges.push((number, number)),
        }
    }
    let shown = ranges.iter().map(|&(first, last)| match last - first {
        0 => first.to_string(),
        1 => format!("{first}, {last}"),
        _ => format!("{first}..{last}"),
    });
    shown.collect::<Vec<_>>().join(", ")
}

#[cfg(test)]
mod tests {
    use super::ranges;

    #[test]
    fn neighbours_among_numbers_are_one_range() {
        assert_eq!(ranges([0, 1, 2, 7, 27, 28, 255]), "0..2, 7, 27, 28, 255");
        assert_eq!(ranges([4, 4, 5, 6]), "4..6");
        assert_eq!(ranges([]), "");
    }
}
