//! Operands that are one of a few words.

use opentmcl_wire::Opcode;
use opentmcl_wire::opcode::Operand;

use crate::check::subject::Subject;
use crate::diagnostic::{Code, Diagnostic};

/// Words for operations that not all commands of the CALC family have.
const SWAP: u8 = 10;
const COMP: u8 = 11;

/// Whether a command has the operation that a word of its operand names.
const fn is_defined(opcode: Opcode, number: u8) -> bool {
    match opcode {
        // A constant has no place to exchange with, and COMP compares with one.
        Opcode::Calc => number != SWAP && number != COMP,
        Opcode::Calcv => number != SWAP,
        Opcode::Calcx => number != COMP,
        _ => true,
    }
}

/// What does the same where a command cannot.
const fn instead(opcode: Opcode, number: u8) -> Option<&'static str> {
    match (opcode, number) {
        (Opcode::Calc, COMP) => Some("COMP compares the accumulator with a value"),
        (Opcode::Calc, SWAP) => {
            Some("CALCX SWAP exchanges accumulator and X, CALCAV SWAP accumulator and variable")
        }
        (Opcode::Calcv, SWAP) => Some("CALCVV SWAP exchanges two variables"),
        (Opcode::Calcx, COMP) => Some("CALCAV COMP compares the accumulator with a variable"),
        _ => None,
    }
}

/// Tells of a number without a word, and of a word that this command does not have.
pub(super) fn check(opcode: Opcode, operand: &Operand, subject: Subject<'_>) -> Option<Diagnostic> {
    let number = subject.command.kind;
    let words = operand.words.iter().filter(|(_, number)| is_defined(opcode, *number));
    if words.clone().any(|&(_, known)| known == number) {
        return None;
    }
    let name = subject.name();
    let message = match operand.words.iter().find(|&&(_, known)| known == number) {
        Some((word, _)) => format!("{name} has no {word}"),
        None => format!("{name} has no {} {}", operand.name, subject.shown(operand.field)),
    };
    let help = match instead(opcode, number) {
        Some(instead) => instead.to_owned(),
        None => {
            let words: Vec<_> = words.map(|(word, number)| format!("{word} ({number})")).collect();
            format!("it has {}", words.join(", "))
        }
    };
    let location = subject.operand(operand.field);
    Some(Diagnostic::new(Code::NoSuchOperation, location, message).help(help))
}
