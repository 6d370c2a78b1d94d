//! Recordings of samples that are made up, read back with the readers of the two crates.

use std::collections::BTreeMap;
use std::fs;
use std::os::unix::fs::symlink;
use std::path::{Path, PathBuf};

use opentmcl_virtual::{MachineSample, Recorder, Sample, VirtualModule};
use opentmcl_wire::{Duration, mnemonic};
use parquet::file::reader::{FileReader, SerializedFileReader};
use parquet::record::Field;
use serde_json::{Value as Json, json};

use super::{Columns, Format, Recording};

const RATE: u32 = 1000;

/// A module with a machine behind axis 1, whose variable 7 and inputs are recorded.
fn columns() -> Columns {
    let model = opentmcl_catalog::find("tmcm-6214").unwrap();
    let mut columns = Columns::without_machines(model, RATE, &[7]);
    columns.add_machine(1);
    columns.add_inputs();
    columns
}

/// The sample with this number, one each millisecond, no value like another.
fn sample(number: u32) -> Sample {
    let n = i32::try_from(number).unwrap();
    let real = f64::from(number);
    let machine = MachineSample {
        fine_steps: 1.0,
        rotor: real * 200.0 - 0.125,
        stage: real * 200.0 - 0.375,
        speed: -real / 3.0,
        load_angle: real / 7.0,
        load: real / 1000.0,
        stallguard: u16::try_from(number % 1024).unwrap(),
        current: 1.5 + real / 16.0,
        lost_steps: -4 * i64::from(n),
        switches: [number.is_multiple_of(2), number.is_multiple_of(3), number.is_multiple_of(5)],
        stop_flags: u8::try_from(number % 4).unwrap(),
        driver_flags: u8::try_from(number % 256).unwrap(),
    };
    Sample {
        time: Duration::from_millis(number.into()),
        address: u16::try_from(number % 2048).unwrap(),
        positions: (0..6).map(|axis| n * 200 + axis).collect(),
        speeds: (0..6).map(|axis| -n - axis).collect(),
        outputs: u8::try_from(number % 256).unwrap(),
        variables: vec![i32::MIN + n],
        machines: vec![None, Some(machine), None, None, None, None],
        servos: vec![None; 6],
        inputs: u8::try_from(number / 256 % 256).unwrap(),
        analog: (0..6).map(|input| n % 4096 - input).collect(),
    }
}

struct Folder(tempfile::TempDir);

impl Folder {
    fn new() -> Self {
        Self(tempfile::tempdir().unwrap())
    }

    fn file(&self, name: &str) -> PathBuf {
        self.0.path().join(name)
    }

    /// Writes a recording of so many samples.
    fn record(&self, name: &str, count: u32) -> PathBuf {
        let path = self.file(name);
        let mut recording = Recording::create(&path, columns()).unwrap();
        (0..count).for_each(|number| recording.add(&sample(number)).unwrap());
        recording.finish().unwrap();
        path
    }

    fn names(&self) -> Vec<String> {
        let entries = fs::read_dir(self.0.path()).unwrap();
        entries.map(|entry| entry.unwrap().file_name().into_string().unwrap()).collect()
    }
}

/// What columns must say of a sample, levels as 0 and 1: those by name that differ most.
fn expected(number: u32) -> Vec<(&'static str, f64)> {
    let sample = sample(number);
    let machine = sample.machines[1].unwrap();
    let level = |levels: u8, bit: u8| f64::from(levels >> bit & 1);
    vec![
        ("time_s", f64::from(number) / 1000.0),
        ("position0_microsteps", sample.positions[0].into()),
        ("position5_microsteps", sample.positions[5].into()),
        ("speed5_pps", sample.speeds[5].into()),
        ("address", sample.address.into()),
        ("output0", level(sample.outputs, 0)),
        ("output1", level(sample.outputs, 1)),
        ("variable7", sample.variables[0].into()),
        ("rotor1_microsteps", machine.rotor),
        ("stage1_microsteps", machine.stage),
        ("real_speed1_pps", machine.speed),
        ("load_angle1_degrees", machine.load_angle),
        ("load1", machine.load),
        ("stallguard1", machine.stallguard.into()),
        ("current1_ampere", machine.current),
        ("lost_steps1", machine.lost_steps as f64),
        ("left1", f64::from(u8::from(machine.switches[0]))),
        ("right1", f64::from(u8::from(machine.switches[1]))),
        ("home1", f64::from(u8::from(machine.switches[2]))),
        ("stop_flags1", machine.stop_flags.into()),
        ("driver_flags1", machine.driver_flags.into()),
        ("input0", level(sample.inputs, 0)),
        ("input1", level(sample.inputs, 1)),
        ("analog0", sample.analog[0].into()),
    ]
}

