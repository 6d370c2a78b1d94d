//! Scenarios: what is read from them, and what is said of mistakes.

use std::f64::consts::PI;

use opentmcl_virtual::{Action, AnalogLevel, PortKind, Scenario, StageUnit};

#[track_caller]
fn machine(axis: &str) -> (opentmcl_plant::machine::Machine, opentmcl_virtual::Scale) {
    let text = format!("[[module]]\nmodel = \"tmcm-6214\"\n[[module.axis]]\naxis = 3\n{axis}");
    let scenario = Scenario::parse("lab.toml", &text).unwrap_or_else(|wrong| panic!("{wrong}"));
    let axis = scenario.modules[0].axes[3].clone();
    (axis.machine.unwrap().stepper().unwrap().clone(), axis.scale)
}

#[track_caller]
fn near(got: f64, expected: f64) {
    assert!((got - expected).abs() <= expected.abs() * 1e-12, "{got} is not {expected}");
}

#[track_caller]
fn mistakes(text: &str) -> Vec<String> {
    let mistakes = Scenario::parse("lab.toml", text).expect_err("it is read");
    mistakes.0.iter().map(ToString::to_string).collect()
}

/// A screw of 5 mm for each turn: 10240 fine steps for a millimetre, 5 mm / 2π for a radian.
const SCREW: &str = "motor = \"qsh4218-51-10-049\"\ntransmission = { screw = \"5 mm\" }\n";
const LEVER: f64 = 0.005 / (2.0 * PI);

#[test]
fn a_load_on_a_screw_is_what_the_shaft_feels() {
    let (machine, scale) = machine(&format!(
        "{SCREW}backlash = \"0.02 mm\"\nload = {{ mass = \"2.4 kg\", friction = \"3 N\", \
         viscous = \"20 N s/m\", gravity = \"negative\", force = \"1 N\", inertia = \"10 g cm2\", \
         springs = [{{ rate = \"2 N/mm\", rest = \"10 mm\" }}], \
         along = [[\"0 mm\", \"0 N\"], [\"100 mm\", \"-5 N\"]] }}"
    ));
    assert_eq!(scale.unit(), StageUnit::Millimetres);
    // J = m (lead/2π)², and the coupling's own.
    near(machine.load.inertia, 2.4 * LEVER * LEVER + 10e-7);
    near(machine.load.friction, 3.0 * LEVER);
    near(machine.load.viscous, 20.0 * LEVER * LEVER);
    // The weight pulls down with m g, 1 N pushes up.
    near(machine.load.constant, (1.0 - 2.4 * 9.80665) * LEVER);
    let [spring] = machine.load.springs[..] else { panic!("one spring") };
    near(spring.rest, 102_400.0);
    // 2000 N/m for a way of 5 mm / 51200.
    near(spring.rate, 2000.0 * 0.005 / 51_200.0 * LEVER);
    near(machine.load.along[1].0, 1_024_000.0);
    near(machine.load.along[1].1, -5.0 * LEVER);
    near(machine.stage.backlash, 204.8);
    // 1 A, 5 ohm, 8 mH: the manual of this motor.
    assert_eq!((machine.motor.rated_current, machine.motor.resistance), (1.0, 5.0));
}

#[test]
fn a_load_behind_a_gear_is_what_the_shaft_feels() {
    let (machine, scale) = machine(
        "motor = { full_steps = 400, resistance = \"2 ohm\", inductance = \"3 mH\", \
         holding_torque = \"50 Ncm\", rated_current = \"1.2 A\", inertia = \"57 g cm²\" }\n\
         transmission = { gear = 10 }\nload = { inertia = \"0.01 kg m2\", torque = \"0.5 Nm\" }\n\
         stage = { circular = true, start = \"90 deg\" }",
    );
    assert_eq!(scale.unit(), StageUnit::Degrees);
    assert_eq!(machine.motor.full_steps, 400);
    near(machine.motor.inertia, 57e-7);
    near(machine.load.inertia, 0.01 / 100.0);
    near(machine.load.constant, 0.05);
    // 400 · 256 · 10 for a turn.
    assert_eq!(machine.stage.circle, Some(1_024_000.0));
    near(machine.stage.start, 256_000.0);
}

