//! What is made of programs, and the way back.

mod binary;
mod disassemble;
mod format;
mod listing;

use opentmcl_lang::include::BuiltInOnly;
use opentmcl_lang::{Assembly, Options, assemble};
use opentmcl_wire::Command;

/// The program of a text that includes no files and ends where it ends.
fn assembled(text: &str) -> Assembly {
    assemble("main.tmc", text, &mut BuiltInOnly, Options { append_stop: false })
}

/// The commands of a text without mistakes.
#[track_caller]
fn commands(text: &str) -> Vec<Command> {
    let assembly = assembled(text);
    assert_eq!(assembly.diagnostics, [], "{text}");
    assembly.commands().collect()
}
