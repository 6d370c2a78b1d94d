//! `tmcl asm`: a program's source to the binary that modules take.

use std::io::{self, Write};
use std::path::{Path, PathBuf};

use opentmcl_lang::{Assembly, binary, listing};
use serde::Serialize;

use crate::diagnostics::{Format, counted};
use crate::failure::Failure;
use crate::output::{self, Output};
use crate::program::{self, SourceArgs};
use crate::sources::{self, is_stdin};
use crate::lookup;

/// Assemble a program into the file that a module takes
///
/// The file has eight bytes per command and no header, as the vendor's tools write and read it. When
/// the source has errors, nothing is written.
#[derive(clap::Args)]
#[command(after_help = EXAMPLES)]
pub(crate) struct Args {
    /// Source of the program; - is standard input
    file: PathBuf,
    /// Where to write the binary; - is standard output [default: FILE with the extension .bin]
    #[arg(short, long, value_name = "FILE")]
    output: Option<PathBuf>,
    /// Write the labels with their addresses; - is standard output
    #[arg(long, value_name = "FILE")]
    symbols: Option<PathBuf>,
    /// Write addresses and commands beside the lines of the source
    #[arg(long, value_name = "FILE", num_args = 0..=1, require_equals = true, default_missing_value = "-")]
    listing: Option<PathBuf>,
    /// Check against what this module has [default: the one that the source names]
    #[arg(long, value_name = "NAME")]
    module: Option<String>,
    #[command(flatten)]
    source: SourceArgs,
    /// Print one JSON object per finding, then one about the binary
    #[arg(long)]
    json: bool,
}

const EXAMPLES: &str = "\
Examples:
  tmcl asm spin.tmc
  tmcl asm spin.tmc -o build/spin.bin --module tmcm-6214 --symbols build/spin.sym
  tmcl asm spin.tmc --listing";

/// What `--json` says of the binary.
#[derive(Serialize)]
struct Assembled<'a> {
    output: &'a Path,
    commands: usize,
}

/// Assembles the program.
pub(crate) fn run(args: &Args) -> Result<(), Failure> {
    let module = args.module.as_deref().map(lookup::module).transpose()?;
    let binary = binary_file(args)?;
    let files = [Some(&binary), args.symbols.as_ref(), args.listing.as_ref()];
    let files: Vec<&Path> = files.into_iter().flatten().map(PathBuf::as_path).collect();
    let to_stdout = files.iter().filter(|file| is_stdin(file)).count();
    if to_stdout + usize::from(args.json) > 1 {
        return Err(Failure::usage("only one thing can go to standard output")
            .help("name files: -o FILE, --symbols FILE, --listing=FILE"));
    }
    let bytes = sources::read(&args.file)?;
    let format = if args.json { Format::Json } else { Format::Human };
    let assembly = program::assemble_valid(&args.file, &bytes, &args.source, module, format)?;
    refuse_to_overwrite(&files, &assembly)?;

    let count = assembly.instructions.len();
    write_all(&files, |at| match at {
        0 => binary::encode(assembly.commands()),
        _ if files[at] == binary => 
    })
}
