//! `tmcl fmt`: the one layout of sources.

use std::io::Write;
use std::path::{Path, PathBuf};

use opentmcl_lang::tree::Tree;
use opentmcl_lang::{Diagnostic, File, Severity, encoding, format};

use crate::diagnostics::{self, Format};
use crate::failure::Failure;
use crate::output;
use crate::print::counted;
use crate::program;
use crate::sources::{self, is_dash};

/// Format sources
///
/// Files are rewritten in place and keep their encoding and line ends; what the program does stays
/// the same to the byte. A file with errors in its syntax is left alone.
#[derive(clap::Args)]
#[command(after_help = EXAMPLES)]
pub(crate) struct Args {
    /// Sources, or folders with .tmc files; - formats standard input to standard output
    #[arg(required = true, value_name = "FILE")]
    files: Vec<PathBuf>,
    /// Change nothing, name the files that would change, and fail if there are any
    #[arg(long)]
    check: bool,
}

const EXAMPLES: &str = "\
Examples:
  tmcl fmt spin.tmc
  tmcl fmt --check .
  tmcl fmt - < spin.tmc";

/// Formats the files, all that can be, and fails for those that cannot.
pub(crate) fn run(args: &Args) -> Result<(), Failure> {
    let mut out = anstream::stdout().lock();
    let (mut changed, mut refused) = (0, 0);
    for file in sources::expand(&args.files, sources::PROGRAMS)? {
        let bytes = sources::read(&file)?;
        let Some(formatted) = formatted(&file, &bytes)? else {
            refused += 1;
            continue;
        };
        let differs = formatted != bytes;
        changed += usize::from(differs);
        if is_dash(&file) && !args.check {
            out.write_all(&formatted)?;
        } else if differs {
            if !args.check {
                output::write_all([(&*file, formatted)])?;
            }
            writeln!(out, "{}", sources::shown(&file))?;
        }
    }
    if refused > 0 {
        let files = counted(refused, "file");
        return Err(Failure::new(format!("{files} with errors cannot be formatted")));
    }
    if args.check && changed > 0 {
        let files = counted(changed, "file");
        let (would, it) = if changed == 1 { ("is", "it") } else { ("are", "them") };
        return Err(Failure::new(format!("{files} {would} not formatted"))
            .help(format!("`tmcl fmt` formats {it}")));
    }
    Ok(())
}

/// The formatted bytes of a file; nothing if it has errors, which have then been told.
fn formatted(name: &Path, bytes: &[u8]) -> Result<Option<Vec<u8>>, Failure> {
    if program::is_binary(name) {
        let message = format!("{} is a binary, not a source", name.display());
        return Err(Failure::usage(message).help("`tmcl disasm` makes a source of it"));
    }
    let (text, encoding) = encoding::decode(bytes);
    let tree = Tree::parse(text);
    let file = File { name: sources::shown(name), built_in: false, included_at: None, tree };
    let is_error = |one: &&Diagnostic| one.severity() == Severity::Error;
    let errors: Vec<Diagnostic> =
        file.tree.diagnostics().iter().filter(is_error).cloned().collect();
    if !errors.is_empty() {
        diagnostics::print(Format::Human, &[file], &errors)?;
        return Ok(None);
    }
    let formatted = encoding::encode(&format(&file.tree), encoding);
    // No layout needs a character that the encoding lacks; if one did, the file stays as it is.
    Ok(Some(formatted.unwrap_or_else(|| bytes.to_vec())))
}
