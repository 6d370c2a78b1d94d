//! `tmcl modules`: what modules there are and what each of them has.

mod data;

use std::io::Write;

use comfy_table::{ColumnConstraint, ContentArrangement, LineStyle, Table, TableStyle, Width};
use opentmcl_catalog::{MODULES, Module};

use crate::failure::Failure;
use crate::{lookup, terminal};

/// List the modules, or everything that one of them has
///
/// With a name: ratings, commands, axis parameters, global parameters, ports and interrupts. The
/// letters under Access mean R: can be read, W: can be written, E: can be stored in the EEPROM,
/// A: is stored by each write.
#[derive(clap::Args)]
#[command(after_help = EXAMPLES)]
pub(crate) struct Args {
    /// Name of the module
    name: Option<String>,
    /// Print JSON
    #[arg(long)]
    json: bool,
}

const EXAMPLES: &str = "\
Examples:
  tmcl modules
  tmcl modules tmcm-6214
  tmcl modules tmcm-6214 --json | jq '.axis_parameters[] | select(.unit == \"pps\") | .id'";

/// Width of a column that holds no sentences, in characters.
const NARROW: u16 = 25;

/// A line under the header and otherwise blanks: the tables are long.
const STYLE: TableStyle =
    TableStyle::new().header_separator(LineStyle::none().fill('─').junction('─'));

/// Lists the modules or one module.
pub(crate) fn run(args: &Args) -> Result<(), Failure> {
    let mut out = anstream::stdout().lock();
    match (&args.name, args.json) {
        (None, false) => list(&mut out)?,
        (None, true) => write_json(&mut out, &data::list())?,
        (Some(name), false) => describe(&mut out, lookup::module(name)?)?,
        (Some(name), true) => write_json(&mut out, &data::Module::from(lookup::module(name)?))?,
    }
    Ok(())
}

fn write_json(out: &mut impl Write, value: &impl serde::Serialize) -> std::io::Result<()> {
    serde_json::to_writer_pretty(&mut *out, value)?;
    writeln!(out)
}

fn list(out: &mut impl Write) -> std::io::Result<()> {
    let mut table = table(["Module", "Firmware", "Axes", "Description"]);
    for module in MODULES {
        table.add_row([
            module.name.to_owned(),
            lookup::version(module.firmware),
            module.axes.to_string(),
            module.description.to_owned(),
        ]);
    }
    writeln!(out, "{}", table.trim_fmt())
}

fn describe(out: &mut impl Write, module: &Module) -> std::io::Result<()> {
    let module = data::Module::from(module);
    let data::Identity { title, description, number, firmware, axes, .. } = &module.identity;
    writeln!(out, "{title}, firmware {firmware}")?;
    writeln!(out, "{description}")?;
    writeln!(out, "Module number {number}, {axes} axes.")?;

    let mut ratings = table(["Rating", "Value"]);
    ratings.add_rows(module.ratings.iter().map(|row| [row.name, row.value]));
    section(out, "Ratings", &ratings)?;

    let mut commands = table(["No", "Command", "Used by", "Since", "Description"]);
    commands.add_rows(module.commands.iter().map(|row| {
        [
            row.number.to_string(),
            row.mnemonic.to_owned(),
            row.used_by.join(", "),
            row.origin.since.clone().unwrap_or_default(),
            explained(row.description, &[], [row.origin.told()]),
        ]
    }));
    section(out, "Commands", &commands)?;

    let mut parameters = table(["No", "Parameter", "Range", "Access", "Description"]);
    parameters.add_rows(module.axis_parameters.iter().map(|row| {
        [
            row.number.to_string(),
            named(row.name, row.id),
            range(row.min, row.max, row.unit, row.default),
            row.access.clone(),
            explained(
                row.description,
                &row.values,
                [axes_note(&row.axes, *axes), row.origin.since(), row.origin.told()],
            ),
        ]
    }));
    section(out, "Axis parameters", &parameters)?;

    let mut parameters = table(["Bank", "No", "Parameter", "Range", "Access", "Description"]);
    parameters.add_rows(module.global_parameters.iter().map(|row| {
        [
            row.bank.to_string(),
            if row.number == row.last {
                row.number.to_string()
            } else {
                format!("{}..{}", row.number, row.last)
            },
            named(row.name, row.id),
            range(row.min, row.max, row.unit, row.default),
            row.access.clone(),
            explained(row.description, &row.values, [row.origin.since(), row.origin.told()]),
        ]
    }));
    section(out, "Global parameters", &parameters)?;

    let mut ports = table(["Bank", "No", "Port", "Range", "Access", "Description"]);
    ports.add_rows(module.ports.iter().map(|row| {
        [
            row.bank.to_string(),
            row.number.to_string(),
            named(row.name, row.id),
            range(row.min, row.max, row.unit, row.default),
            row.access.clone(),
            explained(row.description, &[], [row.origin.since(), row.origin.told()]),
        ]
    }));
    section(out, "Inputs and outputs", &ports)?;

    let mut interrupts = table(["No", "Interrupt", "Description"]);
    interrupts.add_rows(module.interrupts.iter().map(|row| {
        let description = explained(row.description, &[], [row.origin.since(), row.origin.told()]);
        [row.number.to_string(), named(row.name, row.id), description]
    }));
    section(out, "Interrupts", &interrupts)
}

fn section(out: &mut impl Write, heading: &str, table: &Table) -> std::io::Result<()> {
    let style = anstyle::Style::new().bold();
    writeln!(out, "\n{style}{heading}{style:#}\n{}", table.trim_fmt())
}

/// A table as wide as the terminal, whose last column takes what the others leave.
fn table<const COLUMNS: usize>(header: [&str; COLUMNS]) -> Table {
    let mut table = Table::new();
    table
        .load_style(STYLE)
        .set_content_arrangement(ContentArrangement::Dynamic)
        .set_width(terminal::width(std::io::stdout()))
        .set_header(header);
    for column in table.column_iter_mut() {
        column.set_padding((0, 1));
        if column.index + 1 < COLUMNS {
            column.set_constraint(ColumnConstraint::UpperBoundary(Width::Fixed(NARROW)));
        }
    }
    table
}

fn named(name: &str, id: &str) -> String {
    format!("{name}\n{id}")
}

fn range(
    min: impl ToString,
    max: impl ToString,
    unit: Option<&str>,
    default: impl ToString,
) -> String {
    let (min, max, default) = (min.to_string(), max.to_string(), default.to_string());
    let numbers = if min == max { min } else { format!("{min}..{max}") };
    let unit = unit.map(|unit| format!("\n{unit}")).unwrap_or_default();
    format!("{numbers}{unit}\ndefault {default}")
}

fn axes_note(axes: &[u8], count: u8) -> Option<String> {
    let axes = (axes.len() != usize::from(count)).then_some(axes)?;
    let axes: Vec<_> = axes.iter().map(u8::to_string).collect();
    Some(format!("Axes {} only.", axes.join(", ")))
}

fn explained<const NOTES: usize>(
    description: &str,
    values: &[data::Value],
    notes: [Option<String>; NOTES],
) -> String {
    let mut lines = vec![description.to_owned()];
    lines.extend(values.iter().map(|row| format!("{} = {}", row.value, row.meaning)));
    lines.extend(notes.into_iter().flatten());
    lines.join("\n")
}
