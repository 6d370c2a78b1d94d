//! Other names for labels and constants.

use core::fmt;

use opentmcl_wire::opcode::FORMS;

use super::hover::base_name;
use super::symbol::Target;
use super::{Edit, Service};
use crate::diagnostic::{FileId, Location};
use crate::span::Span;
use crate::token::{TokenKind, tokens};

/// Why something cannot be renamed.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum RenameError {
    /// There is neither a label nor a constant.
    NothingHere,
    /// The name has no definition.
    NotDefined(String),
    /// It is defined in a file that comes with the tools.
    BuiltIn(String),
    /// The new name cannot be written.
    NotAName(String),
    /// The new name is a word of the language.
    Keyword(String),
    /// There is a label or constant with the new name.
    Taken(String),
}

impl fmt::Display for RenameError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::NothingHere => write!(f, "only labels and constants can be renamed"),
            Self::NotDefined(name) => {
                write!(f, "{name} is not defined; there is nothing to rename")
            }
            Self::BuiltIn(file) => {
                write!(f, "it is defined in {file}, which comes with the tools and cannot change")
            }
            Self::NotAName(name) => write!(
                f,
                "{name:?} is not a name; a name begins with a letter or `_` and goes on with \
                 letters, digits and `_`"
            ),
            Self::Keyword(name) => {
                write!(f, "{name} is a word of the language; a constant needs another name")
            }
            Self::Taken(name) => write!(
                f,
                "there is a {name} already; labels and constants need different names in any case"
            ),
        }
    }
}

impl core::error::Error for RenameError {}

impl<'a> Service<'a> {
    /// Whether what is at this offset can be renamed: its name and where it is.
    ///
    /// # Errors
    ///
    /// There is no label or constant, or its definition cannot be changed.
    pub fn prepare_rename(
        &self,
        file: FileId,
        offset: u32,
    ) -> Result<(Span, &'a str), RenameError> {
        let (span, target) = self.target_at(file, offset).ok_or(RenameError::NothingHere)?;
        let (Target::Label(name) | Target::Constant(name)) = target else {
            return Err(RenameError::NothingHere);
        };
        let Some(definition) = self.definition_of(&target) else {
            return Err(RenameError::NotDefined(name.to_owned()));
        };
        let defined = self.assembly.file(definition.file);
        if defined.built_in {
            return Err(RenameError::BuiltIn(base_name(&defined.name).to_owned()));
        }
        Ok((span, name))
    }

    /// Gives what is at this offset another name, wherever it is written.
    ///
    /// # Errors
    ///
    /// It cannot be renamed, or not to this name.
    pub fn rename(&self, file: FileId, offset: u32, new: &str) -> Result<Vec<Edit>, RenameError> {
        self.prepare_rename(file, offset)?;
        let (_, target) = self.target_at(file, offset).ok_or(RenameError::NothingHere)?;
        self.check_name(&target, new)?;
        let places = self.references(file, offset).into_iter();
        let edit = |location: Location| Edit { location, text: new.to_owned() };
        Ok(places.map(|reference| edit(reference.location)).collect())
    }

    fn check_name(&self, target: &Target<'_>, new: &str) -> Result<(), RenameError> {
        let found = tokens(new);
        if !matches!(found.as_slice(), [name, _] if name.kind == TokenKind::Name) {
            return Err(RenameError::NotAName(new.to_owned()));
        }
        let renamed = match *target {
            Target::Label(name) => Target::Label(name).is(&Target::Label(new)),
            Target::Constant(name) => Target::Constant(name).is(&Target::Constant(new)),
            Target::File(_) => false,
        };
        // Only its case changes.
        if renamed {
            return Ok(());
        }
        let words = || FORMS.iter().flat_map(|form| form.operands).flat_map(|it| it.words);
        let is_word = words().any(|(word, _)| word.eq_ignore_ascii_case(new));
        if is_word && matches!(target, Target::Constant(_)) {
            return Err(RenameError::Keyword(new.to_owned()));
        }
        // A constant would hide a label of its name where a number is expected, and a label a constant
        // where an address is.
        if self.assembly.label(new).is_some() || self.assembly.constant(new).is_some() {
            return Err(RenameError::Taken(new.to_owned()));
        }
        Ok(())
    }
}
