//! Moves of the ticked ramp generator against the formulas of the data sheet, and what its mechanics have
//! to bring about by themselves.

use opentmcl_motion::ticked::{
    Barred, BrakingFactor, Events, Mode, Ramp, Settings, braking_factor,
};
use opentmcl_motion::{Duration, Instant};

const CLOCK: f64 = 16e6;

fn at(ticks: u64) -> Instant {
    Instant::from_ticks(ticks)
}

fn seconds(value: f64) -> Instant {
    at((value * CLOCK) as u64)
}

fn in_seconds(time: Instant) -> f64 {
    time.as_ticks() as f64 / CLOCK
}

/// Microsteps per second.
fn pps(v: u32, pulse_div: u32) -> f64 {
    CLOCK * f64::from(v) / (2f64.powi(pulse_div as i32) * 2048.0 * 32.0)
}

/// Microsteps per second squared.
fn ppss(a: u32, ramp_div: u32, pulse_div: u32) -> f64 {
    CLOCK * CLOCK * f64::from(a) / 2f64.powi((pulse_div + ramp_div + 29) as i32)
}

fn ramp_period(ramp_div: u32) -> f64 {
    32.0 * 2f64.powi(ramp_div as i32) / CLOCK
}

/// v, a, ramp_div, pulse_div for which a braking factor exists.
const COMBINATIONS: [(u32, u32, u32, u32); 20] = [
    (1000, 500, 3, 2),
    (2047, 500, 3, 2),
    (1000, 500, 7, 3),
    (2047, 2047, 7, 3),
    (500, 100, 7, 3),
    (1234, 321, 7, 3),
    (1000, 1000, 9, 3),
    (300, 50, 7, 5),
    (2047, 100, 7, 5),
    (2047, 2047, 0, 0),
    (777, 777, 0, 0),
    (2000, 300, 5, 5),
    (2000, 1500, 5, 5),
    (1500, 20, 4, 3),
    (100, 10, 3, 3),
    (2047, 1023, 10, 2),
    (2047, 40, 6, 3),
    (640, 200, 8, 3),
    (1999, 999, 6, 4),
    (50, 30, 7, 4),
];

fn settings((v, a, ramp_div, pulse_div): (u32, u32, u32, u32)) -> Settings {
    let factor = braking_factor(a, ramp_div, pulse_div).expect("a combination that fits");
    Settings { v_min: 1, v_max: v, a_max: a, factor, ramp_div, pulse_div, ..Settings::default() }
}

/// Runs until nothing is to come, at most this many events. Gives the end and the extremes of position.
fn run_out(ramp: &mut Ramp, from: Instant, events: usize) -> (Instant, i32, i32) {
    let mut now = from;
    let (mut least, mut most) = (ramp.position(), ramp.position());
    for _ in 0..events {
        let Some(next) = ramp.next_event(now) else { break };
        now = next;
        ramp.advance(now);
        least = least.min(ramp.position());
        most = most.max(ramp.position());
    }
    (now, least, most)
}

#[test]
fn a_speed_is_reached_after_the_time_that_the_formula_gives() {
    for row @ (v, a, ramp_div, pulse_div) in COMBINATIONS {
        for sign in [1, -1] {
            let mut ramp = Ramp::new();
            let v_target = sign * v as i32;
            ramp.set(at(0), &Settings { mode: Mode::Velocity, v_target, ..settings(row) });
            let reached = ramp.next_event(at(0)).expect("it will reach its speed");
            let expected = pps(v, pulse_div) / ppss(a, ramp_div, pulse_div);
            let late = (in_seconds(reached) - expected) / ramp_period(ramp_div);
            assert!((-1e-6..1.0).contains(&late), "{row:?}: {late} ticks late");
            ramp.advance(reached);
            assert_eq!(ramp.velocity(), v_target);
            assert_eq!(ramp.next_event(reached), None, "and then stays as it is");
        }
    }
}

