//! The program as its author wrote it, by address.

use std::borrow::Cow;

use opentmcl_wire::Command;

use crate::program::Program;

/// Characters of a source line that are shown; longer ones are cut.
const LONGEST_TEXT: usize = 48;

/// One command of the program.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub(super) struct Row {
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
}

impl Listing {
    pub(super) fn new(program: &Program) -> Self {
        let main = program.place(0).map(|place| place.file.to_owned());
        let mut rows: Vec<Row> = (0..)
            .zip(&program.commands)
            .map(|(address, command)| match program.place(address) {
                None => Row { text: command.to_string(), ..Row::default() },
                Some(place) if main.as_deref() == Some(place.file) => Row {
                    place: place.line.to_string(),
                    text: bare(place.text, *command),
                    ..Row::default()
                },
                Some(place) => Row {
                    place: format!("{}:{}", place.file, place.line),
                    text: bare(place.text, *command),
                    ..Row::default()
                },
            })
            .collect();
        for (name, address) in program.labels() {
            if let Some(row) = rows.get_mut(usize::from(address)) {
                if !row.label.is_empty() {
                    row.label.push_str(", ");
                }
                row.label.push_str(name);
            }
        }
        Self { rows }
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

    /// `line 12`, `line gripper.inc:12` or, for a binary, `address 7`.
    pub(super) fn place(&self, address: u16) -> String {
        match self.rows.get(usize::from(address)) {
            Some(row) if !row.place.is_empty() => format!("line {}", row.place),
            _ => format!("address {address}"),
        }
    }
}

/// A source line without its label and comments; the command itself if nothing is left, as for one
/// that the assembler added.
fn bare(line: &str, command: Command) -> String {
    let code = line.split("//").next().unwrap_or_default().trim();
    let code = match code.split_once(':') {
        Some((label, rest)) if !label.contains(char::is_whitespace) => rest.trim(),
        _ => code,
    };
    if code.is_empty() {
        return command.to_string();
    }
    let mut text: String = code.split_whitespace().collect::<Vec<_>>().join(" ");
    if text.chars().count() > LONGEST_TEXT {
        text = text.chars().take(LONGEST_TEXT - 1).collect();
        text.push('…');
    }
    text
}
