//! Cases, and the programs that they load and start.

use std::rc::Rc;

use opentmcl_wire::{Command, control, mnemonic, serial};

use super::number::value;
use super::{Begun, Parser};
use crate::programs::Assembled;
use crate::transcript::{
    Body, Case, DEFAULT_ADDRESS, Exchange, ExpectedReply, Program, SourceCommand, StepKind,
};

/// What program is loaded at a place of the file.
#[derive(Clone, Default)]
pub(super) struct Loaded {
    /// The last one from a file, whose names are known.
    pub(super) program: Option<Rc<Assembled>>,
    /// Address of the one that was loaded last.
    pub(super) address: i32,
}

impl Parser<'_> {
    pub(super) fn case(&mut self, line: usize, name: &str) -> Result<Begun, String> {
        let name = name.strip_prefix('"').and_then(|name| name.strip_suffix('"')).unwrap_or(name);
        if name.is_empty() || name.contains('"') {
            return Err("a test has a name: test \"rejects go left\"".into());
        }
        let same = self.cases.iter().find(|case| case.name.as_deref() == Some(name));
        let same = same.map(|case| format!("the test in line {} has the same name", case.line));
        if self.cases.is_empty() {
            self.setup = self.now.clone();
        } else {
            self.now = self.setup.clone();
        }
        self.cases.push(Case { name: Some(name.to_owned()), line, steps: Vec::new() });
        same.map_or(Ok(Begun::Case), Err)
    }

    /// A program: in the following lines, at an address, or in a file.
    pub(super) fn program(&mut self, operand: &str) -> Result<Begun, String> {
        let is_number = operand.starts_with(|c: char| c.is_ascii_digit() || matches!(c, '-' | '$'));
        if operand.is_empty() {
            return Ok(Begun::Program { address: 0 });
        }
        if is_number && let Ok(address) = value(operand) {
            return Ok(Begun::Program { address });
        }
        let file = operand.strip_prefix('"').and_then(|file| file.strip_suffix('"'));
        let module = self.module.ok_or("it is not known for which module the program is")?;
        let program = self.programs.load(file.unwrap_or(operand), self.name, module)?;
        self.now = Loaded { program: Some(Rc::clone(&program)), address: 0 };
        let body = Body::File(program);
        Ok(Begun::Step(StepKind::Program(Program { address: 0, body })))
    }

    /// The commands in the following lines up to `end`.
    pub(super) fn inline_program<'t>(
        &mut self,
        begin: usize,
        address: i32,
        lines: &mut impl Iterator<Item = (usize, &'t str)>,
    ) -> Program {
        let mut commands = Vec::new();
        let mut ended = false;
        for (line, text) in lines {
            if text == "end" {
                ended = true;
                break;
            }
            match mnemonic::parse(text) {
                Ok(command) => commands.push(SourceCommand { line, text: text.into(), command }),
                Err(error) => self.mistake(line, error),
            }
        }
        if !ended {
            self.mistake(begin, "the program has no end; write a line: end");
        }
        self.now.address = address;
        Program { address, body: Body::Lines(commands) }
    }
}

/// The program is started at an address.
pub(super) fn run_from(text: &str, line: usize, address: i32) -> StepKind {
    executed(text, line, Command::new(control::RUN_PROGRAM, 1, 0, address))
}

