//! Numbers that a module gives a meaning, proposed by their names.

use std::collections::BTreeMap;

use opentmcl_catalog::Module;
use opentmcl_wire::Opcode;
use opentmcl_wire::opcode::{Form, Meaning};

use super::{CompletionKind, List};
use crate::diagnostic::FileId;
use crate::service::Service;
use crate::service::subject::{Subject, may_use};
use crate::tree::Line;

/// A command as far as it is written.
pub(super) struct Written<'a> {
    pub(super) file: FileId,
    pub(super) line: &'a Line,
    pub(super) form: &'static Form,
    /// Whether the first operand is not there yet, and the second one is where it will be.
    pub(super) is_left_out: bool,
}

/// How names of some kind begin in the built-in include files, and in others that follow the vendor's.
struct Prefix {
    own: &'static str,
    /// How names begin that are something else although they begin as these do.
    other: Option<&'static str>,
    /// Whether a number means the same whatever else is written, so that any name for it will do.
    is_unique: bool,
}

const AXIS_PARAMETERS: Prefix = Prefix { own: "AP", other: Some("APV"), is_unique: true };
const GLOBAL_PARAMETERS: Prefix = Prefix { own: "GP", other: None, is_unique: false };
const PORTS: Prefix = Prefix { own: "IO", other: None, is_unique: false };
const INTERRUPTS: Prefix = Prefix { own: "TI_", other: None, is_unique: true };

impl Service<'_> {
    /// Adds the numbers that an operand may have on the module.
    pub(super) fn numbers(&self, list: &mut List, written: &Written<'_>, at: usize) {
        let &Written { file, line, form, is_left_out } = written;
        let (Some(module), Some(operand)) = (self.module, form.operands.get(at)) else { return };
        // The value of another operand of the line, if it is written already.
        let other = |meaning: Meaning| {
            let at = form.operands.iter().position(|other| other.meaning == meaning)?;
            let at = at.checked_sub(usize::from(is_left_out))?;
            u8::try_from(self.operand_value(file, line, at)?).ok()
        };
        match operand.meaning {
            Meaning::AxisParameter => {
                self.axis_parameters(list, module, form.opcode, other(Meaning::Axis));
            }
            Meaning::GlobalParameter => {
                let names = self.names_of(&GLOBAL_PARAMETERS);
                let bank = other(Meaning::Bank);
                for row in module.global_parameters {
                    let is_in_bank = bank.is_none_or(|bank| bank == row.bank);
                    if is_in_bank && may_use(form.opcode, row.access) {
                        let constant = names.find(row.number, row.id);
                        let insert = with_bank(constant, row.number, row.bank, bank);
                        add(list, module, Subject::GlobalParameter(row), row.id, &insert);
                    }
                }
            }
            Meaning::Port => {
                let names = self.names_of(&PORTS);
                let bank = other(Meaning::Bank);
                for row in module.ports {
                    let is_in_bank = bank.is_none_or(|bank| bank == row.bank);
                    if is_in_bank && may_use(form.opcode, row.access) {
                        let constant = names.find(row.number, row.id);
                        let insert = with_bank(constant, row.number, row.bank, bank);
                        add(list, module, Subject::Port(row), row.id, &insert);
                    }
                }
            }
            Meaning::Bank => banks(list, module, form),
            Meaning::Interrupt => {
                let names = self.names_of(&INTERRUPTS);
                for row in module.interrupts {
                    let constant = names.find(row.number, row.id);
                    let insert = constant.map_or(row.number.to_string(), str::to_owned);
                    add(list, module, Subject::Interrupt(row), row.id, &insert);
                }
            }
            _ => {
                let values = self.governed_by(file, line, at).map_or(&[][..], Subject::values);
                for (value, meaning) in values {
                    list.add(CompletionKind::Value, &value.to_string(), *meaning);
                }
            }
        }
    }

    /// Adds those that a command may use on this axis.
    fn axis_parameters(
        &self,
        list: &mut List,
        module: &'static Module,
        opcode: Opcode,
        axis: Option<u8>,
    ) {
        let names = self.names_of(&AXIS_PARAMETERS);
        for row in module.axis_parameters {
            let has = axis.is_none_or(|axis| row.is_on(axis));
            if has && may_use(opcode, row.access) {
                let constant = names.find(row.number, row.id);
                let insert = constant.map_or(row.number.to_string(), str::to_owned);
                add(list, module, Subject::AxisParameter(row), row.id, &insert);
            }
        }
    }

    /// The constants of included files whose names begin so.
    fn names_of(&self, prefix: &Prefix) -> Constants<'_> {
        let begins = |name: &str, with: &str| {
            name.get(..with.len()).is_some_and(|start| start.eq_ignore_ascii_case(with))
        };
        let mut by_value: BTreeMap<i64, Vec<&str>> = BTreeMap::new();
        for constant in self.assembly.constants() {
            let is_meant = constant.location.file != FileId(0)
                && begins(constant.name, prefix.own)
                && !prefix.other.is_some_and(|other| begins(constant.name, other));
            if let Some(value) = constant.value.filter(|value| is_meant && value.fract() == 0.0) {
                by_value.entry(value as i64).or_default().push(constant.name);
            }
        }
        Constants { by_value, prefix_len: prefix.own.len(), any_will_do: prefix.is_unique }
    }
}

