//! The TMC5160 moves: everything here goes through registers alone, as a firmware does.

use opentmcl_motion::{Instant, TICKS_PER_SECOND};
use opentmcl_plant::tmc5160::Tmc5160;
use opentmcl_plant::tmc5160::registers::*;

const EVENT_POS_REACHED: u32 = 1 << 7;
const VELOCITY_REACHED: u32 = 1 << 8;
const POSITION_REACHED: u32 = 1 << 9;
const VZERO: u32 = 1 << 10;
const T_ZEROWAIT_ACTIVE: u32 = 1 << 11;
const SECOND_MOVE: u32 = 1 << 12;

/// The ramp of the TMCM-6214's factory settings: 51200 pps, 51200 pps², half of each below V1.
const FACTORY: [(u8, u32); 8] = [
    (VSTART, 1),
    (A1, 220),
    (V1, 26_843),
    (AMAX, 439),
    (VMAX, 53_687),
    (DMAX, 439),
    (D1, 220),
    (VSTOP, 10),
];

fn at(ticks: u64) -> Instant {
    Instant::from_ticks(ticks)
}

fn factory_chip() -> Tmc5160 {
    let mut chip = Tmc5160::new();
    for (address, value) in FACTORY {
        chip.write(address, value, at(0));
    }
    chip.write(RAMP_STAT, u32::MAX, at(0));
    chip
}

fn position(chip: &mut Tmc5160, now: Instant) -> i32 {
    chip.read(XACTUAL, now).cast_signed()
}

/// VACTUAL with the sign of its 24 bits extended.
fn velocity(chip: &mut Tmc5160, now: Instant) -> i32 {
    (chip.read(VACTUAL, now) << 8).cast_signed() >> 8
}

/// Follows the events of the chip until one after which RAMP_STAT has these bits.
fn wait_for(chip: &mut Tmc5160, mut now: Instant, bits: u32) -> Instant {
    loop {
        now = chip.next_event(now).expect("the chip comes to rest without setting the bits");
        if chip.read(RAMP_STAT, now) & bits == bits {
            return now;
        }
    }
}

#[test]
fn a_factory_move_of_512000_microsteps_takes_11_75_seconds() {
    let mut chip = factory_chip();
    chip.write(XTARGET, 512_000, at(0));
    assert_eq!(chip.read(RAMP_STAT, at(0)) & POSITION_REACHED, 0);
    let arrival = wait_for(&mut chip, at(0), POSITION_REACHED | EVENT_POS_REACHED | VZERO);
    assert_eq!(position(&mut chip, arrival), 512_000);
    assert_eq!(velocity(&mut chip, arrival), 0);
    let seconds = arrival.as_ticks() as f64 / TICKS_PER_SECOND as f64;
    assert!((seconds / 11.75 - 1.0).abs() < 0.01, "{seconds} s");
    assert_eq!(chip.next_event(arrival), None, "at rest nothing is to come");
    let before = at(arrival.as_ticks() - 1);
    let mut chip = factory_chip();
    chip.write(XTARGET, 512_000, at(0));
    assert_eq!(chip.read(RAMP_STAT, before) & (POSITION_REACHED | EVENT_POS_REACHED), 0);
}

#[test]
fn vmax_53687_is_51200_microsteps_per_second() {
    let mut chip = factory_chip();
    chip.write(RAMPMODE, 1, at(0));
    let cruising = wait_for(&mut chip, at(0), VELOCITY_REACHED);
    assert_eq!(velocity(&mut chip, cruising), 53_687);
    // 16 MHz: 53687 / (439 / 2^17) clocks, rounded down to whole clocks.
    assert_eq!(cruising.as_ticks(), (53_687 << 17) / 439);
    let start = position(&mut chip, cruising);
    let end = position(&mut chip, at(cruising.as_ticks() + TICKS_PER_SECOND));
    assert!(((end - start) - 51_200).abs() <= 1, "{} microsteps in one second", end - start);
    assert_eq!(chip.next_event(cruising), None);
}

#[test]
fn the_negative_velocity_mode_runs_the_other_way_and_vactual_has_24_bits() {
    let mut chip = factory_chip();
    chip.write(RAMPMODE, 2, at(0));
    let cruising = wait_for(&mut chip, at(0), VELOCITY_REACHED);
    assert_eq!(chip.read(VACTUAL, cruising), (1 << 24) - 53_687);
    let later = at(cruising.as_ticks() + TICKS_PER_SECOND);
    let travel = position(&mut chip, later) - position(&mut chip, cruising);
    assert!((travel + 51_200).abs() <= 1, "{travel} microsteps in one second");
}

#[test]
fn vmax_zero_stops_with_amax_and_hold_keeps_the_velocity() {
    let mut chip = factory_chip();
    chip.write(RAMPMODE, 1, at(0));
    let cruising = wait_for(&mut chip, at(0), VELOCITY_REACHED);
    chip.write(RAMPMODE, 3, cruising);
    chip.write(VMAX, 0, cruising);
    let later = at(cruising.as_ticks() + TICKS_PER_SECOND);
    assert_eq!(velocity(&mut chip, later), 53_687);
    chip.write(RAMPMODE, 1, later);
    let stop = wait_for(&mut chip, later, VZERO | VELOCITY_REACHED);
    assert_eq!(stop.as_ticks() - later.as_ticks(), (53_687 << 17) / 439);
}

