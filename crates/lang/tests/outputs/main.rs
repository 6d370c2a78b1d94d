//! What is made of programs, and the way back.

mod binary;
mod disassemble;
mod format;
mod listing;

use std::fs;
use std::path::{Path, PathBuf};

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

/// The programs that `tests/manual/` has from manuals and from other tools.
fn programs_of_the_manuals() -> Vec<(PathBuf, String)> {
    let manual = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/manual");
    let folders = ["programs", "binaries"].map(|folder| fs::read_dir(manual.join(folder)).unwrap());
    let files = folders.into_iter().flatten().map(|entry| entry.unwrap().path());
    let programs: Vec<_> = files
        .filter(|path| path.extension().is_some_and(|extension| extension == "tmc"))
        .map(|path| (path.clone(), fs::read_to_string(path).unwrap()))
        .collect();
    assert!(programs.len() > 20, "only {} programs", programs.len());
    programs
}