#[test]
fn a_constant_speed_makes_as_many_microsteps_as_the_formula_gives() {
    for row @ (v, _, _, pulse_div) in COMBINATIONS {
        let mut ramp = Ramp::new();
        let hold = Settings { mode: Mode::Hold, v_target: v as i32, ..settings(row) };
        ramp.set(at(0), &hold);
        for time in [1.0, 10.0, 3600.0 * 24.0 * 365.0] {
            ramp.advance(seconds(time));
            let expected = time * pps(v, pulse_div);
            let travel = ramp.travel() as f64;
            assert!((expected - 1.0..=expected).contains(&travel), "{row:?}: {travel}");
            assert_eq!(ramp.position(), (ramp.travel() << 40 >> 40) as i32, "wrapped to 24 bits");
        }
    }
}

/// Time of a move with acceleration a and deceleration q a, where q = p'/p.
fn time_of_move(row: (u32, u32, u32, u32), distance: f64) -> f64 {
    let (v, a, ramp_div, pulse_div) = row;
    let (v, rate) = (pps(v, pulse_div), ppss(a, ramp_div, pulse_div));
    let slopes = 1.0 / rate + 1.0 / (rate * quality(row));
    let ramps = v * v / 2.0 * slopes;
    if ramps < distance {
        v * slopes + (distance - ramps) / v
    } else {
        (2.0 * distance * slopes).sqrt()
    }
}

fn quality((_, a, ramp_div, pulse_div): (u32, u32, u32, u32)) -> f64 {
    let BrakingFactor { pmul, pdiv } = braking_factor(a, ramp_div, pulse_div).unwrap();
    let p = f64::from(a) / 128.0 * 2f64.powi(pulse_div as i32 - ramp_div as i32);
    f64::from(pmul) / 2f64.powi(3 + i32::from(pdiv)) / p
}

#[test]
fn a_move_takes_the_time_that_the_formula_gives_and_the_approach_of_its_end() {
    for row @ (v, a, ramp_div, _) in COMBINATIONS {
        for distance in [1_000, 20_000, 400_000, -400_000] {
            let mut ramp = Ramp::new();
            ramp.set(at(0), &Settings { target: distance, ..settings(row) });
            let (end, least, most) = run_out(&mut ramp, at(0), 100);
            assert_eq!((ramp.position(), ramp.velocity()), (distance, 0), "{row:?}");
            assert_eq!((least, most), (distance.min(0), distance.max(0)), "no overshoot: {row:?}");
            assert_eq!(ramp.stopped_at(), Some(end));
            let events = ramp.take_events();
            assert_eq!(events, Events { arrived: true, stopped: true });
            let late = in_seconds(end) - time_of_move(row, f64::from(distance.abs()));
            let late = late / ramp_period(ramp_div);
            // What a circuit in whole numbers adds, in ramp ticks, with `step` for the change of
            // speed in one of them:
            // - It looks one tick ahead, so that the way runs out by dv/v more: ln(v / v_min).
            // - Pulses come from the speed rounded down, half a unit too little on average: that is
            //   1 / step for both ramps, and another ln(v / v_min) / (2 step) as it follows the curve.
            // - The last microsteps are made at v_min: on the way of the last step or one and a half,
            //   and on what one unit of speed needs.
            let step = f64::from(a) / 256.0;
            let decay = f64::from(v).ln();
            let most = 1.0 + decay + (1.0 + decay / 2.0) / step + (2.0 + 1.5 * step + 2.0 / step);
            assert!((-1.0..most).contains(&late), "{row:?} {distance}: {late} of {most}");
        }
    }
}

#[test]
fn braking_from_an_hour_of_cruising_begins_where_it_would_tick_by_tick() {
    // 8 388 607 microsteps at 30.5 per second take 76 hours; the axis is looked at only at the end.
    let row = (1, 2, 3, 3);
    let mut ramp = Ramp::new();
    ramp.set(at(0), &Settings { target: 0x7F_FFFF, v_min: 1, ..settings(row) });
    let arrival = run_out(&mut ramp, at(0), 10).0;
    let expected = f64::from(0x7F_FFFF) / pps(1, 3);
    assert!((in_seconds(arrival) - expected).abs() < 1.0, "{arrival:?}");
    assert_eq!(ramp.position(), 0x7F_FFFF);
}

