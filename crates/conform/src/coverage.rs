//! Which rows of the catalogue the transcripts touch.
//!
//! A row is covered when a transcript touches it and would notice if it did nothing:
//!
//! - a parameter or port, when a request that names it expects a value, a range or a refusal;
//! - a command or an interrupt, when such an expectation is its own or follows in the file;
//! - anything that a loaded program names, when such an expectation follows in the file.

use std::collections::BTreeSet;
use std::fmt;

use opentmcl_catalog::{AxisBehaviour, GlobalBehaviour, Module};
use opentmcl_wire::{Command, Opcode, control};

use crate::transcript::{StepKind, Transcript};

/// A row of one of the catalogue's tables.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
enum Row {
    Command(u8),
    AxisParameter(u8),
    /// Bank, and number of the first of a row of equal ones.
    GlobalParameter(u8, u8),
    Interrupt(u8),
    /// Bank and number; inputs and settings may share a number.
    Port {
        bank: u8,
        number: u8,
        write: bool,
    },
}

/// What all transcripts of one module cover together.
#[derive(Clone, Debug)]
pub struct Coverage {
    module: &'static Module,
    covered: BTreeSet<Row>,
}

/// One table of the catalogue, counted.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Table {
    /// What the rows are.
    pub name: &'static str,
    /// How many rows it has.
    pub rows: usize,
    /// Rows whose value is kept without effect, each with the reason.
    pub stored: Vec<(String, &'static str)>,
    /// How many rows with an effect are covered.
    pub covered: usize,
    /// Rows with an effect that no transcript covers.
    pub uncovered: Vec<String>,
}

impl Table {
    /// How many rows have an effect.
    pub fn with_behaviour(&self) -> usize {
        self.rows - self.stored.len()
    }
}

impl Coverage {
    /// Nothing is covered yet.
    pub fn new(module: &'static Module) -> Self {
        Self { module, covered: BTreeSet::new() }
    }

    /// The module whose rows are counted.
    pub fn module(&self) -> &'static Module {
        self.module
    }

    /// Adds what a transcript covers.
    pub fn add(&mut self, transcript: &Transcript) {
        // From the end, so that what follows a step is known when the step is looked at.
        let mut telling_follows = false;
        for step in transcript.steps().rev() {
            match &step.kind {
                StepKind::Exchange(exchange) => {
                    let telling = exchange.expected.is_telling();
                    telling_follows |= telling;
                    if let Some(command) = exchange.command() {
                        self.touch(command, telling, telling_follows);
                    }
                }
                StepKind::Expect(conditions) | StepKind::WaitUntil { conditions, .. } => {
                    telling_follows = true;
                    for condition in conditions {
                        self.touch(condition.command, true, true);
                    }
                }
                StepKind::ExtraReply(_) => telling_follows = true,
                StepKind::Program(program) => {
                    for command in program.commands() {
                        self.touch(command, telling_follows, telling_follows);
                    }
                    for number in [control::START_DOWNLOAD, control::END_DOWNLOAD] {
                        self.touch(Command::new(number, 0, 0, 0), false, telling_follows);
                    }
                }
                _ => {}
            }
        }
    }

    /// `value` says whether the touched value is looked at, `effect` whether anything is.
    fn touch(&mut self, command: Command, value: bool, effect: bool) {
        if effect {
            self.covered.insert(Row::Command(command.number));
        }
        let number = command.kind;
        let row = match Opcode::from_number(command.number) {
            Some(
                Opcode::Sap
                | Opcode::Gap
                | Opcode::Aap
                | Opcode::Sapx
                | Opcode::Gapx
                | Opcode::Aapx,
            ) => Some(Row::AxisParameter(number)),
            Some(Opcode::Sgp | Opcode::Ggp | Opcode::Agp | Opcode::Stgp | Opcode::Rsgp) => self
                .module
                .global_parameter(command.motor, number)
                .map(|row| Row::GlobalParameter(row.bank, row.number)),
            Some(Opcode::Sio) => Some(Row::Port { bank: command.motor, number, write: true }),
            Some(Opcode::Gio) => Some(Row::Port { bank: command.motor, number, write: false }),
            Some(Opcode::Ei | Opcode::Vect) => {
                if effect {
                    self.covered.insert(Row::Interrupt(number));
                }
                None
            }
            _ => None,
        };
        if value {
            self.covered.extend(row);
        }
    }

    /// The tables of the module, counted.
    pub fn tables(&self) -> Vec<Table> {
        let module = self.module;
        vec![
            self.table(
                "commands",
                module.commands.iter().map(|row| {
                    let name = format!("{} {}", row.number, row.mnemonic);
                    (name, vec![Row::Command(row.number)], None)
                }),
            ),
            self.table(
                "axis parameters",
                module.axis_parameters.iter().map(|row| {
                    let reason = match row.behaviour {
                        AxisBehaviour::Stored(reason) => Some(reason),
                        _ => None,
                    };
                    let name = format!("{} {}", row.number, row.name);
                    (name, vec![Row::AxisParameter(row.number)], reason)
                }),
            ),
            self.table(
                "global parameters",
                module.global_parameters.iter().map(|row| {
                    let reason = match row.behaviour {
                        GlobalBehaviour::Stored(reason) => Some(reason),
                        _ => None,
                    };
                    let name = format!("bank {}, {} {}", row.bank, row.number, row.name);
                    (name, vec![Row::GlobalParameter(row.bank, row.number)], reason)
                }),
            ),
            self.table(
                "interrupts",
                module.interrupts.iter().map(|row| {
                    let name = format!("{} {}", row.number, row.name);
                    (name, vec![Row::Interrupt(row.number)], None)
                }),
            ),
            self.table(
                "ports",
                module.ports.iter().map(|row| {
                    let name = format!("bank {}, {} {}", row.bank, row.number, row.name);
                    let directions = [(row.access.read, false), (row.access.write, true)];
                    let rows = directions
                        .into_iter()
                        .filter(|(has, _)| *has)
                        .map(|(_, write)| Row::Port { bank: row.bank, number: row.number, write });
                    (name, rows.collect(), None)
                }),
            ),
        ]
    }

    /// Counts rows: the name of each, all that must be covered of it, and why nothing must.
    fn table(
        &self,
        name: &'static str,
        rows: impl Iterator<Item = (String, Vec<Row>, Option<&'static str>)>,
    ) -> Table {
        let mut table =
            Table { name, rows: 0, stored: Vec::new(), covered: 0, uncovered: Vec::new() };
        for (name, parts, reason) in rows {
            table.rows += 1;
            if let Some(reason) = reason {
                table.stored.push((name, reason));
            } else if parts.iter().all(|part| self.covered.contains(part)) {
                table.covered += 1;
            } else {
                table.uncovered.push(name);
            }
        }
        table
    }

    /// Whether each row with an effect is covered.
    pub fn is_complete(&self) -> bool {
        self.tables().iter().all(|table| table.uncovered.is_empty())
    }
}

