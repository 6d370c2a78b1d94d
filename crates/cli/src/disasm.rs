//! `tmcl disasm`: a program's binary to a source that can be read and assembled again.

use std::path::PathBuf;

use opentmcl_lang::{Disassembly, disassemble};

use crate::failure::Failure;
use crate::lookup;
use crate::output;
use crate::program;
use crate::sources;

/// Disassemble a binary into a source
///
/// `tmcl asm --no-stop` makes the same bytes of the source. Where jumps lead to there are labels; with
/// a module, its names stand in place of numbers.
#[derive(clap::Args)]
#[command(after_help = EXAMPLES)]
pub(crate) struct Args {
    /// Binary of the program; - is standard input
    #[arg(value_name = "FILE.bin")]
    file: PathBuf,
    /// Where to write the source [default: standard output]
    #[arg(short, long, value_name = "FILE", default_value = sources::DASH, hide_default_value = true)]
    output: PathBuf,
    /// Write the names that this module has for parameters, inputs and interrupts
    #[arg(short, long, value_name = "NAME")]
    module: Option<String>,
}

const EXAMPLES: &str = "\
Examples:
  tmcl disasm spin.bin
  tmcl disasm spin.bin -o spin.tmc --module tmcm-6214";

/// Disassembles the program.
pub(crate) fn run(args: &Args) -> Result<(), Failure> {
    let module = args.module.as_deref().map(lookup::module).transpose()?;
    let commands = program::decode(&args.file, &sources::read(&args.file)?)?;
    output::keep_apart(&[&args.output], [&*args.file])?;
    let title = format!(" {}", sources::shown(&args.file));
    let source = disassemble(&commands, &Disassembly { module, title: Some(&title) });
    output::write_all([(&*args.output, source.into_bytes())])
}
