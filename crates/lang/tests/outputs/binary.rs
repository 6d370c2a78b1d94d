//! The binary file.

use opentmcl_lang::binary::{
    BadRecord, BadRecordKind, MAX_BAD_RECORDS, MAX_COMMANDS, RECORD_LEN, decode, encode,
};
use opentmcl_wire::Command;
use proptest::prelude::*;

use super::commands;

#[test]
fn a_record_is_the_command_and_the_sum_of_its_bytes() {
    // $04 + $01 + $FF + $FF + $38 = $23B, of which a byte keeps $3B.
    let text = "VECT 3, 5\nMVP REL, 0, 51200\nMVP REL, 0, -51200\nRETI";
    let bytes = encode(commands(text).into_iter());
    let expected = [
        [0x25, 0x03, 0x00, 0x00, 0x00, 0x00, 0x05, 0x2D],
        [0x04, 0x01, 0x00, 0x00, 0x00, 0xC8, 0x00, 0xCD],
        [0x04, 0x01, 0x00, 0xFF, 0xFF, 0x38, 0x00, 0x3B],
        [0x26, 0x00, 0x00, 0x00, 0x00, 0x00, 0x00, 0x26],
    ];
    assert_eq!(bytes, expected.as_flattened());
}

#[test]
fn an_empty_file_is_an_empty_program() {
    assert_eq!(decode(&[]), Ok(vec![]));
    assert_eq!(encode([].into_iter()), []);
}

#[test]
fn zeros_at_the_end_are_a_command() {
    let stop = Command::new(28, 0, 0, 0);
    let bytes = [[0x1C, 0, 0, 0, 0, 0, 0, 0x1C], [0; 8]];
    assert_eq!(decode(bytes.as_flattened()), Ok(vec![stop, Command::new(0, 0, 0, 0)]));
}

#[test]
fn every_bad_record_is_told() {
    let mut bytes = [[0x1C, 0, 0, 0, 0, 0, 0, 0x1C]; 4].as_flattened().to_vec();
    bytes[15] = 0x1D;
    bytes[24] = 0x1B;
    bytes.extend([0x16, 0, 0]);
    let bad = decode(&bytes).unwrap_err();
    let told: Vec<_> = bad.iter().map(BadRecord::to_string).collect();
    assert_eq!(
        told,
        [
            "record 1 (from byte 8): the checksum is $1D; the seven bytes before it add up to $1C",
            "record 3 (from byte 24): the checksum is $1C; the seven bytes before it add up to $1B",
            "record 4 (from byte 32): the file ends after 3 of its 8 bytes",
        ]
    );
}

#[test]
fn a_file_that_is_something_else_is_told_in_a_few_words() {
    let bad = decode(&[b'x'; 100_000]).unwrap_err();
    assert_eq!(bad.len(), MAX_BAD_RECORDS);
}

#[test]
fn a_file_longer_than_any_program_is_refused() {
    let longest = vec![0; MAX_COMMANDS * RECORD_LEN];
    assert_eq!(decode(&longest).map(|commands| commands.len()), Ok(MAX_COMMANDS));

    let too_long = vec![0; MAX_COMMANDS * RECORD_LEN + 1];
    let bad = decode(&too_long).unwrap_err();
    let expected = BadRecord {
        number: MAX_COMMANDS,
        offset: MAX_COMMANDS * RECORD_LEN,
        kind: BadRecordKind::TooMany,
    };
    assert_eq!(bad, [expected]);
    let message =
        "record 65536 (from byte 524288): one too many; a program has at most 65536 commands";
    assert_eq!(expected.to_string(), message);
}

proptest! {
    #[test]
    fn whatever_is_written_is_read_again(fields in prop::collection::vec(any::<(u8, u8, u8, i32)>(), 0..50)) {
        let commands: Vec<_> = fields
            .into_iter()
            .map(|(number, kind, motor, value)| Command::new(number, kind, motor, value))
            .collect();
        prop_assert_eq!(decode(&encode(commands.iter().copied())), Ok(commands));
    }

    #[test]
    fn any_bytes_are_a_program_or_told_to_be_none(bytes in prop::collection::vec(any::<u8>(), 0..100)) {
        match decode(&bytes) {
            Ok(commands) => prop_assert_eq!(encode(commands.into_iter()), bytes),
            Err(bad) => prop_assert!(!bad.is_empty()),
        }
    }
}
