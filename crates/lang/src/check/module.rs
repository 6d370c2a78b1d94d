//! Each command of a program against what a module has.

use opentmcl_catalog::{Mode, Module};

use crate::assembly::Assembly;
use crate::diagnostic::{Code, Diagnostic};

use super::findings::Findings;
use super::subject::Subject;

/// Tells what the module would refuse.
pub(super) fn check(module: &'static Module, assembly: &Assembly, findings: &mut Findings<'_>) {
    for instruction in &assembly.instructions {
        let Some(subject) = Subject::new(assembly, instruction) else { continue };
        if let Some(diagnostic) = check_command(module, subject) {
            findings.report(diagnostic);
        }
    }
}

/// The end mark: an empty place of program memory, which every module knows.
const END: u8 = 0;

fn check_command(module: &'static Module, subject: Subject<'_>) -> Option<Diagnostic> {
    let number = subject.command.number;
    if number == END {
        return None;
    }
    let title = module.title;
    let name = subject.name();
    let Some(row) = module.command(number) else {
        let message = format!("the {title} has no command {name}");
        return Some(Diagnostic::new(Code::NoSuchCommand, subject.head(), message));
    };
    let why = match row {
        opentmcl_catalog::Command { unavailable: Some(why), .. } => (*why).to_owned(),
        opentmcl_catalog::Command { mode: Mode::Direct, mnemonic, .. } => {
            format!("{number} is {mnemonic}, which only a host may send")
        }
        _ => return None,
    };
    let message = format!("the {title} refuses {name}");
    Some(Diagnostic::new(Code::CommandNotAvailable, subject.head(), message).help(why))
}
