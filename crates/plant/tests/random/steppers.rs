//! As `machines`, with a controller for three axes and a driver for each: nothing breaks, looking on changes
//! nothing, and an axis with its own controller is no other than one that shares it.
//!
//! `MACHINES=100000` runs so many; otherwise two hundred.

use opentmcl_motion::{Duration, Instant};
use opentmcl_plant::axis::{Coil, CoilFault, Influence, Rotor, SwitchInput, View};
use opentmcl_plant::machine::Machine;
use opentmcl_plant::steppers::{DRIVER, Steppers};
use opentmcl_plant::tmc26x::registers::{CS, MRES, Register, SEDN, SEMAX, SEMIN, SEUP, SGT, TOFF};
use opentmcl_plant::tmc429::registers::*;

use crate::described::{Random, WAY, check, check_energy, machine, machines};

const FULL_SCALE: f64 = 2.8;

/// What happens at a time: to which axis, and what.
#[derive(Clone, Debug)]
enum Happening {
    Write(u8, u32),
    Influence(Influence),
    Switch(SwitchInput, Option<bool>),
}

/// Something that happens to an axis from outside.
fn happenings(torque: &mut f64, random: &mut Random) -> Vec<Happening> {
    use Happening::{Switch, Write};
    let small = random.next() as u32 >> random.below(32);
    let toff = |toff| Write(DRIVER, Register::ChopConf.datagram(&[(TOFF, toff)]));
    let influence = match random.below(24) {
        0 => Influence::Supply(random.between(0.0, 50.0)),
        1 => {
            *torque = random.between(-0.5, 0.5);
            Influence::Torque(*torque)
        }
        2 => Influence::Blocked(random.one_in(2)),
        3 => Influence::Position(random.between(-2.0 * WAY, 2.0 * WAY)),
        4 => Influence::Coil(Coil::B, random.one_in(3).then_some(CoilFault::Open)),
        5 => Influence::DriverTemperature(random.between(0.0, 200.0)),
        6 => return vec![Switch(SwitchInput::Left, random.one_in(2).then_some(true))],
        7 => return vec![toff(random.below(3) as u32)],
        8 => {
            let cool = [(SEMIN, 1 + small % 15), (SEUP, 3), (SEMAX, small >> 4), (SEDN, 3)];
            return vec![Write(DRIVER, Register::SmartEn.datagram(&cool))];
        }
        9..=14 => {
            // Something that moves.
            let current = Register::SgcsConf.datagram(&[(CS, 31), (SGT, small)]);
            let divisors = (random.below(8) << 12 | random.below(8) << 8) as u32;
            let way = random.between(-2_000.0, 2_000.0) as i32;
            let mode = random.below(4) as u32;
            return vec![
                Write(DRIVER, Register::DrvCtrl.datagram(&[(MRES, random.below(9) as u32)])),
                toff(5),
                Write(DRIVER, current),
                Write(DIVISORS, divisors),
                Write(V_MIN, 1 + random.below(100) as u32),
                Write(V_MAX, random.below(2048) as u32),
                Write(A_MAX, random.below(2048) as u32),
                Write(PMUL_PDIV, (small & 0xFF) << 8 | small >> 8 & 7),
                Write(REF_CONF_RAMP_MODE, if random.one_in(2) { 0 } else { mode }),
                Write(X_TARGET, way.cast_unsigned()),
                Write(V_TARGET, small),
            ];
        }
        _ => return vec![Write(random.below(16) as u8, small)],
    };
    vec![Happening::Influence(influence)]
}

fn happen(steppers: &mut Steppers, axis: u8, happening: &Happening, now: Instant) {
    match *happening {
        Happening::Write(address, value) => steppers.write(axis, address, value, now),
        Happening::Influence(influence) => steppers.influence(axis, influence, now),
        Happening::Switch(switch, held) => steppers.hold_switch(axis, switch, held, now),
    }
}

/// What can be seen of an axis.
fn all(steppers: &mut Steppers, axis: u8, now: Instant) -> (Option<View>, Vec<u32>) {
    let registers = [X_ACTUAL, V_ACTUAL, INTERRUPT, REFERENCE_SWITCHES, DRIVER];
    let values = registers.map(|address| steppers.read(axis, address, now)).to_vec();
    (steppers.view(axis, now), values)
}

