//! A TMCL program from a file: source or binary.

use std::path::{Path, PathBuf};

use opentmcl_catalog::Module;
use opentmcl_lang::{Assembly, Diagnostic, Options, Severity, assemble, encoding};
use opentmcl_wire::Command;

use crate::diagnostics;
use crate::failure::Failure;
use crate::sources::{self, Disk};

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

/// A program that can be executed.
pub(crate) struct Program {
    /// The commands from address 0.
    pub(crate) commands: Vec<Command>,
    /// Where they come from; none for a binary.
    pub(crate) assembly: Option<Assembly>,
}

/// A line of a program's source.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Place<'a> {
    /// The file's name.
    pub(crate) file: &'a str,
    /// The line, from 1.
    pub(crate) line: u32,
    /// What stands there, without the blanks around it.
    pub(crate) text: &'a str,
}

/// Reads a program and prints to standard error what is wrong or doubtful in its source; fails when
/// it cannot be read or has errors. With a module, it is checked against its catalogue, too.
pub(crate) fn load(
    file: &Path,
    args: &SourceArgs,
    module: Option<&'static Module>,
) -> Result<Program, Failure> {
    let bytes = sources::read(file)?;
    if is_binary(file) {
        return Ok(Program { commands: decode(file, &bytes)?, assembly: None });
    }
    let assembly = assembly(file, &bytes, args);
    let findings = findings(&assembly, module);
    // What is merely worth knowing is told by `tmcl check`.
    let told: Vec<_> =
        findings.iter().filter(|finding| finding.severity() > Severity::Hint).collect();
    diagnostics::print(&assembly, &told);
    if told.iter().any(|finding| finding.severity() == Severity::Error) {
        let summary = diagnostics::Summary::of(told.iter().copied());
        return Err(Failure::new(format!("{}: {summary}", sources::shown(file))));
    }
    Ok(Program { commands: assembly.commands().collect(), assembly: Some(assembly) })
}

/// Whether a file's name says that it holds the assembled program.
pub(crate) fn is_binary(file: &Path) -> bool {
    file.extension().is_some_and(|extension| extension.eq_ignore_ascii_case("bin"))
}

/// Assembles a source.
pub(crate) fn assembly(file: &Path, bytes: &[u8], args: &SourceArgs) -> Assembly {
    let (text, _) = encoding::decode(bytes);
    let mut disk = Disk::new(file, &args.include);
    let options = Options { append_stop: !args.no_stop };
    assemble(&sources::shown(file), text, &mut disk, options)
}

/// What is wrong or doubtful in a program.
pub(crate) fn findings(assembly: &Assembly, _module: Option<&'static Module>) -> Vec<Diagnostic> {
    assembly.diagnostics.clone()
}

/// The commands of a binary.
pub(crate) fn decode(file: &Path, bytes: &[u8]) -> Result<Vec<Command>, Failure> {
    let mut commands = Vec::with_capacity(bytes.len() / 8);
    for (number, record) in bytes.chunks(8).enumerate() {
        let &[opcode, kind, motor, a, b, c, d, _] = record else {
            let shown = sources::shown(file);
            return Err(Failure::new(format!("{shown}: record {number} is not complete")));
        };
        commands.push(Command::new(opcode, kind, motor, i32::from_be_bytes([a, b, c, d])));
    }
    Ok(commands)
}

impl Program {
    /// The line of the command at an address.
    pub(crate) fn place(&self, address: u16) -> Option<Place<'_>> {
        let assembly = self.assembly.as_ref()?;
        let place = assembly.instructions.get(usize::from(address))?.place?;
        let file = assembly.file(place.file);
        let span = file.tree.line_span(assembly.line(place)?);
        let text = span.of(file.tree.text()).trim();
        Some(Place { file: &file.name, line: place.line + 1, text })
    }

    /// The address of a label, in any case.
    pub(crate) fn label(&self, name: &str) -> Option<u16> {
        self.assembly.as_ref()?.label(name)?.address.try_into().ok()
    }

    /// All labels with their addresses, in order of address.
    pub(crate) fn labels(&self) -> impl Iterator<Item = (&str, u16)> {
        // The assembler meets them in this order.
        let labels = self.assembly.iter().flat_map(Assembly::labels);
        labels.filter_map(|label| Some((label.name, label.address.try_into().ok()?)))
    }
}
