//! How a motor moves its machine, against formulas that can be worked out by hand.
//!
//! The chip runs from 16 MHz: a speed register of V is V * 16e6 / 2^24 microsteps per second. The motor
//! has 200 full steps, so that a turn is 51200 fine steps.

use std::f64::consts::{PI, TAU};

use crate::bench::*;
use opentmcl_plant::axis::Rotor;
use opentmcl_plant::machine::{Load, Machine, Motor, Spring, Stage};
use opentmcl_plant::tmc5160::registers::*;

#[test]
fn the_load_angle_is_that_at_which_the_field_gives_the_torque_of_the_load() {
    // K = 0.4 / (sqrt2 * 1) Nm/A, at 2.8 A: 0.792 Nm. A quarter of it: sin(angle) = 1/4.
    let full = 0.4 / 2f64.sqrt() * 2.8;
    let load = Load { constant: -full / 4.0, ..Load::default() };
    let mut bench = Bench::new(Machine { load, ..machine() });
    let view = bench.view();
    assert!((view.load - 0.25).abs() < 1e-12, "{view:?}");
    assert!((view.load_angle - 0.25f64.asin().to_degrees()).abs() < 1e-9);
    // The weight pulls the rotor back: 90 electrical degrees are a full step, 256 fine steps.
    let lag = 0.25f64.asin() / (PI / 2.0) * 256.0;
    assert!((view.rotor + lag).abs() < 1e-9, "{view:?}");
}

#[test]
fn with_half_the_current_the_same_load_takes_twice_the_part() {
    let load = Load { constant: 0.2, ..Load::default() };
    let mut bench = Bench::new(Machine { load, ..machine() });
    let full = bench.view().load;
    bench.write(IHOLD_IRUN, 15 << 8 | 15);
    let half = bench.view();
    // 16/32 of the current against 32/32.
    assert!((half.load / full - 2.0).abs() < 1e-12);
    assert!((half.current - 1.4).abs() < 1e-12);
}

#[test]
fn a_motor_pulls_out_at_the_speed_at_which_the_voltage_no_longer_gives_the_torque() {
    // Without resistance: T = K V / (p w L), so w = K V / (p L T).
    let motor = Motor { resistance: 1e-9, ..motor() };
    let torque = 0.1;
    let load = Load { constant: -torque, inertia: 1e-4, ..Load::default() };
    let mut bench = Bench::new(Machine { motor, load, ..machine() });
    // AMAX 100 is 11641.5 microsteps/s².
    let demand = torque + (1e-4 + motor.inertia) * 11_641.532 * TAU / 51_200.0;
    let expected = motor.torque_constant() * 24.0 / (50.0 * motor.inductance * demand);
    bench.turn(100, 8_388_095);
    let mut speed = 0.0;
    while bench.view().state == Rotor::Following {
        speed = bench.view().speed;
        bench.wait_ms(1.0);
    }
    let found = speed * TAU / 51_200.0;
    assert!((found / expected - 1.0).abs() < 1e-3, "{found} rad/s, by hand {expected}");
}

#[test]
fn what_is_blocked_loses_whole_periods_and_the_counter_goes_on() {
    let mut bench = Bench::new(machine());
    bench.turn(5_000, 53_687);
    bench.wait_ms(500.0);
    bench.axis.set_blocked(true, bench.now);
    let stuck = bench.view().rotor;
    bench.wait_ms(300.0);
    assert_eq!(bench.view().state, Rotor::Pressed);
    assert!((bench.view().rotor - stuck).abs() < 1e-9);
    bench.axis.set_blocked(false, bench.now);
    bench.turn(5_000, 0);
    bench.wait_ms(500.0);
    let (view, counter) = (bench.view(), bench.position());
    assert_eq!(view.state, Rotor::Following);
    // 0.3 s at 51200 steps/s are 60 full steps: 15 periods, one more or less for where it was caught.
    assert!(view.lost_steps % 4 == 0 && (52..=68).contains(&view.lost_steps), "{view:?}");
    // The counter shows whole microsteps.
    let missing = counter - view.rotor - view.lost_steps as f64 * 256.0;
    assert!(missing.abs() <= 0.5, "{counter} {view:?}");
}

#[test]
fn a_hard_stop_is_not_passed_and_costs_whole_periods() {
    let stage = Stage { highest: Some(10_000.0), ..Stage::default() };
    let mut bench = Bench::new(Machine { stage, ..machine() });
    bench.turn(5_000, 53_687);
    for _ in 0..2_000 {
        bench.wait_ms(0.37);
        assert!(bench.view().rotor <= 10_000.0);
    }
    bench.turn(5_000, 0);
    bench.wait_ms(200.0);
    let (view, counter) = (bench.view(), bench.position());
    assert!(view.lost_steps > 0 && view.lost_steps % 4 == 0);
    // At rest the field, less the lost periods, is at most half a period from the stop.
    let field = counter - view.lost_steps as f64 * 256.0;
    assert!((field - 10_000.0).abs() <= 512.5, "{view:?}");
    assert!((view.rotor - field.min(10_000.0)).abs() <= 0.5, "{view:?}");
}

#[test]
fn a_motor_without_current_comes_to_rest_by_friction_alone() {
    let friction = 0.02;
    let load = Load { friction, inertia: 2e-5, ..Load::default() };
    let mut bench = Bench::new(Machine { load, ..machine() });
    bench.turn(2_000, 53_687);
    bench.wait_ms(1_000.0);
    let before = bench.view();
    bench.write(CHOPCONF, CHOPPER_OFF);
    bench.wait_ms(1_000.0);
    let after = bench.view();
    assert_eq!((after.state, after.speed), (Rotor::Free, 0.0));
    // J w² / 2 = T s
    let speed = before.speed * TAU / 51_200.0;
    let way = (2e-5 + motor().inertia) * speed * speed / (2.0 * friction) * 51_200.0 / TAU;
    let found = after.rotor - before.rotor;
    assert!((found / way - 1.0).abs() < 1e-6, "{found}, by hand {way}");
}

