//! Trees to commands: includes, then addresses and names, then the commands themselves.

use opentmcl_wire::mnemonic::RAW_OPERANDS;
use opentmcl_wire::opcode::{FORMS, Field, Form, Meaning, Operand};
use opentmcl_wire::{Command, Opcode};

use crate::assembly::{Assembly, File, Instruction, Place};
use crate::builtin;
use crate::constants::{Constant, Evaluator, Purpose};
use crate::diagnostic::{Code, Diagnostic, FileId, Location};
use crate::include::{Found, Sources};
use crate::mnemonic;
use crate::names::{Names, Trees};
use crate::parse::{MAX_DIAGNOSTICS, MAX_TEXT};
use crate::span::Span;
use crate::suggest::nearest;
use crate::tree::{ExpressionId, Line, Statement, TokenId, Tree};

/// How many files a program may have, each counted as often as it is included: enough for any
/// program, and an end for files that include each other twice.
const MAX_FILES: usize = 256;

/// What may be wanted differently.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Options {
    /// Whether STOP is added when the last command is not STOP, as the vendor's assembler does.
    pub append_stop: bool,
}

impl Default for Options {
    fn default() -> Self {
        Self { append_stop: true }
    }
}

/// Assembles a program: the text of its main file, known as `name`, and what it includes.
///
/// This never fails: whatever is wrong is among the diagnostics, all of it at once.
pub fn assemble(
    name: &str,
    text: impl Into<String>,
    sources: &mut dyn Sources,
    options: Options,
) -> Assembly {
    let mut collector = Collector {
        sources,
        files: Vec::new(),
        including: Vec::new(),
        text_left: MAX_TEXT,
        instructions: Vec::new(),
        labels: Names::default(),
        constants: Names::default(),
        redefined: Vec::new(),
        diagnostics: Vec::new(),
    };
    let tree = Tree::parse(text);
    collector.add(File { name: name.into(), built_in: false, included_at: None, tree });
    collector.finish(options)
}

/// Goes through all files once and finds out what stands where.
struct Collector<'a> {
    sources: &'a mut dyn Sources,
    files: Vec<File>,
    /// The files that are being read, each included by the one before.
    including: Vec<FileId>,
    /// How much more text will be taken.
    text_left: usize,
    instructions: Vec<Instruction>,
    labels: Names<u32>,
    constants: Names<Constant>,
    /// Second definitions: which constant, where, and the value.
    redefined: Vec<(usize, FileId, TokenId, ExpressionId)>,
    diagnostics: Vec<Diagnostic>,
}

