//! Text to steps. A file is read to its end whatever is wrong with it, and all of it is told.

mod case;
mod condition;
mod names;
mod number;
mod reply;
mod world;

use opentmcl_catalog::{MODULES, Module, PortBehaviour};
use opentmcl_wire::limits::VARIABLE_BANK;
use opentmcl_wire::serial::FRAME_LEN;
use opentmcl_wire::{Command, Opcode, control};

use crate::programs::{Programs, ScenarioFile};
use crate::transcript::{Case, Exchange, ExpectedReply, Line, Step, StepKind, Transcript};
use case::{Loaded, executed, run_from};
use condition::{conditions, conditions_and_limit};
use names::Names;
use number::duration;
use reply::{bytes_as_written, expectation, is_expectation, request, status_and_value};

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

/// Reads a transcript, for the first module that it names, and the programs that it names.
///
/// # Errors
/// Every line that means nothing, in the order of the file.
pub fn parse(
    name: &str,
    text: &str,
    programs: &mut dyn Programs,
) -> Result<Transcript, Vec<Mistake>> {
    parse_for(name, text, programs, 0)
}

/// Reads a transcript that may be about several modules, `module tmcm-6110 tmcm-6214`: once for each.
///
/// # Errors
/// Every line that means nothing for one of the modules, in the order of the file.
pub fn parse_each(
    name: &str,
    text: &str,
    programs: &mut dyn Programs,
) -> Result<Vec<Transcript>, Vec<Mistake>> {
    let first = lines_of(text).next().map_or("", |(_, line)| line);
    let modules = first.split_whitespace().skip(1).count().max(1);
    (0..modules)
        .map(|which| {
            let mut transcript = parse_for(name, text, programs, which)?;
            if modules > 1 {
                transcript.name = format!("{name} ({})", transcript.module.name);
            }
            Ok(transcript)
        })
        .collect()
}

/// The lines that are not empty, without comments, each with its number.
fn lines_of(text: &str) -> impl Iterator<Item = (usize, &str)> {
    let lines = text.lines().enumerate();
    let lines = lines.map(|(at, line)| (at + 1, without_comment(line).trim()));
    lines.filter(|(_, line)| !line.is_empty())
}

/// Reads a transcript for one of the modules that it names.
fn parse_for(
    name: &str,
    text: &str,
    programs: &mut dyn Programs,
    which: usize,
) -> Result<Transcript, Vec<Mistake>> {
    let mut parser = Parser::new(name, programs);
    let mut lines = lines_of(text).peekable();
    if let Some((number, line)) = lines.next() {
        parser.module_line(number, line, which);
    } else {
        parser.mistake(1, "the file is empty; begin with: module tmcm-6214");
    }
    while let Some((number, line)) = lines.next() {
        match parser.step(number, line) {
            Ok(Begun::Case) => {}
            Ok(Begun::Step(kind)) => parser.push(number, kind),
            Ok(Begun::Request { text, request }) => match lines.peek() {
                Some(&(expected_line, reply)) if is_expectation(reply) => {
                    lines.next();
                    match expectation(reply, parser.names()) {
                        Ok(expected) => {
                            let exchange = Exchange { text, request, expected, expected_line };
                            parser.push(number, StepKind::Exchange(exchange));
                        }
                        Err(message) => parser.mistake(expected_line, message),
                    }
                }
                _ => parser.mistake(number, "no reply is expected; add for example: < 100"),
            },
            Ok(Begun::Program { address }) => {
                let program = parser.inline_program(number, address, &mut lines);
                parser.push(number, StepKind::Program(program));
            }
            Err(message) => parser.mistake(number, message),
        }
    }
    parser.finish()
}

/// A line up to a comment: `#` at its begin or behind a blank, not between quotation marks.
fn without_comment(line: &str) -> &str {
    let mut quoted = false;
    let mut before = ' ';
    for (at, character) in line.char_indices() {
        match character {
            '"' => quoted = !quoted,
            '#' if !quoted && before.is_whitespace() => return &line[..at],
            _ => {}
        }
        before = character;
    }
    line
}

/// A line that is a step, or the beginning of one.
enum Begun {
    Case,
    Step(StepKind),
    Request { text: String, request: [u8; FRAME_LEN] },
    Program { address: i32 },
}

struct Parser<'a> {
    name: &'a str,
    programs: &'a mut dyn Programs,
    module: Option<&'static Module>,
    setup: Loaded,
    setup_steps: Vec<Step>,
    cases: Vec<Case>,
    now: Loaded,
    scenario: Option<ScenarioFile>,
    mistakes: Vec<Mistake>,
}

