//! Stand-in: a program with one mnemonic per line, `label:` lines, or a binary.

use std::path::{Path, PathBuf};

use opentmcl_catalog::Module;
use opentmcl_wire::{Command, mnemonic};

use crate::failure::Failure;

/// Options of every subcommand that takes a program.
#[derive(clap::Args)]
pub(crate) struct SourceArgs {
    /// Folder to search for included files; may be given more than once
    #[arg(short = 'I', long = "include", value_name = "DIR")]
    pub(crate) include: Vec<PathBuf>,
    /// Do not append STOP when the program does not end with it
    #[arg(long)]
    pub(crate) no_stop: bool,
}

pub(crate) struct Program {
    pub(crate) commands: Vec<Command>,
    file: String,
    lines: Vec<(u32, String)>,
    labels: Vec<(String, u16)>,
}

pub(crate) struct Place<'a> {
    pub(crate) file: &'a str,
    pub(crate) line: u32,
    pub(crate) text: &'a str,
}

pub(crate) fn load(
    file: &Path,
    _args: &SourceArgs,
    _module: Option<&'static Module>,
) -> Result<Program, Failure> {
    let text = std::fs::read_to_string(file)
        .map_err(|error| Failure::new(format!("{}: {error}", file.display())))?;
    let (mut commands, mut lines, mut labels) = (Vec::new(), Vec::new(), Vec::new());
    for (number, line) in (1..).zip(text.lines()) {
        let code = line.split("//").next().unwrap_or_default().trim();
        if let Some(label) = code.strip_suffix(':') {
            labels.push((label.to_owned(), commands.len() as u16));
        }
    }
    let mut at = 0;
    labels.clear();
    for line in text.lines() {
        let code = line.split("//").next().unwrap_or_default().trim();
        if let Some(label) = code.strip_suffix(':') {
            labels.push((label.to_owned(), at));
        } else if !code.is_empty() {
            at += 1;
        }
    }
    for (number, line) in (1..).zip(text.lines()) {
        let mut code = line.split("//").next().unwrap_or_default().trim().to_owned();
        if code.is_empty() || code.ends_with(':') {
            continue;
        }
        for (label, at) in &labels {
            if let Some(rest) = code.strip_suffix(label.as_str()) {
                code = format!("{rest}{at}");
                break;
            }
        }
        let command = mnemonic::parse(&code)
            .map_err(|error| Failure::new(format!("{}:{number}: {error}", file.display())))?;
        commands.push(command);
        lines.push((number, line.trim().to_owned()));
    }
    Ok(Program { commands, file: file.display().to_string(), lines, labels })
}

impl Program {
    pub(crate) fn place(&self, address: u16) -> Option<Place<'_>> {
        let (line, text) = self.lines.get(usize::from(address))?;
        Some(Place { file: &self.file, line: *line, text })
    }

    pub(crate) fn labels(&self) -> impl Iterator<Item = (&str, u16)> {
        self.labels.iter().map(|(name, at)| (name.as_str(), *at))
    }
}
