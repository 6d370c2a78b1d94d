//! Axis parameters and global parameters.

use opentmcl_catalog::{Axis, AxisBehaviour, AxisParameter, GlobalParameter, Tmc5160, Unit, is_in};
use opentmcl_wire::Opcode;
use opentmcl_wire::opcode::Field;

use crate::check::subject::Subject;
use crate::diagnostic::{Code, Diagnostic};

use super::{Rules, ranges};

impl Rules {
    pub(super) fn axis_parameter(self, opcode: Opcode, subject: Subject<'_>) -> Option<Diagnostic> {
        let Self { module, .. } = self;
        let location = subject.operand(Field::Kind);
        let shown = subject.shown(Field::Kind);
        let found = module.axis_parameter(subject.command.kind);
        let Some(row) = found.filter(|row| module.has(row.since)) else {
            let message = format!("the {} has no axis parameter {shown}", module.title);
            let rows = module.axis_parameters.iter().filter(|row| module.has(row.since));
            let help = match found.and_then(|row| row.since) {
                Some(since) => newer(since, module.firmware),
                None => format!("it has {}", ranges(rows.map(|row| row.number))),
            };
            return Some(Diagnostic::new(Code::NoSuchAxisParameter, location, message).help(help));
        };
        let parameter = format!("axis parameter {shown}, {}", row.name);
        // In the other forms the axis is in X.
        let names_axis =
            matches!(opcode, Opcode::Sap | Opcode::Gap | Opcode::Aap | Opcode::Stap | Opcode::Rsap);
        let axis = Some(subject.command.motor).filter(|&axis| names_axis && axis < module.axes);
        if axis.is_some_and(|axis| !row.is_on(axis)) {
            let message = format!("axis {} has no {parameter}", subject.shown(Field::Motor));
            let help = format!("axes {} have it", self.axes(row.axes));
            return Some(Diagnostic::new(Code::NoSuchAxisParameter, location, message).help(help));
        }
        if matches!(opcode, Opcode::Gap | Opcode::Gapx) {
            return None;
        }
        if matches!(opcode, Opcode::Stap | Opcode::Rsap) {
            if row.access.store {
                return None;
            }
            let message = format!("{parameter}, cannot be stored");
            let storable = module.axis_parameters.iter().filter(|row| row.access.store);
            let help = format!("{} can be stored", ranges(storable.map(|row| row.number)));
            return Some(Diagnostic::new(Code::NotStorable, location, message).help(help));
        }
        if !row.access.write {
            let message = format!("{parameter}, can only be read");
            return Some(
                Diagnostic::new(Code::NotWritable, location, message).help("GAP reads it"),
            );
        }
        if matches!(opcode, Opcode::Aap | Opcode::Aapx) {
            return None;
        }
        let value = i64::from(subject.command.value);
        self.range(row, value, &parameter, subject)
            .or_else(|| self.choice(row, axis, &parameter, subject))
    }

    /// Tells of a value that the parameter does not take in the units that the program may use.
    pub(super) fn range(
        self,
        row: &AxisParameter,
        value: i64,
        what: &str,
        subject: Subject<'_>,
    ) -> Option<Diagnostic> {
        let (min, max) = (i64::from(row.min), i64::from(row.max));
        let may_be_internal = self.internal_units && matches!(row.unit, Unit::Pps | Unit::Pps2);
        let internal_max = i64::from(row.internal_max);
        let internal_min = if min < 0 { -internal_max } else { min };
        let fits = (min..=max).contains(&value)
            || may_be_internal && (internal_min..=internal_max).contains(&value);
        if fits {
            return None;
        }
        let mut help = format!("it takes {min}..{max}{}", in_unit(row.unit));
        if may_be_internal {
            help += &format!(", and {internal_min}..{internal_max} with unit mode 0");
        }
        Some(out_of_range(what, subject).help(help))
    }

    /// Values within the range that are refused all the same.
    fn choice(
        self,
        row: &AxisParameter,
        axis: Option<u8>,
        what: &str,
        subject: Subject<'_>,
    ) -> Option<Diagnostic> {
        const FROM_ENCODER: i32 = 2;
        let value = subject.command.value;
        match row.behaviour {
            AxisBehaviour::Axis(Axis::ReferenceSearchMode) => {
                if row.values.iter().any(|&(listed, _)| listed == value) {
                    return None;
                }
                let listed = row.values.iter().filter_map(|&(listed, _)| u8::try_from(listed).ok());
                let help = format!("it takes {}", ranges(listed));
                Some(out_of_range(what, subject).help(help))
            }
            AxisBehaviour::Axis(Axis::RelativePositioningOption) if value == FROM_ENCODER => {
                let encoder = AxisBehaviour::Tmc5160(Tmc5160::EncoderPosition);
                let mut rows = self.module.axis_parameters.iter();
                let with_encoder =
                    rows.find(|row| row.behaviour == encoder).map_or(0, |row| row.axes);
                if axis.is_none_or(|axis| is_in(with_encoder, axis)) {
                    return None;
                }
                let help = match with_encoder {
                    0 => "2 counts from an encoder, and no axis has one".into(),
                    axes => {
                        format!("2 counts from the encoder, which axes {} have", self.axes(axes))
                    }
                };
                Some(out_of_range(what, subject).help(help))
            }
            _ => None,
        }
    }

