//! Steps against a module.

use std::collections::VecDeque;

use opentmcl_wire::serial::{self, FRAME_LEN};
use opentmcl_wire::{Command, Duration, Status, control};

use crate::parse::{DEFAULT_ADDRESS, Exchange, ExpectedReply, Line, Program, StepKind, Transcript};

/// How long a reply may take. The longest telegram pause is 255 ms.
pub const REPLY_TIMEOUT: Duration = Duration::from_millis(300);

/// How long one more reply, which should have come by now, may be on its way.
const EXTRA_REPLY_TIMEOUT: Duration = Duration::from_millis(20);

/// A module that transcripts can be run against.
pub trait Target {
    /// Sends nine bytes by this line; `None` is whatever line there is, on a virtual module USB.
    ///
    /// # Errors
    /// When the connection is lost, or the target has no such line.
    fn send(&mut self, line: Option<Line>, frame: [u8; FRAME_LEN]) -> Result<(), TargetError>;

    /// The next nine bytes from the module; `None` if none come within `timeout`.
    ///
    /// # Errors
    /// When the connection is lost.
    fn receive(&mut self, timeout: Duration) -> Result<Option<[u8; FRAME_LEN]>, TargetError>;

    /// Lets time pass.
    ///
    /// # Errors
    /// When the connection is lost.
    fn wait(&mut self, time: Duration) -> Result<(), TargetError>;

    /// Switches the module off and on.
    ///
    /// # Errors
    /// Of kind [`TargetError::Unable`] where that cannot be done.
    fn power_cycle(&mut self) -> Result<(), TargetError>;

    /// Sets the level of a digital input.
    ///
    /// # Errors
    /// Of kind [`TargetError::Unable`] where that cannot be done.
    fn set_input(&mut self, number: u8, high: bool) -> Result<(), TargetError>;

    /// Sets the reading of an analog input.
    ///
    /// # Errors
    /// Of kind [`TargetError::Unable`] where that cannot be done.
    fn set_analog(&mut self, number: u8, reading: u16) -> Result<(), TargetError>;

    /// Takes a new module as it leaves the factory; where there is only one, restarts it, so that
    /// at least what it has in RAM is new.
    ///
    /// # Errors
    /// When it does not come back.
    fn fresh(&mut self) -> Result<(), TargetError>;
}

/// Why a target does not do what a step asks for.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum TargetError {
    /// It cannot, by its nature: the rest of the file is skipped.
    #[error("{0}")]
    Unable(String),
    /// Something broke: the file has failed.
    #[error("{0}")]
    Broken(String),
}

/// An expectation that was not met.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Failure {
    /// Line in the file.
    pub line: usize,
    /// What was asked.
    pub command: String,
    /// What should have come.
    pub expected: String,
    /// What came.
    pub got: String,
}

/// The rest of a file that a target cannot do.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Skipped {
    /// First line that was not done.
    pub line: usize,
    /// Why.
    pub reason: String,
}

/// What came of a transcript.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Outcome {
    /// How many expectations were looked at.
    pub expectations: usize,
    /// Those that were not met.
    pub failures: Vec<Failure>,
    /// The rest that was not done.
    pub skipped: Option<Skipped>,
}

impl Outcome {
    /// Whether all that was done came out as expected.
    pub fn passed(&self) -> bool {
        self.failures.is_empty()
    }
}

/// Runs a transcript from its first step. The target is expected to be a new module.
///
/// A failed expectation does not end it: what follows is told as well.
pub fn run(transcript: &Transcript, target: &mut dyn Target) -> Outcome {
    let mut runner =
        Runner { target, port: None, extras: VecDeque::new(), outcome: Outcome::default() };
    let mut last_line = 1;
    for step in &transcript.steps {
        last_line = step.line;
        match runner.step(step.line, &step.kind) {
            Ok(()) => {}
            Err(TargetError::Unable(reason)) => {
                runner.outcome.skipped = Some(Skipped { line: step.line, reason });
                return runner.outcome;
            }
            Err(TargetError::Broken(reason)) => {
                runner.fail(step.line, "the connection", "a working connection", reason);
                return runner.outcome;
            }
        }
    }
    runner.no_extras_left(last_line);
    runner.outcome
}