#[test]
fn switches_lie_where_a_stage_reaches_them() {
    let (machine, _) = machine(&format!(
        "{SCREW}stage = {{ from = \"-10 mm\", to = \"210 mm\", start = \"50 mm\" }}\n\
         left = {{ at = \"0 mm\", hysteresis = \"0.1 mm\" }}\n\
         right = {{ at = \"200 mm\", width = \"5 mm\", contact = \"normally closed\" }}\n\
         home = {{ at = \"100 mm\", width = \"4 mm\", bounce = \"2 ms\" }}\n\
         encoder = {{ counts = 4000, index = \"1 mm\", reversed = true, on = \"stage\" }}"
    ));
    let zones = machine.switches;
    let (left, right, home) = (zones.left.unwrap(), zones.right.unwrap(), zones.home.unwrap());
    assert_eq!((left.from, left.to), (f64::NEG_INFINITY, 0.0));
    near(left.hysteresis, 1024.0);
    assert_eq!((right.from, right.to), (2_048_000.0, 2_099_200.0));
    assert!(right.normally_closed && !left.normally_closed);
    assert_eq!((home.from, home.to), (1_003_520.0, 1_044_480.0));
    // 2 ms of 16 MHz.
    assert_eq!(home.bounce, 32_000);
    assert_eq!(machine.stage.lowest, Some(-102_400.0));
    let encoder = machine.encoder.unwrap();
    assert_eq!((encoder.counts, encoder.index), (4000.0, 10_240.0));
    assert!(encoder.reversed && encoder.on_stage);
}

#[test]
fn what_is_around_a_module_is_read() {
    let text = "[module]\nmodel = \"TMCM-6214\"\nsupply = \"18 V\"\neeprom = \"xy.bin\"\n\
                start = [\"analog 0 2.5 V\"]\n\
                [[module.port]]\npty = true\n[[module.port]]\nname = \"net\"\ntcp = \"4016\"\n";
    let scenario = Scenario::parse("lab.toml", text).unwrap();
    let module = &scenario.modules[0];
    assert_eq!(module.name, "tmcm-6214");
    let analog = Action::Analog { input: 0, level: AnalogLevel::Volts(2.5) };
    assert_eq!(module.start, [Action::Supply(18.0), analog]);
    assert_eq!(module.eeprom.as_deref(), Some("xy.bin".as_ref()));
    assert_eq!((&*module.ports[0].name, &module.ports[0].kind), ("pty", &PortKind::Pty(None)));
    assert_eq!((&*module.ports[1].name, module.ports[1].line), ("net", 8));
    assert!(module.axes.iter().all(|axis| axis.machine.is_none()));
}

