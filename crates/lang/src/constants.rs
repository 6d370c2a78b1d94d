//! Values of expressions and constants.

use crate::assembly::File;
use crate::diagnostic::{Code, Diagnostic, FileId, Location};
use crate::names::{Names, Trees};
use crate::parse::MAX_DIAGNOSTICS;
use crate::suggest::nearest;
use crate::tree::{ExpressionId, ExpressionKind, TokenId};

/// How deep constants and parentheses together may lead: enough for any person, and little enough for
/// any stack.
const MAX_DEPTH: u32 = 800;

/// How many unknown names get a proposal: looking for one compares with every name there is.
const MAX_PROPOSALS: u32 = 50;

/// The definition of a constant.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Constant {
    pub(crate) expression: ExpressionId,
    state: State,
}

#[derive(Clone, Copy, Debug)]
enum State {
    /// Not looked at yet.
    New,
    /// Being computed: whoever meets it now has gone in a circle.
    Busy,
    Known(f64),
    /// Has no value, and that has been told.
    Failed,
}

impl Constant {
    pub(crate) const fn new(expression: ExpressionId) -> Self {
        Self { expression, state: State::New }
    }

    pub(crate) const fn value(&self) -> Option<f64> {
        match self.state {
            State::Known(value) => Some(value),
            _ => None,
        }
    }
}

/// What a value is for: the address of a jump may be a label, another number should not.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Purpose {
    Address,
    Number,
}

/// Computes values, and tells why one cannot be computed.
pub(crate) struct Evaluator<'a> {
    pub(crate) files: &'a Vec<File>,
    pub(crate) labels: &'a Names<u32>,
    pub(crate) constants: &'a mut Names<Constant>,
    pub(crate) diagnostics: &'a mut Vec<Diagnostic>,
    proposals: u32,
    depth: u32,
}

impl<'a> Evaluator<'a> {
    pub(crate) fn new(
        files: &'a Vec<File>,
        labels: &'a Names<u32>,
        constants: &'a mut Names<Constant>,
        diagnostics: &'a mut Vec<Diagnostic>,
    ) -> Self {
        Self { files, labels, constants, diagnostics, proposals: 0, depth: 0 }
    }

    /// Whether a further finding would be told.
    pub(crate) fn has_room(&self) -> bool {
        self.diagnostics.len() < MAX_DIAGNOSTICS
    }

    pub(crate) fn report(&mut self, diagnostic: Diagnostic) {
        if self.has_room() {
            self.diagnostics.push(diagnostic);
        }
    }

    /// The value of an expression, not rounded; `None` if it has none, which has then been told.
    pub(crate) fn value(
        &mut self,
        file: FileId,
        id: ExpressionId,
        purpose: Purpose,
    ) -> Option<f64> {
        let tree = self.files.tree(file);
        let expression = tree.expression(id);
        match expression.kind {
            ExpressionKind::Number(value) => Some(value),
            ExpressionKind::Name => self.name(file, expression.first, purpose),
            ExpressionKind::Error => None,
            _ => {
                let location = Location { file, span: tree.expression_span(id) };
                self.deeper(location, |evaluator| evaluator.compute(file, id, purpose))
            }
        }
    }

    /// What is computed one step deeper; `None` if that would be too deep, which is then told.
    fn deeper(
        &mut self,
        location: Location,
        compute: impl FnOnce(&mut Self) -> Option<f64>,
    ) -> Option<f64> {
        if self.depth == MAX_DEPTH {
            let message = "the value depends on others more deeply than can be followed";
            self.report(Diagnostic::new(Code::NestedTooDeeply, location, message));
            return None;
        }
        self.depth += 1;
        let value = compute(self);
        self.depth -= 1;
        value
    }

    fn compute(&mut self, file: FileId, id: ExpressionId, purpose: Purpose) -> Option<f64> {
        let tree = self.files.tree(file);
        let value = match tree.expression(id).kind {
            ExpressionKind::Negate(inner) => -self.value(file, inner, purpose)?,
            ExpressionKind::Same(inner) => self.value(file, inner, purpose)?,
            ExpressionKind::Call(function, argument) => {
                function.compute(self.value(file, argument, Purpose::Number)?)
            }
            ExpressionKind::Binary(..) => {
                // A row of operators leans to the left: going down there by a loop keeps the stack
                // small however long the row is.
                let mut row = Vec::new();
                let mut innermost = id;
                while let ExpressionKind::Binary(operator, left, right) =
                    tree.expression(innermost).kind
                {
                    row.push((operator, right));
                    innermost = left;
                }
                let mut value = self.value(file, innermost, purpose);
                for (operator, right) in row.into_iter().rev() {
                    // Both sides are looked at, so that all mistakes are told at once.
                    let right = self.value(file, right, purpose);
                    value = value.zip(right).map(|(left, right)| operator.compute(left, right));
                }
                value?
            }
            _ => return None,
        };
        if value.is_finite() {
            return Some(value);
        }
        let location = Location { file, span: tree.expression_span(id) };
        let text = location.span.of(tree.text());
        let message = format!("{text} has no value");
        self.report(
            Diagnostic::new(Code::UndefinedValue, location, message)
                .help("it divides by zero, leaves the range of a function, or is too large"),
        );
        None
    }