impl fmt::Display for Coverage {
    /// A table for people: counts, then the rows that are only stored, then those not covered.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let tables = self.tables();
        writeln!(
            f,
            "{:<18}{:>6}{:>16}{:>10}{:>13}",
            self.module.title, "rows", "with behaviour", "covered", "only stored"
        )?;
        for table in &tables {
            let (name, rows, behaviour) = (table.name, table.rows, table.with_behaviour());
            let (covered, stored) = (table.covered, table.stored.len());
            writeln!(f, "{name:<18}{rows:>6}{behaviour:>16}{covered:>10}{stored:>13}")?;
        }
        let sum = |count: fn(&Table) -> usize| tables.iter().map(count).sum::<usize>();
        writeln!(
            f,
            "{:<18}{:>6}{:>16}{:>10}{:>13}",
            "all",
            sum(|table| table.rows),
            sum(Table::with_behaviour),
            sum(|table| table.covered),
            sum(|table| table.stored.len())
        )?;
        for table in &tables {
            for (row, reason) in &table.stored {
                writeln!(f, "only stored: {}, {row}: {reason}", table.name)?;
            }
        }
        for table in &tables {
            for row in &table.uncovered {
                writeln!(f, "not covered: {}, {row}", table.name)?;
            }
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::parse::parse;
    use crate::programs::NoPrograms;

    fn covered(text: &str) -> BTreeSet<Row> {
        let text = format!("module tmcm-6214\n{text}");
        let transcript = parse("test.txt", &text, &mut NoPrograms).unwrap();
        let mut coverage = Coverage::new(transcript.module);
        coverage.add(&transcript);
        coverage.covered
    }

    #[test]
    fn a_parameter_is_covered_by_a_request_that_looks_at_its_value() {
        let rows = covered("> SAP 5, 0, 1\n< 100\n> GAP 4, 0\n< 100 51200");
        assert!(rows.contains(&Row::AxisParameter(4)));
        assert!(!rows.contains(&Row::AxisParameter(5)));
        assert!(rows.contains(&Row::Command(5)));
        assert!(covered("> SAP 5, 0, -1\n< 4").contains(&Row::AxisParameter(5)));
    }

    #[test]
    fn a_condition_looks_at_what_it_asks_for_and_at_what_happened_before() {
        let rows = covered("> ROR 0, 500\n< 100\nwait until speed 0 = 500");
        assert!(rows.contains(&Row::AxisParameter(3)));
        assert!(rows.contains(&Row::Command(1)));
        let rows = covered("expect output 2 low\n> MST 0\n< 100");
        assert!(rows.contains(&Row::Port { bank: 2, number: 2, write: false }));
        assert!(!rows.contains(&Row::Command(3)));
    }

    #[test]
    fn a_command_without_a_telling_expectation_after_it_is_not_covered() {
        let rows = covered("> GAP 4, 0\n< 100 51200\n> MST 0\n< 100");
        assert!(!rows.contains(&Row::Command(3)));
        assert!(rows.contains(&Row::Command(6)));
    }

    #[test]
    fn what_a_program_names_is_covered_when_something_is_looked_at_afterwards() {
        let program = "program\nSGP 100, 2, 1\nEI 3\nVECT 3, 0\nGIO 0, 0\nSIO 0, 2, 1\nend\n";
        assert!(covered(program).is_empty());
        let rows = covered(&format!("{program}> GGP 1, 2\n< 100 1"));
        assert!(rows.contains(&Row::Interrupt(3)));
        assert!(rows.contains(&Row::Command(132)));
        assert!(rows.contains(&Row::GlobalParameter(2, 56)));
        assert!(rows.contains(&Row::Port { bank: 0, number: 0, write: false }));
        assert!(rows.contains(&Row::Port { bank: 2, number: 0, write: true }));
        assert!(!rows.contains(&Row::Port { bank: 2, number: 0, write: false }));
    }

    #[test]
    fn the_counts_add_up_and_nothing_is_covered_without_a_transcript() {
        let module = opentmcl_catalog::find("tmcm-6214").unwrap();
        let coverage = Coverage::new(module);
        assert!(!coverage.is_complete());
        for table in coverage.tables() {
            assert_eq!(table.covered, 0, "{}", table.name);
            assert_eq!(table.uncovered.len(), table.with_behaviour(), "{}", table.name);
        }
        assert!(coverage.to_string().contains("not covered: commands, 1 ROR"));
    }
}
