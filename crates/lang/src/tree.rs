//! The syntax tree of one file.
//!
//! TMCL is a language of lines, and so is its tree: flat tables that refer to each other by number,
//! which makes it small and quick to build at each key. Nothing is lost: every byte of the text
//! belongs to one token, every token to one line. Names are not looked up here; that needs all files
//! of a program.

use std::ops::Range;

use opentmcl_wire::opcode::Form;

use crate::diagnostic::Diagnostic;
use crate::expression::Function;
use crate::parse;
use crate::span::Span;
use crate::token::{Token, TokenKind};

/// A file, read.
#[derive(Clone, Debug)]
pub struct Tree {
    pub(crate) text: String,
    pub(crate) tokens: Vec<Token>,
    pub(crate) lines: Vec<Line>,
    pub(crate) labels: Vec<TokenId>,
    pub(crate) operands: Vec<Operand>,
    pub(crate) expressions: Vec<Expression>,
    pub(crate) diagnostics: Vec<Diagnostic>,
}

/// A token of a tree: its place among the tokens.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct TokenId(pub u32);

/// An expression of a tree: its place among the expressions.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct ExpressionId(pub(crate) u32);

/// One line: labels, a statement, a comment, each of which may be missing.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Line {
    /// Its tokens, the end of the line included.
    pub tokens: Range<u32>,
    pub(crate) labels: Range<u32>,
    /// What it says.
    pub statement: Statement,
}

/// What a line says.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Statement {
    /// Nothing, or nothing that can be understood.
    None,
    /// `#include file`
    Include {
        /// The directive.
        directive: TokenId,
        /// The file's name, with quotes if there are any; see [`Tree::include_name`].
        argument: Option<TokenId>,
    },
    /// `name = value`
    Constant {
        /// The name.
        name: TokenId,
        /// The value.
        value: ExpressionId,
    },
    /// `MVP ABS, 0, 1000`
    Command {
        /// The mnemonic.
        mnemonic: TokenId,
        /// What the mnemonic means, if anything.
        form: Option<&'static Form>,
        /// The operands.
        operands: OperandRange,
    },
    /// `200 1, 2, 3`: a command by its number, with type, motor and value.
    Numbered {
        /// The command's number.
        number: TokenId,
        /// The operands.
        operands: OperandRange,
    },
}

/// Operands of one command, as their place among the operands of the tree.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct OperandRange {
    pub(crate) start: u32,
    pub(crate) end: u32,
}

/// One operand. A keyword is an expression that is only a name.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Operand {
    /// What is written.
    pub expression: ExpressionId,
}

/// A part of an expression.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Expression {
    /// What it is.
    pub kind: ExpressionKind,
    pub(crate) first: TokenId,
    pub(crate) last: TokenId,
}

/// What an expression is.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum ExpressionKind {
    /// A number and its value.
    Number(f64),
    /// A constant, label or keyword: the expression's only token.
    Name,
    /// `-x`
    Negate(ExpressionId),
    /// Two values and what is done with them.
    Binary(BinaryOperator, ExpressionId, ExpressionId),
    /// `SQRT(x)`
    Call(Function, ExpressionId),
    /// `(x)` or `+x`
    Same(ExpressionId),
    /// Not understood; there is a diagnostic.
    Error,
}

/// What is done with two values.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum BinaryOperator {
    /// `+`
    Add,
    /// `-`
    Subtract,
    /// `*`
    Multiply,
    /// `/`
    Divide,
    /// `^`
    Power,
}

impl Tree {
    /// Reads a text, whatever it is.
    pub fn parse(text: impl Into<String>) -> Self {
        parse::parse(text.into())
    }

    /// The text, unchanged.
    pub fn text(&self) -> &str {
        &self.text
    }

    /// All tokens, the last of which is empty and the end.
    pub fn tokens(&self) -> &[Token] {
        &self.tokens
    }

    /// All lines, in order.
    pub fn lines(&self) -> &[Line] {
        &self.lines
    }

    /// What is wrong with the text as such. The file of each location is the main file: whoever puts
    /// files together sets it.
    pub fn diagnostics(&self) -> &[Diagnostic] {
        &self.diagnostics
    }

    /// What a token is.
    pub fn kind(&self, token: TokenId) -> TokenKind {
        self.tokens.get(token.0 as usize).map_or(TokenKind::End, |token| token.kind)
    }

