//! Looking at a chip changes nothing, however often and whenever: two chips get the same writes and
//! levels, and only one of them is read in between.

use opentmcl_motion::Instant;
use opentmcl_motion::ticked::braking_factor;
use opentmcl_plant::tmc429::{AXES, Tmc429, registers::*};
use proptest::prelude::*;

#[derive(Clone, Copy, Debug)]
enum Action {
    Write(u8, u32),
    Common(u8, u32),
    Inputs(usize, bool, bool),
}

/// Registers with values that make things happen.
fn write() -> impl Strategy<Value = Action> {
    let value = |index: u8, values: &[u32]| {
        (0..3u8, proptest::sample::select(values.to_vec()))
            .prop_map(move |(axis, value)| Action::Write(of_axis(axis, index), value))
    };
    let position = |index: u8| {
        (0..3u8, any::<i16>()).prop_map(move |(axis, position)| {
            Action::Write(of_axis(axis, index), i32::from(position).cast_unsigned())
        })
    };
    prop_oneof![
        4 => position(X_TARGET),
        1 => position(X_ACTUAL),
        1 => value(V_MIN, &[0, 1, 40]),
        2 => value(V_MAX, &[0, 30, 1000, 2047]),
        2 => value(V_TARGET, &[0, 5, 1000, 0xFFF, 0xA00]),
        1 => value(V_ACTUAL, &[0, 700, 0x900]),
        2 => value(A_MAX, &[0, 7, 500, 2047]),
        1 => value(PMUL_PDIV, &[0, 247 << 8 | 7, 200 << 8 | 4, 0xFF0F]),
        4 => (0..3u8, 0u32..16, 0u32..4).prop_map(|(axis, switches, mode)| {
            Action::Write(of_axis(axis, REF_CONF_RAMP_MODE), switches << 8 | mode)
        }),
        1 => value(INTERRUPT, &[0xFF00, 0xFF, 0x0109]),
        1 => value(DIVISORS, &[0x3706, 0x2306, 0x5504, 0x0A00, 0xD002]),
        1 => value(X_LATCHED, &[0]),
        1 => value(USTEP_COUNT, &[0, 77]),
    ]
}

fn action() -> impl Strategy<Value = Action> {
    prop_oneof![
        8 => write(),
        1 => (0u32..512).prop_map(|value| Action::Common(IF_CONFIGURATION, value)),
        1 => (0u32..4).prop_map(|value| Action::Common(GLOBAL_PARAMETERS, value << 20)),
        2 => (0..AXES, any::<(bool, bool)>())
            .prop_map(|(axis, (left, right))| Action::Inputs(axis, left, right)),
    ]
}

fn act(chip: &mut Tmc429, action: Action, now: Instant) {
    match action {
        Action::Write(address, value) | Action::Common(address, value) => {
            chip.write(address, value, now);
        }
        Action::Inputs(axis, left, right) => chip.set_reference_inputs(axis, left, right, now),
    }
}

/// All registers, and what the plant asks for.
fn everything(chip: &mut Tmc429, now: Instant) -> (Vec<u32>, Vec<String>) {
    let registers = (0..128).map(|address| chip.read(address, now)).collect();
    let axes = (0..AXES).map(|axis| {
        let (travel, motion) = (chip.travel(axis, now), chip.motion(axis, now));
        format!("{travel} {motion:?} {:?}", chip.stopped_at(axis, now))
    });
    (registers, axes.collect())
}

/// A chip whose axes move.
fn moving() -> Tmc429 {
    let mut chip = Tmc429::new();
    let now = Instant::from_ticks(0);
    let factor = braking_factor(500, 7, 3).unwrap();
    for axis in 0..3 {
        for (index, value) in [
            (DIVISORS, 0x3706),
            (V_MIN, 1),
            (V_MAX, 1000),
            (A_MAX, 500),
            (PMUL_PDIV, u32::from(factor.pmul) << 8 | u32::from(factor.pdiv)),
            (X_TARGET, 10_000 * (u32::from(axis) + 1)),
        ] {
            chip.write(of_axis(axis, index), value, now);
        }
    }
    chip
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(100))]

    #[test]
    fn looking_in_between_changes_nothing(
        steps in proptest::collection::vec((0u64..9_000_000, action()), 1..40),
        looks in proptest::collection::vec(0u64..9_000_000, 1..5),
    ) {
        let mut alone = moving();
        let mut watched = alone.clone();
        let mut time = 0;
        for (wait, action) in steps {
            let mut times: Vec<u64> = looks.iter().map(|look| look % (wait + 1)).collect();
            times.sort_unstable();
            for look in times {
                let now = Instant::from_ticks(time + look);
                everything(&mut watched, now);
                watched.next_event(now);
                watched.status(now);
            }
            time += wait;
            let now = Instant::from_ticks(time);
            act(&mut alone, action, now);
            act(&mut watched, action, now);
            prop_assert_eq!(everything(&mut alone.clone(), now), everything(&mut watched, now));
            prop_assert_eq!(alone.clone().status(now), watched.status(now));
        }
        let end = Instant::from_ticks(time + 50_000_000);
        prop_assert_eq!(everything(&mut alone, end), everything(&mut watched, end));
    }

    #[test]
    fn flags_of_the_motion_change_at_events_alone(
        steps in proptest::collection::vec((0u64..9_000_000, action()), 1..30),
    ) {
        let mut chip = moving();
        let mut time = 0;
        for (wait, action) in steps {
            time += wait;
            let now = Instant::from_ticks(time);
            act(&mut chip, action, now);
            let flags = |chip: &mut Tmc429, now| -> Vec<u32> {
                (0..3).map(|axis| chip.read(of_axis(axis, INTERRUPT), now)).collect()
            };
            let before = flags(&mut chip, now);
            let next = chip.next_event(now).map_or(time + 9_000_000, |next| next.as_ticks());
            prop_assert!(next > time);
            let mut later = chip.clone();
            for part in 0..=8 {
                let look = Instant::from_ticks(time + (next - 1 - time) / 8 * part);
                prop_assert_eq!(&flags(&mut later, look), &before);
            }
        }
    }
}
