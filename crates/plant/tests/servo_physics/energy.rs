//! What comes out of the source is found again.

use std::f64::consts::TAU;

use opentmcl_motion::servo::Power;
use opentmcl_plant::servo::motor::{Brushless, preset};
use opentmcl_plant::servo::{Influence, Machine, Motor, Supply, View};

use crate::bench::{Bench, PERIOD, SWITCH, legs, regulated};

const SUPPLY: Supply =
    Supply { voltage: 24.0, resistance: 0.1, capacitance: 2e-3, conductance: 0.002, chopper: 5.0 };

/// Adds up powers by the rule of trapezoids.
struct Meter {
    motor: Brushless,
    inertia: f64,
    external: f64,
    before: View,
    given: f64,
    lost: f64,
    turned_over: f64,
}

impl Meter {
    fn new(bench: &Bench, motor: Brushless, inertia: f64) -> Self {
        let before = bench.view();
        Self { motor, inertia, external: 0.0, before, given: 0.0, lost: 0.0, turned_over: 0.0 }
    }

    fn powers(&self, view: &View) -> [f64; 2] {
        let speed = view.speed / 60.0 * TAU;
        let source = SUPPLY.voltage * view.source_current + self.external * speed;
        let copper = 1.5 * (self.motor.resistance + SWITCH) * view.amplitude * view.amplitude;
        let friction = self.motor.friction * speed.abs() + self.motor.viscous * speed * speed;
        let wires = SUPPLY.resistance * view.source_current * view.source_current;
        let bus = view.bus * (view.bus * SUPPLY.conductance + view.chopper_current);
        [source, copper + friction + wires + bus]
    }

    fn stored(&self, view: &View) -> f64 {
        let speed = view.speed / 60.0 * TAU;
        0.5 * self.inertia * speed * speed
            + 0.75 * self.motor.inductance * view.amplitude * view.amplitude
            + 0.5 * SUPPLY.capacitance * view.bus * view.bus
    }

    fn pass(&mut self, bench: &Bench) {
        let view = bench.view();
        let [[given, lost], [given_before, lost_before]] =
            [self.powers(&view), self.powers(&self.before)];
        self.given += (given + given_before) / 2.0 * PERIOD;
        self.lost += (lost + lost_before) / 2.0 * PERIOD;
        self.turned_over += (given.abs() + lost) * PERIOD;
        self.before = view;
    }
}

fn bench(motor: Brushless) -> (Bench, f64) {
    let mut machine = Machine { supply: SUPPLY, ..Machine::new(Motor::Brushless(motor)) };
    machine.load.inertia = 20e-6;
    let inertia = motor.inertia + 20e-6;
    (Bench::new(machine), inertia)
}

#[test]
fn energy_is_kept_in_acceleration_load_and_braking() {
    for name in ["qbl4208-61-04-013", "qbl4208-100-04-025-light"] {
        let motor = preset(name).unwrap();
        let (mut bench, inertia) = bench(motor);
        bench.run(100, |_| Power::default());
        let mut meter = Meter::new(&bench, motor, inertia);
        let stored = meter.stored(&bench.view());
        for period in 0..8000 {
            if period == 3000 || period == 5000 {
                meter.external = if period == 3000 { -0.15 } else { 0.0 };
                bench.influence(Influence::Torque(meter.external));
                meter.before = bench.view();
            }
            let target = if period < 6000 { 3000.0 } else { 0.0 };
            bench.run(1, |view| {
                let current = ((target - view.speed) * 0.05).clamp(-8.0, 8.0);
                Power { chopper: view.bus > 28.0, ..regulated(view, &motor, current) }
            });
            meter.pass(&bench);
        }
        let gained = meter.stored(&bench.view()) - stored;
        let missing = meter.given - meter.lost - gained;
        println!("{name}: {missing} of {} J, given {}", meter.turned_over, meter.given);
        assert!(missing.abs() < 1e-3 * meter.turned_over, "{name}: {missing}");
    }
}

#[test]
fn energy_is_kept_in_block_commutation() {
    let motor = preset("qbl4208-61-04-013").unwrap();
    let (mut bench, inertia) = bench(motor);
    let mut meter = Meter::new(&bench, motor, inertia);
    let stored = meter.stored(&bench.view());
    let blocks = [(1, 2), (1, 0), (2, 0), (2, 1), (0, 1), (0, 2)];
    for period in 0..8000 {
        bench.run(1, |view| {
            let (high, low) = blocks[((view.electrical_angle * 6.0).round() as usize) % 6];
            let mut parts = [None; 3];
            parts[high] = Some(0.4);
            parts[low] = Some(0.0);
            if period < 6000 { legs(parts) } else { legs([None; 3]) }
        });
        meter.pass(&bench);
    }
    let gained = meter.stored(&bench.view()) - stored;
    let missing = meter.given - meter.lost - gained;
    println!("{missing} of {} J, given {}", meter.turned_over, meter.given);
    assert!(missing.abs() < 1e-2 * meter.turned_over, "{missing}");
}
