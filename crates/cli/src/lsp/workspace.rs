//! Open texts, what they include, and the programs that come of them.

use std::collections::{BTreeMap, BTreeSet};
use std::path::{Component, Path, PathBuf};

use lsp_types::Uri;
use opentmcl_catalog::Module;
use opentmcl_lang::include::{Found, Sources};
use opentmcl_lang::service::Service;
use opentmcl_lang::{Assembly, Diagnostic, File, FileId, Options, assemble, check};

use super::documents::Document;
use super::settings::Settings;
use super::uri;
use crate::sources::Disk;

/// Everything that is known.
#[derive(Default)]
pub(super) struct Workspace {
    settings: Settings,
    /// Open texts by their names.
    documents: BTreeMap<String, Document>,
    /// Each open text as the main file of a program, by its name.
    programs: BTreeMap<String, Program>,
    /// For each open text, the program in which it is looked at.
    contexts: BTreeMap<String, String>,
}

/// A program.
pub(super) struct Program {
    pub(super) assembly: Assembly,
    pub(super) module: Option<&'static Module>,
    pub(super) findings: Vec<Diagnostic>,
}

impl Program {
    pub(super) fn service(&self) -> Service<'_> {
        Service { assembly: &self.assembly, module: self.module }
    }

    /// The number of a file by its name.
    fn file(&self, name: &str) -> Option<FileId> {
        let at = self.assembly.files.iter().position(|file| file.name == name)?;
        Some(FileId(at as u16))
    }
}

impl Workspace {
    /// Looks at everything anew by these settings.
    pub(super) fn set(&mut self, settings: Settings) {
        self.settings = settings;
        self.forget_all();
    }

    /// Files on disk may have changed, or others may now be found by the same name.
    pub(super) fn forget_all(&mut self) {
        self.programs.clear();
    }

    pub(super) fn open(&mut self, name: String, document: Document) {
        self.documents.insert(name, document);
        self.forget_all();
    }

    pub(super) fn close(&mut self, name: &str) {
        self.documents.remove(name);
        self.forget_all();
    }

    /// An open text that is about to change.
    pub(super) fn change(&mut self, name: &str) -> Option<&mut Document> {
        self.programs.retain(|_, program| program.file(name).is_none());
        self.documents.get_mut(name)
    }

    /// Open texts and their names.
    pub(super) fn documents(&self) -> impl Iterator<Item = (&str, &Document)> {
        self.documents.iter().map(|(name, document)| (name.as_str(), document))
    }

    /// Folders in which included files are looked for.
    pub(super) fn include_folders(&self) -> &[PathBuf] {
        &self.settings.include
    }

    /// Where the editor finds a file; nowhere, if it is not on disk.
    pub(super) fn uri(&self, file: &File) -> Option<Uri> {
        if file.built_in {
            return None;
        }
        match self.documents.get(&file.name) {
            Some(document) => Some(document.uri.clone()),
            None => uri::of_file(&file.name),
        }
    }

    /// The program in which an open text is looked at, and which of its files the text is. It may be
    /// missing only if the text is not open, or [`Workspace::assemble`] was not called.
    pub(super) fn context(&self, name: &str) -> Option<(&Program, FileId)> {
        let program = self.programs.get(self.contexts.get(name)?)?;
        Some((program, program.file(name)?))
    }

    /// The programs in which open texts are looked at.
    pub(super) fn programs(&self) -> impl Iterator<Item = &Program> {
        let used: BTreeSet<_> = self.contexts.values().collect();
        used.into_iter().filter_map(|main| self.programs.get(main))
    }

