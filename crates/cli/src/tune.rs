//! `tmcl tune`: the step response of a servo's regulators.

mod analysis;
mod health;
mod line;
mod picture;
mod record;
mod regulator;
mod report;
mod run;
mod settings;

use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

use opentmcl_catalog::{AxisBehaviour, AxisParameter, Module, Servo};
use opentmcl_wire::Duration;
use signal_hook::consts::{SIGINT, SIGTERM};

use crate::connect::ConnectArgs;
use crate::failure::Failure;
use crate::recording::Format;
use crate::sources::is_dash;
use crate::{lookup, output, print, time};
use line::Line;
use regulator::{Parameters, Regulator};
use report::Report;
use run::Plan;
use settings::{must_be_in_range, named_parameter};

/// Measure how a servo's regulator answers a step
///
/// The module is told a new torque, velocity or position, and what it does is read until the time is up: how long
/// it rises, how far it overshoots, when it settles, what is missing. Then the motor is stopped, and all parameters
/// have the values of before. The motor turns: take care that it may. A virtual module inside this program is as it
/// leaves the factory and is asked at exact times; over a line as fast as replies come.
#[derive(clap::Args)]
#[command(after_help = EXAMPLES)]
pub(crate) struct Args {
    /// Which regulator
    #[arg(value_enum)]
    regulator: Regulator,
    #[command(flatten)]
    connect: ConnectArgs,
    /// Height of the step: torque in mA, velocity in rpm, or a distance in the module's units
    #[arg(long, value_name = "VALUE", allow_negative_numbers = true)]
    step: i32,
    /// Proportional gain of this regulator for the run
    #[arg(long, value_name = "GAIN")]
    p: Option<i32>,
    /// Integral gain of this regulator for the run
    #[arg(long, value_name = "GAIN")]
    i: Option<i32>,
    /// Another parameter for the run, by name or number; may be given more than once, in this order
    #[arg(long, value_name = "NAME=VALUE", value_parser = settings::parse)]
    set: Vec<(String, i32)>,
    /// Leave gains and parameters as they are in the run
    #[arg(long)]
    keep: bool,
    /// Use the ramp of the velocity; otherwise it is off during the run
    #[arg(long)]
    ramp: bool,
    /// How long the answer is watched [default: 100ms for the torque, otherwise 1s]
    #[arg(long, value_name = "TIME", value_parser = time::parse)]
    duration: Option<Duration>,
    /// Samples per second, at most, 1..20000
    #[arg(
        long,
        value_name = "HZ",
        default_value_t = 1000,
        value_parser = clap::value_parser!(u32).range(1..=20_000)
    )]
    rate: u32,
    /// Band in which it has settled, in percent of the way to both sides, 1..50
    #[arg(
        long,
        value_name = "PERCENT",
        default_value_t = 5,
        value_parser = clap::value_parser!(u8).range(1..=50)
    )]
    band: u8,
    /// Module [default: the one that answers]
    #[arg(short, long, value_name = "NAME")]
    module: Option<String>,
    /// Draw the answer to an SVG file
    #[arg(long, value_name = "FILE")]
    plot: Option<PathBuf>,
    /// Write the samples to a file: FILE.csv, FILE.parquet or FILE.mcap
    #[arg(long, value_name = "FILE")]
    record: Option<PathBuf>,
    /// Print the report as one line of JSON
    #[arg(long)]
    json: bool,
}

const EXAMPLES: &str = "\
Examples:
  tmcl tune torque -c virtual:tmcm-1613 --step 1000 --p 600 --i 0
  tmcl tune velocity -c /dev/ttyACM0 --step 2000 --p 800 --i 500 --plot velocity.svg
  tmcl tune velocity -c virtual:tmcm-1636 --step 1000 --set commutation_mode=2 --set hall_polarity=1
  tmcl tune position -c tcp:127.0.0.1:4016 --step 4096 --p 300 --ramp --json";

/// Longest run: samples are kept in memory.
const LONGEST: Duration = Duration::from_secs(60);

