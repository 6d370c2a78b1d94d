//! One line to one command, with all names known.

use opentmcl_wire::mnemonic::RAW_OPERANDS;
use opentmcl_wire::opcode::{FORMS, Field, Form, Meaning, Operand, form};
use opentmcl_wire::{Command, Opcode};

use crate::assembly::Place;
use crate::constants::{Evaluator, Purpose};
use crate::diagnostic::{Code, Diagnostic, FileId, Fix, Location};
use crate::mnemonic;
use crate::names::Trees;
use crate::span::Span;
use crate::suggest::nearest;
use crate::tree::{ExpressionId, ExpressionKind, Line, Statement, TokenId, Tree};

/// Makes commands of lines.
pub(crate) struct Encoder<'a> {
    evaluator: Evaluator<'a>,
}

/// A command that is being encoded.
#[derive(Clone, Copy)]
struct Subject<'a> {
    file: FileId,
    tree: &'a Tree,
    line: &'a Line,
    /// None for a command by its number.
    form: Option<&'static Form>,
}

impl<'a> Encoder<'a> {
    pub(crate) fn new(evaluator: Evaluator<'a>) -> Self {
        Self { evaluator }
    }

    fn tree(&self, file: FileId) -> &Tree {
        self.evaluator.files.tree(file)
    }

    /// Computes all constants, used or not, in the order of their definitions: most depend on
    /// earlier ones only.
    pub(crate) fn constants(&mut self, redefined: &[(usize, FileId, TokenId, ExpressionId)]) {
        for at in 0..self.evaluator.constants.entries().len() {
            self.evaluator.constant(at, None);
        }
        for &(at, file, token, expression) in redefined {
            let first = self.evaluator.constant(at, None);
            let second = self.evaluator.value(file, expression, Purpose::Number);
            let (Some(first), Some(second)) = (first, second) else { continue };
            // The same definition in two included files does no harm.
            if first == second {
                continue;
            }
            let entry = &self.evaluator.constants.entries()[at];
            let span = self.tree(entry.file).token_span(entry.token);
            let definition = Location { file: entry.file, span };
            let tree = self.tree(file);
            let name = tree.token_text(token);
            let message = format!("{name} is defined as {second} here and as {first} before");
            let location = Location { file, span: tree.token_span(token) };
            self.evaluator.report(
                Diagnostic::new(Code::RedefinedConstant, location, message)
                    .help("a constant has one value in the whole program; use two names")
                    .related(definition, "the first definition is here"),
            );
        }
    }

    /// The command of a line; `None` if it has mistakes, which have then been told.
    pub(crate) fn encode(&mut self, place: Place) -> Option<Command> {
        let files = self.evaluator.files;
        let tree = files.tree(place.file);
        let line = tree.lines().get(place.line as usize)?;
        match line.statement {
            Statement::Command { mnemonic, form, .. } => {
                let Some(form) = form else {
                    self.unknown_command(place.file, tree, mnemonic);
                    return None;
                };
                let subject = Subject { file: place.file, tree, line, form: Some(form) };
                self.operands(subject, form.opcode.number())
            }
            Statement::Numbered { number, .. } => {
                let value = crate::number::value(tree.token_text(number));
                let whole = value.filter(|value| value.fract() == 0.0 && *value <= 255.0);
                let Some(whole) = whole else {
                    let text = tree.token_text(number);
                    let location = Location { file: place.file, span: tree.token_span(number) };
                    let message = format!("{text} is not the number of a command");
                    self.evaluator.report(
                        Diagnostic::new(Code::UnknownCommand, location, message)
                            .help("a command is a mnemonic or a number in 0..255"),
                    );
                    return None;
                };
                let subject = Subject { file: place.file, tree, line, form: None };
                self.operands(subject, whole as u8)
            }
            _ => None,
        }
    }

    fn unknown_command(&mut self, file: FileId, tree: &Tree, token: TokenId) {
        if !self.evaluator.has_room() {
            return;
        }
        let name = tree.token_text(token);
        let location = Location { file, span: tree.token_span(token) };
        let message = format!("there is no command {name}");
        let diagnostic = Diagnostic::new(Code::UnknownCommand, location, message);
        self.evaluator.report(match mnemonic::probably(name) {
            Some(near) => diagnostic.help(format!("did you mean {near}?")).replace_with(near),
            None => diagnostic.help(
                "a label ends with a colon, and a constant is defined by a line Name = value",
            ),
        });
    }

