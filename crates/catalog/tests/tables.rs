//! The tables of the modules, against the firmware manual.

use opentmcl_catalog::{
    Access, AxisBehaviour, AxisParameter, GlobalBehaviour, MODULES, Mode, PortBehaviour, Source,
    TMCM_6214, Unit, find,
};

fn axis_parameter(number: u8) -> &'static AxisParameter {
    TMCM_6214.axis_parameter(number).expect("a parameter of the module")
}

fn count<T>(rows: &[T], wanted: impl Fn(&T) -> bool) -> usize {
    rows.iter().filter(|row| wanted(row)).count()
}

/// Counted in the manual's tables row by row, as number ranges.
#[test]
fn the_tmcm_6214_has_all_rows_of_the_manual() {
    // Table 16: 0-29, 31-33, 127, 140, 162-174, 180-182, 184-199, 201, 202, 204, 206-210, 212-214,
    // 240, 251, 255.
    let numbers = [0..=29, 31..=33, 127..=127, 140..=140, 162..=174, 180..=182, 184..=199]
        .into_iter()
        .chain([201..=202, 204..=204, 206..=210, 212..=214, 240..=240, 251..=251, 255..=255])
        .flatten();
    assert!(numbers.eq(TMCM_6214.axis_parameters.iter().map(|row| row.number)));
    assert_eq!(TMCM_6214.axis_parameters.len(), 81);

    // Table 18: 65, 66, 68-71, 75-77, 81-85, 87, 128-130, 132, 133, 255. Table 19: two rows.
    // Table 20: three timers, 12 stop switches, 8 inputs.
    let bank = |bank| {
        TMCM_6214.global_parameters.iter().filter(move |row| row.bank == bank).map(|row| row.number)
    };
    let numbers = [65..=66, 68..=71, 75..=77, 81..=85, 87..=87, 128..=130, 132..=133, 255..=255];
    assert!(numbers.into_iter().flatten().eq(bank(0)));
    assert_eq!(bank(0).count(), 21);
    assert!([0, 56].into_iter().eq(bank(2)));
    assert!((0..=2).chain(27..=46).eq(bank(3)));
    assert_eq!(TMCM_6214.global_parameters.len(), 21 + 2 + 3 + 12 + 8);

    // Table 12: three timers; position reached, StallGuard and deviation for six axes each; two stop
    // switches for six axes; eight inputs; 255.
    let numbers = (0..=8).chain(15..=46).chain([255]);
    assert!(numbers.eq(TMCM_6214.interrupts.iter().map(|row| row.number)));
    assert_eq!(TMCM_6214.interrupts.len(), 3 + 6 + 6 + 6 + 12 + 8 + 1);

    // 3.6.13: inputs 0-7, 10, 13, 14 and 255 in bank 0; 0, 4 and 8-10 in bank 1; 3.6.12 and 3.6.13:
    // outputs 0-7 in bank 2. 3.6.12: outputs 255, the pull-ups and two analog ranges.
    let ports = |bank, read, write| {
        count(TMCM_6214.ports, |row| {
            row.bank == bank && row.access.read == read && row.access.write == write
        })
    };
    assert_eq!((ports(0, true, false), ports(0, false, true)), (12, 1));
    assert_eq!((ports(1, true, false), ports(1, false, true)), (5, 2));
    assert_eq!(ports(2, true, true), 9);
    assert_eq!(TMCM_6214.ports.len(), 12 + 1 + 5 + 2 + 9);

    // Table 5 has 51 rows: 1-6, 9-15, 19-28, 30-57. Table 13 adds 16-18 and 80. Table 14 has 128-137
    // and 255; 3.6.56 has 64-71, 3.6.57 has 138. 146-149 are not in the manual.
    let numbers = [1..=6, 9..=15, 16..=18, 19..=28, 30..=57, 64..=71, 80..=80, 128..=138]
        .into_iter()
        .chain([146..=149, 255..=255])
        .flatten();
    assert!(numbers.eq(TMCM_6214.commands.iter().map(|row| row.number)));
    assert_eq!(TMCM_6214.commands.len(), 51 + 4 + 11 + 8 + 1 + 4);
    // Table 13 has 22 rows, all from firmware 1.15 on.
    assert_eq!(count(TMCM_6214.commands, |row| row.since == Some((1, 15))), 22);
}