    /// The value of an expression that is nothing but a name, if the name has a definition that suits
    /// the purpose; the inner `None` if that has no value, which has then been told.
    pub(crate) fn known_name(
        &mut self,
        file: FileId,
        id: ExpressionId,
        purpose: Purpose,
    ) -> Option<Option<f64>> {
        self.known_token(file, self.files.tree(file).expression(id).first, purpose)
    }

    fn known_token(
        &mut self,
        file: FileId,
        token: TokenId,
        purpose: Purpose,
    ) -> Option<Option<f64>> {
        let tree = self.files.tree(file);
        let name = tree.token_text(token);
        if purpose == Purpose::Address
            && let Some(address) = self.label(name)
        {
            return Some(Some(f64::from(address)));
        }
        let at = self.constants.find(name, self.files)?;
        if let State::Known(value) = self.constants.entries()[at].meaning.state {
            return Some(Some(value));
        }
        let user = Location { file, span: tree.token_span(token) };
        Some(self.constant(at, Some(user)))
    }

    fn name(&mut self, file: FileId, token: TokenId, purpose: Purpose) -> Option<f64> {
        if let Some(value) = self.known_token(file, token, purpose) {
            return value;
        }
        let tree = self.files.tree(file);
        let name = tree.token_text(token);
        let location = Location { file, span: tree.token_span(token) };
        if let Some(address) = self.label(name) {
            let message =
                format!("{name} is a label; its address {address} is taken as the number");
            self.report(Diagnostic::new(Code::LabelAsNumber, location, message));
            return Some(f64::from(address));
        }
        let diagnostic = self.unknown(name, location, purpose);
        self.report(diagnostic);
        None
    }

    fn label(&self, name: &str) -> Option<u32> {
        let at = self.labels.find(name, self.files)?;
        self.labels.entries().get(at).map(|entry| entry.meaning)
    }

    fn unknown(&mut self, name: &str, location: Location, purpose: Purpose) -> Diagnostic {
        let diagnostic = match purpose {
            Purpose::Address => {
                let message = format!("there is no label {name}");
                Diagnostic::new(Code::UnknownLabel, location, message)
            }
            Purpose::Number => {
                let message = format!("there is no constant {name}");
                Diagnostic::new(Code::UnknownConstant, location, message)
            }
        };
        self.proposals += 1;
        if self.proposals > MAX_PROPOSALS {
            return diagnostic;
        }
        let files = self.files;
        let near = match purpose {
            Purpose::Address => nearest(name, self.labels.names(files)),
            Purpose::Number => nearest(name, self.constants.names(files)),
        };
        match near {
            Some(near) => {
                let near = near.to_owned();
                diagnostic.help(format!("did you mean {near}?")).replace_with(near)
            }
            None if purpose == Purpose::Address => {
                diagnostic.help(format!("a line that begins with {name}: defines it"))
            }
            None => match crate::builtin::file_with_constant(name) {
                Some(file) => diagnostic.help(format!("#include {file} defines it")),
                None => diagnostic.help(format!("a line {name} = value defines it")),
            },
        }
    }

    /// The value of the constant at this place, computed the first time it is asked for.
    pub(crate) fn constant(&mut self, at: usize, user: Option<Location>) -> Option<f64> {
        let entry = self.constants.entries().get(at)?;
        let (file, token, expression) = (entry.file, entry.token, entry.meaning.expression);
        let tree = self.files.tree(file);
        let definition = Location { file, span: tree.token_span(token) };
        let location = user.unwrap_or(definition);
        match entry.meaning.state {
            State::Known(value) => return Some(value),
            State::Failed => return None,
            State::Busy => {
                let name = tree.token_text(token);
                let message = format!("the value of {name} depends on itself");
                self.report(
                    Diagnostic::new(Code::CircularConstant, location, message)
                        .related(definition, format!("{name} is defined here")),
                );
                return None;
            }
            State::New => {}
        }
        self.deeper(location, |evaluator| {
            evaluator.set_state(at, State::Busy);
            let value = evaluator.value(file, expression, Purpose::Number);
            evaluator.set_state(at, value.map_or(State::Failed, State::Known));
            value
        })
    }

    fn set_state(&mut self, at: usize, state: State) {
        if let Some(entry) = self.constants.entry_mut(at) {
            entry.meaning.state = state;
        }
    }
}