#[test]
fn a_factor_that_is_too_large_runs_past_the_target_and_swings_about_it() {
    let row = (1000, 500, 7, 3);
    for (times, overshoot) in [(2.0, 0.5), (4.0, 0.75)] {
        // v² = 2048 p' d at the beginning of braking, and p gives the way on which it stops: of the way
        // v² / (2048 p) there are only p / p' in front of the target.
        let factor = settings(row).factor;
        let factor =
            BrakingFactor { pdiv: factor.pdiv - if times == 2.0 { 1 } else { 2 }, ..factor };
        let mut ramp = Ramp::new();
        ramp.set(at(0), &Settings { target: 50_000, factor, ..settings(row) });
        let (mut now, mut farthest, mut sides) = (at(0), 0, Vec::new());
        while let Some(next) = ramp.next_event(now) {
            now = next;
            ramp.advance(now);
            // Where it turns round it has no speed.
            farthest = farthest.max(ramp.position());
            if ramp.velocity() == 0 {
                sides.push((ramp.position() - 50_000).signum());
            }
        }
        let way = pps(1000, 3).powi(2) / 2.0 / ppss(500, 7, 3);
        let past = f64::from(farthest - 50_000);
        assert!((past / (way * overshoot) - 1.0).abs() < 0.05, "{past} past, {way} to stop");
        assert!(sides.starts_with(&[1, -1, 1]), "{sides:?}");
        assert_eq!(ramp.position(), 50_000, "at last");
    }
}

#[test]
fn a_factor_that_is_too_small_brakes_early_and_creeps_to_the_target_with_v_min() {
    let row = (1000, 500, 7, 3);
    let good = settings(row);
    let small = BrakingFactor { pdiv: good.factor.pdiv + 4, ..good.factor };
    let mut ramp = Ramp::new();
    ramp.set(at(0), &Settings { target: 100_000, v_min: 100, factor: small, ..good });
    let mut now = at(0);
    let mut crept = 0.0;
    while let Some(next) = ramp.next_event(now) {
        if ramp.velocity() == 100 {
            crept += in_seconds(next) - in_seconds(now);
        }
        now = next;
        ramp.advance(now);
    }
    assert_eq!(ramp.position(), 100_000);
    // At 100 it may not go faster within v² / (2048 p') = 10 000 / (2048 * p / 16) microsteps.
    let p = 500.0 / 128.0 / 16.0 * quality(row) / 16.0;
    let expected = 10_000.0 / (2048.0 * p) / pps(100, 3);
    assert!((crept / expected - 1.0).abs() < 0.1, "{crept} of {expected}");
    // Against a move without ramps, with times in 1/30 518 s and ways in microsteps: 2000 lost with the
    // ramp upward; then from 1000 to 100 at a rate of p', and 100 creeping.
    let (v, rate) = (pps(1000, 3), ppss(500, 7, 3) * quality(row) / 16.0);
    let braking = (v - v / 10.0) / rate - (v * v - v * v / 100.0) / 2.0 / rate / v;
    let lost = v / 2.0 / ppss(500, 7, 3) + braking + expected * 0.9;
    let took = in_seconds(now);
    assert!((took - 100_000.0 / v - lost).abs() < 0.01 * took, "{took} with {lost} lost");
}

