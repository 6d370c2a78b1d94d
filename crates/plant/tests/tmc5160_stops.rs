//! Stop switches, their latches, and the stop by StallGuard2 (datasheet 6.3.2.1, 6.3.2.2).

use opentmcl_motion::{Instant, TICKS_PER_SECOND};
use opentmcl_plant::tmc5160::{Sense, Tmc5160, registers::*};

const STOP_LEFT: u32 = 1 << 0;
const STOP_RIGHT: u32 = 1 << 1;
const SG_STOP: u32 = 1 << 10;
const SOFT: u32 = 1 << 11;
const EVENT_STOP_LEFT: u32 = 1 << 4;
const EVENT_STOP_RIGHT: u32 = 1 << 5;
const EVENT_STOP_SG: u32 = 1 << 6;

fn seconds(seconds: u64) -> Instant {
    Instant::from_ticks(seconds * TICKS_PER_SECOND)
}

fn chip(registers: &[(u8, u32)]) -> Tmc5160 {
    let mut chip = Tmc5160::new();
    let limits = [(AMAX, 4_000), (DMAX, 2_000), (VMAX, 50_000), (VSTOP, 10)];
    for &(address, value) in limits.iter().chain(registers) {
        chip.write(address, value, seconds(0));
    }
    chip
}

fn velocity(chip: &mut Tmc5160, now: Instant) -> i32 {
    (chip.read(VACTUAL, now) << 8).cast_signed() >> 8
}

#[test]
fn the_right_switch_stops_positive_motion_at_once_until_it_opens() {
    let mut chip = chip(&[(SW_MODE, STOP_RIGHT), (RAMPMODE, 1)]);
    chip.set_reference_inputs(false, true, seconds(1));
    assert_eq!(velocity(&mut chip, seconds(1)), 0);
    let here = chip.read(XACTUAL, seconds(1));
    assert_eq!(chip.read(XACTUAL, seconds(2)), here);
    assert_eq!(chip.read(RAMP_STAT, seconds(2)) & EVENT_STOP_RIGHT, EVENT_STOP_RIGHT);
    chip.set_reference_inputs(false, false, seconds(3));
    assert_eq!(chip.read(RAMP_STAT, seconds(3)) & EVENT_STOP_RIGHT, 0);
    assert_eq!(velocity(&mut chip, seconds(5)), 50_000, "it goes on by itself");
}

#[test]
fn a_switch_stops_only_the_direction_that_is_its_own() {
    for (mode, direction, left, right) in [
        (STOP_LEFT | STOP_RIGHT, 1, true, false),
        (STOP_LEFT | STOP_RIGHT, 2, false, true),
        (STOP_LEFT, 1, false, true),
        // Swapped: the left input is the right switch.
        (STOP_LEFT | STOP_RIGHT | 1 << 4, 1, false, true),
        // Inverted: a closed right switch is a free way.
        (STOP_RIGHT | 1 << 3, 1, false, true),
    ] {
        let mut chip = chip(&[]);
        chip.set_reference_inputs(left, right, seconds(0));
        chip.write(SW_MODE, mode, seconds(0));
        chip.write(RAMPMODE, direction, seconds(0));
        assert_eq!(velocity(&mut chip, seconds(2)).abs(), 50_000, "{mode:#b} {left} {right}");
    }
}

#[test]
fn the_position_mode_goes_on_to_its_target_when_the_switch_opens() {
    let mut chip = chip(&[(SW_MODE, STOP_LEFT), (XTARGET, (-100_000i32).cast_unsigned())]);
    chip.set_reference_inputs(true, false, seconds(1));
    let here = chip.read(XACTUAL, seconds(1)).cast_signed();
    assert!(here < 0);
    chip.write(XTARGET, 5_000, seconds(2));
    assert_eq!(chip.read(XACTUAL, seconds(5)), 5_000, "away from the switch is free");
    chip.write(XTARGET, (-100_000i32).cast_unsigned(), seconds(5));
    assert_eq!(chip.read(XACTUAL, seconds(9)), 5_000, "back to it is not");
    chip.write(SW_MODE, 0, seconds(9));
    assert_eq!(chip.read(XACTUAL, seconds(20)).cast_signed(), -100_000);
}

#[test]
fn a_soft_stop_is_a_ramp_with_dmax() {
    // From 50000 units to VSTOP = 10 with 2000 / 2^17 per clock: 49990 * 65.536 = 3276144.6 clocks.
    let mut chip = chip(&[(SW_MODE, STOP_RIGHT | SOFT), (RAMPMODE, 1)]);
    chip.set_reference_inputs(false, true, seconds(2));
    let stop = chip.next_event(seconds(2)).unwrap();
    assert_eq!(stop.as_ticks() - seconds(2).as_ticks(), 3_276_144);
    assert_eq!(velocity(&mut chip, seconds(2)), 50_000);
    assert_eq!(velocity(&mut chip, stop), 0);
}

#[test]
fn the_wait_at_zero_follows_a_hard_stop() {
    // 31250 * 512 clocks = 1 s.
    let mut chip = chip(&[(SW_MODE, STOP_RIGHT), (RAMPMODE, 1), (TZEROWAIT, 31_250)]);
    chip.set_reference_inputs(false, true, seconds(2));
    let soon = Instant::from_ticks(seconds(2).as_ticks() + 1_000);
    chip.set_reference_inputs(false, false, soon);
    assert_eq!(velocity(&mut chip, Instant::from_ticks(seconds(3).as_ticks() - 1)), 0);
    assert_eq!(chip.read(RAMP_STAT, soon) >> 11 & 1, 1);
    assert_ne!(velocity(&mut chip, Instant::from_ticks(seconds(3).as_ticks() + 1_000)), 0);
}

