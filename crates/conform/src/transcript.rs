//! What a transcript says, line by line.

use std::fmt;
use std::ops::RangeInclusive;
use std::rc::Rc;

use opentmcl_catalog::Module;
use opentmcl_wire::serial::{self, FRAME_LEN};
use opentmcl_wire::{Command, Duration};

use crate::programs::{Assembled, ScenarioFile};

/// Address of the module unless a line names another one: the factory setting.
pub const DEFAULT_ADDRESS: u8 = 1;

/// One file, understood.
#[derive(Clone, Debug)]
pub struct Transcript {
    /// Where it comes from, as the user knows it.
    pub name: String,
    /// The module that it is about.
    pub module: &'static Module,
    /// What happens first in each case: the lines before the first `test`.
    pub setup: Vec<Step>,
    /// The cases; a file without a line `test` is one without a name, and has no set-up.
    pub cases: Vec<Case>,
}

impl Transcript {
    /// All steps in the order of the file.
    pub fn steps(&self) -> impl DoubleEndedIterator<Item = &Step> {
        self.setup.iter().chain(self.cases.iter().flat_map(|case| &case.steps))
    }
}

/// A part of a file that begins with a new module.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Case {
    /// What the line `test` calls it.
    pub name: Option<String>,
    /// The line where it begins.
    pub line: usize,
    /// What happens after the set-up, in order.
    pub steps: Vec<Step>,
}

/// One thing to do, and what must come of it.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Step {
    /// Line in the file, counted from 1.
    pub line: usize,
    /// What is to be done.
    pub kind: StepKind,
}

/// What a step does.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum StepKind {
    /// A request and its reply.
    Exchange(Exchange),
    /// One more reply must have come by now.
    ExtraReply(ExpectedReply),
    /// A program is loaded.
    Program(Program),
    /// Conditions hold now, each for itself.
    Expect(Vec<Condition>),
    /// Time passes until all conditions hold at once.
    WaitUntil {
        /// The line as it is written.
        text: String,
        /// The conditions.
        conditions: Vec<Condition>,
        /// How long this may take.
        at_most: Duration,
    },
    /// Time passes.
    Wait(Duration),
    /// The following requests use this line.
    Port(Line),
    /// The supply goes off and on.
    PowerCycle,
    /// A digital input changes.
    Input {
        /// Which input.
        number: u8,
        /// Its level from now on.
        high: bool,
    },
    /// An analog input changes.
    Analog {
        /// Which input.
        number: u8,
        /// What the converter reads from now on.
        reading: u16,
    },
    /// A new module takes the place of the present one.
    Fresh,
    /// A new module with the machines of this scenario takes the place of the present one, and each
    /// new one from now on has them.
    Scenario(ScenarioFile),
    /// Somebody does something to the module from outside.
    World(String),
    /// The stage itself stands here, whatever the module counts.
    Stage(Stage),
}

/// Where a stage should be.
#[derive(Clone, Debug, PartialEq)]
pub struct Stage {
    /// The expectation as it is written.
    pub text: String,
    /// Of which axis.
    pub axis: u8,
    /// Positions, both ends included.
    pub range: RangeInclusive<f64>,
    /// Their unit: `mm`, `deg` or `usteps`.
    pub unit: &'static str,
}

impl Eq for Stage {}

/// A request and what must answer it.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Exchange {
    /// The request as it is written in the file.
    pub text: String,
    /// The bytes to send.
    pub request: [u8; FRAME_LEN],
    /// What must come back.
    pub expected: ExpectedReply,
    /// Line of the expectation.
    pub expected_line: usize,
}

impl Exchange {
    /// The command that is sent, unless the bytes are damaged on purpose.
    pub fn command(&self) -> Option<Command> {
        serial::decode_request(self.request).ok().map(|request| request.command)
    }
}

