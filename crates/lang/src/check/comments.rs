//! What comments tell the tools: the module that a program is for, and findings to be silent about.

use std::collections::BTreeSet;

use opentmcl_catalog::MODULES;

use crate::assembly::{Assembly, File};
use crate::diagnostic::{Code, Diagnostic, FileId, Location};
use crate::span::Span;
use crate::suggest::nearest;
use crate::tree::{Line, Statement};

use super::findings::Findings;

const MODULE: &str = "module";
const ALLOW: &str = "tmcl-allow";
const ALLOW_IN_FILE: &str = "tmcl-allow-file";

/// A part of a comment.
#[derive(Clone, Copy)]
struct Text<'a> {
    text: &'a str,
    location: Location,
}

impl<'a> Text<'a> {
    fn part(self, start: usize, len: usize) -> Self {
        let from = self.location.span.start + start as u32;
        let span = Span::new(from, from + len as u32);
        let text = self.text.get(start..start + len).unwrap_or_default();
        Self { text, location: Location { span, ..self.location } }
    }

    /// Without blanks around it.
    fn trimmed(self) -> Self {
        let start = self.text.len() - self.text.trim_start().len();
        self.part(start, self.text.trim().len())
    }

    /// Up to the first blank, and whether anything follows.
    fn first_word(self) -> (Self, bool) {
        match self.text.find(char::is_whitespace) {
            Some(end) => (self.part(0, end), true),
            None => (self, false),
        }
    }

    /// The words of a list with commas, up to the first behind which a sentence follows.
    fn list(self) -> impl Iterator<Item = Self> {
        let mut start = Some(0);
        std::iter::from_fn(move || {
            let from = start?;
            let rest = self.text.get(from..).unwrap_or_default();
            let len = rest.find(',');
            let (word, is_last) = self.part(from, len.unwrap_or(rest.len())).trimmed().first_word();
            start = len.filter(|_| !is_last).map(|len| from + len + 1);
            Some(word)
        })
    }
}

/// Key and text of a comment of the form `// key: text`.
fn note<'a>(id: FileId, file: &'a File, line: &Line) -> Option<(&'a str, Text<'a>)> {
    let comment = file.tree.comment(line)?;
    let text = file.tree.token_text(comment);
    let key = text.trim_start_matches(['/', ';']).trim_start();
    // Nearly all comments end here.
    if !key.starts_with(['t', 'T', 'm', 'M']) {
        return None;
    }
    let (key, rest) = key.split_once(':')?;
    let end = file.tree.token_span(comment).end;
    let span = Span::new(end - rest.len() as u32, end);
    Some((key.trim_end(), Text { text: rest, location: Location { file: id, span } }.trimmed()))
}

/// The files that people have written, with their numbers.
fn files(assembly: &Assembly) -> impl Iterator<Item = (FileId, &File)> {
    let numbered = (0..).map(FileId).zip(&assembly.files);
    numbered.filter(|(_, file)| !file.built_in)
}

/// See [`super::declared_module`].
pub(super) fn declared_module(assembly: &Assembly) -> Option<(&str, Location)> {
    let (id, main) = files(assembly).next()?;
    main.tree.lines().iter().find_map(|line| {
        let (key, rest) = note(id, main, line)?;
        let (name, in_a_sentence) = rest.first_word();
        let is_meant = key.eq_ignore_ascii_case(MODULE)
            && !name.text.is_empty()
            && (!in_a_sentence || opentmcl_catalog::find(name.text).is_some());
        is_meant.then_some((name.text, name.location))
    })
}

/// Tells of names in comments that do not exist.
pub(super) fn check(assembly: &Assembly, findings: &mut Findings<'_>) {
    if let Some((name, location)) = declared_module(assembly)
        && opentmcl_catalog::find(name).is_none()
    {
        let message = format!("there is no module {name}");
        let names = || MODULES.iter().map(|module| module.name);
        findings.report(unknown(location, message, nearest(name, names()), names()));
    }
    for (id, file) in files(assembly) {
        for line in file.tree.lines() {
            let Some((key, rest)) = note(id, file, line) else { continue };
            if !key.eq_ignore_ascii_case(ALLOW) && !key.eq_ignore_ascii_case(ALLOW_IN_FILE) {
                continue;
            }
            for word in rest.list() {
                check_code(word, findings);
            }
        }
    }
}

fn check_code(Text { text, location }: Text<'_>, findings: &mut Findings<'_>) {
    match Code::find(text) {
        Some(code) if code.can_be_silenced() => {}
        Some(_) => {
            let message = format!("{text} cannot be silenced");
            findings.report(
                Diagnostic::new(Code::UnknownNameInComment, location, message)
                    .help("there is no program without it mended"),
            );
        }
        None => {
            let message = match text {
                "" => "a code is missing here".to_owned(),
                _ => format!("there is no finding {text}"),
            };
            let names = Code::ALL.iter().filter(|code| code.can_be_silenced());
            let near = nearest(text, names.map(|code| code.name()));
            findings.report(unknown(location, message, near, []));
        }
    }
}

fn unknown(
    location: Location,
    message: String,
    near: Option<&str>,
    all: impl IntoIterator<Item = &'static str>,
) -> Diagnostic {
    let diagnostic = Diagnostic::new(Code::UnknownNameInComment, location, message);
    let all: Vec<_> = all.into_iter().collect();
    match near {
        Some(near) => diagnostic.help(format!("did you mean {near}?")).replace_with(near),
        None if all.is_empty() => {
            diagnostic.help("write the code that a finding shows in square brackets")
        }
        None => diagnostic.help(format!("write one of {}", all.join(", "))),
    }
}

/// Which findings comments silence.
#[derive(Default)]
pub(super) struct Silence {
    in_files: BTreeSet<(FileId, Code)>,
    /// With the line from 0.
    in_lines: BTreeSet<(FileId, u32, Code)>,
}

impl Silence {
    /// As the comments of a program say.
    pub(super) fn of(assembly: &Assembly) -> Self {
        let mut silence = Self::default();
        for (id, file) in files(assembly) {
            // From lines with nothing but a comment, for the next statement.
            let mut ahead = BTreeSet::new();
            for (number, line) in (0..).zip(file.tree.lines()) {
                if let Some((key, rest)) = note(id, file, line) {
                    let codes = rest.list().filter_map(|word| Code::find(word.text));
                    if key.eq_ignore_ascii_case(ALLOW_IN_FILE) {
                        silence.in_files.extend(codes.map(|code| (id, code)));
                    } else if key.eq_ignore_ascii_case(ALLOW) {
                        let is_alone =
                            line.statement == Statement::None && file.tree.labels(line).is_empty();
                        if is_alone {
                            ahead.extend(codes);
                        } else {
                            silence.in_lines.extend(codes.map(|code| (id, number, code)));
                        }
                    }
                }
                if line.statement != Statement::None && !ahead.is_empty() {
                    let codes = std::mem::take(&mut ahead);
                    silence.in_lines.extend(codes.into_iter().map(|code| (id, number, code)));
                }
            }
        }
        silence
    }

    /// Whether a finding is one of them.
    pub(super) fn covers(&self, assembly: &Assembly, diagnostic: &Diagnostic) -> bool {
        let Diagnostic { code, location: Location { file, span }, .. } = *diagnostic;
        if self.in_files.is_empty() && self.in_lines.is_empty() || !code.can_be_silenced() {
            return false;
        }
        let line = assembly.file(file).tree.line_at(span.start) as u32;
        self.in_files.contains(&(file, code)) || self.in_lines.contains(&(file, line, code))
    }
}