#[test]
fn the_soft_mode_approaches_its_target_exponentially() {
    let row = (1000, 500, 7, 3);
    let mut ramp = Ramp::new();
    ramp.set(at(0), &Settings { mode: Mode::Soft, target: 50_000, ..settings(row) });
    // v = p' d / 2 makes each microstep left decay with p' / 2 * 16e6 / (2^3 * 2048 * 32) per second.
    let p = 500.0 / 128.0 / 16.0 * quality(row);
    let rate = p / 2.0 * pps(1, 3);
    let mut time = 1.7;
    let left = |ramp: &mut Ramp, time: f64| {
        ramp.advance(seconds(time));
        f64::from(50_000 - ramp.position())
    };
    let mut before = left(&mut ramp, time);
    while before > 2_000.0 {
        time += 0.01;
        before = left(&mut ramp, time);
    }
    for _ in 0..5 {
        time += 0.1;
        let after = left(&mut ramp, time);
        let decay = (before / after).ln() / 0.1;
        assert!((decay / rate - 1.0).abs() < 0.05, "{decay} in place of {rate}");
        before = after;
    }
    run_out(&mut ramp, seconds(time), 100);
    assert_eq!((ramp.position(), ramp.at_rest()), (50_000, true));
}

#[test]
fn a_target_behind_the_axis_makes_it_turn_round() {
    let row = (1000, 500, 7, 3);
    let mut ramp = Ramp::new();
    ramp.set(at(0), &Settings { target: 50_000, ..settings(row) });
    ramp.set(seconds(0.5), &Settings { target: 0, ..settings(row) });
    let turned = ramp.position();
    let (_, least, most) = run_out(&mut ramp, seconds(0.5), 100);
    // It stops on v² / 2a = 2000 microsteps.
    let way = pps(1000, 3).powi(2) / 2.0 / ppss(500, 7, 3);
    assert!((f64::from(most - turned) / way - 1.0).abs() < 0.01);
    assert_eq!((ramp.position(), least), (0, 0));
}

#[test]
fn an_axis_that_moves_away_turns_round_even_if_it_may_not_go_fast() {
    // The smallest p' allows hardly any speed toward the target, but a step of a_max is 8 units.
    let factor = BrakingFactor { pmul: 128, pdiv: 13 };
    let mut ramp = Ramp::new();
    ramp.set(at(0), &Settings { target: 3, a_max: 2047, factor, ..settings((1000, 500, 7, 3)) });
    ramp.set_velocity(at(0), -1);
    run_out(&mut ramp, at(0), 100);
    // It has not gone round the 24 bits.
    assert_eq!((ramp.position(), ramp.travel(), ramp.at_rest()), (3, 3, true));
}

#[test]
fn a_limit_changed_on_the_way_is_taken_up_with_a_max() {
    let row = (1000, 500, 7, 3);
    let mut ramp = Ramp::new();
    let mut now = at(0);
    ramp.set(now, &Settings { target: 500_000, ..settings(row) });
    for v_max in [1000, 300, 2000, 50] {
        ramp.set(now, &Settings { target: 500_000, v_max, ..settings(row) });
        let from = ramp.velocity();
        let next = ramp.next_event(now).unwrap();
        ramp.advance(next);
        assert_eq!(ramp.velocity(), v_max as i32);
        let expected = pps((v_max as i32 - from).unsigned_abs(), 3) / ppss(500, 7, 3);
        let took = in_seconds(next) - in_seconds(now);
        assert!((took - expected).abs() <= ramp_period(7), "{took} in place of {expected}");
        now = next;
    }
    ramp.set(now, &Settings { target: 500_000, ..settings(row) });
    run_out(&mut ramp, now, 100);
    assert_eq!(ramp.position(), 500_000);
}

#[test]
fn the_short_way_to_a_target_leads_over_the_end_of_the_24_bits() {
    let mut ramp = Ramp::new();
    ramp.set_position(at(0), 0x7F_FF00);
    ramp.set(at(0), &Settings { target: -0x7F_FF00, ..settings((1000, 500, 7, 3)) });
    run_out(&mut ramp, at(0), 100);
    assert_eq!((ramp.position(), ramp.travel()), (-0x7F_FF00, 0x200));
}