impl<'a> Parser<'a> {
    fn new(name: &'a str, programs: &'a mut dyn Programs) -> Self {
        Self {
            name,
            programs,
            module: None,
            setup: Loaded::default(),
            setup_steps: Vec::new(),
            cases: Vec::new(),
            now: Loaded::default(),
            scenario: None,
            mistakes: Vec::new(),
        }
    }

    fn mistake(&mut self, line: usize, message: impl ToString) {
        let message = message.to_string();
        self.mistakes.push(Mistake { name: self.name.to_owned(), line, message });
    }

    fn push(&mut self, line: usize, kind: StepKind) {
        let steps = self.cases.last_mut().map_or(&mut self.setup_steps, |case| &mut case.steps);
        steps.push(Step { line, kind });
    }

    fn finish(mut self) -> Result<Transcript, Vec<Mistake>> {
        self.mistakes.sort_by_key(|mistake| mistake.line);
        let Some(module) = self.module.filter(|_| self.mistakes.is_empty()) else {
            return Err(self.mistakes);
        };
        let (mut setup, mut cases) = (self.setup_steps, self.cases);
        if cases.is_empty() {
            cases.push(Case { name: None, line: 1, steps: std::mem::take(&mut setup) });
        }
        Ok(Transcript { name: self.name.to_owned(), module, setup, cases })
    }

    fn module_line(&mut self, number: usize, line: &str, which: usize) {
        let Some(name) = line.strip_prefix("module ") else {
            return self.mistake(number, "the first line must name the module: module tmcm-6214");
        };
        let name = name.split_whitespace().nth(which).unwrap_or_default();
        self.module = opentmcl_catalog::find(name);
        if self.module.is_none() {
            let known: Vec<_> = MODULES.iter().map(|module| module.name).collect();
            self.mistake(number, format!("unknown module {name:?}; known: {}", known.join(", ")));
        }
    }

    fn names(&self) -> Names<'_> {
        Names { program: self.now.program.as_deref(), module: self.module }
    }

    fn step(&mut self, line_number: usize, line: &str) -> Result<Begun, String> {
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
            return Ok(Begun::Step(StepKind::ExtraReply(status_and_value(extra, self.names())?)));
        }
        if let Some(extra) = line.strip_prefix("<<+") {
            let bytes = bytes_as_written(extra)?;
            return Ok(Begun::Step(StepKind::ExtraReply(ExpectedReply::Bytes(bytes))));
        }
        if line.starts_with('<') {
            return Err("a reply follows no request; write the request with > before it".into());
        }
        let (word, rest) = line.split_once(char::is_whitespace).unwrap_or((line, ""));
        match (word, rest.trim()) {
            ("test", name) => self.case(line_number, name),
            ("program", operand) => self.program(operand),
            ("scenario", file) => self.scenario(file),
            ("world", action) => self.world(action),
            ("module", _) => {
                Err(format!("line {line_number} is not the first; a file has one module"))
            }
            ("expect", "") => Err("a condition is missing; write for example: \
                                   expect position 0 = 5000"
                .into()),
            ("expect", text) => Ok(Begun::Step(match world::stage(text) {
                Some(stage) => StepKind::Stage(stage?),
                None => StepKind::Expect(conditions(text, self.names())?),
            })),
            _ => self.words(line_number, line).map(Begun::Step),
        }
    }

    /// Lines of which each word has its place.
    fn words(&self, number: usize, line: &str) -> Result<StepKind, String> {
        let names = self.names();
        let words: Vec<&str> = line.split_whitespace().collect();
        Ok(match words.as_slice() {
            ["wait", "until", ..] => {
                let rest = line.trim_start_matches("wait").trim_start().trim_start_matches("until");
                let (conditions, at_most) = conditions_and_limit(rest.trim(), names)?;
                StepKind::WaitUntil { text: line.to_owned(), conditions, at_most }
            }
            ["wait", amount, unit] => StepKind::Wait(duration(amount, unit)?),
            ["port", name] => StepKind::Port(port(name)?),
            ["power", "cycle"] => StepKind::PowerCycle,
            ["fresh"] => StepKind::Fresh,
            ["input", input, level @ ("high" | "low")] => {
                let number = names.pin(PortBehaviour::DigitalInput, "input", input)?;
                StepKind::Input { number, high: *level == "high" }
            }
            ["analog", input, reading] => {
                let number = names.pin(PortBehaviour::AnalogInput, "analog input", input)?;
                StepKind::Analog { number, reading: names.small(reading)? }
            }
            ["run"] => run_from(line, number, self.now.address),
            ["run", "at", place] => run_from(line, number, names.address(place)?),
            ["stop"] => executed(line, number, Command::new(control::STOP_PROGRAM, 0, 0, 0)),
            ["set", "variable", variable, "=", value] => {
                let (variable, value) = (names.small(variable)?, names.value(value)?);
                let set = Command::new(Opcode::Sgp.number(), variable, VARIABLE_BANK, value);
                executed(line, number, set)
            }
            ["set", ..] => {
                return Err("only variables can be set: set variable 42 = 7; for anything else \
                            write the command, for example > SIO 1, 2, 1"
                    .into());
            }
            [word, ..] if let Some((_, form)) = FORMS.iter().find(|(name, _)| name == word) => {
                return Err(format!("{line:?} is not complete or has too much; write {form}"));
            }
            _ => {
                return Err(format!(
                    "{line:?} is no step; write > and a command, wait 10 ms, wait until a \
                     condition, expect a condition, input 0 high, analog 0 100, set variable 42 = 7, \
                     program, run, stop, scenario lab.toml, world block axis 0, test \"name\", port \
                     rs485, power cycle, fresh or # and a comment"
                ));
            }
        })
    }
}

