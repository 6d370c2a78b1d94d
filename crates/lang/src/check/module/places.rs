//! Ports, interrupts, coordinates, variables, and times.

use opentmcl_catalog::{InterruptBehaviour, Port};
use opentmcl_wire::Opcode;
use opentmcl_wire::limits::{COORDINATES, VARIABLES};
use opentmcl_wire::opcode::{Field, Operand};

use crate::check::subject::Subject;
use crate::diagnostic::{Code, Diagnostic};

use super::parameters::{in_unit, out_of_range};
use super::{Rules, ranges};

const LAST_COORDINATE: i32 = COORDINATES as i32 - 1;
const LAST_VARIABLE: i32 = VARIABLES as i32 - 1;

impl Rules {
    pub(super) fn port(self, opcode: Opcode, subject: Subject<'_>) -> Option<Diagnostic> {
        let Self { module, .. } = self;
        let (number, bank) = (subject.command.kind, subject.command.motor);
        let is_output = opcode == Opcode::Sio;
        let suits = |row: &&Port| if is_output { row.access.write } else { row.access.read };
        let kind = if is_output { "output" } else { "input" };
        let ports = module.ports.iter().filter(suits);
        let in_bank = ports.clone().filter(|row| row.bank == bank);
        if in_bank.clone().next().is_none() {
            let shown = subject.shown(Field::Motor);
            let message = format!("the {} has no bank {shown} of {kind}s", module.title);
            let help = format!("banks {} have some", ranges(ports.map(|row| row.bank)));
            let location = subject.operand(Field::Motor);
            return Some(Diagnostic::new(Code::NoSuchBank, location, message).help(help));
        }
        let Some(row) = in_bank.clone().find(|row| row.number == number) else {
            let shown = subject.shown(Field::Kind);
            let message = format!("bank {bank} of the {} has no {kind} {shown}", module.title);
            let help = format!("it has {}", ranges(in_bank.map(|row| row.number)));
            let location = subject.operand(Field::Kind);
            return Some(Diagnostic::new(Code::NoSuchPort, location, message).help(help));
        };
        let fits = !is_output || (row.min..=row.max).contains(&subject.command.value);
        (!fits).then(|| {
            let help = format!("it takes {}..{}{}", row.min, row.max, in_unit(row.unit));
            out_of_range(row.name, subject).help(help)
        })
    }

    pub(super) fn interrupt(self, opcode: Opcode, subject: Subject<'_>) -> Option<Diagnostic> {
        let Self { module, .. } = self;
        let shown = subject.shown(Field::Kind);
        let has_handler = |behaviour| behaviour != InterruptBehaviour::Global;
        let message = match module.interrupt(subject.command.kind) {
            None => format!("the {} has no interrupt {shown}", module.title),
            Some(row) if opcode == Opcode::Vect && !has_handler(row.behaviour) => {
                format!("{shown} switches all interrupts; it has no handler of its own")
            }
            Some(_) => return None,
        };
        let rows = module.interrupts.iter();
        let suitable = rows.filter(|row| opcode != Opcode::Vect || has_handler(row.behaviour));
        let help = format!("its interrupts are {}", ranges(suitable.map(|row| row.number)));
        let location = subject.operand(Field::Kind);
        Some(Diagnostic::new(Code::NoSuchInterrupt, location, message).help(help))
    }
}

pub(super) fn coordinate(
    number: i32,
    operand: &Operand,
    subject: Subject<'_>,
) -> Option<Diagnostic> {
    if (0..=LAST_COORDINATE).contains(&number) {
        return None;
    }
    let message = format!("there is no coordinate {}", subject.shown(operand.field));
    let help = format!("each axis has the coordinates 0..{LAST_COORDINATE}");
    let location = subject.operand(operand.field);
    Some(Diagnostic::new(Code::NoSuchCoordinate, location, message).help(help))
}

pub(super) fn variable(operand: &Operand, subject: Subject<'_>) -> Option<Diagnostic> {
    // In the other fields every number is that of a variable.
    if operand.field != Field::Value || (0..=LAST_VARIABLE).contains(&subject.command.value) {
        return None;
    }
    let message = format!("there is no user variable {}", subject.shown(operand.field));
    let help = format!("there are the user variables 0..{LAST_VARIABLE}");
    let location = subject.operand(operand.field);
    Some(Diagnostic::new(Code::NoSuchVariable, location, message).help(help))
}

pub(super) fn ticks(subject: Subject<'_>) -> Option<Diagnostic> {
    const FROM_ACCUMULATOR: i32 = -1;
    if subject.command.value >= FROM_ACCUMULATOR {
        return None;
    }
    let message = format!("the time {} counts as 0", subject.shown(Field::Value));
    let location = subject.operand(Field::Value);
    Some(
        Diagnostic::new(Code::NegativeTime, location, message)
            .help("a time is 0 or more, or -1 for the number in the accumulator"),
    )
}
