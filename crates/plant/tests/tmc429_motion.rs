//! Motions of the TMC429 as its registers and flags show them.

use opentmcl_motion::Instant;
use opentmcl_plant::tmc429::Tmc429;
use opentmcl_plant::tmc429::registers::*;

const START: Instant = Instant::from_ticks(0);

/// pulse_div 3, ramp_div 7, 64 microsteps.
const USUAL_DIVISORS: u32 = 3 << 12 | 7 << 8 | 6;

fn seconds(value: f64) -> Instant {
    Instant::from_ticks((value * 16e6) as u64)
}

/// A chip whose axis 0 has the settings of a usual module: 30 518 microsteps per second after 131 ms.
fn usual() -> Tmc429 {
    let mut chip = Tmc429::new();
    // p = 500 / (128 * 2^4) = 0.244; 0.988 of it is 247 / 2^10.
    for (index, value) in [
        (DIVISORS, USUAL_DIVISORS),
        (V_MIN, 1),
        (V_MAX, 1000),
        (A_MAX, 500),
        (PMUL_PDIV, 247 << 8 | 7),
    ] {
        chip.write(index, value, START);
    }
    chip
}

fn velocity(chip: &mut Tmc429, now: Instant) -> i32 {
    (chip.read(V_ACTUAL, now) << 20).cast_signed() >> 20
}

fn flags(chip: &mut Tmc429, now: Instant) -> u32 {
    chip.read(INTERRUPT, now) & 0xFF
}

fn end_of(chip: &mut Tmc429, from: Instant) -> Instant {
    let mut now = from;
    while let Some(next) = chip.next_event(now) {
        now = next;
    }
    now
}

#[test]
fn a_move_shows_in_all_registers() {
    let mut chip = usual();
    chip.write(X_TARGET, 51_200, START);
    // 20 ramp ticks of 4096 clocks: 20 * 500 / 256 = 39.
    let soon = Instant::from_ticks(20 * 4096);
    assert_eq!((velocity(&mut chip, soon), chip.read(A_ACTUAL, soon)), (39, 500));
    assert_eq!(chip.read(V_TARGET, soon), 1000);
    assert_eq!(chip.status(soon) & 1, 0);
    let middle = seconds(0.9);
    assert_eq!((velocity(&mut chip, middle), chip.read(A_ACTUAL, middle)), (1000, 0));
    // v t - v² / 2a = 30517.6 * 0.9 - 2000
    let expected = 30_517.6 * 0.9 - 2000.0;
    assert!((f64::from(chip.read(X_ACTUAL, middle)) - expected).abs() < 10.0);
    let mut before = chip.clone();
    let end = end_of(&mut chip, middle);
    // d / v + v / a
    let expected = 51_200.0 / 30_517.6 + 0.131;
    assert!((end.as_ticks() as f64 / 16e6 - expected).abs() < 0.005, "{end:?}");
    assert_eq!(flags(&mut before, Instant::from_ticks(end.as_ticks() - 1)), 0);
    assert_eq!(flags(&mut chip, end), FLAG_TARGET_REACHED | FLAG_STOPPED);
    assert_eq!((chip.read(X_ACTUAL, end), velocity(&mut chip, end)), (51_200, 0));
    assert_eq!((chip.read(V_TARGET, end), chip.read(A_ACTUAL, end)), (0, 0));
    assert_eq!((chip.status(end) & 1, chip.stopped_at(0, end)), (1, Some(end)));
}

#[test]
fn negative_numbers_have_24_and_12_bits() {
    let mut chip = usual();
    chip.write(X_TARGET, (-51_200i32).cast_unsigned(), START);
    let middle = seconds(0.9);
    assert_eq!(chip.read(V_ACTUAL, middle), 0x1000 - 1000);
    assert_eq!(chip.read(V_TARGET, middle), 0x1000 - 1000);
    let end = end_of(&mut chip, middle);
    assert_eq!(chip.read(X_ACTUAL, end), 0x100_0000 - 51_200);
    assert_eq!(chip.position(0, end), -51_200);
}

#[test]
fn the_actual_position_can_be_written_and_the_axis_then_goes_to_its_target() {
    let mut chip = usual();
    chip.write(X_ACTUAL, 1000, START);
    assert_eq!(chip.travel(0, START), 0);
    let end = end_of(&mut chip, START);
    assert_eq!((chip.position(0, end), chip.travel(0, end)), (0, -1000));
}

#[test]
fn with_v_max_0_positions_can_be_written_without_a_motion() {
    let mut chip = usual();
    chip.write(V_MAX, 0, START);
    chip.write(X_ACTUAL, 1000, START);
    chip.write(X_TARGET, 1000, START);
    assert_eq!(flags(&mut chip, START), FLAG_TARGET_REACHED, "a write has made them equal");
    chip.write(V_MAX, 1000, START);
    assert_eq!(chip.next_event(START), None);
    assert_eq!(chip.travel(0, seconds(1.0)), 0);
}

