//! Names of labels or constants, found in any case.

use hashbrown::HashTable;

use crate::diagnostic::FileId;
use crate::tree::{TokenId, Tree};

/// One kind of names: their definitions in the order in which they come, each found by its name.
#[derive(Clone, Debug)]
pub(crate) struct Names<T> {
    entries: Vec<Entry<T>>,
    index: HashTable<u32>,
}

/// A definition.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Entry<T> {
    hash: u64,
    /// The name where it is defined.
    pub(crate) file: FileId,
    pub(crate) token: TokenId,
    /// What it stands for.
    pub(crate) meaning: T,
}

impl<T> Default for Names<T> {
    fn default() -> Self {
        Self { entries: Vec::new(), index: HashTable::new() }
    }
}

/// Trees of a program's files, by their number.
pub(crate) trait Trees {
    fn tree(&self, file: FileId) -> &Tree;
}

impl<T> Names<T> {
    /// All definitions in the order in which they come.
    pub(crate) fn entries(&self) -> &[Entry<T>] {
        &self.entries
    }

    /// All names as they are written where they are defined.
    pub(crate) fn names<'a, A: Trees>(&'a self, trees: &'a A) -> impl Iterator<Item = &'a str> {
        self.entries.iter().map(|entry| trees.tree(entry.file).token_text(entry.token))
    }

    pub(crate) fn entry_mut(&mut self, at: usize) -> Option<&mut Entry<T>> {
        self.entries.get_mut(at)
    }

    /// The place among the entries of the definition of a name.
    pub(crate) fn find(&self, name: &str, trees: &impl Trees) -> Option<usize> {
        let is_it = |&at: &u32| {
            let entry = &self.entries[at as usize];
            trees.tree(entry.file).token_text(entry.token).eq_ignore_ascii_case(name)
        };
        self.index.find(hash(name), is_it).map(|&at| at as usize)
    }

    /// Adds a definition; if there is one by this name, gives the place of that and adds nothing.
    pub(crate) fn define(
        &mut self,
        file: FileId,
        token: TokenId,
        meaning: T,
        trees: &impl Trees,
    ) -> Result<(), usize> {
        let name = trees.tree(file).token_text(token);
        if let Some(earlier) = self.find(name, trees) {
            return Err(earlier);
        }
        let hash = hash(name);
        let at = self.entries.len() as u32;
        self.entries.push(Entry { hash, file, token, meaning });
        let entries = &self.entries;
        self.index.insert_unique(hash, at, |&at| entries[at as usize].hash);
        Ok(())
    }
}

/// FNV-1a over the lower case letters, and a multiplication so that the upper bits, which the table
/// looks at first, depend on all of them.
fn hash(name: &str) -> u64 {
    let fnv = name.bytes().fold(0xCBF2_9CE4_8422_2325_u64, |hash, byte| {
        (hash ^ u64::from(byte.to_ascii_lowercase())).wrapping_mul(0x100_0000_01B3)
    });
    (fnv ^ fnv >> 32).wrapping_mul(0x9E37_79B9_7F4A_7C15)
}