fn assert_values(number: u32, values: &BTreeMap<String, f64>) {
    for (name, value) in expected(number) {
        assert_eq!(values.get(name), Some(&value), "{name} in sample {number}");
    }
    // Axes without a machine have none of its columns.
    assert!(!values.contains_key("rotor0_microsteps") && !values.contains_key("load2"));
}

#[test]
fn csv_has_the_values_of_the_samples() {
    let text = fs::read_to_string(Folder::new().record("run.csv", 400)).unwrap();
    let mut lines = text.lines();
    let names: Vec<_> = lines.next().unwrap().split(',').collect();
    let mut count = 0;
    for (number, line) in (0..).zip(lines) {
        let values = line.split(',').map(|field| field.parse::<f64>().unwrap());
        let values = names.iter().map(|&name| name.to_owned()).zip(values).collect();
        assert_values(number, &values);
        count += 1;
    }
    assert_eq!(count, 400);
}

#[test]
fn without_machines_csv_has_the_motion_of_each_axis_the_program_and_the_outputs() {
    let folder = Folder::new();
    let path = folder.file("run.csv");
    let model = opentmcl_catalog::find("tmcm-6214").unwrap();
    let columns = Columns::without_machines(model, RATE, &[7]);
    Recording::create(&path, columns).unwrap().finish().unwrap();
    let header = fs::read_to_string(path).unwrap();
    let names: Vec<_> = header.trim_end().split(',').collect();
    assert_eq!(names[..2], ["time_s", "position0_microsteps"]);
    assert_eq!(names[7..9], ["speed0_pps", "speed1_pps"]);
    assert_eq!(names[13..15], ["address", "output0"]);
    assert_eq!(names.last(), Some(&"variable7"));
}

#[test]
fn parquet_has_the_values_of_the_samples_in_groups_of_rows() {
    // A group has a million values, and a row more than 30 of them.
    let count = 45_000;
    let file = fs::File::open(Folder::new().record("run.parquet", count)).unwrap();
    let reader = SerializedFileReader::new(file).unwrap();
    assert!(reader.num_row_groups() >= 2, "{}", reader.num_row_groups());
    let mut rows = 0;
    for (number, row) in (0..).zip(reader.get_row_iter(None).unwrap()) {
        rows += 1;
        if !u32::is_multiple_of(number, 97) {
            continue;
        }
        let row = row.unwrap();
        let values = row.get_column_iter().map(|(name, field)| {
            let value = match field {
                Field::Bool(value) => f64::from(u8::from(*value)),
                Field::Long(value) => *value as f64,
                Field::Double(value) => *value,
                other => panic!("{name}: {other}"),
            };
            (name.clone(), value)
        });
        assert_values(number, &values.collect());
    }
    assert_eq!(rows, count);
}

#[test]
fn parquet_tells_the_module_the_rate_and_the_units() {
    let file = fs::File::open(Folder::new().record("run.parquet", 1)).unwrap();
    let reader = SerializedFileReader::new(file).unwrap();
    let pairs = reader.metadata().file_metadata().key_value_metadata().unwrap();
    let value = |key: &str| {
        let pair = pairs.iter().find(|pair| pair.key == key).unwrap();
        pair.value.clone().unwrap()
    };
    assert_eq!((value("module"), value("firmware")), ("TMCM-6214".into(), "1.16".into()));
    assert_eq!((value("rate_hz"), value("unit.time_s")), ("1000".into(), "s".into()));
    assert_eq!(value("unit.rotor1_microsteps"), "microsteps");
}

