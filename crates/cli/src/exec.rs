//! `tmcl exec`: commands in direct mode.

use std::io::Write;

use opentmcl_link::{Connection, ConnectionError, answers_with_text};
use opentmcl_wire::serial::{self, AddressedReply, FRAME_LEN};
use opentmcl_wire::{Command, Status, control, mnemonic};
use serde::Serialize;

use crate::connect::ConnectArgs;
use crate::failure::Failure;
use crate::print;

/// Execute commands on a module and print the replies
///
/// Commands are executed one after the other; the first one that the module refuses ends it. The
/// output has the form of a transcript: the command behind `>`, status and value of the reply
/// behind `<`.
#[derive(clap::Args)]
#[command(after_help = EXAMPLES)]
pub(crate) struct Args {
    /// Commands in mnemonics, or as a number with type, motor and value: '129 0, 0, 0'
    #[arg(required = true, value_name = "COMMAND", value_parser = parse_command)]
    commands: Vec<Command>,
    #[command(flatten)]
    connect: ConnectArgs,
    /// Show the bytes of requests and replies
    #[arg(long)]
    raw: bool,
    /// Print one JSON object per command
    #[arg(long)]
    json: bool,
}

const EXAMPLES: &str = "\
Examples:
  tmcl exec -c /dev/ttyACM0 'ROR 0, 51200'
  tmcl exec -c tcp:127.0.0.1:4016 'SAP 4, 0, 100000' 'MVP ABS, 0, 512000' 'GAP 1, 0'
  tmcl exec -c virtual:tmcm-6214 --raw '136 1, 0, 0'";

fn parse_command(text: &str) -> Result<Command, String> {
    mnemonic::parse(text).map_err(|error| error.to_string())
}

/// What came back, as `--json` prints it.
#[derive(Serialize)]
struct Executed {
    command: String,
    #[serde(flatten)]
    answer: Answer,
    #[serde(skip_serializing_if = "Option::is_none")]
    request_bytes: Option<String>,
    #[serde(skip_serializing_if = "Option::is_none")]
    reply_bytes: Option<String>,
}

#[derive(Serialize)]
#[serde(untagged)]
enum Answer {
    Reply {
        status: u8,
        meaning: Option<&'static str>,
        value: i32,
    },
    /// Command 136 type 0 answers with text and neither a status nor a checksum.
    Version {
        version: String,
    },
    /// Command 134 answers with a command of the program in place of status and value.
    Stored {
        stored: String,
    },
}

/// Executes the commands.
pub(crate) fn run(args: &Args) -> Result<(), Failure> {
    let mut connection = args.connect.open()?;
    let mut out = anstream::stdout().lock();
    for &command in &args.commands {
        let executed = execute(connection.as_mut(), args, command)?;
        if args.json {
            print::json_line(&mut out, &executed)?;
        } else {
            print(&mut out, &executed)?;
        }
        if let Answer::Reply { status, .. } = executed.answer
            && !Status(status).is_ok()
        {
            return Err(Failure::new(format!(
                "{}: the module answers with status {}",
                executed.command,
                Status(status)
            )));
        }
    }
    Ok(())
}

fn execute(
    connection: &mut dyn Connection,
    args: &Args,
    command: Command,
) -> Result<Executed, Failure> {
    let request = serial::encode_request(args.connect.address, command);
    let frame = connection.exchange(request)?;
    let answer = if answers_with_text(command) {
        let version = String::from_utf8_lossy(&frame[1..]).into_owned();
        Answer::Version { version }
    } else if let Some(stored) = stored_command(command, frame) {
        Answer::Stored { stored: stored.to_string() }
    } else {
        let Ok(AddressedReply { reply, .. }) = serial::decode_reply(frame) else {
            return Err(ConnectionError::DamagedReply(frame).into());
        };
        let (status, value) = (reply.status.0, reply.value);
        Answer::Reply { status, meaning: reply.status.meaning(), value }
    };
    let hex = |bytes| args.raw.then(|| hex(bytes));
    Ok(Executed {
        command: command.to_string(),
        answer,
        request_bytes: hex(request),
        reply_bytes: hex(frame),
    })
}

/// The command of the program that a reply to command 134 holds. A refusal is a general reply, which
/// names the number 134 where the other layout has a motor that no module has.
fn stored_command(command: Command, frame: [u8; FRAME_LEN]) -> Option<Command> {
    let stored = serial::decode_request(frame).ok()?.command;
    let is_refusal = stored.motor == control::READ_PROGRAM;
    (command.number == control::READ_PROGRAM && !is_refusal).then_some(stored)
}

/// Writes the exchange as lines of a transcript.
fn print(out: &mut impl Write, executed: &Executed) -> std::io::Result<()> {
    let Executed { command, answer, request_bytes, reply_bytes } = executed;
    if let (Some(request), Some(reply)) = (request_bytes, reply_bytes) {
        writeln!(out, "# {command}\n>> {request}\n<< {reply}")?;
        return match answer {
            Answer::Reply { status, value, .. } => writeln!(out, "# {status} {value}"),
            Answer::Version { version: text } | Answer::Stored { stored: text } => {
                writeln!(out, "# {text}")
            }
        };
    }
    writeln!(out, "> {command}")?;
    match answer {
        Answer::Reply { status, value, .. } => writeln!(out, "< {status} {value}"),
        Answer::Version { version: text } | Answer::Stored { stored: text } => {
            writeln!(out, "# {text}")
        }
    }
}

fn hex(bytes: [u8; FRAME_LEN]) -> String {
    bytes.map(|byte| format!("{byte:02X}")).join(" ")
}