#[test]
fn a_hard_stop_stands_at_once_and_goes_on_when_the_switch_opens() {
    let row = (1000, 500, 7, 3);
    let mut ramp = Ramp::new();
    let free = Settings { target: 50_000, ..settings(row) };
    let shut = Barred { positive: true, ..Barred::default() };
    ramp.set(at(0), &free);
    ramp.set(seconds(0.5), &Settings { barred: shut, ..free });
    let stopped = ramp.position();
    assert_eq!((ramp.velocity(), ramp.stopped_at()), (0, Some(seconds(0.5))));
    assert!(ramp.at_rest() && !ramp.at_target());
    assert_eq!(ramp.take_events(), Events { arrived: false, stopped: true });
    assert_eq!(ramp.next_event(seconds(0.5)), None);
    ramp.advance(seconds(1.0));
    assert_eq!(ramp.position(), stopped);
    ramp.set(seconds(1.0), &Settings { target: 0, barred: shut, ..free });
    run_out(&mut ramp, seconds(1.0), 100);
    assert_eq!(ramp.position(), 0, "the way back is free");
    ramp.set(seconds(9.0), &free);
    run_out(&mut ramp, seconds(9.0), 100);
    assert_eq!(ramp.position(), 50_000);
}

#[test]
fn a_soft_stop_takes_the_ramp() {
    for mode in [Mode::Ramp, Mode::Soft, Mode::Velocity] {
        let mut ramp = Ramp::new();
        let free =
            Settings { target: -90_000, mode, v_target: -1000, ..settings((1000, 500, 7, 3)) };
        ramp.set(at(0), &free);
        let now = seconds(0.5);
        let barred = Barred { negative: true, soft: true, ..Barred::default() };
        ramp.set(now, &Settings { barred, ..free });
        assert_eq!(ramp.velocity(), -1000);
        let end = ramp.next_event(now).unwrap();
        let took = in_seconds(end) - 0.5;
        assert!((took - pps(1000, 3) / ppss(500, 7, 3)).abs() <= ramp_period(7), "{took}");
        ramp.advance(end);
        assert!(ramp.at_rest());
    }
}

#[test]
fn without_acceleration_an_axis_keeps_its_speed() {
    let row = (1000, 500, 7, 3);
    let mut ramp = Ramp::new();
    ramp.set(at(0), &Settings { target: 50_000, ..settings(row) });
    ramp.set(seconds(1.0), &Settings { target: 50_000, a_max: 0, ..settings(row) });
    assert_eq!(ramp.next_event(seconds(1.0)), None);
    ramp.advance(seconds(3600.0));
    assert_eq!(ramp.velocity(), 1000);
}

#[test]
fn a_motion_tells_what_the_next_ticks_do() {
    let mut ramp = Ramp::new();
    ramp.set(at(0), &Settings { target: 50_000, ..settings((1000, 500, 7, 3)) });
    let tick = 32 << 7;
    ramp.advance(at(10 * tick + 5));
    let motion = ramp.motion();
    assert_eq!((motion.velocity, motion.change), (5000, 500));
    assert_eq!((motion.until, motion.period), (Some(at(11 * tick)), Duration::from_ticks(tick)));
    assert_eq!((ramp.velocity(), ramp.acceleration()), (19, 500));
    ramp.advance(seconds(0.5));
    let cruise = ramp.motion();
    assert_eq!((cruise.velocity, cruise.change, ramp.acceleration()), (256_000, 0, 0));
    // Braking takes 2000 microsteps and 1.2 % more, 50 000 are done 1 s after (50 000 - 4000) / 30 518.
    let braking = in_seconds(cruise.until.unwrap());
    let expected = 0.131 + (50_000.0 - 2_000.0 - 2_024.3) / pps(1000, 3);
    assert!((braking - expected).abs() < 3.0 * ramp_period(7), "{braking} {expected}");
    ramp.advance(cruise.until.unwrap());
    assert_eq!(ramp.exact_velocity(), 255_500);
    assert_eq!(ramp.target_velocity(), 1, "v_min is in view while braking");
}
