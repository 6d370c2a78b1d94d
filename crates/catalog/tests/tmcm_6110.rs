//! The tables of the TMCM-6110, against what is known of modules of this kind.

use opentmcl_catalog::{
    Access, AxisBehaviour, AxisParameter, Certainty, MODULES, Mode, Motion, PortBehaviour, Source,
    TMCM_6110, TMCM_6214, Unit, find,
};

fn axis_parameter(number: u8) -> &'static AxisParameter {
    TMCM_6110.axis_parameter(number).expect("a parameter of the module")
}

#[test]
fn it_is_a_module_of_its_own_beside_the_tmcm_6214() {
    let numbers = MODULES.iter().map(|module| module.number).filter(|number| *number >= 6000);
    assert!(numbers.eq([6110, 6214]));
    let module = find("TMCM-6110").unwrap();
    assert_eq!((module.version, module.firmware), (*b"6110V131", (1, 31)));
    assert_eq!((module.axes, module.peak_current_ma), (6, 1600));
    assert_eq!((module.motion, TMCM_6214.motion), (Motion::Tmc429, Motion::Tmc5160));
}

/// The numbers of PyTrinamic's map, less those of an encoder and of other drivers.
#[test]
fn it_has_the_axis_parameters_of_a_tmc429_with_a_tmc26x() {
    let numbers = [0..=13, 130..=130, 135..=135, 138..=138, 140..=141, 149..=150, 153..=154]
        .into_iter()
        .chain([160..=184, 193..=197, 200..=200, 204..=204, 206..=208, 213..=214])
        .flatten();
    assert!(numbers.eq(TMCM_6110.axis_parameters.iter().map(|row| row.number)));
    for row in TMCM_6110.axis_parameters {
        assert_eq!(row.axes, 0b111111, "{}", row.id);
        let room = match row.behaviour {
            AxisBehaviour::Tmc429(_) => "tmc429",
            AxisBehaviour::Tmc26x(_) => "tmc26x",
            AxisBehaviour::Axis(_) => "axis",
            _ => "another",
        };
        // What the driver chip does; its currents and thresholds of speed are the firmware's.
        let wanted = match row.number {
            140 | 160..=180 | 184 | 206 | 208 => "tmc26x",
            0..=5 | 8 | 10..=13 | 130..=138 | 141 | 149 | 153 | 154 => "tmc429",
            _ => "axis",
        };
        assert_eq!(room, wanted, "{}", row.id);
    }
}

#[test]
fn chopper_coolstep_and_stallguard_settings_are_lost_at_power_off_and_others_can_be_stored() {
    let stored = [4..=7, 12..=13, 130..=130, 138..=138, 140..=140, 149..=149, 153..=154, 193..=195]
        .into_iter()
        .chain([200..=200, 204..=204, 214..=214])
        .flatten();
    let rows = TMCM_6110.axis_parameters.iter();
    assert!(stored.eq(rows.filter(|row| row.access.store).map(|row| row.number)));

    let read = Access { read: true, write: false, store: false, automatic: false };
    let rows = TMCM_6110.axis_parameters.iter().filter(|row| row.access == read);
    let numbers = [3, 8, 9, 10, 11, 135, 180, 196, 197, 206, 207, 208];
    assert!(numbers.into_iter().eq(rows.map(|row| row.number)));
    assert!(TMCM_6110.axis_parameters.iter().all(|row| row.access.read && !row.access.automatic));
}

#[test]
fn speeds_and_accelerations_are_the_eleven_bits_of_the_tmc429() {
    for row in TMCM_6110.axis_parameters {
        let signed = [2, 3].contains(&row.number);
        let wanted = match row.number {
            2..=4 | 130 | 181 | 182 | 194 | 195 => Some("v"),
            5 | 135 => Some("a"),
            _ => None,
        };
        if let Some(unit) = wanted {
            assert_eq!(row.unit, Unit::Other(unit), "{}", row.id);
            assert_eq!((row.min, row.max), (if signed { -2047 } else { 0 }, 2047), "{}", row.id);
        } else {
            assert!(![Unit::Other("v"), Unit::Other("a")].contains(&row.unit), "{}", row.id);
        }
        assert!(![Unit::Pps, Unit::Pps2].contains(&row.unit), "{}", row.id);
        assert_eq!(row.internal_max, row.max, "{}: nothing is converted", row.id);
    }
}

