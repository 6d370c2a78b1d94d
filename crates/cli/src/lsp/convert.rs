//! Places in texts as the protocol writes them.

use std::cell::{Cell, OnceCell};

use lsp_types::{Location, Position, Range, Uri};
use opentmcl_lang::span::{self, ColumnUnit, LineIndex, Span};
use opentmcl_lang::{self as lang, FileId};

use super::workspace::{Program, Workspace};

/// A place of the protocol as one of ours.
pub(super) fn place(position: Position) -> span::Position {
    span::Position { line: position.line, column: position.character }
}

/// The places of one text.
pub(super) struct Places<'a> {
    text: &'a str,
    lines: LineIndex,
    unit: ColumnUnit,
    /// The place that was asked for last: the next one is often behind it, in the same line, and
    /// counting on from there keeps the time linear however long a line is.
    last: Cell<(u32, span::Position)>,
}

impl<'a> Places<'a> {
    pub(super) fn new(text: &'a str, unit: ColumnUnit) -> Self {
        Self { text, lines: LineIndex::new(text), unit, last: Cell::default() }
    }

    pub(super) fn offset(&self, position: Position) -> u32 {
        self.lines.offset(self.text, place(position), self.unit)
    }

    pub(super) fn span(&self, range: Range) -> Span {
        Span::new(self.offset(range.start), self.offset(range.end))
    }

    pub(super) fn position(&self, offset: u32) -> Position {
        let (last, position) = self.last.get();
        let line = self.lines.line(self.text, position.line);
        let found = if last <= offset && offset <= line.end {
            let between = self.unit.columns(Span::new(last, offset).of(self.text));
            span::Position { line: position.line, column: position.column + between }
        } else {
            self.lines.position(self.text, offset, self.unit)
        };
        self.last.set((offset, found));
        Position::new(found.line, found.column)
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
