//! Results for people and as JSON.

use std::io::{self, Write};

use serde::Serialize;

use super::result::{CaseFailure, CaseResult, FileResult};
use crate::print::{self, FAILED, OK};
use crate::time;

/// Prints a file's results for people.
pub(super) fn print(out: &mut impl Write, file: &FileResult) -> io::Result<()> {
    let name = &file.name;
    if !file.mistakes.is_empty() {
        writeln!(out, "{FAILED}failed{FAILED:#}  {name}: it could not be run")?;
    }
    for mistake in &file.mistakes {
        writeln!(out, "  {mistake}")?;
    }
    for case in &file.cases {
        let title = case.name.as_ref().map_or(String::new(), |case| format!(": {case}"));
        let time = time::text(case.time);
        if case.passed() {
            writeln!(out, "{OK}ok{OK:#}      {name}{title} ({time})")?;
        } else {
            writeln!(out, "{FAILED}failed{FAILED:#}  {name}{title} ({time})")?;
        }
        for failure in &case.failures {
            writeln!(out, "  {name}:{}: {}", failure.line, failure.command)?;
            for line in explanation(failure) {
                writeln!(out, "    {line}")?;
            }
        }
    }
    Ok(())
}

/// What was expected, what came, when, and where the program was.
pub(super) fn explanation(failure: &CaseFailure) -> [String; 3] {
    let state = failure.program.as_ref().map_or(String::new(), |state| format!(", {state}"));
    [
        format!("expected {}", failure.expected),
        format!("got      {}", failure.got),
        format!("after    {}{state}", time::text(failure.time)),
    ]
}

/// Prints one object for each case, and one for a file that could not be run.
pub(super) fn json(out: &mut impl Write, file: &FileResult) -> io::Result<()> {
    if !file.mistakes.is_empty() {
        let mistakes = file
            .mistakes
            .iter()
            .map(|mistake| MistakeReport { line: mistake.line, message: &mistake.message });
        let broken = BrokenReport { file: &file.name, passed: false, mistakes: mistakes.collect() };
        print::json_line(out, &broken)?;
    }
    for case in &file.cases {
        print::json_line(out, &CaseReport::new(&file.name, case))?;
    }
    Ok(())
}

#[derive(Serialize)]
struct BrokenReport<'a> {
    file: &'a str,
    passed: bool,
    mistakes: Vec<MistakeReport<'a>>,
}

#[derive(Serialize)]
struct MistakeReport<'a> {
    line: usize,
    message: &'a str,
}

#[derive(Serialize)]
struct CaseReport<'a> {
    file: &'a str,
    line: usize,
    #[serde(skip_serializing_if = "Option::is_none")]
    test: Option<&'a str>,
    passed: bool,
    expectations: usize,
    /// On the module.
    seconds: f64,
    failures: Vec<FailureReport<'a>>,
}

#[derive(Serialize)]
struct FailureReport<'a> {
    line: usize,
    command: &'a str,
    expected: &'a str,
    got: &'a str,
    seconds: f64,
    #[serde(skip_serializing_if = "Option::is_none")]
    program: Option<ProgramReport<'a>>,
}

#[derive(Serialize)]
struct ProgramReport<'a> {
    running: bool,
    address: u16,
    #[serde(skip_serializing_if = "Option::is_none")]
    file: Option<&'a str>,
    #[serde(skip_serializing_if = "Option::is_none")]
    line: Option<usize>,
}

impl<'a> CaseReport<'a> {
    fn new(file: &'a str, case: &'a CaseResult) -> Self {
        let failures = case.failures.iter().map(|failure| FailureReport {
            line: failure.line,
            command: &failure.command,
            expected: &failure.expected,
            got: &failure.got,
            seconds: time::number(failure.time),
            program: failure.program.as_ref().map(|state| ProgramReport {
                running: state.running,
                address: state.address,
                file: state.place.as_ref().map(|place| place.file.as_str()),
                line: state.place.as_ref().map(|place| place.line),
            }),
        });
        Self {
            file,
            line: case.line,
            test: case.name.as_deref(),
            passed: case.passed(),
            expectations: case.expectations,
            seconds: time::number(case.time),
            failures: failures.collect(),
        }
    }
}
