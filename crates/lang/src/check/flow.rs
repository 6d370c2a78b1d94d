//! Where a program goes.
//!
//! The limits are those of the language, the same for all modules.

mod calls;
mod graph;
mod handlers;
mod reach;

use opentmcl_wire::Opcode;
use opentmcl_wire::limits::PROGRAM_LEN;
use opentmcl_wire::opcode::{Field, Meaning};

use crate::assembly::Assembly;
use crate::diagnostic::{Code, Diagnostic, Location};

use super::findings::Findings;
use super::subject::Subject;

use graph::Graph;

/// Tells what is doubtful about the way that a program takes.
pub(super) fn check(assembly: &Assembly, findings: &mut Findings<'_>) {
    check_length(assembly, findings);
    for instruction in &assembly.instructions {
        let Some(subject) = Subject::new(assembly, instruction) else { continue };
        if let Some(diagnostic) = check_wait(subject) {
            findings.report(diagnostic);
        }
        if let Some(diagnostic) = check_target(assembly.instructions.len(), subject) {
            findings.report(diagnostic);
        }
    }
    // Lines that are not understood may lead anywhere.
    if assembly.is_valid() {
        let program = Program::new(assembly);
        reach::check(&program, findings);
        calls::check(&program, findings);
        handlers::check(&program, findings);
    }
}

fn check_length(assembly: &Assembly, findings: &mut Findings<'_>) {
    let instructions = &assembly.instructions;
    let len = instructions.len();
    if len <= PROGRAM_LEN {
        return;
    }
    // The STOP that the assembler has added stands nowhere.
    let beyond = instructions[PROGRAM_LEN..].iter().chain(instructions.iter().rev());
    let Some(subject) = beyond.into_iter().find_map(|one| Subject::new(assembly, one)) else {
        return;
    };
    let message = format!("the program has {len} commands");
    findings.report(
        Diagnostic::new(Code::ProgramTooLong, subject.location(), message)
            .help(format!("program memory holds {PROGRAM_LEN}; this one is beyond")),
    );
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

fn check_target(len: usize, subject: Subject<'_>) -> Option<Diagnostic> {
    let operand = subject.form?.operands.iter().find(|one| one.meaning == Meaning::Address)?;
    let address = subject.command.value;
    if usize::try_from(address).is_ok_and(|address| address < len) {
        return None;
    }
    let location = subject.operand(operand.field);
    let shown = subject.shown(operand.field);
    let message = format!("there is no command at address {shown}");
    let help = if usize::try_from(address).is_ok_and(|address| address == len) {
        "that is right behind the last command; write STOP there".into()
    } else {
        format!("the program has the addresses 0..{}", len.saturating_sub(1))
    };
    Some(Diagnostic::new(Code::JumpOutsideProgram, location, message).help(help))
}

/// A program whose way can be followed.
struct Program<'a> {
    assembly: &'a Assembly,
    graph: Graph,
    /// The first label of each address that has one, ascending.
    labels: Vec<(u32, &'a str)>,
}

impl<'a> Program<'a> {
    fn new(assembly: &'a Assembly) -> Self {
        let mut labels: Vec<_> =
            assembly.labels().map(|label| (label.address, label.name)).collect();
        labels.dedup_by_key(|(address, _)| *address);
        Self { assembly, graph: Graph::new(assembly.commands()), labels }
    }

    fn label(&self, address: u32) -> Option<&'a str> {
        let at = self.labels.binary_search_by_key(&address, |&(address, _)| address).ok()?;
        self.labels.get(at).map(|&(_, name)| name)
    }

    /// How to name an address.
    fn name(&self, address: u32) -> String {
        match self.label(address) {
            Some(name) => name.to_owned(),
            None => format!("address {address}"),
        }
    }

    fn subject(&self, address: u32) -> Option<Subject<'a>> {
        Subject::new(self.assembly, self.assembly.instructions.get(address as usize)?)
    }

    /// Where a command is; nowhere, if the assembler has added it.
    fn location(&self, address: u32) -> Option<Location> {
        self.subject(address).map(|subject| subject.location())
    }
}
