//! A lab: what happens by itself, and its lines.

mod schema;

use opentmcl_virtual::lab::SCHEMA;
use opentmcl_virtual::{Effect, Lab, LabEffect, Scenario, Subscription};
use opentmcl_wire::{Duration, Instant, mnemonic};
use serde_json::{Value, json};

const TWO: &str = r#"
[[module]]
name = "xy"
model = "tmcm-6214"
start = ["input 1 high"]

[[module.axis]]
axis = 0
motor = "nema17"
transmission = { screw = "5 mm" }
stage = { from = "-10 mm", to = "210 mm", start = "50 mm" }
left = { at = "0 mm" }
home = { at = "100 mm", width = "4 mm" }

[[module.port]]
pty = "/dev/xy"
faults = "drop 1%"

[[module.at]]
time = "2 s"
do = ["input 3 high", "supply 18 V"]

[[module.at]]
time = "1 s"
do = "input 3 low"

[[module.wave]]
shape = "square"
low = "analog 0 0"
high = "analog 0 4095"
period = "1 s"
end = "3 s"

[[module]]
name = "z"
model = "tmcm-6214"
"#;

fn lab(text: &str) -> Lab {
    Lab::new(Scenario::parse("lab.toml", text).unwrap_or_else(|mistakes| panic!("{mistakes}")))
}

fn at(millis: u64) -> Instant {
    Instant::from_ticks(0) + Duration::from_millis(millis)
}

fn ask(lab: &mut Lab, module: usize, command: &str) -> i32 {
    lab.module_mut(module).unwrap().execute(mnemonic::parse(command).unwrap()).value
}

/// A line that a lab has written, after a look whether it is as the schema says.
#[track_caller]
fn checked(line: &str) -> Value {
    assert!(!line.contains('\n'), "{line}");
    let value: Value = serde_json::from_str(line).unwrap();
    let root: Value = serde_json::from_str(SCHEMA).unwrap();
    let mismatch = schema::mismatch(&value, &root, &root);
    assert_eq!(mismatch, None, "{line}");
    value
}

#[track_caller]
fn answer(lab: &mut Lab, line: &str) -> Value {
    checked(&lab.line(line).json)
}

#[test]
fn what_is_scheduled_happens_at_its_time_and_in_its_order() {
    let mut lab = lab(TWO);
    assert_eq!(ask(&mut lab, 0, "GIO 1, 0"), 1);
    let mut seen = Vec::new();
    while let Some(next) = lab.next_event() {
        lab.advance_to(next);
        let state = (ask(&mut lab, 0, "GIO 3, 0"), ask(&mut lab, 0, "GIO 8, 1"));
        seen.push((next.as_ticks() / 16_000, ask(&mut lab, 0, "GIO 0, 1"), state));
    }
    // The wave changes every half second; 24 V are the supply until 18 V come.
    let expected = [
        (500, 0, (0, 240)),
        (1000, 4095, (0, 240)),
        (1500, 0, (0, 240)),
        (2000, 4095, (1, 180)),
        (2500, 0, (1, 180)),
        (3000, 4095, (1, 180)),
    ];
    assert_eq!(seen, expected);
    assert_eq!(ask(&mut lab, 1, "GIO 8, 1"), 240);
}

#[test]
fn a_lab_that_is_polled_often_is_in_the_same_state() {
    let run = |step: u64| {
        let mut lab = lab(TWO);
        for command in ["132 0, 0, 0", "GIO 3, 0", "AGP 5, 2", "JA 0", "133 0, 0, 0", "129 1, 0, 0"]
        {
            ask(&mut lab, 0, command);
        }
        ask(&mut lab, 0, "MVP ABS, 0, 100000");
        let mut time = 0;
        while time < 2_750 {
            time += step;
            lab.advance_to(at(time.min(2_750)));
        }
        (lab.line("state").json, ask(&mut lab, 0, "GGP 5, 2"))
    };
    let slow = run(2_750);
    assert_eq!(run(1), slow);
    assert_eq!(run(333), slow);
}

#[test]
fn actions_by_line_are_done_and_mistakes_say_what_would_be_right() {
    let mut lab = lab(TWO);
    assert_eq!(answer(&mut lab, "xy: input 0 high"), json!({ "ok": true }));
    assert_eq!(ask(&mut lab, 0, "GIO 0, 0"), 1);
    assert_eq!(ask(&mut lab, 1, "GIO 0, 0"), 0);
    for (line, part) in [
        ("input 0 high", "for which module? write xy: and the action (modules: xy, z)"),
        ("zz: input 0 high", "no module \"zz\"; did you mean \"z\"? (modules: xy, z)"),
        ("xy: inptu 0 high", "did you mean \"input\"?"),
        ("xy: stat", "did you mean \"state\"?"),
        ("z: block axis 0", "axis 0 has no machine"),
        ("xy: block axis 6", "the TMCM-6214 has no axis 6; its axes are 0 to 5"),
        ("xy: load axis 0 5 V", "another unit"),
        ("xy: set position axis 0 5 deg", "moves along a line; write a length"),
        ("xy: input 9 high", "no digital input 9; there are 0, 1, 2, 3, 4, 5, 6, 7"),
        ("watch 0", "a rate from 1 to 1000"),
        ("", "help lists what there is"),
    ] {
        let error = answer(&mut lab, line);
        let error = error["error"].as_str().unwrap();
        assert!(error.contains(part), "{line}: {error}");
    }
}