/// A command that must be executed.
pub(super) fn executed(text: &str, line: usize, command: Command) -> StepKind {
    StepKind::Exchange(Exchange {
        text: text.to_owned(),
        request: serial::encode_request(DEFAULT_ADDRESS, command),
        expected: ExpectedReply::Status { status: 100, value: None },
        expected_line: line,
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::parse::{Mistake, parse};
    use crate::programs::{NoPrograms, Programs};
    use crate::transcript::Transcript;
    use opentmcl_catalog::Module;

    /// Has one program, with two commands.
    struct OneFile;

    impl Programs for OneFile {
        fn load(&mut self, file: &str, from: &str, _: &Module) -> Result<Rc<Assembled>, String> {
            if (file, from) != ("my sort.tmc", "test.txt") {
                return Err(format!("there is no {file} beside {from}"));
            }
            Ok(Rc::new(Assembled {
                number: 4,
                commands: vec![Command::new(14, 1, 2, 1), Command::new(28, 0, 0, 0)],
                labels: vec![("Again".into(), 1)],
                constants: vec![("Door".into(), 3), ("Full".into(), 4095)],
            }))
        }
    }

    #[track_caller]
    fn with_file(text: &str) -> Result<Transcript, Vec<Mistake>> {
        parse("test.txt", &format!("module tmcm-6214\n{text}"), &mut OneFile)
    }

    #[track_caller]
    fn without_file(text: &str) -> Vec<StepKind> {
        let text = format!("module tmcm-6214\n{text}");
        let transcript = parse("test.txt", &text, &mut NoPrograms).unwrap();
        transcript.steps().map(|step| step.kind.clone()).collect()
    }

    #[track_caller]
    fn command_of(kind: &StepKind) -> Command {
        let StepKind::Exchange(exchange) = kind else { panic!("{kind:?} is no request") };
        assert_eq!(exchange.expected, ExpectedReply::Status { status: 100, value: None });
        exchange.command().unwrap()
    }

    #[test]
    fn a_program_from_a_file_is_loaded_and_its_names_are_known() {
        let text = "program my sort.tmc\nrun at again\ninput Door high\nanalog 0 Full\n\
                    set variable Door = -Full\nstop\n> GAP 1, 0\n< 100 0..full";
        let transcript = with_file(text).unwrap();
        let steps: Vec<_> = transcript.steps().map(|step| &step.kind).collect();
        let StepKind::Program(program) = steps[0] else { panic!("{:?}", steps[0]) };
        assert_eq!(program.address, 0);
        assert_eq!(program.commands().count(), 2);
        // 129 type 1 starts at an address, 128 stops, SGP 3, 2, -4095 sets a variable.
        assert_eq!(command_of(steps[1]), Command::new(129, 1, 0, 1));
        assert_eq!(*steps[2], StepKind::Input { number: 3, high: true });
        assert_eq!(*steps[3], StepKind::Analog { number: 0, reading: 4095 });
        assert_eq!(command_of(steps[4]), Command::new(9, 3, 2, -4095));
        assert_eq!(command_of(steps[5]), Command::new(128, 0, 0, 0));
        let StepKind::Exchange(exchange) = steps[6] else { panic!("{:?}", steps[6]) };
        let value = Some(0..=4095);
        assert_eq!(exchange.expected, ExpectedReply::Status { status: 100, value });
        assert!(with_file("program \"my sort.tmc\"").is_ok());
    }

    #[test]
    fn a_program_is_started_where_it_was_loaded() {
        let kinds = without_file("program 10\nSTOP\nend\nrun");
        assert_eq!(command_of(&kinds[1]), Command::new(129, 1, 0, 10));
        let kinds = without_file("run");
        assert_eq!(command_of(&kinds[0]), Command::new(129, 1, 0, 0));
    }

    #[test]
    fn lines_before_the_first_test_belong_to_each_case() {
        let text = "program my sort.tmc\nwait 1 ms\ntest \"a # b\"\nrun\ntest two words\nrun\n\
                    wait 2 ms";
        let transcript = with_file(text).unwrap();
        assert_eq!(transcript.setup.len(), 2);
        let cases: Vec<_> = transcript
            .cases
            .iter()
            .map(|case| (case.name.as_deref(), case.line, case.steps.len()))
            .collect();
        assert_eq!(cases, [(Some("a # b"), 4, 1), (Some("two words"), 6, 2)]);
        let lines: Vec<_> = transcript.steps().map(|step| step.line).collect();
        assert_eq!(lines, [2, 3, 5, 7, 8]);
    }

    #[test]
    fn a_file_without_tests_is_one_case_without_a_name() {
        let transcript = with_file("wait 1 ms\nwait 2 ms").unwrap();
        assert_eq!(transcript.setup, []);
        let [case] = &transcript.cases[..] else { panic!("{:?}", transcript.cases) };
        assert_eq!((case.name.as_deref(), case.steps.len()), (None, 2));
    }

    #[test]
    fn the_program_of_a_case_is_forgotten_in_the_next_one() {
        let text = "program 7\nSTOP\nend\ntest \"a\"\nprogram my sort.tmc\nrun at Again\n\
                    test \"b\"\nrun";
        let transcript = with_file(text).unwrap();
        let run = transcript.cases[1].steps.last().unwrap();
        assert_eq!(command_of(&run.kind), Command::new(129, 1, 0, 7));
        let mistakes = with_file(&format!("{text} at Again")).unwrap_err();
        assert!(mistakes[0].message.contains("no program is loaded from a file"), "{mistakes:?}");
    }

    #[test]
    fn mistakes_in_the_lines_of_tests_are_told_together() {
        let text = "program no.tmc\ntest\ntest \"a\"\nset output 1 = 1\nexpect\n\
                    wait until\ntest \"a\"\nrun at 70000";
        let mistakes = with_file(text).unwrap_err();
        let begin = [
            "test.txt:2: there is no no.tmc beside test.txt",
            "test.txt:3: a test has a name: test \"rejects go left\"",
            "test.txt:5: only variables can be set: set variable 42 = 7",
            "test.txt:6: a condition is missing",
            "test.txt:7: \"\" is no condition",
            "test.txt:8: the test in line 4 has the same name",
            "test.txt:9: 70000 is not a number from 0 to 65535",
        ];
        assert_eq!(mistakes.len(), begin.len(), "{mistakes:#?}");
        for (found, begin) in mistakes.iter().zip(begin) {
            let found = found.to_string();
            assert!(found.starts_with(begin), "{found} should begin with {begin}");
        }
    }
}
