//! Expressions, by precedence.
//!
//! As in BASIC, to which the vendor's manual compares them: `^` binds closer than a sign (`-2^2` is
//! -4), `*` and `/` closer than `+` and `-`, and operators of the same rank go from left to right.

use crate::diagnostic::{Code, Diagnostic};
use crate::expression::Function;
use crate::number;
use crate::suggest::nearest;
use crate::token::TokenKind;
use crate::tree::{BinaryOperator, ExpressionId, ExpressionKind, TokenId};

use super::{Parser, at};

/// How deeply parentheses, functions and signs may be nested: enough for any person, and little
/// enough for any stack.
const MAX_DEPTH: u32 = 100;

impl Parser {
    pub(super) fn expression(&mut self) -> ExpressionId {
        // Nearly always an operand is one number or one name.
        let single = matches!(self.kind(), TokenKind::Number | TokenKind::Name)
            && matches!(
                self.kind_behind(),
                TokenKind::Comma | TokenKind::Newline | TokenKind::Comment | TokenKind::End
            );
        if single { self.primary() } else { self.sum() }
    }

    fn sum(&mut self) -> ExpressionId {
        let mut left = self.product();
        loop {
            let operator = match self.kind() {
                TokenKind::Plus => BinaryOperator::Add,
                TokenKind::Minus => BinaryOperator::Subtract,
                _ => return left,
            };
            self.take();
            let right = self.product();
            left = self.binary(operator, left, right);
        }
    }

    fn product(&mut self) -> ExpressionId {
        let mut left = self.signed();
        loop {
            let operator = match self.kind() {
                TokenKind::Star => BinaryOperator::Multiply,
                TokenKind::Slash => BinaryOperator::Divide,
                _ => return left,
            };
            self.take();
            let right = self.signed();
            left = self.binary(operator, left, right);
        }
    }

    fn signed(&mut self) -> ExpressionId {
        let negative = match self.kind() {
            TokenKind::Minus => true,
            TokenKind::Plus => false,
            _ => return self.power(),
        };
        let first = self.take();
        let value = self.nested(Self::signed);
        let last = self.last_of(value);
        let kind =
            if negative { ExpressionKind::Negate(value) } else { ExpressionKind::Same(value) };
        self.push(kind, first, last)
    }

    fn power(&mut self) -> ExpressionId {
        let mut left = self.primary();
        while self.kind() == TokenKind::Caret {
            self.take();
            // An exponent may have a sign of its own.
            let signed = matches!(self.kind(), TokenKind::Minus | TokenKind::Plus);
            let right = if signed { self.signed_exponent() } else { self.primary() };
            left = self.binary(BinaryOperator::Power, left, right);
        }
        left
    }

    fn signed_exponent(&mut self) -> ExpressionId {
        let negative = self.kind() == TokenKind::Minus;
        let first = self.take();
        let value = self.primary();
        let last = self.last_of(value);
        let kind =
            if negative { ExpressionKind::Negate(value) } else { ExpressionKind::Same(value) };
        self.push(kind, first, last)
    }

    fn primary(&mut self) -> ExpressionId {
        match self.kind() {
            TokenKind::Number => self.number(),
            TokenKind::Name if self.kind_behind() == TokenKind::Open => self.call(),
            TokenKind::Name => {
                let token = self.take();
                self.push(ExpressionKind::Name, token, token)
            }
            TokenKind::Open => {
                let first = self.take();
                self.parenthesized(first, ExpressionKind::Same)
            }
            TokenKind::Comma => self.missing_operand(),
            _ if self.ends_statement() => {
                let location = at(self.empty_span());
                let message = "a value is missing here";
                self.report(Diagnostic::new(Code::MissingOperand, location, message));
                self.error_expression()
            }
            _ => {
                self.unexpected();
                let token = self.take();
                self.push(ExpressionKind::Error, token, token)
            }
        }
    }