#[test]
fn every_row_is_found_by_its_number_and_no_other_number_finds_one() {
    for module in MODULES {
        let mut found = [0; 5];
        for number in 0..=255 {
            if let Some(row) = module.axis_parameter(number) {
                assert_eq!(row.number, number);
                found[0] += 1;
            }
            if let Some(row) = module.interrupt(number) {
                assert_eq!(row.number, number);
                found[1] += 1;
            }
            if let Some(row) = module.command(number) {
                assert_eq!(row.number, number);
                found[2] += 1;
            }
            for bank in 0..=255 {
                if let Some(row) = module.global_parameter(bank, number) {
                    assert!(row.bank == bank && (row.number..=row.last).contains(&number));
                    found[3] += 1;
                }
                if let Some(row) = module.input_port(bank, number) {
                    assert!(row.bank == bank && row.number == number && row.access.read);
                    found[4] += 1;
                }
                if let Some(row) = module.output_port(bank, number) {
                    assert!(row.bank == bank && row.number == number && row.access.write);
                    found[4] += 1;
                }
            }
        }
        let globals = module.global_parameters.iter();
        let directions = |access: Access| usize::from(access.read) + usize::from(access.write);
        assert_eq!(found[0], module.axis_parameters.len());
        assert_eq!(found[1], module.interrupts.len());
        assert_eq!(found[2], module.commands.len());
        assert_eq!(found[3], globals.map(|row| usize::from(row.last - row.number) + 1).sum());
        assert_eq!(found[4], module.ports.iter().map(|row| directions(row.access)).sum());
    }
}

#[test]
fn a_module_is_found_by_its_name_in_any_case() {
    assert_eq!(find("TMCM-6214").map(|module| module.number), Some(6214));
    assert_eq!(find("tmcm-6214").map(|module| module.version), Some(*b"6214V116"));
    assert!(find("tmcm-6215").is_none());
}

#[test]
fn ranges_are_those_of_table_16() {
    let range = |number| (axis_parameter(number).min, axis_parameter(number).max);
    assert_eq!(range(0), (i32::MIN, i32::MAX));
    assert_eq!(range(2), (-7_999_774, 7_999_774));
    assert_eq!(range(4), (0, 7_999_774));
    assert_eq!(range(5), (0, 7_629_278));
    assert_eq!(range(16), (0, 1_000_000));
    assert_eq!(range(19), (0, 249_999));
    assert_eq!(range(21), (0, 65_535));
    assert_eq!(range(140), (0, 8));
    assert_eq!(range(166), (0, 8));
    assert_eq!(range(174), (-64, 63));
    assert_eq!(range(206), (0, 1023));
    assert_eq!(range(214), (0, 417));
    // Read as the errata say: three options, and the largest base mode with the largest addition.
    assert_eq!(range(127), (0, 2));
    assert_eq!(range(193), (1, 138));
}

#[test]
fn defaults_are_those_that_the_manual_names() {
    for (number, default) in [(140, 8), (187, 0), (192, 1), (202, 200), (214, 200), (255, 1)] {
        let row = axis_parameter(number);
        assert_eq!((row.default, row.default_source), (default, Source::Manual), "{number}");
    }
    let global = |number| TMCM_6214.global_parameter(0, number).unwrap();
    for (number, default) in [(65, 0), (68, 0), (69, 8), (70, 2), (71, 1), (77, 0), (82, 0)] {
        let row = global(number);
        assert_eq!((row.default, row.default_source), (default, Source::Manual), "{number}");
    }
    assert_eq!((global(66).default, global(76).default), (1, 2));
}

