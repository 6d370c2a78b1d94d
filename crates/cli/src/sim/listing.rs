//! The program as its author wrote it, by address.

use std::borrow::Cow;

use opentmcl_wire::Command;

use crate::program::Program;

/// Characters of a source line that are shown; longer ones are cut.
const LONGEST_TEXT: usize = 48;

/// One command of the program.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub(super) struct Row {
    /// File and line; none for a binary and for what the assembler has added.
    source: Option<(String, u32)>,
    /// `12`, or `gripper.inc:12` for a line of an included file; empty for a binary.
    pub(super) place: String,
    /// Labels of this address.
    pub(super) label: String,
    /// As written, without label and comment; for a binary in mnemonics.
    pub(super) text: String,
}

/// Place, labels and text of each command.
pub(super) struct Listing {
    rows: Vec<Row>,
    has_source: bool,
}

impl Listing {
    pub(super) fn new(program: &Program) -> Self {
        let main = program.assembly.as_ref().and_then(|assembly| assembly.files.first());
        let main = main.map_or("", |file| &file.name);
        let row = |(address, &command): (u16, &Command)| Row {
            source: program.place(address).map(|place| (place.file.to_owned(), place.line)),
            place: match program.place(address) {
                Some(place) if place.file == main => place.line.to_string(),
                Some(place) => format!("{}:{}", place.file, place.line),
                None => String::new(),
            },
            label: String::new(),
            text: match statement(program, address) {
                Some(statement) => shortened(statement),
                None => command.to_string(),
            },
        };
        let mut rows: Vec<Row> = (0..).zip(&program.commands).map(row).collect();
        for (name, address) in program.labels() {
            if let Some(row) = rows.get_mut(usize::from(address)) {
                if !row.label.is_empty() {
                    row.label.push_str(", ");
                }
                row.label.push_str(name);
            }
        }
        Self { rows, has_source: program.assembly.is_some() }
    }

    pub(super) fn rows(&self) -> impl Iterator<Item = &Row> {
        self.rows.iter()
    }

    /// The command at an address; behind the program the module's empty memory.
    pub(super) fn row(&self, address: u16, command: Command) -> Cow<'_, Row> {
        match self.rows.get(usize::from(address)) {
            Some(row) => Cow::Borrowed(row),
            None => Cow::Owned(Row { text: command.to_string(), ..Row::default() }),
        }
    }

    /// Labels of an address; empty if it has none.
    pub(super) fn label(&self, address: u16) -> &str {
        self.rows.get(usize::from(address)).map_or("", |row| &row.label)
    }

    /// File and line of an address, if it has any.
    pub(super) fn source(&self, address: u16) -> Option<(String, u32)> {
        self.rows.get(usize::from(address))?.source.clone()
    }

    /// `line 12`, `line gripper.inc:12`, or `address 7` for a binary and behind the source's end.
    pub(super) fn place(&self, address: u16) -> String {
        match self.rows.get(usize::from(address)) {
            Some(row) if !row.place.is_empty() => format!("line {}", row.place),
            Some(_) if self.has_source => format!("address {address}, added by the assembler"),
            _ => format!("address {address}"),
        }
    }
}

/// A command as it is written, without label and comment.
fn statement(program: &Program, address: u16) -> Option<&str> {
    let assembly = program.assembly.as_ref()?;
    let place = assembly.instructions.get(usize::from(address))?.place?;
    let tree = &assembly.file(place.file).tree;
    Some(tree.statement_span(assembly.line(place)?).of(tree.text()))
}

/// A text on one line with single blanks, cut where it would be too long.
fn shortened(text: &str) -> String {
    let text: String = text.split_whitespace().collect::<Vec<_>>().join(" ");
    if text.chars().count() <= LONGEST_TEXT {
        return text;
    }
    text.chars().take(LONGEST_TEXT - 1).chain(['…']).collect()
}