#[test]
fn tstep_counts_clocks_per_256th_of_a_full_step() {
    let mut chip = factory_chip();
    assert_eq!(chip.read(TSTEP, at(0)), (1 << 20) - 1, "standing");
    chip.write(RAMPMODE, 1, at(0));
    let cruising = wait_for(&mut chip, at(0), VELOCITY_REACHED);
    assert_eq!(chip.read(TSTEP, cruising), 16_000_000 / 51_200);
    // MRES 4: 16 microsteps per full step, each of them 16/256.
    chip.write(CHOPCONF, 0x1441_0150, cruising);
    assert_eq!(chip.read(TSTEP, cruising), (1 << 24) / (53_687 * 16));
}

#[test]
fn writing_xactual_in_position_mode_starts_a_motion_to_the_target() {
    let mut chip = factory_chip();
    assert_eq!(chip.next_event(at(0)), None);
    chip.write(XACTUAL, 1000, at(0));
    assert_eq!(position(&mut chip, at(0)), 1000);
    let arrival = wait_for(&mut chip, at(0), EVENT_POS_REACHED);
    assert_eq!(position(&mut chip, arrival), 0);
}

#[test]
fn an_event_stays_until_a_one_is_written_to_it() {
    let mut chip = factory_chip();
    chip.write(XTARGET, 100, at(0));
    let arrival = wait_for(&mut chip, at(0), EVENT_POS_REACHED);
    let events = |chip: &mut Tmc5160| chip.read(RAMP_STAT, arrival) & EVENT_POS_REACHED;
    assert_eq!(events(&mut chip), EVENT_POS_REACHED, "reading does not clear");
    chip.write(RAMP_STAT, !EVENT_POS_REACHED, arrival);
    assert_eq!(events(&mut chip), EVENT_POS_REACHED, "other bits do not clear");
    chip.write(RAMP_STAT, EVENT_POS_REACHED, arrival);
    assert_eq!(events(&mut chip), 0);
    assert_ne!(chip.read(RAMP_STAT, arrival) & POSITION_REACHED, 0, "a state is not an event");
    chip.write(XTARGET, 100, arrival);
    assert_eq!(events(&mut chip), 0, "the same target again is no new arrival");
    chip.write(XTARGET, 101, arrival);
    chip.write(XTARGET, 100, arrival);
    assert_eq!(events(&mut chip), EVENT_POS_REACHED, "a target that becomes the position is one");
}

#[test]
fn an_event_is_not_lost_when_a_write_comes_before_the_read() {
    let mut chip = factory_chip();
    chip.write(XTARGET, 100, at(0));
    let long_after = at(TICKS_PER_SECOND);
    chip.write(XTARGET, 50_000, long_after);
    assert_eq!(chip.read(RAMP_STAT, long_after) & POSITION_REACHED, 0);
    assert_ne!(chip.read(RAMP_STAT, long_after) & EVENT_POS_REACHED, 0);
}

#[test]
fn a_target_behind_the_axis_makes_a_second_move_after_the_wait() {
    let mut chip = factory_chip();
    chip.write(TZEROWAIT, 31_250, at(0)); // 31250 * 512 clocks = 1 s
    chip.write(XTARGET, 512_000, at(0));
    let turn = at(5 * TICKS_PER_SECOND);
    let here = position(&mut chip, turn);
    chip.write(XTARGET, here.cast_unsigned(), turn);
    let standing = wait_for(&mut chip, turn, VZERO | T_ZEROWAIT_ACTIVE);
    assert_eq!(chip.read(RAMP_STAT, standing) & SECOND_MOVE, 0);
    assert!(position(&mut chip, standing) > here);
    let back = wait_for(&mut chip, standing, SECOND_MOVE);
    assert_eq!(back.as_ticks() - standing.as_ticks(), TICKS_PER_SECOND);
    assert_eq!(chip.read(RAMP_STAT, back) & T_ZEROWAIT_ACTIVE, 0);
    let arrival = wait_for(&mut chip, back, EVENT_POS_REACHED);
    assert_eq!(position(&mut chip, arrival), here);
    assert_ne!(
        chip.read(RAMP_STAT, arrival) & T_ZEROWAIT_ACTIVE,
        0,
        "every stop is followed by it"
    );
    let rested = chip.next_event(arrival).unwrap();
    assert_eq!(rested.as_ticks() - arrival.as_ticks(), TICKS_PER_SECOND);
    assert_eq!(chip.read(RAMP_STAT, rested) & T_ZEROWAIT_ACTIVE, 0);
    chip.write(RAMP_STAT, SECOND_MOVE, rested);
    assert_eq!(chip.read(RAMP_STAT, rested) & SECOND_MOVE, 0);
}

