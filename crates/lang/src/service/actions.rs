//! What mends or silences a finding.

use super::{Edit, Service};
use crate::diagnostic::{Diagnostic, Location, Severity};
use crate::span::Span;
use crate::tree::Line;

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

/// With this word a comment silences findings of its line.
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
            if finding.severity() < Severity::Error {
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

    /// Writes at the end of the line that this finding is as it should be.
    fn silence(&self, at: usize, finding: &Diagnostic) -> Option<Action> {
        let file = finding.location.file;
        let tree = &self.assembly.file(file).tree;
        let line: &Line = tree.lines().get(tree.line_at(finding.location.span.start))?;
        let end = tree.line_span(line).end;
        let code = finding.code.name();
        let comment = tree.comment(line).map(|comment| tree.token_text(comment));
        let has_list = comment.is_some_and(|comment| comment.contains(ALLOW));
        let text = if has_list { format!(", {code}") } else { format!(" // {ALLOW} {code}") };
        let location = Location { file, span: Span::new(end, end) };
        let title = format!("Allow {code} on this line");
        Some(Action { title, edit: Edit { location, text }, is_fix: false, finding: at })
    }
}
