//! What mends or silences a finding.

use super::{Edit, Service};
use crate::diagnostic::{Diagnostic, Location};
use crate::span::Span;
use crate::tree::{Statement, Tree};

/// A change that deals with a finding.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Action {
    /// What it does, as a command.
    pub title: String,
    /// The change.
    pub edit: Edit,
    /// Whether it mends the matter, so that it can be applied without a thought.
    pub is_fix: bool,
    /// The finding, by its place among those that were given.
    pub finding: usize,
}

/// With this word a comment begins that silences findings.
const ALLOW: &str = "tmcl-allow:";

impl Service<'_> {
    /// What can be done about findings that touch a place.
    pub fn actions(&self, place: Location, findings: &[Diagnostic]) -> Vec<Action> {
        let touches = |finding: &Diagnostic| {
            let span = finding.location.span;
            finding.location.file == place.file
                && span.start <= place.span.end
                && place.span.start <= span.end
        };
        let mut actions = Vec::new();
        for (at, finding) in findings.iter().enumerate().filter(|(_, finding)| touches(finding)) {
            actions.extend(self.fix(at, finding));
            if finding.code.can_be_silenced() {
                actions.extend(self.silence(at, finding));
            }
        }
        actions
    }

    fn fix(&self, at: usize, finding: &Diagnostic) -> Option<Action> {
        let fix = finding.fix.as_ref()?;
        let location = Location { file: finding.location.file, span: fix.span };
        let old = self.assembly.text(location);
        let title = match (old, fix.replacement.as_str()) {
            ("", new) => format!("Insert {new}"),
            (old, "") => format!("Remove {old}"),
            (old, new) => format!("Replace {old} by {new}"),
        };
        let edit = Edit { location, text: fix.replacement.clone() };
        Some(Action { title, edit, is_fix: true, finding: at })
    }

    /// Writes in a comment that this finding is as it should be.
    fn silence(&self, at: usize, finding: &Diagnostic) -> Option<Action> {
        let file = finding.location.file;
        let tree = &self.assembly.file(file).tree;
        let line = tree.lines().get(tree.line_at(finding.location.span.start))?;
        let span = tree.line_span(line);
        let code = finding.code.name();
        let note = format!("// {ALLOW} {code}");
        let (offset, text) = match tree.comment(line).map(|comment| tree.token_text(comment)) {
            None => (span.end, format!(" {note}")),
            Some(comment) if is_list(comment) => (span.end, format!(", {code}")),
            // A comment on a line of its own is about the next statement.
            Some(_) if line.statement != Statement::None => {
                let text = span.of(tree.text());
                let indent = &text[..text.len() - text.trim_start().len()];
                (span.start, format!("{indent}{note}{}", line_end(tree)))
            }
            Some(_) => return None,
        };
        let location = Location { file, span: Span::new(offset, offset) };
        let title = format!("Allow {code} on this line");
        Some(Action { title, edit: Edit { location, text }, is_fix: false, finding: at })
    }
}

/// Whether a comment lists findings that are as they should be.
fn is_list(comment: &str) -> bool {
    let text = comment.trim_start_matches(['/', ';']).trim_start();
    text.get(..ALLOW.len()).is_some_and(|key| key.eq_ignore_ascii_case(ALLOW))
}

/// What ends the lines of a text.
fn line_end(tree: &Tree) -> &'static str {
    if tree.text().contains("\r\n") { "\r\n" } else { "\n" }
}
