//! What a name or an include stands for, wherever it is written.

use super::Service;
use super::parts::{Part, Role, part_at, span};
use crate::assembly::Place;
use crate::diagnostic::{FileId, Location};
use crate::span::Span;

/// Something that is defined in one place and used in others.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) enum Target<'a> {
    /// A label, by its name as it is written here.
    Label(&'a str),
    /// A constant, by its name as it is written here.
    Constant(&'a str),
    /// An included file.
    File(FileId),
}

impl<'a> Service<'a> {
    /// What a cursor is at, and the part of the text that names it.
    pub(super) fn target_at(&self, file: FileId, offset: u32) -> Option<(Span, Target<'a>)> {
        let (_, part) = part_at(self.assembly, file, offset)?;
        let target = self.target(file, &part)?;
        Some((span(self.assembly, file, &part), target))
    }

    /// What a part names.
    pub(super) fn target(&self, file: FileId, part: &Part) -> Option<Target<'a>> {
        let tree = &self.assembly.file(file).tree;
        let text = || tree.token_text(part.token);
        match part.role {
            Role::LabelDefinition | Role::Label => Some(Target::Label(text())),
            Role::ConstantDefinition | Role::Constant => Some(Target::Constant(text())),
            Role::IncludeName => {
                self.included_at(file, tree.token_span(part.token).start).map(Target::File)
            }
            _ => None,
        }
    }

    /// The file that the `#include` in the line of this offset has brought.
    pub(super) fn included_at(&self, file: FileId, offset: u32) -> Option<FileId> {
        let line = self.assembly.file(file).tree.line_at(offset) as u32;
        let here = Some(Place { file, line });
        let found = self.assembly.files.iter().position(|file| file.included_at == here)?;
        Some(self.first(FileId(found as u16)))
    }

    /// Where it is defined; of a file, its beginning.
    pub(super) fn definition_of(&self, target: &Target<'_>) -> Option<Location> {
        match *target {
            Target::Label(name) => self.assembly.label(name).map(|label| label.location),
            Target::Constant(name) => self.assembly.constant(name).map(|it| it.location),
            Target::File(file) => Some(Location { file, span: Span::default() }),
        }
    }
}

impl Target<'_> {
    /// Whether two places name the same thing.
    pub(super) fn is(&self, other: &Target<'_>) -> bool {
        match (self, other) {
            (Self::Label(left), Target::Label(right))
            | (Self::Constant(left), Target::Constant(right)) => left.eq_ignore_ascii_case(right),
            (Self::File(left), Target::File(right)) => left == right,
            _ => false,
        }
    }
}
