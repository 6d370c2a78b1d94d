//! One line from a terminal to a request.

use super::letter;
use crate::mnemonic::{self, ParseError};
use crate::opcode::{self, Field, Meaning, Opcode, Operand};
use crate::{Command, Status, control};

/// The longest line in characters, from the letter of the address on, without CR. The longest command takes
/// 62, with all its numbers in binary.
pub const LINE_MAX: usize = 80;

/// What a line asks of the module. Each is answered, by [`super::encode_reply`].
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Request {
    /// Execute a command. RUN and STOP are the control commands 129 and 128.
    Command(Command),
    /// BIN: after the reply to it, the line carries 9-byte frames again. The LF of a terminal that
    /// sends it after CR is then a stray byte, which [`crate::serial::BYTE_TIMEOUT`] takes care of.
    Leave,
}

/// Reads a line, which begins with the letter of an address and ends before its CR.
///
/// None if the module with this `address` is not meant: it says nothing. An error is the status to answer a
/// line that cannot be read; the value of that answer is 0, as there is no command.
///
/// ```
/// use opentmcl_wire::ascii::{parse_line, Request};
/// use opentmcl_wire::{Command, Status};
///
/// let stop = Request::Command(Command::new(3, 0, 1, 0));
/// assert_eq!(parse_line(b"A MST 1", 1), Some(Ok(stop)));
/// assert_eq!(parse_line(b"A MST", 1), Some(Err(Status::INVALID_VALUE)));
/// assert_eq!(parse_line(b"A MST 1", 2), None);
/// ```
pub fn parse_line(line: &[u8], address: u8) -> Option<Result<Request, Status>> {
    let (&first, rest) = line.split_first()?;
    if !is_letter_of(first, address) {
        return None;
    }
    let text = core::str::from_utf8(rest).ok().filter(|text| text.is_ascii());
    Some(match text {
        Some(text) if line.len() <= LINE_MAX => parse_request(text),
        _ => Err(Status::INVALID_COMMAND),
    })
}

/// Whether a line that begins with this character is for the module with this address.
pub(super) fn is_letter_of(character: u8, address: u8) -> bool {
    letter(address).is_some_and(|letter| letter == character.to_ascii_uppercase())
}

fn parse_request(text: &str) -> Result<Request, Status> {
    let (name, operands) = mnemonic::split(text);
    if name.eq_ignore_ascii_case("RUN") {
        return Ok(Request::Command(run(operands)?));
    }
    if name.eq_ignore_ascii_case("STOP") {
        let stop = Command::new(control::STOP_PROGRAM, 0, 0, 0);
        return without_operands(operands, Request::Command(stop));
    }
    if name.eq_ignore_ascii_case("BIN") {
        return without_operands(operands, Request::Leave);
    }
    // Before the operands: those of a command that is not for terminals are nobody's business. A number in
    // place of the name has no form, so this refuses it as well.
    if !opcode::form_by_mnemonic(name).is_some_and(|form| is_for_terminals(form.opcode)) {
        return Err(Status::INVALID_COMMAND);
    }
    mnemonic::parse(text).map(Request::Command).map_err(status)
}

fn run(operands: &str) -> Result<Command, Status> {
    const HERE: u8 = 0;
    const AT_ADDRESS: u8 = 1;
    if operands.is_empty() {
        return Ok(Command::new(control::RUN_PROGRAM, HERE, 0, 0));
    }
    let address = mnemonic::number(operands).and_then(|address| i32::try_from(address).ok());
    let address = address.ok_or(Status::INVALID_VALUE)?;
    Ok(Command::new(control::RUN_PROGRAM, AT_ADDRESS, 0, address))
}

fn without_operands(operands: &str, request: Request) -> Result<Request, Status> {
    if operands.is_empty() { Ok(request) } else { Err(Status::INVALID_VALUE) }
}

/// Whether a command may be typed: those that make sense outside of a program.
const fn is_for_terminals(opcode: Opcode) -> bool {
    use Opcode::*;
    matches!(
        opcode,
        Rol | Ror
            | Mst
            | Mvp
            | Sap
            | Gap
            | Stap
            | Rsap
            | Sgp
            | Ggp
            | Stgp
            | Rsgp
            | Rfs
            | Sio
            | Gio
            | Sco
            | Gco
            | Cco
            | Uf0
            | Uf1
            | Uf2
            | Uf3
            | Uf4
            | Uf5
            | Uf6
            | Uf7
    )
}

/// The status that comes nearest to an error of the text: what the module would answer if the wrong number
/// stood in the field.
fn status(error: ParseError<'_>) -> Status {
    match error {
        ParseError::Empty | ParseError::UnknownMnemonic(_) => Status::INVALID_COMMAND,
        ParseError::OperandCount { .. } | ParseError::RawOperandCount { .. } => {
            Status::INVALID_VALUE
        }
        ParseError::BadOperand { operand, .. } | ParseError::OutOfRange { operand, .. } => {
            if is_type(operand) {
                Status::WRONG_TYPE
            } else {
                Status::INVALID_VALUE
            }
        }
    }
}

