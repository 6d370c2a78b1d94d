//! When switches and the encoder see a machine pass, against times worked out by hand.

use crate::bench::*;
use opentmcl_motion::{Duration, Instant};
use opentmcl_plant::axis::SwitchInput;
use opentmcl_plant::machine::{Load, Machine, Stage, Switch, Switches};
use opentmcl_plant::tmc5160::registers::*;

fn switch(from: f64, to: f64) -> Option<Switch> {
    Some(Switch { from, to, hysteresis: 0.0, bounce: 0, normally_closed: false })
}

/// Lets time pass from event to event until the switches differ from what they are.
fn next_edge(bench: &mut Bench) -> Option<Instant> {
    let before = bench.view().switches;
    while let Some(event) = bench.axis.next_event(bench.now) {
        bench.now = event;
        if bench.view().switches != before {
            return Some(event);
        }
    }
    None
}

/// Clocks in which a field at this speed register covers this many fine steps: V is V/2^24 per clock.
fn clocks(way: f64, register: f64) -> f64 {
    way * (1 << 24) as f64 / register
}

#[test]
fn edges_come_in_the_clock_in_which_the_stage_passes_them() {
    let home = switch(30_000.0, 31_000.0);
    let mut bench =
        Bench::new(Machine { switches: Switches { home, ..Switches::default() }, ..machine() });
    // From VSTART at once to full speed: 65535 takes 53687 up in 107375 clocks, which is 172 fine steps.
    bench.turn(65_535, 53_687);
    bench.wait_ms(10.0);
    let (start, from) = (bench.now.as_ticks() as f64, bench.view().rotor);
    for edge in [30_000.0, 31_000.0] {
        let time = next_edge(&mut bench).unwrap().as_ticks() as f64;
        let expected = start + clocks(edge - from, 53_687.0);
        assert!((0.0..=1.5).contains(&(time - expected)), "{edge}: {time}, by hand {expected}");
        assert!((bench.view().rotor - edge).abs() < 0.01);
    }
    assert!(next_edge(&mut bench).is_none());
}

#[test]
fn an_edge_is_late_by_the_lag_of_a_loaded_rotor() {
    let mut times = Vec::new();
    for friction in [0.0, 0.2] {
        let load = Load { friction, ..Load::default() };
        let home = switch(30_000.0, 31_000.0);
        let switches = Switches { home, ..Switches::default() };
        let mut bench = Bench::new(Machine { load, switches, ..machine() });
        bench.turn(65_535, 53_687);
        times.push(next_edge(&mut bench).unwrap().as_ticks() as f64);
    }
    // At 51200 steps/s this motor still has all of its torque: 0.792 Nm.
    let torque = 0.4 / 2f64.sqrt() * 2.8;
    let lag = (0.2 / torque).asin() / std::f64::consts::FRAC_PI_2 * 256.0;
    let late = times[1] - times[0];
    assert!(
        (late - clocks(lag, 53_687.0)).abs() < 2.0,
        "{late}, by hand {}",
        clocks(lag, 53_687.0)
    );
}

#[test]
fn the_play_moves_the_edges_apart() {
    let stage = Stage { backlash: 400.0, ..Stage::default() };
    let home = switch(30_000.0, 31_000.0);
    let switches = Switches { home, ..Switches::default() };
    let mut bench = Bench::new(Machine { stage, switches, ..machine() });
    bench.turn(65_535, 53_687);
    next_edge(&mut bench).unwrap();
    assert!((bench.view().rotor - 30_200.0).abs() < 0.01);
    next_edge(&mut bench).unwrap();
    assert!((bench.view().rotor - 31_200.0).abs() < 0.01);
    bench.write(RAMPMODE, 2);
    next_edge(&mut bench).unwrap();
    assert!((bench.view().rotor - 30_800.0).abs() < 0.01, "back: {:?}", bench.view());
}

#[test]
fn on_a_circular_axis_the_switch_comes_with_every_turn() {
    let stage = Stage { circle: Some(51_200.0), ..Stage::default() };
    let home = switch(1_000.0, 2_000.0);
    let switches = Switches { home, ..Switches::default() };
    let mut bench = Bench::new(Machine { stage, switches, ..machine() });
    bench.turn(65_535, 200_000);
    for turn in 0..5 {
        for edge in [1_000.0, 2_000.0] {
            next_edge(&mut bench).unwrap();
            let expected = edge + f64::from(turn) * 51_200.0;
            assert!((bench.view().rotor - expected).abs() < 0.02, "{:?}", bench.view());
        }
    }
}

#[test]
fn a_hand_presses_a_switch_and_lets_it_go() {
    let left = switch(f64::NEG_INFINITY, -100.0);
    let switches = Switches { left, ..Switches::default() };
    let mut bench = Bench::new(Machine { switches, ..machine() });
    bench.axis.hold_switch(SwitchInput::Left, Some(true), bench.now);
    assert_eq!(bench.view().switches, [true, false, false]);
    bench.axis.hold_switch(SwitchInput::Left, None, bench.now);
    assert_eq!(bench.view().switches, [false; 3]);
    bench.axis.hold_switch(SwitchInput::Home, Some(true), bench.now);
    assert!(bench.axis.home_switch(bench.now), "also one that the machine does not have");
}

#[test]
fn a_bouncing_contact_changes_five_times() {
    let bounce = 16_000;
    let home = Some(Switch { bounce, ..switch(5_000.0, 9_000.0).unwrap() });
    let switches = Switches { home, ..Switches::default() };
    let mut bench = Bench::new(Machine { switches, ..machine() });
    bench.turn(65_535, 53_687);
    let first = next_edge(&mut bench).unwrap();
    for part in 1..5 {
        let edge = next_edge(&mut bench).unwrap();
        assert_eq!(edge, first + Duration::from_ticks(part * bounce / 5));
    }
    assert!(bench.view().switches[2]);
    let release = next_edge(&mut bench).unwrap();
    assert!(release > first + Duration::from_ticks(bounce), "then it is quiet until it opens");
}
