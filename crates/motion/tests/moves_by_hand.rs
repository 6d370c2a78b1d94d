//! Single ramps whose course can be calculated by hand or counted clock by clock.

use opentmcl_motion::ramp::{Barred, Limits, Mode, Phase, Ramp};
use opentmcl_motion::{Duration, Instant, TICKS_PER_SECOND};

/// The factory settings of the TMCM-6214: 51200 pps, 51200 pps², half of each below V1.
const FACTORY: Limits = Limits {
    mode: Mode::Position,
    target: 0,
    vstart: 1,
    a1: 220,
    v1: 26_843,
    amax: 439,
    vmax: 53_687,
    dmax: 439,
    d1: 220,
    vstop: 10,
    zero_wait: Duration::from_ticks(0),
    barred: Barred { negative: false, positive: false, soft: false },
};

fn at(ticks: u64) -> Instant {
    Instant::from_ticks(ticks)
}

fn planned(limits: &Limits) -> Ramp {
    let mut ramp = Ramp::new();
    ramp.plan(at(0), limits);
    ramp
}

fn seconds(time: Instant) -> f64 {
    time.as_ticks() as f64 / TICKS_PER_SECOND as f64
}

/// Speed in microsteps per second and acceleration in microsteps per second squared.
fn pps(register: u32) -> f64 {
    f64::from(register) * 16e6 / f64::from(1 << 24)
}

fn pps2(register: u32) -> f64 {
    f64::from(register) * 16e6 * 16e6 / f64::from(1 << 24) / f64::from(1 << 17)
}

/// Time of a move that reaches VMAX, from the textbook.
fn six_point_seconds(limits: &Limits) -> f64 {
    let (start, knee, top, stop) =
        (pps(limits.vstart), pps(limits.v1), pps(limits.vmax), pps(limits.vstop));
    let legs = [
        (start, knee, pps2(limits.a1)),
        (knee, top, pps2(limits.amax)),
        (knee, top, pps2(limits.dmax)),
        (stop, knee, pps2(limits.d1)),
    ];
    let time: f64 = legs.iter().map(|(low, high, a)| (high - low) / a).sum();
    let way: f64 = legs.iter().map(|(low, high, a)| (high * high - low * low) / (2.0 * a)).sum();
    time + (f64::from(limits.target) - way) / top
}

#[test]
fn ten_revolutions_with_factory_settings_take_11_75_seconds() {
    let limits = Limits { target: 512_000, ..FACTORY };
    let expected = six_point_seconds(&limits);
    assert!((expected / 11.75 - 1.0).abs() < 0.01, "{expected} s by hand");
    let ramp = planned(&limits);
    let arrival = seconds(ramp.arrival().unwrap());
    assert!((arrival - expected).abs() < 1e-3, "{arrival} s against {expected} s by hand");
    assert_eq!(ramp.position(ramp.arrival().unwrap()), 512_000);
    // The same the other way, but for the last half microstep: it is as long in both directions.
    let back = planned(&Limits { target: -512_000, ..FACTORY });
    let difference = seconds(back.arrival().unwrap()) - arrival;
    assert!(difference.abs() < 1e-6, "{difference} s");
}

#[test]
fn the_phases_of_a_six_point_ramp_have_the_accelerations_of_their_registers() {
    let ramp = planned(&Limits { target: 512_000, ..FACTORY });
    let arrival = ramp.arrival().unwrap().as_ticks();
    let change_at = |time: u64| {
        let span = 1_000_000;
        let (before, after) = (ramp.velocity(at(time)), ramp.velocity(at(time + span)));
        f64::from(after - before) * f64::from(1 << 17) / span as f64
    };
    assert!((change_at(1_000_000) - 220.0).abs() < 0.3);
    assert!((change_at(18_000_000) - 439.0).abs() < 0.3);
    assert_eq!(change_at(60_000_000), 0.0);
    assert!((change_at(arrival - 20_000_000) + 439.0).abs() < 0.3);
    assert!((change_at(arrival - 3_000_000) + 220.0).abs() < 0.3);
    assert_eq!(ramp.phase(at(1_000_000)), Phase::Accelerating);
    assert_eq!(ramp.phase(at(60_000_000)), Phase::Cruising);
    assert_eq!(ramp.phase(at(arrival - 1)), Phase::Decelerating);
}

