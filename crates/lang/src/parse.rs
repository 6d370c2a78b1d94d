//! Text to tree. Reading never fails: what is not understood is told, and the next line is read.

mod expression;

use opentmcl_wire::opcode::Form;

use crate::diagnostic::{Code, Diagnostic, FileId, Location};
use crate::mnemonic;
use crate::span::Span;
use crate::token::{Token, TokenKind, tokens};
use crate::tree::{
    Expression, ExpressionId, ExpressionKind, Line, Operand, OperandRange, Statement, TokenId, Tree,
};

/// How many findings of one file are told.
pub(crate) const MAX_DIAGNOSTICS: usize = 1000;

/// The longest text that is read, in bytes. The longest program that a module can hold is a hundredth
/// of it. A text of nothing but short lines takes some sixty times its length in memory.
pub const MAX_TEXT: usize = 8 << 20;

pub(crate) fn parse(text: String) -> Tree {
    let mut tree = Tree {
        text,
        tokens: Vec::new(),
        lines: Vec::new(),
        labels: Vec::new(),
        operands: Vec::new(),
        expressions: Vec::new(),
        diagnostics: Vec::new(),
    };
    if tree.text.len() > MAX_TEXT {
        let message =
            format!("the file has {} bytes; at most {MAX_TEXT} are read", tree.text.len());
        tree.diagnostics.push(Diagnostic::new(Code::TooMuchText, Location::default(), message));
        tree.text = String::new();
    }
    tree.tokens = tokens(&tree.text);
    let ends = tree.tokens.iter().filter(|token| token.kind == TokenKind::Newline).count();
    tree.lines.reserve_exact(ends + 1);
    tree.operands.reserve(tree.tokens.len() / 4);
    tree.expressions.reserve(tree.tokens.len() / 4);
    let mut parser = Parser { tree, at: 0, depth: 0 };
    while parser.kind() != TokenKind::End {
        parser.line();
    }
    parser.tree
}

struct Parser {
    tree: Tree,
    at: u32,
    /// How many parentheses, functions and signs are open.
    depth: u32,
}

impl Parser {
    fn token(&self) -> Token {
        // The last token is the end, and nothing goes beyond it.
        self.tree.tokens[self.at as usize]
    }

    fn kind(&self) -> TokenKind {
        self.token().kind
    }

    /// The kind of the next token that shows something, behind the present one.
    fn kind_behind(&self) -> TokenKind {
        let mut at = self.at as usize + 1;
        while self.tree.tokens.get(at).is_some_and(|token| token.kind == TokenKind::Blank) {
            at += 1;
        }
        self.tree.tokens.get(at).map_or(TokenKind::End, |token| token.kind)
    }

    fn id(&self) -> TokenId {
        TokenId(self.at)
    }

    fn text_of(&self, token: TokenId) -> &str {
        self.tree.token_text(token)
    }

    /// Takes the present token and the blanks behind it.
    fn take(&mut self) -> TokenId {
        let id = self.id();
        if self.kind() != TokenKind::End {
            self.at += 1;
        }
        self.skip_blanks();
        id
    }

    fn skip_blanks(&mut self) {
        while self.kind() == TokenKind::Blank {
            self.at += 1;
        }
    }

    fn ends_statement(&self) -> bool {
        matches!(self.kind(), TokenKind::Comment | TokenKind::Newline | TokenKind::End)
    }

    fn line(&mut self) {
        let first = self.at;
        let first_label = self.tree.labels.len() as u32;
        self.skip_blanks();
        while self.kind() == TokenKind::Name && self.kind_behind() == TokenKind::Colon {
            let label = self.take();
            self.tree.labels.push(label);
            self.take();
        }
        let labels = first_label..self.tree.labels.len() as u32;
        let statement = self.statement();
        self.end_of_statement(&statement);
        if self.kind() == TokenKind::Comment {
            self.at += 1;
        }
        if self.kind() == TokenKind::Newline {
            self.at += 1;
        }
        self.tree.lines.push(Line { tokens: first..self.at, labels, statement });
    }

    fn statement(&mut self) -> Statement {
        match self.kind() {
            TokenKind::Name if self.kind_behind() == TokenKind::Equals => {
                let name = self.take();
                self.take();
                Statement::Constant { name, value: self.expression() }
            }
            TokenKind::Name => self.command(),
            TokenKind::Number => {
                Statement::Numbered { number: self.take(), operands: self.operands() }
            }
            TokenKind::Directive => {
                let directive = self.take();
                let argument = (self.kind() == TokenKind::Argument).then(|| self.take());
                Statement::Include { directive, argument }
            }
            _ => Statement::None,
        }
    }

    fn command(&mut self) -> Statement {
        let mnemonic = self.take();
        let form: Option<&'static Form> = mnemonic::find(self.text_of(mnemonic));
        if self.kind() == TokenKind::Comma {
            let comma = self.tree.token_span(self.id());
            let message = format!("a comma behind {}", self.text_of(mnemonic));
            self.report(
                Diagnostic::new(Code::CommaAfterMnemonic, at(comma), message)
                    .help("the first operand follows behind a blank")
                    .replace_with(""),
            );
            self.take();
        }
        Statement::Command { mnemonic, form, operands: self.operands() }
    }

