//! CoolStep, the coils, and what takes the driver off (datasheet 6.2, 14; manual 6.8).

use opentmcl_motion::{Instant, TICKS_PER_SECOND};
use opentmcl_plant::tmc5160::{Coils, Sense, Tmc5160, registers::*};

const NOW: Instant = Instant::from_ticks(0);
const ON: u32 = 0x1041_0153;
const OVERTEMPERATURE: u32 = 1 << 25;
const SHORT_A: u32 = 1 << 27;

fn seconds(seconds: u64) -> Instant {
    Instant::from_ticks(seconds * TICKS_PER_SECOND)
}

fn chip(registers: &[(u8, u32)]) -> Tmc5160 {
    let mut chip = Tmc5160::new();
    let usual = [(CHOPCONF, ON), (AMAX, 1_000), (IHOLD_IRUN, 15 << 8 | 4), (TPOWERDOWN, 10)];
    for &(address, value) in usual.iter().chain(registers) {
        chip.write(address, value, NOW);
    }
    chip
}

fn driven(scale: u8) -> Coils {
    Coils::Driven { scale, global: 256 }
}

/// Cruising with 50000 units, TSTEP 335, within the range of CoolStep.
fn cooling(coolconf: u32) -> Tmc5160 {
    chip(&[(COOLCONF, coolconf), (TCOOLTHRS, 2_000), (THIGH, 100), (VMAX, 50_000), (RAMPMODE, 1)])
}

fn current(chip: &mut Tmc5160, now: Instant) -> u32 {
    chip.read(DRV_STATUS, now) >> 16 & 0x1F
}

#[test]
fn readings_above_the_range_lower_the_current_and_those_below_raise_it() {
    // SEMIN 2, SEMAX 1: below 64 more, from 128 on less. IRUN is 15.
    for (sedn, needed) in [(0, 32), (1, 8), (2, 2), (3, 1)] {
        let mut chip = cooling(sedn << 13 | 1 << 8 | 2);
        assert_eq!(chip.cool_readings_to_change(128), Some(needed));
        for _ in 1..needed {
            chip.cool_reading(128, seconds(5));
        }
        assert_eq!(current(&mut chip, seconds(5)), 15);
        assert_eq!(chip.cool_readings_to_change(128), Some(1));
        chip.cool_reading(127, seconds(5));
        assert_eq!(current(&mut chip, seconds(5)), 15, "within the range nothing happens");
        chip.cool_reading(128, seconds(5));
        assert_eq!(current(&mut chip, seconds(5)), 14);
        assert_eq!(chip.coils(seconds(5)), driven(15));
        chip.cool_reading(64, seconds(5));
        assert_eq!(current(&mut chip, seconds(5)), 14);
        chip.cool_reading(63, seconds(5));
        assert_eq!(current(&mut chip, seconds(5)), 15);
        assert_eq!(chip.cool_readings_to_change(63), None, "not above IRUN");
    }
}

#[test]
fn after_a_change_of_the_current_the_count_begins_anew() {
    // SEDN 2: every second reading from 96 on.
    let mut chip = cooling(2 << 13 | 2);
    let mut readings = |results: &[u16]| {
        results.iter().for_each(|&result| chip.cool_reading(result, seconds(5)));
        current(&mut chip, seconds(5))
    };
    assert_eq!(readings(&[96, 96]), 14);
    assert_eq!(readings(&[96, 0]), 15, "one counted, then raised");
    assert_eq!(readings(&[96]), 15);
    assert_eq!(readings(&[96]), 14);
}

#[test]
fn the_lowest_current_is_a_half_or_a_quarter_and_seup_is_the_step_up() {
    // 16/32 of full scale: a half is 8/32 (CS 7), a quarter 4/32 (CS 3).
    for (seimin, lowest) in [(0, 7), (1, 3)] {
        for (seup, raised) in [(0, 1), (1, 2), (2, 4), (3, 8)] {
            let mut chip = cooling(seimin << 15 | 3 << 13 | seup << 5 | 2);
            for _ in 0..40 {
                chip.cool_reading(1_023, seconds(5));
            }
            assert_eq!(current(&mut chip, seconds(5)), lowest);
            assert_eq!(chip.cool_readings_to_change(1_023), None);
            chip.cool_reading(0, seconds(5));
            assert_eq!(current(&mut chip, seconds(5)), (lowest + raised).min(15));
        }
    }
}

#[test]
fn coolstep_works_only_within_its_range_of_speeds_and_without_it_the_current_is_irun() {
    let lowered = || {
        let mut chip = cooling(3 << 13 | 2);
        chip.cool_reading(1_023, seconds(5));
        assert_eq!(current(&mut chip, seconds(5)), 14);
        chip
    };
    // 1000 units are a TSTEP of 16777, 200000 one of 83.
    for vmax in [0, 1_000, 200_000] {
        let mut chip = lowered();
        chip.write(VMAX, vmax, seconds(5));
        assert!(!chip.cool_active(seconds(20)), "{vmax}");
        chip.write(VMAX, 50_000, seconds(20));
        assert!(chip.cool_active(seconds(40)), "{vmax}");
        assert_eq!(current(&mut chip, seconds(40)), 15, "{vmax}");
    }
    let mut chip = lowered();
    chip.write(VMAX, 60_000, seconds(5));
    assert_eq!(current(&mut chip, seconds(20)), 14, "it has never left the range");
    let off = cooling(0);
    assert!(!off.cool_active(seconds(5)));
    let stealth = chip_with_stealth_range();
    assert!(!stealth.cool_active(seconds(5)));
}

