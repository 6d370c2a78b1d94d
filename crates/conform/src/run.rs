//! Steps against a module.

use std::collections::VecDeque;

use opentmcl_wire::serial::{self, FRAME_LEN};
use opentmcl_wire::{Command, Duration, Status, control};

use crate::target::{Moment, Target, TargetError};
use crate::transcript::{
    Body, Case, Condition, DEFAULT_ADDRESS, Exchange, ExpectedReply, Line, Program, StepKind,
    Transcript,
};

/// How long a reply may take. The longest telegram pause is 255 ms.
pub const REPLY_TIMEOUT: Duration = Duration::from_millis(300);

/// How long one more reply, which should have come by now, may be on its way.
const EXTRA_REPLY_TIMEOUT: Duration = Duration::from_millis(20);

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
    /// When and where.
    pub moment: Moment,
}

impl Failure {
    fn broken(line: usize, got: String, moment: Moment) -> Self {
        let (command, expected) = ("the connection".into(), "a working connection".into());
        Self { line, command, expected, got, moment }
    }
}

/// The rest of a case that a target cannot do.
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
    /// What was not done of each case that was not run to its end.
    pub skipped: Vec<Skipped>,
}

impl Outcome {
    /// Whether all that was done came out as expected.
    pub fn passed(&self) -> bool {
        self.failures.is_empty()
    }
}

/// Runs all cases of a transcript, one after the other. The target is expected to be a new module.
///
/// A failed expectation ends nothing: what follows is told as well.
pub fn run(transcript: &Transcript, target: &mut dyn Target) -> Outcome {
    let mut outcome = Outcome::default();
    for (at, case) in transcript.cases.iter().enumerate() {
        if at > 0 {
            match target.fresh() {
                Ok(()) => {}
                Err(TargetError::Unable(reason)) => {
                    outcome.skipped.push(Skipped { line: case.line, reason });
                    continue;
                }
                Err(TargetError::Broken(reason)) => {
                    let moment = target.moment();
                    outcome.failures.push(Failure::broken(case.line, reason, moment));
                    return outcome;
                }
            }
        }
        let Outcome { expectations, failures, skipped } = run_case(transcript, case, target);
        outcome.expectations += expectations;
        outcome.failures.extend(failures);
        outcome.skipped.extend(skipped);
    }
    outcome
}

