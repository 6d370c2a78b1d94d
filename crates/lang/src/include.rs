//! Where included files come from.

/// Finds the files that a program includes; what it does not find is looked for among the built-in
/// ones. This is how the outside world gets in: the crate itself reads no file.
pub trait Sources {
    /// The file that `#include name` means in the file known as `from`.
    fn find(&mut self, name: &str, from: &str) -> Found;
}

/// What came of looking for a file.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Found {
    /// It is there.
    File {
        /// By what name to know it, the same each time: its path.
        name: String,
        /// Its text.
        text: String,
    },
    /// There is no such file.
    Nothing,
    /// There is one, and it cannot be read for this reason.
    Unreadable(String),
}

/// Nothing but the built-in files.
#[derive(Clone, Copy, Debug, Default)]
pub struct BuiltInOnly;

impl Sources for BuiltInOnly {
    fn find(&mut self, _name: &str, _from: &str) -> Found {
        Found::Nothing
    }
}
