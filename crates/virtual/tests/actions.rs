//! Actions: their text, and what they do to a module.

use opentmcl_virtual::{
    Action, AnalogLevel, Coil, CoilFault, LineFault, MemoryFlash, ModuleSetup, Options, Place,
    Push, Scenario, SwitchInput, VirtualModule,
};
use opentmcl_wire::{Duration, mnemonic};

fn module() -> VirtualModule {
    let text = "[module]\nmodel = \"tmcm-6214\"\n[[module.axis]]\naxis = 0\nmotor = \"nema17\"\n";
    let scenario = Scenario::parse("lab.toml", text).unwrap();
    VirtualModule::with_setup(&scenario.modules[0], MemoryFlash::new(), Options::default())
}

fn ask(module: &mut VirtualModule, command: &str) -> i32 {
    module.execute(mnemonic::parse(command).unwrap()).value
}

#[track_caller]
fn act(module: &mut VirtualModule, text: &str) {
    module.act(&text.parse().unwrap()).unwrap();
}

#[test]
fn the_text_of_every_action_is_read_as_the_action() {
    let switch = |switch, axis, held| Action::Switch { switch, axis, held };
    let analog = |input, level| Action::Analog { input, level };
    let coil = |coil, fault| Action::Coil { axis: 4, coil, fault };
    let position = |place| Action::Position { axis: 0, place };
    let driver = |axis| Action::DriverTemperature { axis, celsius: 120.0 };
    let load = |push| Action::Load { axis: 2, push };
    let hall = |line, fault| Action::Hall { axis: 0, line, fault };
    let faults = Action::Faults { port: "net".into(), spec: "drop 1%, seed 5".into() };
    for (text, action) in [
        ("press left axis 0", switch(SwitchInput::Left, 0, Some(true))),
        ("release right axis 5", switch(SwitchInput::Right, 5, Some(false))),
        ("free home axis 1", switch(SwitchInput::Home, 1, None)),
        ("load axis 2 0.3 Nm", load(Push::Torque(0.3))),
        ("load axis 2 -5 N", load(Push::Force(-5.0))),
        ("block axis 1", Action::Block { axis: 1, blocked: true }),
        ("unblock axis 1", Action::Block { axis: 1, blocked: false }),
        ("supply 18.5 V", Action::Supply(18.5)),
        ("temperature driver 120", driver(None)),
        ("temperature driver 120 axis 3", driver(Some(3))),
        ("temperature board -10.5", Action::BoardTemperature(-10.5)),
        ("power cycle", Action::PowerCycle),
        ("power off", Action::Power(false)),
        ("power on", Action::Power(true)),
        ("input 3 high", Action::Input { input: 3, high: true }),
        ("input 3 low", Action::Input { input: 3, high: false }),
        ("analog 0 2048", analog(0, AnalogLevel::Reading(2048))),
        ("analog 4 -2.5 V", analog(4, AnalogLevel::Volts(-2.5))),
        ("disconnect coil B axis 4", coil(Coil::B, Some(CoilFault::Open))),
        ("short coil A axis 4", coil(Coil::A, Some(CoilFault::ShortToGround))),
        ("connect coil B axis 4", coil(Coil::B, None)),
        ("set position axis 0 12.5 mm", position(Place::Millimetres(12.5))),
        ("set position axis 0 -90 deg", position(Place::Degrees(-90.0))),
        ("set position axis 0 1000 usteps", position(Place::Microsteps(1000.0))),
        ("temperature motor 80", Action::MotorTemperature { axis: None, celsius: 80.0 }),
        ("temperature motor 80 axis 0", Action::MotorTemperature { axis: Some(0), celsius: 80.0 }),
        ("temperature ambient 40", Action::AmbientTemperature(40.0)),
        ("disconnect hall A axis 0", hall(0, LineFault::StuckHigh)),
        ("short hall B axis 0", hall(1, LineFault::StuckLow)),
        ("connect hall C axis 0", hall(2, LineFault::None)),
        ("disconnect phase C axis 0", Action::Phase { axis: 0, phase: 2, open: true }),
        ("connect phase A axis 0", Action::Phase { axis: 0, phase: 0, open: false }),
        ("driver fault axis 0", Action::DriverFault { axis: 0, fault: true }),
        ("driver ok axis 0", Action::DriverFault { axis: 0, fault: false }),
        ("torque off input 1", Action::Torque { input: 1, allowed: false }),
        ("torque on input 1", Action::Torque { input: 1, allowed: true }),
        ("faults net drop 1%, seed 5", faults),
    ] {
        assert_eq!(text.parse(), Ok(action.clone()), "{text}");
        assert_eq!(action.to_string(), text);
    }
}

#[test]
fn units_and_blanks_can_be_written_in_other_ways() {
    for (text, same) in [
        ("  load   axis 2  30Ncm ", "load axis 2 0.3 Nm"),
        ("supply 18000 mV", "supply 18 V"),
        ("set position axis 0 0.25 turn", "set position axis 0 90 deg"),
        ("temperature driver 120°C", "temperature driver 120"),
        ("disconnect coil b axis 4", "disconnect coil B axis 4"),
    ] {
        assert_eq!(text.parse::<Action>(), same.parse::<Action>(), "{text}");
    }
}

