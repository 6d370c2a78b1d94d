//! Labels and statements, token by token.

use opentmcl_wire::opcode::Form;

use crate::token::TokenKind;
use crate::tree::{Line, Operand, Statement, TokenId, Tree};

use super::INDENT;

/// Writes the labels and the statement of a line that has no mistakes, without a blank behind them.
pub(super) fn write(tree: &Tree, line: &Line, text: &mut String) {
    let start = text.len();
    for (at, &label) in tree.labels(line).iter().enumerate() {
        text.push_str(if at == 0 { "" } else { " " });
        text.push_str(tree.token_text(label));
        text.push(':');
    }
    let (head, form) = match line.statement {
        Statement::None => return,
        Statement::Include { directive: head, .. }
        | Statement::Constant { name: head, .. }
        | Statement::Numbered { number: head, .. } => (head, None),
        Statement::Command { mnemonic: head, form, .. } => (head, form),
    };
    let labels = text[start..].chars().count();
    let blanks = match (labels, is_command(line)) {
        (0, true) => INDENT,
        (0, false) => 0,
        _ => INDENT.saturating_sub(labels).max(1),
    };
    text.extend(std::iter::repeat_n(' ', blanks));
    write_head(tree, line, head, text);
    let operands = tree.operands_of(line);
    let mut writer = Writer { tree, form, operands, operand: 0, blank: true, ends_value: false };
    let mut tokens = (head.0 + 1..line.tokens.end).map(TokenId).peekable();
    while let Some(token) = tokens.next() {
        match tree.kind(token) {
            TokenKind::Blank => {}
            TokenKind::Comment | TokenKind::Newline | TokenKind::End => break,
            _ => {
                while tokens.next_if(|&next| tree.kind(next) == TokenKind::Blank).is_some() {}
                let next = tokens.peek().map_or(TokenKind::End, |&next| tree.kind(next));
                writer.token(token, next, text);
            }
        }
    }
}

/// Whether a line has a command, by its name or by its number.
pub(super) fn is_command(line: &Line) -> bool {
    matches!(line.statement, Statement::Command { .. } | Statement::Numbered { .. })
}

fn write_head(tree: &Tree, line: &Line, head: TokenId, text: &mut String) {
    let written = tree.token_text(head);
    match line.statement {
        Statement::Command { form: Some(form), .. } => text.push_str(form.mnemonic),
        Statement::Include { .. } if written.eq_ignore_ascii_case("#include") => {
            text.push_str("#include");
        }
        _ => text.push_str(written),
    }
}

/// What follows the head of a statement.
struct Writer<'t> {
    tree: &'t Tree,
    form: Option<&'static Form>,
    operands: &'t [Operand],
    /// Which operand comes.
    operand: usize,
    /// Whether a blank is due before the next token.
    blank: bool,
    /// Whether a value has ended, so that a sign is an operator.
    ends_value: bool,
}

impl Writer<'_> {
    fn token(&mut self, token: TokenId, next: TokenKind, text: &mut String) {
        use TokenKind::{Caret, Close, Comma, Equals, Minus, Open, Plus, Slash, Star};
        let kind = self.tree.kind(token);
        let (before, behind, ends_value) = match kind {
            Comma => (false, true, false),
            Equals | Star | Slash => (true, true, false),
            Plus | Minus if self.ends_value => (true, true, false),
            Caret => (false, false, false),
            Close => (false, false, true),
            Plus | Minus | Open => (self.blank, false, false),
            _ => (self.blank, false, true),
        };
        if before {
            text.push(' ');
        }
        let written = self.tree.token_text(token);
        if kind == TokenKind::Name && (next == Open || self.is_keyword()) {
            text.extend(written.chars().map(|character| character.to_ascii_uppercase()));
        } else {
            text.push_str(written);
        }
        self.blank = behind;
        self.ends_value = ends_value;
        self.operand += usize::from(kind == Comma);
    }

    /// Whether the operand is one of its words, and nothing else: these come before constants.
    fn is_keyword(&self) -> bool {
        let place = self.form.and_then(|form| form.operands.get(self.operand));
        let written = self.operands.get(self.operand);
        place.zip(written).is_some_and(|(place, written)| {
            self.tree.name(written.expression).is_some_and(|name| {
                place.words.iter().any(|(word, _)| word.eq_ignore_ascii_case(name))
            })
        })
    }
}
