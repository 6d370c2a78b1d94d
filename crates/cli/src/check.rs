//! `tmcl check`: what is wrong or doubtful in programs.

use std::collections::HashSet;
use std::io::{self, Write};
use std::path::{Path, PathBuf};

use clap::ValueEnum;
use clap::builder::{PossibleValuesParser, TypedValueParser};
use opentmcl_lang::{Assembly, Code, Diagnostic, File};

use crate::diagnostics::{self, Files, Finding, Format, Summary};
use crate::failure::Failure;
use crate::print::counted;
use crate::program::{self, SourceArgs};
use crate::{lookup, sources, terminal};

/// Check programs for mistakes
///
/// Each file is a program with what it includes; a file that another one includes is checked as a part
/// of it. The exit status is 1 when there is an error.
#[derive(clap::Args)]
#[command(after_help = EXAMPLES)]
pub(crate) struct Args {
    /// Sources, or folders with .tmc files; - is standard input
    #[arg(required_unless_present = "explain", value_name = "FILE")]
    files: Vec<PathBuf>,
    /// Check against what this module has [default: the one that the source names]
    #[arg(short, long, value_name = "NAME")]
    module: Option<String>,
    #[command(flatten)]
    source: SourceArgs,
    /// How to print what is found
    #[arg(long, value_enum, default_value_t = Format::Human)]
    format: Format,
    /// The same as --format json
    #[arg(long, conflicts_with = "format")]
    json: bool,
    /// Fail when there are warnings, too
    #[arg(long, value_enum)]
    deny: Option<Denied>,
    /// Explain a code, the word in brackets behind `error` or `warning`
    #[arg(long, value_name = "CODE", value_parser = code_parser(), hide_possible_values = true, exclusive = true)]
    explain: Option<Code>,
}

/// What fails as an error does.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
enum Denied {
    Warnings,
}

const EXAMPLES: &str = "\
Examples:
  tmcl check spin.tmc
  tmcl check programs --module tmcm-6214 --deny warnings
  tmcl check spin.tmc --json
  tmcl check --explain unknown-label";

fn code_parser() -> impl TypedValueParser<Value = Code> {
    let names = Code::ALL.iter().map(|code| code.name());
    PossibleValuesParser::new(names)
        .try_map(|name| Code::find(&name).ok_or("there is no such code"))
}

/// Checks the programs.
pub(crate) fn run(args: &Args) -> Result<(), Failure> {
    if let Some(code) = args.explain {
        let severity = code.severity().name();
        writeln!(anstream::stdout(), "{} ({severity})\n{}", code.name(), code.explanation())?;
        return Ok(());
    }
    let module = args.module.as_deref().map(lookup::module).transpose()?;
    let files = sources::expand(&args.files, sources::PROGRAMS)?;
    let mut programs = Vec::new();
    for file in &files {
        if program::is_binary(file) {
            let message = format!("{} is a binary, not a source", file.display());
            return Err(Failure::usage(message).help("`tmcl disasm` makes a source of it"));
        }
        let bytes = sources::read(file)?;
        programs.push(program::assembly(file, &bytes, &args.source));
    }
    let programs = without_parts(programs);
    let diagnostics: Vec<Vec<Diagnostic>> =
        programs.iter().map(|assembly| program::findings(assembly, module)).collect();
    let sources: Vec<Files<'_>> =
        programs.iter().map(|assembly| Files::new(&assembly.files)).collect();
    let findings = sources.iter().zip(&diagnostics);
    let findings = findings.flat_map(|(files, diagnostics)| files.findings(diagnostics));
    let findings = each_once(findings);

    let format = if args.json { Format::Json } else { args.format };
    let summary = Summary::of(findings.iter().map(|finding| finding.diagnostic));
    let mut out = anstream::stdout().lock();
    diagnostics::write(&mut out, format, &findings, terminal::width(io::stdout()))?;
    if format == Format::Human {
        writeln!(out, "{summary} in {}", counted(files.len(), "file"))?;
    }
    let denied = args.deny == Some(Denied::Warnings) && summary.warnings > 0;
    if summary.errors > 0 || denied { Err(Failure::told()) } else { Ok(()) }
}

/// Without the files that another one of them includes: what such a file means, and whether it is
/// right, depends on what is defined around it.
fn without_parts(programs: Vec<Assembly>) -> Vec<Assembly> {
    let real = |file: &File| Path::new(&file.name).canonicalize().ok();
    let mut left: Vec<Named> = programs
        .into_iter()
        .map(|assembly| {
            let mut files = assembly.files.iter().map(real);
            let (main, parts) = (files.next().flatten(), files.flatten().collect());
            Named { main, parts, assembly }
        })
        .collect();
    // Of files that include each other, the first one is left.
    for at in (0..left.len()).rev() {
        let Some(main) = &left[at].main else { continue };
        let mut others = left.iter().enumerate().filter(|&(other, _)| other != at);
        if others.any(|(_, other)| other.parts.contains(main)) {
            left.remove(at);
        }
    }
    left.into_iter().map(|named| named.assembly).collect()
}

/// A program and its files as the system knows them.
struct Named {
    main: Option<PathBuf>,
    parts: HashSet<PathBuf>,
    assembly: Assembly,
}

/// Without repetitions: several programs may include the same file.
fn each_once<'a>(findings: impl Iterator<Item = Finding<'a>>) -> Vec<Finding<'a>> {
    let mut seen = HashSet::new();
    findings
        .filter(|finding| {
            let Diagnostic { code, ref message, .. } = *finding.diagnostic;
            seen.insert((finding.region(), code, message.as_str()))
        })
        .collect()
}
