//! Currents of windings.

use std::f64::consts::TAU;

use opentmcl_motion::servo::Power;
use opentmcl_plant::servo::{Influence, Motor};

use crate::bench::{
    BRUSHED, Bench, PERIOD, STIFF, SWITCH, frictionless, legs, machine, near, vector,
};

fn locked(motor: Motor) -> Bench {
    let mut bench = Bench::new(machine(motor));
    bench.influence(Influence::Blocked(true));
    bench
}

#[test]
fn the_current_of_a_locked_rotor_rises_along_the_exponential_of_its_winding() {
    let motor = frictionless();
    let resistance = 2.0 * (motor.resistance + SWITCH);
    let time_constant = 2.0 * motor.inductance / resistance;
    let mut bench = locked(Motor::Brushless(motor));
    for period in 1..200 {
        bench.run(1, |_| legs([Some(0.2), Some(0.0), None]));
        let time = f64::from(period) * PERIOD;
        let expected = 0.2 * 24.0 / resistance * (1.0 - (-time / time_constant).exp());
        let [a, b, c] = bench.view().currents;
        near(a, expected, 1e-3);
        near(b, -expected, 1e-3);
        assert!(c.abs() < 1e-12);
    }
}

#[test]
fn so_does_that_of_a_motor_with_brushes_in_either_direction() {
    let resistance = BRUSHED.resistance + 2.0 * SWITCH;
    for (parts, sign) in [([0.75, 0.25], 1.0), ([0.25, 0.75], -1.0)] {
        let mut bench = locked(Motor::Brushed(BRUSHED));
        bench.run(20, |_| legs([Some(parts[0]), Some(parts[1]), Some(1.0)]));
        let left = (-20.0 * PERIOD * resistance / BRUSHED.inductance).exp();
        let view = bench.view();
        near(view.currents[0], sign * 12.0 / resistance * (1.0 - left), 1e-3);
        assert_eq!((view.currents[1], view.currents[2]), (-view.currents[0], 0.0));
        near(view.torque, BRUSHED.torque_constant * view.currents[0], 1e-9);
    }
}

#[test]
fn torque_is_current_times_constant_and_depends_on_the_angle_between_current_and_flux() {
    let motor = frictionless();
    for twelfth in 0..12 {
        let mut bench = Bench::new(machine(Motor::Brushless(motor)));
        // Current into A and out of B and C is along phase A; the flux is turned against it.
        bench.influence(Influence::Position(f64::from(twelfth) * 65536.0 / 48.0));
        bench.influence(Influence::Blocked(true));
        bench.run(2000, |_| legs([Some(0.1), Some(0.0), Some(0.0)]));
        let view = bench.view();
        let current = 2.0 / 3.0 * 2.4 / (motor.resistance + SWITCH);
        near(view.amplitude, current, 1e-3);
        let expected = -0.0312 * current * (f64::from(twelfth) * TAU / 12.0).sin();
        assert!((view.torque - expected).abs() < 2e-3 * 0.0312 * current, "{twelfth}");
    }
}

#[test]
fn a_motor_at_a_constant_speed_has_the_currents_of_its_phasors() {
    let motor = frictionless();
    let (resistance, flux) = (motor.resistance + SWITCH, motor.flux_linkage);
    for (speed, direct, across) in [(100.0, 0.0, 3.0), (-150.0, 1.0, -2.0), (200.0, -2.0, 4.0)] {
        let mut bench = Bench::on_dyno(Motor::Brushless(motor), STIFF, speed);
        bench.run(1000, |view| vector(view, 4.0, direct, across));
        // v_d = R i_d - X i_q and v_q = R i_q + X i_d + ω ψ.
        let (electrical, reactance) = (4.0 * speed, 4.0 * speed * motor.inductance);
        let square = resistance * resistance + reactance * reactance;
        let beyond = across - electrical * flux;
        let view = bench.view();
        let direct_current = (resistance * direct + reactance * beyond) / square;
        let torque_current = (resistance * beyond - reactance * direct) / square;
        let part = 2e-3 * direct_current.hypot(torque_current);
        assert!((view.direct_current - direct_current).abs() < part, "{view:?}");
        assert!((view.torque_current - torque_current).abs() < part, "{view:?}");
    }
}

#[test]
fn shorted_phases_carry_what_the_emf_drives() {
    let motor = frictionless();
    let mut bench = Bench::on_dyno(Motor::Brushless(motor), STIFF, 150.0);
    bench.run(1000, |_| legs([Some(0.0); 3]));
    let impedance = (motor.resistance + SWITCH).hypot(600.0 * motor.inductance);
    near(bench.view().amplitude, 600.0 * motor.flux_linkage / impedance, 1e-3);
    assert!(bench.view().torque < 0.0, "it brakes");
}

