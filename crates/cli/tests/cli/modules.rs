//! `tmcl modules`.

use crate::common::{stdout_of, tmcl};
use opentmcl_catalog::{MODULES, find};

fn json(args: &[&str]) -> serde_json::Value {
    serde_json::from_str(&stdout_of(args)).unwrap()
}

fn numbers(rows: &serde_json::Value) -> Vec<u64> {
    rows.as_array().unwrap().iter().map(|row| row["number"].as_u64().unwrap()).collect()
}

#[test]
fn all_modules_are_listed() {
    let text = stdout_of(&["modules"]);
    let data = json(&["modules", "--json"]);
    assert_eq!(data.as_array().unwrap().len(), MODULES.len());
    for (module, row) in MODULES.iter().zip(data.as_array().unwrap()) {
        assert!(text.contains(module.name), "{text}");
        assert_eq!(row["name"], module.name);
        assert_eq!(row["axes"], module.axes);
    }
}

#[test]
fn the_data_of_a_module_is_complete() {
    let module = find("tmcm-6214").unwrap();
    let data = json(&["modules", "TMCM-6214", "--json"]);
    assert_eq!(data["version"], "6214V116");
    assert_eq!(data["firmware"], "1.16");
    assert_eq!(
        numbers(&data["axis_parameters"]),
        module.axis_parameters.iter().map(|row| u64::from(row.number)).collect::<Vec<_>>()
    );
    assert_eq!(
        numbers(&data["commands"]),
        module.commands.iter().map(|row| u64::from(row.number)).collect::<Vec<_>>()
    );
    for (key, count) in [
        ("ratings", module.ratings.len()),
        ("global_parameters", module.global_parameters.len()),
        ("ports", module.ports.len()),
        ("interrupts", module.interrupts.len()),
    ] {
        assert!(count > 0, "{key}");
        assert_eq!(data[key].as_array().unwrap().len(), count, "{key}");
    }
}

#[test]
fn a_parameter_reads_as_the_manual_has_it() {
    // Firmware manual 4, table 16: maximum current, 0..255, RW.
    let data = json(&["modules", "tmcm-6214", "--json"]);
    let rows = data["axis_parameters"].as_array().unwrap();
    let row = rows.iter().find(|row| row["number"] == 6).unwrap();
    assert_eq!((&row["min"], &row["max"]), (&0.into(), &255.into()));
    assert_eq!(row["access"], "RW");
    assert_eq!(row["axes"], serde_json::json!([0, 1, 2, 3, 4, 5]));
}

#[test]
fn rows_that_are_not_from_the_modules_own_manual_say_so() {
    let data = json(&["modules", "tmcm-6110", "--json"]);
    let rows = data["axis_parameters"].as_array().unwrap();
    let row = |number: u64| rows.iter().find(|row| row["number"] == number).unwrap();
    // Only maps of later firmware have it.
    assert_eq!(row(150)["since"], "1.46");
    assert_eq!(row(204)["certainty"], "observed");
    assert!(row(204)["source"].as_str().unwrap().contains("Odemis"));
    let text = stdout_of(&["modules", "tmcm-6110"]);
    assert!(text.contains("(since V1.46)") && text.contains("(observed: "), "{text}");
    assert!(!stdout_of(&["modules", "tmcm-6214"]).contains("(exact"));
}

#[test]
fn the_tables_name_everything_and_keep_to_the_width() {
    let text = stdout_of(&["modules", "tmcm-6214"]);
    let module = find("tmcm-6214").unwrap();
    for heading in
        ["Ratings", "Commands", "Axis parameters", "Global parameters", "Inputs and outputs"]
    {
        assert!(text.lines().any(|line| line == heading), "{heading}");
    }
    let longest = text.lines().map(|line| line.chars().count()).max();
    assert!(longest.is_some_and(|length| length <= 100), "{longest:?}");
    let first_cells: Vec<&str> =
        text.lines().filter_map(|line| line.split_whitespace().next()).collect();
    for row in module.axis_parameters {
        assert!(first_cells.contains(&row.number.to_string().as_str()), "{}", row.number);
    }
}

#[test]
fn the_output_is_the_same_each_time() {
    let once = tmcl(&["modules", "tmcm-6214", "--json"]).output().unwrap();
    let again = tmcl(&["modules", "tmcm-6214", "--json"]).output().unwrap();
    assert_eq!(once.stdout, again.stdout);
}
