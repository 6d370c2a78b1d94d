//! Servo axes: what scenarios say of their machines, and what hands do to them.

use std::f64::consts::PI;

use opentmcl_plant::servo::{Machine, Motor};
use opentmcl_virtual::{Lab, MemoryFlash, Options, Scale, Scenario, StageUnit, VirtualModule};
use opentmcl_wire::{Duration, mnemonic};

#[track_caller]
fn scenario(model: &str, text: &str) -> Scenario {
    let text = format!("[[module]]\nmodel = \"{model}\"\n{text}");
    Scenario::parse("lab.toml", &text).unwrap_or_else(|wrong| panic!("{wrong}"))
}

/// The machine and its scale of a TMCM-1636, with these lines of the axis.
#[track_caller]
fn machine(axis: &str) -> (Machine, Scale) {
    let scenario = scenario("tmcm-1636", &format!("[[module.axis]]\naxis = 0\n{axis}"));
    let axis = &scenario.modules[0].axes[0];
    (axis.machine.as_ref().unwrap().servo().unwrap().machine.clone(), axis.scale)
}

fn module(model: &str, text: &str) -> VirtualModule {
    let setup = &scenario(model, text).modules[0];
    VirtualModule::with_setup(setup, MemoryFlash::new(), Options::default())
}

/// A motor whose halls are not inverted.
const MOTOR: &str = "[[module.axis]]\naxis = 0\nmotor = \"qbl4208-61-04-013\"\n";

#[track_caller]
fn ask(module: &mut VirtualModule, command: &str) -> i32 {
    let reply = module.execute(mnemonic::parse(command).unwrap());
    assert_eq!(reply.status.0, 100, "{command}");
    reply.value
}

#[track_caller]
fn act(module: &mut VirtualModule, text: &str) {
    module.act(&text.parse().unwrap()).unwrap();
}

#[track_caller]
fn near(got: f64, expected: f64) {
    assert!((got - expected).abs() <= expected.abs() * 1e-9, "{got} is not {expected}");
}

/// Halls, four pole pairs and gains for the usual motor.
const SETTINGS: [&str; 12] = [
    "SAP 10, 0, 4",
    "SAP 11, 0, 4000",
    "SAP 70, 0, 300",
    "SAP 71, 0, 600",
    "SAP 72, 0, 100",
    "SAP 73, 0, 100",
    "SAP 74, 0, 300",
    "SAP 43, 0, 2000",
    "SAP 44, 0, 10000",
    "SAP 92, 0, 1",
    "SAP 56, 0, 24",
    "SAP 15, 0, 2",
];

fn set_up(text: &str) -> VirtualModule {
    let mut module = module("tmcm-1636", text);
    for command in SETTINGS {
        ask(&mut module, command);
    }
    module.advance(Duration::from_millis(2));
    module
}

#[test]
fn a_motor_by_its_data_sheet_is_the_star_that_behaves_so() {
    let (machine, scale) = machine(
        "motor = { pole_pairs = 7, resistance = \"0.5 ohm\", inductance = \"0.8 mH\", \
         torque_constant = \"60 mNm/A\", inertia = \"100 g cm2\", rated_current = \"5 A\" }\n\
         transmission = { screw = \"5 mm\" }\nload = { mass = \"2 kg\" }\n\
         stage = { from = \"-10 mm\", to = \"90 mm\" }\nencoder = { counts = 2000, reversed = true }",
    );
    let Motor::Brushless(motor) = machine.motor else { panic!("it has no brushes") };
    // Half of what is between two terminals; 60 mNm/A of two phases are ψ = k / (√3 p).
    assert_eq!((motor.pole_pairs, motor.resistance, motor.inductance), (7, 0.25, 0.4e-3));
    near(motor.flux_linkage, 0.06 / (3.0f64.sqrt() * 7.0));
    near(motor.inertia, 1e-5);
    // 65536 fine steps for 5 mm.
    assert_eq!(scale.unit(), StageUnit::Millimetres);
    near(scale.to_fine(5.0), 65_536.0);
    near(machine.load.inertia, 2.0 * (0.005 / (2.0 * PI)) * (0.005 / (2.0 * PI)));
    near(machine.stage.highest.unwrap(), 18.0 * 65_536.0);
    let encoder = machine.encoder.unwrap();
    assert_eq!((encoder.counts, encoder.reversed), (2000.0, true));
    assert!(machine.halls.is_some() && machine.absolute.is_none() && machine.brake.is_none());
}

