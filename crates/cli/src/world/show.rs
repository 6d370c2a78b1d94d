//! Answers of a world for people.

use std::io::{self, Write};

use comfy_table::{ContentArrangement, LineStyle, Table, TableStyle};
use serde_json::{Map, Value};

/// A line under the header and otherwise blanks.
const STYLE: TableStyle =
    TableStyle::new().header_separator(LineStyle::none().fill('─').junction('─'));

/// Prints an answer that is no refusal.
pub(super) fn answer(out: &mut impl Write, answer: &Value) -> io::Result<()> {
    if let Some(modules) = answer["state"]["modules"].as_object() {
        return state(out, &answer["time"], modules);
    }
    if let Some(ports) = answer["faults"].as_array() {
        return faults(out, ports);
    }
    if let Some(modules) = answer["scenario"]["modules"].as_array() {
        return scenario(out, modules);
    }
    if let Some(help) = answer.get("help") {
        for line in strings(&help["actions"]).chain(strings(&help["queries"])) {
            writeln!(out, "{line}")?;
        }
        return Ok(());
    }
    let rest: Map<String, Value> = answer
        .as_object()
        .into_iter()
        .flatten()
        .filter(|(key, _)| *key != "ok")
        .map(|(key, value)| (key.clone(), value.clone()))
        .collect();
    if rest.is_empty() {
        return writeln!(out, "ok");
    }
    let shown =
        if rest.len() == 1 { rest.into_iter().next().map(|(_, value)| value) } else { None };
    serde_json::to_writer_pretty(&mut *out, shown.as_ref().unwrap_or(answer))?;
    writeln!(out)
}

fn strings(list: &Value) -> impl Iterator<Item = &str> {
    list.as_array().into_iter().flatten().filter_map(Value::as_str)
}

/// One line for a change: its time, and what is new by the names that lead to it.
pub(super) fn change(out: &mut impl Write, change: &Value) -> io::Result<()> {
    let time = change["time"].as_f64().unwrap_or_default();
    let mut parts = Vec::new();
    let modules =
        change["changes"]["modules"].as_object().or_else(|| change["changes"].as_object());
    for (name, value) in modules.into_iter().flatten() {
        flatten(name, value, &mut parts);
    }
    writeln!(out, "{time:10.4} s  {}", parts.join("  "))
}

fn flatten(path: &str, value: &Value, parts: &mut Vec<String>) {
    match value {
        Value::Object(members) => {
            for (key, value) in members {
                // The number of an axis says enough.
                let path = if key == "axes" { path.to_owned() } else { format!("{path}.{key}") };
                flatten(&path, value, parts);
            }
        }
        value => parts.push(format!("{path}={}", plain(value))),
    }
}

/// A value as people write it.
fn plain(value: &Value) -> String {
    match value {
        Value::String(text) => text.clone(),
        Value::Null => "–".into(),
        Value::Bool(true) => "yes".into(),
        Value::Bool(false) => "no".into(),
        other => other.to_string(),
    }
}

/// A number with so many digits behind the point.
fn rounded(value: &Value, decimals: usize) -> String {
    let number = value.as_f64().unwrap_or_default();
    // Adding 0 makes a negative 0 positive.
    let scale = 10f64.powi(decimals as i32);
    format!("{:.decimals$}", (number * scale).round() / scale + 0.0)
}

