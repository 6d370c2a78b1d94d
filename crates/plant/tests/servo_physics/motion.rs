//! Motion of rotors.

use std::f64::consts::TAU;

use opentmcl_motion::servo::Power;
use opentmcl_plant::machine::{Load, Spring, Stage, Switch};
use opentmcl_plant::servo::motor::{Brushless, Cogging};
use opentmcl_plant::servo::{HoldingBrake, Influence, Machine, Motor};

use crate::bench::{BRUSHED, Bench, PERIOD, frictionless, legs, machine, near, vector};

/// Fine steps of a turn.
const TURN: f64 = 65536.0;

/// A motor of which only the bearings act, turning with a speed in rad/s.
fn turning(friction: f64, viscous: f64, speed: f64) -> Bench {
    let motor = Brushless { friction, viscous, ..frictionless() };
    let mut bench = Bench::new(machine(Motor::Brushless(motor)));
    // Short and strong, so that friction hardly matters.
    bench.influence(Influence::Torque(motor.inertia * speed / PERIOD + friction));
    bench.run(1, |_| Power::default());
    bench.influence(Influence::Torque(0.0));
    near(bench.view().speed, speed * 60.0 / TAU, 1e-3);
    bench
}

#[test]
fn a_motor_without_load_turns_until_its_emf_is_the_voltage() {
    let mut brushed = Bench::new(machine(Motor::Brushed(BRUSHED)));
    brushed.run(40_000, |_| legs([Some(0.0), Some(0.5), None]));
    near(brushed.view().speed, -12.0 / 0.05 * 60.0 / TAU, 1e-3);
    let motor = frictionless();
    let mut brushless = Bench::new(machine(Motor::Brushless(motor)));
    brushless.run(40_000, |view| vector(view, 4.0, 0.0, 6.0));
    let view = brushless.view();
    // There the current that is left only crosses the inductance.
    let emf = view.speed / 60.0 * TAU * 4.0 * motor.flux_linkage;
    near(emf, 6.0, 2e-3);
    near(brushless.view().speed, 6.0 / (motor.flux_linkage * 4.0) * 60.0 / TAU, 2e-3);
}

#[test]
fn viscous_friction_slows_down_along_an_exponential() {
    let mut bench = turning(0.0, 1e-4, 300.0);
    let start = bench.view().speed;
    for _ in 0..10 {
        bench.run(1000, |_| Power::default());
        let time = (bench.ticks as f64 / 16e6) - PERIOD;
        near(bench.view().speed, start * (-time * 1e-4 / 48e-6).exp(), 1e-4);
    }
}

#[test]
fn dry_friction_slows_down_evenly_and_then_holds_exactly() {
    let mut bench = turning(2.4e-3, 0.0, 200.0);
    // 50 rad/s².
    let (start, from) = (bench.view().speed, bench.view().rotor);
    let rate = 50.0 * 60.0 / TAU;
    bench.run(40_000, |_| Power::default());
    near(bench.view().speed, start - 2.0 * rate, 1e-4);
    bench.run(41_000, |_| Power::default());
    let rest = bench.view();
    assert_eq!(rest.speed, 0.0);
    let way = (start / rate) * start / 60.0 / 2.0 * TURN;
    near(rest.rotor - from, way, 1e-4);
    bench.influence(Influence::Torque(2.39e-3));
    bench.run(1000, |_| Power::default());
    assert_eq!((bench.view().rotor, bench.view().speed), (rest.rotor, 0.0), "friction holds");
    bench.influence(Influence::Torque(-2.41e-3));
    bench.run(1000, |_| Power::default());
    assert!(bench.view().speed < 0.0, "and gives way");
}

#[test]
fn a_spring_swings_with_its_frequency_and_keeps_its_energy() {
    let mut machine = machine(Motor::Brushless(frictionless()));
    // 0.5 Nm per rad on 48e-6 kg m²: 102 rad/s.
    let rate = 0.5 * TAU / TURN;
    machine.load = Load { springs: vec![Spring { rate, rest: 0.0 }], ..Load::default() };
    let mut bench = Bench::new(machine);
    bench.influence(Influence::Position(1000.0));
    let period = TAU / (0.5f64 / 48e-6).sqrt();
    bench.run((100.0 * period / PERIOD).round() as u64, |_| Power::default());
    near(bench.view().rotor, 1000.0, 1e-2);
    bench.run((0.5 * period / PERIOD).round() as u64, |_| Power::default());
    near(bench.view().rotor, -1000.0, 1e-2);
}