/// How steps are written whose first word is right and the rest is not.
const FORMS: [(&str, &str); 4] = [
    ("wait", "wait 500 ms, or wait until and a condition"),
    ("input", "input 3 high or input 3 low"),
    ("analog", "analog 0 1234"),
    ("run", "run, or run at and a label or an address"),
];

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
    use crate::programs::NoPrograms;
    use crate::transcript::Body;
    use opentmcl_wire::Duration;

    #[track_caller]
    fn steps(text: &str) -> Vec<StepKind> {
        let text = format!("module tmcm-6214\n{text}");
        let transcript = parse("test.txt", &text, &mut NoPrograms).unwrap();
        transcript.steps().map(|step| step.kind.clone()).collect()
    }

    #[track_caller]
    fn mistakes(text: &str) -> Vec<String> {
        parse("test.txt", text, &mut NoPrograms)
            .unwrap_err()
            .iter()
            .map(ToString::to_string)
            .collect()
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
        let Body::Lines(commands) = &program.body else { panic!("its commands are here") };
        let lines: Vec<_> = commands.iter().map(|command| command.line).collect();
        assert_eq!(lines, [3, 5]);
        assert_eq!(commands[1].command, Command::new(22, 0, 0, 5));
    }

    #[test]
    fn a_step_with_the_right_word_and_a_wrong_rest_is_answered_with_its_form() {
        for (line, form) in [
            ("wait 5", "wait 500 ms, or wait until and a condition"),
            ("wait 5 ms long", "wait 500 ms, or wait until and a condition"),
            ("input 3 hi", "input 3 high or input 3 low"),
            ("analog 0", "analog 0 1234"),
            ("run from 5", "run, or run at and a label or an address"),
        ] {
            let found = mistakes(&format!("module tmcm-6214\n{line}\n"));
            let right =
                format!("test.txt:2: {line:?} is not complete or has too much; write {form}");
            assert_eq!(found, [right]);
        }
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
    fn a_file_about_several_modules_is_read_for_each_of_them() {
        let text = "# Both.\nmodule tmcm-6110 tmcm-6214\n> GAP 1, 0\n< 100 0\n";
        let each = parse_each("test.txt", text, &mut NoPrograms).unwrap();
        let names: Vec<_> = each.iter().map(|one| (one.name.as_str(), one.module.name)).collect();
        let expected =
            [("test.txt (tmcm-6110)", "tmcm-6110"), ("test.txt (tmcm-6214)", "tmcm-6214")];
        assert_eq!(names, expected);
        // What only one of them has is a mistake.
        let text = "module tmcm-6214 tmcm-6110\nanalog 4 1\ntorque\n";
        assert!(parse_each("test.txt", text, &mut NoPrograms).is_err());
        let unknown = parse_each("test.txt", "module tmcm-6214 tmcm-1\n", &mut NoPrograms);
        assert!(unknown.unwrap_err()[0].message.contains("unknown module \"tmcm-1\""));
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

    #[test]
    fn comments_may_stand_behind_a_line() {
        let kinds = steps("wait 1 ms # a while\n> GAP 1, 0 # where\n< 100 # there\nfresh # end");
        assert_eq!(kinds.len(), 3, "{kinds:?}");
        assert!(mistakes("module tmcm-6214\nfresh#")[0].contains("\"fresh#\" is no step"));
    }

    #[test]
    fn only_inputs_that_the_module_has_can_be_set() {
        // Manual 3.6.13: eight digital inputs; port 8 of the analog bank is the supply voltage.
        let text = "module tmcm-6214\ninput 7 high\ninput 8 high\nanalog 0 1\nanalog 8 1";
        let help = "`tmcl modules tmcm-6214` lists those that there are";
        assert_eq!(
            mistakes(text),
            [
                format!("test.txt:3: TMCM-6214 has no input 8; {help}"),
                format!("test.txt:5: TMCM-6214 has no analog input 8; {help}"),
            ]
        );
    }
}