/// Topic, schema, time in nanoseconds and text of each message of a file.
fn messages(path: &Path) -> Vec<(String, Json, u64, Json)> {
    let bytes = fs::read(path).unwrap();
    let messages = mcap::MessageStream::new(&bytes).unwrap();
    messages
        .map(|message| {
            let message = message.unwrap();
            let schema = message.channel.schema.clone().unwrap();
            assert_eq!(
                (schema.encoding.as_str(), message.channel.message_encoding.as_str()),
                ("jsonschema", "json")
            );
            assert_eq!(message.publish_time, message.log_time);
            (
                message.channel.topic.clone(),
                serde_json::from_slice(&schema.data).unwrap(),
                message.log_time,
                serde_json::from_slice(&message.data).unwrap(),
            )
        })
        .collect()
}

#[test]
fn mcap_has_the_values_of_the_samples_in_a_channel_for_each_axis_and_the_module() {
    let messages = messages(&Folder::new().record("run.mcap", 2000));
    // Six axes and the module.
    assert_eq!(messages.len(), 7 * 2000);
    for (topic, _, time, message) in &messages {
        let number = u32::try_from(time / 1_000_000).unwrap();
        let sample = sample(number);
        let machine = sample.machines[1].unwrap();
        match topic.as_str() {
            "/axis0" => assert_eq!(
                *message,
                json!({ "position": sample.positions[0], "speed": sample.speeds[0] })
            ),
            "/axis1" => {
                assert_eq!(message["position"], sample.positions[1]);
                assert_eq!(message["rotor"], machine.rotor);
                // The reader of JSON may be off by the last bit.
                let speed = message["real_speed"].as_f64().unwrap();
                assert!((speed - machine.speed).abs() <= machine.speed.abs() * f64::EPSILON);
                assert_eq!(message["home"], machine.switches[2]);
                assert_eq!(message["stallguard"], machine.stallguard);
            }
            "/module" => {
                assert_eq!(message["address"], sample.address);
                assert_eq!(message["output1"], sample.outputs & 2 != 0);
                assert_eq!(message["variable7"], sample.variables[0]);
                assert_eq!(message["analog0"], sample.analog[0]);
            }
            other => assert!(other.starts_with("/axis"), "{other}"),
        }
    }
}

#[test]
fn each_field_of_a_message_stands_in_its_schema() {
    for (topic, schema, _, message) in messages(&Folder::new().record("run.mcap", 1)) {
        let properties = schema["properties"].as_object().unwrap();
        let fields = message.as_object().unwrap();
        assert!(fields.keys().eq(properties.keys()), "{topic}: {schema}");
        for (name, value) in fields {
            let is_right = match properties[name]["type"].as_str().unwrap() {
                "integer" => value.is_i64() || value.is_u64(),
                "number" => value.is_number(),
                "boolean" => value.is_boolean(),
                other => panic!("{other}"),
            };
            assert!(is_right, "{topic}: {name} is {value}");
        }
    }
}

#[test]
fn a_recording_without_samples_is_a_whole_file() {
    let folder = Folder::new();
    let file = fs::File::open(folder.record("run.parquet", 0)).unwrap();
    let reader = SerializedFileReader::new(file).unwrap();
    assert_eq!(reader.get_row_iter(None).unwrap().count(), 0);
    assert!(messages(&folder.record("run.mcap", 0)).is_empty());
}

#[test]
fn a_recording_that_is_not_finished_leaves_the_older_file_and_nothing_else() {
    for name in ["run.parquet", "run.mcap"] {
        let folder = Folder::new();
        fs::write(folder.file(name), "older").unwrap();
        let mut recording = Recording::create(&folder.file(name), columns()).unwrap();
        recording.add(&sample(0)).unwrap();
        drop(recording);
        assert_eq!(fs::read_to_string(folder.file(name)).unwrap(), "older");
        assert_eq!(folder.names(), [name]);
    }
}

