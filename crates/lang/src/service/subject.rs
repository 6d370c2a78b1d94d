//! What the number in an operand stands for on a module.

use opentmcl_catalog::{Access, AxisParameter, GlobalParameter, Interrupt, Module, Port};
use opentmcl_wire::Opcode;
use opentmcl_wire::limits::VARIABLE_BANK;
use opentmcl_wire::opcode::{Form, Meaning};

use super::Service;
use super::parts::form;
use crate::diagnostic::FileId;
use crate::tree::{ExpressionId, ExpressionKind, Line, Statement};

/// Something of a module that has a number.
#[derive(Clone, Copy, Debug)]
pub(super) enum Subject {
    AxisParameter(&'static AxisParameter),
    GlobalParameter(&'static GlobalParameter),
    Port(&'static Port),
    Interrupt(&'static Interrupt),
}

impl Subject {
    /// Its number; the first one of a row of equal ones.
    pub(super) const fn number(self) -> u8 {
        match self {
            Self::AxisParameter(row) => row.number,
            Self::GlobalParameter(row) => row.number,
            Self::Port(row) => row.number,
            Self::Interrupt(row) => row.number,
        }
    }

    /// Its name in print.
    pub(super) const fn name(self) -> &'static str {
        match self {
            Self::AxisParameter(row) => row.name,
            Self::GlobalParameter(row) => row.name,
            Self::Port(row) => row.name,
            Self::Interrupt(row) => row.name,
        }
    }
}

/// Whether a command may touch what has these rights.
pub(super) const fn may_use(opcode: Opcode, access: Access) -> bool {
    use Opcode::{
        Aap, Aapx, Agp, Gap, Gapx, Ggp, Gio, Rsap, Rsgp, Sap, Sapx, Sgp, Sio, Stap, Stgp,
    };
    match opcode {
        Sap | Sapx | Aap | Aapx | Sgp | Agp | Sio => access.write,
        Gap | Gapx | Ggp | Gio => access.read,
        Stap | Rsap | Stgp | Rsgp => access.store,
        _ => true,
    }
}

impl Service<'_> {
    /// What an operand of a line stands for, if the module is known and has it.
    pub(super) fn subject(&self, file: FileId, line: &Line, operand: usize) -> Option<Subject> {
        let module = self.module?;
        let form = form(line)?;
        let meaning = form.operands.get(operand)?.meaning;
        let number = u8::try_from(self.operand_value(file, line, operand)?).ok()?;
        let bank = || {
            let at = form.operands.iter().position(|other| other.meaning == Meaning::Bank)?;
            u8::try_from(self.operand_value(file, line, at)?).ok()
        };
        match meaning {
            Meaning::AxisParameter => module.axis_parameter(number).map(Subject::AxisParameter),
            Meaning::GlobalParameter => {
                module.global_parameter(bank()?, number).map(Subject::GlobalParameter)
            }
            Meaning::Variable => {
                module.global_parameter(VARIABLE_BANK, number).map(Subject::GlobalParameter)
            }
            Meaning::Port => port(module, form, bank()?, number).map(Subject::Port),
            Meaning::Interrupt => module.interrupt(number).map(Subject::Interrupt),
            _ => None,
        }
    }

    /// What an operand gives a value to: of SAP, SGP and SIO the parameter or port that is set.
    pub(super) fn governed_by(&self, file: FileId, line: &Line, operand: usize) -> Option<Subject> {
        let meant = form(line)?.operands.get(operand)?;
        let is_value = meant.meaning == Meaning::Number;
        let subject = self.subject(file, line, 0).filter(|_| is_value)?;
        (!matches!(subject, Subject::Interrupt(_))).then_some(subject)
    }

    /// The value of an operand, if it is as simple as such operands are: a number, a constant or a
    /// label, perhaps with a sign.
    pub(super) fn operand_value(&self, file: FileId, line: &Line, operand: usize) -> Option<i64> {
        let operands = self.assembly.file(file).tree.operands_of(line);
        self.simple_value(file, operands.get(operand)?.expression)
    }

    fn simple_value(&self, file: FileId, mut id: ExpressionId) -> Option<i64> {
        let tree = &self.assembly.file(file).tree;
        let mut sign = 1.0;
        let value = loop {
            match tree.expression(id).kind {
                ExpressionKind::Number(value) => break value,
                ExpressionKind::Name => {
                    let name = tree.name(id)?;
                    break match self.assembly.constant(name) {
                        Some(constant) => constant.value?,
                        None => f64::from(self.assembly.label(name)?.address),
                    };
                }
                ExpressionKind::Same(inner) => id = inner,
                ExpressionKind::Negate(inner) => {
                    sign = -sign;
                    id = inner;
                }
                _ => return None,
            }
        };
        Some(libm::round(sign * value) as i64)
    }

    /// The form of the command that a line is about, also if it is written as a number.
    pub(super) fn form_of(&self, file: FileId, line: &Line) -> Option<&'static Form> {
        match line.statement {
            Statement::Numbered { number, .. } => {
                let text = self.assembly.file(file).tree.token_text(number);
                let number = crate::number::value(text)?;
                let is_number = number.fract() == 0.0 && (0.0..=255.0).contains(&number);
                opentmcl_wire::opcode::form(number as u8).filter(|_| is_number)
            }
            _ => form(line),
        }
    }
}

/// The port that a command means by this number: SIO and GIO need not mean the same.
fn port(module: &Module, form: &Form, bank: u8, number: u8) -> Option<&'static Port> {
    match form.opcode {
        Opcode::Sio => module.output_port(bank, number),
        _ => module.input_port(bank, number),
    }
}