#[test]
fn access_is_that_of_the_manual() {
    let read = Access { read: true, write: false, store: false, automatic: false };
    let write = Access { write: true, ..read };
    for number in [3, 8, 9, 10, 11, 29, 180, 189, 190, 196, 197, 198, 199, 206, 207, 208] {
        assert_eq!(axis_parameter(number).access, read, "{number}");
    }
    assert_eq!(count(TMCM_6214.axis_parameters, |row| row.access == read), 16);
    assert_eq!(axis_parameter(209).access, write);
    for row in TMCM_6214.global_parameters {
        let automatic = row.bank == 0 && (64..128).contains(&row.number);
        assert_eq!(row.access.automatic, automatic, "{}", row.id);
        let store = row.bank == 2 && row.last < 56;
        assert_eq!(row.access.store, store, "{}", row.id);
        let status = row.bank == 0 && (128..=130).contains(&row.number);
        assert_eq!(row.access.write, !status, "{}", row.id);
    }
}

#[test]
fn the_encoder_parameters_that_the_manual_restricts_exist_on_axes_3_to_5_only() {
    for row in TMCM_6214.axis_parameters {
        let encoder = [209, 210, 212].contains(&row.number);
        assert_eq!(row.axes, if encoder { 0b111000 } else { 0b111111 }, "{}", row.id);
    }
}

#[test]
fn the_serial_heartbeat_is_in_milliseconds_and_off_by_default() {
    let row = TMCM_6214.global_parameter(0, 68).unwrap();
    assert_eq!((row.id, row.unit), ("serial_heartbeat", Unit::Other("ms")));
    assert_eq!((row.min, row.max, row.default), (0, 65_535, 0));
}

#[test]
fn timer_periods_have_32_bits_without_sign() {
    for number in 0..=2 {
        assert_eq!(TMCM_6214.global_parameter(3, number).unwrap().max, i64::from(u32::MAX));
    }
}

#[test]
fn a_reference_search_mode_may_have_64_or_128_added_where_the_manual_says_so() {
    let modes = axis_parameter(193).values.iter().map(|(mode, _)| *mode);
    assert!((1..=10).chain(65..=68).chain(133..=136).eq(modes));
}

#[test]
fn gio_and_sio_may_mean_different_ports_by_the_same_number() {
    let port = |row: Option<&'static opentmcl_catalog::Port>| row.map(|row| row.behaviour);
    assert_eq!(port(TMCM_6214.input_port(0, 0)), Some(PortBehaviour::DigitalInput));
    assert_eq!(port(TMCM_6214.output_port(0, 0)), Some(PortBehaviour::PullUps));
    assert_eq!(port(TMCM_6214.input_port(1, 4)), Some(PortBehaviour::AnalogInput));
    assert_eq!(port(TMCM_6214.output_port(1, 4)), Some(PortBehaviour::AdcRange));
    assert_eq!(port(TMCM_6214.input_port(2, 255)), Some(PortBehaviour::AllOutputs));
    assert_eq!(port(TMCM_6214.output_port(0, 255)), None);
    let all = TMCM_6214.output_port(2, 255).unwrap();
    assert_eq!((all.min, all.max), (-1, 255));
}

#[test]
fn control_commands_are_for_a_host_and_branches_for_a_program() {
    for row in TMCM_6214.commands {
        let mode = match row.number {
            // JC, JA, CSUB, RSUB, WAIT, STOP, RETI, RST, DJNZ, CALL.
            21..=24 | 27 | 28 | 38 | 48 | 49 | 80 => Mode::Standalone,
            128.. => Mode::Direct,
            _ => Mode::Both,
        };
        assert_eq!(row.mode, mode, "{}", row.mnemonic);
        assert_eq!(row.unavailable.is_some(), (64..=71).contains(&row.number), "{}", row.mnemonic);
    }
}