/// Runs the set-up of a transcript and one of its cases. The target is expected to be a new module.
pub fn run_case(transcript: &Transcript, case: &Case, target: &mut dyn Target) -> Outcome {
    let mut runner =
        Runner { target, port: None, extras: VecDeque::new(), outcome: Outcome::default() };
    let mut last_line = case.line;
    for step in transcript.setup.iter().chain(&case.steps) {
        last_line = step.line;
        match runner.step(step.line, &step.kind) {
            Ok(()) => {}
            Err(TargetError::Unable(reason)) => {
                runner.outcome.skipped.push(Skipped { line: step.line, reason });
                return runner.outcome;
            }
            Err(TargetError::Broken(reason)) => {
                let failure = Failure::broken(step.line, reason, runner.target.moment());
                runner.outcome.failures.push(failure);
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
            StepKind::Expect(conditions) => {
                conditions.iter().try_for_each(|condition| self.expect(line, condition))
            }
            StepKind::WaitUntil { text, conditions, at_most } => {
                self.wait_until(line, text, conditions, *at_most)
            }
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
        self.target.loading(program);
        let begin = Command::new(control::START_DOWNLOAD, 0, 0, program.address);
        self.control(line, "program", begin, Status::OK)?;
        match &program.body {
            Body::Lines(lines) => {
                for source in lines {
                    self.control(source.line, &source.text, source.command, Status::LOADED)?;
                }
            }
            Body::File(program) => {
                let before = self.outcome.expectations;
                for &command in &program.commands {
                    self.control(line, &command.to_string(), command, Status::LOADED)?;
                }
                // The author expects one thing of it, however long it is.
                self.outcome.expectations = before;
            }
        }
        self.control(line, "end", Command::new(control::END_DOWNLOAD, 0, 0, 0), Status::OK)
    }

    fn expect(&mut self, line: usize, condition: &Condition) -> Result<(), TargetError> {
        self.outcome.expectations += 1;
        let got = self.look(condition)?;
        if !got.as_ref().is_ok_and(|&value| condition.is_met(value)) {
            let got = got.map_or_else(|reply| reply, |value| condition.meaning.describe(value));
            self.fail(line, &format!("expect {}", condition.text), &condition.expected, got);
        }
        Ok(())
    }

    /// Looks again and again until all conditions hold at once, the time is over or the module
    /// refuses to say.
    fn wait_until(
        &mut self,
        line: usize,
        text: &str,
        conditions: &[Condition],
        at_most: Duration,
    ) -> Result<(), TargetError> {
        self.outcome.expectations += 1;
        let end = self.target.moment().time + at_most;
        loop {
            let Some(unmet) = self.first_unmet(conditions)? else { return Ok(()) };
            let left = end.checked_sub(self.target.moment().time);
            match (unmet, left) {
                ((_, Ok(_)), Some(left)) if left.as_ticks() > 0 => self.target.pause(left)?,
                ((condition, got), _) => {
                    let got = got.map_or_else(|reply| reply, |v| condition.meaning.describe(v));
                    let subject = &condition.text;
                    let expected = format!("{subject} within {}", in_words(at_most));
                    self.fail(line, text, expected, got);
                    return Ok(());
                }
            }
        }
    }

    /// The first condition that does not hold, and the value or reply because of which it does not.
    fn first_unmet<'c>(
        &mut self,
        conditions: &'c [Condition],
    ) -> Result<Option<(&'c Condition, Result<i32, String>)>, TargetError> {
        for condition in conditions {
            let got = self.look(condition)?;
            if !got.as_ref().is_ok_and(|&value| condition.is_met(value)) {
                return Ok(Some((condition, got)));
            }
        }
        Ok(None)
    }

    /// The value that a condition is about, or the reply that has none.
    fn look(&mut self, condition: &Condition) -> Result<Result<i32, String>, TargetError> {
        let command = condition.command;
        let frame = self.ask(serial::encode_request(DEFAULT_ADDRESS, command))?;
        let reply = frame.and_then(|frame| serial::decode_reply(frame).ok());
        Ok(match reply {
            Some(answer)
                if answer.reply.status == Status::OK && answer.reply.number == command.number =>
            {
                Ok(answer.reply.value)
            }
            _ => Err(describe(frame)),
        })
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
        let moment = self.target.moment();
        self.outcome.failures.push(Failure { line, command, expected, got, moment });
    }
}

/// A time in the unit in which it is a small number.
fn in_words(time: Duration) -> String {
    let micros = time.as_micros();
    match micros {
        _ if micros % 1_000_000 == 0 => format!("{} s", micros / 1_000_000),
        _ if micros % 1000 == 0 => format!("{} ms", micros / 1000),
        _ => format!("{micros} us"),
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
    use crate::programs::NoPrograms;
    use opentmcl_wire::Reply;

    /// Answers every command with status 100 and the value of the request plus one; commands to
    /// other addresses than 1 with silence.
    struct Echo {
        replies: VecDeque<[u8; FRAME_LEN]>,
        time: Duration,
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

        fn wait(&mut self, time: Duration) -> Result<(), TargetError> {
            self.time += time;
            Ok(())
        }

        fn pause(&mut self, at_most: Duration) -> Result<(), TargetError> {
            self.time += at_most.min(Duration::from_millis(1));
            Ok(())
        }

        fn moment(&mut self) -> Moment {
            Moment { time: self.time, program: None }
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
        let text = format!("module tmcm-6214\n{text}");
        let transcript = parse("test.txt", &text, &mut NoPrograms).unwrap();
        let echo = Echo { replies: VecDeque::new(), time: Duration::from_ticks(0) };
        run(&transcript, &mut { echo })
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
            [Skipped { line: 4, reason: "it has no switch".to_owned() }]
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