    fn operands(&mut self, subject: Subject<'_>, number: u8) -> Option<Command> {
        let Subject { tree, line, form, .. } = subject;
        let wanted = form.map_or(&RAW_OPERANDS[..], |form| form.operands);
        let surplus = form.and_then(Form::surplus);
        let written = tree.operands_of(line);
        let is_damaged = |operand: &crate::tree::Operand| {
            tree.expression(operand.expression).kind == ExpressionKind::Error
        };
        if written.len() != wanted.len() && written.iter().any(is_damaged) {
            // Text that was not understood has been told; what it would count for nobody knows.
            return None;
        }
        if written.len() < wanted.len() && !self.may_end_early(subject) {
            // Nobody knows which one is missing: the others are not looked at.
            self.missing(subject, wanted.len());
            return None;
        }
        let mut command = Command::new(number, 0, 0, 0);
        let mut complete = true;
        for (operand, written) in wanted.iter().chain(&surplus).zip(written) {
            match self.operand(subject, operand, written.expression) {
                Some(value) => fill(&mut command, operand.field, value),
                None => complete = false,
            }
        }
        if let Some(extra) = written.get(wanted.len() + usize::from(surplus.is_some())) {
            self.extra(subject, wanted.len(), tree.expression_span(extra.expression));
            complete = false;
        }
        complete.then_some(command)
    }

    /// Whether the last operand is missing, and may be.
    fn may_end_early(&mut self, subject: Subject<'_>) -> bool {
        let Subject { tree, line, form: Some(form), .. } = subject else { return false };
        let ([first], [choice, _]) = (tree.operands_of(line), form.operands) else { return false };
        let word = tree
            .name(first.expression)
            .and_then(|name| choice.words.iter().find(|(word, _)| word.eq_ignore_ascii_case(name)));
        word.is_some_and(|&(_, kind)| form.may_end_early(kind))
    }

    fn missing(&mut self, subject: Subject<'_>, wanted: usize) {
        let Subject { file, tree, line, form } = subject;
        let end = tree.statement_span(line).end;
        let location = Location { file, span: Span::new(end, end) };
        let message = format!("{} takes {}", subject.head(), count(wanted, subject.written()));
        let mut help = usage(form);
        let mut fix = None;
        let opcode = form.map(|form| form.opcode);
        if opcode == Some(Opcode::Call) && subject.written() == 1 {
            let text = tree.expression_span(tree.operands_of(line)[0].expression).of(tree.text());
            help = format!("CSUB {text} calls without a condition");
            fix = subject
                .mnemonic()
                .map(|token| Fix { span: tree.token_span(token), replacement: "CSUB".into() });
        } else if opcode == Some(Opcode::Calc) {
            help += "; CALCX calculates with the X register and takes no value";
        }
        let diagnostic = Diagnostic::new(Code::MissingOperand, location, message).help(help);
        self.evaluator.report(Diagnostic { fix, ..diagnostic });
    }

    fn extra(&mut self, subject: Subject<'_>, wanted: usize, span: Span) {
        let location = Location { file: subject.file, span };
        let message = format!("{} takes {}", subject.head(), count(wanted, subject.written()));
        let mut help = usage(subject.form);
        let takes_value = subject.form.and_then(|form| with_value(form.opcode));
        if let Some(other) = takes_value.and_then(|other| form(other.number())) {
            help += &format!("; with a value of your own, {other}");
        }
        self.evaluator.report(Diagnostic::new(Code::ExtraOperand, location, message).help(help));
    }

    /// The value of an operand, rounded and within the range of its field.
    fn operand(
        &mut self,
        subject: Subject<'_>,
        operand: &Operand,
        expression: ExpressionId,
    ) -> Option<i64> {
        let Subject { file, tree, .. } = subject;
        let purpose = match operand.meaning {
            Meaning::Address => Purpose::Address,
            _ => Purpose::Number,
        };
        let kind = tree.expression(expression).kind;
        let value = match (kind, tree.name(expression)) {
            (ExpressionKind::Number(value), _) => value,
            (_, Some(name)) => {
                let word = operand.words.iter().find(|(word, _)| word.eq_ignore_ascii_case(name));
                if let Some(&(_, value)) = word {
                    return Some(i64::from(value));
                }
                match self.evaluator.known_name(file, expression, purpose) {
                    Some(value) => value?,
                    None if self.is_misplaced(subject, operand, expression, name) => return None,
                    None => self.evaluator.value(file, expression, purpose)?,
                }
            }
            (_, None) => self.evaluator.value(file, expression, purpose)?,
        };
        // Nearly every value is whole already.
        let is_whole = f64::from(value as i32) == value;
        let value = if is_whole { value } else { libm::round(value) };
        let (min, max) = match operand.field {
            Field::Kind | Field::Motor => (0.0, 255.0),
            // All 32 bits may be written without a sign: $FFFFFFFF is -1.
            Field::Value => (f64::from(i32::MIN), f64::from(u32::MAX)),
        };
        if (min..=max).contains(&value) {
            return Some(value as i64);
        }
        let location = Location { file, span: tree.expression_span(expression) };
        let message = format!("the {} is {value}; it must be in {min}..{max}", operand.name);
        self.evaluator.report(Diagnostic::new(Code::ValueTooLarge, location, message));
        None
    }

