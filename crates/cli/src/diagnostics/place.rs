//! Where a finding is, as people and other programs count.

use std::cell::OnceCell;

use opentmcl_lang::span::{ColumnUnit, LineIndex, Position, Span};
use opentmcl_lang::{Diagnostic, File, Location};
use serde::Serialize;

/// The files of a program, with the index of lines of each that is asked for.
pub(crate) struct Files<'a> {
    files: &'a [File],
    indexes: Vec<OnceCell<LineIndex>>,
}

/// A finding and the files that it is about.
pub(crate) struct Finding<'a> {
    pub(crate) files: &'a Files<'a>,
    pub(crate) diagnostic: &'a Diagnostic,
}

/// A place in a line and column, both from 1; columns count characters.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Serialize)]
pub(crate) struct Point {
    pub(crate) line: u32,
    pub(crate) column: u32,
}

/// A part of a file.
#[derive(Clone, Debug, PartialEq, Eq, Hash)]
pub(crate) struct Region<'a> {
    /// The file's name.
    pub(crate) file: &'a str,
    /// Its first character.
    pub(crate) start: Point,
    /// The first character after it.
    pub(crate) end: Point,
}

impl From<Position> for Point {
    fn from(position: Position) -> Self {
        Self { line: position.line + 1, column: position.column + 1 }
    }
}

impl<'a> Files<'a> {
    /// Of a program.
    pub(crate) fn new(files: &'a [File]) -> Self {
        Self { files, indexes: files.iter().map(|_| OnceCell::new()).collect() }
    }

    /// The findings that are about these files.
    pub(crate) fn findings(
        &'a self,
        diagnostics: impl IntoIterator<Item = &'a Diagnostic>,
    ) -> Vec<Finding<'a>> {
        let finding = |diagnostic| Finding { files: self, diagnostic };
        diagnostics.into_iter().map(finding).collect()
    }

    fn file(&self, location: Location) -> (&'a File, &LineIndex) {
        let at = usize::from(location.file.0);
        let file = &self.files[at];
        (file, self.indexes[at].get_or_init(|| LineIndex::new(file.tree.text())))
    }

    /// A location as others count.
    pub(crate) fn region(&self, location: Location) -> Region<'a> {
        let (file, index) = self.file(location);
        let point =
            |offset| Point::from(index.position(file.tree.text(), offset, ColumnUnit::Characters));
        let Span { start, end } = location.span;
        Region { file: &file.name, start: point(start), end: point(end.max(start)) }
    }

    /// The text of the line in which a location begins, and what of it the location covers.
    pub(crate) fn line(&self, location: Location) -> (&'a str, Span) {
        let (file, index) = self.file(location);
        let text = file.tree.text();
        let Position { line, .. } =
            index.position(text, location.span.start, ColumnUnit::Characters);
        let line = index.line(text, line);
        let within = |offset: u32| offset.clamp(line.start, line.end) - line.start;
        (line.of(text), Span::new(within(location.span.start), within(location.span.end)))
    }
}

impl<'a> Finding<'a> {
    /// Where it is.
    pub(crate) fn region(&self) -> Region<'a> {
        self.files.region(self.diagnostic.location)
    }

    /// The part of the file that its fix replaces, and what comes there.
    pub(crate) fn fix(&self) -> Option<(Region<'a>, &'a str)> {
        let fix = self.diagnostic.fix.as_ref()?;
        let location = Location { span: fix.span, ..self.diagnostic.location };
        Some((self.files.region(location), &fix.replacement))
    }

    /// The further place that explains it, and what is there.
    pub(crate) fn related(&self) -> Option<(Region<'a>, &'a str)> {
        let (location, message) = self.diagnostic.related.as_ref()?;
        Some((self.files.region(*location), message))
    }
}
