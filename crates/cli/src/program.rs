//! A TMCL program from a file: source or binary.

use std::path::{Path, PathBuf};

use opentmcl_catalog::Module;
use opentmcl_lang::{Assembly, Diagnostic, Options, Severity, assemble, binary, check, encoding};
use opentmcl_wire::Command;

use crate::diagnostics::{self, Format, Summary};
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

/// What becomes of a program that can be assembled, but has commands that its module will refuse.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Refusals {
    /// It fails: a module is not to be given what it refuses.
    Fail,
    /// They are told, and the program is run to show what comes of it.
    Tell,
}

/// Reads a program and prints to standard error what is wrong or doubtful in its source; fails when
/// it cannot be read or has errors. It is checked against what this module has, or else the one that
/// it names itself.
pub(crate) fn load(
    file: &Path,
    args: &SourceArgs,
    module: Option<&'static Module>,
    refusals: Refusals,
) -> Result<Program, Failure> {
    let bytes = sources::read(file)?;
    if is_binary(file) {
        return Ok(Program { commands: decode(file, &bytes)?, assembly: None });
    }
    let assembly = assemble_valid(file, &bytes, args, module, refusals, Format::Human)?;
    Ok(Program { commands: assembly.commands().collect(), assembly: Some(assembly) })
}

/// Assembles a source and prints what is wrong or doubtful: for people to standard error, for
/// programs to standard output. Fails when there are errors.
pub(crate) fn assemble_valid(
    file: &Path,
    bytes: &[u8],
    args: &SourceArgs,
    module: Option<&'static Module>,
    refusals: Refusals,
    format: Format,
) -> Result<Assembly, Failure> {
    let assembly = assembly(file, bytes, args);
    let mut findings = findings(&assembly, module);
    // What is merely worth knowing is told by `tmcl check`.
    findings.retain(|finding| finding.severity() > Severity::Hint);
    diagnostics::print(format, &assembly.files, &findings)?;
    let mut errors = findings.iter().filter(|finding| finding.severity() == Severity::Error);
    let Some(first) = errors.next() else { return Ok(assembly) };
    if refusals == Refusals::Tell && assembly.is_valid() {
        return Ok(assembly);
    }
    let failure = Failure::new(format!("{}: {}", sources::shown(file), Summary::of(&findings)));
    if [first].into_iter().chain(errors).all(|error| error.code.can_be_silenced()) {
        let code = first.code.name();
        return Err(failure.help(format!("`// tmcl-allow: {code}` in the line lets it pass")));
    }
    Err(failure)
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

/// What is wrong or doubtful in a program, for this module or else the one that a comment names.
pub(crate) fn findings(assembly: &Assembly, module: Option<&'static Module>) -> Vec<Diagnostic> {
    check::findings(assembly, module.or_else(|| declared(assembly)))
}

/// The module that a comment names; a name that no module has is among the findings.
fn declared(assembly: &Assembly) -> Option<&'static Module> {
    opentmcl_catalog::find(check::declared_module(assembly)?.0)
}

/// The files of a program's source, without those that come with the tools.
pub(crate) fn files(assembly: &Assembly) -> impl Iterator<Item = &Path> {
    let own = assembly.files.iter().filter(|file| !file.built_in);
    own.map(|file| Path::new(&file.name))
}

/// The commands of a binary.
pub(crate) fn decode(file: &Path, bytes: &[u8]) -> Result<Vec<Command>, Failure> {
    binary::decode(bytes).map_err(|bad| {
        let first = bad.first().map(ToString::to_string).unwrap_or_default();
        let more = if bad.len() > 1 { "; other records are wrong as well" } else { "" };
        Failure::new(format!("{}: {first}{more}", sources::shown(file))).help(
            "a binary has eight bytes per command, the last of which is the sum of the others",
        )
    })
}

impl Program {
    /// The module that a comment names.
    pub(crate) fn module(&self) -> Option<&'static Module> {
        declared(self.assembly.as_ref()?)
    }

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

#[cfg(test)]
#[expect(clippy::unwrap_used, reason = "the panic of a test is its report")]
mod tests {
    use super::*;

    /// Loads `main.tmc`, which includes `part.inc`.
    fn program(main: &str, part: &str) -> (tempfile::TempDir, Result<Program, Failure>) {
        let folder = tempfile::tempdir().unwrap();
        std::fs::write(folder.path().join("part.inc"), part).unwrap();
        let file = folder.path().join("main.tmc");
        std::fs::write(&file, main).unwrap();
        let args = SourceArgs { include: Vec::new(), no_stop: false };
        (folder, load(&file, &args, None, Refusals::Fail))
    }

    #[test]
    fn a_command_has_the_place_where_it_is_written() {
        let (folder, program) =
            program("Begin: ROR 0, 1\n#include part.inc\n", "\n  MST 0 // end\nLast:\n");
        let program = program.unwrap();
        let path = |name: &str| folder.path().join(name).display().to_string();
        let place = |address| program.place(address);
        let (main, part) = (path("main.tmc"), path("part.inc"));
        assert_eq!(place(0), Some(Place { file: &main, line: 1, text: "Begin: ROR 0, 1" }));
        assert_eq!(place(1), Some(Place { file: &part, line: 2, text: "MST 0 // end" }));
        assert_eq!(program.commands.len(), 3);
        assert_eq!(place(2), None, "the assembler has added STOP");
        assert_eq!(place(3), None);
    }

    #[test]
    fn labels_are_found_in_any_case_and_come_by_address() {
        let (_folder, program) = program("#include part.inc\nZ: ROR 0, 1\nA:\n", "M: MST 0\n");
        let program = program.unwrap();
        assert_eq!(program.labels().collect::<Vec<_>>(), [("M", 0), ("Z", 1), ("A", 2)]);
        assert_eq!(program.label("z"), Some(1));
        assert_eq!(program.label("y"), None);
    }

    #[test]
    fn a_binary_has_commands_and_nothing_else() {
        let folder = tempfile::tempdir().unwrap();
        let file = folder.path().join("spin.BIN");
        // ROR 0, 1: the last byte is the sum.
        std::fs::write(&file, [1, 0, 0, 0, 0, 0, 1, 2]).unwrap();
        let args = SourceArgs { include: Vec::new(), no_stop: false };
        let program = load(&file, &args, None, Refusals::Fail).unwrap();
        assert_eq!(program.commands, [Command::new(1, 0, 0, 1)]);
        assert_eq!((program.place(0), program.label("x")), (None, None));
        assert_eq!(program.labels().count(), 0);
    }
}