/// Constants that may stand for numbers of one kind.
struct Constants<'a> {
    by_value: BTreeMap<i64, Vec<&'a str>>,
    prefix_len: usize,
    any_will_do: bool,
}

impl<'a> Constants<'a> {
    /// The constant for what has this number and name: if possible one of the same name.
    fn find(&self, number: u8, id: &str) -> Option<&'a str> {
        let names = self.by_value.get(&i64::from(number))?;
        let letters = |name: &str| name.replace('_', "").to_ascii_lowercase();
        let wanted = letters(id);
        let same = |name: &&&str| name.get(self.prefix_len..).map(letters) == Some(wanted.clone());
        let any = names.first().filter(|_| self.any_will_do);
        names.iter().find(same).or(any).copied()
    }
}

/// Adds a row of the catalogue: called by its name in programs, inserted as its number or as the
/// constant that stands for it.
fn add(list: &mut List, module: &Module, subject: Subject, id: &str, insert: &str) {
    let detail = match subject.range() {
        Some(range) => format!("{}: {range}", subject.place()),
        None => subject.place(),
    };
    list.add(CompletionKind::Parameter, id, detail);
    list.document(subject.markdown(module));
    list.insert(insert.to_owned());
    if let Some(item) = list.last() {
        item.filter = Some(format!("{id} {insert} {}", subject.number()));
    }
}

/// A number or the constant for it, and the bank behind it if that is still to be written.
fn with_bank(constant: Option<&str>, number: u8, bank: u8, written: Option<u8>) -> String {
    let number = constant.map_or(number.to_string(), str::to_owned);
    match written {
        Some(_) => number,
        None => format!("{number}, {bank}"),
    }
}

/// The banks of global parameters or of ports, each with what is first in it.
fn banks(list: &mut List, module: &Module, form: &Form) {
    let of_ports = matches!(form.opcode, Opcode::Sio | Opcode::Gio);
    let parameters = module.global_parameters.iter();
    let parameters = parameters.map(|row| (row.bank, row.name, row.access));
    let ports = module.ports.iter().map(|row| (row.bank, row.name, row.access));
    let mut banks: BTreeMap<u8, Vec<&str>> = BTreeMap::new();
    for (bank, name, access) in parameters.filter(|_| !of_ports).chain(ports.filter(|_| of_ports)) {
        if may_use(form.opcode, access) {
            banks.entry(bank).or_default().push(name);
        }
    }
    for (bank, names) in banks {
        let first: Vec<_> = names.iter().take(3).copied().collect();
        let more = if names.len() > first.len() { ", …" } else { "" };
        list.add(CompletionKind::Value, &bank.to_string(), format!("{}{more}", first.join(", ")));
    }
}
