//! Changes of texts as the protocol writes them.

use std::collections::HashMap;

use lsp_types::{TextEdit, Uri, WorkspaceEdit};
use opentmcl_lang::service::Edit;
use opentmcl_lang::span::Span;

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
    let changed = |lines: &[Span], text: &str| {
        let start = lines.get(first).map_or(text.len() as u32, |line| line.start);
        Span::new(start, lines[..lines.len() - last].last().map_or(0, |line| line.end))
    };
    let range = places.range(changed(&old_lines, old));
    vec![TextEdit::new(range, changed(&new_lines, new).of(new).to_owned())]
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

#[cfg(test)]
mod tests {
    use opentmcl_lang::span::ColumnUnit;

    use super::*;

    /// The parts of the old text that are replaced, each with what comes in its place.
    #[track_caller]
    fn replaces(old: &str, new: &str, expected: &[(&str, &str)]) {
        let places = Places::new(old, ColumnUnit::Utf16);
        let edits = difference(old, new, &places);
        let span = |edit: &TextEdit| places.span(edit.range);
        let seen: Vec<_> =
            edits.iter().map(|edit| (span(edit).of(old), edit.new_text.as_str())).collect();
        assert_eq!(seen, expected);
        let mut text = old.to_owned();
        for edit in edits.iter().rev() {
            let span = span(edit);
            text.replace_range(span.start as usize..span.end as usize, &edit.new_text);
        }
        assert_eq!(text, new);
    }

    #[test]
    fn lines_that_stay_are_left_alone() {
        replaces("a\nb\nc\n", "a\nb\nc\n", &[]);
        replaces("a\n b\nc\n  d", "a\nb\nc\nd", &[(" b\n", "b\n"), ("  d", "d")]);
    }

    #[test]
    fn lines_that_come_or_go_are_replaced_from_the_first_to_the_last() {
        replaces("a\n\n\nb\n", "a\n\nb\n", &[("\n", "")]);
        replaces("a\nb", "a\nb\n\n", &[("b", "b\n\n")]);
        replaces("", "a\n", &[("", "a\n")]);
        replaces("a\n", "", &[("a\n", "")]);
        replaces("a\na\n", "a\n", &[("a\n", "")]);
    }
}
