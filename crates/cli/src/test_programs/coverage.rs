//! Which lines of programs were executed, and which branches were taken.

use std::collections::BTreeMap;
use std::fmt;
use std::path::Path;

use opentmcl_conform::{Body, Program as LoadedProgram};
use opentmcl_firmware::Executed;
use opentmcl_lang::Assembly;
use opentmcl_lang::span::{ColumnUnit, LineIndex};
use opentmcl_wire::{Command, Opcode};

use crate::print::counted;
use crate::program_files::ProgramFiles;
use crate::virtual_target::Observer;

/// How often each command of each program was executed, over all tests.
#[derive(Default)]
pub(super) struct Counts {
    /// By the number of the program and the address.
    programs: Vec<Vec<Count>>,
    /// What stands at each address at present: a program, and the address there.
    memory: Vec<Option<(usize, usize)>>,
}

#[derive(Clone, Copy)]
struct Count {
    command: Command,
    executed: u64,
    jumped: u64,
    passed: u64,
}

impl Observer for Counts {
    fn fresh(&mut self) {
        self.memory.clear();
    }

    fn loading(&mut self, program: &LoadedProgram) {
        let begin = usize::try_from(program.address).unwrap_or(usize::MAX);
        let number = match &program.body {
            Body::Lines(_) => None,
            Body::File(file) => {
                if self.programs.len() <= file.number {
                    self.programs.resize(file.number + 1, Vec::new());
                }
                if self.programs[file.number].is_empty() {
                    let counts = file.commands.iter().map(|&command| Count {
                        command,
                        executed: 0,
                        jumped: 0,
                        passed: 0,
                    });
                    self.programs[file.number] = counts.collect();
                }
                Some(file.number)
            }
        };
        for at in 0..program.commands().count() {
            let Some(address) = begin.checked_add(at).filter(|&address| address < 1 << 16) else {
                break;
            };
            if self.memory.len() <= address {
                self.memory.resize(address + 1, None);
            }
            self.memory[address] = number.map(|number| (number, at));
        }
    }

    fn executed(&mut self, executed: &Executed) {
        let place = self.memory.get(usize::from(executed.address)).copied().flatten();
        let count = place.and_then(|(number, at)| self.programs.get_mut(number)?.get_mut(at));
        // Requests may have written another command there since.
        let Some(count) = count.filter(|count| count.command == executed.command) else { return };
        count.executed += 1;
        match executed.branch {
            Some(true) => count.jumped += 1,
            Some(false) => count.passed += 1,
            None => {}
        }
    }
}

/// How much of the programs was executed, by source file.
#[derive(Default)]
pub(super) struct Coverage {
    pub(super) files: Vec<FileCoverage>,
    /// Binaries, which have no lines.
    without_source: usize,
}

/// A source file.
#[derive(Default)]
pub(super) struct FileCoverage {
    pub(super) name: String,
    text: String,
    /// Lines with commands, by number from 1.
    pub(super) lines: BTreeMap<u32, LineCount>,
    /// Lines with the labels of subroutines and handlers, and how often those were entered.
    pub(super) routines: BTreeMap<u32, (String, u64)>,
}

/// The command of a line; several if its file is included more than once.
#[derive(Clone, Copy, Default)]
pub(super) struct LineCount {
    pub(super) executed: u64,
    pub(super) branch: Option<Branch>,
}

/// A command that goes on in one of two places.
#[derive(Clone, Copy, Default)]
pub(super) struct Branch {
    pub(super) jumped: u64,
    pub(super) passed: u64,
}

impl Branch {
    pub(super) fn taken(self) -> usize {
        usize::from(self.jumped > 0) + usize::from(self.passed > 0)
    }
}

impl Coverage {
    /// Puts together what was counted.
    pub(super) fn new(counts: &Counts, programs: &ProgramFiles<'_>) -> Self {
        let mut coverage = Self::default();
        for (number, program) in programs.programs() {
            let counts = counts.programs.get(number).map_or(&[][..], Vec::as_slice);
            match &program.assembly {
                Some(assembly) => coverage.add(assembly, counts),
                None => coverage.without_source += 1,
            }
        }
        coverage.files.sort_by(|left, right| left.name.cmp(&right.name));
        coverage
    }

    fn add(&mut self, assembly: &Assembly, counts: &[Count]) {
        let files: Vec<usize> = assembly
            .files
            .iter()
            .map(|file| self.file(relative(&file.name), file.tree.text()))
            .collect();
        for (address, instruction) in assembly.instructions.iter().enumerate() {
            let Some(place) = instruction.place else { continue };
            let count = counts.get(address);
            let file = &mut self.files[files[usize::from(place.file.0)]];
            let line = file.lines.entry(place.line + 1).or_default();
            line.executed += count.map_or(0, |count| count.executed);
            if may_branch(instruction.command) {
                let branch = line.branch.get_or_insert_default();
                branch.jumped += count.map_or(0, |count| count.jumped);
                branch.passed += count.map_or(0, |count| count.passed);
            }
        }
        for label in assembly.labels().filter(|label| is_routine(assembly, label.address)) {
            let source = assembly.file(label.location.file).tree.text();
            let begin = label.location.span.start;
            let line = LineIndex::new(source).position(source, begin, ColumnUnit::Utf8).line + 1;
            let file = &mut self.files[files[usize::from(label.location.file.0)]];
            let (_, entered) = file.routines.entry(line).or_insert((label.name.to_owned(), 0));
            *entered += counts.get(label.address as usize).map_or(0, |count| count.executed);
        }
        self.files.retain(|file| !file.lines.is_empty());
    }

