//! The reference switches of the TMC429: stops, edges, polarity, latch.

use opentmcl_motion::Instant;
use opentmcl_plant::tmc429::Tmc429;
use opentmcl_plant::tmc429::registers::*;

const START: Instant = Instant::from_ticks(0);

fn seconds(value: f64) -> Instant {
    Instant::from_ticks((value * 16e6) as u64)
}

/// A chip with right switches, whose axis 1 runs in velocity mode with 1000 (30 518 microsteps per
/// second, reached after 131 ms).
fn running(v_target: i32) -> Tmc429 {
    let mut chip = Tmc429::new();
    chip.write(IF_CONFIGURATION, ENABLE_RIGHT_SWITCHES, START);
    for (index, value) in [
        (DIVISORS, 3 << 12 | 7 << 8 | 6),
        (V_MIN, 1),
        (V_MAX, 2047),
        (A_MAX, 500),
        (REF_CONF_RAMP_MODE, 2),
        (V_TARGET, v_target.cast_unsigned() & 0xFFF),
    ] {
        chip.write(of_axis(1, index), value, START);
    }
    chip
}

fn flags(chip: &mut Tmc429, now: Instant) -> u32 {
    chip.read(of_axis(1, INTERRUPT), now) & 0xFF
}

#[test]
fn a_switch_stops_the_direction_it_stands_in_and_no_other() {
    let now = seconds(1.0);
    for (v_target, left, right, stops) in [
        (1000, false, true, true),
        (1000, true, false, false),
        (-1000, true, false, true),
        (-1000, false, true, false),
    ] {
        let mut chip = running(v_target);
        chip.set_reference_inputs(1, left, right, now);
        assert_eq!(chip.velocity(1, now), if stops { 0 } else { v_target });
        let later = seconds(2.0);
        assert_eq!(chip.velocity(1, later), if stops { 0 } else { v_target });
        chip.set_reference_inputs(1, false, false, later);
        assert_eq!(chip.velocity(1, seconds(3.0)), v_target, "it goes on when the switch opens");
    }
}

#[test]
fn a_disabled_stop_lets_the_axis_pass_and_the_edge_is_seen_all_the_same() {
    let mut chip = running(1000);
    let configuration = of_axis(1, REF_CONF_RAMP_MODE);
    chip.write(configuration, 2 | DISABLE_STOP_RIGHT, START);
    let now = seconds(1.0);
    chip.set_reference_inputs(1, false, true, now);
    assert_eq!((chip.velocity(1, now), flags(&mut chip, now)), (1000, FLAG_RIGHT_CLOSED));
    chip.write(configuration, 2 | DISABLE_STOP_LEFT, now);
    assert_eq!(chip.velocity(1, now), 0, "enabling it with the switch closed stops");
}

#[test]
fn a_soft_stop_takes_the_ramp() {
    let mut chip = running(1000);
    chip.write(of_axis(1, REF_CONF_RAMP_MODE), 2 | SOFT_STOP, START);
    let now = seconds(1.0);
    chip.set_reference_inputs(1, false, true, now);
    assert_eq!(chip.velocity(1, now), 1000);
    let end = chip.next_event(now).unwrap();
    // 1000 * 256 / 500 = 512 ramp ticks of 256 µs
    let took = end.as_ticks() as f64 / 16e6 - 1.0;
    assert!((took - 512.0 * 256e-6).abs() <= 256e-6, "{took}");
    assert_eq!((chip.velocity(1, end), chip.next_event(end)), (0, None));
    assert_eq!(flags(&mut chip, end), FLAG_RIGHT_CLOSED | FLAG_STOPPED);
}

#[test]
fn levels_stand_in_one_register_with_the_right_switch_of_axis_0_first() {
    let mut chip = Tmc429::new();
    chip.write(IF_CONFIGURATION, ENABLE_RIGHT_SWITCHES, START);
    for (bit, (axis, left)) in [(0, false), (0, true), (1, false), (1, true), (2, false), (2, true)]
        .into_iter()
        .enumerate()
    {
        chip.set_reference_inputs(axis, left, !left, START);
        assert_eq!(chip.read(REFERENCE_SWITCHES, START), 1 << bit);
        // The status has the left ones in bits 1, 3 and 5.
        let status = chip.status(START) & 0b10_1010;
        assert_eq!(status, if left { 1 << bit } else { 0 });
        chip.set_reference_inputs(axis, false, false, START);
    }
}

#[test]
fn polarity_turns_all_levels_over() {
    let mut chip = running(1000);
    chip.write(IF_CONFIGURATION, ENABLE_RIGHT_SWITCHES | INVERT_SWITCHES, START);
    assert_eq!(chip.read(REFERENCE_SWITCHES, START), 0x3F);
    chip.set_reference_inputs(1, true, true, START);
    assert_eq!(chip.read(REFERENCE_SWITCHES, START), 0x33);
}

