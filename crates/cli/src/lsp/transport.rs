//! Messages from and to byte streams: `Content-Length: 17`, an empty line, JSON.
//!
//! `lsp_server` can do this too, but gives up at the first text that is not a message, and reserves
//! as much memory as the header asks for.

use std::io::{self, BufRead, Read, Write};
use std::sync::mpsc::{Receiver, channel};
use std::thread;

use lsp_server::{ErrorCode, Message};
use serde::Serialize;
use serde_json::{Value, json};

/// The longest message that is read, in bytes: the longest text that can be assembled, with each of
/// its bytes escaped.
const MAX_LEN: u64 = 6 * opentmcl_lang::MAX_TEXT as u64;

/// The longest line of a header, in bytes.
const MAX_HEADER_LEN: u64 = 1024;

/// What has come.
pub(super) enum Incoming {
    /// A message.
    Message(Message),
    /// Something that is none, and the answer to it.
    NotAMessage(Value),
    /// What makes it impossible to find the next message.
    Broken(String),
}

/// Reads standard input in a thread of its own; the end of it disconnects the receiver.
pub(super) fn incoming() -> Receiver<Incoming> {
    let (sender, receiver) = channel();
    thread::spawn(move || {
        let mut input = io::stdin().lock();
        while let Some(incoming) = read(&mut input) {
            let is_last = matches!(incoming, Incoming::Broken(_));
            if sender.send(incoming).is_err() || is_last {
                return;
            }
        }
    });
    receiver
}

/// The next message; `None` at the end of the stream.
fn read(input: &mut impl BufRead) -> Option<Incoming> {
    match body(input) {
        Ok(Some(body)) => Some(message(&body)),
        Ok(None) => None,
        Err(error) => Some(Incoming::Broken(error.to_string())),
    }
}

/// The text of the next message; nothing at the end of the stream.
fn body(input: &mut impl BufRead) -> io::Result<Option<Vec<u8>>> {
    let mut length = None;
    loop {
        let mut line = Vec::new();
        input.by_ref().take(MAX_HEADER_LEN).read_until(b'\n', &mut line)?;
        if line.is_empty() {
            return Ok(None);
        }
        if line.last() != Some(&b'\n') {
            return Err(wrong(format!("no header of a message: {}", shown(&line))));
        }
        let header = line.trim_ascii();
        if header.is_empty() {
            break;
        }
        let header = String::from_utf8_lossy(header);
        let Some((name, value)) = header.split_once(':') else {
            return Err(wrong(format!("no header of a message: {}", shown(&line))));
        };
        if name.trim().eq_ignore_ascii_case("Content-Length") {
            let value = value.trim().parse::<u64>().ok().filter(|&value| value <= MAX_LEN);
            let too_long = || wrong(format!("Content-Length must be a number up to {MAX_LEN}"));
            length = Some(value.ok_or_else(too_long)?);
        }
    }
    let Some(length) = length else {
        return Err(wrong("a message without Content-Length".into()));
    };
    // Grows with what comes, not with what is announced.
    let mut body = Vec::new();
    input.take(length).read_to_end(&mut body)?;
    Ok((body.len() as u64 == length).then_some(body))
}

fn message(body: &[u8]) -> Incoming {
    let value: Value = match serde_json::from_slice(body) {
        Ok(value) => value,
        Err(error) => return not_a_message(&Value::Null, ErrorCode::ParseError, &error),
    };
    let id = value.get("id").cloned().unwrap_or_default();
    match serde_json::from_value(value) {
        // A request whose identifier is neither a number nor a text reads as a notification.
        Ok(Message::Notification(_)) if !id.is_null() => {
            let error = "an identifier is a whole number of 32 bits or a text";
            not_a_message(&Value::Null, ErrorCode::InvalidRequest, &error)
        }
        Ok(message) => Incoming::Message(message),
        Err(_) => {
            let error = "neither a request nor a notification nor a response";
            not_a_message(&id, ErrorCode::InvalidRequest, &error)
        }
    }
}

fn not_a_message(id: &Value, code: ErrorCode, error: &dyn std::fmt::Display) -> Incoming {
    let error = json!({ "code": code as i32, "message": error.to_string() });
    Incoming::NotAMessage(json!({ "id": id, "error": error }))
}

fn wrong(message: String) -> io::Error {
    io::Error::new(io::ErrorKind::InvalidData, message)
}

/// The beginning of what came, as text.
fn shown(bytes: &[u8]) -> String {
    format!("{:?}", String::from_utf8_lossy(&bytes[..bytes.len().min(40)]))
}

/// Writes one message.
pub(super) fn write(output: &mut impl Write, message: &impl Serialize) -> io::Result<()> {
    #[derive(Serialize)]
    struct JsonRpc<'a, T> {
        jsonrpc: &'static str,
        #[serde(flatten)]
        message: &'a T,
    }
    let text = serde_json::to_string(&JsonRpc { jsonrpc: "2.0", message })?;
    write!(output, "Content-Length: {}\r\n\r\n{text}", text.len())?;
    output.flush()
}