#[test]
fn open_legs_carry_nothing_below_the_bus_voltage_and_rectify_above() {
    let motor = Motor::Brushless(frictionless());
    // The EMF between two terminals is 0.036 V per rad/s at its peak.
    let mut below = Bench::on_dyno(motor, STIFF, 650.0);
    below.run(400, |_| Power::default());
    assert_eq!(below.view().amplitude, 0.0);
    let mut above = Bench::on_dyno(motor, STIFF, 800.0);
    let mut given = 0.0;
    for _ in 0..400 {
        above.run(1, |_| Power::default());
        assert!(above.view().bus_current <= 0.0);
        given -= above.view().bus_current / 400.0;
    }
    assert!(given > 1.0, "{given}");
}

#[test]
fn a_floating_terminal_that_the_emf_pulls_below_ground_conducts() {
    let mut bench = Bench::on_dyno(Motor::Brushless(frictionless()), STIFF, 100.0);
    let (mut flowing, mut floating) = (0, 0);
    for _ in 0..2000 {
        bench.run(1, |_| legs([Some(0.0), Some(0.0), None]));
        let [_, _, c] = bench.view().currents;
        assert!(c > -1e-9, "the diode lets no current out of the motor: {c}");
        if c > 1e-6 { flowing += 1 } else { floating += 1 }
    }
    assert!(flowing > 600 && floating > 200, "{flowing} {floating}");
}

#[test]
fn block_commutation_in_the_middle_of_a_block_has_two_phases_in_series() {
    let motor = frictionless();
    let speed = 100.0 / 60.0 * TAU;
    // Legs that are high and low in the sectors of 60°.
    let blocks = [(1, 2), (1, 0), (2, 0), (2, 1), (0, 1), (0, 2)];
    let mut bench = Bench::on_dyno(Motor::Brushless(motor), STIFF, speed);
    let expected = (24.0 / 12.0 - 0.036 * speed) / (2.0 * (motor.resistance + SWITCH));
    let mut middles = 0;
    for _ in 0..12_000 {
        let sectors = bench.view().electrical_angle * 6.0;
        let sector = (sectors.round() as usize) % 6;
        let (high, low) = blocks[sector];
        let mut parts = [None; 3];
        parts[high] = Some(1.0 / 12.0);
        parts[low] = Some(0.0);
        bench.run(1, |_| legs(parts));
        if (sectors - sectors.round()).abs() < 0.002 {
            middles += 1;
            let view = bench.view();
            near(view.currents[high], expected, 3e-3);
            near(view.currents[low], -expected, 3e-3);
            near(view.torque, 0.036 * expected, 3e-3);
        }
    }
    assert!(middles >= 20, "{middles}");
}

#[test]
fn the_phase_that_is_left_runs_out_through_its_diode_and_stays_without_current() {
    let motor = frictionless();
    let resistance = motor.resistance + SWITCH;
    let time_constant = motor.inductance / resistance;
    let mut bench = locked(Motor::Brushless(motor));
    bench.run(2000, |_| legs([Some(0.1), None, Some(0.0)]));
    let before = 2.4 / (2.0 * resistance);
    near(bench.view().currents[0], before, 1e-3);
    // Now A high, B low: C's current goes through its upper diode, with a third of the bus voltage against it.
    let third = 24.0 / 3.0 / resistance;
    let gone = time_constant * (1.0 + before / third).ln();
    let rising = |time: f64| third + (before - third) * (-time / time_constant).exp();
    for period in 1..30 {
        bench.run(1, |_| legs([Some(1.0), Some(0.0), None]));
        let time = f64::from(period) * PERIOD;
        let [a, _, c] = bench.view().currents;
        if time < gone {
            near(a, rising(time), 1e-3);
            let left = third - (before + third) * (-time / time_constant).exp();
            assert!((c - left).abs() < 1e-3 * before, "{c}, not {left}");
        } else {
            let end = 24.0 / (2.0 * resistance);
            let expected = end + (rising(gone) - end) * (-(time - gone) / time_constant).exp();
            near(a, expected, 1e-3);
            assert!(c.abs() < 1e-9, "{c}");
        }
    }
    assert!(gone > 3.0 * PERIOD, "{gone} is seen");
}

#[test]
fn a_phase_whose_wire_is_off_carries_nothing() {
    let mut bench = locked(Motor::Brushless(frictionless()));
    bench.influence(Influence::PhaseOpen(1, true));
    bench.run(400, |_| legs([Some(0.1), Some(0.5), Some(0.0)]));
    let [a, b, c] = bench.view().currents;
    assert!(b.abs() < 1e-12 && a > 3.0 && (a + c).abs() < 1e-12, "{a} {b} {c}");
    bench.influence(Influence::DriverFault(true));
    bench.run(400, |_| legs([Some(0.1), Some(0.5), Some(0.0)]));
    assert_eq!(bench.view().amplitude, 0.0, "a faulty driver lets go");
}
