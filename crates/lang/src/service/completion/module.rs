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

/// How names of some kind begin in include files that follow the vendor's.
struct Prefix {
    own: &'static str,
    /// How names begin that are something else although they begin as these do.
    other: Option<&'static str>,
}

const AXIS_PARAMETERS: Prefix = Prefix { own: "AP", other: Some("APV") };
const INTERRUPTS: Prefix = Prefix { own: "TI_", other: None };

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
                let names = self.names_of(&AXIS_PARAMETERS);
                let axis = other(Meaning::Axis);
                for row in module.axis_parameters {
                    let has = axis.is_none_or(|axis| axis < 8 && row.axes >> axis & 1 == 1);
                    if has && may_use(form.opcode, row.access) {
                        let name = names.get(&i64::from(row.number)).copied();
                        let number = row.number.to_string();
                        let subject = Subject::AxisParameter(row);
                        add(list, module, subject, row.id, &number, name);
                    }
                }
            }
            Meaning::GlobalParameter => {
                let bank = other(Meaning::Bank);
                for row in module.global_parameters {
                    let is_in_bank = bank.is_none_or(|bank| bank == row.bank);
                    if is_in_bank && may_use(form.opcode, row.access) {
                        let insert = with_bank(row.number, row.bank, bank);
                        let subject = Subject::GlobalParameter(row);
                        add(list, module, subject, row.id, &insert, None);
                    }
                }
            }
            Meaning::Port => {
                let bank = other(Meaning::Bank);
                for row in module.ports {
                    let is_in_bank = bank.is_none_or(|bank| bank == row.bank);
                    if is_in_bank && may_use(form.opcode, row.access) {
                        let insert = with_bank(row.number, row.bank, bank);
                        add(list, module, Subject::Port(row), row.id, &insert, None);
                    }
                }
            }
            Meaning::Bank => banks(list, module, form),
            Meaning::Interrupt => {
                let names = self.names_of(&INTERRUPTS);
                for row in module.interrupts {
                    let name = names.get(&i64::from(row.number)).copied();
                    let number = row.number.to_string();
                    add(list, module, Subject::Interrupt(row), row.id, &number, name);
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

    /// The constants of included files whose names begin so, by their value.
    fn names_of(&self, prefix: &Prefix) -> BTreeMap<i64, &str> {
        let begins = |name: &str, with: &str| {
            name.get(..with.len()).is_some_and(|start| start.eq_ignore_ascii_case(with))
        };
        let mut names = BTreeMap::new();
        for constant in self.assembly.constants() {
            let is_meant = constant.location.file != FileId(0)
                && begins(constant.name, prefix.own)
                && !prefix.other.is_some_and(|other| begins(constant.name, other));
            if let Some(value) = constant.value.filter(|value| is_meant && value.fract() == 0.0) {
                names.entry(value as i64).or_insert(constant.name);
            }
        }
        names
    }
}

/// Adds a row of the catalogue: called by its name in programs, inserted as its number, or as the
/// constant that stands for the number.
fn add(
    list: &mut List,
    module: &Module,
    subject: Subject,
    id: &str,
    insert: &str,
    constant: Option<&str>,
) {
    let detail = match subject.range() {
        Some(range) => format!("{}: {range}", subject.place()),
        None => subject.place(),
    };
    list.add(CompletionKind::Parameter, id, detail);
    list.document(subject.markdown(module));
    list.insert(constant.unwrap_or(insert).to_owned());
    if let Some(item) = list.last() {
        let constant = constant.map(|name| format!(" {name}")).unwrap_or_default();
        item.filter = Some(format!("{id}{constant} {insert}"));
    }
}

/// A number, and the bank behind it if that is still to be written.
fn with_bank(number: u8, bank: u8, written: Option<u8>) -> String {
    match written {
        Some(_) => number.to_string(),
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