fn state(out: &mut impl Write, time: &Value, modules: &Map<String, Value>) -> io::Result<()> {
    writeln!(out, "{:.4} s", time.as_f64().unwrap_or_default())?;
    for (name, module) in modules {
        let power = if module["powered"] == true { "on" } else { "off" };
        writeln!(
            out,
            "\n{name}: {}, power {power}, {} V, {} °C, program {}",
            plain(&module["model"]),
            plain(&module["supply"]),
            plain(&module["temperature"]),
            plain(&module["program"]),
        )?;
        for (what, list) in [
            ("inputs", "inputs"),
            ("outputs", "outputs"),
            ("analog", "analog"),
            ("torque", "torque"),
        ] {
            if let Some(values) = module[list].as_object().filter(|values| !values.is_empty()) {
                let values: Vec<String> = values
                    .iter()
                    .map(|(number, value)| match value {
                        Value::Bool(level) => format!("{number}={}", u8::from(*level)),
                        value => format!("{number}={}", plain(value)),
                    })
                    .collect();
                writeln!(out, "{what:8} {}", values.join("  "))?;
            }
        }
        if module["axes"].as_object().is_some_and(|axes| axes.values().any(is_servo)) {
            servo_axes(out, &module["axes"])?;
            continue;
        }
        let columns =
            ["Axis", "Position", "Counter", "Speed", "Load angle", "SG", "Current", "Switches", ""];
        let mut table = table(&columns);
        for (number, axis) in module["axes"].as_object().into_iter().flatten() {
            let unit = plain(&axis["unit"]);
            // Without a machine nothing measures a load.
            let measured =
                |value: String| if axis["machine"] == true { value } else { "–".into() };
            table.add_row([
                number.clone(),
                format!("{} {unit}", rounded(&axis["position"], 3)),
                plain(&axis["counter"]),
                format!("{} {unit}/s", rounded(&axis["speed"], 2)),
                measured(format!("{}°", rounded(&axis["load_angle"], 1))),
                measured(plain(&axis["stallguard"])),
                measured(format!("{} A", rounded(&axis["current"], 2))),
                switches(axis),
                notes(axis),
            ]);
        }
        writeln!(out, "{}", table.trim_fmt())?;
    }
    Ok(())
}

fn is_servo(axis: &Value) -> bool {
    axis.get("rpm").is_some()
}

/// The switches that are actuated.
fn switches(axis: &Value) -> String {
    let all = ["left", "home", "right"].into_iter();
    all.filter(|&switch| axis["switches"][switch] == true).collect::<Vec<_>>().join(" ")
}

fn servo_axes(out: &mut impl Write, axes: &Value) -> io::Result<()> {
    let columns = [
        "Axis", "Position", "Counter", "Speed", "Current", "Torque", "Bus", "Motor", "Driver",
        "Switches", "",
    ];
    let mut table = table(&columns);
    for (number, axis) in axes.as_object().into_iter().flatten() {
        let celsius = |part: &str| format!("{} °C", rounded(&axis["temperatures"][part], 1));
        table.add_row([
            number.clone(),
            format!("{} {}", rounded(&axis["position"], 3), plain(&axis["unit"])),
            plain(&axis["counter"]),
            format!("{} rpm", rounded(&axis["rpm"], 1)),
            format!("{} A", rounded(&axis["torque_current"], 2)),
            format!("{} Nm", rounded(&axis["motor_torque"], 3)),
            format!("{} V", rounded(&axis["bus"], 2)),
            celsius("motor"),
            celsius("driver"),
            switches(axis),
            notes(axis),
        ]);
    }
    writeln!(out, "{}", table.trim_fmt())
}

/// Status flags of a servo axis that tell of trouble.
const TROUBLES: [&str; 6] =
    ["overcurrent", "undervoltage", "overvoltage", "overtemperature", "hall_error", "driver_error"];

