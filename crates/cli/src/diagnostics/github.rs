//! Findings as workflow commands of GitHub Actions: lines that its runner turns into annotations.

use opentmcl_lang::Severity;

use super::place::{Finding, Region};

/// The command that annotates a finding.
pub(super) fn command(finding: &Finding<'_>) -> String {
    let diagnostic = finding.diagnostic;
    let level = match diagnostic.severity() {
        Severity::Error => "error",
        Severity::Warning => "warning",
        Severity::Hint => "notice",
    };
    let Region { file, start, end } = finding.region();
    // Columns only count where the annotation is within a line.
    let message = match &diagnostic.help {
        Some(help) => format!("{}\n{help}", diagnostic.message),
        None => diagnostic.message.clone(),
    };
    format!(
        "::{level} file={},line={},col={},endLine={},endColumn={},title={}::{}",
        property(file),
        start.line,
        start.column,
        end.line,
        end.column,
        diagnostic.code.name(),
        data(&message)
    )
}

/// A text behind `::`.
fn data(text: &str) -> String {
    text.replace('%', "%25").replace('\r', "%0D").replace('\n', "%0A")
}

/// A text between `=` and the next comma or colon.
fn property(text: &str) -> String {
    data(text).replace(':', "%3A").replace(',', "%2C")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_the_runner_would_take_for_its_own_is_escaped() {
        // As the runner's own library escapes: % first, or it would be escaped twice.
        assert_eq!(data("50 %\r\n: a, b"), "50 %25%0D%0A: a, b");
        assert_eq!(property("C:a,b%.tmc"), "C%3Aa%2Cb%25.tmc");
    }
}
