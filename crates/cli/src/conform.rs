//! `tmcl conform`: transcripts against a module.

mod files;
mod target;

use std::io::Write;
use std::path::PathBuf;
use std::process::ExitCode;

use opentmcl_conform::{Coverage, Outcome, Transcript};
use opentmcl_link::Uri;
use opentmcl_virtual::ModuleSetup;
use serde::Serialize;

use crate::failure::{self, Failure};
use crate::lookup;
use crate::print::{self, FAILED, OK, SKIPPED, counted};
use crate::program::SourceArgs;
use crate::program_files::ProgramFiles;
use crate::scenario;
use crate::virtual_target::VirtualTarget;
use target::ConnectedModule;

/// Run transcripts: requests and the replies that a module must give
///
/// Without files it runs all transcripts (*.txt) below the folder `conformance`, each on a new
/// virtual module. With --connect they run on another module, for example a real one, which is
/// restarted before each file: its motors move, at up to full current, and its settings and its
/// program change. What cannot be done there, such as switching it off and on, ends a file early.
#[derive(clap::Args)]
#[command(after_help = EXAMPLES)]
pub(crate) struct Args {
    /// Transcripts, or folders with transcripts
    #[arg(value_name = "FILE")]
    files: Vec<PathBuf>,
    /// Module: /dev/ttyACM0, serial:PATH?baud=N, tcp:HOST:PORT, virtual:NAME or virtual:SCENARIO.toml
    #[arg(short, long, value_name = "URI", value_parser = lookup::uri)]
    connect: Option<Uri>,
    /// Only transcripts of this kind of module
    #[arg(short, long, value_name = "NAME")]
    module: Option<String>,
    /// Count what the transcripts cover; a row of the catalogue that none covers is an error
    #[arg(long)]
    coverage: bool,
    /// Print one JSON object per transcript
    #[arg(long)]
    json: bool,
    #[command(flatten)]
    source: SourceArgs,
}

const EXAMPLES: &str = "\
Examples:
  tmcl conform
  tmcl conform conformance/tmcm-6214/rotate.txt -c /dev/ttyACM0
  tmcl conform --coverage";

/// Runs the transcripts and says how the program ends.
pub(crate) fn run(args: Args) -> ExitCode {
    failure::exit_code(run_all(&args))
}

fn run_all(args: &Args) -> Result<(), Failure> {
    let only = args.module.as_deref().map(lookup::module).transpose()?;
    let mut transcripts = files::read(&args.files, &mut ProgramFiles::new(&args.source))?;
    transcripts.retain(|transcript| only.is_none_or(|only| only.name == transcript.module.name));
    if transcripts.is_empty() {
        return Err(Failure::new("there are no transcripts for this module"));
    }
    let mut connection = Connect::new(args.connect.as_ref())?;
    let mut out = anstream::stdout().lock();
    let mut summary = Summary::default();
    for transcript in &transcripts {
        let outcome = connection.run(transcript)?;
        summary.add(&outcome);
        if args.json {
            print::json_line(&mut out, &FileReport::new(transcript, &outcome))?;
        } else {
            print(&mut out, transcript, &outcome)?;
        }
    }
    if !args.json {
        writeln!(out, "{summary}")?;
    }
    let uncovered = if args.coverage { print_coverage(&mut out, args, &transcripts)? } else { 0 };
    match (summary.failed_files, uncovered) {
        (0, 0) => Ok(()),
        (0, rows) => {
            Err(Failure::new(format!("{} of the catalogue not covered", counted(rows, "row")))
                .help("write a transcript for each, or give the row a reason with stored = \"…\""))
        }
        (files, _) => {
            let all = counted(transcripts.len(), "transcript");
            Err(Failure::new(format!("{files} of {all} failed")))
        }
    }
}

/// Where the transcripts run.
enum Connect {
    /// Each on a new virtual module: this one, or of the kind that the transcript is about.
    Virtual(Option<ModuleSetup>),
    /// All on the same module.
    Port(ConnectedModule),
}

impl Connect {
    fn new(uri: Option<&Uri>) -> Result<Self, Failure> {
        Ok(match uri {
            None => Self::Virtual(None),
            Some(Uri::Virtual(name)) => Self::Virtual(Some(scenario::module(name)?)),
            Some(Uri::Port(port)) => Self::Port(ConnectedModule::open(port)?),
        })
    }

    fn run(&mut self, transcript: &Transcript) -> Result<Outcome, Failure> {
        match self {
            Self::Virtual(setup) => {
                let setup = setup.clone().unwrap_or_else(|| ModuleSetup::new(transcript.module));
                let model = setup.model;
                if model.name != transcript.module.name {
                    let (name, about) = (&transcript.name, transcript.module.name);
                    return Err(Failure::usage(format!("{name} is about {about}"))
                        .help(format!("name only transcripts of {}", model.name)));
                }
                Ok(opentmcl_conform::run(transcript, &mut VirtualTarget::new(setup)))
            }
            Self::Port(module) => {
                module.restart()?;
                Ok(opentmcl_conform::run(transcript, module))
            }
        }
    }
}

