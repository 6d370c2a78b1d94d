//! A machine, its data, and who drives it.

use std::f64::consts::TAU;

use opentmcl_motion::Instant;
use opentmcl_motion::servo::{Leg, PERIOD_TICKS, Power};
use opentmcl_plant::servo::motor::{Brushed, Brushless, preset};
use opentmcl_plant::servo::{Influence, Machine, Motor, Sensing, Servo, Supply, TwoShunt, View};

/// A control period in seconds.
pub(crate) const PERIOD: f64 = 50e-6;

/// Resistance of a switch in ohm.
pub(crate) const SWITCH: f64 = 0.004;

/// QBL4208-61 without friction.
pub(crate) fn frictionless() -> Brushless {
    Brushless { friction: 0.0, viscous: 0.0, ..preset("qbl4208-61-04-013").unwrap() }
}

/// A motor with brushes and without friction.
pub(crate) const BRUSHED: Brushed = Brushed {
    resistance: 1.5,
    inductance: 1e-3,
    torque_constant: 0.05,
    inertia: 20e-6,
    friction: 0.0,
    viscous: 0.0,
};

/// 24 V that nothing moves.
pub(crate) const STIFF: Supply =
    Supply { voltage: 24.0, resistance: 1e-5, capacitance: 1.0, conductance: 0.0, chopper: 10.0 };

pub(crate) fn machine(motor: Motor) -> Machine {
    Machine { supply: STIFF, ..Machine::new(motor) }
}

/// A machine and the time.
#[derive(Clone)]
pub(crate) struct Bench {
    pub(crate) servo: Servo,
    pub(crate) ticks: u64,
}

impl Bench {
    pub(crate) fn new(machine: Machine) -> Self {
        Self { servo: Servo::new(machine, Sensing::TwoShunt(TwoShunt::default())), ticks: 0 }
    }

    /// A motor on so much inertia that its speed in rad/s does not change.
    pub(crate) fn on_dyno(motor: Motor, supply: Supply, speed: f64) -> Self {
        let mut machine = Machine { supply, ..Machine::new(motor) };
        machine.load.inertia = 1000.0;
        let mut bench = Self::new(machine);
        bench.influence(Influence::Torque(1000.0 * speed / 0.01));
        bench.run(200, |_| Power::default());
        bench.influence(Influence::Torque(0.0));
        bench
    }

    pub(crate) fn now(&self) -> Instant {
        Instant::from_ticks(self.ticks)
    }

    pub(crate) fn view(&self) -> View {
        self.servo.view(self.now())
    }

    pub(crate) fn influence(&mut self, influence: Influence) {
        self.servo.influence(influence, self.now());
    }

    /// Runs for so many control periods, each with the power that follows from the view at its beginning.
    pub(crate) fn run(&mut self, periods: u64, mut power: impl FnMut(&View) -> Power) {
        for _ in 0..periods {
            let power = power(&self.view());
            self.servo.drive(&power, self.now());
            self.ticks += PERIOD_TICKS;
        }
        self.servo.come_to(self.now());
    }
}

/// Legs with these parts of the bus voltage.
pub(crate) fn legs(parts: [Option<f64>; 3]) -> Power {
    let leg = |part: Option<f64>| match part {
        Some(part) => Leg::Duty((part * 65535.0).round() as u16),
        None => Leg::Open,
    };
    Power { legs: parts.map(leg), ..Power::default() }
}

/// A voltage vector in the frame of the rotor, as it stands in the middle of the coming period.
pub(crate) fn vector(view: &View, pole_pairs: f64, direct: f64, across: f64) -> Power {
    let turning = view.speed / 60.0 * pole_pairs * PERIOD / 2.0;
    let angle = TAU * (view.electrical_angle + turning);
    let phase = |number: f64| {
        let angle = angle - number * TAU / 3.0;
        Some(0.5 + (direct * angle.cos() - across * angle.sin()) / view.bus)
    };
    legs([phase(0.0), phase(1.0), phase(2.0)])
}

/// What a current regulator with good knowledge of the motor gives for a torque current in ampere.
pub(crate) fn regulated(view: &View, motor: &Brushless, current: f64) -> Power {
    let pole_pairs = f64::from(motor.pole_pairs);
    let speed = view.speed / 60.0 * TAU * pole_pairs;
    let gain = 2.0;
    let direct = -speed * motor.inductance * view.torque_current - gain * view.direct_current;
    let across = motor.resistance * current
        + speed * motor.flux_linkage
        + gain * (current - view.torque_current);
    let limit = view.bus / 3f64.sqrt() * 0.98;
    let shrink = (limit / direct.hypot(across)).min(1.0);
    vector(view, pole_pairs, direct * shrink, across * shrink)
}

#[track_caller]
pub(crate) fn near(value: f64, expected: f64, part: f64) {
    assert!((value - expected).abs() <= expected.abs() * part, "{value}, not {expected}");
}