/// Makes the step and tells what came of it.
pub(crate) fn run(args: &Args) -> Result<(), Failure> {
    check_outputs(args)?;
    let duration = duration(args)?;
    let chosen = args.module.as_deref().map(lookup::module).transpose()?;
    let mut line = Line::open(&args.connect)?;
    let module = match chosen {
        Some(module) => module,
        None => identify(&mut line)?,
    };
    let parameters = args.regulator.parameters(module)?;
    let settings = settings(args, module, &parameters)?;
    must_be_in_range(parameters.target, args.step)?;
    let plan = Plan {
        module,
        regulator: args.regulator,
        parameters,
        step: args.step,
        settings,
        duration,
        rate: args.rate,
    };
    let interrupted = Arc::new(AtomicBool::new(false));
    for signal in [SIGINT, SIGTERM] {
        signal_hook::flag::register(signal, Arc::clone(&interrupted))
            .map_err(|error| Failure::new(format!("cannot wait for Ctrl-C: {error}")))?;
    }
    let run = run::play(&mut line, &plan, &|| interrupted.load(Ordering::Relaxed))?;

    let report = Report::new(&plan, &run, args, line.is_virtual());
    if let Some(path) = &args.record {
        record::write(path, &plan, &run)?;
    }
    if let Some(path) = &args.plot {
        let svg = picture::draw(&plan, &run, &report);
        output::write_all([(&**path, svg.into_bytes())])?;
    }
    let mut out = anstream::stdout().lock();
    if args.json {
        print::json_line(&mut out, &report)?;
    } else {
        report.write(&mut out)?;
    }
    if report.has_failed() { Err(report.failure()) } else { Ok(()) }
}

/// Fails if the files cannot be what they are to be.
fn check_outputs(args: &Args) -> Result<(), Failure> {
    let outputs: Vec<&Path> = args.record.iter().chain(&args.plot).map(PathBuf::as_path).collect();
    if outputs.iter().any(|file| is_dash(file)) {
        return Err(Failure::usage("standard output has the report already")
            .help("name a file for the recording or the picture"));
    }
    output::keep_apart(&outputs, [])?;
    if let Some(path) = &args.record {
        Format::of(path)?;
    }
    Ok(())
}

fn duration(args: &Args) -> Result<Duration, Failure> {
    let usual = match args.regulator {
        Regulator::Torque => Duration::from_millis(100),
        Regulator::Velocity | Regulator::Position => Duration::from_secs(1),
    };
    match args.duration.unwrap_or(usual) {
        duration if duration > LONGEST => {
            Err(Failure::usage("a step is watched for a minute at most")
                .help("write --duration 1s"))
        }
        duration => Ok(duration),
    }
}

/// The module that answers.
fn identify(line: &mut Line) -> Result<&'static Module, Failure> {
    let number = line.module_number()?;
    number.and_then(lookup::by_number).ok_or_else(|| {
        let message = match number {
            Some(number) => {
                format!("the module calls itself {number}, which is not in the catalogue")
            }
            None => "the module does not tell which one it is".to_owned(),
        };
        Failure::new(message).help("--module NAME says as which one it is to be treated")
    })
}

/// Parameters for the run, in the order in which they are set, and whether they keep their values.
fn settings(
    args: &Args,
    module: &'static Module,
    parameters: &Parameters,
) -> Result<Vec<(&'static AxisParameter, i32, bool)>, Failure> {
    let mut settings = Vec::new();
    if args.regulator != Regulator::Torque {
        let ramp = regulator::parameter(module, Servo::RampEnable)?;
        settings.push((ramp, i32::from(args.ramp), false));
    } else if args.ramp {
        return Err(Failure::usage("the torque has no ramp").help("leave --ramp out"));
    }
    for (name, value) in &args.set {
        let row = named_parameter(module, name)?;
        if row.behaviour == AxisBehaviour::Servo(Servo::RampEnable) {
            return Err(Failure::usage("the ramp is off during a run, or on with --ramp")
                .help(format!("leave --set {name} out")));
        }
        settings.push((row, *value, args.keep));
    }
    if let Some(p) = args.p {
        settings.push((parameters.p, p, args.keep));
    }
    if let Some(i) = args.i {
        let row = parameters.i.ok_or_else(|| {
            Failure::usage("the position regulator has no integral part").help("leave --i out")
        })?;
        settings.push((row, i, args.keep));
    }
    settings.iter().try_for_each(|(row, value, _)| must_be_in_range(row, *value))?;
    Ok(settings)
}
