//! The vendor's binary file: eight bytes for each command, and nothing else.
//!
//! A record is the command's number, type, motor, value (most significant byte first), and the sum of
//! these seven bytes. There is no header, no address and no end mark: the command 0 that the vendor's
//! tools send behind a program belongs to the download, so that a record of zeros in a file is a
//! command like any other.

use std::fmt;

use opentmcl_wire::Command;

/// Bytes of one record.
pub const RECORD_LEN: usize = 8;

/// The longest program that a file may hold. No module holds a tenth of it; it keeps a file that is
/// something else from filling the memory.
pub const MAX_COMMANDS: usize = 1 << 16;

/// How many bad records of a file are told.
pub const MAX_BAD_RECORDS: usize = 100;

/// A record that is not what it should be.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct BadRecord {
    /// Which one, from 0: the address of its command.
    pub number: usize,
    /// Where it begins in the file, in bytes.
    pub offset: usize,
    /// What is wrong with it.
    pub kind: BadRecordKind,
}

/// What is wrong with a record.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum BadRecordKind {
    /// The last byte is not the sum of the others.
    Checksum {
        /// What is there.
        found: u8,
        /// What should be there.
        expected: u8,
    },
    /// The file ends within the record.
    Truncated {
        /// How many bytes of it are there, 1..=7.
        length: usize,
    },
    /// There are more records than [`MAX_COMMANDS`]; this is the first of them.
    TooMany,
}

impl fmt::Display for BadRecord {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { number, offset, kind } = self;
        write!(f, "record {number} (from byte {offset}): ")?;
        match kind {
            BadRecordKind::Checksum { found, expected } => write!(
                f,
                "the checksum is ${found:02X}; the seven bytes before it add up to ${expected:02X}"
            ),
            BadRecordKind::Truncated { length } => {
                write!(f, "the file ends after {length} of its {RECORD_LEN} bytes")
            }
            BadRecordKind::TooMany => {
                write!(f, "one too many; a program has at most {MAX_COMMANDS} commands")
            }
        }
    }
}

impl std::error::Error for BadRecord {}

/// The record of one command.
pub fn record(command: Command) -> [u8; RECORD_LEN] {
    let [number, kind, motor, b3, b2, b1, b0] = command.to_bytes();
    [number, kind, motor, b3, b2, b1, b0, checksum(&command.to_bytes())]
}

/// The file of a program.
pub fn encode(commands: impl Iterator<Item = Command>) -> Vec<u8> {
    let mut bytes = Vec::with_capacity(commands.size_hint().0.saturating_mul(RECORD_LEN));
    for command in commands {
        bytes.extend(record(command));
    }
    bytes
}

/// The program of a file; an empty file is an empty program. Everything that is wrong with the file is
/// told at once, up to [`MAX_BAD_RECORDS`], in the order of the records.
pub fn decode(bytes: &[u8]) -> Result<Vec<Command>, Vec<BadRecord>> {
    let (records, rest) = bytes.as_chunks::<RECORD_LEN>();
    let mut commands = Vec::with_capacity(records.len().min(MAX_COMMANDS));
    let mut bad = Vec::new();
    for (number, &[fields @ .., found]) in records.iter().take(MAX_COMMANDS).enumerate() {
        let expected = checksum(&fields);
        if found != expected {
            bad.push(bad_record(number, BadRecordKind::Checksum { found, expected }));
            if bad.len() == MAX_BAD_RECORDS {
                return Err(bad);
            }
        }
        commands.push(Command::from_bytes(fields));
    }
    if bytes.len() > MAX_COMMANDS * RECORD_LEN {
        bad.push(bad_record(MAX_COMMANDS, BadRecordKind::TooMany));
    } else if !rest.is_empty() {
        let kind = BadRecordKind::Truncated { length: rest.len() };
        bad.push(bad_record(records.len(), kind));
    }
    if bad.is_empty() { Ok(commands) } else { Err(bad) }
}

fn bad_record(number: usize, kind: BadRecordKind) -> BadRecord {
    BadRecord { number, offset: number * RECORD_LEN, kind }
}

fn checksum(bytes: &[u8]) -> u8 {
    bytes.iter().fold(0, |sum, &byte| sum.wrapping_add(byte))
}
