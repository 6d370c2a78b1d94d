//! Any machine, driven by any writes: nothing panics, nothing becomes a NaN, nobody leaves the way or gains
//! energy from nowhere, and looking on changes nothing.
//!
//! `MACHINES=100000` runs so many; otherwise two thousand.

use std::f64::consts::TAU;

use opentmcl_motion::{Duration, Instant};
use opentmcl_plant::axis::{Axis, Coil, CoilFault, Rotor, SwitchInput, View};
use opentmcl_plant::machine::motor::PRESETS;
use opentmcl_plant::machine::{Encoder, Load, Machine, Spring, Stage, Switch, Switches};
use opentmcl_plant::tmc5160::registers::*;

/// Numbers that look random and are the same each time (splitmix64, Steele et al. 2014).
#[derive(Clone)]
struct Random(u64);

impl Random {
    fn next(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9E37_79B9_7F4A_7C15);
        let mut z = self.0;
        z = (z ^ z >> 30).wrapping_mul(0xBF58_476D_1CE4_E5B9);
        z = (z ^ z >> 27).wrapping_mul(0x94D0_49BB_1331_11EB);
        z ^ z >> 31
    }

    fn below(&mut self, end: u64) -> u64 {
        self.next() % end
    }

    fn one_in(&mut self, count: u64) -> bool {
        self.below(count) == 0
    }

    fn part(&mut self) -> f64 {
        (self.next() >> 11) as f64 / (1u64 << 53) as f64
    }

    fn between(&mut self, from: f64, to: f64) -> f64 {
        from + self.part() * (to - from)
    }

    /// From one power of ten to another.
    fn decades(&mut self, from: f64, to: f64) -> f64 {
        10f64.powf(self.between(from, to))
    }
}

/// In a fine step of a motor with 200 full steps.
const RADIANS: f64 = TAU / 51_200.0;

const WAY: f64 = 400_000.0;

fn machine(random: &mut Random) -> Machine {
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

/// Something that happens to an axis from outside.
fn happen(axis: &mut Axis, torque: &mut f64, random: &mut Random, now: Instant) {
    const ADDRESSES: [u8; 34] = [
        GCONF, IHOLD_IRUN, TPOWERDOWN, TPWMTHRS, 0x14, THIGH, RAMPMODE, RAMPMODE, RAMPMODE,
        XACTUAL, VSTART, A1, V1, AMAX, AMAX, VMAX, VMAX, VMAX, DMAX, D1, VSTOP, TZEROWAIT, XTARGET,
        XTARGET, VDCMIN, SW_MODE, RAMP_STAT, 0x38, X_ENC, 0x3A, 0x3D, CHOPCONF, 0x6D, 0x70,
    ];
    let bits = random.below(32);
    let small = random.next() as u32 >> bits;
    match random.below(20) {
        0 => axis.set_supply(random.between(0.0, 50.0), now),
        1 => {
            *torque = random.between(-0.5, 0.5);
            axis.set_external_torque(*torque, now);
        }
        2 => axis.set_blocked(random.one_in(2), now),
        3 => axis.set_position(random.between(-2.0 * WAY, 2.0 * WAY), now),
        4 => axis.set_coil(Coil::B, random.one_in(3).then_some(CoilFault::Open), now),
        5 => axis.set_driver_temperature(random.between(0.0, 200.0), now),
        6 => axis.hold_switch(SwitchInput::Left, random.one_in(2).then_some(true), now),
        7 => axis.set_torque_allowed(!random.one_in(3), now),
        8 if random.one_in(10) => axis.reset(now),
        9..=12 => {
            // Something that moves.
            axis.write(CHOPCONF, 0x0041_0153, now);
            axis.write(AMAX, 1 + small % 65_535, now);
            axis.write(VMAX, random.below(2_000_000) as u32, now);
        }
        _ => {
            let address = ADDRESSES[random.below(ADDRESSES.len() as u64) as usize];
            axis.write(address, small, now);
        }
    }
}

/// Fine steps per second that no rotor of this machine can exceed: the fastest field, or all the work
/// that the load can do along the way.
fn fastest(machine: &Machine) -> f64 {
    let inertia = machine.load.inertia + machine.motor.inertia;
    let torque = machine.load.largest_between(-WAY, WAY) + 0.5;
    let by_work = (2.0 * torque * 2.0 * WAY * RADIANS / inertia).sqrt() / RADIANS;
    // With full steps a register unit is 256 fine steps; a field that jumps from VSTART is as fast.
    let by_field = f64::from((1 << 23) - 1) * 256.0;
    by_field + by_work
}

fn check(view: &View, machine: &Machine, told: &str) {
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
fn work(machine: &Machine, torque: f64, from: f64, to: f64) -> f64 {
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
fn check_energy(machine: &Machine, torque: f64, before: &View, after: &View, told: &str) {
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

/// Runs one machine; looks at it now and then, or at each of a number of further times as well.
fn run(seed: u64, looks: u64) -> (View, Vec<u32>) {
    let mut random = Random(seed);
    let machine = machine(&mut random);
    let mut axis = Axis::with_machine(machine.clone(), 2.8);
    let mut now = Instant::from_ticks(0);
    let mut torque = 0.0;
    let mut look = Random(!seed);
    for step in 0..30 {
        happen(&mut axis, &mut torque, &mut random, now);
        let before = axis.view(now);
        let longest = 1 << (10 + random.below(14));
        let clocks = random.below(longest);
        let mut times: Vec<u64> = (0..looks).map(|_| look.below(clocks + 1)).collect();
        times.sort_unstable();
        for time in times {
            let at = now + Duration::from_ticks(time);
            axis.view(at);
            axis.read(DRV_STATUS, at);
            axis.read(X_ENC, at);
            axis.next_event(at);
        }
        now += Duration::from_ticks(clocks);
        let told = format!("machine {seed}, step {step}");
        let after = axis.view(now);
        check(&after, &machine, &told);
        if (before.state, after.state) == (Rotor::Free, Rotor::Free)
            && machine.load.along.is_empty()
        {
            check_energy(&machine, torque, &before, &after, &told);
        }
    }
    let registers = [XACTUAL, VACTUAL, RAMP_STAT, X_ENC, DRV_STATUS, 0x36, 0x3B, 0x3C];
    let registers = registers.map(|address| axis.read(address, now)).to_vec();
    (axis.view(now), registers)
}

fn machines() -> u64 {
    std::env::var("MACHINES").ok().and_then(|count| count.parse().ok()).unwrap_or(2_000)
}

#[test]
fn no_machine_breaks_and_looking_on_changes_nothing() {
    for seed in 0..machines() {
        assert_eq!(run(seed, 0), run(seed, 3), "machine {seed}");
    }
}
