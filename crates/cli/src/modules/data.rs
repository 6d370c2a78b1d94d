//! The catalogue as data for `--json`; the field names are what other programs rely on.

use opentmcl_catalog as catalog;
use serde::Serialize;

use crate::lookup::version;

/// What identifies a module.
#[derive(Serialize)]
pub(super) struct Identity {
    pub(super) name: &'static str,
    pub(super) title: &'static str,
    pub(super) description: &'static str,
    pub(super) number: u16,
    pub(super) firmware: String,
    pub(super) version: String,
    pub(super) axes: u8,
}

/// All that is known of a module.
#[derive(Serialize)]
pub(super) struct Module {
    #[serde(flatten)]
    pub(super) identity: Identity,
    pub(super) ratings: Vec<Rating>,
    pub(super) commands: Vec<Command>,
    pub(super) axis_parameters: Vec<AxisParameter>,
    pub(super) global_parameters: Vec<GlobalParameter>,
    pub(super) ports: Vec<Port>,
    pub(super) interrupts: Vec<Interrupt>,
}

#[derive(Serialize)]
pub(super) struct Rating {
    pub(super) name: &'static str,
    pub(super) value: &'static str,
}

#[derive(Serialize)]
pub(super) struct Command {
    pub(super) number: u8,
    pub(super) mnemonic: &'static str,
    /// Who may use it: `host`, `program` or both.
    pub(super) used_by: &'static [&'static str],
    pub(super) description: &'static str,
    #[serde(flatten)]
    pub(super) origin: Origin,
}

#[derive(Serialize)]
pub(super) struct AxisParameter {
    pub(super) number: u8,
    pub(super) id: &'static str,
    pub(super) name: &'static str,
    pub(super) unit: Option<&'static str>,
    pub(super) min: i32,
    pub(super) max: i32,
    pub(super) internal_max: i32,
    pub(super) default: i32,
    pub(super) default_source: &'static str,
    pub(super) access: String,
    pub(super) axes: Vec<u8>,
    pub(super) description: &'static str,
    pub(super) values: Vec<Value>,
    #[serde(flatten)]
    pub(super) origin: Origin,
}

#[derive(Serialize)]
pub(super) struct GlobalParameter {
    pub(super) bank: u8,
    pub(super) number: u8,
    pub(super) last: u8,
    pub(super) id: &'static str,
    pub(super) name: &'static str,
    pub(super) unit: Option<&'static str>,
    pub(super) min: i64,
    pub(super) max: i64,
    pub(super) default: i32,
    pub(super) default_source: &'static str,
    pub(super) access: String,
    pub(super) description: &'static str,
    pub(super) values: Vec<Value>,
    #[serde(flatten)]
    pub(super) origin: Origin,
}

#[derive(Serialize)]
pub(super) struct Port {
    pub(super) bank: u8,
    pub(super) number: u8,
    pub(super) id: &'static str,
    pub(super) name: &'static str,
    pub(super) unit: Option<&'static str>,
    pub(super) min: i32,
    pub(super) max: i32,
    pub(super) default: i32,
    pub(super) access: String,
    pub(super) description: &'static str,
    #[serde(flatten)]
    pub(super) origin: Origin,
}

#[derive(Serialize)]
pub(super) struct Interrupt {
    pub(super) number: u8,
    pub(super) id: &'static str,
    pub(super) name: &'static str,
    pub(super) description: &'static str,
    #[serde(flatten)]
    pub(super) origin: Origin,
}

/// How sure a row is, and since when it exists.
#[derive(Serialize)]
pub(super) struct Origin {
    /// First firmware that has it, if not all do.
    pub(super) since: Option<String>,
    /// `exact`, `sister`, `observed`, `inferred` or `recalled`.
    pub(super) certainty: &'static str,
    /// Where it comes from, if not from the manual of the module.
    pub(super) source: Option<&'static str>,
}

impl Origin {
    fn new(
        since: Option<(u8, u8)>,
        certainty: catalog::Certainty,
        source: Option<&'static str>,
    ) -> Self {
        let certainty = match certainty {
            catalog::Certainty::Exact => "exact",
            catalog::Certainty::Sister => "sister",
            catalog::Certainty::Observed => "observed",
            catalog::Certainty::Inferred => "inferred",
            catalog::Certainty::Recalled => "recalled",
        };
        Self { since: since.map(version), certainty, source }
    }

    /// For people: where the row comes from, if the module's own manual does not say it.
    pub(super) fn told(&self) -> Option<String> {
        self.source.map(|source| format!("({}: {source})", self.certainty))
    }

    /// For people: since when it exists, if not from the beginning.
    pub(super) fn since(&self) -> Option<String> {
        self.since.as_ref().map(|version| format!("(since V{version})"))
    }
}