#[test]
fn what_is_no_action_is_answered_with_what_would_be_right() {
    for (text, part) in [
        ("", "an action is missing"),
        ("pres left axis 0", "\"pres\" is no action; did you mean \"press\"? (actions begin with"),
        (
            "press lft axis 0",
            "\"lft\" is not \"left\", \"right\" or \"home\"; did you mean \"left\"?",
        ),
        ("press left 0", "write press left axis 0"),
        ("press left axis nine", "\"nine\" is not a number from 0 to 255"),
        ("load axis 2 0.3", "\"0.3\" has no unit; write a torque such as \"5 Nm\""),
        ("load axis 2", "write load axis 0 0.3 Nm"),
        ("supply 500 V", "not from 0 V to 100 V"),
        ("supply nan V", "does not begin with a number"),
        ("temperature driver 999", "not from -55 to 250"),
        ("temperature winding 5", "\"driver\", \"motor\", \"ambient\" or \"board\""),
        ("connect hal A axis 0", "did you mean \"hall\"?"),
        ("disconnect phase D axis 0", "\"A\", \"B\" or \"C\""),
        ("short phase A axis 0", "\"coil\" or \"hall\""),
        ("driver faulty axis 0", "did you mean \"fault\"?"),
        ("power of", "did you mean \"off\"?"),
        ("input 3 hi", "\"high\" or \"low\""),
        ("analog 0 4096", "a reading is a number from 0 to 4095"),
        ("faults net", "write faults PORT and what the line shall do"),
    ] {
        let error = text.parse::<Action>().unwrap_err().to_string();
        assert!(error.contains(part), "{text}: {error}");
    }
}

#[test]
fn the_pins_of_the_module_follow() {
    let mut module = module();
    act(&mut module, "input 3 high");
    assert_eq!(ask(&mut module, "GIO 3, 0"), 1);
    act(&mut module, "supply 18.26 V");
    // In 0.1 V.
    assert_eq!(ask(&mut module, "GIO 8, 1"), 183);
    act(&mut module, "supply 60 V");
    assert_eq!(ask(&mut module, "GIO 8, 1"), 500, "the catalogue's largest reading");
    act(&mut module, "temperature board 60");
    assert_eq!(ask(&mut module, "GIO 9, 1"), 60);
    act(&mut module, "torque off input 1");
    assert_eq!((ask(&mut module, "GIO 13, 0"), ask(&mut module, "GIO 14, 0")), (1, 0));
}

#[test]
fn a_voltage_is_read_in_the_range_that_is_selected() {
    let mut module = module();
    act(&mut module, "analog 4 5 V");
    // Of 4095: half of 0..10 V, a quarter of 0..20 V, three quarters of -10..10 V.
    for (range, reading) in [(0, 2048), (1, 1024), (2, 3071)] {
        ask(&mut module, &format!("SIO 4, 1, {range}"));
        assert_eq!(ask(&mut module, "GIO 4, 1"), reading, "range {range}");
    }
    act(&mut module, "analog 4 -20 V");
    assert_eq!(ask(&mut module, "GIO 4, 1"), 0);
    act(&mut module, "analog 4 1234");
    assert_eq!(ask(&mut module, "GIO 4, 1"), 1234);
}

#[test]
fn what_a_module_does_not_have_cannot_be_acted_upon() {
    let mut module = module();
    for (text, part) in [
        ("press left axis 6", "has no axis 6; its axes are 0 to 5"),
        ("block axis 1", "axis 1 has no machine"),
        ("load axis 0 5 N", "the stage of axis 0 turns; write a torque"),
        ("set position axis 0 5 mm", "the stage of axis 0 turns; write an angle"),
        ("analog 1 5", "no analog input 1; there are 0, 4"),
        ("torque off input 2", "no safe-torque-off input 2; they are 0 to 1"),
    ] {
        let error = module.act(&text.parse().unwrap()).unwrap_err().to_string();
        assert!(error.contains(part), "{text}: {error}");
    }
}

#[test]
fn a_power_cycle_by_action_is_one_by_hand() {
    let model = opentmcl_catalog::find("tmcm-6214").unwrap();
    let setup = ModuleSetup::new(model);
    let run = |cycle: fn(&mut VirtualModule)| {
        let mut module = VirtualModule::with_setup(&setup, MemoryFlash::new(), Options::default());
        ask(&mut module, "SAP 4, 0, 1000");
        ask(&mut module, "ROR 0, 5000");
        module.advance(Duration::from_millis(700));
        cycle(&mut module);
        module.advance(Duration::from_millis(700));
        (ask(&mut module, "GAP 1, 0"), ask(&mut module, "GAP 4, 0"), ask(&mut module, "GAP 3, 0"))
    };
    let by_hand = run(VirtualModule::power_cycle);
    assert_eq!(run(|module| act(module, "power cycle")), by_hand);
    // Stands at 0 with the factory's speed.
    assert_eq!(by_hand, (0, 51_200, 0));
}
