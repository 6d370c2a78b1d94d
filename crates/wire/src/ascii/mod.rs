//! The ASCII interface: a serial line as a person at a terminal uses it, in place of 9-byte frames.
//!
//! A line is the letter of the module's address, the command as [`crate::mnemonic`] reads it, and CR:
//! `AMVP ABS, 1, 50000`. The answer is the letters of host and module, status and value:
//! `BA 100 -5000`. Binary command 139 enters, `BIN` leaves; global parameter 67 has the mode after
//! power-up ([`starts_in_ascii`]) and the [`Echo`].
//!
//! - [`LineEditor`] takes bytes as they arrive, yields what to echo and, with the end of a line, what it asks.
//! - [`parse_line`] reads one whole line.
//! - [`encode_reply`] writes the answer.
//!
//! Sources: manuals of the TMCM-6110 and TMCM-351, which agree.
//!
//! # Readings
//!
//! The manuals have three examples of lines and one of a reply. Beyond them:
//!
//! - Letters of addresses and names of commands may be written in either case; replies use upper case.
//! - Addresses 1 to 26 have a letter, as far as the alphabet goes. A module with another address cannot be
//!   meant by any line, and says nothing. A reply to a host without letter begins with `?`.
//! - Operands are written as everywhere in text: words or numbers, decimal, `$` or `0x` hexadecimal or `%`
//!   binary; what follows `//` is a comment. Commands by number (`4 0, 1, 500`) are unknown: the notation has
//!   none, and with them any command could be given.
//! - SAC, which older lists contain, is unknown.
//! - RUN and STOP are the control commands 129 and 128. RUN may name the address at which the program starts;
//!   without one it goes on where it stands.
//! - Every line to this module is answered once. What cannot be read: an unknown command, none at all, a
//!   line that is too long or not ASCII is status 2; an operand for the type field or a bank, status 3; a
//!   motor, a value, and too few or too many operands, status 4.
//! - CR ends a line, and so does LF, for terminals that send nothing else. An empty line is for nobody, so
//!   the LF of a terminal that sends both is without effect.
//! - Backspace (8) and delete (127) both take back a character, with any echo. All other control characters
//!   are ignored, a tabulator too. Blanks before the letter of the address are ignored.
//! - The echo begins with the letter of this module and ends with CR, whatever ended the line. If backspaces
//!   take back the letter, the next character decides anew who is meant.
//! - Echo bits 4 and 5 both set: no echo.
//! - On a bus a reply is heard by all and begins with the letter of the host. A module that has the address of
//!   the host takes it for a line, and answers it: do not give a module that address.

mod editor;
mod reply;
mod request;
mod text;

pub use editor::{ECHO_MAX, LineEditor, Typed};
pub use reply::{REPLY_MAX, encode_reply};
pub use request::{LINE_MAX, Request, parse_line};
pub use text::Text;

/// The letter that stands for the address of a module or a host, `A` for 1; there are 26.
pub const fn letter(address: u8) -> Option<u8> {
    match address {
        1..=26 => Some(b'A' + (address - 1)),
        _ => None,
    }
}

/// Whether a module with this value of global parameter 67 is in ASCII mode after power-up (bit 0).
pub const fn starts_in_ascii(parameter: i32) -> bool {
    parameter & 1 != 0
}

/// What the module sends back of what is typed to it.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub enum Echo {
    /// Each character as it is typed; a backspace removes it from the screen.
    #[default]
    Characters,
    /// The whole line, after its CR.
    Line,
    /// Nothing, so that the reply is all that is sent.
    Off,
}

impl Echo {
    /// The echo that bits 4 and 5 of global parameter 67 ask for.
    pub const fn from_parameter(parameter: i32) -> Self {
        match parameter >> 4 & 3 {
            0 => Self::Characters,
            1 => Self::Line,
            _ => Self::Off,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn letters_are_those_of_the_alphabet_from_address_1_on() {
        let letters = (0..=u8::MAX).filter_map(letter);
        assert!(letters.eq(*b"ABCDEFGHIJKLMNOPQRSTUVWXYZ"));
        assert_eq!(letter(1), Some(b'A'));
        assert_eq!(letter(26), Some(b'Z'));
    }

    #[test]
    fn the_vendors_three_values_of_parameter_67_start_in_ascii_mode_each_with_its_echo() {
        let modes = [(0x01, Echo::Characters), (0x11, Echo::Line), (0x21, Echo::Off)];
        for (parameter, echo) in modes {
            assert!(starts_in_ascii(parameter));
            assert_eq!(Echo::from_parameter(parameter), echo);
            assert!(!starts_in_ascii(parameter - 1));
            assert_eq!(Echo::from_parameter(parameter - 1), echo);
        }
        assert_eq!(Echo::from_parameter(0x31), Echo::Off);
    }
}