#[derive(Serialize)]
pub(super) struct Value {
    pub(super) value: i32,
    pub(super) meaning: &'static str,
}

/// All modules, without what they have.
pub(super) fn list() -> Vec<Identity> {
    catalog::MODULES.iter().map(|module| Identity::from(*module)).collect()
}

fn unit(unit: catalog::Unit) -> Option<&'static str> {
    match unit {
        catalog::Unit::None => None,
        catalog::Unit::Microsteps => Some("microsteps"),
        catalog::Unit::Pps => Some("pps"),
        catalog::Unit::Pps2 => Some("pps²"),
        catalog::Unit::Other(text) => Some(text),
    }
}

fn source(source: catalog::Source) -> &'static str {
    match source {
        catalog::Source::Manual => "manual",
        catalog::Source::OpenFirmware => "open-firmware",
        catalog::Source::Chosen => "chosen",
    }
}

fn access(access: catalog::Access) -> String {
    let catalog::Access { read, write, store, automatic } = access;
    [(read, 'R'), (write, 'W'), (store, 'E'), (automatic, 'A')]
        .into_iter()
        .filter_map(|(allowed, letter)| allowed.then_some(letter))
        .collect()
}

fn values(values: &[(i32, &'static str)]) -> Vec<Value> {
    values.iter().map(|&(value, meaning)| Value { value, meaning }).collect()
}

impl From<&catalog::Module> for Identity {
    fn from(module: &catalog::Module) -> Self {
        Self {
            name: module.name,
            title: module.title,
            description: module.description,
            number: module.number,
            firmware: version(module.firmware),
            version: String::from_utf8_lossy(&module.version).into_owned(),
            axes: module.axes,
        }
    }
}

impl From<&catalog::Module> for Module {
    fn from(module: &catalog::Module) -> Self {
        Self {
            identity: Identity::from(module),
            ratings: module
                .ratings
                .iter()
                .map(|row| Rating { name: row.name, value: row.value })
                .collect(),
            commands: module.commands.iter().map(Command::from).collect(),
            axis_parameters: module.axis_parameters.iter().map(AxisParameter::from).collect(),
            global_parameters: module.global_parameters.iter().map(GlobalParameter::from).collect(),
            ports: module.ports.iter().map(Port::from).collect(),
            interrupts: module.interrupts.iter().map(Interrupt::from).collect(),
        }
    }
}

impl From<&catalog::Command> for Command {
    fn from(row: &catalog::Command) -> Self {
        Self {
            number: row.number,
            mnemonic: row.mnemonic,
            used_by: match row.mode {
                catalog::Mode::Both => &["host", "program"],
                catalog::Mode::Direct => &["host"],
                catalog::Mode::Standalone => &["program"],
            },
            description: row.description,
            origin: Origin::new(row.since, row.certainty, row.source),
        }
    }
}

impl From<&catalog::AxisParameter> for AxisParameter {
    fn from(row: &catalog::AxisParameter) -> Self {
        Self {
            number: row.number,
            id: row.id,
            name: row.name,
            unit: unit(row.unit),
            min: row.min,
            max: row.max,
            internal_max: row.internal_max,
            default: row.default,
            default_source: source(row.default_source),
            access: access(row.access),
            axes: (0..8).filter(|&axis| row.is_on(axis)).collect(),
            description: row.description,
            values: values(row.values),
            origin: Origin::new(row.since, row.certainty, row.source),
        }
    }
}

impl From<&catalog::GlobalParameter> for GlobalParameter {
    fn from(row: &catalog::GlobalParameter) -> Self {
        Self {
            bank: row.bank,
            number: row.number,
            last: row.last,
            id: row.id,
            name: row.name,
            unit: unit(row.unit),
            min: row.min,
            max: row.max,
            default: row.default,
            default_source: source(row.default_source),
            access: access(row.access),
            description: row.description,
            values: values(row.values),
            origin: Origin::new(row.since, row.certainty, row.source),
        }
    }
}

impl From<&catalog::Port> for Port {
    fn from(row: &catalog::Port) -> Self {
        Self {
            bank: row.bank,
            number: row.number,
            id: row.id,
            name: row.name,
            unit: unit(row.unit),
            min: row.min,
            max: row.max,
            default: row.default,
            access: access(row.access),
            description: row.description,
            origin: Origin::new(row.since, row.certainty, row.source),
        }
    }
}

impl From<&catalog::Interrupt> for Interrupt {
    fn from(row: &catalog::Interrupt) -> Self {
        Self {
            number: row.number,
            id: row.id,
            name: row.name,
            description: row.description,
            origin: Origin::new(row.since, row.certainty, row.source),
        }
    }
}
