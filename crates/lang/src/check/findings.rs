//! Collects findings.

use crate::assembly::Assembly;
use crate::diagnostic::{Code, Diagnostic};
use crate::parse::MAX_DIAGNOSTICS;

use super::comments::Silence;

/// The findings of one program.
pub(super) struct Findings<'a> {
    assembly: &'a Assembly,
    silence: Silence,
    all: Vec<Diagnostic>,
    /// How many more will be taken.
    room: usize,
}

impl<'a> Findings<'a> {
    /// None yet.
    pub(super) fn new(assembly: &'a Assembly) -> Self {
        let silence = Silence::of(assembly);
        Self { assembly, silence, all: Vec::new(), room: MAX_DIAGNOSTICS }
    }

    /// Adds what the assembler has told, which is limited in number already.
    pub(super) fn repeat(&mut self, diagnostic: &Diagnostic) {
        if !self.silence.covers(self.assembly, diagnostic) {
            self.all.push(diagnostic.clone());
        }
    }

    /// Adds a finding, unless a comment silences it.
    pub(super) fn report(&mut self, diagnostic: Diagnostic) {
        if self.room > 0 && !self.silence.covers(self.assembly, &diagnostic) {
            self.room -= 1;
            self.all.push(diagnostic);
        }
    }

    /// All of them in the order of files and lines.
    pub(super) fn finish(mut self) -> Vec<Diagnostic> {
        let is_told = self.all.iter().any(|one| one.code == Code::TooManyFindings);
        if self.room == 0 && !is_told {
            let last = self.all.iter().map(|one| one.location).max().unwrap_or_default();
            let message = format!("there are more than {MAX_DIAGNOSTICS} findings");
            self.all.push(Diagnostic::new(Code::TooManyFindings, last, message));
        }
        self.all.sort_by_key(|diagnostic| diagnostic.location);
        self.all
    }
}