struct Runner<'a> {
    target: &'a mut dyn Target,
    port: Option<Line>,
    /// Replies that have come and that no request of now has asked for.
    extras: VecDeque<[u8; FRAME_LEN]>,
    outcome: Outcome,
}

impl Runner<'_> {
    fn step(&mut self, line: usize, kind: &StepKind) -> Result<(), TargetError> {
        match kind {
            StepKind::Exchange(exchange) => self.exchange(exchange),
            StepKind::ExtraReply(expected) => self.extra(line, expected),
            StepKind::Program(program) => self.load(line, program),
            StepKind::Wait(time) => self.target.wait(*time),
            StepKind::Port(port) => {
                self.port = Some(*port);
                Ok(())
            }
            StepKind::PowerCycle => self.target.power_cycle(),
            StepKind::Input { number, high } => self.target.set_input(*number, *high),
            StepKind::Analog { number, reading } => self.target.set_analog(*number, *reading),
            StepKind::Fresh => {
                self.no_extras_left(line);
                self.port = None;
                self.target.fresh()
            }
        }
    }

    fn exchange(&mut self, exchange: &Exchange) -> Result<(), TargetError> {
        let reply = self.ask(exchange.request)?;
        let command = exchange.command().map(|command| command.number);
        self.check(exchange.expected_line, &exchange.text, &exchange.expected, reply, command);
        Ok(())
    }

    /// Sends a request and waits for its reply; replies of command 138 that come meanwhile are
    /// put aside.
    fn ask(&mut self, request: [u8; FRAME_LEN]) -> Result<Option<[u8; FRAME_LEN]>, TargetError> {
        while let Some(frame) = self.target.receive(Duration::from_ticks(0))? {
            self.extras.push_back(frame);
        }
        self.target.send(self.port, request)?;
        loop {
            match self.target.receive(REPLY_TIMEOUT)? {
                Some(frame) if is_event(frame) => self.extras.push_back(frame),
                reply => return Ok(reply),
            }
        }
    }

    fn extra(&mut self, line: usize, expected: &ExpectedReply) -> Result<(), TargetError> {
        let frame = match self.extras.pop_front() {
            None => self.target.receive(EXTRA_REPLY_TIMEOUT)?,
            frame => frame,
        };
        self.check(line, "one more reply", expected, frame, None);
        Ok(())
    }

    fn no_extras_left(&mut self, line: usize) {
        while let Ok(Some(frame)) = self.target.receive(EXTRA_REPLY_TIMEOUT) {
            self.extras.push_back(frame);
        }
        while let Some(frame) = self.extras.pop_front() {
            self.outcome.expectations += 1;
            self.fail(line, "nothing", "no more replies", describe(Some(frame)));
        }
    }

    fn load(&mut self, line: usize, program: &Program) -> Result<(), TargetError> {
        let begin = Command::new(control::START_DOWNLOAD, 0, 0, program.address);
        self.control(line, "program", begin, Status::OK)?;
        for source in &program.commands {
            self.control(source.line, &source.text, source.command, Status::LOADED)?;
        }
        self.control(line, "end", Command::new(control::END_DOWNLOAD, 0, 0, 0), Status::OK)
    }

    fn control(
        &mut self,
        line: usize,
        text: &str,
        command: Command,
        status: Status,
    ) -> Result<(), TargetError> {
        let reply = self.ask(serial::encode_request(DEFAULT_ADDRESS, command))?;
        let expected = ExpectedReply::Status { status: status.0, value: None };
        self.check(line, text, &expected, reply, Some(command.number));
        Ok(())
    }

    fn check(
        &mut self,
        line: usize,
        command: &str,
        expected: &ExpectedReply,
        reply: Option<[u8; FRAME_LEN]>,
        number: Option<u8>,
    ) {
        self.outcome.expectations += 1;
        if !is_met(expected, reply, number) {
            self.fail(line, command, expected.to_string(), describe(reply));
        }
    }

    fn fail(&mut self, line: usize, command: &str, expected: impl ToString, got: String) {
        let (command, expected) = (command.to_owned(), expected.to_string());
        self.outcome.failures.push(Failure { line, command, expected, got });
    }
}