impl Collector<'_> {
    fn report(&mut self, diagnostic: Diagnostic) {
        if self.diagnostics.len() < MAX_DIAGNOSTICS {
            self.diagnostics.push(diagnostic);
        }
    }

    fn add(&mut self, file: File) {
        let id = FileId(self.files.len() as u16);
        self.text_left = self.text_left.saturating_sub(file.tree.text().len());
        let found = file.tree.diagnostics().iter().cloned().map(|mut diagnostic| {
            diagnostic.location.file = id;
            diagnostic
        });
        let room = MAX_DIAGNOSTICS.saturating_sub(self.diagnostics.len());
        self.diagnostics.extend(found.take(room));
        self.instructions.reserve(file.tree.lines().len());
        self.files.push(file);
        self.including.push(id);
        for line in 0..self.files.tree(id).lines().len() {
            self.line(id, line);
        }
        self.including.pop();
    }

    fn line(&mut self, file: FileId, number: usize) {
        let address = self.instructions.len() as u32;
        let tree = self.files.tree(file);
        let line = &tree.lines()[number];
        for at in 0..tree.labels(line).len() {
            self.label(file, number, at, address);
        }
        let tree = self.files.tree(file);
        match tree.lines()[number].statement {
            Statement::None => {}
            Statement::Command { .. } | Statement::Numbered { .. } => {
                let place = Place { file, line: number as u32 };
                let command = Command::default();
                self.instructions.push(Instruction { command, place: Some(place) });
            }
            Statement::Constant { name, value } => {
                let constant = Constant::new(value);
                if let Err(earlier) = self.constants.define(file, name, constant, &self.files) {
                    self.redefined.push((earlier, file, name, value));
                }
            }
            Statement::Include { directive, argument } => self.include(file, directive, argument),
        }
    }

    fn label(&mut self, file: FileId, line: usize, at: usize, address: u32) {
        let tree = self.files.tree(file);
        let token = tree.labels(&tree.lines()[line])[at];
        let Err(earlier) = self.labels.define(file, token, address, &self.files) else { return };
        let name = tree.token_text(token).to_owned();
        let location = Location { file, span: tree.token_span(token) };
        let entry = self.labels.entries()[earlier];
        let span = self.files.tree(entry.file).token_span(entry.token);
        let first = Location { file: entry.file, span };
        self.report(
            Diagnostic::new(Code::DuplicateLabel, location, format!("a second label {name}"))
                .help("case does not matter in labels; give one of them another name")
                .related(first, "the first one is here"),
        );
    }

    fn include(&mut self, file: FileId, directive: TokenId, argument: Option<TokenId>) {
        let tree = self.files.tree(file);
        let word = tree.token_text(directive);
        let location = Location { file, span: tree.token_span(directive) };
        if !word.eq_ignore_ascii_case("#include") {
            let message = format!("there is no directive {word}");
            let diagnostic = Diagnostic::new(Code::UnknownDirective, location, message);
            return self.report(match word.to_ascii_lowercase().as_str() {
                "#define" => diagnostic.help("a constant is defined by a line: Name = value"),
                _ => diagnostic.help("the only directive is #include"),
            });
        }
        let Some(argument) = argument else {
            let message = "#include without the name of a file";
            return self.report(
                Diagnostic::new(Code::IncludeNotFound, location, message)
                    .help("write for example: #include TMCLParam.tmc"),
            );
        };
        let location = Location { file, span: tree.token_span(argument) };
        let name = tree.include_name(argument).to_owned();
        let from = self.files[usize::from(file.0)].name.clone();
        match self.sources.find(&name, &from) {
            Found::File { name: known_as, text } => {
                self.add_included(location, &known_as, text, false);
            }
            Found::Nothing => match builtin::file(&name) {
                Some((known_as, text)) => self.add_included(location, known_as, text.into(), true),
                None => self.not_found(location, &name),
            },
            Found::Unreadable(why) => {
                let message = format!("cannot read {name}: {why}");
                self.report(Diagnostic::new(Code::IncludeNotFound, location, message));
            }
        }
    }

    fn not_found(&mut self, location: Location, name: &str) {
        let message = format!("there is no file {name}");
        let diagnostic = Diagnostic::new(Code::IncludeNotFound, location, message);
        self.report(match nearest(name, builtin::names()) {
            Some(near) => diagnostic.help(format!("did you mean {near}?")).replace_with(near),
            None => diagnostic.help(
                "it is looked for beside the including file, in the include folders, and among \
                 the built-in files",
            ),
        });
    }

    fn add_included(&mut self, location: Location, name: &str, text: String, built_in: bool) {
        let is_open =
            self.including.iter().any(|&open| self.files[usize::from(open.0)].name == name);
        if is_open {
            let message = format!("{name} includes itself");
            return self.report(
                Diagnostic::new(Code::CircularInclude, location, message)
                    .help("remove this line, or move what both need into a file of its own"),
            );
        }
        if self.files.len() >= MAX_FILES || text.len() > self.text_left {
            let message = format!(
                "the program has more than {MAX_FILES} files or {MAX_TEXT} bytes with this one"
            );
            return self.report(Diagnostic::new(Code::TooMuchText, location, message));
        }
        let tree = Tree::parse(text);
        self.add(File { name: name.into(), built_in, included_at: Some(location), tree });
    }

    fn finish(mut self, options: Options) -> Assembly {
        let mut encoder = Encoder {
            evaluator: Evaluator::new(
                &self.files,
                &self.labels,
                &mut self.constants,
                &mut self.diagnostics,
            ),
        };
        encoder.constants(&self.redefined);
        for instruction in &mut self.instructions {
            if let Some(place) = instruction.place {
                instruction.command = encoder.encode(place).unwrap_or_default();
            }
        }
        let stop = Command::new(Opcode::Stop.number(), 0, 0, 0);
        if options.append_stop
            && self.instructions.last().is_none_or(|last| last.command.number != stop.number)
        {
            self.instructions.push(Instruction { command: stop, place: None });
        }
        let diagnostics = &mut self.diagnostics;
        if diagnostics.len() >= MAX_DIAGNOSTICS {
            let last = diagnostics.iter().map(|one| one.location).max().unwrap_or_default();
            let message = format!("there are more than {MAX_DIAGNOSTICS} findings");
            diagnostics.push(Diagnostic::new(Code::TooManyFindings, last, message));
        }
        diagnostics.sort_by_key(|diagnostic| diagnostic.location);
        Assembly {
            files: self.files,
            instructions: self.instructions,
            diagnostics: self.diagnostics,
            labels: self.labels,
            constants: self.constants,
        }
    }
}

