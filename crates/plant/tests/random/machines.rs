//! Any machine, driven by any writes: nothing panics, nothing becomes a NaN, nobody leaves the way or gains
//! energy from nowhere, and looking on changes nothing.
//!
//! `MACHINES=100000` runs so many; otherwise two thousand.

use opentmcl_motion::{Duration, Instant};
use opentmcl_plant::axis::{Axis, Coil, CoilFault, Rotor, SwitchInput, View};
use opentmcl_plant::tmc5160::registers::*;

use crate::described::{Random, WAY, check, check_energy, machine, machines};

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

#[test]
fn no_machine_breaks_and_looking_on_changes_nothing() {
    for seed in 0..machines(2_000) {
        assert_eq!(run(seed, 0), run(seed, 3), "machine {seed}");
    }
}