    fn operands(&mut self) -> OperandRange {
        let start = self.tree.operands.len() as u32;
        while !self.ends_statement() {
            let first = self.kind();
            let is_told = !begins_expression(first) && !is_sign(first);
            let expression = self.expression();
            self.tree.operands.push(Operand { expression });
            match self.kind() {
                TokenKind::Comma => {
                    self.take();
                    if self.ends_statement() {
                        let expression = self.missing_operand();
                        self.tree.operands.push(Operand { expression });
                    }
                }
                _ if self.ends_statement() => {}
                _ if is_told => self.pass_comma(),
                kind if begins_expression(kind) => {
                    let between = self.tree.token_span(self.id());
                    let message = "a comma is missing between two operands";
                    self.report(
                        Diagnostic::new(Code::MissingComma, at(between), message)
                            .help("operands stand apart from each other by commas"),
                    );
                }
                _ => {
                    self.unexpected();
                    self.pass_comma();
                }
            }
        }
        OperandRange { start, end: self.tree.operands.len() as u32 }
    }

    /// Passes over what an operand cannot hold, and the comma behind it.
    fn pass_comma(&mut self) {
        while !self.ends_statement() && self.kind() != TokenKind::Comma {
            self.take();
        }
        if self.kind() == TokenKind::Comma {
            self.take();
        }
    }

    fn missing_operand(&mut self) -> ExpressionId {
        let location = at(self.empty_span());
        self.report(Diagnostic::new(Code::MissingOperand, location, "an operand is missing here"));
        self.error_expression()
    }

    /// Whatever is left on the line does not belong there.
    fn end_of_statement(&mut self, statement: &Statement) {
        if self.ends_statement() {
            return;
        }
        match statement {
            // Text that was not understood has been told already.
            &Statement::Constant { value, .. }
                if self.tree.expression(value).kind == ExpressionKind::Error => {}
            Statement::Constant { .. } if begins_expression(self.kind()) => {
                let location = at(self.tree.token_span(self.id()));
                let message = "a constant has one value; an operator is missing here";
                self.report(Diagnostic::new(Code::UnexpectedText, location, message));
            }
            _ => self.unexpected(),
        }
        while !self.ends_statement() {
            self.take();
        }
    }

    fn unexpected(&mut self) {
        let span = self.tree.token_span(self.id());
        let text = span.of(&self.tree.text);
        let message = match self.kind() {
            TokenKind::Unknown if text.chars().all(char::is_control) => {
                let code = text.chars().next().map_or(0, u32::from);
                format!("a control character (${code:02X}) that has no meaning here")
            }
            TokenKind::Colon => "a colon without a label in front of it".into(),
            TokenKind::Equals => "an equals sign without a constant in front of it".into(),
            _ => format!("{text:?} is not expected here"),
        };
        let diagnostic = Diagnostic::new(Code::UnexpectedText, at(span), message);
        let help = match (self.kind(), text) {
            (TokenKind::Colon, _) => Some("a label begins with a letter or `_`: Loop1:"),
            (TokenKind::Unknown, "'" | "!" | "\\" | "\"" | "{" | "[") => {
                Some("a comment begins with // and goes to the end of the line")
            }
            (TokenKind::Star | TokenKind::Slash, _) => {
                Some("a comment begins with // and goes to the end of the line; there is no /* */")
            }
            _ => None,
        };
        self.report(match help {
            Some(help) => diagnostic.help(help),
            None => diagnostic,
        });
    }

    /// Whether a further finding would be told.
    fn has_room(&self) -> bool {
        self.tree.diagnostics.len() < MAX_DIAGNOSTICS
    }

    fn report(&mut self, diagnostic: Diagnostic) {
        if self.has_room() {
            self.tree.diagnostics.push(diagnostic);
        }
    }

    fn push(&mut self, kind: ExpressionKind, first: TokenId, last: TokenId) -> ExpressionId {
        let id = ExpressionId(self.tree.expressions.len() as u32);
        self.tree.expressions.push(Expression { kind, first, last });
        id
    }

    /// An expression that is not there: its first token is the one behind its last.
    fn error_expression(&mut self) -> ExpressionId {
        let id = self.id();
        self.push(ExpressionKind::Error, TokenId(id.0 + 1), id)
    }

    /// The place just behind the last token that shows something.
    fn empty_span(&self) -> Span {
        let TokenId(behind) = self.without_blanks(self.id());
        let start = self.tree.tokens[behind as usize].start;
        Span::new(start, start)
    }

    /// The first of the blanks in front of a token, or the token itself.
    fn without_blanks(&self, TokenId(mut token): TokenId) -> TokenId {
        while token > 0 && self.tree.kind(TokenId(token - 1)) == TokenKind::Blank {
            token -= 1;
        }
        TokenId(token)
    }
}

/// A place in the file that is being read; whoever puts files together knows which one it is.
fn at(span: Span) -> Location {
    Location { file: FileId(0), span }
}

/// Whether an expression begins with this token; behind another expression a sign is an operator.
fn begins_expression(kind: TokenKind) -> bool {
    matches!(kind, TokenKind::Name | TokenKind::Number | TokenKind::Open)
}

fn is_sign(kind: TokenKind) -> bool {
    matches!(kind, TokenKind::Plus | TokenKind::Minus)
}
