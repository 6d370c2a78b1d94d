//! A machine in which nothing changes can be skipped.

use opentmcl_motion::Instant;
use opentmcl_motion::servo::{PERIOD_TICKS, Power};
use opentmcl_plant::servo::motor::preset;
use opentmcl_plant::servo::{Influence, Machine, Motor, Noise, Sensing, Servo, TwoShunt};

use crate::bench::{Bench, legs};

fn bench() -> Bench {
    Bench::new(Machine::new(Motor::Brushless(preset("qbl4208-61-04-013").unwrap())))
}

/// Runs as a module does, with its senses in each period.
fn run(bench: &mut Bench, periods: u64, power: Power) {
    for _ in 0..periods {
        bench.ticks += PERIOD_TICKS;
        let _ = bench.servo.sense(bench.now());
        bench.servo.drive(&power, bench.now());
    }
}

#[test]
fn a_machine_at_rest_becomes_still_with_and_without_current() {
    let cases = [
        Power::default(),
        legs([Some(0.3), Some(0.28), Some(0.28)]),
        legs([Some(0.02), Some(0.0), None]),
        legs([Some(0.5); 3]),
    ];
    for power in cases {
        let mut bench = bench();
        run(&mut bench, 40_000, power);
        assert!(bench.servo.is_still(), "{power:?} {:?}", bench.view());
        let mut skipped = bench.clone();
        let later = bench.ticks + 123_456 * PERIOD_TICKS + 77;
        while bench.ticks + PERIOD_TICKS <= later {
            run(&mut bench, 1, power);
        }
        bench.ticks = later;
        skipped.ticks = later;
        skipped.servo.skip(Instant::from_ticks(later));
        assert_eq!(skipped.view(), bench.view(), "{power:?}");
        assert_eq!(skipped.servo.sense(skipped.now()), bench.servo.sense(bench.now()));
        // What comes then is the same, too.
        let moving = legs([Some(0.5), Some(0.4), Some(0.3)]);
        run(&mut bench, 333, moving);
        run(&mut skipped, 333, moving);
        assert_eq!(skipped.view(), bench.view(), "{power:?}");
    }
}

#[test]
fn skipping_a_machine_in_motion_is_stepping() {
    let mut bench = bench();
    let power = legs([Some(0.5), Some(0.4), Some(0.3)]);
    run(&mut bench, 100, power);
    let mut skipped = bench.clone();
    skipped.ticks += 5000 * PERIOD_TICKS;
    skipped.servo.skip(skipped.now());
    run(&mut bench, 5000, power);
    assert_eq!(skipped.view(), bench.view());
}

#[test]
fn a_skip_takes_no_longer_for_a_year_than_for_a_second() {
    let mut bench = bench();
    run(&mut bench, 40_000, legs([Some(0.3), Some(0.28), Some(0.28)]));
    bench.ticks += 365 * 86_400 * 16_000_000;
    bench.servo.skip(bench.now());
    let view = bench.view();
    // 2/3 of 2 % of 24 V on 0.364 Ω, heating 0.36 Ω on 4 K/W and 4 mΩ on 12 K/W.
    let amplitude = 2.0 / 3.0 * 0.02 * view.bus / 0.364;
    let square = 1.5 * amplitude * amplitude;
    assert!((view.winding_temperature - (25.0 + square * 0.36 * 4.0)).abs() < 0.01, "{view:?}");
    assert!((view.driver_temperature - (25.0 + square * 0.004 * 12.0)).abs() < 0.01, "{view:?}");
}

#[test]
fn what_moves_bounces_or_is_noisy_is_not_still() {
    let mut moving = bench();
    run(&mut moving, 40_000, Power::default());
    assert!(moving.servo.is_still());
    moving.influence(Influence::Torque(0.1));
    assert!(!moving.servo.is_still(), "it is about to move");
    let machine = moving.servo.machine().clone();
    let noise = Noise { counts: 1.0, seed: 1 };
    let mut noisy = moving.clone();
    noisy.servo = Servo::new(machine, Sensing::TwoShunt(TwoShunt { noise, ..TwoShunt::default() }));
    noisy.ticks = 0;
    run(&mut noisy, 40_000, Power::default());
    assert!(!noisy.servo.is_still());
}

#[test]
fn a_look_at_a_still_machine_after_weeks_costs_no_steps() {
    let mut bench = bench();
    run(&mut bench, 40_000, Power::default());
    // Step by step this would take days.
    let later = Instant::from_ticks(bench.ticks + 1000 * 3600 * 16_000_000);
    assert_eq!(bench.servo.view(later).turns, bench.view().turns);
    assert_eq!(bench.servo.switches(later), [false; 3]);
}