/// What a reply must look like.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum ExpectedReply {
    /// No reply at all.
    Silence,
    /// This status, and if given a value within this range.
    Status {
        /// Status code.
        status: u8,
        /// Range of the value, both ends included.
        value: Option<RangeInclusive<i32>>,
    },
    /// These bytes, with `None` for any.
    Bytes([Option<u8>; FRAME_LEN]),
}

impl ExpectedReply {
    /// Whether it says more than that the command was executed: a value, a refusal, bytes or
    /// silence.
    pub fn is_telling(&self) -> bool {
        !matches!(self, Self::Status { status: 100 | 101, value: None })
    }
}

impl fmt::Display for ExpectedReply {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Silence => f.write_str("silence"),
            Self::Status { status, value: None } => write!(f, "status {status}"),
            Self::Status { status, value: Some(value) } if value.start() == value.end() => {
                write!(f, "status {status}, value {}", value.start())
            }
            Self::Status { status, value: Some(value) } => {
                write!(f, "status {status}, value {}..{}", value.start(), value.end())
            }
            Self::Bytes(bytes) => {
                for (at, byte) in bytes.iter().enumerate() {
                    f.write_str(if at == 0 { "" } else { " " })?;
                    match byte {
                        Some(byte) => write!(f, "{byte:02X}")?,
                        None => f.write_str("..")?,
                    }
                }
                Ok(())
            }
        }
    }
}

/// A program to load.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Program {
    /// Address of the first command.
    pub address: i32,
    /// What is loaded there.
    pub body: Body,
}

/// Where a program's commands stand.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Body {
    /// In lines of the transcript.
    Lines(Vec<SourceCommand>),
    /// In a file of their own.
    File(Rc<Assembled>),
}

impl Program {
    /// Its commands in their order.
    pub fn commands(&self) -> impl Iterator<Item = Command> {
        let (lines, file): (&[SourceCommand], &[Command]) = match &self.body {
            Body::Lines(lines) => (lines, &[]),
            Body::File(program) => (&[], &program.commands),
        };
        lines.iter().map(|line| line.command).chain(file.iter().copied())
    }
}

/// A command of a program.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct SourceCommand {
    /// Line in the file.
    pub line: usize,
    /// The command as it is written.
    pub text: String,
    /// The command.
    pub command: Command,
}

/// The line by which requests travel.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Line {
    /// USB, where the module's address is not checked.
    Usb,
    /// RS485.
    Rs485,
    /// RS232.
    Rs232,
}

/// Something that a command can be asked for, and what it should be.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Condition {
    /// The condition as it is written.
    pub text: String,
    /// The command whose reply tells.
    pub command: Command,
    /// What the value of the reply means.
    pub meaning: Meaning,
    /// Values, both ends included.
    pub range: RangeInclusive<i32>,
    /// Whether the value should lie outside of the range.
    pub outside: bool,
    /// What is expected, for people.
    pub expected: String,
}

impl Condition {
    /// Whether it holds with this value.
    pub fn is_met(&self, value: i32) -> bool {
        self.range.contains(&value) != self.outside
    }
}

/// What the value of a reply means to people.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Meaning {
    /// A number.
    Number,
    /// The level of an input or output.
    Level,
    /// Whether a position has been reached.
    Reached,
    /// What the program does: global parameter 128.
    Application,
    /// An address of the program.
    Address,
}

impl Meaning {
    /// A value in words.
    pub fn describe(self, value: i32) -> String {
        match (self, value) {
            (Self::Level, 0) => "low".into(),
            (Self::Level, 1) => "high".into(),
            (Self::Reached, 0) => "not reached".into(),
            (Self::Reached, 1) => "reached".into(),
            (Self::Application, 0 | 3) => "stopped".into(),
            (Self::Application, 1) => "running".into(),
            (Self::Application, 2) => "running, step by step".into(),
            (Self::Address, _) => format!("at address {value}"),
            _ => value.to_string(),
        }
    }
}
