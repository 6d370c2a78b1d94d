//! Looking at a chip changes nothing, however often and whenever: two chips get the same writes and
//! signals, and only one of them is read in between.

use opentmcl_motion::Instant;
use opentmcl_plant::tmc5160::{Sense, Tmc5160, registers::*};
use proptest::prelude::*;

#[derive(Clone, Copy, Debug)]
enum Action {
    Write(u8, u32),
    Inputs(bool, bool),
    Encoder(i64),
    Index(bool, bool),
    Sense(u16, u32),
    Reading(u16),
    Stall,
    Limit(Option<u32>),
    Enabled(bool),
}

/// Registers with values that make things happen.
fn write() -> impl Strategy<Value = Action> {
    let value = |address: u8, values: &[u32]| {
        proptest::sample::select(values.to_vec())
            .prop_map(move |value| Action::Write(address, value))
    };
    prop_oneof![
        value(RAMPMODE, &[0, 1, 2, 3]),
        any::<i16>().prop_map(|target| Action::Write(XTARGET, i32::from(target).cast_unsigned())),
        any::<i16>().prop_map(|actual| Action::Write(XACTUAL, i32::from(actual).cast_unsigned())),
        value(VMAX, &[0, 3_000, 20_000, 90_000]),
        value(AMAX, &[300, 2_000, 30_000]),
        value(TZEROWAIT, &[0, 500, 5_000]),
        value(TPWMTHRS, &[0, 500, 5_000]),
        value(TCOOLTHRS, &[0, 700, 9_000, 0xF_FFFF]),
        value(THIGH, &[0, 190, 800]),
        value(GCONF, &[0, 4, 16, 20, 1 << 14 | 4]),
        value(CHOPCONF, &[0x1041_0153, 0x120D_0153, 0x1841_0153, 0]),
        value(COOLCONF, &[0, 0x6005, 0xE167, 0x100_2142]),
        (0u32..1 << 12).prop_map(|mode| Action::Write(SW_MODE, mode)),
        (0u32..1 << 11).prop_map(|mode| Action::Write(ENCMODE, mode)),
        any::<u32>().prop_map(|constant| Action::Write(ENC_CONST, constant)),
        value(VDCMIN, &[0, 1_000, 30_000]),
        value(IHOLD_IRUN, &[0x1F00, 0x2_1004, 0x1_0810]),
        value(RAMP_STAT, &[0, 1 << 6, u32::MAX]),
        value(PWMCONF, &[30, 1 << 20, 1 << 21 | 7 << 8]),
    ]
}

fn action() -> impl Strategy<Value = Action> {
    prop_oneof![
        5 => write(),
        1 => any::<(bool, bool)>().prop_map(|(left, right)| Action::Inputs(left, right)),
        1 => any::<i32>().prop_map(|count| Action::Encoder(i64::from(count))),
        1 => any::<(bool, bool)>().prop_map(|(a, b)| Action::Index(a, b)),
        1 => (0u16..1024, any::<u32>()).prop_map(|(raw, flags)| Action::Sense(raw, flags)),
        4 => (0u16..1024).prop_map(Action::Reading),
        1 => Just(Action::Stall),
        1 => proptest::option::of(0u32..100_000).prop_map(Action::Limit),
        1 => any::<bool>().prop_map(Action::Enabled),
    ]
}

fn act(chip: &mut Tmc5160, action: Action, now: Instant) {
    match action {
        Action::Write(address, value) => chip.write(address, value, now),
        Action::Inputs(left, right) => chip.set_reference_inputs(left, right, now),
        Action::Encoder(count) => chip.set_encoder_count(count, now),
        Action::Index(a, b) => chip.encoder_index(a, b, now),
        Action::Sense(stallguard, flags) => {
            chip.set_sense(Sense { stallguard, flags, ..Sense::IDEAL }, now);
        }
        Action::Reading(result) => chip.cool_reading(result, now),
        Action::Stall => chip.stall(now),
        Action::Limit(limit) => chip.set_speed_limit(limit, now),
        Action::Enabled(enabled) => chip.set_enabled(enabled, now),
    }
}

