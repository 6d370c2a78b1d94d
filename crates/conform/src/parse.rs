//! Text to steps. A file is read to its end whatever is wrong with it, and all of it is told.

use std::fmt;
use std::ops::RangeInclusive;

use opentmcl_catalog::{MODULES, Module};
use opentmcl_wire::serial::{self, FRAME_LEN};
use opentmcl_wire::{Command, Duration, mnemonic};

/// Address of the module unless a line names another one: the factory setting.
pub const DEFAULT_ADDRESS: u8 = 1;

/// One file, understood.
#[derive(Clone, Debug)]
pub struct Transcript {
    /// Where it comes from, as the user knows it.
    pub name: String,
    /// The module that it is about.
    pub module: &'static Module,
    /// What happens, in order.
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
}

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
    /// The commands.
    pub commands: Vec<SourceCommand>,
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

/// What is wrong with a line, and what would be right.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("{name}:{line}: {message}")]
pub struct Mistake {
    /// The file, as given to [`parse`].
    pub name: String,
    /// Line in the file, counted from 1.
    pub line: usize,
    /// What is wrong and what would be right.
    pub message: String,
}

/// Reads a transcript.
///
/// # Errors
/// Every line that means nothing, in the order of the file.
pub fn parse(name: &str, text: &str) -> Result<Transcript, Vec<Mistake>> {
    let mut parser = Parser { name, module: None, steps: Vec::new(), mistakes: Vec::new() };
    let mut lines = text
        .lines()
        .enumerate()
        .map(|(at, line)| (at + 1, line.trim()))
        .filter(|(_, line)| !line.is_empty() && !line.starts_with('#'))
        .peekable();
    if let Some((number, line)) = lines.next() {
        parser.module_line(number, line);
    } else {
        parser.mistake(1, "the file is empty; begin with: module tmcm-6214");
    }
    while let Some((number, line)) = lines.next() {
        match parser.step(number, line) {
            Ok(Begun::Step(kind)) => parser.steps.push(Step { line: number, kind }),
            Ok(Begun::Request { text, request }) => match lines.peek() {
                Some(&(expected_line, reply)) if is_expectation(reply) => {
                    lines.next();
                    match expectation(reply) {
                        Ok(expected) => {
                            let exchange = Exchange { text, request, expected, expected_line };
                            let kind = StepKind::Exchange(exchange);
                            parser.steps.push(Step { line: number, kind });
                        }
                        Err(message) => parser.mistake(expected_line, message),
                    }
                }
                _ => parser.mistake(number, "no reply is expected; add for example: < 100"),
            },
            Ok(Begun::Program { address }) => {
                let mut commands = Vec::new();
                let mut ended = false;
                for (number, line) in lines.by_ref() {
                    if line == "end" {
                        ended = true;
                        break;
                    }
                    match mnemonic::parse(line) {
                        Ok(command) => {
                            commands.push(SourceCommand {
                                line: number,
                                text: line.into(),
                                command,
                            });
                        }
                        Err(error) => parser.mistake(number, error),
                    }
                }
                if !ended {
                    parser.mistake(number, "the program has no end; write a line: end");
                }
                let kind = StepKind::Program(Program { address, commands });
                parser.steps.push(Step { line: number, kind });
            }
            Err(message) => parser.mistake(number, message),
        }
    }
    parser.mistakes.sort_by_key(|mistake| mistake.line);
    match parser.module {
        Some(module) if parser.mistakes.is_empty() => {
            Ok(Transcript { name: name.to_owned(), module, steps: parser.steps })
        }
        _ => Err(parser.mistakes),
    }
}

/// A line that is a step, or the beginning of one.
enum Begun {
    Step(StepKind),
    Request { text: String, request: [u8; FRAME_LEN] },
    Program { address: i32 },
}

struct Parser<'a> {
    name: &'a str,
    module: Option<&'static Module>,
    steps: Vec<Step>,
    mistakes: Vec<Mistake>,
}