#[test]
fn ranges_are_those_of_the_chips_and_of_sister_modules() {
    let range = |number| (axis_parameter(number).min, axis_parameter(number).max);
    for number in [0, 1, 197] {
        assert_eq!(range(number), (i32::MIN, i32::MAX), "{number}");
    }
    for (number, max) in [(6, 255), (7, 255), (183, 255), (200, 255), (138, 2), (140, 8)] {
        assert_eq!(range(number), (0, max), "{number}");
    }
    for (number, max) in [(141, 4095), (153, 13), (154, 13), (164, 3), (166, 8), (206, 1023)] {
        assert_eq!(range(number), (0, max), "{number}");
    }
    assert_eq!(range(174), (-64, 63));
    assert_eq!(range(193), (1, 136));
    assert_eq!(range(214), (1, 65_535));
    let modes = axis_parameter(193).values.iter().map(|(mode, _)| *mode);
    assert!((1..=8).chain(65..=68).chain(133..=136).eq(modes));
    for number in [204, 214] {
        assert_eq!(axis_parameter(number).unit, Unit::Other("10 ms"), "{number}");
    }
}

/// Initial values of the vendor's open firmware for a TMC429 with a TMC262.
#[test]
fn defaults_that_no_manual_prints_are_those_of_the_open_firmware() {
    for (number, default) in [(4, 1000), (5, 500), (153, 3), (154, 2), (6, 255), (7, 32), (130, 1)]
        .into_iter()
        .chain([(140, 8), (162, 2), (166, 3), (167, 5), (173, 1), (174, 5), (175, 3), (176, 3)])
        .chain([(179, 1), (12, 1), (13, 1), (181, 0), (182, 0), (183, 0), (138, 0)])
        // The chip's field is 2, which the parameter calls 2 - 3.
        .chain([(165, 2 - 3)])
    {
        let row = axis_parameter(number);
        assert_eq!((row.default, row.default_source), (default, Source::OpenFirmware), "{number}");
    }
    assert_eq!((axis_parameter(214).default, axis_parameter(204).default), (200, 0));
}

#[test]
fn a_parameter_that_both_modules_have_has_the_same_number_and_nearly_always_the_same_name() {
    let both = TMCM_6110.axis_parameters.iter().filter_map(|row| {
        TMCM_6214.axis_parameter(row.number).map(|other| (row.number, row.id, other.id))
    });
    // 164: the TMC5160 has its flag alone. 204: a time here, a choice there.
    let different = both.filter(|(_, id, other)| id != other).map(|(number, ..)| number);
    assert!([164, 204].into_iter().eq(different));
}

#[test]
fn it_has_the_global_parameters_of_its_language() {
    let bank = |bank| {
        TMCM_6110.global_parameters.iter().filter(move |row| row.bank == bank).map(|row| row.number)
    };
    let numbers = [64..=71, 73..=73, 75..=77, 79..=79, 81..=85, 87..=87, 90..=90, 128..=133];
    assert!(numbers.into_iter().chain([255..=255]).flatten().eq(bank(0)));
    assert_eq!(bank(1).count(), 0);
    assert!([0, 56].into_iter().eq(bank(2)));
    assert!((0..=2).chain(27..=46).eq(bank(3)));

    for row in TMCM_6110.global_parameters {
        let automatic = row.bank == 0 && (64..128).contains(&row.number);
        assert_eq!(row.access.automatic, automatic, "{}", row.id);
        let store = row.bank == 3 || row.bank == 2 && row.last < 56;
        assert_eq!(row.access.store, store, "{}", row.id);
        let status = row.bank == 0 && matches!(row.number, 128..=131 | 133);
        assert_eq!(row.access.write, !status, "{}", row.id);
    }
    let default = |number| TMCM_6110.global_parameter(0, number).unwrap().default;
    for (number, value) in [(64, 228), (65, 0), (66, 1), (69, 8), (70, 2), (71, 1), (76, 2)] {
        assert_eq!(default(number), value, "{number}");
    }
}