/// Whether this is the second reply to a command 138, which comes when it comes.
fn is_event(frame: [u8; FRAME_LEN]) -> bool {
    serial::decode_reply(frame).is_ok_and(|answer| {
        answer.reply.status == Status::DELAYED && answer.reply.number == control::POSITION_REPORT
    })
}

/// Whether a reply is as expected; if it answers a command it must also name that command.
fn is_met(expected: &ExpectedReply, reply: Option<[u8; FRAME_LEN]>, number: Option<u8>) -> bool {
    match (expected, reply) {
        (ExpectedReply::Silence, None) => true,
        (ExpectedReply::Silence, Some(_)) | (_, None) => false,
        (ExpectedReply::Bytes(bytes), Some(reply)) => {
            bytes.iter().zip(reply).all(|(expected, byte)| expected.is_none_or(|e| e == byte))
        }
        (ExpectedReply::Status { status, value }, Some(reply)) => {
            let Ok(answer) = serial::decode_reply(reply) else { return false };
            answer.reply.status.0 == *status
                && value.as_ref().is_none_or(|range| range.contains(&answer.reply.value))
                && number.is_none_or(|number| answer.reply.number == number)
        }
    }
}

fn describe(reply: Option<[u8; FRAME_LEN]>) -> String {
    let Some(frame) = reply else { return "silence".to_owned() };
    let bytes = frame.map(|byte| format!("{byte:02X}")).join(" ");
    match serial::decode_reply(frame) {
        Ok(answer) => {
            let reply = answer.reply;
            format!("status {}, value {} ({bytes})", reply.status, reply.value)
        }
        Err(_) => format!("no valid reply ({bytes})"),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::parse::parse;
    use opentmcl_wire::Reply;

    /// Answers every command with status 100 and the value of the request plus one; commands to
    /// other addresses than 1 with silence.
    #[derive(Default)]
    struct Echo {
        replies: VecDeque<[u8; FRAME_LEN]>,
    }

    impl Target for Echo {
        fn send(&mut self, _: Option<Line>, frame: [u8; FRAME_LEN]) -> Result<(), TargetError> {
            let request = serial::decode_request(frame).unwrap();
            let Command { number, value, .. } = request.command;
            if number == control::POSITION_REPORT {
                let event = Reply { status: Status::DELAYED, number, value: 1 };
                self.replies.push_back(serial::encode_reply(2, 1, event));
            }
            if request.address == 1 {
                let loaded = matches!(number, 1..=100);
                let status = if loaded && value == 7 { Status::LOADED } else { Status::OK };
                let reply = Reply { status, number, value: value + 1 };
                self.replies.push_back(serial::encode_reply(2, 1, reply));
            }
            Ok(())
        }

        fn receive(&mut self, _: Duration) -> Result<Option<[u8; FRAME_LEN]>, TargetError> {
            Ok(self.replies.pop_front())
        }

        fn wait(&mut self, _: Duration) -> Result<(), TargetError> {
            Ok(())
        }

        fn power_cycle(&mut self) -> Result<(), TargetError> {
            Err(TargetError::Unable("it has no switch".to_owned()))
        }

        fn set_input(&mut self, _: u8, _: bool) -> Result<(), TargetError> {
            Err(TargetError::Broken("the cable is out".to_owned()))
        }

        fn set_analog(&mut self, _: u8, _: u16) -> Result<(), TargetError> {
            Ok(())
        }

        fn fresh(&mut self) -> Result<(), TargetError> {
            Ok(())
        }
    }

    fn outcome(text: &str) -> Outcome {
        let transcript = parse("test.txt", &format!("module tmcm-6214\n{text}")).unwrap();
        run(&transcript, &mut Echo::default())
    }

    #[test]
    fn what_comes_as_expected_passes() {
        let text = "> SAP 1, 0, 5\n< 100\n> SAP 1, 0, 5\n< 100 6\n> SAP 1, 0, 5\n< 100 0..6\n\
                    > module 9: GAP 1, 0\n< silence\n>> 01 06 01 00 00 00 00 00 08\n\
                    << 02 01 64 06 00 00 00 01 ..\nwait 10 ms\nprogram\nSGP 1, 2, 7\nend\n";
        let outcome = outcome(text);
        assert_eq!(outcome.failures, []);
        assert_eq!(outcome.expectations, 8);
    }

    #[test]
    fn a_failure_names_line_command_and_both_replies_and_the_file_goes_on() {
        let outcome = outcome("> SAP 1, 0, 5\n< 100 5\n> GAP 1, 0\n< 4\n> GAP 1, 0\n< 100 1");
        assert_eq!(outcome.expectations, 3);
        assert!(!outcome.passed());
        let [first, second] = &outcome.failures[..] else { panic!("{:?}", outcome.failures) };
        assert_eq!((first.line, second.line), (3, 5));
        assert_eq!(first.command, "SAP 1, 0, 5");
        assert_eq!(first.expected, "status 100, value 5");
        assert!(first.got.starts_with("status 100 (successfully executed), value 6 (02 01 64 05"));
        assert_eq!(second.expected, "status 4");
    }

    #[test]
    fn a_reply_where_silence_belongs_and_silence_where_a_reply_belongs_fail() {
        let outcome = outcome("> GAP 1, 0\n< silence\n> module 5: GAP 1, 0\n< 100");
        assert_eq!(outcome.failures.len(), 2);
        assert_eq!(outcome.failures[1].got, "silence");
    }

    #[test]
    fn a_second_reply_is_kept_until_it_is_asked_for() {
        assert!(outcome("> 138 0, 0, 1\n< 100 2\n<+ 128 1").passed());
        let bytes = "> 138 0, 0, 1\n< 100\n<<+ 02 01 80 8A 00 00 00 01 0E";
        assert!(outcome(bytes).passed());
        assert_eq!(outcome("<+ 128 1").failures[0].got, "silence");
    }

    #[test]
    fn a_second_reply_that_nobody_expects_fails() {
        let outcome = outcome("> 138 0, 0, 1\n< 100 2");
        assert_eq!(outcome.failures.len(), 1);
        assert_eq!(outcome.failures[0].expected, "no more replies");
    }

    #[test]
    fn what_a_target_cannot_do_skips_the_rest() {
        let outcome = outcome("> GAP 1, 0\n< 100\npower cycle\n> GAP 1, 0\n< 4");
        assert!(outcome.passed());
        assert_eq!(
            outcome.skipped,
            Some(Skipped { line: 4, reason: "it has no switch".to_owned() })
        );
    }

    #[test]
    fn a_lost_connection_is_a_failure_and_ends_the_file() {
        let outcome = outcome("input 0 high\n> GAP 1, 0\n< 4");
        assert_eq!(outcome.failures.len(), 1);
        assert_eq!(outcome.failures[0].got, "the cable is out");
    }

    #[test]
    fn a_program_is_loaded_command_by_command() {
        // The target answers a command with value 7 as loaded, any other as executed.
        let outcome = outcome("program\nSGP 1, 2, 7\nSGP 1, 2, 8\nend");
        assert_eq!(outcome.expectations, 4);
        assert_eq!(outcome.failures.len(), 1);
        assert_eq!(outcome.failures[0].line, 4);
        assert_eq!(outcome.failures[0].expected, "status 101");
    }
}
