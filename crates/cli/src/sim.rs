//! `tmcl sim`: a program in virtual time.

mod listing;
mod options;
mod picture;
mod ports;
mod record;
mod report;
mod run;
mod summary;
mod tally;
mod trace;

use std::io::{BufWriter, Write};
use std::path::{Path, PathBuf};

use opentmcl_catalog::Module;
use opentmcl_virtual::ModuleSetup;
use opentmcl_wire::limits::VARIABLE_BANK;
use opentmcl_wire::{Command, Duration, Opcode};

use crate::failure::Failure;
use crate::lookup;
use crate::output;
use crate::print;
use crate::program::{self, Refusals, SourceArgs};
use crate::recording::Format;
use crate::scenario;
use crate::sources::{self, is_dash};
use crate::time;
use crate::virtual_args::VirtualArgs;
use listing::Listing;
use picture::Picture;
use record::Record;
use run::{Observer, Run};
use summary::Summary;
use tally::Tally;
use trace::Trace;

/// Run a program in virtual time and tell what it does
///
/// The program is downloaded into a new module and started. The run is over when it has stopped and
/// the axes have come to rest, or when the time is up; it takes no longer than it has to. A command
/// that the module refuses does nothing and the program goes on, as on a real module: the summary
/// names such commands. The exit status is 0 when the program ran, however it ended.
#[derive(clap::Args)]
#[command(after_help = EXAMPLES)]
pub(crate) struct Args {
    /// Program: source text, or a binary as `tmcl asm` writes it
    file: PathBuf,
    /// Module on which it runs [default: the one that a comment `// module: NAME` names]
    #[arg(short, long, value_name = "NAME")]
    module: Option<String>,
    /// Scenario with the machines behind the axes: FILE, or FILE#NAME for a module of several
    #[arg(long, value_name = "FILE")]
    scenario: Option<String>,
    /// Longest virtual time: 500ms, 10s, 2min, 1h
    #[arg(long, value_name = "TIME", default_value = "60s", value_parser = time::parse)]
    until: Duration,
    /// Level of a digital input; may be given more than once
    #[arg(long, value_name = "N=high|low", value_parser = options::parse_input)]
    input: Vec<(u8, bool)>,
    /// Reading of an analog input; may be given more than once
    #[arg(long, value_name = "N=READING", value_parser = options::parse_analog)]
    analog: Vec<(u8, u16)>,
    /// Value of a user variable; may be given more than once
    #[arg(long, value_name = "N=VALUE", value_parser = options::parse_variable)]
    variable: Vec<(u8, i32)>,
    #[command(flatten)]
    virtual_module: VirtualArgs,
    /// Print each executed command
    #[arg(long)]
    trace: bool,
    /// Write positions, speeds, program counter, outputs and what machines do to a file: FILE.csv,
    /// FILE.parquet or FILE.mcap
    #[arg(long, value_name = "FILE")]
    record: Option<PathBuf>,
    /// Samples per second of the recording, 1..1000000
    #[arg(
        long,
        value_name = "HZ",
        default_value_t = 100,
        requires = "record",
        value_parser = clap::value_parser!(u32).range(1..=1_000_000)
    )]
    rate: u32,
    /// Record a user variable as well; may be given more than once
    #[arg(long, value_name = "N", requires = "record")]
    record_variable: Vec<u8>,
    /// Draw speeds, positions and outputs to an SVG file
    #[arg(long, value_name = "FILE")]
    plot: Option<PathBuf>,
    /// Print the summary as one line of JSON
    #[arg(long, conflicts_with = "trace")]
    json: bool,
    #[command(flatten)]
    source: SourceArgs,
}

const EXAMPLES: &str = "\
Examples:
  tmcl sim sorter.tmc
  tmcl sim sorter.bin --module tmcm-6214
  tmcl sim sorter.tmc --until 10s --input 3=high --variable 42=1000 --trace
  tmcl sim homing.tmc --scenario lab.toml
  tmcl sim sorter.tmc --record sorter.csv --rate 1000 --plot sorter.svg
  tmcl sim sorter.tmc --record sorter.mcap";