#[test]
fn with_v1_zero_amax_and_dmax_alone_make_a_trapezoid() {
    // A1 and D1 would make themselves felt: they are a hundred times as gentle.
    let limits = Limits { target: 512_000, v1: 0, a1: 4, d1: 4, ..FACTORY };
    let ramp = planned(&limits);
    let (top, a) = (pps(53_687), pps2(439));
    let expected = 2.0 * top / a + (512_000.0 - top * top / a) / top;
    let arrival = seconds(ramp.arrival().unwrap());
    assert!((arrival - expected).abs() < 2e-3, "{arrival} s against {expected} s by hand");
}

#[test]
fn a_triangle_peaks_where_acceleration_and_braking_meet() {
    let limits = Limits { target: 10_000, v1: 0, vstart: 0, vstop: 1, ..FACTORY };
    let ramp = planned(&limits);
    // Half the way up, half the way down: v² = distance * a.
    let expected = (10_000.0 * pps2(439)).sqrt();
    let arrival = ramp.arrival().unwrap();
    let peak = pps(ramp.velocity(at(arrival.as_ticks() / 2)).unsigned_abs());
    assert!((peak / expected - 1.0).abs() < 1e-3, "{peak} pps against {expected} pps by hand");
    let time = 2.0 * expected / pps2(439);
    assert!((seconds(arrival) - time).abs() < 2e-3, "{} s against {time} s", seconds(arrival));
}

#[test]
fn dmax_and_d1_of_zero_brake_with_the_next_acceleration_that_is_not_zero() {
    let arrival = |limits: &Limits| planned(&Limits { target: 200_000, ..*limits }).arrival();
    let same = |a: Limits, b: Limits| assert_eq!(arrival(&a), arrival(&b));
    same(Limits { d1: 0, ..FACTORY }, Limits { d1: 439, ..FACTORY });
    same(Limits { dmax: 0, amax: 500, ..FACTORY }, Limits { dmax: 500, amax: 500, ..FACTORY });
    same(Limits { d1: 0, dmax: 0, ..FACTORY }, Limits { d1: 439, dmax: 439, ..FACTORY });
    same(Limits { vstop: 0, ..FACTORY }, Limits { vstop: 1, ..FACTORY });
    assert_ne!(arrival(&Limits { d1: 439, ..FACTORY }), arrival(&FACTORY));
}

#[test]
fn without_acceleration_an_axis_keeps_the_speed_it_has() {
    let limits = Limits { target: 100, ..FACTORY };
    let stuck = planned(&Limits { a1: 0, vstart: 0, ..limits });
    assert_eq!(stuck.arrival(), None);
    assert_eq!(stuck.phase(at(1 << 40)), Phase::Standstill);
    let at_start_speed = planned(&Limits { a1: 0, vstart: 5, ..limits });
    assert_eq!(at_start_speed.velocity(at(1 << 24)), 5);
    assert_eq!(at_start_speed.position(at_start_speed.arrival().unwrap()), 100);
    let up_to_v1 = planned(&Limits { amax: 0, target: 512_000, ..FACTORY });
    assert_eq!(up_to_v1.velocity(at(60_000_000)), 26_843);
    assert_eq!(up_to_v1.position(up_to_v1.arrival().unwrap()), 512_000);
    let mut running = planned(&Limits { mode: Mode::VelocityPositive, ..FACTORY });
    running.plan(at(8_000_000), &Limits { mode: Mode::VelocityPositive, amax: 0, ..FACTORY });
    assert_eq!(running.velocity(at(8_000_000)), running.velocity(at(900_000_000)));
}

#[test]
fn an_axis_moves_the_short_way_round_the_end_of_the_counter() {
    let mut ramp = Ramp::new();
    ramp.set_position(at(0), i32::MAX - 100);
    ramp.plan(at(0), &Limits { target: i32::MIN + 99, ..FACTORY });
    let arrival = ramp.arrival().unwrap();
    let direct = planned(&Limits { target: 200, ..FACTORY });
    assert_eq!(Some(arrival), direct.arrival());
    assert!(ramp.velocity(at(arrival.as_ticks() / 2)) > 0);
    assert_eq!(ramp.position(arrival), i32::MIN + 99);
}