    /// Tells when a name without a definition is not one of the words that are wanted here, or one that
    /// belongs elsewhere.
    fn is_misplaced(
        &mut self,
        subject: Subject<'_>,
        operand: &Operand,
        expression: ExpressionId,
        name: &str,
    ) -> bool {
        let Subject { file, tree, form, .. } = subject;
        if operand.meaning == Meaning::Address {
            return false;
        }
        let location = Location { file, span: tree.expression_span(expression) };
        if operand.meaning == Meaning::Choice {
            let message = format!("{name} is not {}", with_article(operand.name));
            let diagnostic = Diagnostic::new(Code::UnknownKeyword, location, message);
            let words = || operand.words.iter().map(|&(word, _)| word);
            self.evaluator.report(match nearest(name, words()) {
                Some(near) => diagnostic.help(format!("did you mean {near}?")).replace_with(near),
                None => {
                    let words: Vec<_> = words().collect();
                    diagnostic.help(format!("write one of {}", words.join(", ")))
                }
            });
            return true;
        }
        let has_word = |form: &Form| {
            form.operands.iter().any(|operand| {
                operand.words.iter().any(|(word, _)| word.eq_ignore_ascii_case(name))
            })
        };
        let is_label = self.evaluator.labels.find(name, self.evaluator.files).is_some();
        if is_label || !FORMS.iter().any(has_word) {
            return false;
        }
        let message =
            format!("{name} is a keyword; {} is expected here", with_article(operand.name));
        self.evaluator
            .report(Diagnostic::new(Code::UnknownKeyword, location, message).help(usage(form)));
        true
    }
}

impl<'a> Subject<'a> {
    /// The mnemonic, if there is one.
    fn mnemonic(&self) -> Option<TokenId> {
        match self.line.statement {
            Statement::Command { mnemonic, .. } => Some(mnemonic),
            _ => None,
        }
    }

    /// The mnemonic or number with which the command begins.
    fn head(&self) -> &'a str {
        match self.line.statement {
            Statement::Command { mnemonic: head, .. }
            | Statement::Numbered { number: head, .. } => self.tree.token_text(head),
            _ => "",
        }
    }

    /// How many operands are written.
    fn written(&self) -> usize {
        self.tree.operands_of(self.line).len()
    }
}

fn fill(command: &mut Command, field: Field, value: i64) {
    match field {
        Field::Kind => command.kind = value as u8,
        Field::Motor => command.motor = value as u8,
        // Values above i32 are bit patterns.
        Field::Value => command.value = value as i32,
    }
}

fn count(wanted: usize, written: usize) -> String {
    let plural = if wanted == 1 { "" } else { "s" };
    let are = if written == 1 { "is" } else { "are" };
    match wanted {
        0 => format!("no operand; {written} {are} written"),
        _ => format!("{wanted} operand{plural}; {written} {are} written"),
    }
}

/// How a command is written.
fn usage(form: Option<&Form>) -> String {
    match form {
        Some(form) => format!("write {form}"),
        None => "write <number> <type>, <motor>, <value>".into(),
    }
}

/// The command that does with a value what this one does with the accumulator.
fn with_value(opcode: Opcode) -> Option<Opcode> {
    Some(match opcode {
        Opcode::Aap => Opcode::Sap,
        Opcode::Aapx => Opcode::Sapx,
        Opcode::Agp => Opcode::Sgp,
        Opcode::Aco => Opcode::Sco,
        Opcode::Aiv => Opcode::Siv,
        Opcode::Mvpa => Opcode::Mvp,
        Opcode::Rora => Opcode::Ror,
        Opcode::Rola => Opcode::Rol,
        _ => return None,
    })
}

fn with_article(noun: &str) -> String {
    let article = if noun.starts_with(['a', 'e', 'i', 'o', 'u']) { "an" } else { "a" };
    format!("{article} {noun}")
}