    fn file(&mut self, name: String, text: &str) -> usize {
        if let Some(at) = self.files.iter().position(|file| file.name == name) {
            return at;
        }
        self.files.push(FileCoverage { name, text: text.to_owned(), ..FileCoverage::default() });
        self.files.len() - 1
    }
}

/// Whether a command asks something before it goes somewhere else.
fn may_branch(command: Command) -> bool {
    let opcode = Opcode::from_number(command.number);
    matches!(opcode, Some(Opcode::Jc | Opcode::Call | Opcode::Djnz))
}

/// Whether a subroutine or an interrupt handler begins at an address.
fn is_routine(assembly: &Assembly, address: u32) -> bool {
    assembly.commands().any(|command| {
        let opcode = Opcode::from_number(command.number);
        matches!(opcode, Some(Opcode::Csub | Opcode::Call | Opcode::Vect))
            && i64::from(command.value) == i64::from(address)
    })
}

/// A file's name from the working folder, by which it is the same however a program includes it.
fn relative(name: &str) -> String {
    let Ok(path) = Path::new(name).canonicalize() else { return name.to_owned() };
    let folder = std::env::current_dir().and_then(|folder| folder.canonicalize());
    let within = folder.ok().and_then(|folder| path.strip_prefix(folder).ok());
    within.unwrap_or(&path).display().to_string()
}

/// So many of so many.
#[derive(Clone, Copy, Default)]
pub(super) struct Share {
    pub(super) hit: usize,
    pub(super) found: usize,
}

impl std::ops::AddAssign for Share {
    fn add_assign(&mut self, other: Self) {
        self.hit += other.hit;
        self.found += other.found;
    }
}

impl fmt::Display for Share {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { hit, found } = self;
        // Rounded down: 100 % is all.
        match (hit * 100).checked_div(*found) {
            Some(percent) => write!(f, "{hit} of {found}, {percent} %"),
            None => f.write_str("none"),
        }
    }
}

impl FileCoverage {
    pub(super) fn line_share(&self) -> Share {
        let hit = self.lines.values().filter(|line| line.executed > 0).count();
        Share { hit, found: self.lines.len() }
    }

    pub(super) fn branch_share(&self) -> Share {
        let branches = self.lines.values().filter_map(|line| line.branch);
        let mut share = Share::default();
        for branch in branches {
            share += Share { hit: branch.taken(), found: 2 };
        }
        share
    }
}

impl fmt::Display for FileCoverage {
    /// The source, each line with how often it was executed, and how often it jumped.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        writeln!(f, "{}\n{:>9}{:>14}", self.name, "executed", "jumped")?;
        let index = LineIndex::new(&self.text);
        let last = self.lines.keys().last().copied().unwrap_or(0);
        for number in 1..=last {
            let count = self.lines.get(&number);
            let executed = count.map_or(String::new(), |count| match count.executed {
                0 => "never".to_owned(),
                times => times.to_string(),
            });
            let jumped = count.and_then(|count| count.branch).map_or(String::new(), |branch| {
                format!("{} of {}", branch.jumped, branch.jumped + branch.passed)
            });
            let text = index.line(&self.text, number - 1).of(&self.text);
            let line = format!("{executed:>9}{jumped:>14}{number:>6}  {text}");
            writeln!(f, "{}", line.trim_end())?;
        }
        Ok(())
    }
}

impl fmt::Display for Coverage {
    /// Each file, then a table of all.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let names = self.files.iter().map(|file| file.name.chars().count());
        let width = names.max().unwrap_or(0).max("total".len()) + 2;
        let (mut lines, mut branches) = (Share::default(), Share::default());
        let mut table = String::new();
        let row = |name: &str, lines: &str, branches: &str| {
            format!("{name:<width$}{lines:<20}{branches}").trim_end().to_owned() + "\n"
        };
        for file in &self.files {
            let (file_lines, file_branches) = (file.line_share(), file.branch_share());
            table += &row(&file.name, &file_lines.to_string(), &file_branches.to_string());
            lines += file_lines;
            branches += file_branches;
            writeln!(f, "{file}")?;
        }
        f.write_str(&row("", "lines", "branches"))?;
        f.write_str(&table)?;
        f.write_str(&row("total", &lines.to_string(), &branches.to_string()))?;
        if self.without_source > 0 {
            let programs = counted(self.without_source, "program");
            writeln!(f, "not counted: {programs} without source")?;
        }
        Ok(())
    }
}