fn registers(chip: &mut Tmc5160, now: Instant) -> Vec<u32> {
    (0..128).map(|address| chip.read(address, now)).collect()
}

/// An axis that is on its way into the range of CoolStep.
fn cooling() -> Tmc5160 {
    let mut chip = Tmc5160::new();
    for (address, value) in [
        (CHOPCONF, 0x1041_0153),
        (COOLCONF, 0xE167),
        (IHOLD_IRUN, 0x1F00),
        (TCOOLTHRS, 9_000),
        (AMAX, 2_000),
        (VMAX, 20_000),
        (RAMPMODE, 1),
    ] {
        chip.write(address, value, Instant::from_ticks(0));
    }
    chip
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(200))]

    #[test]
    fn looking_in_between_changes_nothing(
        steps in proptest::collection::vec((0u64..9_000_000, action()), 1..40),
        looks in proptest::collection::vec(0u64..9_000_000, 1..5),
    ) {
        let mut alone = cooling();
        let mut watched = alone.clone();
        let mut time = 0;
        for (wait, action) in steps {
            let mut times: Vec<u64> = looks.iter().map(|look| look % (wait + 1)).collect();
            times.sort_unstable();
            for look in times {
                let now = Instant::from_ticks(time + look);
                registers(&mut watched, now);
            }
            time += wait;
            let now = Instant::from_ticks(time);
            act(&mut alone, action, now);
            act(&mut watched, action, now);
            prop_assert_eq!(registers(&mut alone.clone(), now), registers(&mut watched, now));
            prop_assert_eq!(alone.coils(now), watched.coils(now));
            prop_assert_eq!(alone.next_event(now), watched.next_event(now));
            prop_assert_eq!(alone.next_threshold(now), watched.next_threshold(now));
            prop_assert_eq!(alone.next_coil_change(now), watched.next_coil_change(now));
        }
        let end = Instant::from_ticks(time + 50_000_000);
        prop_assert_eq!(registers(&mut alone, end), registers(&mut watched, end));
    }

    #[test]
    fn the_field_never_jumps_at_a_write(
        steps in proptest::collection::vec((0u64..9_000_000, write()), 1..40),
    ) {
        let mut chip = Tmc5160::new();
        let mut time = 0;
        for (wait, action) in steps {
            time += wait;
            let now = Instant::from_ticks(time);
            let before = chip.field(now).position_at(now);
            act(&mut chip, action, now);
            let after = chip.field(now).position_at(now);
            prop_assert!((before - after).abs() < 1e-3, "{:?}: {} {}", action, before, after);
        }
    }

    #[test]
    fn a_threshold_is_crossed_when_it_is_foreseen_and_not_before(
        steps in proptest::collection::vec((0u64..9_000_000, write()), 1..40),
    ) {
        // Bits of DRV_STATUS that follow from thresholds: StealthChop and full steps.
        const FLAGS: u32 = 0b11 << 14;
        let mut chip = Tmc5160::new();
        let mut time = 0;
        for (wait, action) in steps {
            time += wait;
            let now = Instant::from_ticks(time);
            act(&mut chip, action, now);
            let end = chip.field(now).until.map_or(time + 9_000_000, |until| until.as_ticks() - 1);
            let end = chip.next_threshold(now).map_or(end, |next| next.as_ticks() - 1);
            let flags = chip.read(DRV_STATUS, now) & FLAGS;
            let mut later = chip.clone();
            for part in 0..=8 {
                let look = Instant::from_ticks(time + (end.saturating_sub(time)) / 8 * part);
                prop_assert_eq!(later.read(DRV_STATUS, look) & FLAGS, flags);
            }
        }
    }
}
