//! The page about CoolStep: its picture is that of the run that it shows, and the current is the one that
//! follows from the data of the motor by hand.

use std::f64::consts::TAU;
use std::fs;
use std::path::Path;

use crate::common::tmcl;

const BOOK: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/../../docs/coolstep.md");
const PICTURE: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/../../docs/images/coolstep.svg");

/// A folder with the two files of the page.
fn hill() -> tempfile::TempDir {
    let book = fs::read_to_string(BOOK).unwrap();
    let folder = tempfile::tempdir().unwrap();
    for name in ["hill.toml", "hill.tmc"] {
        let (_, rest) = book.split_once(&format!("<!-- file: {name} -->\n```")).unwrap();
        let (_, rest) = rest.split_once('\n').unwrap();
        let (text, _) = rest.split_once("```\n").unwrap();
        fs::write(folder.path().join(name), text).unwrap();
    }
    folder
}

fn simulate(folder: &Path, output: &[&str]) {
    let words = [&["sim", "hill.tmc", "--scenario", "hill.toml"], output].concat();
    assert!(tmcl(&words).current_dir(folder).output().unwrap().status.success());
}

#[test]
fn the_picture_of_the_page_is_that_of_its_run() {
    let folder = hill();
    simulate(folder.path(), &["--plot", "coolstep.svg"]);
    let drawn = fs::read_to_string(folder.path().join("coolstep.svg")).unwrap();
    if std::env::var_os("OPENTMCL_BLESS").is_some_and(|value| value == "1") {
        fs::write(PICTURE, &drawn).unwrap();
    }
    assert!(
        fs::read_to_string(PICTURE).unwrap() == drawn,
        "docs/images/coolstep.svg shows another run; if that is meant, run this test with OPENTMCL_BLESS=1 \
         and look at the picture"
    );
}

/// Columns of a recording, as numbers.
fn recorded(folder: &Path, columns: &[&str]) -> Vec<Vec<f64>> {
    simulate(folder, &["--record", "hill.csv", "--rate", "2000"]);
    let text = fs::read_to_string(folder.join("hill.csv")).unwrap();
    let mut lines = text.lines();
    let names: Vec<&str> = lines.next().unwrap().split(',').collect();
    let places: Vec<usize> = columns
        .iter()
        .map(|column| names.iter().position(|name| name == column).expect("a column"))
        .collect();
    lines
        .map(|line| {
            let cells: Vec<&str> = line.split(',').collect();
            places.iter().map(|&place| cells[place].parse().unwrap()).collect()
        })
        .collect()
}

#[test]
fn the_current_goes_up_where_the_load_takes_the_value_below_the_lower_limit() {
    let folder = hill();
    let columns = ["position0_microsteps", "speed0_pps", "current0_ampere", "lost_steps0"];
    let rows = recorded(folder.path(), &columns);
    let cruising = rows.iter().filter(|row| row[1] > 102_000.0);
    let currents: Vec<(f64, f64)> = cruising.map(|row| (row[0], row[2])).collect();

    // Per ampere 1.01 / (sqrt 2 * 2.8) Nm, as many volts per rad/s; two turns per second; 0.83 ohm. The
    // value is 800 E / (E + R I) * (1 - T / (K I)); the hill gains 0.1895 Nm in 5000 degrees.
    let constant = 1.01 / (2f64.sqrt() * 2.8);
    let emf = constant * 2.0 * TAU;
    let place = |current: f64| {
        let free = 800.0 * emf / (emf + 0.83 * current);
        let torque = constant * current * (1.0 - 128.0 / free);
        (torque - 0.02 - 0.075) / 0.1895 * 5000.0 / 360.0 * 51_200.0
    };
    let step = 2.8 / 32.0;
    let mut raised = 0;
    for pair in currents.windows(2) {
        let [(_, before), (at, after)] = [pair[0], pair[1]];
        if after > before {
            raised += 1;
            assert!((after - before - 2.0 * step).abs() < 1e-9, "two steps: {before} to {after}");
            // One digit of the value is 1134 microsteps of the way at the first step and less than 2200
            // at the last; a reading comes each full step, 256 microsteps.
            let late = at - place(before);
            assert!(
                (-60.0..=2_500.0).contains(&late),
                "{before} A: {at}, by hand {}",
                place(before)
            );
        }
    }
    assert_eq!(raised, 4);
    assert!(rows.iter().all(|row| row[3] == 0.0), "no step is lost");

    let full = 17.0 * step;
    let heat = currents.iter().map(|(_, current)| current * current).sum::<f64>();
    let part = heat / (currents.len() as f64 * full * full);
    assert!((0.69..0.71).contains(&part), "the page says 70 %: {part}");
}
