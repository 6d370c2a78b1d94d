//! Bytes from a terminal to lines, and what the terminal gets to see of them.

use super::Echo;
use super::request::{LINE_MAX, Request, is_letter_of, parse_line};
use crate::Status;

const BACKSPACE: u8 = 0x08;
const LF: u8 = b'\n';
const CR: u8 = b'\r';
const DELETE: u8 = 0x7F;

/// Overwrites the character before the cursor with a blank and stays in front of that.
const RUB_OUT: &[u8] = &[BACKSPACE, b' ', BACKSPACE];

/// Characters of a line that are kept: one more than it may have, so that it is known to be too long.
const KEPT: usize = LINE_MAX + 1;

/// The most bytes that one byte from the terminal can make the module echo: a line that is too long, as far
/// as it is kept, and CR.
pub const ECHO_MAX: usize = KEPT + 1;

/// What one byte from the terminal leads to.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Typed<'a> {
    /// What to send back before any reply, at most [`ECHO_MAX`] bytes.
    pub echo: &'a [u8],
    /// What a line asked that ended with this byte, if it was for this module: a request, or the status to
    /// answer, with value 0, if it cannot be read. Either takes exactly one reply.
    pub request: Option<Result<Request, Status>>,
}

/// Collects the bytes of one line, as a module in ASCII mode does.
///
/// Any bytes may come. Lines for other modules are passed over without echo; backspaces work in them too,
/// so that all modules on a bus agree on who is meant.
///
/// ```
/// use opentmcl_wire::ascii::{Echo, LineEditor, Request};
/// use opentmcl_wire::Command;
///
/// let mut editor = LineEditor::new();
/// let (mut screen, mut requests) = (Vec::new(), Vec::new());
/// for &byte in b"BMST 0\rAMST 1\r" {
///     let typed = editor.push(byte, 1, Echo::Characters);
///     screen.extend_from_slice(typed.echo);
///     requests.extend(typed.request);
/// }
/// assert_eq!(screen, b"AMST 1\r");
/// assert_eq!(requests, [Ok(Request::Command(Command::new(3, 0, 1, 0)))]);
/// ```
#[derive(Clone, Debug)]
pub struct LineEditor {
    /// The first characters of the line, and room for CR.
    line: [u8; ECHO_MAX],
    /// Characters of the line, kept or not.
    len: usize,
    /// The module's address when the line began: a line is for whoever was meant then.
    address: u8,
    /// The character to echo.
    last: u8,
}

impl Default for LineEditor {
    fn default() -> Self {
        Self::new()
    }
}

impl LineEditor {
    /// An editor that waits for the first character of a line.
    pub const fn new() -> Self {
        Self { line: [0; ECHO_MAX], len: 0, address: 0, last: 0 }
    }

    /// Whether no line has begun, or all of it has been taken back.
    pub const fn is_empty(&self) -> bool {
        self.len == 0
    }