#[test]
fn a_cruising_axis_goes_round_the_circle_for_ever() {
    let limits = Limits { mode: Mode::VelocityPositive, vmax: 1 << 22, amax: 65_535, ..FACTORY };
    let mut ramp = planned(&limits);
    let cruising = ramp.next_event(at(0)).unwrap();
    // A quarter of a microstep per clock: 2^34 clocks are the whole circle.
    for circles in [1, 1_000, 1_000_000] {
        let later = at(cruising.as_ticks() + (circles << 34));
        assert_eq!(ramp.position(later), ramp.position(cruising));
    }
    let later = at(cruising.as_ticks() + (1_000_000 << 34));
    let expected = ramp.position(at(later.as_ticks() + 400));
    ramp.plan(later, &limits);
    assert_eq!(ramp.position(at(later.as_ticks() + 400)), expected);
    assert_eq!(expected, ramp.position(later).wrapping_add(100));
}

#[test]
fn a_reversal_in_velocity_mode_stops_waits_and_accelerates_again() {
    let wait = 1_600_000;
    let limits =
        Limits { mode: Mode::VelocityPositive, zero_wait: Duration::from_ticks(wait), ..FACTORY };
    let mut ramp = planned(&limits);
    let cruising = ramp.next_event(at(0)).unwrap();
    let ramp_time = cruising.as_ticks();
    assert_eq!(ramp_time, (53_687 << 17) / 439);
    assert!(ramp.velocity_reached(cruising));
    assert!(!ramp.velocity_reached(at(ramp_time - 1)));
    ramp.plan(cruising, &Limits { mode: Mode::VelocityNegative, ..limits });
    let stop = ramp.next_event(cruising).unwrap();
    assert_eq!(stop.as_ticks() - cruising.as_ticks(), ramp_time);
    assert_eq!(ramp.phase(stop), Phase::Waiting);
    assert!(ramp.zero_wait_active(stop));
    let start = ramp.next_event(stop).unwrap();
    assert_eq!(start.as_ticks() - stop.as_ticks(), wait);
    assert!(!ramp.zero_wait_active(start));
    let reversed = ramp.next_event(start).unwrap();
    assert_eq!(reversed.as_ticks() - start.as_ticks(), ramp_time);
    assert_eq!(ramp.velocity(reversed), -53_687);
    assert_eq!(ramp.second_move(), None, "velocity mode has no second move");
    assert_eq!(ramp.next_event(reversed), None);
}

#[test]
fn start_and_stop_speed_do_not_matter_in_velocity_mode() {
    let limits = Limits { mode: Mode::VelocityPositive, ..FACTORY };
    let slow = planned(&limits);
    let fast = planned(&Limits { vstart: 20_000, vstop: 20_000, a1: 1, v1: 50_000, ..limits });
    for time in (0..20_000_000).step_by(100_003) {
        assert_eq!(slow.velocity(at(time)), fast.velocity(at(time)));
    }
}

#[test]
fn a_move_that_follows_a_stop_waits_at_zero_first() {
    let wait = 320_000;
    let limits = Limits { zero_wait: Duration::from_ticks(wait), target: 1_000, ..FACTORY };
    let mut ramp = planned(&limits);
    let arrival = ramp.arrival().unwrap();
    assert_eq!(ramp.phase(at(0)), Phase::Accelerating, "the first move has nothing to wait for");
    let early = at(arrival.as_ticks() + wait / 4);
    ramp.plan(early, &Limits { target: 2_000, ..limits });
    assert_eq!(ramp.phase(early), Phase::Waiting);
    assert_eq!(ramp.next_event(early), Some(at(arrival.as_ticks() + wait)));
    assert_eq!(ramp.phase(at(arrival.as_ticks() + wait)), Phase::Accelerating);
    let second = ramp.arrival().unwrap();
    let late = at(second.as_ticks() + wait);
    ramp.plan(late, &Limits { target: 3_000, ..limits });
    assert_eq!(ramp.phase(late), Phase::Accelerating);
}

