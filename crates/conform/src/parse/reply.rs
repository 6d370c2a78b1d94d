//! Requests and the replies that are expected.

use opentmcl_wire::mnemonic;
use opentmcl_wire::serial::{self, FRAME_LEN};

use super::Begun;
use super::names::Names;
use super::number::small;
use crate::transcript::{DEFAULT_ADDRESS, ExpectedReply};

pub(super) fn request(text: &str) -> Result<Begun, String> {
    let (address, command) = match text.strip_prefix("module ") {
        None => (DEFAULT_ADDRESS, text),
        Some(rest) => {
            let (address, command) = rest
                .split_once(':')
                .ok_or("the colon is missing; write for example: > module 7: GAP 1, 0")?;
            (small(address.trim())?, command.trim())
        }
    };
    let command = mnemonic::parse(command).map_err(|error| error.to_string())?;
    let request = serial::encode_request(address, command);
    Ok(Begun::Request { text: text.to_owned(), request })
}

pub(super) fn is_expectation(line: &str) -> bool {
    line.starts_with('<') && !line.starts_with("<+") && !line.starts_with("<<+")
}

pub(super) fn expectation(line: &str, names: Names<'_>) -> Result<ExpectedReply, String> {
    if let Some(bytes) = line.strip_prefix("<<") {
        return Ok(ExpectedReply::Bytes(bytes_as_written(bytes)?));
    }
    let rest = line.strip_prefix('<').unwrap_or(line).trim();
    if rest == "silence" {
        return Ok(ExpectedReply::Silence);
    }
    status_and_value(rest, names)
}

pub(super) fn status_and_value(text: &str, names: Names<'_>) -> Result<ExpectedReply, String> {
    let mut words = text.split_whitespace();
    let status = words.next().ok_or("the status is missing; write for example: < 100")?;
    let status = small(status)?;
    let value = words.next().map(|value| names.range(value)).transpose()?;
    match words.next() {
        None => Ok(ExpectedReply::Status { status, value }),
        Some(word) => Err(format!("{word:?} is too much; write status and value: < 100 5")),
    }
}

pub(super) fn bytes_as_written(text: &str) -> Result<[Option<u8>; FRAME_LEN], String> {
    let mut bytes = [None; FRAME_LEN];
    let mut words = text.split_whitespace();
    for place in &mut bytes {
        let word = words.next().ok_or("a frame has 9 bytes; some are missing")?;
        if word != ".." {
            let byte = Some(word).filter(|word| word.len() == 2);
            let byte = byte.and_then(|word| u8::from_str_radix(word, 16).ok());
            *place = Some(byte.ok_or_else(|| {
                format!("{word:?} is no byte; write two hexadecimal digits, or .. for any")
            })?);
        }
    }
    match words.next() {
        None => Ok(bytes),
        Some(word) => Err(format!("a frame has 9 bytes; {word:?} is one too many")),
    }
}
