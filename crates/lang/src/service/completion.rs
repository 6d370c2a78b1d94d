//! What may be written where the cursor is.

mod module;

use opentmcl_catalog::MODULES;
use opentmcl_wire::opcode::{FORMS, Meaning, Operand};

use super::context::{Cursor, Place};
use super::describe::{command, command_markdown, is_usable};
use super::hover::{base_name, shown};
use super::{Service, keywords};
use crate::builtin;
use crate::diagnostic::{Code, FileId};
use crate::expression::Function;
use crate::span::Span;
use crate::tree::Tree;

use module::Written;

/// One proposal.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Completion {
    /// What it is called in the list.
    pub label: String,
    /// What it is.
    pub kind: CompletionKind,
    /// More about it in a few words.
    pub detail: Option<String>,
    /// All about it, in Markdown.
    pub documentation: Option<String>,
    /// What what has been written so far is compared with, if not with the label.
    pub filter: Option<String>,
    /// What is replaced.
    pub replace: Span,
    /// What comes in its place.
    pub insert: String,
}

/// What a proposal is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum CompletionKind {
    /// A command.
    Mnemonic,
    /// A word of the language.
    Keyword,
    /// A parameter, port or interrupt of the module.
    Parameter,
    /// A value of a parameter.
    Value,
    /// A label.
    Label,
    /// A constant.
    Constant,
    /// A function.
    Function,
    /// A file to include.
    File,
    /// A module.
    Module,
    /// The name of a finding.
    Finding,
}

/// Collects proposals.
struct List {
    replace: Span,
    items: Vec<Completion>,
}

impl List {
    fn add(&mut self, kind: CompletionKind, label: &str, detail: impl Into<String>) {
        let detail = Some(detail.into()).filter(|detail| !detail.is_empty());
        self.items.push(Completion {
            label: label.to_owned(),
            kind,
            detail,
            documentation: None,
            filter: None,
            replace: self.replace,
            insert: label.to_owned(),
        });
    }

    /// The proposal that was added last.
    fn last(&mut self) -> Option<&mut Completion> {
        self.items.last_mut()
    }

    fn document(&mut self, markdown: String) {
        if let Some(item) = self.last() {
            item.documentation = Some(markdown);
        }
    }

    fn insert(&mut self, text: String) {
        if let Some(item) = self.last() {
            item.insert = text;
        }
    }
}

impl Service<'_> {
    /// What may be written at this offset, the likeliest first. What has been written so far is not
    /// looked at: choosing among the proposals is up to the editor.
    pub fn completion(&self, file: FileId, offset: u32) -> Vec<Completion> {
        let tree = &self.assembly.file(file).tree;
        let cursor = Cursor::new(tree, offset);
        let mut list = List { replace: cursor.word, items: Vec::new() };
        match cursor.place {
            Place::Nothing => {}
            Place::Statement => self.statement(&mut list),
            Place::IncludeName => {
                list.replace = within_quotes(tree, cursor.word);
                for name in builtin::names() {
                    list.add(CompletionKind::File, &name, "comes with the tools");
                }
            }
            Place::Comment => comment(&mut list, tree, offset),
            Place::Expression => self.expression(&mut list),
            Place::Operand { form, at, is_first_word, is_left_out } => {
                let Some(operand) = form.operands.get(at) else { return list.items };
                if is_first_word {
                    words(&mut list, operand);
                    if let Some(line) = cursor.line {
                        let statement = Written { file, line, form, is_left_out };
                        self.numbers(&mut list, &statement, at);
                    }
                }
                match operand.meaning {
                    Meaning::Choice => {}
                    Meaning::Address => {
                        self.labels(&mut list);
                        self.expression(&mut list);
                    }
                    _ => self.expression(&mut list),
                }
            }
        }
        list.items
    }

    /// The name behind `#include` that a cursor at this offset is at, for whoever knows more files
    /// than the built-in ones.
    pub fn include_name(&self, file: FileId, offset: u32) -> Option<Span> {
        let tree = &self.assembly.file(file).tree;
        let cursor = Cursor::new(tree, offset);
        matches!(cursor.place, Place::IncludeName).then(|| within_quotes(tree, cursor.word))
    }

    fn statement(&self, list: &mut List) {
        for form in FORMS {
            let number = form.opcode.number();
            if !is_usable(self.module, number) {
                continue;
            }
            let usage = form.to_string();
            list.add(CompletionKind::Mnemonic, form.mnemonic, usage);
            if command(self.module, number).is_some() {
                list.document(command_markdown(self.module, form));
            }
        }
        list.add(CompletionKind::Keyword, "#include", "#include <file>");
    }

    fn labels(&self, list: &mut List) {
        for label in self.assembly.labels() {
            list.add(CompletionKind::Label, label.name, format!("address {}", label.address));
        }
    }

    fn expression(&self, list: &mut List) {
        for constant in self.assembly.constants() {
            let value = constant.value.map(shown).unwrap_or_default();
            list.add(CompletionKind::Constant, constant.name, value);
            if constant.location.file != FileId(0) {
                let name = &self.assembly.file(constant.location.file).name;
                list.document(format!("Defined in {}", base_name(name)));
            }
        }
        for function in Function::ALL {
            list.add(CompletionKind::Function, function.name(), function.description());
            list.insert(format!("{}(", function.name()));
        }
    }
}

fn words(list: &mut List, operand: &'static Operand) {
    for (word, number) in operand.words {
        list.add(CompletionKind::Keyword, word, format!("{} {number}", operand.name));
        if let Some(meaning) = keywords::meaning(operand.name, word) {
            list.document(meaning.to_owned());
        }
    }
}

/// What comments tell the tools: the module, and which findings are as they should be.
fn comment(list: &mut List, tree: &Tree, offset: u32) {
    let written = Span::new(list.replace.start, offset).of(tree.text());
    let written = written.trim_start_matches(['/', ';']).trim_start();
    let Some((key, value)) = written.split_once(':') else { return };
    let word = value.rsplit([' ', '\t', ',']).next().unwrap_or_default();
    list.replace = Span::new(offset - word.len() as u32, offset);
    match key.trim_end().to_ascii_lowercase().as_str() {
        "module" => {
            for module in MODULES {
                list.add(CompletionKind::Module, module.name, module.description);
            }
        }
        "tmcl-allow" | "tmcl-allow-file" => {
            for code in Code::ALL.iter().filter(|code| code.can_be_silenced()) {
                list.add(CompletionKind::Finding, code.name(), code.severity().name());
                list.document(code.explanation().to_owned());
            }
        }
        _ => {}
    }
}

/// The part of a file's name between its quotes, of which the second may not be there yet.
fn within_quotes(tree: &Tree, name: Span) -> Span {
    let text = name.of(tree.text());
    let begins = text.starts_with(['"', '<']);
    let ends = begins && text.len() > 1 && text.ends_with(['"', '>']);
    Span::new(name.start + u32::from(begins), name.end - u32::from(ends))
}
