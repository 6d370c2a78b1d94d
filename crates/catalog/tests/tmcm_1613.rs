//! The tables of the TMCM-1613, against its firmware manual, V1.00.

use opentmcl_catalog::{
    Access, AxisBehaviour, AxisParameter, Block, Certainty, GlobalBehaviour, Mode, Motion,
    PortBehaviour, Servo, Source, TMCM_1613, Unit, find,
};

fn axis_parameter(number: u8) -> &'static AxisParameter {
    TMCM_1613.axis_parameter(number).expect("a parameter of the module")
}

#[test]
fn it_is_a_servo_module_with_block_commutation() {
    let module = find("tmcm-1613").unwrap();
    assert_eq!((module.number, module.version, module.firmware), (1613, *b"1613V100", (1, 0)));
    assert_eq!((module.axes, module.motion), (1, Motion::Block));
    assert_eq!(module.peak_current_ma, 30_000);
    assert!(module.interrupts.is_empty());
}

/// Table 59 of the manual.
#[test]
fn it_has_all_axis_parameters_of_the_manual() {
    let numbers = [0..=4, 6..=7, 9..=11, 13..=13, 31..=31, 133..=134, 146..=146, 150..=152]
        .into_iter()
        .chain([155..=156, 159..=159, 172..=175, 200..=201, 214..=219, 226..=226, 228..=230])
        .chain([234..=235, 253..=254])
        .flatten();
    assert!(numbers.eq(TMCM_1613.axis_parameters.iter().map(|row| row.number)));
    for row in TMCM_1613.axis_parameters {
        let only_here = matches!(row.number, 31 | 133 | 134 | 159 | 174 | 175 | 214..=219 | 253);
        let block = matches!(row.behaviour, AxisBehaviour::Block(_));
        assert_eq!(block, only_here, "{}", row.id);
        assert!(block || matches!(row.behaviour, AxisBehaviour::Servo(_)), "{}", row.id);
        assert_eq!(row.axes, 1, "{}", row.id);
    }
}

#[test]
fn access_is_that_of_the_manual() {
    let numbers = |wanted: fn(Access) -> bool| {
        TMCM_1613.axis_parameters.iter().filter(move |row| wanted(row.access)).map(|row| row.number)
    };
    let stored = [4, 6, 7, 9, 10, 11, 133, 134, 146, 172, 173, 175, 230, 234, 235, 253, 254];
    assert!(stored.into_iter().eq(numbers(|access| access.store)));
    let read_only = [3, 13, 150, 151, 152, 156, 159, 200, 201, 214, 226, 228, 229];
    assert!(read_only.into_iter().eq(numbers(|access| !access.write)));
    assert!([31, 215, 216].into_iter().eq(numbers(|access| !access.read)));
    assert_eq!(numbers(|access| access.automatic).count(), 0);
}

#[test]
fn ranges_are_those_of_the_manual() {
    let range = |number| (axis_parameter(number).min, axis_parameter(number).max);
    for number in [0, 1, 3, 13, 150, 200, 201, 217, 218, 219, 226, 228, 229] {
        assert_eq!(range(number), (i32::MIN, i32::MAX), "{number}");
    }
    for number in [4, 7, 9] {
        assert_eq!(range(number), (0, 200_000), "{number}");
    }
    assert_eq!(range(2), (-200_000, 200_000));
    assert_eq!((range(6), range(155)), ((0, 30_000), (-30_000, 30_000)));
    assert_eq!((range(10), range(11)), ((0, 100_000), (0, 100_000)));
    for number in [172, 173, 230, 234, 235] {
        assert_eq!(range(number), (0, 65_535), "{number}");
    }
    assert_eq!((range(175), range(214), range(253)), ((0, 4096), (0, 1000), (2, 254)));
    // Multiples of 50 us; the second one includes its default, which the printed range does not.
    assert_eq!((range(133), range(134)), ((0, 20), (1, 10)));
    assert_eq!((axis_parameter(133).default, axis_parameter(134).default), (1, 1));
}

#[test]
fn defaults_that_the_manual_does_not_print_are_marked_as_chosen() {
    let named = |row: &&AxisParameter| row.default_source == Source::Manual;
    let rows = TMCM_1613.axis_parameters.iter().filter(named).map(|row| row.number);
    assert!([133, 134, 159].into_iter().eq(rows));
    let named =
        TMCM_1613.global_parameters.iter().filter(|row| row.default_source == Source::Manual);
    assert!([64, 65, 77, 85, 255].into_iter().eq(named.map(|row| row.number)));
    // Halted (bit 4), stop mode (bit 8), initialized (bit 15).
    assert_eq!(axis_parameter(156).default, 1 << 4 | 1 << 8 | 1 << 15);
}