#[test]
fn sensors_brake_supply_and_surroundings_are_as_described() {
    let text = "supply = { voltage = \"48 V\", resistance = \"80 mohm\", capacitance = \"470 uF\", \
                chopper = false }\n[[module.axis]]\naxis = 0\nmotor = \"QBL4208-100-04-025\"\n\
                halls = { offset = \"-30 deg\", inverted = true }\n\
                absolute = { offset = \"90 deg\", reversed = true }\nbrake = { torque = \"0.4 Nm\" }\n\
                ambient = \"40 °C\"\nnoise = { counts = 3.5, seed = 9 }\n";
    let scenario = scenario("tmcm-1636", text);
    let servo = scenario.modules[0].axes[0].machine.as_ref().unwrap().servo().unwrap();
    let machine = &servo.machine;
    let (halls, absolute) = (machine.halls.unwrap(), machine.absolute.unwrap());
    assert_eq!((halls.offset, halls.inverted), (-30.0, true));
    assert_eq!((absolute.offset, absolute.reversed), (16_384.0, true));
    assert_eq!(machine.brake.unwrap().torque, 0.4);
    assert_eq!((machine.supply.voltage, machine.supply.resistance), (48.0, 0.08));
    assert!((machine.supply.capacitance - 470e-6).abs() < 1e-12);
    assert_eq!(machine.supply.chopper, f64::INFINITY);
    assert_eq!(machine.thermal.ambient, 40.0);
    assert_eq!((servo.noise.counts, servo.noise.seed), (3.5, 9));
    let Motor::Brushless(motor) = machine.motor else { panic!() };
    assert_eq!(motor.rated_current, 6.95);
    let mut module =
        VirtualModule::with_setup(&scenario.modules[0], MemoryFlash::new(), Options::default());
    // In 0.1 V, less what the module draws through 80 mΩ; in °C.
    assert_eq!(ask(&mut module, "GAP 220, 0"), 480);
    assert_eq!(ask(&mut module, "GAP 221, 0"), 40);
}

#[test]
fn mistakes_say_what_would_be_right() {
    let usual = "motor = \"qbl4208-61-04-013\"";
    for (model, lines, part) in [
        (
            "tmcm-1636",
            "motor = \"nema17\"",
            "is a stepper motor, and the TMCM-1636 drives servo motors (motors: qbl4208-61",
        ),
        (
            "tmcm-6214",
            usual,
            "is a brushless motor, and the TMCM-6214 drives stepper motors (motors: qsh4218",
        ),
        ("tmcm-1636", "motor = \"qbl4208-61-04-31\"", "did you mean \"qbl4208-61-04-013\"?"),
        (
            "tmcm-1636",
            "motor = { full_steps = 200 }",
            "this is a stepper motor; write pole_pairs, resistance",
        ),
        ("tmcm-6110", "motor = { pole_pairs = 4 }", "this is none; write full_steps"),
        (
            "tmcm-1636",
            "motor = { pole_pairs = 4 }",
            "needs the key \"torque_constant\", for example torque_constant = \"36 mNm/A\"",
        ),
        ("tmcm-1636", "motor = { kind = \"brusched\" }", "did you mean \"brushed\"?"),
        ("tmcm-1636", &format!("{usual}\nhals = true"), "did you mean \"halls\"?"),
        ("tmcm-6214", "motor = \"nema17\"\nhalls = true", "an axis has no key \"halls\""),
        (
            "tmcm-1613",
            &format!("{usual}\nencoder = {{ counts = 4000 }}"),
            "the TMCM-1613 has no encoder inputs",
        ),
        (
            "tmcm-1613",
            &format!("{usual}\nbrake = {{ torque = \"1 Nm\" }}"),
            "the TMCM-1613 has no output for a holding brake",
        ),
        (
            "tmcm-1613",
            &format!("{usual}\nleft = {{ at = \"0 deg\", width = \"5 deg\" }}"),
            "the TMCM-1613 has no inputs for limit switches",
        ),
        (
            "tmcm-1613",
            "motor = { kind = \"brushed\", resistance = \"1 ohm\", inductance = \"1 mH\", torque_constant = \"30 mNm/A\", inertia = \"50 g cm2\" }",
            "no control for motors with brushes",
        ),
        ("tmcm-1636", &format!("{usual}\nnoise = {{ seed = 4 }}"), "needs the key \"counts\""),
        ("tmcm-1636", &format!("{usual}\nambient = \"400 °C\""), "from -55 °C to 125 °C"),
        ("tmcm-1636", &format!("{usual}\nhalls = {{ offset = \"30 V\" }}"), "write an angle"),
    ] {
        let text = format!("[[module]]\nmodel = \"{model}\"\n[[module.axis]]\naxis = 0\n{lines}\n");
        let wrong = Scenario::parse("lab.toml", &text).expect_err(lines).to_string();
        assert!(wrong.contains(part), "{lines}: {wrong}");
    }
    let text = "[[module]]\nmodel = \"tmcm-6214\"\nsupply = { voltage = \"24 V\" }\n";
    let wrong = Scenario::parse("lab.toml", text).unwrap_err().to_string();
    assert!(wrong.starts_with("lab.toml:3:10: the supply of a TMCM-6214 is ideal"), "{wrong}");
}