    /// Where a token is.
    pub fn token_span(&self, token: TokenId) -> Span {
        let at = token.0 as usize;
        let end = self.text.len() as u32;
        let start = self.tokens.get(at).map_or(end, |token| token.start);
        Span::new(start, self.tokens.get(at + 1).map_or(end, |next| next.start))
    }

    /// The text of a token.
    pub fn token_text(&self, token: TokenId) -> &str {
        self.token_span(token).of(&self.text)
    }

    /// The names of the labels of a line.
    pub fn labels(&self, line: &Line) -> &[TokenId] {
        slice(&self.labels, line.labels.start, line.labels.end)
    }

    /// The comment of a line.
    pub fn comment(&self, line: &Line) -> Option<TokenId> {
        let ids = line.tokens.clone().rev().take(2).map(TokenId);
        ids.into_iter().find(|&token| self.kind(token) == TokenKind::Comment)
    }

    /// The operands of a command.
    pub fn operands(&self, range: OperandRange) -> &[Operand] {
        slice(&self.operands, range.start, range.end)
    }

    /// The operands of a line, if it has a command.
    pub fn operands_of(&self, line: &Line) -> &[Operand] {
        match line.statement {
            Statement::Command { operands, .. } | Statement::Numbered { operands, .. } => {
                self.operands(operands)
            }
            _ => &[],
        }
    }

    /// A part of an expression.
    pub fn expression(&self, id: ExpressionId) -> Expression {
        const ERROR: Expression =
            Expression { kind: ExpressionKind::Error, first: TokenId(0), last: TokenId(0) };
        self.expressions.get(id.0 as usize).copied().unwrap_or(ERROR)
    }

    /// Where an expression is. One that is missing is empty and stands where it should be.
    pub fn expression_span(&self, id: ExpressionId) -> Span {
        let expression = self.expression(id);
        let last = self.token_span(expression.last);
        if expression.first > expression.last {
            return Span::new(last.start, last.start);
        }
        Span::new(self.token_span(expression.first).start, last.end)
    }

    /// The name, if an expression is nothing else.
    pub fn name(&self, id: ExpressionId) -> Option<&str> {
        let expression = self.expression(id);
        let is_name = expression.kind == ExpressionKind::Name;
        is_name.then(|| self.token_text(expression.first))
    }

    /// Where a line is, without what ends it.
    pub fn line_span(&self, line: &Line) -> Span {
        let end = line.tokens.end.saturating_sub(1);
        let last = self.token_span(TokenId(end));
        let end = if self.kind(TokenId(end)) == TokenKind::Newline { last.start } else { last.end };
        Span::new(self.token_span(TokenId(line.tokens.start)).start, end)
    }

    /// Where the statement of a line is, from its first to its last token that is neither blank nor a
    /// comment; the labels do not belong to it. Empty, at the end of the line, if there is none.
    pub fn statement_span(&self, line: &Line) -> Span {
        let first = match line.statement {
            Statement::None => {
                let end = self.line_span(line).end;
                return Span::new(end, end);
            }
            Statement::Include { directive: first, .. }
            | Statement::Constant { name: first, .. }
            | Statement::Command { mnemonic: first, .. }
            | Statement::Numbered { number: first, .. } => first,
        };
        let shows = |&token: &TokenId| {
            use TokenKind::{Blank, Comment, Newline};
            !matches!(self.kind(token), Blank | Comment | Newline)
        };
        let last = line.tokens.clone().rev().map(TokenId).find(shows).unwrap_or(first);
        Span::new(self.token_span(first).start, self.token_span(last).end)
    }

    /// The number of the line that holds an offset, from 0.
    pub fn line_at(&self, offset: u32) -> usize {
        let starts_by = |line: &Line| {
            self.tokens.get(line.tokens.start as usize).is_some_and(|token| token.start <= offset)
        };
        self.lines.partition_point(starts_by).saturating_sub(1)
    }

    /// The name of an included file without its quotes or brackets.
    pub fn include_name(&self, argument: TokenId) -> &str {
        let text = self.token_text(argument);
        let unquoted = |open, close| text.strip_prefix(open)?.strip_suffix(close);
        unquoted('"', '"').or_else(|| unquoted('<', '>')).unwrap_or(text).trim()
    }
}

