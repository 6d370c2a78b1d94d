//! Programs for tests, in which `$0` marks the cursor.

use opentmcl_catalog::Module;

use crate::assembly::Assembly;
use crate::diagnostic::{FileId, Location};
use crate::include::{Found, Sources};
use crate::service::Service;
use crate::{Options, assemble};

/// A program with a cursor in it.
pub(super) struct Fixture {
    pub(super) assembly: Assembly,
    pub(super) module: Option<&'static Module>,
    pub(super) file: FileId,
    pub(super) offset: u32,
}

/// Files by their names.
struct Files(Vec<(String, String)>);

impl Sources for Files {
    fn find(&mut self, name: &str, _from: &str) -> Found {
        match self.0.iter().find(|(known, _)| known == name) {
            Some((name, text)) => Found::File { name: name.clone(), text: text.clone() },
            None => Found::Nothing,
        }
    }
}

impl Fixture {
    /// Of a text for a TMCM-6214. A line `//- name` begins a further file.
    pub(super) fn new(text: &str) -> Self {
        let mut files = vec![("main.tmc".to_owned(), String::new())];
        for line in text.split_inclusive('\n') {
            match line.strip_prefix("//- ") {
                Some(name) => files.push((name.trim_end().to_owned(), String::new())),
                None => files.last_mut().unwrap().1.push_str(line),
            }
        }
        let mut cursor = None;
        for (name, text) in &mut files {
            if let Some(at) = text.find("$0") {
                assert!(cursor.is_none(), "one cursor at most");
                text.replace_range(at..at + 2, "");
                cursor = Some((name.clone(), at as u32));
            }
        }
        let main = files[0].1.clone();
        let assembly = assemble("main.tmc", main, &mut Files(files), Options::default());
        let (name, offset) = cursor.unwrap_or(("main.tmc".into(), 0));
        let file = assembly.files.iter().position(|file| file.name == name);
        let file = FileId(file.expect("the file with the cursor is included") as u16);
        Self { assembly, module: opentmcl_catalog::find("tmcm-6214"), file, offset }
    }

    pub(super) fn without_module(text: &str) -> Self {
        Self { module: None, ..Self::new(text) }
    }

    pub(super) fn service(&self) -> Service<'_> {
        Service { assembly: &self.assembly, module: self.module }
    }

    /// A place as `file:line: text`, the line counted from 1 as editors show it.
    pub(super) fn place(&self, location: Location) -> String {
        let file = self.assembly.file(location.file);
        let line = file.tree.line_at(location.span.start) + 1;
        format!("{}:{line}: {}", file.name, self.assembly.text(location))
    }
}
