//! A reply as text.

use super::{Text, letter};
use crate::Reply;

/// The longest reply in bytes: two letters, a status of three digits, the smallest value with its sign, two
/// blanks and CR.
pub const REPLY_MAX: usize = 2 + 1 + 3 + 1 + 11 + 1;

/// The reply of the module with one address to the host with another: `BA 100 -5000` and CR. An address
/// without letter is written as `?`; the number of the command is not part of the text.
///
/// ```
/// use opentmcl_wire::ascii::encode_reply;
/// use opentmcl_wire::{Reply, Status};
///
/// let reply = Reply { status: Status::OK, number: 6, value: -5000 };
/// assert_eq!(encode_reply(2, 1, reply).as_bytes(), b"BA 100 -5000\r");
/// ```
pub fn encode_reply(host: u8, module: u8, reply: Reply) -> Text {
    let mut text = Text::new();
    for address in [host, module] {
        text.push(&[letter(address).unwrap_or(b'?')]);
    }
    for number in [i32::from(reply.status.0), reply.value] {
        text.push(b" ");
        push_number(&mut text, number);
    }
    text.push(b"\r");
    text
}

fn push_number(text: &mut Text, number: i32) {
    if number < 0 {
        text.push(b"-");
    }
    let mut rest = number.unsigned_abs();
    let mut digits = [0; 10];
    let mut count = 0;
    for digit in &mut digits {
        *digit = b'0' + (rest % 10) as u8;
        count += 1;
        rest /= 10;
        if rest == 0 {
            break;
        }
    }
    for &digit in digits.iter().take(count).rev() {
        text.push(&[digit]);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Status;
    use std::format;

    #[track_caller]
    fn writes(host: u8, module: u8, status: u8, value: i32, text: &str) {
        let reply = Reply { status: Status(status), number: 6, value };
        assert_eq!(encode_reply(host, module, reply).as_bytes(), text.as_bytes());
    }

    #[test]
    fn the_manuals_reply_is_written() {
        writes(2, 1, 100, -5000, "BA 100 -5000\r");
    }

    #[test]
    fn the_longest_reply_is_whole_and_has_the_stated_length() {
        let text = "ZZ 255 -2147483648\r";
        assert_eq!(text.len(), REPLY_MAX);
        writes(26, 26, 255, i32::MIN, text);
    }

    #[test]
    fn an_address_without_letter_is_a_question_mark() {
        writes(0, 27, 2, 0, "?? 2 0\r");
    }

    #[test]
    fn numbers_are_decimal_without_zeros_in_front() {
        for at in 0..31 {
            for value in [1 << at, (1 << at) - 1, -(1 << at), 10i32.pow(at % 10)] {
                writes(1, 2, at as u8 + 95, value, &format!("AB {} {value}\r", at + 95));
            }
        }
        writes(1, 2, 100, i32::MAX, "AB 100 2147483647\r");
    }
}