fn slice<T>(all: &[T], start: u32, end: u32) -> &[T] {
    all.get(start as usize..end as usize).unwrap_or_default()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[track_caller]
    fn operands(text: &str, expected: &[&str]) {
        let tree = Tree::parse(text);
        let of = |operand: &Operand| tree.expression_span(operand.expression).of(text);
        let found: Vec<_> = tree.operands_of(&tree.lines()[0]).iter().map(of).collect();
        assert_eq!(found, expected, "{text}");
    }

    #[test]
    fn the_place_of_an_operand_is_all_that_is_written_of_it() {
        operands("SAP 4, (1+2)*3 , SIN( x )//y", &["4", "(1+2)*3", "SIN( x )"]);
        operands("COMP 2 ^ - 3", &["2 ^ - 3"]);
        operands("COMP - - 3", &["- - 3"]);
        operands("200 1, x-1", &["1", "x-1"]);
    }

    #[test]
    fn the_place_of_a_damaged_operand_does_not_reach_beyond_it() {
        operands("SAP 4,, 5", &["4", "", "5"]);
        operands("SAP 4, 1+, 5", &["4", "1+", "5"]);
        operands("SAP 4, (1, 5", &["4", "(1", "5"]);
        operands("SAP 4, 2*(, 5", &["4", "2*(", "5"]);
        operands("SAP 4, 2^-, 5", &["4", "2^-", "5"]);
        operands("SAP 4, 1 + \u{A0} // x", &["4", "1 +"]);
        operands("SAP 4, ( ", &["4", "("]);
    }

    #[test]
    fn a_missing_operand_is_where_it_should_be() {
        let text = "SAP 4, , 5";
        let tree = Tree::parse(text);
        let missing = tree.operands_of(&tree.lines()[0])[1];
        assert_eq!(tree.expression_span(missing.expression), Span::new(7, 7));
    }

    #[test]
    fn a_statement_has_neither_labels_nor_comments() {
        let text = "A: MST 0 \t// x\r\nB: // y\n C = 1 + 2 \n#include d ;e\n  200 1\n";
        let tree = Tree::parse(text);
        let statements = tree.lines().iter().map(|line| tree.statement_span(line).of(text));
        let expected = ["MST 0", "", "C = 1 + 2", "#include d", "200 1"];
        assert_eq!(statements.collect::<Vec<_>>(), expected);
        // Where none is, one would be written at the end of the line.
        let end = text.find("// y").unwrap() as u32 + 4;
        assert_eq!(tree.statement_span(&tree.lines()[1]), Span::new(end, end));
        let line = tree.line_span(&tree.lines()[0]);
        assert_eq!(line.of(text), "A: MST 0 \t// x");
        let open = Tree::parse("A\nSTOP");
        assert_eq!(open.line_span(&open.lines()[1]), Span::new(2, 6));
        let comments = tree.lines().iter().map(|line| Some(tree.token_text(tree.comment(line)?)));
        assert_eq!(
            comments.collect::<Vec<_>>(),
            [Some("// x"), Some("// y"), None, Some(";e"), None]
        );
    }

    #[test]
    fn an_offset_belongs_to_the_line_that_it_is_on() {
        let tree = Tree::parse("ab\ncd\n");
        let lines: Vec<_> = (0..8).map(|offset| tree.line_at(offset)).collect();
        // The end of a line belongs to it; behind the last one there is no further line.
        assert_eq!(lines, [0, 0, 0, 1, 1, 1, 1, 1]);
    }

    #[test]
    fn the_name_of_an_included_file_is_free_of_quotes_and_blanks() {
        for text in ["#include a b.tmc", "#include < a b.tmc >", "#include \" a b.tmc\" // x"] {
            let tree = Tree::parse(text);
            let Statement::Include { argument: Some(argument), .. } = tree.lines()[0].statement
            else {
                panic!("{text}")
            };
            assert_eq!(tree.include_name(argument), "a b.tmc", "{text}");
        }
    }

    #[test]
    fn a_text_that_is_too_long_is_not_read() {
        let full = Tree::parse(" ".repeat(crate::MAX_TEXT));
        assert_eq!((full.text().len(), full.diagnostics().len()), (crate::MAX_TEXT, 0));
        let too_long = Tree::parse(" ".repeat(crate::MAX_TEXT + 1));
        assert_eq!((too_long.text(), too_long.diagnostics().len()), ("", 1));
        assert_eq!(too_long.diagnostics()[0].code, crate::Code::TooMuchText);
    }

    #[test]
    fn a_tree_tells_no_more_than_a_thousand_findings() {
        assert_eq!(Tree::parse("= 5\n".repeat(2000)).diagnostics().len(), 1000);
    }
}