/// What is out of the ordinary about an axis.
fn notes(axis: &Value) -> String {
    let mut notes = Vec::new();
    if axis["machine"] == false {
        notes.push("ideal".to_owned());
    }
    if axis["blocked"] == true {
        notes.push("blocked".to_owned());
    }
    if let Some(state @ ("slipping" | "free")) = axis["rotor_state"].as_str() {
        notes.push(state.to_owned());
    }
    if let Some(lost) = axis["lost_steps"].as_i64().filter(|&lost| lost != 0) {
        notes.push(format!("{lost} steps lost"));
    }
    for (coil, state) in axis["coils"].as_object().into_iter().flatten() {
        if let Some(state @ ("disconnected" | "shorted")) = state.as_str() {
            notes.push(format!("coil {} {state}", coil.to_uppercase()));
        }
    }
    if axis["driver_fault"] == true {
        notes.push("driver fault".to_owned());
    }
    for (what, wires) in [("hall", &axis["halls"]), ("phase", &axis["phases"])] {
        for (wire, state) in wires.as_object().into_iter().flatten() {
            if let Some(state @ ("disconnected" | "shorted")) = state.as_str() {
                notes.push(format!("{what} {} {state}", wire.to_uppercase()));
            }
        }
    }
    if is_servo(axis) {
        let flags = TROUBLES.into_iter().filter(|&flag| axis["flags"][flag] == true);
        notes.extend(flags.map(|flag| format!("flag {}", flag.replace('_', " "))));
    }
    for (switch, held) in axis["held"].as_object().into_iter().flatten() {
        if let Some(held @ ("pressed" | "released")) = held.as_str() {
            notes.push(format!("{switch} held {held}"));
        }
    }
    notes.join(", ")
}

/// What a scenario has behind its axes: the way of the stage, and where its switches are.
fn scenario(out: &mut impl Write, modules: &[Value]) -> io::Result<()> {
    for (at, module) in modules.iter().enumerate() {
        let gap = if at == 0 { "" } else { "\n" };
        let ports: Vec<&str> = strings(&module["ports"]).collect();
        let (name, model) = (plain(&module["name"]), plain(&module["model"]));
        writeln!(out, "{gap}{name}: {model}, ports {}", ports.join(" "))?;
        let mut table = table(&["Axis", "Way", "Left", "Home", "Right"]);
        for axis in module["axes"].as_array().into_iter().flatten() {
            let unit = plain(&axis["unit"]);
            // An end that is left open is one without end.
            let range = |from: &Value, to: &Value| {
                let ends = [from, to].map(|end| end.as_f64().map(|_| rounded(end, 2)));
                match ends {
                    [Some(from), Some(to)] => format!("{from} to {to} {unit}"),
                    [Some(from), None] => format!("from {from} {unit}"),
                    [None, Some(to)] => format!("up to {to} {unit}"),
                    [None, None] => "endless".to_owned(),
                }
            };
            let way = match axis["circle"].as_f64() {
                Some(_) => format!("circle of {} {unit}", rounded(&axis["circle"], 2)),
                None if axis["machine"] == true => range(&axis["from"], &axis["to"]),
                None => "ideal".to_owned(),
            };
            let switch = |name: &str| {
                let switch = &axis[name];
                if switch.is_null() {
                    "–".to_owned()
                } else {
                    range(&switch["from"], &switch["to"])
                }
            };
            let row = [plain(&axis["axis"]), way, switch("left"), switch("home"), switch("right")];
            table.add_row(row);
        }
        writeln!(out, "{}", table.trim_fmt())?;
    }
    Ok(())
}

fn faults(out: &mut impl Write, ports: &[Value]) -> io::Result<()> {
    for (at, port) in ports.iter().enumerate() {
        let gap = if at == 0 { "" } else { "\n" };
        let name = format!("{}: {}", plain(&port["module"]), plain(&port["port"]));
        writeln!(out, "{gap}{name}, faults {}", plain(&port["faults"]))?;
        for direction in ["requests", "replies"] {
            let counts = port[direction].as_object();
            let met: Vec<String> = counts
                .into_iter()
                .flatten()
                .filter(|(name, count)| *name != "frames" && **count != 0)
                .map(|(name, count)| format!("{name} {count}"))
                .collect();
            let met = if met.is_empty() { "unharmed".to_owned() } else { met.join(", ") };
            writeln!(out, "  {direction:8} {} frames: {met}", plain(&port[direction]["frames"]))?;
        }
    }
    Ok(())
}

fn table(columns: &[&str]) -> Table {
    let mut table = Table::new();
    table
        .load_style(STYLE)
        .set_content_arrangement(ContentArrangement::Disabled)
        .set_header(columns.iter().copied());
    for column in table.column_iter_mut() {
        column.set_padding((0, 1));
    }
    table
}
