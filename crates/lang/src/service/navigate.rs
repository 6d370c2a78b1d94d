//! Where something is defined and used.

use super::Service;
use super::parts::{Role, location, parts};
use super::symbol::Target;
use crate::diagnostic::{FileId, Location};

/// One place that names something.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Reference {
    /// The place.
    pub location: Location,
    /// Whether it defines it.
    pub is_definition: bool,
}

impl Service<'_> {
    /// Where the label, constant or included file at this offset is defined.
    pub fn definition(&self, file: FileId, offset: u32) -> Option<Location> {
        let (_, target) = self.target_at(file, offset)?;
        self.definition_of(&target)
    }

    /// Every place, in all files, that names what is at this offset.
    pub fn references(&self, file: FileId, offset: u32) -> Vec<Reference> {
        let Some((_, target)) = self.target_at(file, offset) else { return Vec::new() };
        self.files().flat_map(|file| self.references_in(file, &target)).collect()
    }

    /// Every place in the same file that names what is at this offset.
    pub fn highlights(&self, file: FileId, offset: u32) -> Vec<Reference> {
        let Some((_, target)) = self.target_at(file, offset) else { return Vec::new() };
        self.references_in(file, &target)
    }

    pub(super) fn references_in(&self, file: FileId, target: &Target<'_>) -> Vec<Reference> {
        let lines = self.assembly.file(file).tree.lines();
        let all = lines.iter().flat_map(|line| parts(self.assembly, file, line));
        let wanted = all.filter(|part| self.target(file, part).is_some_and(|it| it.is(target)));
        let reference = |part: super::parts::Part| Reference {
            location: location(self.assembly, file, &part),
            is_definition: matches!(part.role, Role::LabelDefinition | Role::ConstantDefinition),
        };
        wanted.map(reference).collect()
    }
}
