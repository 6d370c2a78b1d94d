//! One command as text: `ROR 0, 51200`, `MVP ABS, 0, $C800`, or with a number for the command,
//! `129 1, 0, 5` (type, motor, value), for commands that have no mnemonic.
//!
//! This is direct mode as a person types it; labels, constants and expressions belong to the
//! assembler.

use core::fmt;

use crate::Command;
use crate::opcode::{self, Field, Form, Meaning, Operand};

/// Why a line is not a command; each says which part and what would be right.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum ParseError<'a> {
    /// The line holds nothing.
    Empty,
    /// No command has this name.
    UnknownMnemonic(&'a str),
    /// Too few or too many operands.
    OperandCount {
        /// The command whose operands were counted.
        form: &'static Form,
        /// How many were written.
        found: usize,
    },
    /// Too few or too many numbers behind a command number.
    RawOperandCount {
        /// How many were written.
        found: usize,
    },
    /// An operand is neither a number nor one of the words allowed there.
    BadOperand {
        /// The text of the operand.
        text: &'a str,
        /// What is expected in its place.
        operand: Operand,
    },
    /// A number does not fit its field.
    OutOfRange {
        /// The text of the operand.
        text: &'a str,
        /// What is expected in its place.
        operand: Operand,
    },
}

impl fmt::Display for ParseError<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Empty => write!(f, "no command; write for example: GAP 1, 0"),
            Self::UnknownMnemonic(name) => {
                write!(f, "unknown command {name:?}; write a mnemonic such as ROR, MVP or GAP")
            }
            Self::OperandCount { form, found } => {
                let wanted = form.operands.len();
                let plural = if wanted == 1 { "" } else { "s" };
                write!(f, "{} takes {wanted} operand{plural}, not {found}: {form}", form.mnemonic)
            }
            Self::RawOperandCount { found } => write!(
                f,
                "a command number takes 3 operands, not {found}: <number> <type>, <motor>, <value>"
            ),
            Self::BadOperand { text, operand } => {
                write!(f, "{text:?} is not a {}; write ", operand.name)?;
                for (word, _) in operand.words {
                    write!(f, "{word}, ")?;
                }
                write!(f, "{}a number", if operand.words.is_empty() { "" } else { "or " })
            }
            Self::OutOfRange { text, operand } => {
                let range = match operand.field {
                    Field::Kind | Field::Motor => "0..255",
                    Field::Value => "-2147483648..2147483647",
                };
                write!(f, "{} {text} is out of range {range}", operand.name)
            }
        }
    }
}

impl core::error::Error for ParseError<'_> {}

/// How many keywords a pattern spells out.
const MAX_WORDS: usize = 6;

impl fmt::Display for Form {
    /// The pattern of the command: `MVP <ABS|REL|COORD>, <motor>, <position>`. Operands with many
    /// keywords are named: `JC <condition>, <address>`.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}", self.mnemonic)?;
        for (at, operand) in self.operands.iter().enumerate() {
            f.write_str(if at == 0 { " <" } else { ", <" })?;
            match operand.words {
                [] => f.write_str(operand.name)?,
                words if words.len() > MAX_WORDS => f.write_str(operand.name)?,
                words => {
                    for (at, (word, _)) in words.iter().enumerate() {
                        write!(f, "{}{word}", if at == 0 { "" } else { "|" })?;
                    }
                }
            }
            f.write_str(">")?;
        }
        Ok(())
    }
}

impl Form {
    /// Whether all fields that have no operand of their own are zero, so that the mnemonic form loses
    /// nothing.
    pub fn shows_all_of(&self, command: Command) -> bool {
        let has = |field| self.operands.iter().any(|operand| operand.field == field);
        (command.kind == 0 || has(Field::Kind))
            && (command.motor == 0 || has(Field::Motor))
            && (command.value == 0 || has(Field::Value))
    }
}