/// Makes commands of lines, with all names known.
struct Encoder<'a> {
    evaluator: Evaluator<'a>,
}

impl Encoder<'_> {
    fn tree(&self, file: FileId) -> &Tree {
        self.evaluator.files.tree(file)
    }

    /// Computes all constants, used or not, in the order of their definitions: most depend on
    /// earlier ones only.
    fn constants(&mut self, redefined: &[(usize, FileId, TokenId, ExpressionId)]) {
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
    fn encode(&mut self, place: Place) -> Option<Command> {
        let files = self.evaluator.files;
        let tree = files.tree(place.file);
        let line = tree.lines().get(place.line as usize)?;
        match line.statement {
            Statement::Command { mnemonic, form, .. } => {
                let Some(form) = form else {
                    self.unknown_command(place.file, tree, mnemonic);
                    return None;
                };
                let command = Command::new(form.opcode.number(), 0, 0, 0);
                self.operands(place.file, tree, line, Some(form), command, form.operands)
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
                let command = Command::new(whole as u8, 0, 0, 0);
                self.operands(place.file, tree, line, None, command, &RAW_OPERANDS)
            }
            _ => None,
        }
    }

    fn unknown_command(&mut self, file: FileId, tree: &Tree, token: TokenId) {
        let name = tree.token_text(token);
        let location = Location { file, span: tree.token_span(token) };
        let message = format!("there is no command {name}");
        let diagnostic = Diagnostic::new(Code::UnknownCommand, location, message);
        self.evaluator.proposals += 1;
        self.evaluator.report(match mnemonic::probably(name) {
            Some(near) => diagnostic.help(format!("did you mean {near}?")).replace_with(near),
            None => diagnostic.help(
                "a label ends with a colon, and a constant is defined by a line Name = value",
            ),
        });
    }

    fn operands(
        &mut self,
        file: FileId,
        tree: &Tree,
        line: &Line,
        form: Option<&Form>,
        mut command: Command,
        wanted: &[Operand],
    ) -> Option<Command> {
        let written = tree.operands_of(line);
        let mut complete = true;
        for (operand, written) in wanted.iter().zip(written) {
            let value = self.operand(file, tree, form, operand, written.expression);
            complete &= value.is_some_and(|value| fill(&mut command, operand.field, value));
        }
        if let Some(missing) = wanted.get(written.len()) {
            // CALC NOT has no use for its second operand.
            let may_be_missing = command.number == Opcode::Calc.number() && command.kind == NOT;
            if !may_be_missing || written.is_empty() {
                self.missing(file, tree, line, form, missing);
                complete = false;
            }
        }
        if let Some(extra) = written.get(wanted.len()) {
            self.extra(file, tree, line, form, tree.expression_span(extra.expression));
            complete = false;
        }
        complete.then_some(command)
    }

    fn missing(
        &mut self,
        file: FileId,
        tree: &Tree,
        line: &Line,
        form: Option<&Form>,
        missing: &Operand,
    ) {
        let end = tree.statement_span(line).end;
        let location = Location { file, span: Span::new(end, end) };
        let message = format!("{} has no {}", head(tree, line), missing.name);
        self.evaluator
            .report(Diagnostic::new(Code::MissingOperand, location, message).help(usage(form)));
    }

    fn extra(&mut self, file: FileId, tree: &Tree, line: &Line, form: Option<&Form>, span: Span) {
        let text = span.of(tree.text());
        let message = format!("{} has no operand for {text}", head(tree, line));
        let location = Location { file, span };
        self.evaluator
            .report(Diagnostic::new(Code::ExtraOperand, location, message).help(usage(form)));
    }

    /// The value of an operand, rounded and within the range of its field.
    fn operand(
        &mut self,
        file: FileId,
        tree: &Tree,
        form: Option<&Form>,
        operand: &Operand,
        expression: ExpressionId,
    ) -> Option<i64> {
        if let Some(name) = tree.name(expression) {
            let word = operand.words.iter().find(|(word, _)| word.eq_ignore_ascii_case(name));
            if let Some(&(_, value)) = word {
                return Some(i64::from(value));
            }
            if self.is_misplaced(file, tree, form, operand, expression, name) {
                return None;
            }
        }
        let purpose = match operand.meaning {
            Meaning::Address => Purpose::Address,
            _ => Purpose::Number,
        };
        let value = libm::round(self.evaluator.value(file, expression, purpose)?);
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

    /// Tells when a name is not one of the words that are wanted here, or one that belongs elsewhere.
    fn is_misplaced(
        &mut self,
        file: FileId,
        tree: &Tree,
        form: Option<&Form>,
        operand: &Operand,
        expression: ExpressionId,
        name: &str,
    ) -> bool {
        let known = self.evaluator.constants.find(name, self.evaluator.files).is_some();
        if known || operand.meaning == Meaning::Address {
            return false;
        }
        let location = Location { file, span: tree.expression_span(expression) };
        if operand.meaning == Meaning::Choice {
            let message = format!("{name} is not a {}", operand.name);
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
        let belongs_to = |form: &&Form| {
            form.operands.iter().any(|operand| {
                operand.words.iter().any(|(word, _)| word.eq_ignore_ascii_case(name))
            })
        };
        let is_label = self.evaluator.labels.find(name, self.evaluator.files).is_some();
        let own = form.filter(belongs_to);
        if is_label || own.or_else(|| FORMS.iter().find(belongs_to)).is_none() {
            return false;
        }
        let message = format!("{name} is a keyword; a {} is expected here", operand.name);
        self.evaluator
            .report(Diagnostic::new(Code::UnknownKeyword, location, message).help(usage(form)));
        true
    }
}

/// The operation of CALC that needs no operand.
const NOT: u8 = 8;

fn fill(command: &mut Command, field: Field, value: i64) -> bool {
    match field {
        Field::Kind => command.kind = value as u8,
        Field::Motor => command.motor = value as u8,
        // Values above i32 are bit patterns.
        Field::Value => command.value = value as i32,
    }
    true
}

/// The mnemonic or number with which a line begins.
fn head<'a>(tree: &'a Tree, line: &Line) -> &'a str {
    match line.statement {
        Statement::Command { mnemonic: head, .. } | Statement::Numbered { number: head, .. } => {
            tree.token_text(head)
        }
        _ => "",
    }
}

/// How a command is written.
fn usage(form: Option<&Form>) -> String {
    match form {
        Some(form) => format!("write {form}"),
        None => "write <number> <type>, <motor>, <value>".into(),
    }
}
