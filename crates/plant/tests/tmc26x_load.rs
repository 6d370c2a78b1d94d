//! StallGuard2 and CoolStep of a TMC26x (datasheet chapters 4 and 5).

use core::num::NonZeroU64;

use opentmcl_motion::Instant;
use opentmcl_plant::tmc26x::registers::*;
use opentmcl_plant::tmc26x::{Coils, Motion, Sense, Tmc26x};

const NOW: Instant = Instant::from_ticks(0);
const MOVING: Motion = Motion::Moving { rate: NonZeroU64::new(1 << 30).unwrap() };
const ON: (Field, u32) = (TOFF, 5);

fn set(chip: &mut Tmc26x, fields: &[(Field, u32)]) {
    for register in Register::ALL {
        chip.write(register.datagram(fields), NOW);
    }
}

/// A moving motor.
fn chip(fields: &[(Field, u32)]) -> Tmc26x {
    let mut chip = Tmc26x::new();
    set(&mut chip, fields);
    chip.set_motion(MOVING, NOW);
    chip
}

fn sense(stallguard: u16) -> Sense {
    Sense { stallguard, ..Sense::IDEAL }
}

/// SG and its flag, by two datagrams as a firmware reads it.
fn stallguard(chip: &mut Tmc26x) -> (u32, bool) {
    chip.write(Register::DrvConf.datagram(&[(RDSEL, 1)]), NOW);
    let reply = chip.write(Register::DrvConf.datagram(&[(RDSEL, 1)]), NOW);
    assert_eq!(chip.stalls(NOW), reply & 1 == 1);
    (reply >> 10, reply & 1 == 1)
}

/// The upper half of SG, and SE.
fn cool(chip: &mut Tmc26x) -> (u32, u32) {
    chip.write(Register::DrvConf.datagram(&[(RDSEL, 2)]), NOW);
    let reply = chip.status(NOW);
    (reply >> 15, reply >> 10 & 0x1F)
}

#[test]
fn the_threshold_shifts_the_result_by_16_within_ten_bits() {
    for (raw, sgt, expected) in [
        (300, 0, 300),
        (300, 5, 380),
        (300, -10, 140),
        (300, -19, 0),
        (300, -64, 0),
        (300, 63, 1023),
        (0, 1, 16),
        (1023, 0, 1023),
    ] {
        let mut chip = chip(&[ON, (SGT, sgt as u32)]);
        chip.set_sense(sense(raw), NOW);
        assert_eq!(stallguard(&mut chip), (expected, expected == 0), "{raw} with SGT {sgt}");
        assert_eq!(u32::from(chip.stallguard(raw)), expected);
        assert_eq!(cool(&mut chip).0, expected >> 5);
    }
}

#[test]
fn a_stall_is_told_only_where_there_is_a_measurement() {
    let mut unknown = chip(&[ON]);
    assert_eq!(stallguard(&mut unknown), (0, false), "no motor");
    let stalled = || {
        let mut chip = chip(&[ON]);
        chip.set_sense(sense(0), NOW);
        assert_eq!(stallguard(&mut chip), (0, true));
        chip
    };
    let mut standing = stalled();
    standing.set_motion(Motion::Standing { since: NOW }, NOW);
    assert_eq!(stallguard(&mut standing), (0, false));
    let mut off = stalled();
    off.write(Register::ChopConf.datagram(&[]), NOW);
    assert_eq!(stallguard(&mut off), (0, false));
    let mut disabled = stalled();
    disabled.set_enabled(false, NOW);
    assert_eq!(stallguard(&mut disabled), (0, false));
}

#[test]
fn readings_above_the_range_lower_the_current_and_those_below_raise_it() {
    // SEMIN 3, SEMAX 2: below 96 more, from 192 on less.
    for (sedn, needed) in [(0, 32), (1, 8), (2, 2), (3, 1)] {
        let mut chip = chip(&[ON, (CS, 23), (SEMIN, 3), (SEMAX, 2), (SEDN, sedn)]);
        assert!(chip.cool_active(NOW));
        assert_eq!(chip.cool_readings_to_change(192), Some(needed));
        (1..needed).for_each(|_| chip.cool_reading(192, NOW));
        chip.cool_reading(191, NOW);
        chip.cool_reading(96, NOW);
        assert_eq!(cool(&mut chip).1, 23, "within the range nothing happens");
        chip.cool_reading(192, NOW);
        assert_eq!(cool(&mut chip).1, 22);
        assert_eq!(chip.coils(NOW), Coils::Driven { scale: 23, global: 256 });
        chip.cool_reading(95, NOW);
        assert_eq!(cool(&mut chip).1, 23);
        assert_eq!(chip.cool_readings_to_change(95), None, "not above CS");
    }
}