fn is_type(operand: Operand) -> bool {
    operand.field == Field::Kind || operand.meaning == Meaning::Bank
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::opcode::FORMS;
    use std::format;
    use std::vec::Vec;

    #[track_caller]
    fn reads(line: &str, bytes: [u8; 7]) {
        let command = Request::Command(Command::from_bytes(bytes));
        assert_eq!(parse_line(line.as_bytes(), 1), Some(Ok(command)), "{line}");
    }

    #[track_caller]
    fn refuses(status: Status, lines: &[&str]) {
        for line in lines {
            assert_eq!(parse_line(line.as_bytes(), 1), Some(Err(status)), "{line}");
        }
    }

    #[test]
    fn the_manuals_lines_are_read() {
        reads("AMVP ABS, 1, 50000", [4, 0, 1, 0, 0, 0xC3, 0x50]);
        reads("A MST 1", [3, 0, 1, 0, 0, 0, 0]);
        assert_eq!(parse_line(b"ABIN", 1), Some(Ok(Request::Leave)));
    }

    #[test]
    fn case_and_blanks_do_not_matter() {
        reads("a   mvp rel ,1,-1 ", [4, 1, 1, 0xFF, 0xFF, 0xFF, 0xFF]);
        assert_eq!(parse_line(b"z bin", 26), Some(Ok(Request::Leave)));
    }

    #[test]
    fn words_stand_for_numbers_as_everywhere() {
        reads("ARFS START, 2", [13, 0, 2, 0, 0, 0, 0]);
        reads("ARFS STATUS, 2", [13, 2, 2, 0, 0, 0, 0]);
        reads("AMVP COORD, $47, 2", [4, 2, 0x47, 0, 0, 0, 2]);
        reads("AUF7", [71, 0, 0, 0, 0, 0, 0]);
    }

    #[test]
    fn run_and_stop_are_control_commands() {
        reads("ARUN", [129, 0, 0, 0, 0, 0, 0]);
        reads("a run 258", [129, 1, 0, 0, 0, 1, 2]);
        reads("ASTOP", [128, 0, 0, 0, 0, 0, 0]);
    }

    #[test]
    fn a_line_for_somebody_else_is_none() {
        for line in ["", " ", "BMST 0", "MST 0", " AMST 0", "?MST 0", "\u{e4}MST 0"] {
            assert_eq!(parse_line(line.as_bytes(), 1), None, "{line}");
        }
    }

    #[test]
    fn a_module_without_letter_is_never_meant() {
        for address in [0, 27, 32, 33, 255] {
            for first in 0..=u8::MAX {
                assert_eq!(parse_line(&[first, b'M', b'S', b'T', b' ', b'0'], address), None);
            }
        }
    }

    #[test]
    fn exactly_the_manuals_commands_may_be_typed() {
        let expected = Vec::from_iter((1..=15).chain(30..=32).chain(64..=71));
        let mut found = Vec::new();
        for form in FORMS.iter().filter(|form| form.opcode != Opcode::Stop) {
            let zeros = Vec::from_iter(form.operands.iter().map(|_| "0")).join(",");
            let request = parse_line(format!("A{} {zeros}", form.mnemonic).as_bytes(), 1).unwrap();
            match request {
                Ok(_) => found.push(form.opcode.number()),
                Err(status) => assert_eq!(status, Status::INVALID_COMMAND, "{form}"),
            }
        }
        assert_eq!(found, expected);
    }

    #[test]
    fn what_is_no_command_for_terminals_is_status_2_whatever_its_operands() {
        refuses(
            Status::INVALID_COMMAND,
            &[
                "A",
                "A  ",
                "A // MST 0",
                "AA MST 0",
                "AGO 1",
                "AMST0",
                "AWAIT FAST",
                "AJA 0",
                "A:MST 0",
            ],
        );
    }

    #[test]
    fn a_command_by_number_is_status_2() {
        refuses(Status::INVALID_COMMAND, &["A3 0, 0, 0", "A 137 0, 0, 1234", "A$03 0, 0, 0"]);
    }

    #[test]
    fn a_bad_type_or_bank_is_status_3() {
        refuses(
            Status::WRONG_TYPE,
            &["AMVP FAST, 0, 1", "AGAP 256, 0", "AGAP , 0", "AGGP 1, X", "ASIO 0, 256, 1"],
        );
    }

    #[test]
    fn a_bad_motor_or_value_or_count_of_operands_is_status_4() {
        refuses(
            Status::INVALID_VALUE,
            &["AMST X", "AMST 256", "AROR 0, 2147483648", "AROR 0, fast", "AROR 0, +5"],
        );
        refuses(
            Status::INVALID_VALUE,
            &["AMST", "AMST 0, 0", "AROR 0", "ABIN 1", "ASTOP 0", "ARUN x", "ARUN 0, 1", "AUF0 1"],
        );
        refuses(Status::INVALID_VALUE, &["ARUN 2147483648", "ARUN -"]);
    }

    #[test]
    fn a_line_that_is_not_ascii_is_status_2() {
        for line in [&b"AMST\xA00"[..], b"AMST 0\xFF", "AMST 0 // \u{e4}".as_bytes()] {
            assert_eq!(parse_line(line, 1), Some(Err(Status::INVALID_COMMAND)));
        }
    }

    #[test]
    fn a_line_may_have_80_characters_and_with_more_is_status_2() {
        let line = format!("{:80}", "AMST 1");
        reads(&line, [3, 0, 1, 0, 0, 0, 0]);
        refuses(Status::INVALID_COMMAND, &[&format!("{line} ")]);
    }

    #[test]
    fn the_longest_command_in_binary_fits() {
        let line = format!("A SAP %{:b}, %{:b}, -%{:b}", 254, 255, 1u32 << 31);
        assert_eq!(line.len(), 62);
        reads(&line, [5, 254, 255, 0x80, 0, 0, 0]);
    }
}
