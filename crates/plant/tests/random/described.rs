//! Machines that look random, and what holds of each.

use std::f64::consts::TAU;

use opentmcl_plant::axis::View;
use opentmcl_plant::machine::motor::PRESETS;
use opentmcl_plant::machine::{Encoder, Load, Machine, Spring, Stage, Switch, Switches};

/// Numbers that look random and are the same each time (splitmix64, Steele et al. 2014).
#[derive(Clone)]
pub(crate) struct Random(pub(crate) u64);

impl Random {
    pub(crate) fn next(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9E37_79B9_7F4A_7C15);
        let mut z = self.0;
        z = (z ^ z >> 30).wrapping_mul(0xBF58_476D_1CE4_E5B9);
        z = (z ^ z >> 27).wrapping_mul(0x94D0_49BB_1331_11EB);
        z ^ z >> 31
    }

    pub(crate) fn below(&mut self, end: u64) -> u64 {
        self.next() % end
    }

    pub(crate) fn one_in(&mut self, count: u64) -> bool {
        self.below(count) == 0
    }

    pub(crate) fn part(&mut self) -> f64 {
        (self.next() >> 11) as f64 / (1u64 << 53) as f64
    }

    pub(crate) fn between(&mut self, from: f64, to: f64) -> f64 {
        from + self.part() * (to - from)
    }

    /// From one power of ten to another.
    pub(crate) fn decades(&mut self, from: f64, to: f64) -> f64 {
        10f64.powf(self.between(from, to))
    }
}

/// In a fine step of a motor with 200 full steps.
pub(crate) const RADIANS: f64 = TAU / 51_200.0;

pub(crate) const WAY: f64 = 400_000.0;

pub(crate) fn machine(random: &mut Random) -> Machine {
    let motor = PRESETS[random.below(PRESETS.len() as u64) as usize].motor;
    let torque = |random: &mut Random| {
        if random.one_in(3) { random.between(-1.0, 1.0) * motor.holding_torque } else { 0.0 }
    };
    let load = Load {
        inertia: random.decades(-7.0, -2.0),
        friction: random.between(0.0, 0.3) * motor.holding_torque,
        viscous: random.decades(-7.0, -2.0),
        constant: torque(random),
        springs: (0..random.below(3))
            .map(|_| Spring { rate: random.decades(-9.0, 0.0), rest: random.between(-WAY, WAY) })
            .collect(),
        along: if random.one_in(3) {
            let mut points: Vec<_> =
                (0..4).map(|_| (random.between(-WAY, WAY), torque(random))).collect();
            points.sort_by(|a, b| a.0.total_cmp(&b.0));
            points
        } else {
            Vec::new()
        },
    };
    let switch = |random: &mut Random, width: f64| {
        let from = random.between(-WAY, WAY);
        Switch {
            from,
            to: from + width,
            hysteresis: random.between(0.0, 500.0),
            bounce: random.below(100_000),
            normally_closed: random.one_in(2),
        }
    };
    let switches = Switches {
        left: Some(Switch { from: f64::NEG_INFINITY, ..switch(random, 1_000.0) }),
        right: Some(Switch { to: f64::INFINITY, ..switch(random, 1_000.0) }),
        home: Some(switch(random, 3_000.0)),
    };
    let stage = Stage {
        lowest: Some(-WAY),
        highest: Some(WAY),
        circle: None,
        backlash: random.between(0.0, 300.0),
        start: random.between(-WAY, WAY),
    };
    let encoder = Encoder {
        counts: random.between(100.0, 100_000.0),
        index: random.between(0.0, 51_200.0),
        reversed: random.one_in(2),
        on_stage: random.one_in(2),
    };
    Machine { motor, load, stage, switches, encoder: Some(encoder) }
}

/// Fine steps per second that no rotor of this machine can exceed: the fastest field, or all the work
/// that the load can do along the way.
pub(crate) fn fastest(machine: &Machine) -> f64 {
    let inertia = machine.load.inertia + machine.motor.inertia;
    let torque = machine.load.largest_between(-WAY, WAY) + 0.5;
    let by_work = (2.0 * torque * 2.0 * WAY * RADIANS / inertia).sqrt() / RADIANS;
    // With full steps a register unit is 256 fine steps; a field that jumps from VSTART is as fast.
    let by_field = f64::from((1 << 23) - 1) * 256.0;
    by_field + by_work
}

pub(crate) fn check(view: &View, machine: &Machine, told: &str) {
    let View { rotor, stage, speed, load_angle, load, current, .. } = *view;
    for value in [rotor, stage, speed, load_angle, load, current] {
        assert!(value.is_finite(), "{told}: {view:?}");
    }
    let play = machine.stage.backlash / 2.0;
    assert!(rotor.abs() <= WAY + play && stage.abs() <= WAY + play, "{told}: {view:?}");
    assert!((rotor - stage).abs() <= play * 1.000_001 + 1e-6, "{told}: {view:?}");
    assert!((0.0..=1.0).contains(&load) && (0.0..=90.0).contains(&load_angle), "{told}: {view:?}");
    assert!((0.0..=2.8).contains(&current), "{told}: {view:?}");
    assert!(speed.abs() <= fastest(machine), "{told}: {view:?}");
}

/// Work in joule that a load does on the way between two positions: it is the same on every way there.
pub(crate) fn work(machine: &Machine, torque: f64, from: f64, to: f64) -> f64 {
    let mut places = vec![from, to];
    places.extend(machine.load.along.iter().map(|point| point.0));
    places.retain(|place| (from.min(to)..=from.max(to)).contains(place));
    places.sort_by(|a, b| if from < to { a.total_cmp(b) } else { b.total_cmp(a) });
    // Between the points of the profile torques are linear.
    let pieces = places.windows(2).map(|ends| {
        let middle = ends[0].midpoint(ends[1]);
        (machine.load.torque_at(middle) + torque) * (ends[1] - ends[0])
    });
    pieces.sum::<f64>() * RADIANS
}

/// A rotor that nothing drives gets its energy from the load alone. A tenth is for strong brakes, which
/// within a step of half a millisecond count with the speed at its end. A profile of torques is not
/// followed within a step, so it is left out.
pub(crate) fn check_energy(
    machine: &Machine,
    torque: f64,
    before: &View,
    after: &View,
    told: &str,
) {
    let inertia = machine.load.inertia + machine.motor.inertia;
    let energy = |view: &View| inertia * (view.speed * RADIANS).powi(2) / 2.0;
    let work = work(machine, torque, before.rotor, after.rotor);
    let (had, has) = (energy(before) + work, energy(after));
    let most = energy(before).max(has).max(work.abs());
    assert!(
        has <= had + 0.1 * most + 1e-12,
        "{told}: {had} J became {has} J, {before:?} {after:?}"
    );
}

/// How many to try.
pub(crate) fn machines(otherwise: u64) -> u64 {
    std::env::var("MACHINES").ok().and_then(|count| count.parse().ok()).unwrap_or(otherwise)
}