#[test]
fn velocity_mode_runs_at_the_target_velocity_up_to_v_max() {
    let mut chip = usual();
    chip.write(REF_CONF_RAMP_MODE, 2, START);
    chip.write(V_TARGET, 0x1000 - 1500, START);
    assert_eq!(velocity(&mut chip, seconds(1.0)), -1000);
    chip.write(V_MAX, 2047, seconds(1.0));
    assert_eq!(velocity(&mut chip, seconds(2.0)), -1500);
    assert_eq!(chip.read(V_TARGET, seconds(2.0)), 0x1000 - 1500);
    chip.write(V_TARGET, 0, seconds(2.0));
    let end = end_of(&mut chip, seconds(2.0));
    // 1500 * 256 / 500 ramp ticks
    assert!((end.as_ticks() as f64 / 16e6 - 2.0 - 768.0 * 256e-6).abs() <= 256e-6);
    assert_eq!(flags(&mut chip, end), FLAG_STOPPED, "there is no target to reach");
}

#[test]
fn the_hard_stop_of_the_vendors_firmware_stands_at_once() {
    let mut chip = usual();
    chip.write(X_TARGET, 51_200, START);
    let now = seconds(0.7);
    chip.write(REF_CONF_RAMP_MODE, 2, now);
    chip.write(V_TARGET, 0, now);
    assert_eq!(velocity(&mut chip, now), 1000);
    chip.write(V_ACTUAL, 0, now);
    assert_eq!((velocity(&mut chip, now), chip.next_event(now)), (0, None));
    assert_eq!(chip.stopped_at(0, now), Some(now));
    assert_eq!(chip.read(X_TARGET, now), 51_200);
}

#[test]
fn leaving_ramp_mode_keeps_the_velocity_in_view() {
    let mut chip = usual();
    chip.write(X_TARGET, 51_200, START);
    chip.write(REF_CONF_RAMP_MODE, 2, seconds(0.7));
    assert_eq!(chip.read(V_TARGET, seconds(0.7)), 1000);
    assert_eq!(velocity(&mut chip, seconds(100.0)), 1000, "it does not stop on the target");
    chip.write(REF_CONF_RAMP_MODE, 0, seconds(100.0));
    let end = end_of(&mut chip, seconds(100.0));
    assert_eq!(chip.position(0, end), 51_200);
}

#[test]
fn hold_mode_takes_velocities_at_once() {
    let mut chip = usual();
    chip.write(X_TARGET, 51_200, START);
    let now = Instant::from_ticks(100 * 4096);
    chip.write(REF_CONF_RAMP_MODE, 3, now);
    assert_eq!(velocity(&mut chip, seconds(1.0)), 195, "100 * 500 / 256, and held");
    chip.write(V_TARGET, 2000, seconds(1.0));
    assert_eq!(velocity(&mut chip, seconds(1.0)), 2000);
    chip.write(V_ACTUAL, 0x1000 - 7, seconds(1.0));
    assert_eq!(velocity(&mut chip, seconds(5.0)), -7);
    chip.write(V_MIN, 1, seconds(5.0));
    assert_eq!(velocity(&mut chip, seconds(5.0)), -7, "other writes do not change it");
}

#[test]
fn a_changed_divisor_changes_the_speed_at_once() {
    let mut chip = usual();
    chip.write(REF_CONF_RAMP_MODE, 3, START);
    chip.write(V_TARGET, 1000, START);
    let (mut now, mut before) = (START, 0);
    for (pulse_div, pps) in [(3, 30_517.6), (2, 61_035.2), (5, 7_629.4)] {
        chip.write(DIVISORS, pulse_div << 12 | 7 << 8, now);
        now = Instant::from_ticks(now.as_ticks() + 16_000_000);
        let travel = chip.travel(0, now);
        assert!(((travel - before) as f64 - pps).abs() <= 1.0, "{pulse_div}: {travel}");
        before = travel;
    }
}

#[test]
fn the_microstep_count_follows_the_steps_at_any_resolution() {
    let mut chip = usual();
    chip.write(USTEP_COUNT, 10, START);
    chip.write(X_TARGET, 700, START);
    let end = end_of(&mut chip, START);
    assert_eq!(chip.read(USTEP_COUNT, end), (10 + 700) % 256);
    // With 4 microsteps one of them is 16 of the 256 places in a period.
    chip.write(DIVISORS, USUAL_DIVISORS & !7 | 2, end);
    assert_eq!(chip.read(USTEP_COUNT, end), (10 + 700) % 256, "changing it moves nothing");
    chip.write(X_TARGET, 697, end);
    let end = end_of(&mut chip, end);
    assert_eq!(chip.read(USTEP_COUNT, end), (10 + 700 - 48) % 256);
}

#[test]
fn three_axes_move_at_the_same_time() {
    let mut chip = Tmc429::new();
    for axis in 0..3u8 {
        for (index, value) in [
            (DIVISORS, USUAL_DIVISORS),
            (V_MIN, 1),
            (V_MAX, 500 * (u32::from(axis) + 1)),
            (A_MAX, 500),
            (PMUL_PDIV, 247 << 8 | 7),
            (X_TARGET, 20_000),
        ] {
            chip.write(of_axis(axis, index), value, START);
        }
    }
    // d / v + v / a
    let expected =
        [20_000.0 / 15_258.8 + 0.0655, 20_000.0 / 30_517.6 + 0.131, 20_000.0 / 45_776.4 + 0.197];
    let end = end_of(&mut chip, START);
    assert_eq!(chip.status(end) & 0b01_0101, 0b01_0101);
    for (axis, expected) in expected.into_iter().enumerate() {
        let stopped = chip.stopped_at(axis, end).unwrap().as_ticks() as f64 / 16e6;
        assert!((stopped - expected).abs() < 0.006, "{axis}: {stopped} in place of {expected}");
    }
}
