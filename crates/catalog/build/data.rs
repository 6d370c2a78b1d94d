//! The rows of `modules/*.toml` as they are written. Meaning of the fields: the head of each file,
//! and the types of `src/lib.rs`.

use std::collections::BTreeMap;

use serde::Deserialize;

/// A file of module data.
pub(crate) struct Source {
    /// Its name from the root of the repository, for messages.
    pub(crate) file: String,
    pub(crate) text: String,
}

#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct File {
    pub(crate) module: Head,
    #[serde(default)]
    pub(crate) rating: Vec<Rating>,
    #[serde(default)]
    pub(crate) axis_parameter: Vec<AxisParameter>,
    #[serde(default)]
    pub(crate) global_parameter: Vec<GlobalParameter>,
    #[serde(default)]
    pub(crate) interrupt: Vec<Interrupt>,
    #[serde(default)]
    pub(crate) port: Vec<Port>,
    #[serde(default)]
    pub(crate) command: Vec<Command>,
}

#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct Head {
    pub(crate) name: String,
    pub(crate) title: String,
    pub(crate) description: String,
    pub(crate) number: u16,
    pub(crate) firmware: (u8, u8),
    pub(crate) version: String,
    pub(crate) axes: u8,
    pub(crate) motion: Motion,
    pub(crate) peak_current_ma: u32,
}

/// What drives the axes, in the words of the files.
#[derive(Clone, Copy, Debug, Deserialize)]
#[serde(rename_all = "lowercase")]
pub(crate) enum Motion {
    Tmc5160,
    Tmc429,
    Foc,
    Block,
}

#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct Rating {
    pub(crate) name: String,
    pub(crate) value: String,
}

/// Where a default comes from, in the words of the files.
#[derive(Clone, Copy, Debug, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub(crate) enum DefaultSource {
    Manual,
    OpenFirmware,
    Chosen,
}

/// How sure a row is, in the words of the files; rows that do not say it are exact.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub(crate) enum Certainty {
    #[default]
    Exact,
    Sister,
    Observed,
    Inferred,
    Recalled,
}

#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct AxisParameter {
    // Numbers are read wider than they may be, so that a check can say what is wrong with them.
    pub(crate) number: i64,
    pub(crate) id: String,
    pub(crate) name: String,
    #[serde(default)]
    pub(crate) unit: String,
    pub(crate) min: i64,
    pub(crate) max: i64,
    pub(crate) internal_max: Option<i64>,
    pub(crate) default: i64,
    pub(crate) default_source: DefaultSource,
    pub(crate) access: String,
    pub(crate) axes: Option<Vec<i64>>,
    pub(crate) behaviour: Option<String>,
    pub(crate) stored: Option<String>,
    pub(crate) since: Option<(u8, u8)>,
    #[serde(default)]
    pub(crate) certainty: Certainty,
    pub(crate) source: Option<String>,
    pub(crate) description: String,
    #[serde(default)]
    pub(crate) values: BTreeMap<String, String>,
}

#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct GlobalParameter {
    pub(crate) bank: i64,
    pub(crate) number: i64,
    pub(crate) last: Option<i64>,
    pub(crate) id: String,
    pub(crate) name: String,
    #[serde(default)]
    pub(crate) unit: String,
    pub(crate) min: i64,
    pub(crate) max: i64,
    pub(crate) default: i64,
    pub(crate) default_source: DefaultSource,
    pub(crate) access: String,
    pub(crate) behaviour: Option<String>,
    pub(crate) stored: Option<String>,
    pub(crate) since: Option<(u8, u8)>,
    #[serde(default)]
    pub(crate) certainty: Certainty,
    pub(crate) source: Option<String>,
    pub(crate) description: String,
    #[serde(default)]
    pub(crate) values: BTreeMap<String, String>,
}

#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct Interrupt {
    pub(crate) number: i64,
    pub(crate) id: String,
    pub(crate) name: String,
    pub(crate) behaviour: String,
    pub(crate) index: u8,
    pub(crate) since: Option<(u8, u8)>,
    #[serde(default)]
    pub(crate) certainty: Certainty,
    pub(crate) source: Option<String>,
    pub(crate) description: String,
}