/// Runs the program.
pub(crate) fn run(args: &Args) -> Result<(), Failure> {
    let setup = args.scenario.as_deref().map(scenario::of_argument).transpose()?;
    let mut chosen = args.module.as_deref().map(lookup::module).transpose()?;
    if let Some(setup) = &setup {
        if let Some(other) = chosen.filter(|chosen| chosen.name != setup.model.name) {
            let message =
                format!("the scenario has a {}, not a {}", setup.model.title, other.title);
            return Err(Failure::usage(message).help("leave --module out"));
        }
        chosen = Some(setup.model);
    }
    let outputs: Vec<&Path> = args.record.iter().chain(&args.plot).map(PathBuf::as_path).collect();
    if outputs.iter().any(|file| is_dash(file)) {
        return Err(Failure::usage("standard output has the summary already")
            .help("name a file for the recording or the picture"));
    }
    let program = program::load(&args.file, &args.source, chosen, Refusals::Tell)?;
    let own = program.assembly.iter().flat_map(program::files);
    let around = args.scenario.as_deref().map(scenario::file);
    output::keep_apart(&outputs, own.chain([&*args.file]).chain(around))?;
    if let Some(path) = &args.record {
        Format::of(path)?;
    }
    let model = chosen.or_else(|| program.module()).ok_or_else(|| {
        let message = format!("{} does not say for which module it is", sources::shown(&args.file));
        Failure::usage(message).help("--module NAME does; so does `// module: NAME` in the source")
    })?;
    let listing = Listing::new(&program);
    let setup = setup.unwrap_or_else(|| ModuleSetup::new(model));
    let mut run = Run::new(&setup, args.virtual_module.options(), &program.commands)?;
    set_up(&mut run, model, args)?;

    let mut out = BufWriter::new(anstream::stdout().lock());
    let mut tally = Tally::new(run.start);
    let mut trace =
        if args.trace { Some(Trace::new(&mut out, &listing, run.start)?) } else { None };
    let mut record = match &args.record {
        Some(path) => Some(Record::create(path, &run.module, args.rate, &args.record_variable)?),
        None => None,
    };
    let mut picture = args.plot.as_ref().map(|_| Picture::new(&listing, run.start));

    let mut observers: Vec<&mut dyn Observer> = vec![&mut tally];
    observers.extend(trace.as_mut().map(|trace| trace as &mut dyn Observer));
    observers.extend(record.as_mut().map(|record| record as &mut dyn Observer));
    observers.extend(picture.as_mut().map(|picture| picture as &mut dyn Observer));
    let outcome = run.play(args.until, &mut observers)?;

    let name = args.file.file_name().unwrap_or_default().to_string_lossy().into_owned();
    if let Some(record) = record {
        record.finish()?;
    }
    if let (Some(picture), Some(path)) = (picture, &args.plot) {
        let title = format!("{name} on a {}", model.title);
        let svg = picture.draw(&title, &mut run);
        output::write_all([(&**path, svg.into_bytes())])?;
    }
    let summary = Summary::new(name, &listing, &mut run, &tally, &outcome);
    if trace.is_some() {
        writeln!(out)?;
    }
    if args.json {
        print::json_line(&mut out, &summary)?;
    } else {
        report::write(&mut out, &summary)?;
    }
    out.flush()?;
    Ok(())
}

/// What is to be so when the program starts.
fn set_up(run: &mut Run, model: &'static Module, args: &Args) -> Result<(), Failure> {
    for &(number, level) in &args.input {
        let input = ports::digital_input(model, number)?;
        run.module.set_digital_input(input.index, level);
    }
    for &(number, reading) in &args.analog {
        let input = ports::analog_input(model, number)?;
        if i32::from(reading) > input.max {
            return Err(Failure::usage(format!(
                "analog input {number} cannot read {reading}; write 0 to {}",
                input.max
            )));
        }
        run.module.set_analog_input(input.index, reading);
    }
    for &(number, value) in &args.variable {
        let command = Command::new(Opcode::Sgp.number(), number, VARIABLE_BANK, value);
        run::execute(&mut run.module, command)?;
    }
    Ok(())
}
