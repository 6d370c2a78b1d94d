//! `tmcl disasm`: a program's binary to a source that can be read and assembled again.

use std::path::{Path, PathBuf};

use crate::failure::Failure;
use crate::lookup;
use crate::output;
use crate::program;
use crate::sources;
use crate::standin::disassemble::{Disassembly, disassemble};

/// Disassemble a binary into a source
///
/// The source assembles to the same bytes. Targets of jumps get labels; with a module, its parameters
/// are named in comments.
#[derive(clap::Args)]
#[command(after_help = EXAMPLES)]
pub(crate) struct Args {
    /// Binary of the program; - is standard input
    #[arg(value_name = "FILE.bin")]
    file: PathBuf,
    /// Where to write the source [default: standard output]
    #[arg(short, long, value_name = "FILE", default_value = sources::STDIN_OR_STDOUT, hide_default_value = true)]
    output: PathBuf,
    /// Name the parameters as this module has them
    #[arg(long, value_name = "NAME")]
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
    if output::is_same(&args.output, &args.file) && !sources::is_stdin(&args.file) {
        let message = format!("{} is the binary itself", args.output.display());
        return Err(Failure::usage(message).help("write to a file of another name"));
    }
    let name = args.file.file_name().map(Path::new).filter(|_| !sources::is_stdin(&args.file));
    let title = name.map(|name| name.display().to_string());
    let source = disassemble(&commands, &Disassembly { module, title: title.as_deref() });
    output::write_all([(&*args.output, source.into_bytes())])
}
