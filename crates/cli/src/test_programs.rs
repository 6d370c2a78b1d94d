//! `tmcl test`: tests of programs, in virtual time.

mod coverage;
mod junit;
mod lcov;
mod report;
mod result;

use std::io::Write;
use std::path::{Path, PathBuf};
use std::time::Instant;

use opentmcl_conform::{Case, Transcript};
use opentmcl_virtual::ModuleSetup;
use opentmcl_wire::Duration;

use crate::failure::Failure;
use crate::output;
use crate::program::{self, SourceArgs};
use crate::program_files::ProgramFiles;
use crate::sources::{self, Wanted};
use crate::time;
use crate::virtual_target::VirtualTarget;
use coverage::{Counts, Coverage};
use result::{CaseResult, FileResult, Total};

/// Test programs in virtual time
///
/// A test is a transcript: it names a program, starts it, changes inputs, lets time pass and says
/// what must come of it. Each case runs on a new virtual module, and no time passes in reality. The
/// exit status is 1 when a test failed.
#[derive(clap::Args)]
#[command(after_help = EXAMPLES)]
pub(crate) struct Args {
    /// Tests, or folders with tests (*.test.txt)
    #[arg(value_name = "FILE", default_value = ".")]
    files: Vec<PathBuf>,
    /// Only cases with this text in their names, in any case
    #[arg(long, value_name = "TEXT")]
    filter: Option<String>,
    /// Virtual time after which a case has failed: 500ms, 10s, 2min, 1h
    #[arg(long, value_name = "TIME", default_value = "1h", value_parser = time::parse)]
    limit: Duration,
    /// Print how often each line of the programs was executed, and which branches were taken
    #[arg(long, conflicts_with = "json")]
    coverage: bool,
    /// Write the coverage to a file as lcov does
    #[arg(long, value_name = "FILE")]
    lcov: Option<PathBuf>,
    /// Write the results to a file in JUnit's XML
    #[arg(long, value_name = "FILE")]
    junit: Option<PathBuf>,
    /// Print one JSON object per case
    #[arg(long)]
    json: bool,
    #[command(flatten)]
    source: SourceArgs,
}

const EXAMPLES: &str = "\
Examples:
  tmcl test
  tmcl test sort.test.txt --coverage
  tmcl test tests --junit results.xml --lcov lcov.info";

const TESTS: Wanted = Wanted {
    is_it: |path| path.as_os_str().as_encoded_bytes().ends_with(b".test.txt"),
    what: "tests",
    help: "the names of tests end in .test.txt; or name a file",
};

/// Runs the tests.
pub(crate) fn run(args: &Args) -> Result<(), Failure> {
    // Who names a program wants it tested, and has to say how.
    let is_program = |file: &&PathBuf| sources::is_source(file) || program::is_binary(file);
    if let Some(file) = args.files.iter().find(is_program) {
        let message = format!("{} is a program, not a test of one", file.display());
        return Err(
            Failure::usage(message).help("a test is a file *.test.txt with the line: program FILE")
        );
    }
    let files = sources::expand(&args.files, TESTS)?;
    let mut tests = Tests {
        args,
        filter: args.filter.as_deref().map(str::to_lowercase),
        programs: ProgramFiles::new(&args.source),
        counts: (args.coverage || args.lcov.is_some()).then(Counts::default),
    };
    let mut out = anstream::stdout().lock();
    let mut results = Vec::new();
    for file in &files {
        let result = tests.file(file)?;
        if args.json {
            report::json(&mut out, &result)?;
        } else {
            report::print(&mut out, &result)?;
        }
        results.push(result);
    }
    let total = Total::of(&results);
    if let Some(text) = args.filter.as_deref().filter(|_| total.is_empty()) {
        return Err(Failure::usage(format!("no test has {text:?} in its name"))
            .help("`tmcl test` without --filter names all"));
    }
    if !args.json {
        writeln!(out, "{total}")?;
    }
    let mut written = Vec::new();
    if let Some(counts) = &tests.counts {
        let coverage = Coverage::new(counts, &tests.programs);
        if args.coverage {
            write!(out, "\n{coverage}")?;
        }
        if let Some(file) = &args.lcov {
            written.push((file.as_path(), lcov::text(&coverage).into_bytes()));
        }
    }
    if let Some(file) = &args.junit {
        written.push((file.as_path(), junit::text(&results).into_bytes()));
    }
    let outputs: Vec<&Path> = written.iter().map(|(file, _)| *file).collect();
    let programs = tests.programs.programs().filter_map(|(_, program)| program.assembly.as_ref());
    let read = programs.flat_map(program::files).chain(files.iter().map(PathBuf::as_path));
    output::keep_apart(&outputs, read)?;
    // What is written to standard output comes behind all that is there already.
    out.flush()?;
    drop(out);
    output::write_all(written)?;
    total.verdict()
}

struct Tests<'a> {
    args: &'a Args,
    filter: Option<String>,
    programs: ProgramFiles<'a>,
    counts: Option<Counts>,
}

impl Tests<'_> {
    fn file(&mut self, path: &Path) -> Result<FileResult, Failure> {
        let start = Instant::now();
        let name = path.display().to_string();
        let bytes = sources::read(path)?;
        let text = String::from_utf8_lossy(&bytes);
        let mut result = match opentmcl_conform::parse(&name, &text, &mut self.programs) {
            Ok(transcript) => FileResult::new(name, self.cases(&transcript)),
            Err(mistakes) => FileResult::broken(name, mistakes),
        };
        result.wall = start.elapsed();
        Ok(result)
    }

    fn cases(&mut self, transcript: &Transcript) -> Vec<CaseResult> {
        let wanted = transcript.cases.iter().filter(|case| {
            let name = case.name.as_ref().unwrap_or(&transcript.name).to_lowercase();
            self.filter.as_ref().is_none_or(|filter| name.contains(filter))
        });
        let wanted: Vec<&Case> = wanted.collect();
        wanted.into_iter().map(|case| self.case(transcript, case)).collect()
    }

    fn case(&mut self, transcript: &Transcript, case: &Case) -> CaseResult {
        let start = Instant::now();
        let mut target =
            VirtualTarget::new(ModuleSetup::new(transcript.module)).limited(self.args.limit);
        if let Some(counts) = &mut self.counts {
            target = target.observed(counts);
        }
        let outcome = opentmcl_conform::run_case(transcript, case, &mut target);
        CaseResult::new(transcript, case, &outcome, &self.programs, start.elapsed())
    }
}
