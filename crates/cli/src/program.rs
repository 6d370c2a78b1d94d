//! Stand-in until the assembler is there.

use std::path::{Path, PathBuf};

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
    args: &SourceArgs,
    _module: Option<&'static opentmcl_catalog::Module>,
) -> Result<Program, Failure> {
    let name = file.display().to_string();
    let bytes =
        std::fs::read(file).map_err(|error| Failure::new(format!("cannot read {name}: {error}")))?;
    let mut program = Program { commands: vec![], file: name, lines: vec![], labels: vec![] };
    if file.extension().is_some_and(|extension| extension == "bin") {
        program.commands = bytes
            .chunks_exact(8)
            .map(|chunk| Command::from_bytes(chunk[..7].try_into().unwrap()))
            .collect();
        return Ok(program);
    }
    for (line, text) in (1..).zip(String::from_utf8_lossy(&bytes).lines()) {
        let mut text = text.split("//").next().unwrap_or_default().trim();
        if let Some((label, rest)) = text.split_once(':') {
            program.labels.push((label.trim().into(), program.commands.len() as u16));
            text = rest.trim();
        }
        if text.is_empty() {
            continue;
        }
        let mut resolved = text.to_owned();
        for (label, address) in &program.labels {
            resolved = resolved.replace(label.as_str(), &address.to_string());
        }
        let command =
            mnemonic::parse(&resolved).map_err(|error| Failure::new(format!("{line}: {error}")))?;
        program.commands.push(command);
        program.lines.push((line, text.to_owned()));
    }
    if !args.no_stop && program.commands.last().is_none_or(|command| command.number != 28) {
        program.commands.push(Command::new(28, 0, 0, 0));
    }
    Ok(program)
}

impl Program {
    pub(crate) fn place(&self, address: u16) -> Option<Place<'_>> {
        let (line, text) = self.lines.get(usize::from(address))?;
        Some(Place { file: &self.file, line: *line, text })
    }

    pub(crate) fn label(&self, name: &str) -> Option<u16> {
        self.labels().find(|(label, _)| label.eq_ignore_ascii_case(name)).map(|(_, address)| address)
    }

    pub(crate) fn labels(&self) -> impl Iterator<Item = (&str, u16)> {
        self.labels.iter().map(|(name, address)| (name.as_str(), *address))
    }
}