#[test]
fn a_full_disk_is_told() {
    let folder = Folder::new();
    for name in ["run.csv", "run.parquet", "run.mcap"] {
        symlink("/dev/full", folder.file(name)).unwrap();
        let record = || {
            let mut recording = Recording::create(&folder.file(name), columns())?;
            (0..1000).try_for_each(|number| recording.add(&sample(number)))?;
            recording.finish()
        };
        let failure = record().expect_err(name);
        let message = failure.message();
        assert!(message.contains(name) && message.contains("space"), "{message}");
    }
}

#[test]
fn the_ending_says_the_form_and_those_that_are_known_are_named() {
    let form = |name: &str| Format::of(Path::new(name));
    assert_eq!(form("run.csv").unwrap(), Format::Csv);
    assert_eq!(form("a.b/run.Parquet").unwrap(), Format::Parquet);
    assert_eq!(form("run.mcap").unwrap(), Format::Mcap);
    assert_eq!(form("/dev/fd/3").unwrap(), Format::Csv);
    assert!(form("run.xlsx").unwrap_err().message().contains(".xlsx"));
}

#[test]
fn a_servo_axis_has_columns_of_its_parameters_and_of_its_machine() {
    let folder = Folder::new();
    let path = folder.file("servo.csv");
    let model = opentmcl_catalog::find("tmcm-1636").unwrap();
    let mut module = VirtualModule::new(model);
    for command in ["SAP 90, 0, 1", "SAP 15, 0, 2", "SAP 56, 0, 24", "ROR 0, 1000"] {
        module.execute(mnemonic::parse(command).unwrap());
    }
    let mut recording = Recording::create(&path, Columns::new(&module, 10, &[], false)).unwrap();
    let mut recorder = Recorder::new(module.now(), 10, Vec::new());
    for _ in 0..11 {
        module.advance_to(recorder.due());
        recording.add(recorder.take(&mut module)).unwrap();
    }
    recording.finish().unwrap();
    let text = fs::read_to_string(path).unwrap();
    let mut lines = text.lines();
    let names: Vec<_> = lines.next().unwrap().split(',').collect();
    assert!(names.starts_with(&["time_s", "position0_units", "speed0_rpm"]), "{names:?}");
    let last: Vec<f64> =
        lines.last().unwrap().split(',').map(|field| field.parse().unwrap()).collect();
    let value = |name: &str| last[names.iter().position(|other| *other == name).unwrap()];
    let mut parameter = |number: u8| {
        let command = mnemonic::parse(&format!("GAP {number}, 0")).unwrap();
        f64::from(module.execute(command).value)
    };
    for (column, number) in [
        ("position0_units", 52),
        ("target_position0_units", 50),
        ("ramp_position0_units", 51),
        ("target_speed0_rpm", 40),
        ("ramp_speed0_rpm", 41),
        ("actual_torque0_milliampere", 31),
        ("target_torque0_milliampere", 30),
        ("actual_flux0_milliampere", 33),
        ("target_flux0_milliampere", 32),
        ("status_flags0", 156),
    ] {
        assert_eq!(value(column), parameter(number), "{column}");
    }
    let speed = value("real_speed0_rpm");
    assert!((speed - value("speed0_rpm")).abs() < 30.0 && speed > 500.0, "{speed}");
    // 24 hall edges in a turn; the counter is behind by less than one, and the rest of a sector at power-up.
    assert!((value("rotor0_turns") - value("position0_units") / 24.0).abs() < 0.1);
    let sum = value("current_a0_ampere") + value("current_b0_ampere") + value("current_c0_ampere");
    assert!(sum.abs() < 1e-9 && value("current_a0_ampere").abs() > 0.0);
    // K = 36 mNm/A / √3 · 3/2, of the current that makes the torque.
    let torque = 0.036 / 3.0f64.sqrt() * 1.5 * value("torque_current0_ampere");
    assert!((value("torque0_newtonmeter") - torque).abs() < 1e-9);
    assert!((value("bus0_volt") - 24.0).abs() < 0.5 && value("duty0") > 0.0);
    assert!(!names.iter().any(|name| name.contains("stallguard") || name.contains("microsteps")));
}