#[test]
fn right_switches_need_an_input_of_their_own_or_a_multiplexer() {
    let mut chip = running(1000);
    chip.set_reference_inputs(0, true, true, START);
    chip.set_reference_inputs(2, true, false, START);
    assert_eq!(chip.read(REFERENCE_SWITCHES, START), 0b10_0011);
    chip.write(IF_CONFIGURATION, 0, START);
    assert_eq!(chip.read(REFERENCE_SWITCHES, START), 0b10_0010);
    chip.write(GLOBAL_PARAMETERS, SWITCHES_MULTIPLEXED, START);
    assert_eq!(chip.read(REFERENCE_SWITCHES, START), 0b10_0011);
    chip.write(GLOBAL_PARAMETERS, THIRD_IS_RIGHT_OF_FIRST, START);
    assert_eq!(chip.read(REFERENCE_SWITCHES, START), 0b00_0011);
    chip.set_reference_inputs(2, false, true, START);
    assert_eq!(chip.read(REFERENCE_SWITCHES, START), 0b00_0010);
}

#[test]
fn the_latch_takes_the_position_at_the_next_closing_of_the_reference_switch() {
    for (configuration, is_right) in [(2, false), (2 | REFERENCE_IS_RIGHT, true)] {
        let mut chip = running(1000);
        let address = of_axis(1, REF_CONF_RAMP_MODE);
        let all_off = DISABLE_STOP_LEFT | DISABLE_STOP_RIGHT;
        chip.write(address, configuration | all_off, START);
        let latched = |chip: &mut Tmc429, now| chip.read(of_axis(1, X_LATCHED), now);
        let close = |chip: &mut Tmc429, right: bool, closed: bool, now| {
            chip.set_reference_inputs(1, closed && !right, closed && right, now);
        };
        close(&mut chip, is_right, true, seconds(0.5));
        assert_eq!(latched(&mut chip, seconds(0.6)), 0, "nobody has armed it");
        chip.write(of_axis(1, X_LATCHED), 0, seconds(0.6));
        assert_eq!(chip.read(address, seconds(0.6)) & LATCH_WAITS, LATCH_WAITS);
        chip.write(address, configuration | all_off, seconds(0.6));
        close(&mut chip, is_right, false, seconds(0.7));
        close(&mut chip, !is_right, true, seconds(0.8));
        close(&mut chip, !is_right, false, seconds(0.9));
        assert_eq!(chip.read(address, seconds(0.9)) & LATCH_WAITS, LATCH_WAITS, "waits still");
        close(&mut chip, is_right, true, seconds(1.0));
        let position = chip.position(1, seconds(1.0));
        close(&mut chip, is_right, false, seconds(1.1));
        close(&mut chip, is_right, true, seconds(1.2));
        // v t - v² / 2a
        assert!((f64::from(position) - (30_517.6 - 2000.0)).abs() < 10.0);
        assert_eq!(latched(&mut chip, seconds(2.0)), position.cast_unsigned());
        assert_eq!(chip.read(address, seconds(2.0)), configuration | all_off);
    }
}

#[test]
fn a_reference_switch_outside_its_tolerance_is_reported() {
    let mut chip = running(0);
    chip.write(of_axis(1, DX_REF_TOLERANCE), 100, START);
    for (position, wrong) in [(100, false), (101, true), (-100, false), (-101, true)] {
        chip.write(of_axis(1, X_ACTUAL), i32::cast_unsigned(position), START);
        chip.set_reference_inputs(1, true, false, START);
        assert_eq!(flags(&mut chip, START) & FLAG_REFERENCE_WRONG != 0, wrong, "{position}");
        chip.set_reference_inputs(1, false, false, START);
        chip.write(of_axis(1, INTERRUPT), 0xFF, START);
    }
}

#[test]
fn a_barred_axis_stops_only_once() {
    let mut chip = running(1000);
    chip.write(of_axis(1, REF_CONF_RAMP_MODE), 3, START);
    chip.write(of_axis(1, V_TARGET), 1000, START);
    let now = seconds(1.0);
    chip.set_reference_inputs(1, false, true, now);
    chip.write(of_axis(1, INTERRUPT), 0xFF, now);
    let later = seconds(2.0);
    chip.write(of_axis(1, V_MIN), 2, later);
    chip.write(of_axis(1, V_TARGET), 900, later);
    assert_eq!((flags(&mut chip, later), chip.stopped_at(1, later)), (0, Some(now)));
}