/// As slow as StealthChop wants it.
fn chip_with_stealth_range() -> Tmc5160 {
    chip(&[(GCONF, 1 << 2), (COOLCONF, 2), (TCOOLTHRS, 100), (VMAX, 50_000), (RAMPMODE, 1)])
}

#[test]
fn the_power_down_is_foreseen_step_by_step() {
    // 2^20 + 10 * 2^18 clocks after power-up, then a step from 15 to 4 every 2 * 2^18 clocks.
    let chip = chip(&[(IHOLD_IRUN, 2 << 16 | 15 << 8 | 4)]);
    let start = (1 << 20) + (10 << 18);
    let mut time = NOW;
    for step in 1..=11u8 {
        let next = chip.next_coil_change(time).unwrap();
        assert_eq!(next.as_ticks(), start + u64::from(step) * (2 << 18));
        assert_eq!(chip.coils(Instant::from_ticks(next.as_ticks() - 1)), driven(17 - step));
        assert_eq!(chip.coils(next), driven(16 - step));
        time = next;
    }
    assert_eq!(chip.next_coil_change(time), None);
}

#[test]
fn freewheeling_needs_no_hold_current_stealthchop_and_the_end_of_the_power_down() {
    let free = |freewheel: u32, hold: u32, gconf: u32| {
        let registers = [
            (IHOLD_IRUN, 15 << 8 | hold),
            (GCONF, gconf),
            (TPWMTHRS, 0xF_FFFF),
            (PWMCONF, freewheel << 20),
        ];
        chip(&registers)
    };
    let end = Instant::from_ticks((1 << 20) + (10 << 18));
    let before = Instant::from_ticks(end.as_ticks() - 1);
    for (freewheel, coils) in
        [(0, driven(1)), (1, Coils::Off), (2, Coils::Shorted), (3, Coils::Shorted)]
    {
        let chip = free(freewheel, 0, 1 << 2);
        assert_eq!(chip.coils(before), driven(16));
        assert_eq!(chip.next_coil_change(before), Some(end));
        assert_eq!(chip.coils(end), coils, "{freewheel}");
        assert_eq!(free(freewheel, 0, 0).coils(end), driven(1), "without StealthChop");
        assert_eq!(free(freewheel, 1, 1 << 2).coils(end), driven(2), "with a hold current");
    }
    let mut moving = free(1, 0, 1 << 2);
    moving.write(VMAX, 50_000, end);
    moving.write(RAMPMODE, 1, end);
    assert_eq!(moving.coils(Instant::from_ticks(end.as_ticks() + 1)), driven(16));
}

#[test]
fn the_coils_are_off_with_toff_0_and_without_the_enable_pin() {
    let mut chip = chip(&[(GLOBAL_SCALER, 128)]);
    assert_eq!(chip.coils(NOW), Coils::Driven { scale: 16, global: 128 });
    chip.set_enabled(false, NOW);
    assert_eq!(chip.coils(NOW), Coils::Off);
    chip.set_enabled(true, NOW);
    assert_eq!(chip.coils(NOW), Coils::Driven { scale: 16, global: 128 });
    chip.write(CHOPCONF, ON & !0xF, NOW);
    assert_eq!(chip.coils(NOW), Coils::Off);
}

fn sense(flags: u32) -> Sense {
    Sense { flags, ..Sense::IDEAL }
}

#[test]
fn overtemperature_takes_the_driver_off_as_long_as_it_lasts() {
    let mut chip = chip(&[]);
    chip.write(GSTAT, 0b111, NOW);
    chip.set_sense(sense(OVERTEMPERATURE), NOW);
    assert_eq!(chip.coils(NOW), Coils::Off);
    assert_eq!(chip.read(DRV_STATUS, NOW) & OVERTEMPERATURE, OVERTEMPERATURE);
    chip.set_sense(sense(0), NOW);
    assert_eq!(chip.coils(NOW), driven(16));
    assert_eq!(chip.read(GSTAT, NOW), 0b10, "a driver error has been");
}

#[test]
fn a_short_takes_the_driver_off_until_it_is_switched_off_and_on() {
    for toff in [false, true] {
        let mut chip = chip(&[]);
        chip.set_sense(sense(SHORT_A), NOW);
        chip.set_sense(sense(0), NOW);
        assert_eq!(chip.coils(NOW), Coils::Off);
        assert_eq!(chip.read(DRV_STATUS, NOW) & SHORT_A, SHORT_A, "it stays");
        let restart = |chip: &mut Tmc5160| {
            if toff {
                chip.write(CHOPCONF, ON & !0xF, NOW);
                chip.write(CHOPCONF, ON, NOW);
            } else {
                chip.set_enabled(false, NOW);
                chip.set_enabled(true, NOW);
            }
        };
        restart(&mut chip);
        assert_eq!(chip.coils(NOW), driven(16));
        assert_eq!(chip.read(DRV_STATUS, NOW) & SHORT_A, 0);
        chip.set_sense(sense(SHORT_A), NOW);
        restart(&mut chip);
        assert_eq!(chip.coils(NOW), Coils::Off, "the short is there still");
    }
}