fn look(steppers: &mut Steppers, looker: &mut Random, from: Instant, clocks: u64, looks: u64) {
    let mut times: Vec<u64> = (0..looks).map(|_| looker.below(clocks + 1)).collect();
    times.sort_unstable();
    for time in times {
        let at = from + Duration::from_ticks(time);
        let axis = looker.below(steppers.len().into()) as u8;
        all(steppers, axis, at);
        steppers.next_event(axis, at);
        steppers.home_switch(axis, at);
    }
}

/// Runs three machines at one controller; looks at them now and then, or at each of a number of further times.
fn run(seed: u64, looks: u64) -> Vec<(Option<View>, Vec<u32>)> {
    let mut random = Random(seed);
    let described: Vec<Machine> = (0..3).map(|_| machine(&mut random)).collect();
    let mut steppers = Steppers::with_machines(described.iter().cloned().map(Some), FULL_SCALE);
    let mut now = Instant::from_ticks(0);
    let mut torques = [0.0; 3];
    let mut looker = Random(!seed);
    for step in 0..40 {
        let axis = random.below(3) as u8;
        let number = usize::from(axis);
        if random.one_in(100) {
            steppers.reset(now);
        } else if random.one_in(30) {
            let common = [IF_CONFIGURATION, GLOBAL_PARAMETERS][random.below(2) as usize];
            steppers.write(axis, common, random.next() as u32, now);
        }
        for happening in happenings(&mut torques[number], &mut random) {
            happen(&mut steppers, axis, &happening, now);
        }
        // A step of a free rotor begins here for this axis: within one, brakes count with the speed at its end.
        steppers.influence(axis, Influence::Torque(torques[number]), now);
        let before = steppers.view(axis, now).unwrap();
        let longest = 1 << (10 + random.below(14));
        let clocks = random.below(longest);
        look(&mut steppers, &mut looker, now, clocks, looks);
        now += Duration::from_ticks(clocks);
        for (axis, described) in (0..).zip(&described) {
            let told = format!("machines {seed}, axis {axis}, step {step}");
            check(&steppers.view(axis, now).unwrap(), described, &told);
        }
        let after = steppers.view(axis, now).unwrap();
        if (before.state, after.state) == (Rotor::Free, Rotor::Free)
            && described[number].load.along.is_empty()
        {
            let told = format!("machines {seed}, axis {axis}, step {step}");
            check_energy(&described[number], torques[number], &before, &after, &told);
        }
    }
    (0..3).map(|axis| all(&mut steppers, axis, now)).collect()
}

#[test]
fn no_machine_breaks_and_looking_on_changes_nothing() {
    for seed in 0..machines(200) {
        assert_eq!(run(seed, 0), run(seed, 5), "machines {seed}");
    }
}

/// What happens to one axis, and when.
fn story(random: &mut Random) -> (Machine, Vec<(u64, Happening)>) {
    let (machine, mut now, mut torque) = (machine(random), 0, 0.0);
    let mut story = Vec::new();
    for _ in 0..20 {
        now += random.below(1 << 22);
        story.extend(happenings(&mut torque, random).into_iter().map(|what| (now, what)));
    }
    (machine, story)
}

#[test]
fn neighbours_at_a_controller_do_not_touch_each_other() {
    let end = Instant::from_ticks(20 << 22);
    for seed in 0..machines(40) {
        let mut random = Random(seed);
        let stories: Vec<_> = (0..3).map(|_| story(&mut random)).collect();
        let machines = |wanted: Option<usize>| {
            let machine = move |(axis, (machine, _)): (usize, &(Machine, _))| {
                wanted.is_none_or(|wanted| wanted == axis).then(|| machine.clone())
            };
            Steppers::with_machines(stories.iter().enumerate().map(machine), FULL_SCALE)
        };
        let mut together = machines(None);
        let mut times: Vec<_> = (0..3u8)
            .flat_map(|axis| {
                stories[usize::from(axis)].1.iter().map(move |(time, what)| (*time, axis, what))
            })
            .collect();
        times.sort_by_key(|(time, ..)| *time);
        for (time, axis, what) in times {
            happen(&mut together, axis, what, Instant::from_ticks(time));
        }
        for axis in 0..3 {
            let mut alone = machines(Some(usize::from(axis)));
            for (time, what) in &stories[usize::from(axis)].1 {
                happen(&mut alone, axis, what, Instant::from_ticks(*time));
            }
            let (mut seen, mut expected) =
                (all(&mut together, axis, end), all(&mut alone, axis, end));
            // The register with the switches of all three.
            (seen.1[3], expected.1[3]) = (0, 0);
            assert_eq!(seen, expected, "machines {seed}, axis {axis}");
        }
    }
}
