//! What a file defines and includes.

use std::ops::Range;

use super::Service;
use super::hover::shown;
use crate::diagnostic::FileId;
use crate::span::Span;
use crate::tree::Statement;

/// One entry of the outline of a file.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Symbol {
    /// Its name.
    pub name: String,
    /// What it is.
    pub kind: SymbolKind,
    /// The address or value, if it has one.
    pub detail: Option<String>,
    /// Its name in the text.
    pub span: Span,
    /// All that belongs to it; of a label, the lines up to the next one.
    pub extent: Span,
}

/// What an entry of the outline is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum SymbolKind {
    /// A label.
    Label,
    /// A constant.
    Constant,
    /// An included file.
    Include,
}

impl Service<'_> {
    /// The labels, constants and includes of a file, in the order in which they come.
    pub fn symbols(&self, file: FileId) -> Vec<Symbol> {
        let tree = &self.assembly.file(file).tree;
        let mut symbols: Vec<Symbol> = Vec::new();
        // Labels whose last line has not come yet.
        let mut open: Range<usize> = 0..0;
        let mut end_of_last_line = 0;
        for line in tree.lines() {
            let whole = tree.line_span(line);
            let labels = tree.labels(line);
            if !labels.is_empty() {
                close(&mut symbols[open], end_of_last_line);
                open = symbols.len()..symbols.len() + labels.len();
            }
            for &label in labels {
                let name = tree.token_text(label);
                let address = self.assembly.label(name).map(|label| label.address);
                let span = tree.token_span(label);
                symbols.push(Symbol {
                    name: name.to_owned(),
                    kind: SymbolKind::Label,
                    detail: address.map(|address| format!("address {address}")),
                    span,
                    extent: Span::new(span.start, whole.end),
                });
            }
            let extent = tree.statement_span(line);
            match line.statement {
                Statement::Constant { name, .. } => {
                    let text = tree.token_text(name);
                    let value = self.assembly.constant(text).and_then(|constant| constant.value);
                    symbols.push(Symbol {
                        name: text.to_owned(),
                        kind: SymbolKind::Constant,
                        detail: value.map(shown),
                        span: tree.token_span(name),
                        extent,
                    });
                }
                Statement::Include { argument: Some(argument), .. } => symbols.push(Symbol {
                    name: tree.include_name(argument).to_owned(),
                    kind: SymbolKind::Include,
                    detail: None,
                    span: tree.token_span(argument),
                    extent,
                }),
                _ => {}
            }
            end_of_last_line = whole.end;
        }
        close(&mut symbols[open], end_of_last_line);
        symbols
    }
}

/// Ends what belongs to labels at the end of the last line before the next label.
fn close(labels: &mut [Symbol], end: u32) {
    for label in labels {
        label.extent.end = label.extent.end.max(end);
    }
}
