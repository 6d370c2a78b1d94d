//! Findings of programs, printed: for people, and in the forms that other programs read.
//!
//! The language has them as values; this is where they become text.

mod github;
mod human;
mod json;
mod place;
mod sarif;

use std::fmt;
use std::io::{self, Write};

use opentmcl_lang::{Diagnostic, File, Severity};

use crate::print::counted;
use crate::terminal;

pub(crate) use place::{Files, Finding};

/// In which form findings are printed.
#[derive(Clone, Copy, Debug, PartialEq, Eq, clap::ValueEnum)]
pub(crate) enum Format {
    /// For people, with the lines of the source
    Human,
    /// One JSON object per finding and line
    Json,
    /// Commands for GitHub Actions, which shows them in the change
    Github,
    /// One SARIF 2.1.0 document, for code scanning
    Sarif,
}

/// Prints findings.
///
/// `width` is the number of characters in a line; longer lines of a source are shortened.
///
/// # Errors
///
/// What writing fails with.
pub(crate) fn write(
    out: &mut impl Write,
    format: Format,
    findings: &[Finding<'_>],
    width: u16,
) -> io::Result<()> {
    match format {
        Format::Human => {
            for finding in findings {
                writeln!(out, "{}\n", human::render(finding, width))?;
            }
            Ok(())
        }
        Format::Json => findings.iter().try_for_each(|finding| json::write(out, finding)),
        Format::Github => {
            findings.iter().try_for_each(|finding| writeln!(out, "{}", github::command(finding)))
        }
        Format::Sarif => sarif::write(out, findings),
    }
}

/// Prints what was found in a program: for people to standard error, in other forms to standard
/// output.
///
/// # Errors
///
/// What writing fails with.
pub(crate) fn print(format: Format, files: &[File], diagnostics: &[Diagnostic]) -> io::Result<()> {
    let files = Files::new(files);
    let findings = files.findings(diagnostics);
    match format {
        Format::Human => {
            let width = terminal::width(io::stderr());
            write(&mut anstream::stderr().lock(), format, &findings, width)
        }
        _ => write(&mut io::stdout().lock(), format, &findings, u16::MAX),
    }
}

/// How many findings there are of each severity: `2 errors, 1 warning`.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(crate) struct Summary {
    pub(crate) errors: usize,
    pub(crate) warnings: usize,
    pub(crate) hints: usize,
}

impl Summary {
    /// Counts findings.
    pub(crate) fn of<'a>(findings: impl IntoIterator<Item = &'a Diagnostic>) -> Self {
        let mut summary = Self::default();
        for finding in findings {
            *match finding.severity() {
                Severity::Error => &mut summary.errors,
                Severity::Warning => &mut summary.warnings,
                Severity::Hint => &mut summary.hints,
            } += 1;
        }
        summary
    }
}

impl fmt::Display for Summary {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let counts = [(self.errors, "error"), (self.warnings, "warning"), (self.hints, "hint")];
        let told = counts.into_iter().filter(|&(count, _)| count > 0);
        let told: Vec<_> = told.map(|(count, noun)| counted(count, noun)).collect();
        f.write_str(if told.is_empty() { "no findings" } else { "" })?;
        f.write_str(&told.join(", "))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_summary_counts_only_what_there_is() {
        let summary = Summary { errors: 2, warnings: 1, hints: 0 };
        assert_eq!(summary.to_string(), "2 errors, 1 warning");
        assert_eq!(Summary { hints: 3, ..Summary::default() }.to_string(), "3 hints");
        assert_eq!(Summary::default().to_string(), "no findings");
    }
}