    /// Assembles what has changed.
    pub(super) fn assemble(&mut self) {
        if self.programs.len() == self.documents.len() {
            return;
        }
        for (name, document) in &self.documents {
            if self.programs.contains_key(name) {
                continue;
            }
            let mut sources = OpenFirst {
                documents: &self.documents,
                folders: &self.settings.include,
                disk: Disk::new(Path::new(name), &self.settings.include),
            };
            let text = document.text.as_str();
            let assembly = assemble(name, text, &mut sources, Options::default());
            let declared = check::declared_module(&assembly).map(|(name, _)| name);
            let module = declared.and_then(opentmcl_catalog::find).or(self.settings.module);
            let findings = check::findings(&assembly, module);
            self.programs.insert(name.clone(), Program { assembly, module, findings });
        }
        self.contexts = contexts(&self.programs);
    }
}

/// For each program's main file the program in which it is looked at: one that includes it, or its
/// own.
fn contexts(programs: &BTreeMap<String, Program>) -> BTreeMap<String, String> {
    let included = |program: &Program| -> BTreeSet<String> {
        let names = program.assembly.files.iter().skip(1).map(|file| file.name.clone());
        names.filter(|name| programs.contains_key(name)).collect()
    };
    let included: BTreeMap<&String, BTreeSet<String>> =
        programs.iter().map(|(main, program)| (main, included(program))).collect();
    let is_included = |name: &String| included.values().any(|names| names.contains(name));
    let mut contexts = BTreeMap::new();
    // Those that nothing includes, then one of each circle.
    for may_be_included in [false, true] {
        for (&main, names) in &included {
            if contexts.contains_key(main) || is_included(main) && !may_be_included {
                continue;
            }
            contexts.insert(main.clone(), main.clone());
            for name in names {
                contexts.entry(name.clone()).or_insert_with(|| main.clone());
            }
        }
    }
    contexts
}

/// Finds files as the command line does; where one is open in the editor, its text is what is there.
struct OpenFirst<'a> {
    documents: &'a BTreeMap<String, Document>,
    folders: &'a [PathBuf],
    disk: Disk<'a>,
}

impl Sources for OpenFirst<'_> {
    fn find(&mut self, name: &str, from: &str) -> Found {
        let Some(from) = self.beside(from) else { return Found::Nothing };
        match self.disk.find(name, &from) {
            Found::File { name, text } => self.open_or_else(name, text),
            otherwise => self.never_saved(name, &from).unwrap_or(otherwise),
        }
    }
}

impl OpenFirst<'_> {
    /// A file in the folder in which to look first: that of the including file, or for a text that is
    /// not on disk the first one of the settings.
    fn beside(&self, from: &str) -> Option<String> {
        if Path::new(from).is_absolute() {
            return Some(from.to_owned());
        }
        let folder = self.folders.first()?;
        Some(folder.join("unsaved").display().to_string())
    }

    fn open_or_else(&self, name: String, text: String) -> Found {
        let open = self.documents.get_key_value(&name).or_else(|| {
            let real = Path::new(&name).canonicalize().ok()?;
            self.documents.iter().find(|(_, document)| document.real.as_ref() == Some(&real))
        });
        match open {
            Some((name, document)) => {
                Found::File { name: name.clone(), text: document.text.clone() }
            }
            None => Found::File { name: straight(&name), text },
        }
    }

    /// A file that is open and was never saved.
    fn never_saved(&self, name: &str, from: &str) -> Option<Found> {
        let name = name.replace('\\', "/");
        let beside = Path::new(from).parent().unwrap_or(Path::new("/"));
        let folders = [beside].into_iter().chain(self.folders.iter().map(PathBuf::as_path));
        let mut paths = folders.map(|folder| straight(&folder.join(&name).display().to_string()));
        let (name, document) = paths.find_map(|path| self.documents.get_key_value(&path))?;
        Some(Found::File { name: name.clone(), text: document.text.clone() })
    }
}

/// A path without the detours in it, as an editor names the file.
fn straight(name: &str) -> String {
    let mut path = PathBuf::new();
    for component in Path::new(name).components() {
        match component {
            Component::CurDir => {}
            Component::ParentDir => {
                path.pop();
            }
            _ => path.push(component),
        }
    }
    path.display().to_string()
}