#[test]
fn faults_are_handed_to_whoever_serves_the_lab() {
    let mut lab = lab(TWO);
    let effect = Effect::Faults { port: "pty".into(), spec: "drop 2%, seed 7".into() };
    let expected = [LabEffect { module: 0, effect }];
    assert_eq!(lab.line("xy: faults pty drop 2%, seed 7").effects, expected);
    assert_eq!(lab.take_effects(), []);
    let port = &lab.scenario().modules[0].ports[0];
    assert_eq!(port.faults.as_deref(), Some("drop 1%"));
}

#[test]
fn every_answer_is_as_the_schema_says() {
    let mut lab = lab(TWO);
    let state = answer(&mut lab, "state");
    assert_eq!(state["time"], json!(0.0));
    let module = &state["state"]["modules"]["xy"];
    assert_eq!(module["inputs"]["1"], json!(true));
    assert_eq!(module["axes"]["0"]["unit"], json!("mm"));
    assert_eq!(module["axes"]["1"]["unit"], json!("deg"));
    let scenario = answer(&mut lab, "scenario");
    let axis = &scenario["scenario"]["modules"][0]["axes"][0];
    // 200 full steps of 256 for 5 mm; a left switch reaches as far as the stage does.
    assert_eq!(axis["microsteps_per_unit"], json!(10_240.0));
    assert_eq!(axis["left"], json!({ "from": null, "to": 0.0 }));
    assert_eq!((&axis["from"], &axis["to"]), (&json!(-10.0), &json!(210.0)));
    answer(&mut lab, "help");
    let schema = answer(&mut lab, "schema");
    assert_eq!(schema["schema"], serde_json::from_str::<Value>(SCHEMA).unwrap());
    answer(&mut lab, "nothing");
    assert_eq!(lab.line("watch").watch, Some(Some(Subscription::Changes)));
    assert_eq!(lab.line("watch 20").watch, Some(Some(Subscription::Rate(20))));
    assert_eq!(lab.line("unwatch").watch, Some(None));
}

#[test]
fn a_watcher_is_told_of_changes_and_of_nothing_else() {
    let mut lab = lab(TWO);
    let mut snapshot = lab.snapshot(Subscription::Changes);
    assert_eq!(lab.changes_since(&mut snapshot), None);
    lab.line("xy: disconnect coil B axis 4");
    let changes = checked(&lab.changes_since(&mut snapshot).unwrap());
    let coil =
        json!({ "modules": { "xy": { "axes": { "4": { "coils": { "b": "disconnected" } } } } } });
    assert_eq!(changes["changes"], coil);
    assert_eq!(lab.next_look(&snapshot), Some(at(500)));
    lab.advance_to(at(500));
    let changes = checked(&lab.changes_since(&mut snapshot).unwrap());
    let analog = json!({ "modules": { "xy": { "analog": { "0": 0 } } } });
    assert_eq!(changes, json!({ "time": 0.5, "changes": analog }));
}

#[test]
fn a_watcher_with_a_rate_is_told_no_more_often() {
    let mut lab = lab("[[module]]\nmodel = \"tmcm-6214\"");
    let mut snapshot = lab.snapshot(Subscription::Rate(20));
    assert_eq!(lab.next_look(&snapshot), None, "all is at rest");
    ask(&mut lab, 0, "ROR 0, 51200");
    let mut told = 0;
    while let Some(next) = lab.next_look(&snapshot).filter(|next| *next <= at(1000)) {
        lab.advance_to(next);
        if let Some(line) = lab.changes_since(&mut snapshot) {
            checked(&line);
            told += 1;
        }
    }
    // Every 50 ms for a second.
    assert_eq!(told, 20);
}

#[test]
fn without_its_supply_a_module_does_nothing() {
    let mut lab = lab("[[module]]\nmodel = \"tmcm-6214\"");
    ask(&mut lab, 0, "SIO 2, 2, 1");
    ask(&mut lab, 0, "ROR 0, 51200");
    lab.line("power off");
    let off = lab.line("state").json;
    assert_eq!(lab.next_event(), None);
    lab.advance_to(at(5000));
    let state = answer(&mut lab, "state");
    let module = &state["state"]["modules"]["tmcm-6214"];
    assert_eq!((&module["powered"], &module["outputs"]["2"]), (&json!(false), &json!(false)));
    assert_eq!(module["axes"]["0"]["moving"], json!(false));
    assert!(off.contains("\"powered\":false"));
    lab.line("power on");
    assert_eq!(ask(&mut lab, 0, "GIO 2, 2"), 0);
    assert_eq!(ask(&mut lab, 0, "GAP 3, 0"), 0);
}