#[test]
fn the_position_is_latched_at_the_edges_that_are_enabled() {
    // SW_MODE bits 5 to 8: left closing, left opening, right closing, right opening.
    for (bit, flag, edges) in [
        (5, 1 << 2, [true, false, false, false]),
        (6, 1 << 2, [false, true, false, false]),
        (7, 1 << 3, [false, false, true, false]),
        (8, 1 << 3, [false, false, false, true]),
    ] {
        let mut chip = chip(&[(SW_MODE, 1 << bit), (RAMPMODE, 1)]);
        let inputs = [(true, false), (false, false), (false, true), (false, false)];
        for ((time, (left, right)), latches) in (1..).zip(inputs).zip(edges) {
            let now = seconds(time);
            chip.set_reference_inputs(left, right, now);
            let position = chip.read(XACTUAL, now);
            assert_eq!(chip.read(RAMP_STAT, now) & flag != 0, latches, "bit {bit} at {time} s");
            assert_eq!(chip.read(XLATCH, now) == position, latches, "bit {bit} at {time} s");
            chip.write(RAMP_STAT, flag, now);
        }
    }
}

#[test]
fn the_encoder_is_latched_together_with_the_position_if_asked() {
    for (mode, latched) in [(1 << 5, 0), (1 << 5 | 1 << 9, 321)] {
        let mut chip = chip(&[(SW_MODE, mode)]);
        chip.set_encoder_count(321, seconds(0));
        chip.set_reference_inputs(true, false, seconds(0));
        assert_eq!(chip.read(ENC_LATCH, seconds(0)), latched);
    }
}

fn stalling(registers: &[(u8, u32)]) -> Tmc5160 {
    let mut chip = chip(&[(TCOOLTHRS, 0xF_FFFF), (SW_MODE, SG_STOP), (RAMPMODE, 1)]);
    for &(address, value) in registers {
        chip.write(address, value, seconds(0));
    }
    chip
}

#[test]
fn a_stall_stops_only_with_sg_stop_above_the_threshold_speed_and_without_stealthchop() {
    assert!(stalling(&[]).stall_stops(seconds(1)));
    assert!(!stalling(&[(SW_MODE, 0)]).stall_stops(seconds(1)));
    assert!(!stalling(&[(VMAX, 0)]).stall_stops(seconds(1)), "standing");
    // 50000 units are a TSTEP of 2^24 / 50000 = 335.
    assert!(!stalling(&[(TCOOLTHRS, 300)]).stall_stops(seconds(1)));
    assert!(!stalling(&[(TCOOLTHRS, 300), (GCONF, 1 << 2)]).stall_stops(seconds(1)));
}

#[test]
fn after_a_stall_the_axis_stands_until_the_event_or_sg_stop_is_cleared() {
    for (address, value) in [(RAMP_STAT, EVENT_STOP_SG), (SW_MODE, 0)] {
        let mut chip = stalling(&[]);
        chip.stall(seconds(2));
        assert_eq!(velocity(&mut chip, seconds(2)), 0);
        assert_eq!(chip.read(RAMP_STAT, seconds(3)) & EVENT_STOP_SG, EVENT_STOP_SG);
        chip.write(VMAX, 40_000, seconds(3));
        chip.write(RAMPMODE, 2, seconds(3));
        assert_eq!(velocity(&mut chip, seconds(5)), 0, "held whatever is asked for");
        chip.write(address, value, seconds(5));
        assert_eq!(velocity(&mut chip, seconds(7)), -40_000);
    }
}

#[test]
fn a_driver_without_a_motor_shows_no_stall() {
    let mut chip = stalling(&[]);
    assert_eq!(chip.read(DRV_STATUS, seconds(2)) & (1 << 24 | 0x3FF), 0);
    assert_eq!(chip.read(RAMP_STAT, seconds(2)) >> 13, 0);
    chip.set_sense(Sense { stallguard: 0, ..Sense::IDEAL }, seconds(2));
    assert_eq!(chip.read(DRV_STATUS, seconds(2)) & (1 << 24 | 0x3FF), 1 << 24);
    assert_eq!(chip.read(RAMP_STAT, seconds(2)) >> 13, 1);
    chip.set_sense(Sense { stallguard: 5, ..Sense::IDEAL }, seconds(2));
    assert_eq!(chip.read(DRV_STATUS, seconds(2)) & (1 << 24 | 0x3FF), 5);
    assert_eq!(chip.read(RAMP_STAT, seconds(2)) & EVENT_STOP_LEFT, 0);
}

#[test]
fn sgt_shifts_the_result_by_16_a_unit_over_its_whole_range() {
    for (sgt, raw, result) in [
        (0, 500, 500),
        (1, 500, 516),
        (127, 500, 484),
        (63, 0, 1008),
        (63, 16, 1023),
        (64, 1023, 0),
    ] {
        let chip = chip(&[(COOLCONF, sgt << 16)]);
        assert_eq!(chip.stallguard(raw), result, "SGT {sgt}");
    }
}