impl Parser<'_> {
    fn mistake(&mut self, line: usize, message: impl ToString) {
        let message = message.to_string();
        self.mistakes.push(Mistake { name: self.name.to_owned(), line, message });
    }

    fn module_line(&mut self, number: usize, line: &str) {
        let Some(name) = line.strip_prefix("module ") else {
            return self.mistake(number, "the first line must name the module: module tmcm-6214");
        };
        self.module = opentmcl_catalog::find(name.trim());
        if self.module.is_none() {
            let known: Vec<_> = MODULES.iter().map(|module| module.name).collect();
            let name = name.trim();
            self.mistake(number, format!("unknown module {name:?}; known: {}", known.join(", ")));
        }
    }

    fn step(&self, line_number: usize, line: &str) -> Result<Begun, String> {
        if let Some(bytes) = line.strip_prefix(">>") {
            let request = bytes_as_written(bytes)?;
            let request = request.map(|byte| byte.ok_or("a request cannot leave bytes open (..)"));
            let mut frame = [0; FRAME_LEN];
            for (place, byte) in frame.iter_mut().zip(request) {
                *place = byte?;
            }
            return Ok(Begun::Request { text: bytes.trim().to_owned(), request: frame });
        }
        if let Some(text) = line.strip_prefix('>') {
            return request(text.trim());
        }
        if let Some(extra) = line.strip_prefix("<+") {
            return Ok(Begun::Step(StepKind::ExtraReply(status_and_value(extra)?)));
        }
        if let Some(extra) = line.strip_prefix("<<+") {
            let bytes = bytes_as_written(extra)?;
            return Ok(Begun::Step(StepKind::ExtraReply(ExpectedReply::Bytes(bytes))));
        }
        if line.starts_with('<') {
            return Err("a reply follows no request; write the request with > before it".into());
        }
        let words: Vec<&str> = line.split_whitespace().collect();
        let kind = match words.as_slice() {
            ["wait", amount, unit] => StepKind::Wait(duration(amount, unit)?),
            ["port", name] => StepKind::Port(port(name)?),
            ["power", "cycle"] => StepKind::PowerCycle,
            ["fresh"] => StepKind::Fresh,
            ["input", input, level @ ("high" | "low")] => {
                StepKind::Input { number: small(input)?, high: *level == "high" }
            }
            ["analog", input, reading] => {
                StepKind::Analog { number: small(input)?, reading: small(reading)? }
            }
            ["program"] => return Ok(Begun::Program { address: 0 }),
            ["program", address] => return Ok(Begun::Program { address: value(address)? }),
            ["module", ..] => {
                return Err(format!("line {line_number} is not the first; a file has one module"));
            }
            _ => {
                return Err(format!(
                    "{line:?} is no step; write > and a command, wait 10 ms, port rs485, \
                     power cycle, input 0 high, analog 0 100, program, fresh or # and a comment"
                ));
            }
        };
        Ok(Begun::Step(kind))
    }
}