#[test]
fn a_weight_falls_without_current_is_caught_by_the_stop_and_held_by_enough_current() {
    let load = Load { constant: -0.3, ..Load::default() };
    let stage = Stage { lowest: Some(-20_000.0), ..Stage::default() };
    let mut bench = Bench::new(Machine { load, stage, ..machine() });
    bench.wait_ms(100.0);
    assert_eq!(bench.view().state, Rotor::Following);
    // 8/32 of the current give 0.198 Nm: not enough; the weight runs away.
    bench.write(IHOLD_IRUN, 7 << 8 | 7);
    assert_eq!(bench.view().state, Rotor::Slipping);
    bench.wait_ms(1_000.0);
    assert_eq!(bench.view().rotor, -20_000.0);
    bench.write(IHOLD_IRUN, 31 << 8 | 31);
    let view = bench.view();
    assert!(view.lost_steps > 0 && view.state != Rotor::Slipping, "{view:?}");
}

#[test]
fn the_fall_of_a_weight_is_that_of_the_textbook() {
    let load = Load { constant: -0.05, inertia: 1e-5, ..Load::default() };
    let mut bench = Bench::new(Machine { load, ..machine() });
    bench.write(CHOPCONF, CHOPPER_OFF);
    let start = bench.view().rotor;
    bench.wait_ms(200.0);
    let acceleration = 0.05 / (1e-5 + motor().inertia) * 51_200.0 / TAU;
    let way = -acceleration * 0.2 * 0.2 / 2.0;
    let found = bench.view().rotor - start;
    assert!((found / way - 1.0).abs() < 1e-9, "{found}, by hand {way}");
}

#[test]
fn a_start_is_followed_up_to_the_speed_at_which_the_field_still_catches_the_rotor() {
    // The swing in the field stays within a period up to w = 2 sqrt(T / (J p)), w in rad/s of the shaft.
    // Nearly without inductance, so that the voltage suffices for all of the current.
    let motor = Motor { inductance: 1e-7, ..motor() };
    let load = Load { inertia: 1e-4, ..Load::default() };
    let torque = motor.torque_constant() * 2.8;
    let limit = 2.0 * (torque / ((1e-4 + motor.inertia) * 50.0)).sqrt();
    for (part, caught) in [(0.99, true), (1.01, false)] {
        let mut bench = Bench::new(Machine { motor, load: load.clone(), ..machine() });
        // The field turns already when the current comes on.
        bench.write(CHOPCONF, CHOPPER_OFF);
        bench.turn(65_535, (limit * part * 51_200.0 / TAU * 1.048_576) as u32);
        bench.wait_ms(500.0);
        assert_eq!(bench.view().state, Rotor::Free);
        bench.write(CHOPCONF, CHOPPER_ON);
        let state = if caught { Rotor::Following } else { Rotor::Slipping };
        assert_eq!(bench.view().state, state, "{part} of {limit} rad/s");
    }
}

/// A rotor without a field, let go at 1000 fine steps from where a spring has no tension.
fn swinging(rate: f64, friction: f64) -> Bench {
    let load = Load { friction, springs: vec![Spring { rate, rest: 0.0 }], ..Load::default() };
    let stage = Stage { start: 1_000.0, ..Stage::default() };
    let mut bench = Bench::new(Machine { load, stage, ..machine() });
    bench.write(CHOPCONF, CHOPPER_OFF);
    bench
}

#[test]
fn friction_takes_the_same_part_of_each_swing_and_in_the_end_holds_the_rotor() {
    // Each half of a swing is one around the place where spring and friction are equal, F / k = 75 fine
    // steps on this side: from 1000 to -850, and so on to 100, and from there to 50, where it stays.
    let rate = 1e-3;
    let mut bench = swinging(rate, 75.0 * rate);
    let mut turns = Vec::new();
    for _ in 0..2_000 {
        bench.wait_ms(0.1);
        let view = bench.view();
        if view.speed == 0.0 && turns.last() != Some(&view.rotor) {
            turns.push(view.rotor);
        }
    }
    let expected = [-850.0, 700.0, -550.0, 400.0, -250.0, 100.0, 50.0];
    assert_eq!(turns.len(), expected.len(), "{turns:?}");
    assert!(turns.iter().zip(expected).all(|(turn, at)| (turn - at).abs() < 1e-6), "{turns:?}");
}

#[test]
fn springs_are_stable_however_stiff() {
    for rate in [1e-6, 1e-3, 1.0, 1e3] {
        let mut bench = swinging(rate, 0.001);
        for _ in 0..5_000 {
            bench.wait_ms(0.5);
            assert!(bench.view().rotor.abs() <= 1_000.0, "{rate}");
        }
    }
}

#[test]
fn the_stage_follows_the_rotor_behind_its_play() {
    let stage = Stage { backlash: 200.0, ..Stage::default() };
    let mut bench = Bench::new(Machine { stage, ..machine() });
    // While it brakes, the rotor is ahead of the field by a fraction of a fine step.
    bench.move_to(10_000);
    assert!((bench.view().stage - 9_900.0).abs() < 0.2);
    bench.move_to(9_950);
    assert!((bench.view().stage - 9_900.0).abs() < 0.2, "within the play");
    bench.move_to(5_000);
    assert!((bench.view().stage - 5_100.0).abs() < 0.2);
}
