//! Findings of a program as people read them.

use std::fmt;

use anstyle::{AnsiColor, Style};
use opentmcl_lang::span::{ColumnUnit, LineIndex};
use opentmcl_lang::{Assembly, Diagnostic, Severity};

/// Prints findings to standard error.
pub(crate) fn print(assembly: &Assembly, findings: &[&Diagnostic]) {
    for finding in findings {
        let file = assembly.file(finding.location.file);
        let text = file.tree.text();
        let at = LineIndex::new(text).position(
            text,
            finding.location.span.start,
            ColumnUnit::Characters,
        );
        let style = style(finding.severity());
        let (name, line, column) = (&file.name, at.line + 1, at.column + 1);
        let (severity, code) = (finding.severity().name(), finding.code.name());
        anstream::eprintln!(
            "{name}:{line}:{column}: {style}{severity}[{code}]{style:#}: {}",
            finding.message
        );
        if let Some(help) = &finding.help {
            anstream::eprintln!("  help: {help}");
        }
    }
}

fn style(severity: Severity) -> Style {
    let color = match severity {
        Severity::Error => AnsiColor::Red,
        Severity::Warning => AnsiColor::Yellow,
        Severity::Hint => AnsiColor::Cyan,
    };
    color.on_default().bold()
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
    pub(crate) fn of<'a>(findings: impl Iterator<Item = &'a Diagnostic>) -> Self {
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
        let mut separator = "";
        for (count, noun) in counts.into_iter().filter(|&(count, _)| count > 0) {
            let plural = if count == 1 { "" } else { "s" };
            write!(f, "{separator}{count} {noun}{plural}")?;
            separator = ", ";
        }
        if separator.is_empty() { f.write_str("no findings") } else { Ok(()) }
    }
}
