//! The listing: the program as it is written, and beside it what the assembler has made of it.

use std::fmt::Write;

use crate::assembly::{Assembly, ConstantValue, Instruction, Place};
use crate::binary;
use crate::diagnostic::FileId;
use crate::tree::{Line, Statement};

/// How wide the columns are; the third is as wide as its longest entry.
const ADDRESS_WIDTH: usize = 7;
const RECORD_WIDTH: usize = 3 * binary::RECORD_LEN - 1;

/// All lines of a program in the order in which the assembler takes them, those of an included file
/// behind the line that includes it; built-in files are left out.
///
/// In front of each line stand the address and the record of its command as the binary file has it, or
/// the value of its constant; then the number of the line, with its file if there are several. A STOP
/// that the assembler has added stands at the end. A line with mistakes has a record of zeros.
pub fn listing(assembly: &Assembly) -> String {
    let mut writer = Writer::new(assembly);
    writer.row("address", "record", "line", "source");
    writer.file(FileId(0));
    for instruction in assembly.instructions.iter().skip(writer.address) {
        let record = hex(instruction);
        let address = writer.address.to_string();
        writer.row(&address, &record, "", &format!("{}  // appended", instruction.command));
    }
    writer.text
}

struct Writer<'a> {
    assembly: &'a Assembly,
    text: String,
    /// How wide the numbers of lines are, with their files.
    line_width: usize,
    with_files: bool,
    /// The address of the next command.
    address: usize,
    /// The next file that will be included.
    next_file: usize,
}

impl<'a> Writer<'a> {
    fn new(assembly: &'a Assembly) -> Self {
        let shown = || assembly.files.iter().filter(|file| !file.built_in);
        let with_files = shown().count() > 1;
        let width = shown().map(|file| {
            let number = file.tree.lines().len().to_string().len();
            if with_files { file.name.chars().count() + 1 + number } else { number }
        });
        let line_width = width.max().unwrap_or_default().max("line".len());
        Self { assembly, text: String::new(), line_width, with_files, address: 0, next_file: 1 }
    }

    fn file(&mut self, id: FileId) {
        let assembly = self.assembly;
        let file = assembly.file(id);
        for (number, line) in file.tree.lines().iter().enumerate() {
            let place = Place { file: id, line: number as u32 };
            if !file.built_in {
                self.line(place, line);
            }
            // Files are numbered in the order in which they are included.
            let next = assembly.files.get(self.next_file);
            if next.is_some_and(|next| next.included_at == Some(place)) {
                let included = FileId(self.next_file as u16);
                self.next_file += 1;
                self.file(included);
            }
        }
    }

    fn line(&mut self, place: Place, line: &Line) {
        let assembly = self.assembly;
        let file = assembly.file(place.file);
        let instruction = assembly.instructions.get(self.address);
        let instruction = instruction.filter(|instruction| instruction.place == Some(place));
        let (address, result) = match (instruction, &line.statement) {
            (Some(instruction), _) => {
                self.address += 1;
                ((self.address - 1).to_string(), hex(instruction))
            }
            (None, &Statement::Constant { name, .. }) => {
                let constant = assembly.constant(file.tree.token_text(name));
                (String::new(), constant.as_ref().map(value).unwrap_or_default())
            }
            _ => (String::new(), String::new()),
        };
        let number = match self.with_files {
            true => format!("{}:{}", file.name, place.line + 1),
            false => (place.line + 1).to_string(),
        };
        let source = file.tree.line_span(line).of(file.tree.text());
        self.row(&address, &result, &number, source);
    }

    fn row(&mut self, address: &str, result: &str, line: &str, source: &str) {
        let start = self.text.len();
        let width = self.line_width;
        // Writing to a string cannot fail.
        let _ = write!(
            self.text,
            "{address:>ADDRESS_WIDTH$}  {result:<RECORD_WIDTH$}  {line:>width$}  {source}"
        );
        let shown = self.text[start..].trim_ascii_end().len();
        self.text.truncate(start + shown);
        self.text.push('\n');
    }
}

fn hex(instruction: &Instruction) -> String {
    let mut text = String::with_capacity(RECORD_WIDTH);
    for byte in binary::record(instruction.command) {
        let separator = if text.is_empty() { "" } else { " " };
        let _ = write!(text, "{separator}{byte:02X}");
    }
    text
}

fn value(constant: &ConstantValue<'_>) -> String {
    match constant.value {
        None => String::new(),
        Some(value) if value == 0.0 || (1e-6..1e15).contains(&value.abs()) => format!("= {value}"),
        // Without an exponent it would have up to three hundred digits.
        Some(value) => format!("= {value:e}"),
    }
}