#[test]
fn a_target_behind_a_moving_axis_is_reached_by_a_second_move() {
    let limits = Limits { target: 512_000, zero_wait: Duration::from_ticks(160_000), ..FACTORY };
    let mut ramp = planned(&limits);
    let turn = at(5 * TICKS_PER_SECOND);
    ramp.plan(turn, &Limits { target: -1_000, ..limits });
    let stop = ramp.next_event(turn).unwrap();
    // Braking from VMAX to VSTOP: DMAX to V1, D1 below.
    let braking = ((53_687u64 - 26_843) << 17) / 439 + ((26_843u64 - 10) << 17) / 220;
    assert_eq!(stop.as_ticks() - turn.as_ticks(), braking);
    assert_eq!(ramp.velocity(stop), 0);
    let back = ramp.second_move().unwrap();
    assert_eq!(back.as_ticks() - stop.as_ticks(), 160_000);
    assert_eq!(ramp.position(ramp.arrival().unwrap()), -1_000);
}

#[test]
fn a_lower_vmax_slows_a_positioning_axis_down_with_amax() {
    let limits = Limits { target: 2_000_000, ..FACTORY };
    let mut ramp = planned(&limits);
    let change = at(5 * TICKS_PER_SECOND);
    ramp.plan(change, &Limits { vmax: 40_000, ..limits });
    let slow = ramp.next_event(change).unwrap();
    assert_eq!(slow.as_ticks() - change.as_ticks(), ((53_687u64 - 40_000) << 17) / 439);
    assert_eq!(ramp.velocity(slow), 40_000);
    assert!(ramp.velocity_reached(slow));
    assert_eq!(ramp.position(ramp.arrival().unwrap()), 2_000_000);
}

#[test]
fn vmax_zero_stops_a_positioning_axis_with_amax_and_a1_until_it_is_raised_again() {
    let limits = Limits { target: 2_000_000, dmax: 200, d1: 100, ..FACTORY };
    let mut ramp = planned(&limits);
    let change = at(5 * TICKS_PER_SECOND);
    ramp.plan(change, &Limits { vmax: 0, ..limits });
    let stop = ramp.next_event(change).unwrap();
    let slowing = ((53_687u64 - 26_843) << 17) / 439 + (26_843u64 << 17) / 220;
    assert_eq!(stop.as_ticks() - change.as_ticks(), slowing);
    assert_eq!(ramp.arrival(), None);
    assert_eq!(ramp.next_event(stop), None);
    ramp.plan(stop, &limits);
    assert_eq!(ramp.position(ramp.arrival().unwrap()), 2_000_000);
}

#[test]
fn hold_keeps_the_velocity_and_a_hard_stop_ends_it() {
    let mut ramp = planned(&Limits { mode: Mode::VelocityNegative, ..FACTORY });
    let now = at(8_000_000);
    let velocity = ramp.velocity(now);
    assert!(velocity < -20_000);
    ramp.plan(now, &Limits { mode: Mode::Hold, ..FACTORY });
    let later = at(900_000_000);
    assert_eq!(ramp.velocity(later), velocity);
    let position = ramp.position(later);
    ramp.stop_now(later);
    assert_eq!(ramp.velocity(later), 0);
    assert_eq!(ramp.position(at(901_000_000)), position);
    assert_eq!(ramp.stopped_at(at(901_000_000)), Some(later));
}

#[test]
fn setting_the_position_in_position_mode_moves_the_axis_to_its_target() {
    let mut ramp = planned(&Limits { target: 0, ..FACTORY });
    assert_eq!(ramp.arrival(), Some(at(0)));
    ramp.set_position(at(100), 5_000);
    assert_eq!(ramp.position(at(100)), 5_000);
    let arrival = ramp.arrival().unwrap();
    assert!(ramp.velocity(at(arrival.as_ticks() / 2)) < 0);
    assert_eq!(ramp.position(arrival), 0);
}
