//! The reference pages of the book, which are made from the tables of the program.
//!
//! The files must be what is made here. After a change of the tables, run
//! `OPENTMCL_BLESS=1 cargo test -p opentmcl-cli --test reference`.

use std::env;
use std::fmt::Write;
use std::fs;
use std::path::Path;

use opentmcl_catalog::{MODULES, Mode, Module};
use opentmcl_lang::expression::Function;
use opentmcl_lang::{Code, Severity};
use opentmcl_wire::opcode::{FORMS, Form, Operand};

const NOTE: &str = "This page is made from the tables of the program; \
                    `OPENTMCL_BLESS=1 cargo test -p opentmcl-cli --test reference` makes it again.\n";

#[track_caller]
fn is_as_made(name: &str, text: &str) {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../docs/reference").join(name);
    if env::var_os("OPENTMCL_BLESS").is_some() {
        fs::write(&path, text).unwrap();
    }
    let found = fs::read_to_string(&path).unwrap_or_default();
    assert!(found == text, "docs/reference/{name} is not up to date; see the head of this test");
}

/// A command as one writes it, within a table, where a bar would end the cell.
fn written(form: &Form) -> String {
    format!("`{}`", form.to_string().replace('|', "\\|"))
}

/// Where a module takes a command: in a program, from a host, in both, or not at all.
fn use_of(module: &Module, form: &Form) -> String {
    let Some(row) = module.command(form.opcode.number()) else { return "–".into() };
    let place = match row.mode {
        _ if row.unavailable.is_some() => "refused",
        Mode::Both => "yes",
        Mode::Direct => "host only",
        Mode::Standalone => "program only",
    };
    match row.since {
        Some((major, minor)) => format!("{place}, since V{major}.{minor:02}"),
        None => place.into(),
    }
}

#[test]
fn the_page_of_commands_is_up_to_date() {
    let mut page = String::from(
        "# Commands\n\nEvery command that the assembler knows, with its number and its operands, and \
         where each module takes it. A keyword may be written as its number; an address is written as \
         a label. [The language](../language.md) says how they make a program.\n\n",
    );
    page += NOTE;
    page += "\n| No. | Written |";
    for module in MODULES {
        let _ = write!(page, " {} |", module.title);
    }
    page += " What it does |\n|---|---|";
    page += &"---|".repeat(MODULES.len() + 1);
    page.push('\n');
    for form in FORMS {
        let number = form.opcode.number();
        let _ = write!(page, "| {number} | {} |", written(form));
        for module in MODULES {
            let _ = write!(page, " {} |", use_of(module, form));
        }
        let row = MODULES.iter().find_map(|module| module.command(number));
        let description = row.map_or("A command of other modules.", |row| row.description);
        let _ = writeln!(page, " {description} |");
    }
    page += "\n## Keywords\n\n| Operand | Commands | Keywords and their numbers |\n|---|---|---|\n";
    let mut told: Vec<&Operand> = Vec::new();
    for operand in FORMS.iter().flat_map(|form| form.operands) {
        if operand.words.is_empty() || told.iter().any(|known| known.words == operand.words) {
            continue;
        }
        told.push(operand);
        let users = FORMS
            .iter()
            .filter(|form| form.operands.iter().any(|other| other.words == operand.words));
        let users: Vec<_> = users.map(|form| form.mnemonic).collect();
        let words: Vec<_> =
            operand.words.iter().map(|(word, number)| format!("`{word}` {number}")).collect();
        let _ =
            writeln!(page, "| {} | {} | {} |", operand.name, users.join(", "), words.join(", "));
    }
    page += "\n## Functions of expressions\n\n| Function | Value |\n|---|---|\n";
    for function in Function::ALL {
        let _ = writeln!(page, "| `{}` | {} |", function.name(), function.description());
    }
    is_as_made("commands.md", &page);
}

#[test]
fn the_page_of_findings_is_up_to_date() {
    let mut page = String::from(
        "# Findings\n\nWhat the assembler and `tmcl check` may say of a program, by the code in square \
         brackets behind each message. [Checking programs](../language-tools.md) says how to silence \
         one.\n\n",
    );
    page += NOTE;
    for (severity, heading) in
        [(Severity::Error, "Errors"), (Severity::Warning, "Warnings"), (Severity::Hint, "Hints")]
    {
        let _ = write!(page, "\n## {heading}\n\n| Code | Meaning |\n|---|---|\n");
        for code in Code::ALL.iter().filter(|code| code.severity() == severity) {
            let _ = writeln!(page, "| `{}` | {} |", code.name(), code.explanation());
        }
    }
    is_as_made("findings.md", &page);
}
