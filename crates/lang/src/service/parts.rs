//! What each token of a line is, once all names are known.

use opentmcl_wire::opcode::{Form, Meaning, Operand};

use crate::assembly::Assembly;
use crate::diagnostic::{FileId, Location};
use crate::expression::Function;
use crate::span::Span;
use crate::token::TokenKind;
use crate::tree::{Line, Operand as TreeOperand, Statement, TokenId, Tree};

/// A token that means something.
#[derive(Clone, Copy, Debug)]
pub(super) struct Part {
    pub(super) token: TokenId,
    pub(super) role: Role,
    /// The operand that it belongs to, counted from 0.
    pub(super) operand: Option<usize>,
}

/// What a token is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Role {
    Mnemonic(Option<&'static Form>),
    /// The number of a command in place of its mnemonic.
    CommandNumber,
    /// A word of an operand, and its number.
    Keyword(&'static Operand, u8),
    LabelDefinition,
    Label,
    ConstantDefinition,
    Constant,
    Function(Option<Function>),
    Number,
    Comment,
    Operator,
    Directive,
    IncludeName,
}

/// The parts of a line, in order.
pub(super) fn parts(assembly: &Assembly, file: FileId, line: &Line) -> Vec<Part> {
    let tree = &assembly.file(file).tree;
    let mut reader = Reader { assembly, tree, line, form: form(line), operand: None, call: 0 };
    let tokens = line.tokens.clone().map(TokenId);
    tokens.filter_map(|token| reader.part(token)).collect()
}

/// The part that a cursor at this offset touches; the one behind it if it stands between two.
pub(super) fn part_at(assembly: &Assembly, file: FileId, offset: u32) -> Option<(&Line, Part)> {
    let tree = &assembly.file(file).tree;
    let line = tree.lines().get(tree.line_at(offset))?;
    let touches = |part: &Part| tree.token_span(part.token).touches(offset);
    let touched = parts(assembly, file, line).into_iter().filter(touches);
    // Of a name and the comma behind it, the name is meant.
    let part = touched.min_by_key(|part| part.role == Role::Operator)?;
    Some((line, part))
}

/// The form of the command of a line.
pub(super) fn form(line: &Line) -> Option<&'static Form> {
    match line.statement {
        Statement::Command { form, .. } => form,
        _ => None,
    }
}

/// Where a part is.
pub(super) fn span(assembly: &Assembly, file: FileId, part: &Part) -> Span {
    assembly.file(file).tree.token_span(part.token)
}

/// Where a part is, with its file.
pub(super) fn location(assembly: &Assembly, file: FileId, part: &Part) -> Location {
    Location { file, span: span(assembly, file, part) }
}

struct Reader<'a> {
    assembly: &'a Assembly,
    tree: &'a Tree,
    line: &'a Line,
    form: Option<&'static Form>,
    /// The operand that is being read.
    operand: Option<usize>,
    /// How many parentheses are open since a function's name.
    call: u32,
}

impl Reader<'_> {
    fn part(&mut self, token: TokenId) -> Option<Part> {
        let operand = self.operand_of(token);
        let role = self.role(token, operand)?;
        Some(Part { token, role, operand })
    }

    fn operand_of(&mut self, token: TokenId) -> Option<usize> {
        let operands = self.tree.operands_of(self.line);
        let expression = |operand: &TreeOperand| self.tree.expression(operand.expression);
        let begun = operands.partition_point(|operand| expression(operand).first <= token);
        let last = begun.checked_sub(1)?;
        let found = operands.get(last).filter(|&operand| token <= expression(operand).last);
        let found = found.map(|_| last);
        if found != self.operand {
            self.operand = found;
            self.call = 0;
        }
        found
    }

    fn role(&mut self, token: TokenId, operand: Option<usize>) -> Option<Role> {
        Some(match self.tree.kind(token) {
            TokenKind::Name => self.name(token, operand),
            TokenKind::Number => match self.line.statement {
                Statement::Numbered { number, .. } if number == token => Role::CommandNumber,
                _ => Role::Number,
            },
            TokenKind::Comment => Role::Comment,
            TokenKind::Directive => Role::Directive,
            TokenKind::Argument => Role::IncludeName,
            TokenKind::Open => {
                self.call += u32::from(self.call > 0);
                Role::Operator
            }
            TokenKind::Close => {
                // The function's own parenthesis is the second of what its name began.
                self.call = if self.call <= 2 { 0 } else { self.call - 1 };
                Role::Operator
            }
            TokenKind::Comma
            | TokenKind::Colon
            | TokenKind::Equals
            | TokenKind::Plus
            | TokenKind::Minus
            | TokenKind::Star
            | TokenKind::Slash
            | TokenKind::Caret => Role::Operator,
            TokenKind::Blank | TokenKind::Newline | TokenKind::Unknown | TokenKind::End => {
                return None;
            }
        })
    }

    fn name(&mut self, token: TokenId, operand: Option<usize>) -> Role {
        if self.tree.labels(self.line).binary_search(&token).is_ok() {
            return Role::LabelDefinition;
        }
        match self.line.statement {
            Statement::Command { mnemonic, form, .. } if mnemonic == token => {
                return Role::Mnemonic(form);
            }
            Statement::Constant { name, .. } if name == token => return Role::ConstantDefinition,
            _ => {}
        }
        let text = self.tree.token_text(token);
        if self.kind_behind(token) == TokenKind::Open {
            self.call = self.call.max(1);
            return Role::Function(Function::find(text));
        }
        let meant = operand.and_then(|at| self.form?.operands.get(at));
        let is_alone = operand.is_some_and(|at| {
            let operands = self.tree.operands_of(self.line);
            operands.get(at).is_some_and(|it| self.tree.name(it.expression).is_some())
        });
        if let Some(operand) = meant.filter(|_| is_alone)
            && let Some(&(_, number)) =
                operand.words.iter().find(|(word, _)| word.eq_ignore_ascii_case(text))
        {
            return Role::Keyword(operand, number);
        }
        let address = self.call == 0 && meant.is_some_and(|it| it.meaning == Meaning::Address);
        let label = self.assembly.label(text).is_some();
        let constant = self.assembly.constant(text).is_some();
        // As the assembler looks for it: labels first where an address is wanted, last elsewhere.
        match (address, label, constant) {
            (true, true, _) | (true, _, false) | (false, true, false) => Role::Label,
            (true, false, true) | (false, ..) => Role::Constant,
        }
    }

    fn kind_behind(&self, token: TokenId) -> TokenKind {
        let behind = (token.0 + 1..self.line.tokens.end).map(|at| self.tree.kind(TokenId(at)));
        behind.into_iter().find(|&kind| kind != TokenKind::Blank).unwrap_or(TokenKind::End)
    }
}
