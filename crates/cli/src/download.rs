//! `tmcl download`: a program onto a module.

use std::io::Write;
use std::path::PathBuf;
use std::time::Instant;

use opentmcl_link::program::Protection;
use serde::Serialize;

use crate::connect::ConnectArgs;
use crate::failure::Failure;
use crate::lookup;
use crate::print::{self, counted};
use crate::program::{self, Refusals, SourceArgs};
use crate::progress::Progress;

/// Bring a program onto a module
///
/// The program is assembled first, and checked against the module: against its own type, which the
/// module tells, or that of --module. What runs on the module is stopped. What the line loses or
/// garbles is sent again.
#[derive(clap::Args)]
#[command(after_help = EXAMPLES)]
pub(crate) struct Args {
    /// Program: source, or binary with the extension .bin
    file: PathBuf,
    #[command(flatten)]
    source: SourceArgs,
    #[command(flatten)]
    connect: ConnectArgs,
    /// Check the program against this module instead of the connected one
    #[arg(short, long, value_name = "NAME")]
    module: Option<String>,
    /// Read the program back and compare
    #[arg(long)]
    verify: bool,
    /// Whether the module starts the program when it is switched on [default: as it was]
    #[arg(long, value_name = "WHEN")]
    autostart: Option<AutoStart>,
    /// Start the program afterwards
    #[arg(long)]
    run: bool,
    /// Print one JSON object
    #[arg(long)]
    json: bool,
}

#[derive(Clone, Copy, PartialEq, Eq, clap::ValueEnum)]
enum AutoStart {
    On,
    Off,
}

const EXAMPLES: &str = "\
Examples:
  tmcl download stage.tmc -c /dev/ttyACM0
  tmcl download stage.tmc -c tcp:127.0.0.1:4016 --verify --run
  tmcl download stage.bin -c /dev/ttyACM0 --autostart on";

/// What was done, as `--json` prints it.
#[derive(Serialize)]
struct Downloaded {
    /// Number and version of the module, if it tells them.
    module: Option<u16>,
    firmware: Option<String>,
    commands: usize,
    seconds: f64,
    verified: bool,
    /// Null if it was left as it was.
    auto_start: Option<bool>,
    started: bool,
}

/// Downloads the program.
pub(crate) fn run(args: &Args) -> Result<(), Failure> {
    let chosen = args.module.as_deref().map(lookup::module).transpose()?;
    let mut connection = args.connect.open()?;
    let mut programmer = args.connect.programmer(connection.as_mut())?;
    let identity = programmer.identity();
    let module = chosen.or_else(|| lookup::by_number(identity?.number));
    let commands = program::load(&args.file, &args.source, module, Refusals::Fail)?.commands;
    let protection = programmer.protection()?;
    must_not_be_protected(&protection, args.verify)?;

    let start = Instant::now();
    let mut progress = Progress::start("downloading", Some(commands.len()));
    programmer.download(&commands, &mut |done| progress.set(done))?;
    if args.verify {
        progress = Progress::start("verifying", Some(commands.len()));
        programmer.verify(&commands, &mut |done| progress.set(done))?;
    } else if !protection.reading {
        programmer.verify_end(&commands)?;
    }
    drop(progress);
    let seconds = start.elapsed().as_secs_f64();
    let auto_start = args.autostart.map(|when| when == AutoStart::On);
    if let Some(on) = auto_start {
        programmer.set_auto_start(on)?;
    }
    if args.run {
        programmer.reset()?;
        programmer.run(None)?;
    }
    let done = Downloaded {
        module: identity.map(|identity| identity.number),
        firmware: identity.map(|identity| lookup::version(identity.firmware)),
        commands: commands.len(),
        seconds: (seconds * 1000.0).round() / 1000.0,
        verified: args.verify,
        auto_start,
        started: args.run,
    };
    report(&done, args.json)
}

fn must_not_be_protected(protection: &Protection, verify: bool) -> Result<(), Failure> {
    if protection.overwriting {
        let help = if protection.reading {
            "`tmcl exec -c URI 'SGP 81, 0, 0'` lifts the protection and erases the program"
        } else {
            "`tmcl exec -c URI 'SGP 81, 0, 0'` lifts the protection"
        };
        let message = "the program on the module is protected against overwriting (global \
                       parameter 81)";
        return Err(Failure::new(message).help(help));
    }
    if protection.reading && verify {
        let message = "the program cannot be verified: it is protected against reading (global \
                       parameter 81)";
        return Err(Failure::new(message).help(
            "leave --verify out, or lift the protection and erase the program with `tmcl exec -c \
             URI 'SGP 81, 0, 0'`",
        ));
    }
    Ok(())
}

fn report(done: &Downloaded, json: bool) -> Result<(), Failure> {
    let mut out = anstream::stdout().lock();
    if json {
        return Ok(print::json_line(&mut out, done)?);
    }
    let Downloaded { commands, seconds, verified, auto_start, started, .. } = done;
    let commands = counted(*commands, "command");
    let verified = if *verified { " and verified" } else { "" };
    write!(out, "{commands} downloaded{verified} in {seconds:.1} s")?;
    match auto_start {
        Some(true) => write!(out, "; auto start is on")?,
        Some(false) => write!(out, "; auto start is off")?,
        None => {}
    }
    writeln!(out, "{}", if *started { "; started" } else { "" })?;
    Ok(())
}
