//! The even field that a machine feels stays with the steps that the controller makes.

use opentmcl_motion::ticked::braking_factor;
use opentmcl_motion::{Duration, Instant};
use opentmcl_plant::axis::{Rotor, SwitchInput};
use opentmcl_plant::machine::{Load, Machine, Motor, Stage, Switch, Switches};
use opentmcl_plant::steppers::{DRIVER, Steppers};
use opentmcl_plant::tmc26x::registers::{CS, MRES, Register, SGT, TOFF};
use opentmcl_plant::tmc429::registers::*;

use crate::described::Random;

/// A motor that follows any field at once.
const STIFF: Motor = Motor {
    full_steps: 200,
    resistance: 1e-3,
    inductance: 1e-12,
    holding_torque: 1e-3,
    rated_current: 1.0,
    detent_torque: 0.0,
    inertia: 1e-15,
};

/// 0.3465 Nm/A, 5 ohm; 1 A gives 0.3465 Nm.
const MOTOR: Motor = Motor {
    full_steps: 200,
    resistance: 5.0,
    inductance: 0.008,
    holding_torque: 0.49,
    rated_current: 1.0,
    detent_torque: 0.028,
    inertia: 68e-7,
};

fn of_motor(motor: Motor) -> Machine {
    Machine {
        motor,
        load: Load::default(),
        stage: Stage::default(),
        switches: Switches::default(),
        encoder: None,
    }
}

fn at(clocks: u64) -> Instant {
    Instant::from_ticks(clocks)
}

/// Seconds in clocks.
fn seconds(seconds: f64) -> Instant {
    at((seconds * 16e6) as u64)
}

/// Axes with this resolution (0 is 256 microsteps), half of the current, and both switches.
fn axes(machines: &[Option<Machine>], resolution: u32) -> Steppers {
    let mut steppers = Steppers::with_machines(machines.iter().cloned(), 2.0);
    for axis in 0..steppers.len() {
        steppers.write(axis, IF_CONFIGURATION, ENABLE_RIGHT_SWITCHES, at(0));
        for datagram in [
            Register::DrvCtrl.datagram(&[(MRES, resolution)]),
            Register::SgcsConf.datagram(&[(CS, 15), (SGT, 0)]),
            Register::ChopConf.datagram(&[(TOFF, 5)]),
        ] {
            steppers.write(axis, DRIVER, datagram, at(0));
        }
    }
    steppers
}

/// Writes a speed, an acceleration and divisors, with the factor that belongs to them.
fn limit(steppers: &mut Steppers, axis: u8, [v_max, a_max, ramp, pulse]: [u32; 4], now: Instant) {
    steppers.write(axis, DIVISORS, pulse << 12 | ramp << 8, now);
    steppers.write(axis, V_MIN, 1, now);
    steppers.write(axis, V_MAX, v_max, now);
    steppers.write(axis, A_MAX, a_max, now);
    if let Some(factor) = braking_factor(a_max, ramp, pulse) {
        let word = u32::from(factor.pmul) << 8 | u32::from(factor.pdiv);
        steppers.write(axis, PMUL_PDIV, word, now);
    }
}

fn counter(steppers: &mut Steppers, axis: u8, now: Instant) -> f64 {
    f64::from((steppers.read(axis, X_ACTUAL, now) << 8).cast_signed() >> 8)
}

#[test]
fn the_field_stays_within_some_microsteps_of_the_counter() {
    for seed in 0..300 {
        let mut random = Random(seed);
        let resolution = random.below(9) as u32;
        let fine = f64::from(1u32 << resolution);
        let mut steppers = axes(&[Some(of_motor(STIFF))], resolution);
        let mut now = at(0);
        for step in 0..30 {
            match random.below(4) {
                0 => {
                    let numbers = [2048, 2048, 9, 9].map(|end| random.below(end) as u32);
                    limit(&mut steppers, 0, numbers, now);
                }
                1 => {
                    let target = random.between(-1e4, 1e4) as i32;
                    steppers.write(0, X_TARGET, target.cast_unsigned(), now);
                    steppers.write(0, REF_CONF_RAMP_MODE, random.one_in(5).into(), now);
                }
                2 => {
                    steppers.write(0, REF_CONF_RAMP_MODE, 2, now);
                    steppers.write(0, V_TARGET, random.next() as u32, now);
                }
                _ => {
                    let held = random.one_in(2).then_some(true);
                    steppers.hold_switch(0, SwitchInput::Left, held, now);
                }
            }
            let longest = 1 << (8 + random.below(14));
            for _ in 0..8 {
                let counted = counter(&mut steppers, 0, now);
                let view = steppers.view(0, now).unwrap();
                let told =
                    format!("seed {seed}, step {step}: {counted} {} {view:?}", view.rotor / fine);
                assert_eq!(view.state, Rotor::Following, "{told}");
                let most = if view.speed == 0.0 { 2.0 } else { 8.0 };
                assert!((view.rotor / fine - counted).abs() <= most, "{told}");
                now += Duration::from_ticks(random.below(longest));
            }
        }
    }
}