    /// Takes the next byte, as the module that has this `address` and `echo`. Both may change at any time;
    /// a new address holds from the next line on.
    pub fn push(&mut self, byte: u8, address: u8, echo: Echo) -> Typed<'_> {
        match byte {
            // Of CR and LF the second ends an empty line, which asks nothing.
            CR | LF => self.end(echo),
            BACKSPACE | DELETE => self.take_back(echo),
            b' ' if self.len == 0 => Typed::default(),
            _ if byte.is_ascii_control() => Typed::default(),
            _ => self.add(byte, address, echo),
        }
    }

    fn add(&mut self, character: u8, address: u8, echo: Echo) -> Typed<'_> {
        if self.len == 0 {
            self.address = address;
        }
        if let Some(place) = self.line.get_mut(self.len) {
            *place = character;
        }
        self.len = self.len.saturating_add(1);
        self.last = character;
        self.echo_at_once(core::slice::from_ref(&self.last), echo)
    }

    fn take_back(&mut self, echo: Echo) -> Typed<'_> {
        let Some(len) = self.len.checked_sub(1) else {
            return Typed::default();
        };
        self.len = len;
        self.echo_at_once(RUB_OUT, echo)
    }

    /// The echo of something typed into a line, or out of it. Its first character has been typed, and is
    /// still there if it has just been taken back.
    fn echo_at_once<'a>(&'a self, bytes: &'a [u8], echo: Echo) -> Typed<'a> {
        let is_for_me = self.line.first().is_some_and(|&first| is_letter_of(first, self.address));
        let is_echoed = is_for_me && echo == Echo::Characters;
        Typed { echo: if is_echoed { bytes } else { &[] }, request: None }
    }

    fn end(&mut self, echo: Echo) -> Typed<'_> {
        let kept = core::mem::take(&mut self.len).min(KEPT);
        let request = parse_line(self.line.get(..kept).unwrap_or_default(), self.address);
        if request.is_none() {
            return Typed::default();
        }
        if let Some(place) = self.line.get_mut(kept) {
            *place = CR;
        }
        let echo = match echo {
            Echo::Characters => &[CR],
            Echo::Line => self.line.get(..=kept).unwrap_or_default(),
            Echo::Off => &[],
        };
        Typed { echo, request }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Command;
    use std::vec::Vec;

    type Answer = Result<Request, Status>;

    fn stop(motor: u8) -> Answer {
        Ok(Request::Command(Command::new(3, 0, motor, 0)))
    }

    /// Everything echoed to the module at address 1, and everything asked of it.
    fn type_in(bytes: &[u8], echo: Echo) -> (Vec<u8>, Vec<Answer>) {
        let mut editor = LineEditor::new();
        let (mut echoed, mut requests) = (Vec::new(), Vec::new());
        for &byte in bytes {
            let typed = editor.push(byte, 1, echo);
            assert!(typed.echo.len() <= ECHO_MAX);
            echoed.extend_from_slice(typed.echo);
            requests.extend(typed.request);
        }
        (echoed, requests)
    }

    #[track_caller]
    fn echoes(bytes: &[u8], characters: &[u8], line: &[u8]) {
        assert_eq!(type_in(bytes, Echo::Characters).0, characters);
        assert_eq!(type_in(bytes, Echo::Line).0, line);
        assert_eq!(type_in(bytes, Echo::Off).0, b"");
    }

    #[track_caller]
    fn asks(bytes: &[u8], requests: &[Answer]) {
        for echo in [Echo::Characters, Echo::Line, Echo::Off] {
            assert_eq!(type_in(bytes, echo).1, requests, "{echo:?}");
        }
    }

    #[test]
    fn each_character_is_echoed_when_it_is_typed_and_a_whole_line_after_its_cr() {
        let mut editor = LineEditor::new();
        for byte in *b"AMST 1" {
            assert_eq!(editor.push(byte, 1, Echo::Characters).echo, [byte]);
        }
        assert_eq!(editor.push(CR, 1, Echo::Characters).echo, b"\r");
        for byte in *b"AMST 1" {
            assert_eq!(editor.push(byte, 1, Echo::Line).echo, b"");
        }
        assert_eq!(editor.push(CR, 1, Echo::Line).echo, b"AMST 1\r");
    }

    #[test]
    fn backspace_and_delete_take_back_a_character_and_remove_it_from_the_screen() {
        for key in [BACKSPACE, DELETE] {
            let typed = [b"AMST 12", &[key][..], b"\r"].concat();
            echoes(&typed, b"AMST 12\x08 \x08\r", b"AMST 1\r");
            asks(&typed, &[stop(1)]);
        }
    }

    #[test]
    fn lines_for_others_are_neither_echoed_nor_answered() {
        echoes(b"BMST 0\r\r\n  \r?\rMST 0\x7F1\r\xC1MST 0\r", b"", b"");
        asks(b"BMST 0\r\r\n  \r?\rMST 0\x7F1\r\xC1MST 0\r", &[]);
    }

    #[test]
    fn who_is_meant_may_be_corrected() {
        echoes(b"B\x08AMST 1\r", b"AMST 1\r", b"AMST 1\r");
        asks(b"B\x08AMST 1\r", &[stop(1)]);
        echoes(b"A\x08BMST 1\r", b"A\x08 \x08", b"");
        asks(b"A\x08BMST 1\r", &[]);
        echoes(b"\x08\x08AMST 1\r", b"AMST 1\r", b"AMST 1\r");
    }

    #[test]
    fn cr_and_lf_and_both_end_a_line_once() {
        asks(
            b"AMST 0\rAMST 1\nAMST 2\r\nAMST 3\r\n\nAMST 4\n\rAMST 5\r",
            &[0, 1, 2, 3, 4, 5].map(stop),
        );
        echoes(b"AMST 0\r\nAMST 1\n", b"AMST 0\rAMST 1\r", b"AMST 0\rAMST 1\r");
    }

    #[test]
    fn other_control_characters_and_blanks_before_the_letter_are_ignored() {
        echoes(b"\0 \x1B A\tM\0ST\x07 1\r", b"AMST 1\r", b"AMST 1\r");
        asks(b"\0 \x1B A\tM\0ST\x07 1\r", &[stop(1)]);
    }

    #[test]
    fn a_line_that_cannot_be_read_is_answered_with_a_status() {
        let invalid = Err(Status::INVALID_COMMAND);
        asks(
            b"A\rA \rAGO\rAMST\xE4 0\rAMST\r",
            &[invalid, invalid, invalid, invalid, Err(Status::INVALID_VALUE)],
        );
    }

    #[test]
    fn a_line_that_is_too_long_is_answered_with_status_2() {
        let longest = [b"AMST 1", &[b' '; LINE_MAX - 6][..]].concat();
        let [fits, long, longer] =
            [0, 1, 1000].map(|surplus| [&longest[..], &[b' '].repeat(surplus), b"\r"].concat());
        asks(&fits, &[stop(1)]);
        asks(&long, &[Err(Status::INVALID_COMMAND)]);
        asks(&longer, &[Err(Status::INVALID_COMMAND)]);
        echoes(&fits, &fits, &fits);
        echoes(&longer, &longer, &long);
    }

    #[test]
    fn a_line_that_was_too_long_fits_again_after_backspaces() {
        let typed = [b"AMST 1", &[b' '; 200][..], &[BACKSPACE; 200], b"2\r"].concat();
        asks(&typed, &[Ok(Request::Command(Command::new(3, 0, 12, 0)))]);
    }

    #[test]
    fn a_new_address_holds_from_the_next_line_on() {
        let mut editor = LineEditor::new();
        let mut type_as = |bytes: &[u8], address| {
            let typed = bytes.iter().map(|&byte| editor.push(byte, address, Echo::Off).request);
            typed.last().flatten()
        };
        assert_eq!(type_as(b"AMST", 1), None);
        assert_eq!(type_as(b" 1\r", 2), Some(stop(1)));
        assert_eq!(type_as(b"AMST 1\r", 2), None);
        assert_eq!(type_as(b"BMST 1\r", 2), Some(stop(1)));
    }

    #[test]
    fn an_editor_is_empty_between_two_lines_and_after_backspaces() {
        let mut editor = LineEditor::new();
        let mut is_empty_after = |byte| {
            editor.push(byte, 1, Echo::Off);
            editor.is_empty()
        };
        // The line of another module is one, too.
        let keys = [(b' ', true), (b'B', false), (b'1', false), (8, false), (8, true), (8, true)];
        for (key, is_empty) in keys.into_iter().chain([(b'B', false), (CR, true)]) {
            assert_eq!(is_empty_after(key), is_empty, "{key}");
        }
    }

    #[test]
    fn the_echo_may_change_within_a_line() {
        let mut editor = LineEditor::new();
        assert_eq!(editor.push(b'A', 1, Echo::Off).echo, b"");
        assert_eq!(editor.push(b'M', 1, Echo::Characters).echo, b"M");
        assert_eq!(editor.push(CR, 1, Echo::Line).echo, b"AM\r");
    }
}
