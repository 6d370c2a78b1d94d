//! Edges of the text form and of the frame: what is refused, and what nearly looks like something else.

use opentmcl_wire::mnemonic::{ParseError, parse};
use opentmcl_wire::serial::{WrongChecksum, decode_reply};
use opentmcl_wire::{Command, mnemonic};

#[test]
fn a_number_has_one_sign_before_its_prefix_and_prefixes_in_both_cases() {
    assert_eq!(parse("SGP 1, 2, -0X1f"), parse("SGP 1, 2, -31"));
    for text in ["SGP 1, 2, --5", "SGP 1, 2, $-5", "SGP 1, 2, +5", "SGP 1, 2, 0x+5"] {
        assert!(matches!(parse(text), Err(ParseError::BadOperand { .. })), "{text}");
    }
}

#[test]
fn a_single_slash_begins_no_comment() {
    assert_eq!(parse("GAP 1, 0 // position"), parse("GAP 1, 0"));
    assert!(parse("GAP 1, 0 / position").is_err());
}

#[test]
fn a_command_by_number_takes_three_numbers() {
    for (text, found) in [("129", 0), ("129 1", 1), ("129 1, 0", 2), ("129 1, 0, 5, 6", 4)] {
        assert_eq!(parse(text), Err(ParseError::RawOperandCount { found }), "{text}");
    }
}

#[test]
fn a_command_is_shown_by_its_number_when_its_mnemonic_would_hide_a_field() {
    // STOP has no operands; JA has a value only.
    for command in [Command::new(28, 0, 3, 0), Command::new(22, 0, 3, 5), Command::new(28, 1, 0, 0)]
    {
        assert_eq!(mnemonic::parse(&command.to_string()), Ok(command), "{command}");
    }
}

#[test]
fn a_damaged_reply_names_the_host_it_was_for() {
    let damaged = [2, 1, 100, 6, 0, 0, 0, 0, 0];
    assert_eq!(decode_reply(damaged), Err(WrongChecksum { address: 2 }));
}
