//! The supply of the bridge.

use std::f64::consts::TAU;

use opentmcl_motion::servo::Power;
use opentmcl_plant::servo::{Influence, Machine, Motor, Supply};

use crate::bench::{BRUSHED, Bench, SWITCH, frictionless, legs, near, regulated};

const SUPPLY: Supply =
    Supply { voltage: 24.0, resistance: 0.2, capacitance: 1e-3, conductance: 0.0, chopper: 5.0 };

#[test]
fn a_load_makes_the_bus_sag_by_the_resistance_of_the_source() {
    let mut bench = Bench::new(Machine { supply: SUPPLY, ..Machine::new(Motor::Brushed(BRUSHED)) });
    bench.influence(Influence::Blocked(true));
    bench.run(2000, |_| legs([Some(1.0), Some(0.0), None]));
    let view = bench.view();
    let current = 24.0 / (0.2 + BRUSHED.resistance + 2.0 * SWITCH);
    near(view.currents[0], current, 1e-6);
    near(view.bus, 24.0 - 0.2 * current, 1e-6);
    near(view.source_current, current, 1e-6);
    near(view.bus_current, current, 1e-6);
    bench.influence(Influence::SourceVoltage(12.0));
    bench.run(2000, |_| legs([Some(1.0), Some(0.0), None]));
    near(bench.view().currents[0], current / 2.0, 1e-6);
}

#[test]
fn half_the_duty_takes_a_quarter_of_the_current_from_the_bus() {
    let mut bench = Bench::new(Machine { supply: SUPPLY, ..Machine::new(Motor::Brushed(BRUSHED)) });
    bench.influence(Influence::Blocked(true));
    bench.run(2000, |_| legs([Some(32768.0 / 65535.0), Some(0.0), None]));
    let view = bench.view();
    near(view.bus_current, view.currents[0] / 2.0, 1e-4);
    near(view.currents[0], view.bus / 2.0 / (BRUSHED.resistance + 2.0 * SWITCH), 1e-4);
}

/// A motor that turns with 200 rad/s on 200e-6 kg m² without friction.
fn turning() -> Bench {
    let mut machine = Machine { supply: SUPPLY, ..Machine::new(Motor::Brushless(frictionless())) };
    machine.load.inertia = 152e-6;
    let mut bench = Bench::new(machine);
    bench.influence(Influence::Torque(200e-6 * 200.0 / 0.01));
    bench.run(200, |_| Power::default());
    bench.influence(Influence::Torque(0.0));
    bench
}

#[test]
fn braking_lifts_the_bus_by_what_the_capacitor_gets() {
    let mut bench = turning();
    let motor = frictionless();
    let mut burnt = 0.0;
    let kinetic = |speed: f64| 0.5 * 200e-6 * (speed / 60.0 * TAU).powi(2);
    let before = bench.view();
    while bench.view().bus < 50.0 && bench.view().speed > 200.0 {
        let from = bench.view().amplitude;
        bench.run(1, |view| regulated(view, &motor, -4.0));
        let square = (from.powi(2) + bench.view().amplitude.powi(2)) / 2.0;
        burnt += 1.5 * (motor.resistance + SWITCH) * square * 50e-6;
        assert_eq!(bench.view().source_current, (24.0 - bench.view().bus).max(0.0) / 0.2);
    }
    let after = bench.view();
    let gained = 0.5e-3 * (after.bus.powi(2) - before.bus.powi(2))
        + 0.75 * motor.inductance * after.amplitude.powi(2);
    near(gained, kinetic(before.speed) - kinetic(after.speed) - burnt, 5e-3);
    assert!(after.bus > 40.0, "{}", after.bus);
}

#[test]
fn a_generator_fills_the_capacitor_and_not_the_source() {
    let supply = Supply { resistance: 0.01, capacitance: 1e-4, ..SUPPLY };
    // An EMF of 20 V on half of the bus voltage.
    let mut bench = Bench::on_dyno(Motor::Brushed(BRUSHED), supply, 400.0);
    let mut expected = bench.view().bus;
    for _ in 0..20 {
        bench.run(1, |_| legs([Some(0.5), Some(0.0), None]));
        expected -= bench.view().bus_current * 50e-6 / 1e-4;
        near(bench.view().bus, expected, 1e-9);
    }
    assert!(expected > 30.0, "{expected}");
}

#[test]
fn a_motor_that_turns_meets_the_bus_that_it_makes_sag() {
    let supply = Supply { resistance: 3.0, capacitance: 2e-5, ..SUPPLY };
    let mut bench = Bench::on_dyno(Motor::Brushed(BRUSHED), supply, 200.0);
    bench.run(2000, |_| legs([Some(1.0), Some(0.0), None]));
    let current = (24.0 - 200.0 * 0.05) / (3.0 + BRUSHED.resistance + 2.0 * SWITCH);
    near(bench.view().currents[0], current, 1e-4);
    near(bench.view().bus, 24.0 - 3.0 * current, 1e-4);
}

#[test]
fn the_chopper_keeps_the_bus_down() {
    let mut bench = turning();
    let motor = frictionless();
    let mut on = false;
    let (mut highest, mut hot) = (0.0f64, 0);
    for _ in 0..3000 {
        bench.run(1, |view| {
            on = if on { view.bus > 27.0 } else { view.bus > 28.0 };
            let current = if view.speed > 100.0 { -4.0 } else { 0.0 };
            Power { chopper: on, ..regulated(view, &motor, current) }
        });
        highest = highest.max(bench.view().bus);
        hot += u32::from(on);
        if on {
            near(bench.view().chopper_current, bench.view().bus / 5.0, 1e-12);
        }
    }
    assert!(highest < 28.5 && hot > 10, "{highest} {hot}");
}

#[test]
fn the_module_empties_its_capacitor_when_the_source_is_gone() {
    let supply = Supply { conductance: 0.01, ..SUPPLY };
    let mut bench = Bench::new(Machine { supply, ..Machine::new(Motor::Brushed(BRUSHED)) });
    bench.run(100, |_| Power::default());
    let full = bench.view().bus;
    near(full, 24.0 / 1.002, 1e-6);
    bench.influence(Influence::SourceVoltage(0.0));
    bench.run(2000, |_| Power::default());
    near(bench.view().bus, full * (-1.0f64).exp(), 1e-6);
}