#[test]
fn the_lowest_current_is_a_half_or_a_quarter_and_seup_is_the_step_up() {
    // 24/32 of full scale: a half is 12/32 (CS 11), a quarter 6/32 (CS 5).
    for (seimin, lowest) in [(0, 11), (1, 5)] {
        for (seup, raised) in [(0, 1), (1, 2), (2, 4), (3, 8)] {
            let settings = [ON, (CS, 23), (SEMIN, 2), (SEDN, 3), (SEIMIN, seimin), (SEUP, seup)];
            let mut chip = chip(&settings);
            (0..40).for_each(|_| chip.cool_reading(1_023, NOW));
            assert_eq!(cool(&mut chip).1, lowest);
            assert_eq!(chip.cool_readings_to_change(1_023), None);
            chip.cool_reading(0, NOW);
            assert_eq!(cool(&mut chip).1, lowest + raised);
            (0..40).for_each(|_| chip.cool_reading(0, NOW));
            assert_eq!(cool(&mut chip).1, 23);
        }
    }
}

#[test]
fn coolstep_ends_with_the_motion_the_bridges_or_semin() {
    type End = (fn(&mut Tmc26x), fn(&mut Tmc26x));
    const SETTINGS: [(Field, u32); 4] = [ON, (CS, 23), (SEMIN, 2), (SEDN, 3)];
    let ends: [End; 5] = [
        (
            |chip| chip.set_motion(Motion::Standing { since: NOW }, NOW),
            |chip| chip.set_motion(MOVING, NOW),
        ),
        (
            |chip| {
                chip.write(Register::ChopConf.datagram(&[]), NOW);
            },
            |chip| set(chip, &SETTINGS),
        ),
        (
            |chip| {
                chip.write(Register::SmartEn.datagram(&[(SEDN, 3)]), NOW);
            },
            |chip| set(chip, &SETTINGS),
        ),
        (
            |chip| {
                chip.write(Register::DrvConf.datagram(&[(SDOFF, 1)]), NOW);
            },
            |chip| set(chip, &SETTINGS),
        ),
        (
            |chip| chip.set_sense(Sense { flags: 1 << 25, ..Sense::IDEAL }, NOW),
            |chip| chip.set_sense(Sense::IDEAL, NOW),
        ),
    ];
    for (which, (end, begin)) in ends.into_iter().enumerate() {
        let mut chip = chip(&SETTINGS);
        (0..3).for_each(|_| chip.cool_reading(1_023, NOW));
        assert_eq!(cool(&mut chip).1, 20);
        end(&mut chip);
        assert!(!chip.cool_active(NOW), "{which}");
        chip.cool_reading(1_023, NOW);
        let after = chip.clone();
        begin(&mut chip);
        assert!(chip.cool_active(NOW), "{which}");
        assert_eq!(cool(&mut chip).1, 23, "{which}");
        assert_eq!(cool(&mut after.clone()).1, 23, "{which}");
    }
}

#[test]
fn a_firmware_may_read_by_writing_again_what_stands_there() {
    // The vendor's firmware reads the state by sending one of its registers after the other.
    let settings = [ON, (CS, 23), (SEMIN, 2), (SEDN, 1), (RDSEL, 2), (SGT, 3), (MRES, 2)];
    let mut asked = chip(&settings);
    let mut alone = asked.clone();
    for (count, reading) in [500, 500, 0, 700, 64, 96, 96].into_iter().cycle().take(99).enumerate()
    {
        asked.cool_reading(reading, NOW);
        alone.cool_reading(reading, NOW);
        asked.write(Register::ALL[count % 5].datagram(&settings), NOW);
        asked.set_motion(MOVING, NOW);
    }
    assert_eq!(format!("{asked:?}"), format!("{alone:?}"));
    assert!(cool(&mut asked).1 < 23, "something has happened");
}

#[test]
fn a_lower_cs_is_lowered_by_no_more_than_it_allows() {
    let mut chip = chip(&[ON, (CS, 31), (SEMIN, 2), (SEDN, 3)]);
    (0..16).for_each(|_| chip.cool_reading(1_023, NOW));
    assert_eq!(cool(&mut chip).1, 15);
    // CS 3: 4/32, of which a half is 2/32.
    chip.write(Register::SgcsConf.datagram(&[(CS, 3)]), NOW);
    assert_eq!(cool(&mut chip).1, 1);
    chip.write(Register::SgcsConf.datagram(&[(CS, 0)]), NOW);
    assert_eq!(cool(&mut chip).1, 0);
}