#[test]
fn what_a_servo_module_does_not_have_cannot_be_acted_upon() {
    let brushed = "[[module.axis]]\naxis = 0\nmotor = { kind = \"brushed\", resistance = \"1 ohm\", \
                   inductance = \"1 mH\", torque_constant = \"30 mNm/A\", inertia = \"50 g cm2\" }";
    let (foc, block) = (("tmcm-1636", ""), ("tmcm-1613", ""));
    let (brushed, stepper) = (("tmcm-1636", brushed), ("tmcm-6214", ""));
    for (setup, text, part) in [
        (
            foc,
            "disconnect coil A axis 0",
            "which has phases; write for example disconnect phase A axis 0",
        ),
        (foc, "set position axis 0 100 usteps", "has no microsteps; write an angle"),
        (foc, "temperature board 60", "write temperature driver 60"),
        (foc, "torque off input 0", "the TMCM-1636 has no safe-torque-off inputs"),
        (foc, "block axis 1", "has no axis 1"),
        (block, "press left axis 0", "the TMCM-1613 has no inputs for switches"),
        (brushed, "disconnect hall A axis 0", "the motor of axis 0 has no halls"),
        (brushed, "disconnect phase C axis 0", "its wires are A and B"),
        (stepper, "disconnect hall A axis 0", "drives a stepper motor; this is for servo motors"),
        (stepper, "driver fault axis 0", "drives a stepper motor"),
        (stepper, "temperature ambient 40", "drives a stepper motor"),
    ] {
        let mut module = module(setup.0, setup.1);
        let error = module.act(&text.parse().unwrap()).unwrap_err().to_string();
        assert!(error.contains(part), "{text}: {error}");
    }
}

#[test]
fn hands_reach_the_machine_of_a_servo_axis() {
    let mut module = set_up(MOTOR);
    // Bits 0 to 2 of parameter 94 are the hall lines.
    let halls = ask(&mut module, "GAP 94, 0");
    assert_eq!(halls, 0b101, "the rotor stands at 0");
    act(&mut module, "short hall A axis 0");
    module.advance(Duration::from_millis(1));
    assert_eq!(ask(&mut module, "GAP 94, 0"), 0b100);
    act(&mut module, "disconnect hall B axis 0");
    act(&mut module, "connect hall A axis 0");
    module.advance(Duration::from_millis(1));
    assert_eq!(ask(&mut module, "GAP 94, 0"), 0b111);
    act(&mut module, "connect hall B axis 0");
    act(&mut module, "set position axis 0 90 deg");
    near(module.stage(0).unwrap(), 16_384.0);
    act(&mut module, "supply 30 V");
    act(&mut module, "temperature driver 60");
    act(&mut module, "temperature motor 80");
    module.advance(Duration::from_millis(50));
    assert_eq!((ask(&mut module, "GAP 220, 0"), ask(&mut module, "GAP 221, 0")), (300, 60));
    let view = module.servo_view(0).unwrap();
    assert!((view.winding_temperature - 80.0).abs() < 0.1, "{view:?}");
    act(&mut module, "load axis 0 0.1 Nm");
    module.advance(Duration::from_millis(100));
    assert!(module.servo_view(0).unwrap().speed > 100.0, "nothing holds it");
    act(&mut module, "block axis 0");
    assert_eq!(module.servo_view(0).unwrap().speed, 0.0);
}

#[test]
fn a_held_switch_is_told_to_the_firmware_although_the_axis_sleeps() {
    let mut module = set_up(MOTOR);
    module.advance(Duration::from_secs(3600));
    let (left, right) = ("GAP 212, 0", "GAP 211, 0");
    let before = (ask(&mut module, left), ask(&mut module, right));
    act(&mut module, "press left axis 0");
    let pressed = (ask(&mut module, left), ask(&mut module, right));
    act(&mut module, "free left axis 0");
    act(&mut module, "press right axis 0");
    let other = (ask(&mut module, left), ask(&mut module, right));
    assert_eq!((before, pressed, other), ((0, 0), (1, 0), (0, 1)));
}