/// Reads one command. Case does not matter; numbers may be decimal, `$` or `0x` hexadecimal or `%`
/// binary; a word and its number mean the same; what follows `//` is a comment.
pub fn parse(line: &str) -> Result<Command, ParseError<'_>> {
    let (name, rest) = split(line);
    if name.is_empty() {
        return Err(ParseError::Empty);
    }
    if let Some(number) = number(name) {
        let number = u8::try_from(number).map_err(|_| ParseError::UnknownMnemonic(name))?;
        return parse_raw(number, rest);
    }
    let form = opcode::form_by_mnemonic(name).ok_or(ParseError::UnknownMnemonic(name))?;
    let mut command = Command::new(form.opcode.number(), 0, 0, 0);
    let surplus = form.surplus();
    for (text, &operand) in operands(rest).zip(form.operands.iter().chain(&surplus)) {
        fill(&mut command, text, operand)?;
    }
    let wanted = form.operands.len();
    let found = operands(rest).count();
    let ends_early = found + 1 == wanted && form.may_end_early(command.kind);
    let has_surplus = found == wanted + 1 && surplus.is_some();
    if found != wanted && !ends_early && !has_surplus {
        return Err(ParseError::OperandCount { form, found });
    }
    Ok(command)
}

/// The name of the command in a line, and the text of its operands; both without comment and outer
/// blanks, and empty if there is none.
pub(crate) fn split(line: &str) -> (&str, &str) {
    let line = line.split("//").next().unwrap_or_default().trim();
    let (name, rest) = line.split_once(|c: char| c.is_whitespace()).unwrap_or((line, ""));
    (name, rest.trim())
}

/// The operands of a command that is written as a number.
pub const RAW_OPERANDS: [Operand; 3] = [
    Operand { name: "type", meaning: Meaning::Number, field: Field::Kind, words: &[] },
    Operand { name: "motor", meaning: Meaning::Number, field: Field::Motor, words: &[] },
    Operand { name: "value", meaning: Meaning::Number, field: Field::Value, words: &[] },
];

fn parse_raw(number: u8, rest: &str) -> Result<Command, ParseError<'_>> {
    let found = operands(rest).count();
    if found != RAW_OPERANDS.len() {
        return Err(ParseError::RawOperandCount { found });
    }
    let mut command = Command::new(number, 0, 0, 0);
    for (text, operand) in operands(rest).zip(RAW_OPERANDS) {
        fill(&mut command, text, operand)?;
    }
    Ok(command)
}

fn operands(rest: &str) -> impl Iterator<Item = &str> {
    let count = if rest.is_empty() { 0 } else { usize::MAX };
    rest.split(',').map(str::trim).take(count)
}

fn fill<'a>(command: &mut Command, text: &'a str, operand: Operand) -> Result<(), ParseError<'a>> {
    let word = operand.words.iter().find(|(word, _)| word.eq_ignore_ascii_case(text));
    let value = match word {
        Some(&(_, value)) => i64::from(value),
        None => number(text).ok_or(ParseError::BadOperand { text, operand })?,
    };
    let out_of_range = |_| ParseError::OutOfRange { text, operand };
    match operand.field {
        Field::Kind => command.kind = u8::try_from(value).map_err(out_of_range)?,
        Field::Motor => command.motor = u8::try_from(value).map_err(out_of_range)?,
        Field::Value => command.value = i32::try_from(value).map_err(out_of_range)?,
    }
    Ok(())
}

/// A number in one of the notations of the language. Too long a number is none.
pub(crate) fn number(text: &str) -> Option<i64> {
    let (negative, digits) = match text.strip_prefix('-') {
        Some(digits) => (true, digits),
        None => (false, text),
    };
    let (radix, digits) = if let Some(digits) = digits.strip_prefix('$') {
        (16, digits)
    } else if let Some(digits) = digits.strip_prefix("0x").or(digits.strip_prefix("0X")) {
        (16, digits)
    } else if let Some(digits) = digits.strip_prefix('%') {
        (2, digits)
    } else {
        (10, digits)
    };
    if digits.starts_with(['+', '-']) {
        return None;
    }
    let magnitude = i64::from_str_radix(digits, radix).ok()?;
    Some(if negative { -magnitude } else { magnitude })
}

