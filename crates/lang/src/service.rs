//! What an editor asks about a program, as offsets and values: what may stand here, what this is,
//! where it is defined, what it is called from now on.
//!
//! Nothing here knows a protocol. Every answer is computed from an [`Assembly`] alone, which is
//! quick to make, so that nothing is kept between two questions.

mod actions;
mod completion;
mod context;
mod describe;
mod hints;
mod hover;
mod keywords;
mod navigate;
mod outline;
mod parts;
mod rename;
mod subject;
mod symbol;
mod tokens;

#[cfg(test)]
mod tests;

use opentmcl_catalog::Module;

pub use actions::Action;
pub use completion::{Completion, CompletionKind};
pub use hints::{Hint, HintKind};
pub use hover::Hover;
pub use navigate::Reference;
pub use outline::{Symbol, SymbolKind};
pub use rename::RenameError;
pub use tokens::{SemanticToken, TokenClass};

use crate::assembly::Assembly;
use crate::diagnostic::{FileId, Location};

/// A program and the module that it is for.
///
/// Questions name one of the program's files and a byte in it. An offset beyond the file's end or
/// within a character finds nothing, or what is nearest to it.
#[derive(Clone, Copy, Debug)]
pub struct Service<'a> {
    /// The program with all its files.
    pub assembly: &'a Assembly,
    /// The module, if it is known; without it numbers of parameters have no names.
    pub module: Option<&'static Module>,
}

/// A replacement in one of a program's files.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Edit {
    /// What is replaced.
    pub location: Location,
    /// What comes in its place.
    pub text: String,
}

impl Service<'_> {
    /// The same file as it was included first: a file that is included twice is there twice.
    fn first(&self, file: FileId) -> FileId {
        let name = &self.assembly.file(file).name;
        let first = self.assembly.files.iter().position(|other| other.name == *name);
        first.map_or(file, |at| FileId(at as u16))
    }

    /// All files, each once.
    fn files(&self) -> impl Iterator<Item = FileId> {
        let all = (0..self.assembly.files.len()).map(|at| FileId(at as u16));
        all.filter(|&file| self.first(file) == file)
    }
}
