//! Steps against a module.

mod condition;

use std::collections::VecDeque;

use opentmcl_wire::serial::{self, FRAME_LEN};
use opentmcl_wire::{Command, Duration, Status, control};

use crate::target::{Moment, Target, TargetError};
use crate::transcript::{
    Body, Case, DEFAULT_ADDRESS, Exchange, ExpectedReply, Line, Program, Stage, StepKind,
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
            StepKind::Scenario(scenario) => self.target.scenario(scenario),
            StepKind::World(action) => self.target.world(action),
            StepKind::Stage(stage) => self.stage(line, stage),
        }
    }

    fn stage(&mut self, line: usize, stage: &Stage) -> Result<(), TargetError> {
        let position = self.target.stage(stage.axis, stage.unit)?;
        self.outcome.expectations += 1;
        if position.is_some_and(|position| stage.range.contains(&position)) {
            return Ok(());
        }
        let (axis, unit) = (stage.axis, stage.unit);
        let got = match position {
            Some(position) => format!("stage {axis} = {position:.4} {unit}"),
            None => format!("a stage that is not measured in {unit}"),
        };
        self.fail(line, "where the stage is", &stage.text, got);
        Ok(())
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
mod tests;
