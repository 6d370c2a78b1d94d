//! Steps against a module.

mod condition;

use std::collections::VecDeque;

use opentmcl_wire::serial::{self, FRAME_LEN};
use opentmcl_wire::{Command, Duration, Status, control};

use crate::target::{Moment, Target, TargetError};
use crate::transcript::{
    Body, Case, DEFAULT_ADDRESS, Exchange, ExpectedReply, Line, Program, StepKind, Transcript,
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
    /// When the last step was over.
    pub ended: Option<Moment>,
}

impl Outcome {
    /// Whether all that was done came out as expected.
    pub fn passed(&self) -> bool {
        self.failures.is_empty()
    }

    /// The target goes no further.
    fn end(&mut self, line: usize, error: TargetError, moment: Moment) {
        self.ended = Some(moment);
        let (command, expected, got) = match error {
            TargetError::Unable(reason) => return self.skipped.push(Skipped { line, reason }),
            TargetError::Broken(reason) => {
                ("the connection", "a working connection".to_owned(), reason)
            }
            TargetError::TimeIsUp(limit) => {
                let expected = format!("an end within {}, the limit", condition::in_words(limit));
                ("the time that passes", expected, "it goes on for longer".to_owned())
            }
        };
        self.failures.push(Failure { line, command: command.to_owned(), expected, got, moment });
    }
}

/// Runs all cases of a transcript, one after the other. The target is expected to be a new module.
///
/// A failed expectation ends nothing: what follows is told as well.
pub fn run(transcript: &Transcript, target: &mut dyn Target) -> Outcome {
    let mut outcome = Outcome::default();
    for (at, case) in transcript.cases.iter().enumerate() {
        if at > 0
            && let Err(error) = target.fresh()
        {
            outcome.end(case.line, error, target.moment());
            return outcome;
        }
        let Outcome { expectations, failures, skipped, ended } = run_case(transcript, case, target);
        outcome.expectations += expectations;
        outcome.failures.extend(failures);
        outcome.skipped.extend(skipped);
        outcome.ended = ended;
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
        if let Err(error) = runner.step(step.line, &step.kind) {
            let moment = runner.target.moment();
            runner.outcome.end(step.line, error, moment);
            return runner.outcome;
        }
    }
    runner.outcome.ended = Some(runner.target.moment());
    runner.target.case_over();
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
    use opentmcl_wire::{Opcode, Reply};

    /// Answers every command with status 100 and the value of the request plus one; GGP with the
    /// time in milliseconds, GAP of axis 5 with a refusal; commands to other addresses than 1 with
    /// silence.
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
                let refused = number == Opcode::Gap.number() && request.command.motor == 5;
                let status = match refused {
                    true => Status::INVALID_VALUE,
                    false if loaded && value == 7 => Status::LOADED,
                    false => Status::OK,
                };
                let millis = i32::try_from(self.time.as_millis()).unwrap();
                let is_clock = number == Opcode::Ggp.number();
                let reply =
                    Reply { status, number, value: if is_clock { millis } else { value + 1 } };
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
            self.time = Duration::from_ticks(0);
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
        assert_eq!(outcome.skipped, [Skipped { line: 4, reason: "it has no switch".to_owned() }]);
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

    #[test]
    fn an_expected_condition_is_asked_for_and_each_one_that_does_not_hold_is_told() {
        // Whatever is asked with the value 0 is answered with 1; GGP with the time.
        assert!(outcome("expect position 0 = 1, output 2 high, variable 3 = 0").passed());
        let outcome = outcome("wait 4 ms\nexpect speed 0 > 1, output 2 low, variable 3 = 5..9");
        let told: Vec<_> = outcome
            .failures
            .iter()
            .map(|f| (f.line, f.command.as_str(), f.expected.as_str(), f.got.as_str()))
            .collect();
        assert_eq!(
            told,
            [
                (3, "expect speed 0 > 1", "> 1", "1"),
                (3, "expect output 2 low", "low", "high"),
                (3, "expect variable 3 = 5..9", "5..9", "4"),
            ]
        );
        assert_eq!(outcome.expectations, 3);
        assert_eq!(outcome.failures[0].moment.time, Duration::from_millis(4));
    }

    #[test]
    fn a_wait_goes_on_until_all_conditions_hold_at_once() {
        // The clock is 5 after five looks that failed, and goes on by 1 with each.
        let text = "wait until variable 0 >= 5, position 0 = 1, at most 5 ms\n\
                    expect variable 0 = 5";
        assert_eq!(outcome(text).failures, []);
        let never = outcome("wait until variable 0 < 2, variable 0 > 3, at most 20 ms");
        assert_eq!(never.failures.len(), 1, "each holds for a while, never both");
    }

    #[test]
    fn a_wait_whose_time_is_over_fails_with_the_condition_and_goes_on() {
        let outcome = outcome("wait until variable 0 = 5, at most 4 ms\nexpect variable 0 = 4");
        let [failure] = &outcome.failures[..] else { panic!("{:?}", outcome.failures) };
        assert_eq!(failure.command, "wait until variable 0 = 5, at most 4 ms");
        assert_eq!(failure.expected, "variable 0 = 5 within 4 ms");
        assert_eq!(failure.got, "4");
        assert_eq!(outcome.expectations, 2);
    }

    #[test]
    fn what_the_module_refuses_to_say_is_told_at_once() {
        for text in ["expect position 5 = 1", "wait until position 5 reached, at most 1 s"] {
            let outcome = outcome(text);
            assert!(outcome.failures[0].got.starts_with("status 4 (invalid value)"), "{text}");
            assert_eq!(outcome.failures[0].moment.time, Duration::from_ticks(0), "{text}");
        }
    }

    #[test]
    fn each_case_begins_anew_with_the_set_up() {
        let text = "wait 7 ms\ntest \"a\"\nexpect variable 0 = 7\nwait 1 ms\n\
                    test \"b\"\nexpect variable 0 = 7";
        assert_eq!(outcome(text).failures, []);
    }

    #[test]
    fn what_a_target_cannot_do_skips_the_rest_of_the_case_alone() {
        let text = "test \"a\"\npower cycle\nexpect position 0 = 2\n\
                    test \"b\"\nexpect position 0 = 2";
        let outcome = outcome(text);
        assert_eq!(outcome.skipped.len(), 1);
        assert_eq!(outcome.skipped[0].line, 3);
        let lines: Vec<_> = outcome.failures.iter().map(|failure| failure.line).collect();
        assert_eq!(lines, [6]);
    }
}
