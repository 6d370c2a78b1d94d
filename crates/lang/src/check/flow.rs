//! Where a program goes.

use opentmcl_wire::Opcode;
use opentmcl_wire::opcode::Field;

use crate::assembly::Assembly;
use crate::diagnostic::{Code, Diagnostic};

use super::findings::Findings;
use super::subject::Subject;

/// Tells what is doubtful about the way that a program takes.
pub(super) fn check(assembly: &Assembly, findings: &mut Findings<'_>) {
    for instruction in &assembly.instructions {
        let Some(subject) = Subject::new(assembly, instruction) else { continue };
        if let Some(diagnostic) = check_wait(subject) {
            findings.report(diagnostic);
        }
    }
}

/// A switch need not close; that a target is reached or a search ends, the motion itself sees to.
fn check_wait(subject: Subject<'_>) -> Option<Diagnostic> {
    const SWITCHES: [u8; 2] = [2, 3];
    let command = subject.command;
    let waits_for_ever = command.number == Opcode::Wait.number()
        && SWITCHES.contains(&command.kind)
        && command.value == 0;
    waits_for_ever.then(|| {
        let location = subject.operand(Field::Value);
        let message = "waits for ever if the switch does not close";
        Diagnostic::new(Code::WaitWithoutTimeOut, location, message)
            .help("give a time-out in units of 10 ms, and test it by JC ETO")
    })
}