/// What came of all transcripts.
#[derive(Default)]
struct Summary {
    files: usize,
    failed_files: usize,
    expectations: usize,
    failed: usize,
    skipped_files: usize,
}

impl Summary {
    fn add(&mut self, outcome: &Outcome) {
        self.files += 1;
        self.failed_files += usize::from(!outcome.passed());
        self.skipped_files += usize::from(!outcome.skipped.is_empty());
        self.expectations += outcome.expectations;
        self.failed += outcome.failures.len();
    }
}

impl std::fmt::Display for Summary {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let Self { files, failed_files, expectations, failed, skipped_files } = self;
        let files = counted(*files, "transcript");
        let expectations = counted(*expectations, "expectation");
        write!(f, "{files}, {failed_files} failed, {skipped_files} not to the end; ")?;
        write!(f, "{expectations}, {failed} not met")
    }
}

fn print(out: &mut impl Write, transcript: &Transcript, outcome: &Outcome) -> std::io::Result<()> {
    let (name, expectations) = (&transcript.name, counted(outcome.expectations, "expectation"));
    let failed = outcome.failures.len();
    if outcome.passed() {
        writeln!(out, "{OK}ok{OK:#}      {name}: {expectations}")?;
    } else {
        writeln!(out, "{FAILED}failed{FAILED:#}  {name}: {failed} of {expectations}")?;
    }
    for failure in &outcome.failures {
        writeln!(out, "  {name}:{}: {}", failure.line, failure.command)?;
        writeln!(out, "    expected {}", failure.expected)?;
        writeln!(out, "    got      {}", failure.got)?;
    }
    for skipped in &outcome.skipped {
        let (line, reason) = (skipped.line, &skipped.reason);
        writeln!(out, "  {SKIPPED}skipped{SKIPPED:#} from line {line}: {reason}")?;
    }
    Ok(())
}

/// Prints what the transcripts cover, module by module; returns how many rows are not covered.
fn print_coverage(
    out: &mut impl Write,
    args: &Args,
    transcripts: &[Transcript],
) -> Result<usize, Failure> {
    let mut coverages: Vec<Coverage> = Vec::new();
    for transcript in transcripts {
        let known = coverages.iter().position(|c| c.module().name == transcript.module.name);
        let at = known.unwrap_or_else(|| {
            coverages.push(Coverage::new(transcript.module));
            coverages.len() - 1
        });
        coverages[at].add(transcript);
    }
    let mut uncovered = 0;
    for coverage in &coverages {
        uncovered += coverage.tables().iter().map(|table| table.uncovered.len()).sum::<usize>();
        if args.json {
            print::json_line(out, &CoverageReport::new(coverage))?;
        } else {
            write!(out, "\n{coverage}")?;
        }
    }
    Ok(uncovered)
}

/// What `--json` prints of a transcript.
#[derive(Serialize)]
struct FileReport<'a> {
    file: &'a str,
    module: &'static str,
    passed: bool,
    expectations: usize,
    failures: Vec<FailureReport<'a>>,
    #[serde(skip_serializing_if = "Option::is_none")]
    skipped_from_line: Option<usize>,
    #[serde(skip_serializing_if = "Option::is_none")]
    skipped_because: Option<&'a str>,
}

#[derive(Serialize)]
struct FailureReport<'a> {
    line: usize,
    command: &'a str,
    expected: &'a str,
    got: &'a str,
}

impl<'a> FileReport<'a> {
    fn new(transcript: &'a Transcript, outcome: &'a Outcome) -> Self {
        let failures = outcome.failures.iter().map(|failure| FailureReport {
            line: failure.line,
            command: &failure.command,
            expected: &failure.expected,
            got: &failure.got,
        });
        let skipped = outcome.skipped.first();
        Self {
            file: &transcript.name,
            module: transcript.module.name,
            passed: outcome.passed(),
            expectations: outcome.expectations,
            failures: failures.collect(),
            skipped_from_line: skipped.map(|skipped| skipped.line),
            skipped_because: skipped.map(|skipped| skipped.reason.as_str()),
        }
    }
}

/// What `--json` prints of the coverage.
#[derive(Serialize)]
struct CoverageReport {
    coverage: &'static str,
    tables: Vec<TableReport>,
}

#[derive(Serialize)]
struct TableReport {
    table: &'static str,
    rows: usize,
    with_behaviour: usize,
    covered: usize,
    stored: Vec<StoredReport>,
    uncovered: Vec<String>,
}

#[derive(Serialize)]
struct StoredReport {
    row: String,
    reason: &'static str,
}

impl CoverageReport {
    fn new(coverage: &Coverage) -> Self {
        let tables = coverage.tables().into_iter().map(|table| TableReport {
            table: table.name,
            rows: table.rows,
            with_behaviour: table.with_behaviour(),
            covered: table.covered,
            stored: table
                .stored
                .into_iter()
                .map(|(row, reason)| StoredReport { row, reason })
                .collect(),
            uncovered: table.uncovered,
        });
        Self { coverage: coverage.module().name, tables: tables.collect() }
    }
}
