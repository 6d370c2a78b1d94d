//! What is worth showing between the letters of a program: addresses of labels, names of numbers.

use super::Service;
use crate::diagnostic::FileId;
use crate::span::Span;
use crate::token::TokenKind;
use crate::tree::{ExpressionKind, TokenId};

/// A remark at a place of the text.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Hint {
    /// Where it is shown.
    pub offset: u32,
    /// What it says.
    pub text: String,
    /// What it is about.
    pub kind: HintKind,
}

/// What a hint is about.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum HintKind {
    /// The address of a label, behind its colon.
    Address,
    /// The name of the parameter, port or interrupt whose number follows.
    Name,
}

impl Service<'_> {
    /// The hints of a part of a file, line by line.
    pub fn hints(&self, file: FileId, part: Span) -> Vec<Hint> {
        let tree = &self.assembly.file(file).tree;
        let mut hints = Vec::new();
        for line in tree.lines().iter().skip(tree.line_at(part.start)) {
            if tree.line_span(line).start > part.end {
                break;
            }
            for &label in tree.labels(line) {
                let Some(known) = self.assembly.label(tree.token_text(label)) else { continue };
                let is_colon = |&token: &TokenId| tree.kind(token) == TokenKind::Colon;
                let behind = (label.0..line.tokens.end).map(TokenId).find(is_colon);
                hints.push(Hint {
                    offset: tree.token_span(behind.unwrap_or(label)).end,
                    text: format!("@{}", known.address),
                    kind: HintKind::Address,
                });
            }
            for (at, operand) in tree.operands_of(line).iter().enumerate() {
                // A constant has a name already.
                let kind = tree.expression(operand.expression).kind;
                if !matches!(kind, ExpressionKind::Number(_)) {
                    continue;
                }
                let Some(subject) = self.subject(file, line, at) else { continue };
                hints.push(Hint {
                    offset: tree.expression_span(operand.expression).start,
                    text: format!("{}:", lower_case(subject.name())),
                    kind: HintKind::Name,
                });
            }
        }
        hints
    }
}

/// A name as it is written within a sentence: abbreviations stay as they are.
fn lower_case(name: &str) -> String {
    let mut letters = name.chars();
    let (Some(first), rest) = (letters.next(), letters.as_str()) else { return String::new() };
    if rest.starts_with(|second: char| second.is_uppercase() || second.is_ascii_digit()) {
        return name.to_owned();
    }
    first.to_lowercase().chain(rest.chars()).collect()
}