#[test]
fn every_default_lies_in_its_range() {
    for module in MODULES {
        for row in module.axis_parameters {
            assert!((row.min..=row.max).contains(&row.default), "{}", row.id);
        }
        for row in module.global_parameters {
            assert!((row.min..=row.max).contains(&i64::from(row.default)), "{}", row.id);
        }
        for row in module.ports {
            assert!((row.min..=row.max).contains(&row.default), "{}", row.id);
        }
    }
}

#[test]
fn every_description_is_a_sentence_without_blanks_at_its_ends() {
    for module in MODULES {
        let texts = module.axis_parameters.iter().map(|row| row.description);
        let texts = texts.chain(module.global_parameters.iter().map(|row| row.description));
        let texts = texts.chain(module.interrupts.iter().map(|row| row.description));
        let texts = texts.chain(module.ports.iter().map(|row| row.description));
        let texts = texts.chain(module.commands.iter().map(|row| row.description));
        for text in texts.chain([module.description]) {
            assert_eq!(text, text.trim());
            assert!(text.len() > 1 && text.ends_with('.'), "{text:?}");
        }
    }
}

#[test]
fn only_settings_of_hardware_that_is_not_modelled_are_without_effect() {
    let stored = |row: &opentmcl_catalog::GlobalParameter| matches!(row.behaviour, GlobalBehaviour::Stored(reason) if !reason.is_empty());
    let numbers =
        TMCM_6214.global_parameters.iter().filter(|row| stored(row)).map(|row| row.number);
    assert!([65, 69, 70, 71, 82, 83].into_iter().eq(numbers));
    let stored = |row: &AxisParameter| matches!(row.behaviour, AxisBehaviour::Stored(_));
    assert!(!TMCM_6214.axis_parameters.iter().any(stored));
}

/// Registers of the TMC5160 run from a 16 MHz clock: a speed is V * 16e6 / 2^24, an acceleration
/// A * 16e6^2 / 2^41.
mod ramp {
    use super::axis_parameter;

    const SPEED: f64 = 16e6 / 16_777_216.0;
    const ACCELERATION: f64 = 16e6 * 16e6 / 2_199_023_255_552.0;

    /// What a value selects: the register truncates.
    fn register(number: u8, factor: f64) -> f64 {
        (f64::from(axis_parameter(number).default) / factor).trunc()
    }

    #[test]
    fn defaults_select_the_register_values_of_the_open_firmware_and_read_back_as_written() {
        for (number, factor, value) in [
            (4, SPEED, 53_687.0),
            (5, ACCELERATION, 439.0),
            (15, ACCELERATION, 220.0),
            (16, SPEED, 26_843.0),
            (17, ACCELERATION, 439.0),
            (18, ACCELERATION, 220.0),
            (19, SPEED, 1.0),
            (20, SPEED, 10.0),
        ] {
            assert_eq!(register(number, factor), value, "{number}");
            // Reading rounds away from zero.
            assert_eq!((value * factor).ceil(), f64::from(axis_parameter(number).default));
        }
    }

    #[test]
    fn a_move_of_512000_microsteps_from_rest_takes_11_75_seconds() {
        let speed = |number| register(number, SPEED) * SPEED;
        let acceleration = |number| register(number, ACCELERATION) * ACCELERATION;
        let (v1, vmax) = (speed(16), speed(4));
        let phases = [
            (speed(19), v1, acceleration(15)),
            (v1, vmax, acceleration(5)),
            (v1, vmax, acceleration(17)),
            (speed(20), v1, acceleration(18)),
        ];
        let (mut time, mut way) = (0.0, 0.0);
        for (slow, fast, acceleration) in phases {
            time += (fast - slow) / acceleration;
            way += (fast * fast - slow * slow) / (2.0 * acceleration);
        }
        let total = time + (512_000.0 - way) / vmax;
        assert!((total - 11.75).abs() < 0.01 * 11.75, "{total} s");
    }
}