impl fmt::Display for Command {
    /// The text from which [`parse`] reads this command again: the mnemonic form where it shows
    /// everything that the command holds, otherwise the numbers.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Some(form) = opcode::form(self.number).filter(|form| form.shows_all_of(*self)) else {
            return write!(f, "{} {}, {}, {}", self.number, self.kind, self.motor, self.value);
        };
        write!(f, "{}", form.mnemonic)?;
        for (at, operand) in form.operands.iter().enumerate() {
            f.write_str(if at == 0 { " " } else { ", " })?;
            let word = operand.words.iter().find(|&&(_, number)| number == self.kind);
            match (operand.field, word) {
                (Field::Kind, Some((word, _))) => f.write_str(word)?,
                (Field::Kind, None) => write!(f, "{}", self.kind)?,
                (Field::Motor, _) => write!(f, "{}", self.motor)?,
                (Field::Value, _) => write!(f, "{}", self.value)?,
            }
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::string::ToString;

    #[track_caller]
    fn reads(line: &str, bytes: [u8; 7]) {
        let command = parse(line).unwrap();
        assert_eq!(command.to_bytes(), bytes, "{line}");
        assert_eq!(parse(&command.to_string()), Ok(command), "{line}");
    }

    #[track_caller]
    fn refuses(line: &str, message: &str) {
        assert_eq!(parse(line).unwrap_err().to_string(), message);
    }

    #[test]
    fn the_manuals_examples_are_read() {
        reads("ROR 0, 51200", [1, 0, 0, 0, 0, 0xC8, 0]);
        reads("MVP REL, 0, -10000", [4, 1, 0, 0xFF, 0xFF, 0xD8, 0xF0]);
        reads("MVP COORD, $47, 2", [4, 2, 0x47, 0, 0, 0, 2]);
        reads("GGP 66, 0", [10, 0x42, 0, 0, 0, 0, 0]);
        reads("CALC MUL, -5000", [19, 2, 0, 0xFF, 0xFF, 0xEC, 0x78]);
        reads("JC GE, 10", [21, 5, 0, 0, 0, 0, 10]);
        reads("CALCVV SUB, 65, 42", [40, 1, 65, 0, 0, 0, 42]);
        reads("DJNZ 42, 1", [49, 42, 0, 0, 0, 0, 1]);
        reads("CALL LT, 100", [80, 6, 0, 0, 0, 0, 100]);
        reads("SAPX 4, 51200", [16, 4, 0, 0, 0, 0xC8, 0]);
        reads("RSUB", [24, 0, 0, 0, 0, 0, 0]);
    }

    #[test]
    fn operands_without_a_meaning_may_be_left_out_or_written() {
        reads("CALC NOT", [19, 8, 0, 0, 0, 0, 0]);
        reads("CALC NOT, 0", [19, 8, 0, 0, 0, 0, 0]);
        reads("GCO 0, 255, 0", [31, 0, 255, 0, 0, 0, 0]);
    }

    #[test]
    fn case_blanks_and_comments_do_not_matter() {
        reads("  mvp abs ,0,%1010 // ten", [4, 0, 0, 0, 0, 0, 10]);
    }

    #[test]
    fn a_command_without_mnemonic_is_written_with_its_number() {
        reads("129 1, 0, 5", [129, 1, 0, 0, 0, 0, 5]);
    }

    #[test]
    fn a_command_that_its_mnemonic_cannot_show_is_printed_as_numbers() {
        let command = Command::new(2, 1, 0, 3);
        assert_eq!(command.to_string(), "2 1, 0, 3");
        assert_eq!(parse("2 1, 0, 3"), Ok(command));
    }

    #[test]
    fn errors_say_what_would_be_right() {
        refuses(
            "WAIT POS",
            "WAIT takes 3 operands, not 1: WAIT <TICKS|POS|REFSW|LIMSW|RFS>, <motor>, <ticks>",
        );
        refuses("ROR 0", "ROR takes 2 operands, not 1: ROR <motor>, <velocity>");
        refuses(
            "MVP FAST, 0, 1",
            "\"FAST\" is not a kind of move; write ABS, REL, COORD, or a number",
        );
        refuses("ROR 256, 1", "motor 256 is out of range 0..255");
        refuses("GO 1", "unknown command \"GO\"; write a mnemonic such as ROR, MVP or GAP");
        refuses("CALC ADD", "CALC takes 2 operands, not 1: CALC <operation>, <value>");
    }
}