#[test]
fn reading_in_between_changes_nothing() {
    let mut asked = factory_chip();
    let mut left_alone = factory_chip();
    for chip in [&mut asked, &mut left_alone] {
        chip.write(XTARGET, 100_000, at(0));
    }
    for ticks in (0..64_000_000).step_by(99_991) {
        for address in 0..128 {
            asked.read(address, at(ticks));
        }
    }
    for address in 0..128 {
        let end = at(64_000_000);
        assert_eq!(asked.read(address, end), left_alone.read(address, end), "{address:#04x}");
    }
}

#[test]
fn the_microstep_counter_follows_the_motor_and_not_the_position_register() {
    let mut chip = factory_chip();
    chip.write(XTARGET, 1_300, at(0));
    let arrival = wait_for(&mut chip, at(0), EVENT_POS_REACHED);
    assert_eq!(chip.read(MSCNT, arrival), 1_300 - 1_024);
    chip.write(RAMPMODE, 3, arrival);
    chip.write(XACTUAL, 77, arrival);
    assert_eq!(chip.read(MSCNT, arrival), 276, "the motor has not moved");
    // MRES 8: full steps, a quarter of the period each.
    chip.write(CHOPCONF, 0x1841_0150, arrival);
    assert_eq!(chip.read(MSCNT, arrival), 276);
    chip.write(XTARGET, 78, arrival);
    chip.write(RAMPMODE, 0, arrival);
    chip.write(RAMP_STAT, u32::MAX, arrival);
    let next = wait_for(&mut chip, arrival, EVENT_POS_REACHED);
    assert_eq!(position(&mut chip, next), 78);
    assert_eq!(chip.read(MSCNT, next), 276 + 256);
}

#[test]
fn stealth_chop_is_on_below_its_threshold_speed() {
    const STEALTH: u32 = 1 << 14;
    let mut chip = factory_chip();
    chip.write(TPWMTHRS, 3_200, at(0)); // 5000 pps
    assert_eq!(chip.read(DRV_STATUS, at(0)) & STEALTH, 0, "not enabled");
    chip.write(GCONF, 1 << 2, at(0));
    assert_eq!(chip.read(DRV_STATUS, at(0)) & STEALTH, STEALTH);
    chip.write(RAMPMODE, 1, at(0));
    // With the hysteresis of a sixteenth an axis gets faster than the threshold at
    // TSTEP < 3200 * 15 / 16 - 1 = 2999, that is from 5595 units on (2^24 / 5595 = 2998.6).
    for (vmax, stealth) in [(5_000, STEALTH), (5_594, STEALTH), (5_595, 0), (5_000, STEALTH)] {
        chip.write(VMAX, vmax, at(0));
        let mut chip = chip.clone();
        let cruising = wait_for(&mut chip, at(0), VELOCITY_REACHED);
        assert_eq!(chip.read(DRV_STATUS, cruising) & STEALTH, stealth, "VMAX {vmax}");
    }
}

#[test]
fn after_a_motion_the_current_waits_and_goes_down_step_by_step() {
    let mut chip = factory_chip();
    chip.write(IHOLD_IRUN, 7 << 16 | 16 << 8 | 8, at(0));
    chip.write(TPOWERDOWN, 122, at(0)); // 122 * 2^18 clocks = 2.0 s
    chip.write(XTARGET, 10_000, at(0));
    let moving = at(1_000_000);
    let current = |chip: &mut Tmc5160, now: Instant| chip.read(DRV_STATUS, now) >> 16 & 0x1F;
    let stands = |chip: &mut Tmc5160, now: Instant| chip.read(DRV_STATUS, now) >> 31 == 1;
    assert_eq!(current(&mut chip, moving), 16);
    assert!(!stands(&mut chip, moving));
    let stop = wait_for(&mut chip, moving, EVENT_POS_REACHED).as_ticks();
    assert!(!stands(&mut chip, at(stop + (1 << 20) - 1)));
    assert!(stands(&mut chip, at(stop + (1 << 20))));
    let down = stop + (1 << 20) + (122 << 18);
    let step = 7 << 18;
    assert_eq!(current(&mut chip, at(down + step - 1)), 16);
    for steps in 1..=8 {
        let now = down + steps * step;
        assert_eq!(current(&mut chip, at(now - 1)), 17 - steps as u32);
        assert_eq!(current(&mut chip, at(now)), 16 - steps as u32);
    }
    assert_eq!(current(&mut chip, at(down + 1_000 * step)), 8, "the hold current is the end of it");
    let again = at(down + 1_000 * step);
    chip.write(XTARGET, 0, again);
    assert_eq!(current(&mut chip, again), 16, "motion has the full current at once");
    assert!(!stands(&mut chip, again));
}

#[test]
fn without_a_step_delay_the_hold_current_comes_at_once() {
    let mut chip = Tmc5160::new();
    chip.write(IHOLD_IRUN, 31 << 8, at(0));
    chip.write(TPOWERDOWN, 0, at(0));
    let current = |chip: &mut Tmc5160, now: u64| chip.read(DRV_STATUS, at(now)) >> 16 & 0x1F;
    assert_eq!(current(&mut chip, (1 << 20) - 1), 31);
    assert_eq!(current(&mut chip, 1 << 20), 0);
}
