//! Places in texts as the protocol writes them.

use std::cell::{OnceCell, RefCell};

use lsp_types::{Location, Position, Range, Uri};
use opentmcl_lang::span::{self, ColumnUnit, LineIndex, Span};
use opentmcl_lang::{self as lang, FileId};

use super::workspace::{Program, Workspace};

/// A place of the protocol as one of ours.
pub(super) fn place(position: Position) -> span::Position {
    span::Position { line: position.line, column: position.character }
}

/// How many bytes lie between two columns of a long line that are remembered.
const STEP: u32 = 1024;

/// The places of one text.
pub(super) struct Places<'a> {
    text: &'a str,
    lines: LineIndex,
    unit: ColumnUnit,
    /// A long line, and the column at about every [`STEP`] bytes of it, so that a place costs the same
    /// wherever it is.
    marks: RefCell<(u32, Vec<Mark>)>,
}

/// A byte of a line and the column that it is at.
#[derive(Clone, Copy, Default)]
struct Mark {
    byte: u32,
    column: u32,
}

impl<'a> Places<'a> {
    pub(super) fn new(text: &'a str, unit: ColumnUnit) -> Self {
        Self { text, lines: LineIndex::new(text), unit, marks: RefCell::default() }
    }

    pub(super) fn offset(&self, position: Position) -> u32 {
        self.lines.offset(self.text, place(position), self.unit)
    }

    pub(super) fn span(&self, range: Range) -> Span {
        Span::new(self.offset(range.start), self.offset(range.end))
    }

    pub(super) fn position(&self, offset: u32) -> Position {
        // Bytes need no counting.
        let span::Position { line, column: byte } =
            self.lines.position(self.text, offset, ColumnUnit::Utf8);
        let start = offset.saturating_sub(byte);
        let mark = if byte < STEP { Mark::default() } else { self.mark(line, start, byte) };
        let rest = Span::new(start + mark.byte, offset).of(self.text);
        Position::new(line, mark.column + self.unit.columns(rest))
    }

    /// The last mark in front of a byte of a line, which begins at `start`.
    fn mark(&self, line: u32, start: u32, byte: u32) -> Mark {
        let mut known = self.marks.borrow_mut();
        if known.0 != line || known.1.is_empty() {
            *known = (line, self.marks_of(line, start));
        }
        let behind = known.1.partition_point(|mark| mark.byte <= byte);
        known.1[..behind].last().copied().unwrap_or_default()
    }

    fn marks_of(&self, line: u32, start: u32) -> Vec<Mark> {
        let text = Span::new(start, self.lines.line(self.text, line).end).of(self.text);
        let mut marks = vec![Mark::default()];
        let mut last = Mark::default();
        for (byte, _) in text.char_indices() {
            let byte = byte as u32;
            if byte >= last.byte + STEP {
                let column = self.unit.columns(Span::new(last.byte, byte).of(text));
                last = Mark { byte, column: last.column + column };
                marks.push(last);
            }
        }
        marks
    }

    pub(super) fn range(&self, span: Span) -> Range {
        Range { start: self.position(span.start), end: self.position(span.end) }
    }
}

/// The places of all files of a program.
pub(super) struct Files<'a> {
    program: &'a Program,
    workspace: &'a Workspace,
    unit: ColumnUnit,
    /// Of each file that was asked for.
    places: Vec<OnceCell<Places<'a>>>,
}

impl<'a> Files<'a> {
    pub(super) fn new(program: &'a Program, workspace: &'a Workspace, unit: ColumnUnit) -> Self {
        let places = program.assembly.files.iter().map(|_| OnceCell::new()).collect();
        Self { program, workspace, unit, places }
    }

    pub(super) fn of(&self, file: FileId) -> &Places<'a> {
        let text = self.program.assembly.file(file).tree.text();
        // There is one for each file of the program.
        self.places[usize::from(file.0)].get_or_init(|| Places::new(text, self.unit))
    }

    /// Where the editor finds a file; nowhere, if it is not on disk.
    pub(super) fn uri(&self, file: FileId) -> Option<Uri> {
        self.workspace.uri(self.program.assembly.file(file))
    }

    pub(super) fn location(&self, location: lang::Location) -> Option<Location> {
        let uri = self.uri(location.file)?;
        Some(Location { uri, range: self.of(location.file).range(location.span) })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_place_far_behind_in_a_long_line_is_right() {
        // Each ä is two bytes and one unit of UTF-16, so that no mark is at a round number.
        let text = format!("x\n{}\n{}MST", "ä".repeat(5000), "aä".repeat(5000));
        for unit in [ColumnUnit::Utf8, ColumnUnit::Utf16] {
            let places = Places::new(&text, unit);
            for (at, _) in text.char_indices().step_by(97).chain(text.char_indices().skip(15_000)) {
                let at = at as u32;
                let place = LineIndex::new(&text).position(&text, at, unit);
                assert_eq!(places.position(at), Position::new(place.line, place.column), "{at}");
            }
        }
    }

    #[test]
    fn places_are_the_same_in_whatever_order_they_are_asked_for() {
        let text = "// ä𝄞 x\r\n\r\nMST 0\n";
        let offsets: Vec<u32> = text.char_indices().map(|(at, _)| at as u32).collect();
        for unit in [ColumnUnit::Utf8, ColumnUnit::Utf16] {
            let alone = |at| {
                let place = LineIndex::new(text).position(text, at, unit);
                Position::new(place.line, place.column)
            };
            let places = Places::new(text, unit);
            for &at in offsets.iter().chain(offsets.iter().rev()).chain(offsets.iter().step_by(2)) {
                assert_eq!(places.position(at), alone(at), "{at}");
                let (before, behind) = text.split_at(at as usize);
                let is_inside_line_end = before.ends_with('\r') && behind.starts_with('\n');
                if !is_inside_line_end {
                    assert_eq!(places.offset(alone(at)), at);
                }
            }
        }
    }
}
