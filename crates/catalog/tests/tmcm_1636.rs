//! The tables of the TMCM-1636, against what the vendor's documents and software say of it.

use opentmcl_catalog::{
    AxisBehaviour, AxisParameter, Certainty, Foc, GlobalBehaviour, MODULES, Mode, Motion,
    PortBehaviour, Servo, Source, TMCM_1613, TMCM_1636, Unit, find,
};

fn axis_parameter(number: u8) -> &'static AxisParameter {
    TMCM_1636.axis_parameter(number).expect("a parameter of the module")
}

#[test]
fn it_is_a_servo_module_with_field_oriented_control() {
    let module = find("tmcm-1636").unwrap();
    assert_eq!((module.number, module.version, module.firmware), (1636, *b"1636V109", (1, 9)));
    assert_eq!((module.axes, module.motion), (1, Motion::Foc));
    // 60 A RMS, to the next 1000 mA.
    let peak = (60_000.0 * 2_f64.sqrt() / 1000.0).round() * 1000.0;
    assert_eq!(f64::from(module.peak_current_ma), peak);
    assert!(module.interrupts.is_empty());
    assert!(MODULES.iter().map(|module| module.number).eq([1613, 1636, 6110, 6214]));
}

/// The numbers of the vendor's maps of this module, less 7, which later firmware does not have.
#[test]
fn it_has_the_axis_parameters_that_todays_clients_read() {
    let numbers = [0..=6, 10..=21, 25..=27, 30..=33, 40..=47, 50..=57, 70..=81, 90..=94]
        .into_iter()
        .chain([100..=111, 120..=125, 140..=142, 144..=144, 153..=154, 156..=156, 160..=163])
        .chain([165..=167, 209..=213, 220..=221, 230..=232, 240..=249, 255..=255])
        .flatten();
    assert!(numbers.eq(TMCM_1636.axis_parameters.iter().map(|row| row.number)));
    for row in TMCM_1636.axis_parameters {
        let room = match row.behaviour {
            AxisBehaviour::Servo(_) => "servo",
            AxisBehaviour::Foc(_) => "foc",
            AxisBehaviour::Stored(_) => "none",
            _ => "another",
        };
        let wanted = match row.number {
            110 | 165..=167 => "none",
            11 | 30 | 31 | 40..=45 | 47 | 50 | 52..=54 | 70..=75 | 77 | 78 | 80 | 81 => "servo",
            90 | 156 | 220 | 221 => "servo",
            _ => "foc",
        };
        assert_eq!(room, wanted, "{}", row.id);
    }
}

#[test]
fn both_servo_modules_have_every_effect_of_the_room_that_they_share() {
    let effects = |module: &'static opentmcl_catalog::Module| {
        module.axis_parameters.iter().filter_map(|row| match row.behaviour {
            AxisBehaviour::Servo(effect) => Some(effect),
            _ => None,
        })
    };
    assert_eq!(effects(&TMCM_1613).count(), 28);
    assert_eq!(effects(&TMCM_1636).count(), 28);
    for effect in effects(&TMCM_1613) {
        assert!(effects(&TMCM_1636).any(|other| other == effect), "{effect:?}");
    }
}

#[test]
fn only_the_frame_of_the_absolute_encoder_belongs_to_later_firmware() {
    let later = TMCM_1636.axis_parameters.iter().filter(|row| !TMCM_1636.has(row.since));
    assert!([165, 166, 167].into_iter().eq(later.map(|row| row.number)));
    assert_eq!(axis_parameter(165).since, Some((1, 12)));
    assert!(TMCM_1636.global_parameters.iter().all(|row| TMCM_1636.has(row.since)));
    assert!(TMCM_1636.commands.iter().all(|row| TMCM_1636.has(row.since)));
}

/// Numbers in force from the map before this firmware to that of today; those of the manual's example
/// are on no list.
#[test]
fn commutation_and_the_clearing_of_the_position_are_numbered_as_clients_know_them() {
    let modes = axis_parameter(15).values.iter().map(|(mode, _)| *mode);
    assert!((0..=4).eq(modes));
    let mode = |mode| axis_parameter(15).values.iter().find(|(value, _)| *value == mode);
    assert!(mode(2).unwrap().1.contains("hall"));
    assert!(mode(3).unwrap().1.contains("incremental encoder"));
    assert_eq!(axis_parameter(107).behaviour, AxisBehaviour::Foc(Foc::ClearOnNull));
    assert_eq!(axis_parameter(108).behaviour, AxisBehaviour::Foc(Foc::ClearOnce));
    assert!(TMCM_1636.axis_parameter(67).is_none() && TMCM_1636.axis_parameter(68).is_none());
}

#[test]
fn ranges_and_defaults_are_those_of_the_vendors_tables() {
    let row = |number| {
        let row = axis_parameter(number);
        (row.min, row.max, row.default)
    };
    for (number, wanted) in [
        (10, (1, 255, 4)),
        (11, (0, 60_000, 4000)),
        (12, (0, 60_000, 2000)),
        (15, (0, 4, 0)),
        (30, (-60_000, 60_000, 0)),
        (40, (-200_000, 200_000, 0)),
        (43, (0, 200_000, 4000)),
        (44, (0, 100_000, 2000)),
        (56, (6, i32::MAX, 65_536)),
        (70, (0, 32_767, 500)),
        (71, (0, 32_767, 500)),
        (72, (0, 32_767, 100)),
        (73, (0, 32_767, 100)),
        (74, (0, 32_767, 50)),
        (93, (-32_768, 32_767, 0)),
        (100, (0, 16_777_215, 4096)),
        (110, (25_000, 100_000, 25_000)),
        (141, (50, 1000, 1000)),
        (142, (0, 50, 0)),
    ] {
        assert_eq!(row(number), wanted, "{number}");
    }
    for (number, default) in [(45, 1), (53, 50), (54, 500), (104, 1000), (105, 200)] {
        let row = axis_parameter(number);
        assert_eq!((row.default, row.default_source), (default, Source::OpenFirmware), "{number}");
    }
}

