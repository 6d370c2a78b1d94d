//! StallGuard2 and what follows from it, against the load worked out by hand.

use std::f64::consts::TAU;

use crate::bench::*;
use opentmcl_plant::axis::Rotor;
use opentmcl_plant::machine::motor::PRESETS;
use opentmcl_plant::machine::{Load, Machine};
use opentmcl_plant::tmc5160::registers::*;

const SG_STOP: u32 = 1 << 10;
const EVENT_STOP_SG: u32 = 1 << 6;

fn sg_result(bench: &mut Bench) -> f64 {
    f64::from(bench.read(DRV_STATUS) & 0x3FF)
}

/// A speed of so many turns per second in register units.
fn register(turns: f64) -> u32 {
    (turns * 51_200.0 * f64::from(1 << 24) / 16e6) as u32
}

#[test]
fn the_value_falls_linearly_to_zero_at_the_torque_at_which_the_motor_pulls_out() {
    for name in ["qsh4218-51-10-049", "qsh5718-51-28-101", "qsh6018-56-28-165", "nema17"] {
        let motor = PRESETS.iter().find(|preset| preset.name == name).unwrap().motor;
        for (turns, scale) in [(1.0, 15), (2.0, 15), (3.0, 23), (4.0, 31)] {
            // The torque at which the motor pulls out, found by raising the load until it does.
            let constant = motor.holding_torque / (2f64.sqrt() * motor.rated_current);
            let most = constant * 2.8 * f64::from(scale + 1) / 32.0;
            let at = |torque: f64| {
                let mut bench = Bench::new(Machine { motor, ..machine() });
                bench.write(IHOLD_IRUN, scale << 8 | scale);
                bench.turn(20_000, register(turns));
                bench.wait_ms(2_000.0);
                bench.axis.set_external_torque(-torque, bench.now);
                bench.wait_ms(100.0);
                let follows = bench.view().state == Rotor::Following;
                (follows, sg_result(&mut bench))
            };
            let (mut holds, mut fails) = (0.0, most * 1.01);
            for _ in 0..30 {
                let middle = (holds + fails) / 2.0;
                if at(middle).0 { holds = middle } else { fails = middle }
            }
            let free = at(0.0).1;
            assert!(free > 30.0, "{name} at {turns}/s: {free}");
            for part in [0.1, 0.25, 0.5, 0.75, 0.9, 1.0] {
                let line = free * (1.0 - part);
                let found = at(holds * part).1;
                // One digit is the resolution.
                assert!(
                    (found - line).abs() <= (free * 0.05).max(1.0),
                    "{name} at {turns}/s, {part} of {holds} Nm: {found}, on the line {line}"
                );
            }
            assert_eq!(at(fails * 1.01), (false, 0.0), "{name} at {turns}/s has stalled");
        }
    }
}

/// A motor that turns once per second with StallGuard2 on at any speed.
fn watched(threshold: i32) -> Bench {
    let mut bench = Bench::new(machine());
    bench.write(TCOOLTHRS, 0xF_FFFF);
    bench.write(COOLCONF, (threshold.cast_unsigned() & 0x7F) << 16);
    bench.turn(2_000, 53_687);
    bench.wait_ms(1_000.0);
    bench.write(SW_MODE, SG_STOP);
    bench
}

#[test]
fn a_blocked_axis_stops_by_stall_within_a_reading_and_loses_nothing() {
    let mut bench = watched(0);
    bench.axis.set_blocked(true, bench.now);
    let stuck = bench.view().rotor;
    bench.wait_ms(100.0);
    assert_eq!(bench.read(VACTUAL), 0);
    assert_ne!(bench.read(RAMP_STAT) & EVENT_STOP_SG, 0);
    // The value is 0 when the load angle is 90 degrees, one full step ahead, and is read one full step
    // later: the field stands at most two full steps ahead, from where it still holds the rotor.
    let ahead = bench.position() - stuck;
    assert!((256.0..=512.5).contains(&ahead), "{ahead}");
    assert_eq!(bench.view().lost_steps, 0);
}

#[test]
fn a_higher_threshold_takes_more_load_to_stop() {
    let mut torques = Vec::new();
    for threshold in [-4, 0] {
        let mut bench = watched(threshold);
        let full = 0.4 / 2f64.sqrt() * 2.8;
        let stops = (0..100).find(|part| {
            bench.axis.set_external_torque(-full * f64::from(*part) / 100.0, bench.now);
            bench.wait_ms(50.0);
            bench.read(RAMP_STAT) & EVENT_STOP_SG != 0
        });
        torques.push(stops.unwrap_or(100));
    }
    // -4 takes 64 from the value: at 1/s it is 800 E / (E + R I), E = K w.
    let emf = 0.4 / 2f64.sqrt() * TAU;
    let free = 800.0 * emf / (emf + 2.0 * 2.8);
    let expected = 100.0 * (1.0 - 64.0 / free);
    assert!((f64::from(torques[0]) - expected).abs() <= 2.0, "{torques:?}, by hand {expected}");
    assert!(torques[1] >= 99, "{torques:?}");
}

#[test]
fn coolstep_settles_at_the_current_at_which_the_value_is_between_its_limits() {
    // SEMIN 2: below 64 more current; SEMAX 1: from (2 + 1 + 1) * 32 = 128 on less; SEUP 1, SEDN 3.
    let (semin, semax) = (2, 1);
    let mut bench =
        Bench::new(Machine { load: Load { friction: 0.05, ..Load::default() }, ..machine() });
    bench.write(TCOOLTHRS, 0xF_FFFF);
    bench.write(COOLCONF, semin | semax << 8 | 3 << 13 | 1 << 15);
    bench.turn(2_000, 53_687);
    bench.wait_ms(4_000.0);
    let result = |torque: f64, scale: u32| {
        let constant = 0.4 / 2f64.sqrt();
        let current = 2.8 * f64::from(scale + 1) / 32.0;
        let emf = constant * TAU;
        let free = 800.0 * emf / (emf + 2.0 * current);
        free * (1.0 - (torque / (constant * current)).min(1.0))
    };
    let mut torque: f64 = 0.0;
    for goal in [0.0, 0.2, 0.4, 0.1] {
        // Slowly: a sudden load would find the motor with the current for the one before.
        while torque != goal {
            torque += (goal - torque).clamp(-0.01, 0.01);
            bench.axis.set_external_torque(-torque, bench.now);
            bench.wait_ms(100.0);
        }
        bench.wait_ms(1_000.0);
        assert_eq!(bench.view().state, Rotor::Following, "{torque}");
        let scale = bench.read(DRV_STATUS) >> 16 & 0x1F;
        let found = sg_result(&mut bench);
        assert!(
            (found - result(torque + 0.05, scale)).abs() <= 1.0,
            "{torque}: {found} at {scale}"
        );
        let lowest = scale == 7;
        assert!(found >= 64.0 || scale == 31, "{torque}: {found} at {scale}");
        assert!(found < 128.0 || lowest, "{torque}: {found} at {scale}");
    }
}