#[test]
fn a_driver_that_reports_a_fault_lets_the_motor_go() {
    let mut module = set_up(MOTOR);
    ask(&mut module, "ROR 0, 1000");
    module.advance(Duration::from_millis(500));
    assert!(module.servo_view(0).unwrap().amplitude > 0.0);
    act(&mut module, "driver fault axis 0");
    module.advance(Duration::from_millis(20));
    assert_eq!(module.servo_view(0).unwrap().amplitude, 0.0);
    let flags = module.servo_state(0).unwrap().status_flags;
    assert_eq!(flags >> 6 & 1, 1, "driver error");
    assert_eq!(module.servo_state(0).unwrap().status_flags, flags, "looking clears nothing");
    assert_eq!(ask(&mut module, "GAP 156, 0") as u32, flags);
    act(&mut module, "driver ok axis 0");
    module.advance(Duration::from_millis(2));
    ask(&mut module, "GAP 156, 0");
    assert_eq!(module.servo_state(0).unwrap().status_flags >> 6 & 1, 0, "GAP has cleared it");
}

#[test]
fn a_phase_whose_wire_is_off_carries_no_current() {
    let largest = |text: &str| {
        let mut module = module("tmcm-1613", text);
        ask(&mut module, "ROR 0, 500");
        let mut largest = [0.0f64; 3];
        for _ in 0..1000 {
            module.advance(Duration::from_millis(1));
            let currents = module.servo_view(0).unwrap().currents;
            for (largest, current) in largest.iter_mut().zip(currents) {
                *largest = largest.max(current.abs());
            }
        }
        largest
    };
    let [a, b, c] = largest("");
    assert!(a.min(b).min(c) > 0.1, "{a} {b} {c}");
    // Block commutation begins with B and C.
    let [a, b, c] = largest("start = [\"disconnect phase A axis 0\"]");
    assert!(a == 0.0 && b > 0.1 && (b - c).abs() < 1e-9, "{a} {b} {c}");
}

#[test]
fn a_schedule_acts_upon_a_servo_axis() {
    let text = "[[module.at]]\ntime = \"20 ms\"\ndo = [\"supply 20 V\", \"short hall C axis 0\"]\n";
    let mut module = module("tmcm-1636", &format!("{text}{MOTOR}"));
    module.advance(Duration::from_millis(19));
    assert_eq!(ask(&mut module, "GAP 220, 0"), 240);
    module.advance(Duration::from_secs(1));
    assert_eq!((ask(&mut module, "GAP 220, 0"), ask(&mut module, "GAP 94, 0")), (200, 0b001));
}

#[test]
fn a_lab_shows_a_servo_axis_as_its_schema_says() {
    let mut lab = Lab::new(scenario("tmcm-1636", ""));
    for line in ["driver fault axis 0", "short hall B axis 0", "press home axis 0"] {
        assert_eq!(lab.line(line).json, r#"{"ok":true}"#);
    }
    let state: serde_json::Value = serde_json::from_str(&lab.line("state").json).unwrap();
    let axis = &state["state"]["modules"]["tmcm-1636"]["axes"]["0"];
    assert_eq!(axis["bus"], 24.0);
    assert_eq!((&axis["driver_fault"], &axis["halls"]["b"]), (&true.into(), &"shorted".into()));
    assert_eq!(
        (&axis["held"]["home"], &axis["switches"]["home"]),
        (&"pressed".into(), &true.into())
    );
    assert_eq!(axis["temperatures"]["driver"], 25.0);
    assert_eq!(axis["flags"]["stop_mode"], true);
    assert!(axis.get("load_angle").is_none() && axis.get("coils").is_none());
}

#[test]
fn a_module_does_not_start_with_an_error_of_its_halls() {
    for model in ["tmcm-1613", "tmcm-1636"] {
        let mut module = module(model, "");
        assert_eq!(ask(&mut module, "GAP 156, 0") >> 5 & 1, 0, "{model}");
    }
}

/// Everything that is to be seen after a motion with this noise, looked at so many times on the way.
fn noisy(noise: &str, looks: u64) -> String {
    let axis = "[[module.axis]]\naxis = 0\nmotor = \"qbl4208-61-04-013\"\n";
    let mut module = set_up(&format!("{axis}noise = {noise}\n"));
    ask(&mut module, "ROR 0, 800");
    let start = module.now();
    for look in 1..=looks {
        module.advance_to(start + Duration::from_ticks(16_000_000 * look / looks));
        module.view(0);
        module.servo_view(0);
        module.servo_state(0);
        module.stage(0);
    }
    act(&mut module, "load axis 0 -20 mNm");
    module.advance(Duration::from_millis(100));
    format!("{:?} {:?}", module.servo_view(0), module.servo_state(0))
}

#[test]
fn noise_follows_from_its_seed_and_looking_at_it_changes_nothing() {
    let once = noisy("{ counts = 4, seed = 1 }", 1);
    assert_eq!(noisy("{ counts = 4, seed = 1 }", 777), once);
    assert_ne!(noisy("{ counts = 4, seed = 2 }", 1), once);
    assert_eq!(noisy("{ counts = 0 }", 777), noisy("{ counts = 0, seed = 5 }", 1));
}
