//! What the assembler makes of a program.

use opentmcl_wire::Command;

use crate::constants::Constant;
use crate::diagnostic::{Diagnostic, FileId, Location, Severity};
use crate::names::{Entry, Names, Trees};
use crate::tree::{Line, Tree};

/// A program, assembled as far as it can be.
#[derive(Clone, Debug)]
pub struct Assembly {
    /// Its files; the first is the one that was asked for.
    pub files: Vec<File>,
    /// Its commands from address 0. A line that could not be understood has an empty command, so that
    /// the addresses behind it are right.
    pub instructions: Vec<Instruction>,
    /// What was found, in the order of files and lines.
    pub diagnostics: Vec<Diagnostic>,
    pub(crate) labels: Names<u32>,
    pub(crate) constants: Names<Constant>,
}

/// One file of a program.
#[derive(Clone, Debug)]
pub struct File {
    /// By what name it is known.
    pub name: String,
    /// Whether it is one of those that come with the tools.
    pub built_in: bool,
    /// The line that includes it; none for the main file.
    pub included_at: Option<Place>,
    /// What is in it.
    pub tree: Tree,
}

/// One command and where it stands.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Instruction {
    /// The command.
    pub command: Command,
    /// Where it stands; nowhere, if the assembler has added it.
    pub place: Option<Place>,
}

/// A line of a program.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct Place {
    /// The file.
    pub file: FileId,
    /// The line, from 0.
    pub line: u32,
}

/// A label.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Label<'a> {
    /// Its name as it is written where it is defined.
    pub name: &'a str,
    /// The address that it stands for.
    pub address: u32,
    /// Where its name is.
    pub location: Location,
}

/// A constant.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ConstantValue<'a> {
    /// Its name as it is written where it is defined.
    pub name: &'a str,
    /// Its value, if it has one. It may have a fraction: it is rounded where it is used.
    pub value: Option<f64>,
    /// Where its name is.
    pub location: Location,
}

impl Trees for Vec<File> {
    fn tree(&self, file: FileId) -> &Tree {
        // A file's number is only made for a file that is there.
        &self[usize::from(file.0)].tree
    }
}

impl Assembly {
    /// Whether there are no errors, so that the commands are what the author has written.
    pub fn is_valid(&self) -> bool {
        self.diagnostics.iter().all(|diagnostic| diagnostic.severity() < Severity::Error)
    }

    /// The commands from address 0.
    pub fn commands(&self) -> impl ExactSizeIterator<Item = Command> {
        self.instructions.iter().map(|instruction| instruction.command)
    }

    /// A file.
    pub fn file(&self, file: FileId) -> &File {
        &self.files[usize::from(file.0)]
    }

    /// The line of a place.
    pub fn line(&self, place: Place) -> Option<&Line> {
        self.file(place.file).tree.lines().get(place.line as usize)
    }

    /// All labels in the order in which they come.
    pub fn labels(&self) -> impl Iterator<Item = Label<'_>> {
        self.labels.entries().iter().map(|entry| self.label_of(entry))
    }

    fn label_of(&self, entry: &Entry<u32>) -> Label<'_> {
        let tree = self.files.tree(entry.file);
        Label {
            name: tree.token_text(entry.token),
            address: entry.meaning,
            location: Location { file: entry.file, span: tree.token_span(entry.token) },
        }
    }

    /// The label with this name, in any case.
    pub fn label(&self, name: &str) -> Option<Label<'_>> {
        let at = self.labels.find(name, &self.files)?;
        Some(self.label_of(self.labels.entries().get(at)?))
    }

    /// All constants in the order in which they come.
    pub fn constants(&self) -> impl Iterator<Item = ConstantValue<'_>> {
        self.constants.entries().iter().map(|entry| self.constant_of(entry))
    }

    fn constant_of(&self, entry: &Entry<Constant>) -> ConstantValue<'_> {
        let tree = self.files.tree(entry.file);
        ConstantValue {
            name: tree.token_text(entry.token),
            value: entry.meaning.value(),
            location: Location { file: entry.file, span: tree.token_span(entry.token) },
        }
    }

    /// The constant with this name, in any case.
    pub fn constant(&self, name: &str) -> Option<ConstantValue<'_>> {
        let at = self.constants.find(name, &self.files)?;
        Some(self.constant_of(self.constants.entries().get(at)?))
    }

    /// The text of a place.
    pub fn text(&self, location: Location) -> &str {
        location.span.of(self.file(location.file).tree.text())
    }
}
