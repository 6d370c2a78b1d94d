//! Changes of texts as the protocol writes them.

use std::collections::HashMap;

use lsp_types::{TextEdit, Uri, WorkspaceEdit};
use opentmcl_lang::service::Edit;
use opentmcl_lang::span::{LineIndex, Span};

use super::convert::{Files, Places};

/// Changes in several files; none if one of them is not on disk.
#[expect(clippy::mutable_key_type, reason = "the type of the protocol; no key changes")]
pub(super) fn workspace_edit(
    edits: impl IntoIterator<Item = Edit>,
    files: &Files<'_>,
) -> Option<WorkspaceEdit> {
    let mut changes: HashMap<Uri, Vec<TextEdit>> = HashMap::new();
    for Edit { location, text } in edits {
        let place = files.location(location)?;
        changes.entry(place.uri).or_default().push(TextEdit::new(place.range, text));
    }
    Some(WorkspaceEdit::new(changes))
}

/// What makes one text of another: line by line, so that a cursor stays where it is, if both have the
/// same lines, otherwise from the first to the last line that differs.
pub(super) fn difference(old: &str, new: &str, places: &Places<'_>) -> Vec<TextEdit> {
    let (old_lines, new_lines) = (lines(old), lines(new));
    if old_lines.len() == new_lines.len() {
        let pairs = old_lines.iter().zip(&new_lines);
        let changed = pairs.filter(|(before, after)| before.of(old) != after.of(new));
        return changed
            .map(|(&before, after)| TextEdit::new(places.range(before), after.of(new).to_owned()))
            .collect();
    }
    let same = |(before, after): &(&Span, &Span)| before.of(old) == after.of(new);
    let first = old_lines.iter().zip(&new_lines).take_while(same).count();
    let last = old_lines[first..].iter().rev().zip(new_lines[first..].iter().rev());
    let last = last.take_while(same).count();
    let start =
        |lines: &[Span], text: &str| lines.get(first).map_or(text.len() as u32, |line| line.start);
    let end = |lines: &[Span]| lines[..lines.len() - last].last().map_or(0, |line| line.end);
    let before = Span::new(start(&old_lines, old), end(&old_lines).max(start(&old_lines, old)));
    let after = Span::new(start(&new_lines, new), end(&new_lines).max(start(&new_lines, new)));
    vec![TextEdit::new(places.range(before), after.of(new).to_owned())]
}

/// Where the lines of a text are, with what ends them.
fn lines(text: &str) -> Vec<Span> {
    let mut start = 0;
    let line = |line: &str| {
        let span = Span::new(start, start + line.len() as u32);
        start = span.end;
        span
    };
    text.split_inclusive('\n').map(line).collect()
}
