//! What came of tests.

use std::fmt;

use opentmcl_conform::{
    Body, Case, Failure as Unmet, Mistake, Moment, Outcome, Program, StepKind, Transcript,
};
use opentmcl_wire::Duration;

use crate::failure::Failure;
use crate::print::counted;
use crate::program_files::ProgramFiles;

/// A file with tests.
pub(super) struct FileResult {
    pub(super) name: String,
    /// Those of its cases that were run.
    pub(super) cases: Vec<CaseResult>,
    /// Why none was run.
    pub(super) mistakes: Vec<Mistake>,
    pub(super) wall: std::time::Duration,
}

impl FileResult {
    pub(super) fn new(name: String, cases: Vec<CaseResult>) -> Self {
        Self { name, cases, mistakes: Vec::new(), wall: std::time::Duration::ZERO }
    }

    pub(super) fn broken(name: String, mistakes: Vec<Mistake>) -> Self {
        Self { mistakes, ..Self::new(name, Vec::new()) }
    }
}

/// One case.
pub(super) struct CaseResult {
    /// What the line `test` calls it.
    pub(super) name: Option<String>,
    /// The line where it begins.
    pub(super) line: usize,
    pub(super) expectations: usize,
    pub(super) failures: Vec<CaseFailure>,
    /// How long it took on the module.
    pub(super) time: Duration,
    /// How long it took in reality.
    pub(super) wall: std::time::Duration,
}

/// An expectation that was not met.
pub(super) struct CaseFailure {
    pub(super) line: usize,
    pub(super) command: String,
    pub(super) expected: String,
    pub(super) got: String,
    pub(super) time: Duration,
    pub(super) program: Option<ProgramState>,
}

/// What the program did then.
pub(super) struct ProgramState {
    pub(super) running: bool,
    pub(super) address: u16,
    pub(super) place: Option<SourceLine>,
}

pub(super) struct SourceLine {
    pub(super) file: String,
    pub(super) line: usize,
    pub(super) text: String,
}

impl CaseResult {
    pub(super) fn new(
        transcript: &Transcript,
        case: &Case,
        outcome: &Outcome,
        programs: &ProgramFiles<'_>,
        wall: std::time::Duration,
    ) -> Self {
        let failure = |unmet: &Unmet| CaseFailure {
            line: unmet.line,
            command: unmet.command.clone(),
            expected: unmet.expected.clone(),
            got: unmet.got.clone(),
            time: unmet.moment.time,
            program: state(transcript, case, programs, unmet.line, unmet.moment),
        };
        Self {
            name: case.name.clone(),
            line: case.line,
            expectations: outcome.expectations,
            failures: outcome.failures.iter().map(failure).collect(),
            time: outcome.ended.map_or(Duration::from_ticks(0), |moment| moment.time),
            wall,
        }
    }

    pub(super) fn passed(&self) -> bool {
        self.failures.is_empty()
    }
}

/// What the program did when a line failed; none if none had been loaded.
fn state(
    transcript: &Transcript,
    case: &Case,
    programs: &ProgramFiles<'_>,
    line: usize,
    moment: Moment,
) -> Option<ProgramState> {
    let steps = transcript.setup.iter().chain(&case.steps);
    let loaded = steps.take_while(|step| step.line <= line).filter_map(|step| match &step.kind {
        StepKind::Program(program) => Some(program),
        _ => None,
    });
    let program = loaded.last()?;
    let moment = moment.program?;
    let place = source_line(transcript, program, programs, moment.address);
    Some(ProgramState { running: moment.running, address: moment.address, place })
}

fn source_line(
    transcript: &Transcript,
    program: &Program,
    programs: &ProgramFiles<'_>,
    address: u16,
) -> Option<SourceLine> {
    match &program.body {
        Body::Lines(lines) => {
            let at = i32::from(address).checked_sub(program.address)?;
            let source = lines.get(usize::try_from(at).ok()?)?;
            let (file, text) = (transcript.name.clone(), source.text.clone());
            Some(SourceLine { file, line: source.line, text })
        }
        Body::File(assembled) => {
            let place = programs.program(assembled.number)?.place(address)?;
            let (file, text) = (place.file.to_owned(), place.text.to_owned());
            Some(SourceLine { file, line: place.line as usize, text })
        }
    }
}

impl fmt::Display for ProgramState {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let state = if self.running { "running" } else { "stopped" };
        match &self.place {
            Some(SourceLine { file, line, text }) => {
                write!(f, "program {state} at {file}:{line}: {text}")
            }
            None => write!(f, "program {state} at address {}", self.address),
        }
    }
}

/// What came of all files.
#[derive(Debug, Default)]
pub(super) struct Total {
    passed: usize,
    failed: usize,
    broken_files: usize,
}

impl Total {
    pub(super) fn of(results: &[FileResult]) -> Self {
        let mut total = Self::default();
        for file in results {
            total.broken_files += usize::from(!file.mistakes.is_empty());
            for case in &file.cases {
                total.passed += usize::from(case.passed());
                total.failed += usize::from(!case.passed());
            }
        }
        total
    }

    /// Whether there was nothing to run.
    pub(super) fn is_empty(&self) -> bool {
        let Self { passed, failed, broken_files } = self;
        passed + failed + broken_files == 0
    }

    pub(super) fn verdict(&self) -> Result<(), Failure> {
        let Self { passed, failed, broken_files } = self;
        match (failed, broken_files) {
            (0, 0) => Ok(()),
            (0, files) => {
                Err(Failure::new(format!("{} could not be run", counted(*files, "file"))))
            }
            _ => Err(Failure::new(format!(
                "{failed} of {} failed",
                counted(passed + failed, "test")
            ))),
        }
    }
}

impl fmt::Display for Total {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { passed, failed, broken_files } = self;
        write!(f, "{}: {passed} passed, {failed} failed", counted(passed + failed, "test"))?;
        if *broken_files > 0 {
            write!(f, "; {} could not be run", counted(*broken_files, "file"))?;
        }
        Ok(())
    }
}
