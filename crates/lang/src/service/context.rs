//! What may stand where the cursor is, also on a line that is not finished.

use opentmcl_wire::opcode::Form;

use crate::mnemonic;
use crate::span::Span;
use crate::token::TokenKind;
use crate::tree::{Line, TokenId, Tree};

/// The place of a cursor in the language.
#[derive(Clone, Copy, Debug)]
pub(super) struct Cursor<'a> {
    /// The line, if it is not empty.
    pub(super) line: Option<&'a Line>,
    /// The word that is being written; empty, at the cursor, if none is.
    pub(super) word: Span,
    pub(super) place: Place,
}

#[derive(Clone, Copy, Debug)]
pub(super) enum Place {
    /// Where nothing can be proposed.
    Nothing,
    /// The beginning of a statement.
    Statement,
    /// The name behind `#include`.
    IncludeName,
    /// Behind `//`.
    Comment,
    /// Within the value of a constant, or an operand of a command that is written as a number.
    Expression,
    /// An operand of a command.
    Operand {
        form: &'static Form,
        /// Which, counted from 0.
        at: usize,
        /// Whether nothing of it is there yet but the word.
        is_first_word: bool,
        /// Whether the comma behind it follows the mnemonic directly. The tree takes such a comma
        /// for a mistake, and the operand behind it for the first one.
        is_left_out: bool,
    },
}

impl<'a> Cursor<'a> {
    /// Where a cursor at this offset is.
    pub(super) fn new(tree: &'a Tree, offset: u32) -> Self {
        let offset = offset.min(tree.text().len() as u32);
        let empty = Span::new(offset, offset);
        let line = tree.lines().get(tree.line_at(offset));
        let line = line.filter(|line| offset <= tree.line_span(line).end);
        let nowhere = Self { line, word: empty, place: Place::Nothing };
        let Some(line) = line else { return Self { place: Place::Statement, ..nowhere } };
        let mut before = Vec::new();
        let mut word = empty;
        let mut tokens = line.tokens.clone().map(TokenId);
        for token in tokens.by_ref() {
            let span = tree.token_span(token);
            let kind = tree.kind(token);
            if span.start >= offset {
                break;
            }
            let is_touched = offset <= span.end;
            match kind {
                TokenKind::Comment => return Self { word: span, place: Place::Comment, ..nowhere },
                TokenKind::Name
                | TokenKind::Number
                | TokenKind::Directive
                | TokenKind::Argument
                    if is_touched =>
                {
                    word = span;
                }
                TokenKind::Blank => {}
                _ => before.push(token),
            }
        }
        let behind = line.tokens.clone().map(TokenId).find(|&token| {
            tree.token_span(token).start >= word.end.max(offset)
                && tree.kind(token) != TokenKind::Blank
        });
        let behind = behind.map_or(TokenKind::End, |token| tree.kind(token));
        Self { line: Some(line), word, place: place(tree, &before, word == empty, behind) }
    }
}

/// The place behind these tokens and in front of the next one.
fn place(tree: &Tree, mut before: &[TokenId], word_is_empty: bool, behind: TokenKind) -> Place {
    while let [name, colon, rest @ ..] = before
        && tree.kind(*name) == TokenKind::Name
        && tree.kind(*colon) == TokenKind::Colon
    {
        before = rest;
    }
    let Some((&head, rest)) = before.split_first() else {
        // The name of a label or constant is the author's to find.
        let is_definition = matches!(behind, TokenKind::Colon | TokenKind::Equals);
        return if is_definition { Place::Nothing } else { Place::Statement };
    };
    let last = rest.last().map(|&token| tree.kind(token));
    // Behind a complete value nothing but an operator or a comma can come.
    let is_complete = matches!(last, Some(TokenKind::Name | TokenKind::Number | TokenKind::Close));
    match tree.kind(head) {
        TokenKind::Directive => {
            let is_include = tree.token_text(head).eq_ignore_ascii_case("#include");
            if is_include && rest.is_empty() { Place::IncludeName } else { Place::Nothing }
        }
        _ if is_complete => Place::Nothing,
        TokenKind::Number => Place::Expression,
        TokenKind::Name if rest.first().is_some_and(|&it| tree.kind(it) == TokenKind::Equals) => {
            Place::Expression
        }
        TokenKind::Name => {
            let is_comma = |&&token: &&TokenId| tree.kind(token) == TokenKind::Comma;
            let commas = rest.iter().filter(is_comma).count();
            let at = commas - usize::from(rest.first().as_ref().is_some_and(is_comma));
            let is_first_word = matches!(last, None | Some(TokenKind::Comma));
            let is_left_out = rest.is_empty() && word_is_empty && behind == TokenKind::Comma;
            match mnemonic::find(tree.token_text(head)) {
                Some(form) if at < form.operands.len() => {
                    Place::Operand { form, at, is_first_word, is_left_out }
                }
                _ => Place::Nothing,
            }
        }
        _ => Place::Nothing,
    }
}
