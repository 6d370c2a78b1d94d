//! `tmcl upload`: the program on a module into a file.

use std::io::Write;
use std::path::PathBuf;

use opentmcl_catalog::Module;
use opentmcl_lang::{Disassembly, binary, disassemble};
use opentmcl_link::program::Programmer;

use crate::connect::ConnectArgs;
use crate::failure::Failure;
use crate::lookup;
use crate::output;
use crate::print::counted;
use crate::program;
use crate::progress::Progress;
use crate::sources;

/// Read the program from a module
///
/// It is read from address 0 up to the end mark that a download leaves, or to the end of the memory,
/// and written as source. Reading does not disturb a program that runs.
#[derive(clap::Args)]
#[command(after_help = EXAMPLES)]
pub(crate) struct Args {
    #[command(flatten)]
    connect: ConnectArgs,
    /// Write to this file: source, or binary with the extension .bin [default: standard output]
    #[arg(short, long, value_name = "FILE", default_value = sources::DASH, hide_default_value = true)]
    output: PathBuf,
    /// Write names of parameters, inputs and interrupts in place of their numbers
    #[arg(long)]
    names: bool,
}

const EXAMPLES: &str = "\
Examples:
  tmcl upload -c /dev/ttyACM0
  tmcl upload -c /dev/ttyACM0 -o stage.tmc --names
  tmcl upload -c tcp:127.0.0.1:4016 -o stage.bin";

/// Reads the program and writes it.
pub(crate) fn run(args: &Args) -> Result<(), Failure> {
    let mut connection = args.connect.open()?;
    let mut programmer = args.connect.programmer(connection.as_mut())?;
    let mut progress = Progress::start("commands read:", None);
    let commands = programmer.read(&mut |done| progress.set(done))?;
    drop(progress);
    if commands.is_empty() {
        return Err(empty(&mut programmer)?);
    }
    let contents = if program::is_binary(&args.output) {
        binary::encode(commands.iter().copied())
    } else {
        let module = match args.names {
            true => Some(named_module(&mut programmer)?),
            false => None,
        };
        disassemble(&commands, &Disassembly { module, title: None }).into_bytes()
    };
    output::write_all([(&*args.output, contents)])?;
    if !sources::is_dash(&args.output) {
        let count = counted(commands.len(), "command");
        writeln!(anstream::stdout().lock(), "{}: {count}", args.output.display())?;
    }
    Ok(())
}

/// The module whose names are wanted.
fn named_module(programmer: &mut Programmer<'_>) -> Result<&'static Module, Failure> {
    let number = programmer.identity().map(|identity| identity.number);
    number.and_then(lookup::by_number).ok_or_else(|| {
        Failure::new("the module's names are not known: it is not in the catalogue")
            .help("leave out --names; `tmcl modules` lists the modules that are known")
    })
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
