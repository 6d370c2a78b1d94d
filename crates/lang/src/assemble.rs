//! Trees to commands: includes, then addresses and names, then the commands themselves.

use opentmcl_wire::{Command, Opcode};

use crate::assembly::{Assembly, File, Instruction, Place};
use crate::builtin;
use crate::constants::{Constant, Evaluator};
use crate::diagnostic::{Code, Diagnostic, FileId, Location};
use crate::encode::Encoder;
use crate::include::{Found, Sources};
use crate::names::{Names, Trees};
use crate::parse::{MAX_DIAGNOSTICS, MAX_TEXT};
use crate::suggest::nearest;
use crate::tree::{ExpressionId, Line, Statement, TokenId, Tree};

/// How many files a program may have, each counted as often as it is included, found or not: enough
/// for any program, and an end for files that include each other twice.
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
        includes_left: MAX_FILES - 1,
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
    /// How many more files will be looked for.
    includes_left: usize,
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
        let has_command = |line: &&Line| {
            matches!(line.statement, Statement::Command { .. } | Statement::Numbered { .. })
        };
        self.instructions.reserve(file.tree.lines().iter().filter(has_command).count());
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
            Statement::Include { directive, argument } => {
                let place = Place { file, line: number as u32 };
                self.include(place, directive, argument);
            }
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

    fn include(&mut self, place: Place, directive: TokenId, argument: Option<TokenId>) {
        let file = place.file;
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
        if self.includes_left == 0 {
            return self.too_much(location);
        }
        self.includes_left -= 1;
        let from = self.files[usize::from(file.0)].name.clone();
        match self.sources.find(&name, &from) {
            Found::File { name: known_as, text } => {
                self.add_included(place, location, &known_as, text, false);
            }
            Found::Nothing => match builtin::file(&name) {
                Some((known_as, text)) => {
                    self.add_included(place, location, &known_as, text.into_owned(), true);
                }
                None => self.not_found(location, &name),
            },
            Found::Unreadable(why) => {
                let message = format!("cannot read {name}: {why}");
                self.report(Diagnostic::new(Code::IncludeNotFound, location, message));
            }
        }
    }

    fn too_much(&mut self, location: Location) {
        let message = format!(
            "the program has more than {MAX_FILES} files or {MAX_TEXT} bytes with this one"
        );
        self.report(Diagnostic::new(Code::TooMuchText, location, message));
    }

    fn not_found(&mut self, location: Location, name: &str) {
        let message = format!("there is no file {name}");
        let diagnostic = Diagnostic::new(Code::IncludeNotFound, location, message);
        let names: Vec<_> = builtin::names().collect();
        self.report(match nearest(name, names.iter().map(String::as_str)) {
            Some(near) => diagnostic.help(format!("did you mean {near}?")).replace_with(near),
            None => diagnostic.help(
                "it is looked for beside the including file, in the include folders, and among \
                 the built-in files",
            ),
        });
    }

    fn add_included(
        &mut self,
        place: Place,
        location: Location,
        name: &str,
        text: String,
        built_in: bool,
    ) {
        let is_open =
            self.including.iter().any(|&open| self.files[usize::from(open.0)].name == name);
        if is_open {
            let message = format!("{name} includes itself");
            return self.report(
                Diagnostic::new(Code::CircularInclude, location, message)
                    .help("remove this line, or move what both need into a file of its own"),
            );
        }
        if text.len() > self.text_left {
            return self.too_much(location);
        }
        let included_at = Some(place);
        self.add(File { name: name.into(), built_in, included_at, tree: Tree::parse(text) });
    }

    fn finish(mut self, options: Options) -> Assembly {
        let mut encoder = Encoder::new(Evaluator::new(
            &self.files,
            &self.labels,
            &mut self.constants,
            &mut self.diagnostics,
        ));
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