#[test]
fn the_stiffest_spring_and_the_lightest_rotor_stay_within_their_energy() {
    let motor = Brushless { inertia: 1e-9, ..frictionless() };
    let mut machine = machine(Motor::Brushless(motor));
    let rate = 1e4 * TAU / TURN;
    machine.load = Load { springs: vec![Spring { rate, rest: 0.0 }], ..Load::default() };
    let mut bench = Bench::new(machine);
    bench.influence(Influence::Position(1000.0));
    for _ in 0..10_000 {
        bench.run(1, |_| Power::default());
        assert!(bench.view().rotor.abs() <= 1000.1, "{}", bench.view().rotor);
    }
}

#[test]
fn hard_stops_stop_and_a_circle_has_none() {
    let stage = Stage { lowest: Some(-500.0), highest: Some(20_000.0), ..Stage::default() };
    let mut bench = Bench::new(Machine { stage, ..machine(Motor::Brushed(BRUSHED)) });
    bench.run(4000, |_| legs([Some(0.2), Some(0.0), None]));
    let view = bench.view();
    assert_eq!((view.rotor, view.speed), (20_000.0, 0.0));
    near(view.currents[0], 4.8 / 1.508, 1e-3);
    bench.run(4000, |_| legs([Some(0.0), Some(0.2), None]));
    assert_eq!((bench.view().rotor, bench.view().speed), (-500.0, 0.0));
    let circle = Stage { circle: Some(TURN), ..stage };
    let mut bench = Bench::new(Machine { stage: circle, ..machine(Motor::Brushed(BRUSHED)) });
    bench.run(4000, |_| legs([Some(0.2), Some(0.0), None]));
    assert!(bench.view().rotor > 100_000.0);
}

#[test]
fn a_holding_brake_holds_until_it_gets_its_duty() {
    let brake = Some(HoldingBrake { torque: 0.4, release_duty: 20 });
    let mut machine = Machine { brake, ..machine(Motor::Brushless(frictionless())) };
    machine.load.constant = -0.2;
    let mut bench = Bench::new(machine);
    bench.run(1000, |_| Power { brake: 19, ..Power::default() });
    assert_eq!(bench.view().rotor, 0.0);
    bench.run(1000, |_| Power { brake: 20, ..Power::default() });
    near(bench.view().speed, -0.2 / 48e-6 * 0.05 * 60.0 / TAU, 1e-6);
    // It brakes with 0.2 Nm more than the weight pulls: as long as it fell.
    bench.run(990, |_| Power::default());
    assert!(bench.view().speed < 0.0);
    bench.run(20, |_| Power::default());
    assert_eq!(bench.view().speed, 0.0);
}

#[test]
fn a_cogging_rotor_settles_in_one_of_its_positions() {
    let cogging = Cogging { torque: 0.01, per_turn: 24 };
    let motor = Brushless { cogging, viscous: 1e-3, ..frictionless() };
    let mut bench = Bench::new(machine(Motor::Brushless(motor)));
    bench.influence(Influence::Position(TURN / 24.0 * 5.4));
    bench.run(40_000, |_| Power::default());
    near(bench.view().rotor, TURN / 24.0 * 5.0, 1e-6);
}

#[test]
fn the_stage_has_play_and_actuates_its_switches() {
    let stage = Stage { backlash: 200.0, ..Stage::default() };
    let home =
        Switch { from: 950.0, to: 2000.0, hysteresis: 0.0, bounce: 0, normally_closed: false };
    let mut machine = Machine { stage, ..machine(Motor::Brushed(BRUSHED)) };
    machine.switches.home = Some(home);
    let mut bench = Bench::new(machine);
    let mut seen = false;
    for _ in 0..600 {
        bench.run(1, |_| legs([Some(0.02), Some(0.0), None]));
        let view = bench.view();
        assert_eq!(view.stage, (view.rotor - 100.0).max(0.0));
        assert_eq!(view.switches, [false, false, (950.0..=2000.0).contains(&view.stage)]);
        assert_eq!(bench.servo.switches(bench.now()), view.switches);
        seen |= view.switches[2];
    }
    assert!(seen);
}

#[test]
fn a_blocked_rotor_stands_where_it_was_held() {
    let mut bench = turning(0.0, 0.0, 100.0);
    bench.influence(Influence::Blocked(true));
    let at = bench.view().rotor;
    bench.influence(Influence::Torque(100.0));
    bench.influence(Influence::Position(0.0));
    bench.run(100, |view| vector(view, 4.0, 0.0, 3.0));
    assert_eq!((bench.view().rotor, bench.view().speed), (at, 0.0));
    bench.influence(Influence::Blocked(false));
    bench.run(10, |_| Power::default());
    assert!(bench.view().speed > 0.0);
}
