//! `tmcl upload`: the program on a module into a file.

use std::fmt::Write as _;
use std::fs;
use std::io::Write;
use std::path::{Path, PathBuf};

use opentmcl_firmware::PROGRAM_LEN;
use opentmcl_link::program::Programmer;
use opentmcl_wire::Command;

use crate::connect::ConnectArgs;
use crate::failure::Failure;
use crate::program;
use crate::progress::Progress;

/// Read the program from a module
///
/// It is read from address 0 up to the end mark that a download leaves, or to the end of the memory,
/// and printed as source. Reading does not disturb a program that runs.
#[derive(clap::Args)]
#[command(after_help = EXAMPLES)]
pub(crate) struct Args {
    #[command(flatten)]
    connect: ConnectArgs,
    /// Write to this file: source, or binary with the extension .bin [default: standard output]
    #[arg(short, long, value_name = "FILE")]
    output: Option<PathBuf>,
}

const EXAMPLES: &str = "\
Examples:
  tmcl upload -c /dev/ttyACM0
  tmcl upload -c /dev/ttyACM0 -o stage.tmc
  tmcl upload -c tcp:127.0.0.1:4016 -o stage.bin";

/// Reads the program and writes it.
pub(crate) fn run(args: &Args) -> Result<(), Failure> {
    let mut connection = args.connect.open()?;
    let mut programmer = Programmer::open(connection.as_mut(), args.connect.address, PROGRAM_LEN)?;
    let mut progress = Progress::start("commands read:", None);
    let commands = programmer.read(&mut |done| progress.set(done))?;
    drop(progress);
    if commands.is_empty() {
        return Err(empty(&mut programmer)?);
    }
    match &args.output {
        Some(path) => write_file(path, &commands),
        None => Ok(anstream::stdout().lock().write_all(source(&commands).as_bytes())?),
    }
}

/// Why the module shows no program.
fn empty(programmer: &mut Programmer<'_>) -> Result<Failure, Failure> {
    Ok(if programmer.protection()?.reading {
        let message =
            "the program on the module is protected against reading (global parameter 81)";
        Failure::new(message).help("lifting the protection erases the program; ask who wrote it")
    } else {
        Failure::new("there is no program on the module: address 0 holds the end mark")
            .help("`tmcl download FILE -c URI` brings one onto it")
    })
}

fn write_file(path: &Path, commands: &[Command]) -> Result<(), Failure> {
    let contents =
        if program::is_binary(path) { binary(commands) } else { source(commands).into_bytes() };
    fs::write(path, contents)
        .map_err(|error| Failure::new(format!("cannot write {}: {error}", path.display())))?;
    let plural = if commands.len() == 1 { "" } else { "s" };
    writeln!(
        anstream::stdout().lock(),
        "{} command{plural} written to {}",
        commands.len(),
        path.display()
    )?;
    Ok(())
}

fn source(commands: &[Command]) -> String {
    let mut text = String::new();
    for command in commands {
        // A string takes everything.
        let _ = writeln!(text, "{command}");
    }
    text
}

/// Eight bytes for each command: the command and the sum of its bytes.
fn binary(commands: &[Command]) -> Vec<u8> {
    let record = |command: &Command| {
        let [a, b, c, d, e, f, g] = command.to_bytes();
        let sum = command.to_bytes().into_iter().fold(0, u8::wrapping_add);
        [a, b, c, d, e, f, g, sum]
    };
    commands.iter().flat_map(record).collect()
}
