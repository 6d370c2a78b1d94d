//! `tmcl asm`: a program's source to the binary that modules take.

use std::io::Write;
use std::path::{Path, PathBuf};

use opentmcl_lang::{binary, listing, symbols};
use serde::Serialize;

use crate::diagnostics::Format;
use crate::failure::Failure;
use crate::lookup;
use crate::output;
use crate::print::{self, counted};
use crate::program::{self, Refusals, SourceArgs};
use crate::sources::{self, is_dash};

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
    /// Write addresses and commands beside the lines of the source [default: to standard output]
    #[arg(
        long,
        value_name = "FILE",
        num_args = 0..=1,
        require_equals = true,
        default_missing_value = sources::DASH
    )]
    listing: Option<PathBuf>,
    /// Check against what this module has [default: the one that the source names]
    #[arg(short, long, value_name = "NAME")]
    module: Option<String>,
    #[command(flatten)]
    source: SourceArgs,
    /// Print one JSON object per finding, and one about the binary
    #[arg(long)]
    json: bool,
}

const EXAMPLES: &str = "\
Examples:
  tmcl asm spin.tmc
  tmcl asm spin.tmc -o build/spin.bin --symbols build/spin.sym --module tmcm-6214
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
    let files: Vec<&Path> = [Some(&*binary), args.symbols.as_deref(), args.listing.as_deref()]
        .into_iter()
        .flatten()
        .collect();
    let to_stdout = files.iter().filter(|file| is_dash(file)).count() + usize::from(args.json);
    if to_stdout > 1 {
        return Err(Failure::usage("only one thing can go to standard output")
            .help("name a file for each of the others: -o FILE, --symbols FILE, --listing=FILE"));
    }

    let bytes = sources::read(&args.file)?;
    let format = if args.json { Format::Json } else { Format::Human };
    let refusals = Refusals::Fail;
    let assembly =
        program::assemble_valid(&args.file, &bytes, &args.source, module, refusals, format)?;
    output::keep_apart(&files, program::files(&assembly))?;

    let mut texts = vec![(&*binary, binary::encode(assembly.commands()))];
    if let Some(file) = &args.symbols {
        texts.push((file, symbols(&assembly).into_bytes()));
    }
    if let Some(file) = &args.listing {
        texts.push((file, listing(&assembly).into_bytes()));
    }
    output::write_all(texts)?;

    let commands = assembly.instructions.len();
    let mut out = anstream::stdout().lock();
    if args.json {
        print::json_line(&mut out, &Assembled { output: &binary, commands })?;
    } else if to_stdout == 0 {
        writeln!(out, "{}: {}", binary.display(), counted(commands, "command"))?;
    }
    Ok(())
}

/// Where the binary goes.
fn binary_file(args: &Args) -> Result<PathBuf, Failure> {
    if program::is_binary(&args.file) {
        let message = format!("{} is a binary already", args.file.display());
        return Err(Failure::usage(message).help("`tmcl disasm` makes a source of it"));
    }
    match &args.output {
        Some(file) => Ok(file.clone()),
        None if is_dash(&args.file) => {
            Err(Failure::usage("a program from standard input has no name for its binary")
                .help("name it: -o FILE, or -o - for standard output"))
        }
        None => Ok(args.file.with_extension("bin")),
    }
}