#[test]
fn every_mistake_of_a_file_is_told_with_its_place() {
    let text = r#"[[module]]
model = "tmcm-6214"
suply = "24 V"
start = ["input 9 high", 3]
[[module.axis]]
axis = 6
motor = "qsh4218-51-10-094"
transmission = { screw = "5 kg" }
[[module.axis]]
axis = 0
transmission = { screw = "5 mm" }
load = { mass = 2.4, torque = "1 Nm", gravity = "down" }
stage = { from = "10 mm", to = "5 mm" }
home = { at = "5 mm" }
encoder = { counts = 4000 }
[[module.at]]
do = "block axs 0"
[[module.wave]]
shape = "sine"
low = "input 1 low"
high = "input 1 high"
period = "1 s"
"#;
    let expected = [
        "3:1: a module has no key \"suply\"; did you mean \"supply\"?",
        "4:10: the TMCM-6214 has no digital input 9",
        "4:26: this is a text between quotation marks",
        "6:8: this is a whole number from 0 to 5",
        "7:9: there is no motor \"qsh4218-51-10-094\"; did you mean \"qsh4218-51-10-049\"?",
        "8:26: \"5 kg\" has another unit; write a length such as \"5 mm\"",
        "9:1: an axis needs the key \"motor\", for example motor = \"qsh4218-51-10-049\"",
        "12:17: a value with its unit is a text: a mass such as \"5 kg\"",
        "12:31: this stage moves along a line; write force instead",
        "12:49: \"down\" is none of negative, positive",
        "13:32: the way must end after it begins",
        "14:8: a home switch needs the key \"width\"",
        "15:11: axis 0 of the TMCM-6214 has no encoder input; axes 3, 4, 5 have one",
        "16:1: an entry of the plan needs the key \"time\"",
        "17:6: \"axs\" is not \"axis\"; did you mean \"axis\"?",
        "21:8: there is nothing between \"input 1 low\" and \"input 1 high\"",
    ];
    let found = mistakes(text);
    for (found, expected) in found.iter().zip(expected) {
        assert!(found.starts_with(&format!("lab.toml:{expected}")), "{found}\nnot {expected}");
    }
    assert_eq!(found.len(), expected.len(), "{found:#?}");
}

#[test]
fn what_is_no_toml_is_told_with_its_place() {
    let found = mistakes("[[module]]\nmodel = \"tmcm-6214\nsupply = \"24 V\"\n");
    assert!(found[0].starts_with("lab.toml:2:"), "{found:#?}");
    assert!(found.iter().all(|mistake| !mistake.contains('\n')));
}

#[test]
fn a_scenario_without_a_module_is_none() {
    assert!(mistakes("")[0].starts_with("lab.toml:1:1: a scenario needs the key \"module\""));
    assert!(mistakes("module = []")[0].contains("at least one module"));
    let twice = "[[module]]\nmodel = \"tmcm-6214\"\n[[module]]\nmodel = \"tmcm-6214\"\n";
    assert!(mistakes(twice)[0].starts_with("lab.toml:3:1: a second module has the name"));
    assert!(mistakes("[[module]]\nmodel = \"tmcm-6241\"")[0].contains("did you mean"));
}

#[test]
fn what_would_make_no_sense_is_refused() {
    let axis = |lines: &str| {
        mistakes(&format!("[module]\nmodel = \"tmcm-6214\"\n[[module.axis]]\naxis = 0\n{lines}"))
    };
    for (lines, part) in [
        ("motor = \"nema17\"\ntransmission = { gear = 0 }", "a number from 0.001 to 10000"),
        ("motor = \"nema17\"\ntransmission = { belt = \"40 mm\", screw = \"5 mm\" }", "not both"),
        ("motor = \"nema17\"\nleft = { at = \"5 mm\" }", "write an angle such as"),
        ("motor = \"nema17\"\nload = { mass = \"1 kg\" }", "write inertia"),
        ("motor = \"nema17\"\nload = { gravity = \"negative\" }", "gravity pulls a mass"),
        ("motor = \"nema17\"\nload = { friction = \"-1 Nm\" }", "0 or more"),
        ("motor = \"nema17\"\nstage = { to = \"99999999 turns\" }", "farther than a position"),
        ("motor = \"nema17\"\nstage = { circular = true, to = \"5 deg\" }", "has no ends"),
        ("motor = \"nema17\"\nstage = { from = \"5 deg\" }", "must start between"),
        ("motor = \"nema17\"\nleft = { at = \"5 deg\" }\nstage = { circular = true }", "width"),
        ("motor = { resistance = \"0 ohm\" }", "more than 0"),
        ("motor = 5", "a table with the keys"),
    ] {
        let found = axis(lines);
        assert!(found.iter().any(|mistake| mistake.contains(part)), "{lines}: {found:#?}");
    }
}
