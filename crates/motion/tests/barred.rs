//! Barred directions, as limit switches make them: the axis stops, stands, and may go the other way.

use opentmcl_motion::ramp::{Barred, Limits, Mode, Phase, Ramp};
use opentmcl_motion::{Duration, Instant};

const NEGATIVE: Barred = Barred { negative: true, positive: false, soft: false };
const POSITIVE: Barred = Barred { negative: false, positive: true, soft: false };

/// 0 to 65536 units in 2^17 clocks: an acceleration of 65536 would take 2^17, 32768 takes 2^18.
const FAST: Limits = Limits {
    mode: Mode::VelocityPositive,
    target: 0,
    vstart: 0,
    a1: 0,
    v1: 0,
    amax: 32_768,
    vmax: 65_536,
    dmax: 16_384,
    d1: 16_384,
    vstop: 1,
    zero_wait: Duration::from_ticks(0),
    barred: Barred { negative: false, positive: false, soft: false },
};

fn at(ticks: u64) -> Instant {
    Instant::from_ticks(ticks)
}

fn running() -> Ramp {
    let mut ramp = Ramp::new();
    ramp.plan(at(0), &FAST);
    ramp
}

const CRUISING: Instant = Instant::from_ticks(1 << 20);

#[test]
fn a_barred_direction_stops_at_once_and_the_other_one_does_not_matter() {
    let mut ramp = running();
    ramp.plan(CRUISING, &Limits { barred: NEGATIVE, ..FAST });
    assert_eq!(ramp.velocity(CRUISING), 65_536);
    let here = ramp.position(CRUISING);
    ramp.plan(CRUISING, &Limits { barred: POSITIVE, ..FAST });
    assert_eq!(ramp.velocity(CRUISING), 0);
    assert_eq!(ramp.position(at(u64::from(u32::MAX))), here);
    assert_eq!(ramp.stopped_at(at(1 << 21)), Some(CRUISING));
}

#[test]
fn a_soft_stop_brakes_with_dmax_even_in_velocity_mode() {
    // From 65536 to VSTOP = 1 with 16384 / 2^17 per clock: 65535 * 8 = 524280 clocks.
    let mut ramp = running();
    let barred = Barred { soft: true, ..POSITIVE };
    ramp.plan(CRUISING, &Limits { barred, ..FAST });
    assert_eq!(ramp.phase(CRUISING), Phase::Decelerating);
    let stop = at(CRUISING.as_ticks() + 65_535 * 8);
    assert_eq!(ramp.next_event(CRUISING), Some(stop));
    assert_eq!(ramp.velocity(at(stop.as_ticks() - 8)), 2);
    assert_eq!(ramp.phase(stop), Phase::Standstill);
}

#[test]
fn a_soft_stop_brakes_with_d1_below_v1() {
    // 65536 to 32768 with DMAX 16384: 32768 * 8 clocks; 32768 to 1 with D1 8192: 32767 * 16.
    let mut ramp = running();
    let barred = Barred { soft: true, ..POSITIVE };
    ramp.plan(CRUISING, &Limits { barred, v1: 32_768, d1: 8_192, ..FAST });
    let stop = CRUISING.as_ticks() + 32_768 * 8 + 32_767 * 16;
    assert_eq!(ramp.next_event(CRUISING), Some(at(stop)));
}

#[test]
fn an_axis_at_rest_does_not_start_in_a_barred_direction_and_starts_when_it_is_free() {
    let mut ramp = Ramp::new();
    let limits = Limits { mode: Mode::Position, target: -1_000, barred: NEGATIVE, ..FAST };
    ramp.plan(at(0), &limits);
    assert_eq!((ramp.phase(at(0)), ramp.arrival()), (Phase::Standstill, None));
    assert_eq!(ramp.position(at(1 << 30)), 0);
    ramp.plan(at(1 << 30), &Limits { barred: Barred::default(), ..limits });
    assert_eq!(ramp.position(ramp.arrival().unwrap()), -1_000);
}

#[test]
fn a_way_back_into_a_barred_direction_ends_where_it_would_begin() {
    // The target is behind: the axis brakes, and would come back.
    let mut ramp = running();
    let limits = Limits { mode: Mode::Position, target: 0, barred: NEGATIVE, ..FAST };
    let limits = Limits { zero_wait: Duration::from_ticks(1_000), ..limits };
    ramp.plan(CRUISING, &limits);
    let stop = at(CRUISING.as_ticks() + 65_535 * 8);
    assert_eq!(ramp.phase(at(stop.as_ticks() - 1)), Phase::Decelerating);
    assert_eq!(ramp.phase(stop), Phase::Standstill);
    assert_eq!((ramp.arrival(), ramp.second_move()), (None, None));
    assert_eq!(ramp.velocity(at(1 << 40)), 0);
    assert_eq!(ramp.stopped_at(at(1 << 40)), Some(stop));
}

#[test]
fn after_the_stop_the_axis_leaves_in_the_free_direction_when_the_wait_is_over() {
    let mut ramp = running();
    let limits = Limits { mode: Mode::VelocityNegative, barred: POSITIVE, ..FAST };
    ramp.plan(CRUISING, &Limits { zero_wait: Duration::from_ticks(1_000), ..limits });
    assert_eq!((ramp.phase(CRUISING), ramp.velocity(CRUISING)), (Phase::Waiting, 0));
    let start = at(CRUISING.as_ticks() + 1_000);
    assert_eq!(ramp.phase(start), Phase::Accelerating);
    assert!(ramp.velocity(at(start.as_ticks() + 1_000)) < 0);
}

#[test]
fn writing_the_counter_keeps_the_part_of_a_microstep() {
    // At 65536 units a microstep takes 256 clocks; the counter changes half way between two.
    let mut ramp = running();
    let now = CRUISING;
    let next = (1..=256).find(|&n| ramp.position(at(now.as_ticks() + n)) != ramp.position(now));
    let before = ramp.position(now);
    ramp.set_position(now, 77);
    let next_after = (1..=256).find(|&n| ramp.position(at(now.as_ticks() + n)) != 77);
    assert_ne!(before, 77);
    assert_eq!(next_after, next);
}