#[test]
fn the_status_flags_are_bits_without_the_two_that_are_not_in_use() {
    let bits = axis_parameter(156).values.iter().map(|(bit, _)| *bit);
    let wanted = (0..16).filter(|bit| ![12, 13].contains(bit)).map(|bit| 1 << bit);
    assert!(wanted.eq(bits));
}

#[test]
fn its_target_speed_is_that_of_ror() {
    let row = TMCM_1613.target_speed().unwrap();
    assert_eq!((row.number, row.unit), (2, Unit::Other("rpm")));
    assert_eq!(row.behaviour, AxisBehaviour::Servo(Servo::TargetVelocity));
    assert_eq!(axis_parameter(253).behaviour, AxisBehaviour::Block(Block::MotorPoles));
}

/// Tables 70 and 72 of the manual.
#[test]
fn it_has_the_global_parameters_of_the_manual_and_only_its_behaviour_is_stored_on_request() {
    let rows = |bank| TMCM_1613.global_parameters.iter().filter(move |row| row.bank == bank);
    let numbers = [64..=66, 73..=73, 75..=78, 81..=81, 85..=85, 128..=130, 132..=132, 255..=255];
    assert!(numbers.into_iter().flatten().eq(rows(0).map(|row| row.number)));
    for row in rows(0) {
        assert_eq!(row.access.store, row.number == 78, "{}", row.id);
        let automatic = (64..=85).contains(&row.number) && ![65, 78].contains(&row.number);
        assert_eq!(row.access.automatic, automatic, "{}", row.id);
        let read_only = matches!(row.number, 65 | 128..=130);
        assert_eq!(row.access.write, !read_only, "{}", row.id);
        let stored = matches!(row.behaviour, GlobalBehaviour::Stored(_));
        assert_eq!(stored, row.number == 65, "{}", row.id);
    }
    assert!(rows(2).map(|row| (row.number, row.last, row.access.store)).eq([(0, 55, true)]));
    let default = |number| TMCM_1613.global_parameter(0, number).unwrap().default;
    assert_eq!((default(64), default(66), default(76), default(78)), (0xD0, 1, 2, 0));
    let timer = TMCM_1613.global_parameter(0, 132).unwrap();
    assert_eq!(timer.max, i64::from(u32::MAX));
}

/// Table 54 of the manual.
#[test]
fn it_has_the_ports_of_the_manual() {
    let ports = TMCM_1613.ports.iter().map(|row| (row.bank, row.number, row.max, row.behaviour));
    let wanted = [
        (0, 0, 1, PortBehaviour::DigitalInput),
        (0, 1, 1, PortBehaviour::DigitalInput),
        (0, 2, 1, PortBehaviour::DigitalInput),
        (1, 0, 4095, PortBehaviour::AnalogInput),
        (1, 1, 4095, PortBehaviour::ShuntReading),
        (1, 2, 4095, PortBehaviour::SupplyReading),
        (1, 3, 4095, PortBehaviour::TemperatureReading),
        (2, 0, 1, PortBehaviour::SerialOutput),
    ];
    assert!(wanted.into_iter().eq(ports));
    for row in TMCM_1613.ports {
        assert_eq!((row.access.read, row.access.write), (true, row.bank == 2), "{}", row.id);
    }
}

#[test]
fn the_rows_of_the_manual_are_exact_and_the_commands_of_programs_inferred() {
    let numbers = [1..=12, 14..=15, 19..=24, 27..=28, 33..=36, 128..=137, 255..=255];
    assert!(numbers.into_iter().flatten().eq(TMCM_1613.commands.iter().map(|row| row.number)));
    for row in TMCM_1613.commands {
        let exact = matches!(row.number, 1..=15 | 136);
        assert_eq!(row.certainty == Certainty::Exact, exact, "{}", row.mnemonic);
        assert_eq!(row.certainty == Certainty::Inferred, !exact, "{}", row.mnemonic);
        let mode = match row.number {
            21..=24 | 27 | 28 => Mode::Standalone,
            128.. => Mode::Direct,
            _ => Mode::Both,
        };
        assert_eq!((row.mode, row.unavailable), (mode, None), "{}", row.mnemonic);
    }
    let exact = |certainty| certainty == Certainty::Exact;
    assert!(TMCM_1613.axis_parameters.iter().all(|row| exact(row.certainty)));
    assert!(TMCM_1613.global_parameters.iter().all(|row| exact(row.certainty)));
    assert!(TMCM_1613.ports.iter().all(|row| exact(row.certainty)));
}