    /// The axes of a mask.
    fn axes(self, mask: u8) -> String {
        ranges((0..self.module.axes).filter(|&axis| is_in(mask, axis)))
    }

    pub(super) fn global_parameter(
        self,
        opcode: Opcode,
        subject: Subject<'_>,
    ) -> Option<Diagnostic> {
        let Self { module, .. } = self;
        let (number, bank) = (subject.command.kind, subject.command.motor);
        let rows = module.global_parameters.iter().filter(|row| module.has(row.since));
        let in_bank = rows.filter(|row| row.bank == bank);
        if in_bank.clone().next().is_none() {
            let shown = subject.shown(Field::Motor);
            let message = format!("the {} has no bank {shown} of global parameters", module.title);
            let banks = ranges(module.global_parameters.iter().map(|row| row.bank));
            let location = subject.operand(Field::Motor);
            return Some(
                Diagnostic::new(Code::NoSuchBank, location, message)
                    .help(format!("its banks are {banks}")),
            );
        }
        let location = subject.operand(Field::Kind);
        let shown = subject.shown(Field::Kind);
        let numbers = |row: &'static GlobalParameter| row.number..=row.last;
        let found = module.global_parameter(bank, number);
        let Some(row) = found.filter(|row| module.has(row.since)) else {
            let message = format!("bank {bank} of the {} has no parameter {shown}", module.title);
            let help = match found.and_then(|row| row.since) {
                Some(since) => newer(since, module.firmware),
                None => format!("it has {}", ranges(in_bank.flat_map(numbers))),
            };
            return Some(
                Diagnostic::new(Code::NoSuchGlobalParameter, location, message).help(help),
            );
        };
        let parameter = format!("global parameter {shown}, {}", row.name);
        match opcode {
            Opcode::Sgp | Opcode::Agp if !row.access.write => {
                let message = format!("{parameter}, can only be read");
                Some(Diagnostic::new(Code::NotWritable, location, message).help("GGP reads it"))
            }
            Opcode::Sgp => global_value(row, &parameter, subject),
            Opcode::Stgp | Opcode::Rsgp => {
                let is_stored = |row: &&GlobalParameter| row.access.store || row.access.automatic;
                if is_stored(&row) {
                    return None;
                }
                let message = format!("{parameter}, cannot be stored");
                let stored = ranges(in_bank.filter(is_stored).flat_map(numbers));
                let help = match stored.as_str() {
                    "" => format!("nothing in bank {bank} can be stored"),
                    stored => format!("in bank {bank}, {stored} can be stored"),
                };
                Some(Diagnostic::new(Code::NotStorable, location, message).help(help))
            }
            _ => None,
        }
    }
}

/// What to say of a row that the module's firmware is too old for.
fn newer(since: (u8, u8), firmware: (u8, u8)) -> String {
    let [since, firmware] = [since, firmware].map(|(major, minor)| format!("V{major}.{minor:02}"));
    format!("firmware {since} has it, this is {firmware}")
}

/// Whether the value that SGP gives to a parameter is in its range.
fn global_value(
    row: &GlobalParameter,
    parameter: &str,
    subject: Subject<'_>,
) -> Option<Diagnostic> {
    let GlobalParameter { min, max, unit, .. } = *row;
    // A range beyond 31 bit is that of an unsigned number.
    let is_unsigned = max > i64::from(i32::MAX);
    let value = subject.command.value;
    let comparable = if is_unsigned { i64::from(value as u32) } else { i64::from(value) };
    if (min..=max).contains(&comparable) {
        return None;
    }
    let help = format!("it takes {min}..{max}{}", in_unit(unit));
    Some(out_of_range(parameter, subject).help(help))
}

/// A value that is refused; the help is still to be said.
pub(super) fn out_of_range(what: &str, subject: Subject<'_>) -> Diagnostic {
    let shown = subject.shown(Field::Value);
    let message = format!("{shown} is out of range for {what}");
    Diagnostic::new(Code::ValueOutOfRange, subject.operand(Field::Value), message)
}

/// A unit behind a number.
pub(super) fn in_unit(unit: Unit) -> String {
    match unit {
        Unit::None => String::new(),
        Unit::Microsteps => " microsteps".into(),
        Unit::Pps => " pps".into(),
        Unit::Pps2 => " pps²".into(),
        // A number before the unit would read as part of the range.
        Unit::Other(unit) if unit.starts_with(|first: char| first.is_ascii_digit()) => {
            format!(" times {unit}")
        }
        Unit::Other(unit) => format!(" {unit}"),
    }
}