#[test]
fn settings_can_be_stored_and_targets_readings_and_switches_of_the_moment_cannot() {
    let store = |numbers: &[u8], wanted: bool| {
        for number in numbers {
            assert_eq!(axis_parameter(*number).access.store, wanted, "{number}");
        }
    };
    store(&[5, 6, 10, 15, 43, 56, 70, 93, 100, 106, 121, 124, 141, 163, 209, 210], true);
    store(&[30, 32, 40, 50, 52, 107, 108, 120, 153, 154, 240, 249, 255], false);
    let read_only = [0..=4, 16..=21, 31..=31, 33..=33, 41..=42, 51..=51, 55..=55, 75..=81, 94..=94]
        .into_iter()
        .chain([103..=103, 109..=109, 111..=111, 144..=144, 156..=156, 211..=213])
        .chain([220..=221, 230..=232])
        .flatten();
    let rows = TMCM_1636.axis_parameters.iter().filter(|row| !row.access.write);
    assert!(read_only.eq(rows.map(|row| row.number)));
    assert!(TMCM_1636.axis_parameters.iter().all(|row| row.access.read));
}

#[test]
fn its_target_speed_is_parameter_40() {
    let row = TMCM_1636.target_speed().unwrap();
    assert_eq!((row.number, row.unit), (40, Unit::Other("rpm")));
    assert_eq!(row.behaviour, AxisBehaviour::Servo(Servo::TargetVelocity));
}

#[test]
fn its_debug_values_are_one_effect_in_the_order_of_their_numbers() {
    let debug = AxisBehaviour::Foc(Foc::DebugValue);
    let rows = TMCM_1636.axis_parameters.iter().filter(|row| row.behaviour == debug);
    assert!((240..=249).eq(rows.map(|row| row.number)));
}

#[test]
fn it_has_global_parameters_for_can_and_none_for_interrupts() {
    let rows = |bank| TMCM_1636.global_parameters.iter().filter(move |row| row.bank == bank);
    let numbers = [64..=66, 69..=71, 75..=77, 83..=83, 85..=85, 128..=128, 130..=130, 132..=132];
    assert!(numbers.into_iter().flatten().eq(rows(0).map(|row| row.number)));
    assert!([(0, 55, true), (56, 255, false)].into_iter().eq(rows(2).map(|row| {
        let stored = row.access.store;
        (row.number, row.last, stored)
    })));
    assert_eq!(rows(3).count(), 0);
    for row in rows(0) {
        assert_eq!(row.access.automatic, (64..128).contains(&row.number), "{}", row.id);
        let stored = matches!(row.behaviour, GlobalBehaviour::Stored(_));
        assert_eq!(stored, [65, 69, 70, 71, 83].contains(&row.number), "{}", row.id);
    }
    let default = |number| TMCM_1636.global_parameter(0, number).unwrap().default;
    for (number, value) in [(64, 0x64), (65, 7), (66, 1), (69, 8), (70, 2), (71, 1), (76, 2)] {
        assert_eq!(default(number), value, "{number}");
    }
}

#[test]
fn its_inputs_are_pulled_up() {
    for number in 0..4 {
        let port = TMCM_1636.input_port(0, number).unwrap();
        assert_eq!((port.behaviour, port.default), (PortBehaviour::DigitalInput, 1), "{number}");
    }
    let analog = TMCM_1636.ports.iter().filter(|row| row.bank == 1);
    assert!(analog.map(|row| (row.number, row.behaviour)).eq([
        (0, PortBehaviour::AnalogInput),
        (1, PortBehaviour::AnalogInput),
        (2, PortBehaviour::SupplyReading),
        (3, PortBehaviour::TemperatureReading),
    ]));
    let outputs = TMCM_1636.ports.iter().filter(|row| row.bank == 2 && row.access.write);
    assert_eq!(outputs.count(), 2);
    assert_eq!(TMCM_1636.ports.len(), 4 + 4 + 2);
}

/// Table 4 of the manual, its section on user functions, and the control commands of the family.
#[test]
fn it_has_the_commands_of_the_manuals_list() {
    let numbers =
        [1..=12, 14..=15, 19..=24, 27..=28, 33..=36, 64..=71, 128..=137, 255..=255].into_iter();
    assert!(numbers.flatten().eq(TMCM_1636.commands.iter().map(|row| row.number)));
    for row in TMCM_1636.commands {
        let mode = match row.number {
            21..=24 | 27 | 28 => Mode::Standalone,
            128.. => Mode::Direct,
            _ => Mode::Both,
        };
        assert_eq!(row.mode, mode, "{}", row.mnemonic);
        assert_eq!(row.unavailable.is_some(), (64..=71).contains(&row.number), "{}", row.mnemonic);
        assert_eq!(row.certainty == Certainty::Exact, row.number < 128, "{}", row.mnemonic);
    }
}

#[test]
fn no_parameter_is_exact_as_the_manuals_tables_are_not_public() {
    let axis = TMCM_1636.axis_parameters.iter().map(|row| (row.certainty, row.source));
    let global = TMCM_1636.global_parameters.iter().map(|row| (row.certainty, row.source));
    let ports = TMCM_1636.ports.iter().map(|row| (row.certainty, row.source));
    for (certainty, source) in axis.chain(global).chain(ports) {
        assert!(certainty != Certainty::Exact && source.is_some());
    }
}
