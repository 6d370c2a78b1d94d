//! One command and what is written for its operands.

use opentmcl_wire::Command;
use opentmcl_wire::mnemonic::RAW_OPERANDS;
use opentmcl_wire::opcode::{Field, Form, form};

use crate::assembly::{Assembly, Instruction};
use crate::diagnostic::{FileId, Location};
use crate::tree::{Statement, Tree};

/// The longest operand that a message repeats.
const MAX_SHOWN: usize = 40;

/// A command that stands in a file and has been understood.
#[derive(Clone, Copy)]
pub(super) struct Subject<'a> {
    pub(super) command: Command,
    /// None if the language has no such command.
    pub(super) form: Option<&'static Form>,
    file: FileId,
    tree: &'a Tree,
    line: &'a crate::tree::Line,
}

impl<'a> Subject<'a> {
    /// `None` if the assembler has added the command, or has told that it does not understand it.
    pub(super) fn new(assembly: &'a Assembly, instruction: &Instruction) -> Option<Self> {
        let place = instruction.place?;
        let line = assembly.line(place)?;
        let command = instruction.command;
        let is_damaged =
            command.number == 0 && !matches!(line.statement, Statement::Numbered { .. });
        let tree = &assembly.file(place.file).tree;
        let form = form(command.number);
        (!is_damaged).then_some(Self { command, form, file: place.file, tree, line })
    }

    /// Where the whole command is.
    pub(super) fn location(&self) -> Location {
        Location { file: self.file, span: self.tree.statement_span(self.line) }
    }

    /// Where its mnemonic or number is.
    pub(super) fn head(&self) -> Location {
        let span = match self.line.statement {
            Statement::Command { mnemonic: head, .. }
            | Statement::Numbered { number: head, .. } => self.tree.token_span(head),
            _ => self.tree.statement_span(self.line),
        };
        Location { file: self.file, span }
    }

    /// The command's mnemonic, or its number if it has none.
    pub(super) fn name(&self) -> String {
        match self.form {
            Some(form) => form.mnemonic.to_owned(),
            None => self.command.number.to_string(),
        }
    }

    /// Where the operand for a field is; the whole command if none is written.
    pub(super) fn operand(&self, field: Field) -> Location {
        let operands = match self.line.statement {
            Statement::Command { form: Some(form), .. } => form.operands,
            _ => &RAW_OPERANDS[..],
        };
        let at = operands.iter().position(|operand| operand.field == field);
        let written = at.and_then(|at| self.tree.operands_of(self.line).get(at));
        match written {
            Some(operand) => {
                let span = self.tree.expression_span(operand.expression);
                Location { file: self.file, span }
            }
            None => self.location(),
        }
    }

    /// A number as the operand of a field gives it, with what is written for it if that is something
    /// else: `7 (Motor7)`.
    pub(super) fn shown(&self, field: Field) -> String {
        let number = match field {
            Field::Kind => i64::from(self.command.kind),
            Field::Motor => i64::from(self.command.motor),
            Field::Value => i64::from(self.command.value),
        };
        let number = number.to_string();
        let operand = self.operand(field);
        let written = operand.span.of(self.tree.text());
        let explains =
            written != number && written.len() <= MAX_SHOWN && operand != self.location();
        if explains { format!("{number} ({written})") } else { number }
    }
}