#[test]
fn at_its_target_the_rotor_is_where_the_counter_is() {
    for resolution in [0, 4, 8] {
        let fine = f64::from(1u32 << resolution);
        let mut steppers = axes(&[Some(of_motor(STIFF))], resolution);
        limit(&mut steppers, 0, [1000, 500, 7, 3], at(0));
        let mut now = at(0);
        for target in [5_000, -777, 1, 2, 40_000, -40_000, 0] {
            steppers.write(0, X_TARGET, i32::cast_unsigned(target), now);
            now += Duration::from_ticks(16_000_000 * 5);
            let rotor = steppers.view(0, now).unwrap().rotor;
            assert!((rotor - f64::from(target) * fine).abs() < 1e-6, "{rotor} {target}");
        }
    }
}

#[test]
fn a_switch_closes_when_the_rotor_comes_to_it() {
    // At 30517.578 microsteps/s, after 65.536 ms of acceleration on 1000 microsteps: 20 000 half a step later.
    let left = Switch {
        from: f64::NEG_INFINITY,
        to: -20_000.5,
        hysteresis: 0.0,
        bounce: 0,
        normally_closed: false,
    };
    let switches = Switches { left: Some(left), ..Switches::default() };
    let mut steppers = axes(&[Some(Machine { switches, ..of_motor(STIFF) })], 0);
    limit(&mut steppers, 0, [1000, 1000, 7, 3], at(0));
    steppers.write(0, REF_CONF_RAMP_MODE, 2, at(0));
    steppers.write(0, V_TARGET, (-1000i32).cast_unsigned(), at(0));
    let mut now = at(0);
    while let Some(next) = steppers.next_event(0, now).filter(|next| *next < seconds(2.0)) {
        now = next;
    }
    let speed = 1000.0 * 16e6 / (8.0 * 65_536.0);
    let acceleration = 1000.0 * 16e6 * 16e6 / f64::from(1u32 << 29) / 1024.0;
    // The first tick of 256 us comes at its end, so that the axis is half of that behind an even acceleration.
    let expected = speed / acceleration / 2.0 + 20_000.5 / speed + 128e-6;
    assert!((now.as_ticks() as f64 / 16e6 - expected).abs() < 1e-4, "{now:?} {expected}");
    assert_eq!(counter(&mut steppers, 0, now), -20_000.0);
    assert_eq!(steppers.read(0, V_ACTUAL, now), 0, "it stops there");
}

#[test]
fn the_third_switch_stops_the_first_axis_where_it_is_its_right_one() {
    let left = Switch {
        from: 10_000.5,
        to: f64::INFINITY,
        hysteresis: 0.0,
        bounce: 0,
        normally_closed: false,
    };
    let third = Machine {
        switches: Switches { left: Some(left), ..Switches::default() },
        ..of_motor(STIFF)
    };
    let idle = Some(of_motor(STIFF));
    let mut steppers = axes(&[idle.clone(), idle, Some(third)], 0);
    steppers.write(0, IF_CONFIGURATION, 0, at(0));
    steppers.write(0, GLOBAL_PARAMETERS, THIRD_IS_RIGHT_OF_FIRST, at(0));
    for axis in [0, 2] {
        limit(&mut steppers, axis, [1000, 1000, 7, 3], at(0));
        steppers.write(axis, REF_CONF_RAMP_MODE, 2, at(0));
        steppers.write(axis, V_TARGET, 1000, at(0));
    }
    // Both move alike, until the third comes to its switch.
    let end = seconds(1.0);
    assert_eq!(counter(&mut steppers, 0, end), 10_000.0);
    assert!((steppers.view(0, end).unwrap().rotor - 10_000.5).abs() < 2.0);
    assert!(counter(&mut steppers, 2, end) > 20_000.0);
}

#[test]
fn stallguard_falls_with_the_load_and_an_overload_costs_whole_periods() {
    use opentmcl_plant::axis::Influence::{Blocked, Torque};
    let mut steppers = axes(&[Some(of_motor(MOTOR))], 0);
    limit(&mut steppers, 0, [1678, 500, 7, 3], at(0));
    steppers.write(0, REF_CONF_RAMP_MODE, 2, at(0));
    steppers.write(0, V_TARGET, 1678, at(0));
    // 6.284 rad/s: 2.177 V of back EMF against 5 V of 1 A.
    let constant = 0.49 / 2f64.sqrt();
    let emf = constant * 1678.0 * 16e6 / (8.0 * 65_536.0) / 51_200.0 * core::f64::consts::TAU;
    for part in [0.0, 0.3, 0.6, 0.9] {
        steppers.influence(0, Torque(-part * constant), seconds(1.0));
        let value = steppers.view(0, seconds(1.0)).unwrap().stallguard;
        let expected = 800.0 * emf / (emf + 5.0) * (1.0 - part);
        assert!((f64::from(value) - expected).abs() <= 1.0, "{value} {expected}");
    }
    steppers.influence(0, Torque(0.0), seconds(1.0));
    steppers.influence(0, Blocked(true), seconds(1.0));
    steppers.influence(0, Blocked(false), seconds(2.0));
    let view = steppers.view(0, seconds(3.0)).unwrap();
    // 51208.5 microsteps of 1024 in a period.
    assert_eq!((view.lost_steps, view.state), (4 * 50, Rotor::Following));
}