fn request(text: &str) -> Result<Begun, String> {
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

fn is_expectation(line: &str) -> bool {
    line.starts_with('<') && !line.starts_with("<+") && !line.starts_with("<<+")
}

fn expectation(line: &str) -> Result<ExpectedReply, String> {
    if let Some(bytes) = line.strip_prefix("<<") {
        return Ok(ExpectedReply::Bytes(bytes_as_written(bytes)?));
    }
    let rest = line.strip_prefix('<').unwrap_or(line).trim();
    if rest == "silence" {
        return Ok(ExpectedReply::Silence);
    }
    status_and_value(rest)
}

fn status_and_value(text: &str) -> Result<ExpectedReply, String> {
    let mut words = text.split_whitespace();
    let status = words.next().ok_or("the status is missing; write for example: < 100")?;
    let status = small(status)?;
    let value = words.next().map(value_or_range).transpose()?;
    match words.next() {
        None => Ok(ExpectedReply::Status { status, value }),
        Some(word) => Err(format!("{word:?} is too much; write status and value: < 100 5")),
    }
}

fn value_or_range(text: &str) -> Result<RangeInclusive<i32>, String> {
    let Some((low, high)) = text.split_once("..") else {
        let value = value(text)?;
        return Ok(value..=value);
    };
    let (low, high) = (value(low)?, value(high)?);
    if low > high {
        return Err(format!("the range {text} is empty; write the smaller number first"));
    }
    Ok(low..=high)
}

/// A 32-bit value; hexadecimal ones are the bit pattern.
fn value(text: &str) -> Result<i32, String> {
    let parsed = match text.strip_prefix('$') {
        Some(digits) => u32::from_str_radix(digits, 16).ok().map(u32::cast_signed),
        None => text.parse().ok(),
    };
    parsed.ok_or_else(|| {
        format!("{text:?} is no value; write -2147483648..2147483647 or $ and up to 8 digits")
    })
}

/// A number of at most 8 or 16 bits.
fn small<T: std::str::FromStr>(text: &str) -> Result<T, String> {
    text.parse().map_err(|_| {
        format!("{text:?} is not a number up to {}", if size_of::<T>() == 1 { 255 } else { 65535 })
    })
}

fn bytes_as_written(text: &str) -> Result<[Option<u8>; FRAME_LEN], String> {
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

fn duration(amount: &str, unit: &str) -> Result<Duration, String> {
    let amount: u32 = amount
        .parse()
        .map_err(|_| format!("{amount:?} is no time; write for example: wait 1500 ms"))?;
    let amount = u64::from(amount);
    match unit {
        "us" => Ok(Duration::from_micros(amount)),
        "ms" => Ok(Duration::from_millis(amount)),
        "s" => Ok(Duration::from_secs(amount)),
        _ => Err(format!("{unit:?} is no unit of time; write s, ms or us")),
    }
}

fn port(name: &str) -> Result<Line, String> {
    match name {
        "usb" => Ok(Line::Usb),
        "rs485" => Ok(Line::Rs485),
        "rs232" => Ok(Line::Rs232),
        _ => Err(format!("{name:?} is no line; write usb, rs485 or rs232")),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[track_caller]
    fn steps(text: &str) -> Vec<StepKind> {
        let transcript = parse("test.txt", &format!("module tmcm-6214\n{text}")).unwrap();
        transcript.steps.into_iter().map(|step| step.kind).collect()
    }

    #[track_caller]
    fn mistakes(text: &str) -> Vec<String> {
        parse("test.txt", text).unwrap_err().iter().map(ToString::to_string).collect()
    }

    #[track_caller]
    fn expects(reply: &str, expected: ExpectedReply) {
        let [StepKind::Exchange(exchange)] = &steps(&format!("> GAP 1, 0\n{reply}"))[..] else {
            panic!("one exchange");
        };
        assert_eq!(exchange.expected, expected, "{reply}");
    }

    #[test]
    fn a_request_is_read_with_its_reply() {
        let [StepKind::Exchange(exchange)] =
            &steps("# source\n\n> SAP 5, 0, 51200\n< 100 51200")[..]
        else {
            panic!("one exchange");
        };
        assert_eq!(exchange.request, [1, 5, 5, 0, 0, 0, 0xC8, 0, 0xD3]);
        assert_eq!(exchange.command(), Some(Command::new(5, 5, 0, 51200)));
        assert_eq!(exchange.expected_line, 5);
    }

    #[test]
    fn another_module_can_be_addressed() {
        let [StepKind::Exchange(exchange)] = &steps("> module 7: GAP 1, 0\n< silence")[..] else {
            panic!("one exchange");
        };
        assert_eq!(exchange.request[0], 7);
        assert_eq!(exchange.expected, ExpectedReply::Silence);
    }

    #[test]
    fn every_form_of_reply_is_read() {
        let status = |status, value| ExpectedReply::Status { status, value };
        expects("< 4", status(4, None));
        expects("< 100 -5", status(100, Some(-5..=-5)));
        expects("< 100 $FFFFFFFE", status(100, Some(-2..=-2)));
        expects("< 100 -20..-10", status(100, Some(-20..=-10)));
        expects("< silence", ExpectedReply::Silence);
        let bytes = [2, 1, 0x64, 6, 0, 0, 0, 5].map(Some);
        let mut frame = [None; FRAME_LEN];
        frame[..8].copy_from_slice(&bytes);
        expects("<< 02 01 64 06 00 00 00 05 ..", ExpectedReply::Bytes(frame));
    }

    #[test]
    fn steps_of_every_other_kind_are_read() {
        let text = "wait 1500 ms\nwait 2 s\nport rs485\npower cycle\ninput 3 high\nanalog 0 1234\n\
                    fresh\n<+ 128 5";
        let extra = ExpectedReply::Status { status: 128, value: Some(5..=5) };
        let expected = [
            StepKind::Wait(Duration::from_millis(1500)),
            StepKind::Wait(Duration::from_secs(2)),
            StepKind::Port(Line::Rs485),
            StepKind::PowerCycle,
            StepKind::Input { number: 3, high: true },
            StepKind::Analog { number: 0, reading: 1234 },
            StepKind::Fresh,
            StepKind::ExtraReply(extra),
        ];
        assert_eq!(steps(text), expected);
    }

    #[test]
    fn a_program_keeps_the_lines_of_its_commands() {
        let [StepKind::Program(program)] = &steps("program 5\n  ROR 0, 1\n# on\n  JA 5\nend")[..]
        else {
            panic!("one program");
        };
        assert_eq!(program.address, 5);
        let lines: Vec<_> = program.commands.iter().map(|command| command.line).collect();
        assert_eq!(lines, [3, 5]);
        assert_eq!(program.commands[1].command, Command::new(22, 0, 0, 5));
    }

    #[test]
    fn all_mistakes_of_a_file_are_told_with_their_lines() {
        let text = "module tmcm-6214\n> GO 1\n< 100\nwait 5 minutes\n> GAP 1, 0\nsleep\n\
                    > GAP 1, 0\n< 100 5..4\n>> 01 02\nprogram\n  NOP\n";
        let found = mistakes(text);
        let begin = [
            "test.txt:2: unknown command \"GO\"",
            "test.txt:3: a reply follows no request",
            "test.txt:4: \"minutes\" is no unit of time; write s, ms or us",
            "test.txt:5: no reply is expected; add for example: < 100",
            "test.txt:6: \"sleep\" is no step",
            "test.txt:8: the range 5..4 is empty",
            "test.txt:9: a frame has 9 bytes; some are missing",
            "test.txt:10: the program has no end",
            "test.txt:11: unknown command \"NOP\"",
        ];
        assert_eq!(found.len(), begin.len(), "{found:#?}");
        for (found, begin) in found.iter().zip(begin) {
            assert!(found.starts_with(begin), "{found} should begin with {begin}");
        }
    }

    #[test]
    fn a_file_must_name_a_module_that_there_is() {
        assert_eq!(
            mistakes("> GAP 1, 0\n< 100"),
            [
                "test.txt:1: the first line must name the module: module tmcm-6214",
                "test.txt:2: a reply follows no request; write the request with > before it",
            ]
        );
        assert!(mistakes("module tmcm-1")[0].contains("unknown module \"tmcm-1\"; known: "));
        assert!(mistakes("# nothing")[0].contains("the file is empty"));
    }
}
