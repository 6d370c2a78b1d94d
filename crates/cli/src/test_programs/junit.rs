//! Results in the XML of JUnit, which continuous integration services read.
//!
//! A file is a suite. Times are those of reality, as these services add them up; the time on the
//! module is the property `virtual-seconds`.

use std::fmt::Write;

use super::report::explanation;
use super::result::{CaseFailure, CaseResult, FileResult};
use crate::time;

/// The document.
pub(super) fn text(results: &[FileResult]) -> String {
    let mut xml = String::from("<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n");
    let tests: usize = results.iter().map(tests).sum();
    let failures: usize = results.iter().map(failures).sum();
    let errors: usize = results.iter().map(errors).sum();
    let wall = results.iter().map(|file| file.wall.as_secs_f64()).sum::<f64>();
    let counts = format!("tests=\"{tests}\" failures=\"{failures}\" errors=\"{errors}\"");
    // Writing to a string does not fail.
    let _ = writeln!(xml, "<testsuites name=\"tmcl test\" {counts} time=\"{wall:.6}\">");
    for file in results {
        suite(&mut xml, file);
    }
    xml.push_str("</testsuites>\n");
    xml
}

fn tests(file: &FileResult) -> usize {
    file.cases.len() + errors(file)
}

fn failures(file: &FileResult) -> usize {
    file.cases.iter().filter(|case| !case.passed()).count()
}

fn errors(file: &FileResult) -> usize {
    usize::from(!file.mistakes.is_empty())
}

fn suite(xml: &mut String, file: &FileResult) {
    let (name, wall) = (escaped(&file.name), file.wall.as_secs_f64());
    let (tests, failures, errors) = (tests(file), failures(file), errors(file));
    let _ = writeln!(
        xml,
        "  <testsuite name=\"{name}\" tests=\"{tests}\" failures=\"{failures}\" \
         errors=\"{errors}\" skipped=\"0\" time=\"{wall:.6}\">"
    );
    if errors > 0 {
        let mistakes: Vec<String> = file.mistakes.iter().map(ToString::to_string).collect();
        let message = mistakes.first().map(String::as_str).unwrap_or_default();
        let _ = writeln!(
            xml,
            "    <testcase name=\"{name}\" classname=\"{name}\" file=\"{name}\" time=\"{wall:.6}\">\n      \
             <error message=\"{}\" type=\"mistake\">{}</error>\n    </testcase>",
            escaped(message),
            escaped(&mistakes.join("\n"))
        );
    }
    for case in &file.cases {
        test_case(xml, &file.name, case);
    }
    xml.push_str("  </testsuite>\n");
}

fn test_case(xml: &mut String, file: &str, case: &CaseResult) {
    let name = escaped(case.name.as_deref().unwrap_or(file));
    let (class, line, wall) = (escaped(file), case.line, case.wall.as_secs_f64());
    let _ = writeln!(
        xml,
        "    <testcase name=\"{name}\" classname=\"{class}\" file=\"{class}\" line=\"{line}\" \
         time=\"{wall:.6}\">\n      <properties>\n        \
         <property name=\"virtual-seconds\" value=\"{}\"/>\n      </properties>",
        time::column(case.time)
    );
    // Readers show one failure of a case: it holds all.
    if let Some(first) = case.failures.first() {
        let CaseFailure { line, command, expected, got, .. } = first;
        let message = format!("line {line}: {command}: expected {expected}, got {got}");
        let body: Vec<String> = case
            .failures
            .iter()
            .map(|failure| {
                let explanation = explanation(failure).join("\n  ");
                format!("{file}:{}: {}\n  {explanation}", failure.line, failure.command)
            })
            .collect();
        let _ = writeln!(
            xml,
            "      <failure message=\"{}\" type=\"expectation\">{}</failure>",
            escaped(&message),
            escaped(&body.join("\n"))
        );
    }
    xml.push_str("    </testcase>\n");
}

/// Text as it may stand between tags and in an attribute. What XML cannot hold at all becomes a
/// replacement character.
fn escaped(text: &str) -> String {
    let mut escaped = String::with_capacity(text.len());
    for character in text.chars() {
        match character {
            '&' => escaped.push_str("&amp;"),
            '<' => escaped.push_str("&lt;"),
            '>' => escaped.push_str("&gt;"),
            '"' => escaped.push_str("&quot;"),
            '\n' => escaped.push_str("&#10;"),
            '\t' => escaped.push_str("&#9;"),
            '\0'..='\u{1F}' | '\u{FFFE}' | '\u{FFFF}' => escaped.push('\u{FFFD}'),
            _ => escaped.push(character),
        }
    }
    escaped
}
