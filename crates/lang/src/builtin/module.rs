//! The include file of a module, made from its catalogue.

use std::fmt::Write as _;

use opentmcl_catalog::{AxisParameter, GlobalParameter, Interrupt, Module, Port, Unit};

/// `tmcm-6214.inc`
pub(crate) fn file_name(model: &Module) -> String {
    format!("{}.inc", model.name)
}

/// Names for all numbers that a program for the module may need. Axis parameters have the vendor's
/// prefix AP, global ones GP, inputs and outputs IO, interrupts TI.
pub(super) fn text(model: &Module) -> String {
    let (major, minor) = model.firmware;
    let mut file = File {
        text: format!("// Names for the {}, firmware V{major}.{minor:02}.\n", model.title),
        names: Vec::new(),
    };
    file.heading("Axis parameters");
    for row in model.axis_parameters {
        file.line(&axis_parameter(row), row.number, row.name, row.unit);
    }
    let mut bank = None;
    for row in model.global_parameters.iter().filter(|row| row.number == row.last) {
        if bank.replace(row.bank) != Some(row.bank) {
            file.heading(&format!("Global parameters in bank {}", row.bank));
        }
        file.line(&global_parameter(row), row.number, row.name, row.unit);
    }
    let mut bank = None;
    for row in model.ports {
        if bank.replace(row.bank) != Some(row.bank) {
            file.heading(&format!("Inputs and outputs in bank {}", row.bank));
        }
        file.line(&port(row), row.number, row.name, row.unit);
    }
    file.heading("Interrupts");
    for row in model.interrupts {
        file.line(&interrupt(row), row.number, row.name, Unit::None);
    }
    file.text
}

struct File {
    text: String,
    /// All definitions so far: an input may be in two banks under the same number.
    names: Vec<(String, u8)>,
}

impl File {
    fn heading(&mut self, heading: &str) {
        let _ = write!(self.text, "\n// {heading}\n");
    }

    fn line(&mut self, name: &str, number: u8, title: &str, unit: Unit) {
        if self.names.iter().any(|known| *known == (name.to_owned(), number)) {
            return;
        }
        let unit = match unit {
            Unit::None => String::new(),
            Unit::Microsteps => " [microsteps]".into(),
            Unit::Pps => " [pps]".into(),
            Unit::Pps2 => " [pps²]".into(),
            Unit::Other(unit) => format!(" [{unit}]"),
        };
        let _ = writeln!(self.text, "{:<36} // {title}{unit}", format!("{name} = {number}"));
        self.names.push((name.to_owned(), number));
    }
}

/// `APMaxPositioningSpeed`
pub(crate) fn axis_parameter(row: &AxisParameter) -> String {
    format!("AP{}", joined(row.id))
}

/// `GPAutoStart`
pub(crate) fn global_parameter(row: &GlobalParameter) -> String {
    format!("GP{}", joined(row.id))
}

/// `IOSupplyVoltage`
pub(crate) fn port(row: &Port) -> String {
    format!("IO{}", joined(row.id))
}

/// `max_positioning_speed` as the vendor writes names: `MaxPositioningSpeed`.
fn joined(id: &str) -> String {
    let mut name = String::new();
    for word in id.split('_') {
        let mut letters = word.chars();
        name.extend(letters.next().map(|letter| letter.to_ascii_uppercase()));
        name.push_str(letters.as_str());
    }
    name
}

/// `timer_0` as the manual writes names of interrupts: `TI_TIMER0`.
pub(crate) fn interrupt(row: &Interrupt) -> String {
    let upper = row.id.to_ascii_uppercase();
    match upper.rsplit_once('_') {
        Some((name, number)) if number.bytes().all(|byte| byte.is_ascii_digit()) => {
            format!("TI_{name}{number}")
        }
        _ => format!("TI_{upper}"),
    }
}
