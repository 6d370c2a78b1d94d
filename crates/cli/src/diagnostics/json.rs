//! Findings as JSON, one object per line; the field names are what other programs rely on.

use std::io::{self, Write};

use serde::Serialize;

use super::place::{Finding, Point, Region};
use crate::print;

#[derive(Serialize)]
struct Object<'a> {
    file: &'a str,
    line: u32,
    column: u32,
    end: Point,
    severity: &'static str,
    code: &'static str,
    message: &'a str,
    #[serde(skip_serializing_if = "Option::is_none")]
    help: Option<&'a str>,
    #[serde(skip_serializing_if = "Option::is_none")]
    related: Option<Related<'a>>,
    #[serde(skip_serializing_if = "Option::is_none")]
    fix: Option<Fix<'a>>,
}

#[derive(Serialize)]
struct Related<'a> {
    file: &'a str,
    line: u32,
    column: u32,
    end: Point,
    message: &'a str,
}

#[derive(Serialize)]
struct Fix<'a> {
    line: u32,
    column: u32,
    end: Point,
    replacement: &'a str,
}

/// Writes a finding as one line.
pub(super) fn write(out: &mut impl Write, finding: &Finding<'_>) -> io::Result<()> {
    let diagnostic = finding.diagnostic;
    let Region { file, start: Point { line, column }, end } = finding.region();
    let related = finding.related().map(|(region, message)| {
        let Region { file, start: Point { line, column }, end } = region;
        Related { file, line, column, end, message }
    });
    let fix = finding.fix().map(|(region, replacement)| {
        let Region { start: Point { line, column }, end, .. } = region;
        Fix { line, column, end, replacement }
    });
    let object = Object {
        file,
        line,
        column,
        end,
        severity: diagnostic.severity().name(),
        code: diagnostic.code.name(),
        message: &diagnostic.message,
        help: diagnostic.help.as_deref(),
        related,
        fix,
    };
    print::json_line(out, &object)
}