#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct Port {
    pub(crate) bank: i64,
    pub(crate) number: i64,
    pub(crate) id: String,
    pub(crate) name: String,
    #[serde(default)]
    pub(crate) unit: String,
    pub(crate) min: i64,
    pub(crate) max: i64,
    pub(crate) default: i64,
    pub(crate) access: String,
    pub(crate) behaviour: String,
    pub(crate) index: u8,
    pub(crate) since: Option<(u8, u8)>,
    #[serde(default)]
    pub(crate) certainty: Certainty,
    pub(crate) source: Option<String>,
    pub(crate) description: String,
}

/// Where a command may be used, in the words of the files.
#[derive(Clone, Copy, Debug, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub(crate) enum Mode {
    Both,
    Direct,
    Standalone,
}

#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct Command {
    pub(crate) number: i64,
    pub(crate) mnemonic: String,
    pub(crate) mode: Mode,
    pub(crate) unavailable: Option<String>,
    pub(crate) since: Option<(u8, u8)>,
    #[serde(default)]
    pub(crate) certainty: Certainty,
    pub(crate) source: Option<String>,
    pub(crate) description: String,
}

/// Reads one file; a row with an unknown, missing or mistyped field is an error.
pub(crate) fn parse(source: &Source) -> Result<File, String> {
    toml::from_str(&source.text).map_err(|error| {
        let before = error.span().and_then(|span| source.text.get(..span.start));
        let line = before.unwrap_or_default().split('\n').count();
        format!("{}: line {line}: {}", source.file, error.message().replace('\n', " "))
    })
}

/// The enum variant of an identifier: `target_position` becomes `TargetPosition`.
pub(crate) fn variant(id: &str) -> String {
    let mut name = String::new();
    for word in id.split('_') {
        let mut letters = word.chars();
        name.extend(letters.next().map(|first| first.to_ascii_uppercase()));
        name.push_str(letters.as_str());
    }
    name
}

/// Whether a text is `snake_case`, so that a Rust or TMCL name can be made of it.
pub(crate) fn is_snake_case(id: &str) -> bool {
    id.starts_with(|c: char| c.is_ascii_lowercase())
        && id.split('_').all(|word| {
            !word.is_empty() && word.chars().all(|c| c.is_ascii_lowercase() || c.is_ascii_digit())
        })
}

/// The rooms of the firmware that each table may name, each with the enum of its effects.
pub(crate) mod rooms {
    use super::Motion;

    /// Of axis parameters, of all modules.
    pub(crate) const AXIS: &[(&str, &str)] = &[
        ("tmc5160", "Tmc5160"),
        ("tmc429", "Tmc429"),
        ("tmc26x", "Tmc26x"),
        ("axis", "Axis"),
        ("servo", "Servo"),
        ("foc", "Foc"),
        ("block", "Block"),
    ];

    /// Of axis parameters, of a module that is driven so.
    pub(crate) fn axis(motion: Motion) -> &'static [(&'static str, &'static str)] {
        match motion {
            Motion::Tmc5160 => &[("tmc5160", "Tmc5160"), ("axis", "Axis")],
            Motion::Tmc429 => &[("tmc429", "Tmc429"), ("tmc26x", "Tmc26x"), ("axis", "Axis")],
            Motion::Foc => &[("servo", "Servo"), ("foc", "Foc")],
            Motion::Block => &[("servo", "Servo"), ("block", "Block")],
        }
    }

    /// Of global parameters. `interrupts` here are settings; the interrupts have their own table.
    pub(crate) const GLOBAL: &[(&str, &str)] =
        &[("globals", "Globals"), ("variables", "Variables"), ("interrupts", "InterruptSetting")];
    /// Of interrupts.
    pub(crate) const INTERRUPT: &[(&str, &str)] = &[("interrupts", "InterruptBehaviour")];
    /// Of ports.
    pub(crate) const PORT: &[(&str, &str)] = &[("io", "PortBehaviour")];
}
