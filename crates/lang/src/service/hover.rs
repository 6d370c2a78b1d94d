//! What something is.

use core::fmt::Write;

use super::describe::command_markdown;
use super::parts::{Part, Role, form, part_at, span};
use super::{Service, keywords};
use crate::diagnostic::{FileId, Location};
use crate::expression::Function;
use crate::number;
use crate::span::Span;
use crate::tree::{Line, Statement};

/// What is said about a part of the text.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Hover {
    /// The part.
    pub span: Span,
    /// What it is, in Markdown.
    pub markdown: String,
}

impl Service<'_> {
    /// What is at this offset.
    pub fn hover(&self, file: FileId, offset: u32) -> Option<Hover> {
        let (line, part) = part_at(self.assembly, file, offset)?;
        let span = span(self.assembly, file, &part);
        let own = self.of_part(file, line, &part);
        let operand = part.operand.and_then(|operand| self.of_operand(file, line, operand));
        // Within a calculation the part is of more interest than what comes out.
        let sections = [operand, own].into_iter().flatten().collect::<Vec<_>>();
        let markdown = sections.join("\n\n---\n\n");
        (!markdown.is_empty()).then_some(Hover { span, markdown })
    }

    fn of_part(&self, file: FileId, line: &Line, part: &Part) -> Option<String> {
        let tree = &self.assembly.file(file).tree;
        let text = tree.token_text(part.token);
        match part.role {
            Role::Mnemonic(_) | Role::CommandNumber => {
                let form = self.form_of(file, line)?;
                Some(command_markdown(self.module, form))
            }
            Role::Keyword(operand, number) => {
                let (word, _) = operand.words.iter().find(|&&(_, other)| other == number)?;
                let meaning = keywords::meaning(operand.name, word)?;
                Some(format!("**{word}**, {} {number}\n\n{meaning}", operand.name))
            }
            Role::LabelDefinition | Role::Label => self.of_label(text),
            Role::ConstantDefinition | Role::Constant => self.of_constant(file, text),
            Role::Function(function) => function.map(of_function),
            Role::Number => of_number(text),
            Role::IncludeName => self.of_file(file, tree.token_span(part.token).start),
            Role::Comment | Role::Operator | Role::Directive => None,
        }
    }

    /// What the operand as a whole stands for on the module.
    fn of_operand(&self, file: FileId, line: &Line, operand: usize) -> Option<String> {
        form(line)?;
        let module = self.module?;
        if let Some(subject) = self.subject(file, line, operand) {
            return Some(subject.markdown(module));
        }
        let subject = self.governed_by(file, line, operand)?;
        subject.value_markdown(self.operand_value(file, line, operand))
    }

    fn of_label(&self, name: &str) -> Option<String> {
        let label = self.assembly.label(name)?;
        let mut text = format!("```tmcl\n{}:\n```\nAddress {}", label.name, label.address);
        self.add_comment(&mut text, label.location);
        Some(text)
    }

    fn of_constant(&self, file: FileId, name: &str) -> Option<String> {
        let constant = self.assembly.constant(name)?;
        let defined = self.assembly.file(constant.location.file);
        let tree = &defined.tree;
        let line = tree.lines().get(tree.line_at(constant.location.span.start))?;
        let mut text = format!("```tmcl\n{}\n```", tree.statement_span(line).of(tree.text()));
        match constant.value {
            Some(value) if value.fract() == 0.0 => {
                let _ = write!(text, "\n{}", shown(value));
            }
            Some(value) => {
                let _ = write!(text, "\n{}, used as {}", shown(value), libm::round(value));
            }
            None => text.push_str("\nIt has no value."),
        }
        self.add_comment(&mut text, constant.location);
        if constant.location.file != file {
            let _ = write!(text, "\n\nDefined in {}", base_name(&defined.name));
        }
        Some(text)
    }

    /// Adds what the author has written behind a definition.
    fn add_comment(&self, text: &mut String, definition: Location) {
        let tree = &self.assembly.file(definition.file).tree;
        let line = tree.lines().get(tree.line_at(definition.span.start));
        let Some(comment) = line.and_then(|line| tree.comment(line)) else { return };
        let comment = tree.token_text(comment).trim_start_matches(['/', ';']).trim();
        if !comment.is_empty() {
            let _ = write!(text, "\n\n{comment}");
        }
    }

    fn of_file(&self, file: FileId, offset: u32) -> Option<String> {
        let file = self.assembly.file(self.included_at(file, offset)?);
        let constants = |statement: &Statement| matches!(statement, Statement::Constant { .. });
        let lines = file.tree.lines();
        let constants = lines.iter().filter(|line| constants(&line.statement)).count();
        let origin = if file.built_in { "a file that comes with the tools" } else { "a file" };
        let plural = if constants == 1 { "" } else { "s" };
        Some(format!("**{}**, {origin} with {constants} constant{plural}", file.name))
    }
}

fn of_function(function: Function) -> String {
    format!("```tmcl\n{}(x)\n```\n{}", function.name(), function.description())
}

/// A number in the notations in which it is not written.
fn of_number(text: &str) -> Option<String> {
    let value = number::value(text)?;
    if value.fract() != 0.0 || value > f64::from(u32::MAX) {
        return Some(shown(value));
    }
    let bits = value as u32;
    let mut all = format!("{bits} = ${bits:X}");
    if text.starts_with('%') || bits <= 0xFF {
        let _ = write!(all, " = %{bits:b}");
    }
    // All 32 bits may be written without a sign.
    let signed = bits.cast_signed();
    if signed < 0 {
        let _ = write!(all, " = {signed} as a signed value");
    }
    Some(all)
}

/// A value as people write it.
pub(super) fn shown(value: f64) -> String {
    // What is left of the binary representation behind so many digits is of no interest.
    let rounded = libm::round(value * 1e9) / 1e9;
    if rounded.is_finite() { rounded.to_string() } else { value.to_string() }
}

/// The last part of a file's path.
pub(super) fn base_name(name: &str) -> &str {
    name.rsplit(['/', '\\']).next().unwrap_or(name)
}