    fn number(&mut self) -> ExpressionId {
        let token = self.take();
        let text = self.text_of(token);
        let kind = match number::value(text) {
            Some(value) => ExpressionKind::Number(value),
            None => {
                let message = format!("{text:?} is not a number");
                let location = at(self.tree.token_span(token));
                self.report(Diagnostic::new(Code::BadNumber, location, message).help(
                    "numbers are decimal (51200), hexadecimal ($C800 or 0xC800, up to 32 bits) or \
                     binary (%1010)",
                ));
                ExpressionKind::Error
            }
        };
        self.push(kind, token, token)
    }

    fn call(&mut self) -> ExpressionId {
        let first = self.take();
        let name = self.text_of(first);
        let function = Function::find(name);
        if function.is_none() && self.has_room() {
            let names = Function::ALL.iter().map(|function| function.name());
            let near = nearest(name, names).map(str::to_owned);
            let message = format!("there is no function {name:?}");
            let diagnostic =
                Diagnostic::new(Code::UnknownFunction, at(self.tree.token_span(first)), message);
            self.report(match near {
                Some(near) => diagnostic.help(format!("did you mean {near}?")).replace_with(near),
                None => diagnostic.help(
                    "the functions are SIN COS TAN ASIN ACOS ATAN LOG LN EXP SQRT ABS INT ROUND \
                     SIGN DEG RAD",
                ),
            });
        }
        self.take();
        self.parenthesized(first, |argument| match function {
            Some(function) => ExpressionKind::Call(function, argument),
            None => ExpressionKind::Error,
        })
    }

    /// What follows `(`, which has been taken, up to `)`.
    fn parenthesized(
        &mut self,
        first: TokenId,
        kind: impl FnOnce(ExpressionId) -> ExpressionKind,
    ) -> ExpressionId {
        let inner = self.nested(Self::sum);
        if self.kind() == TokenKind::Close {
            let last = self.take();
            return self.push(kind(inner), first, last);
        }
        // Text that was not understood has been told already.
        let is_told = self.tree.expression(inner).kind == ExpressionKind::Error;
        if is_told && self.ends_statement() {
            return self.push(ExpressionKind::Error, first, self.last_of(inner));
        }
        if self.ends_statement() || self.kind() == TokenKind::Comma {
            let location = at(self.empty_span());
            let message = "a parenthesis is not closed";
            self.report(
                Diagnostic::new(Code::UnclosedParenthesis, location, message)
                    .help("write ) here")
                    .replace_with(")"),
            );
        } else {
            self.unexpected();
            while !self.ends_statement() && self.kind() != TokenKind::Comma {
                self.take();
            }
        }
        let last = self.last_of(inner);
        self.push(ExpressionKind::Error, first, last)
    }

    fn nested(&mut self, read: impl FnOnce(&mut Self) -> ExpressionId) -> ExpressionId {
        if self.depth == MAX_DEPTH {
            let location = at(self.tree.token_span(self.id()));
            let message = format!("the expression is nested more than {MAX_DEPTH} deep");
            self.report(
                Diagnostic::new(Code::NestedTooDeeply, location, message)
                    .help("give a part of it a name: Part = …"),
            );
            while !self.ends_statement() {
                self.take();
            }
            return self.error_expression();
        }
        self.depth += 1;
        let id = read(self);
        self.depth -= 1;
        id
    }

    /// The last token of an expression; for a missing one, the last in front of it that shows
    /// something.
    fn last_of(&self, id: ExpressionId) -> TokenId {
        let expression = self.tree.expression(id);
        if expression.first > expression.last {
            return TokenId(self.without_blanks(expression.last).0.saturating_sub(1));
        }
        expression.last
    }

    fn binary(
        &mut self,
        operator: BinaryOperator,
        left: ExpressionId,
        right: ExpressionId,
    ) -> ExpressionId {
        let first = self.tree.expression(left).first;
        let last = self.last_of(right);
        self.push(ExpressionKind::Binary(operator, left, right), first, last)
    }
}
