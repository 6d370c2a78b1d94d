//! What the checks say of programs that can be assembled.
//!
//! In the programs of these tests a comment `//! code` names the finding that begins on its line;
//! nothing else may be told.

mod comments;
mod flow;
mod manual;
mod module;
mod running;

use opentmcl_catalog::Module;
use opentmcl_lang::include::BuiltInOnly;
use opentmcl_lang::{Assembly, Diagnostic, Options, assemble, check};

fn tmcm_6214() -> &'static Module {
    opentmcl_catalog::find("tmcm-6214").unwrap()
}

fn assembly(text: &str, append_stop: bool) -> Assembly {
    let assembly = assemble("main.tmc", text, &mut BuiltInOnly, Options { append_stop });
    assert!(assembly.is_valid(), "{text}\n{:#?}", assembly.diagnostics);
    assembly
}

/// Line and code of each finding.
fn told(assembly: &Assembly, findings: &[Diagnostic]) -> Vec<(usize, String)> {
    let line = |finding: &Diagnostic| {
        assembly.file(finding.location.file).tree.line_at(finding.location.span.start)
    };
    let mut told: Vec<_> =
        findings.iter().map(|finding| (line(finding), finding.code.name().to_owned())).collect();
    told.sort();
    told
}

/// Line and code of each mark.
fn marked(text: &str) -> Vec<(usize, String)> {
    let mut marked = Vec::new();
    for (number, line) in text.lines().enumerate() {
        if let Some((_, codes)) = line.split_once("//!") {
            marked.extend(codes.split(',').map(|code| (number, code.trim().to_owned())));
        }
    }
    marked.sort();
    marked
}

#[track_caller]
fn tells(text: &str, append_stop: bool, module: Option<&'static Module>) {
    let assembly = assembly(text, append_stop);
    let findings = check::findings(&assembly, module);
    assert_eq!(told(&assembly, &findings), marked(text), "{text}\n{findings:#?}");
}

/// Each finding as `text that it is about | message | help`.
fn said(text: &str, module: Option<&'static Module>) -> Vec<String> {
    let assembly = assembly(text, true);
    let one = |finding: &Diagnostic| {
        let help = finding.help.as_deref().unwrap_or("-");
        format!("{} | {} | {help}", assembly.text(finding.location), finding.message)
    };
    check::findings(&assembly, module).iter().map(one).collect()
}

#[track_caller]
fn says(text: &str, expected: &[&str]) {
    assert_eq!(said(text, Some(tmcm_6214())), expected, "{text}");
}