#[test]
fn it_has_the_ports_of_its_connectors() {
    let ports = |bank, read, write| {
        let rows = TMCM_6110.ports.iter();
        rows.filter(move |row| row.bank == bank)
            .filter(move |row| row.access.read == read && row.access.write == write)
            .map(|row| row.number)
    };
    assert!((0..=7).chain([255]).eq(ports(0, true, false)));
    assert!([0].into_iter().eq(ports(0, false, true)));
    assert!([0, 4, 8, 9].into_iter().eq(ports(1, true, false)));
    assert!((0..=7).eq(ports(2, true, true)));
    assert!([255].into_iter().eq(ports(2, false, true)));
    assert_eq!(TMCM_6110.ports.len(), 9 + 1 + 4 + 8 + 1);
    let pull_ups = TMCM_6110.output_port(0, 0).unwrap();
    assert_eq!((pull_ups.behaviour, pull_ups.default), (PortBehaviour::PullUps, 3));
}

#[test]
fn its_interrupts_have_the_numbers_of_the_tmcm_6214() {
    let rows = |module: &'static opentmcl_catalog::Module| {
        module.interrupts.iter().map(|row| (row.number, row.id, row.behaviour, row.index))
    };
    assert!(rows(&TMCM_6110).eq(rows(&TMCM_6214)));
}

#[test]
fn newer_commands_are_unknown_to_it_and_status_2_answers_them() {
    let numbers = [1..=15, 19..=28, 30..=39, 64..=71, 128..=139, 242..=242, 255..=255];
    assert!(numbers.into_iter().flatten().eq(TMCM_6110.commands.iter().map(|row| row.number)));
    for row in TMCM_6110.commands {
        let mode = match row.number {
            // COMP, JC, JA, CSUB, RSUB, WAIT, STOP, CLE, RETI.
            20..=24 | 27 | 28 | 36 | 38 => Mode::Standalone,
            128.. => Mode::Direct,
            _ => Mode::Both,
        };
        assert_eq!(row.mode, mode, "{}", row.mnemonic);
        assert_eq!(row.unavailable.is_some(), (64..=71).contains(&row.number), "{}", row.mnemonic);
    }
}

#[test]
fn a_row_of_later_firmware_is_in_the_tables_and_not_in_the_module() {
    let mut later = TMCM_6110.axis_parameters.iter().filter(|row| !TMCM_6110.has(row.since));
    assert_eq!(later.next().map(|row| row.number), Some(150));
    assert!(later.next().is_none());
    let mut later = TMCM_6110.global_parameters.iter().filter(|row| !TMCM_6110.has(row.since));
    assert_eq!(later.next().map(|row| (row.bank, row.number)), Some((0, 131)));
    assert!(later.next().is_none());

    assert!(TMCM_6110.has(None));
    for (since, has) in [((1, 30), true), ((1, 31), true), ((1, 32), false), ((2, 0), false)] {
        assert_eq!(TMCM_6110.has(Some(since)), has, "{since:?}");
    }
    assert!(TMCM_6110.has(Some((0, 255))));
    assert!(TMCM_6214.commands.iter().all(|row| TMCM_6214.has(row.since)));
}

#[test]
fn each_row_says_how_sure_it_is() {
    let rows = |module: &'static opentmcl_catalog::Module| {
        let axis = module.axis_parameters.iter().map(|row| (row.certainty, row.source));
        let global = module.global_parameters.iter().map(|row| (row.certainty, row.source));
        let interrupts = module.interrupts.iter().map(|row| (row.certainty, row.source));
        let ports = module.ports.iter().map(|row| (row.certainty, row.source));
        let commands = module.commands.iter().map(|row| (row.certainty, row.source));
        axis.chain(global).chain(interrupts).chain(ports).chain(commands)
    };
    assert!(rows(&TMCM_6214).all(|row| row == (Certainty::Exact, None)));
    // One page of the manual of this firmware is public, and no table is on it.
    assert!(rows(&TMCM_6110).all(|(certainty, source)| {
        certainty != Certainty::Exact && source.is_some_and(|source| !source.is_empty())
    }));
    for row in TMCM_6110.interrupts {
        let inferred = matches!(row.number, 3..=8 | 15..=26);
        assert_eq!(row.certainty == Certainty::Inferred, inferred, "{}", row.id);
    }
    let recalled = rows(&TMCM_6110).filter(|row| row.0 == Certainty::Recalled);
    assert_eq!(recalled.count(), 2, "the temperature and the suppressed reply");
}
