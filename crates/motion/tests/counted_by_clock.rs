//! The closed form against counters that know nothing of it: clock by clock, and by summing speeds.

use opentmcl_motion::ramp::{Barred, Limits, Mode, Ramp};
use opentmcl_motion::{Duration, Instant};
use proptest::prelude::*;

fn at(ticks: u64) -> Instant {
    Instant::from_ticks(ticks)
}

const UNIT: i64 = 1 << 17;
const MICROSTEP: i128 = 1 << 42;

/// One axis that is stepped every clock.
struct Counter {
    limits: Limits,
    velocity: i64,
    position: i128,
}

impl Counter {
    fn at_rest(limits: Limits) -> Self {
        Self { limits, velocity: 0, position: 0 }
    }

    /// Speed after one clock on the way to `goal`; the last, incomplete step is a jump.
    fn toward(speed: i64, goal: i64, acceleration: u32) -> i64 {
        let step = i64::from(acceleration);
        if (goal - speed).abs() < step { goal } else { speed + step * (goal - speed).signum() }
    }

    fn microsteps(&self) -> i32 {
        ((self.position + MICROSTEP / 2) / MICROSTEP) as i32
    }

    fn clock(&mut self, velocity: i64) {
        self.position += i128::from(self.velocity + velocity);
        self.velocity = velocity;
    }

    /// Travel until VSTOP when braking begins now at this speed, counted clock by clock.
    fn braking(&self, mut speed: i64) -> i128 {
        let (v1, stop) = (i64::from(self.limits.v1) * UNIT, i64::from(self.limits.vstop) * UNIT);
        let mut travel = 0;
        while speed > stop {
            let next = if speed > v1 {
                Self::toward(speed, v1.max(stop), self.limits.dmax)
            } else {
                Self::toward(speed, stop, self.limits.d1)
            };
            travel += i128::from(speed + next);
            speed = next;
        }
        travel
    }

    /// Drives to the target as fast as braking allows, deciding every clock; returns the clocks.
    fn drive_to_target(&mut self) -> u64 {
        let (v1, max) = (i64::from(self.limits.v1) * UNIT, i64::from(self.limits.vmax) * UNIT);
        let stop = i64::from(self.limits.vstop) * UNIT;
        let mut clocks = 0;
        self.velocity = i64::from(self.limits.vstart) * UNIT;
        let mut braking = false;
        // What whole clocks leave over when braking has ended belongs to the jump to zero.
        while self.microsteps() != self.limits.target && !(braking && self.velocity <= stop) {
            let room = i128::from(self.limits.target) * MICROSTEP - MICROSTEP / 2 - self.position;
            let speed = self.velocity;
            let faster = if speed < v1 {
                Self::toward(speed, v1.min(max), self.limits.a1)
            } else {
                Self::toward(speed, max, self.limits.amax)
            };
            let next = if !braking && i128::from(speed + faster) + self.braking(faster) <= room {
                faster
            } else if !braking && i128::from(2 * speed) + self.braking(speed) <= room {
                speed
            } else {
                braking = true;
                if speed > v1 {
                    Self::toward(speed, v1.max(stop), self.limits.dmax)
                } else {
                    Self::toward(speed, stop.min(speed), self.limits.d1)
                }
            };
            self.clock(next);
            clocks += 1;
        }
        clocks
    }
}

#[test]
fn velocity_mode_agrees_with_a_counter_at_every_clock() {
    for (amax, vmax) in [(65_535, 600), (40_000, 8_000_000), (777, 3), (1, 1)] {
        let limits = Limits { mode: Mode::VelocityPositive, amax, vmax, ..Limits::default() };
        let mut ramp = Ramp::new();
        ramp.plan(at(0), &limits);
        let mut counter = Counter::at_rest(limits);
        for clock in 1..200_000 {
            let goal = i64::from(vmax) * UNIT;
            let next = Counter::toward(counter.velocity, goal, amax);
            // The ramp jumps onto VMAX as soon as less than one step is missing.
            if next == goal && counter.velocity < goal {
                counter.velocity = goal;
            }
            counter.clock(next);
            assert_eq!(ramp.position(at(clock)), counter.microsteps(), "clock {clock}");
        }
    }
}

#[test]
fn short_moves_take_the_time_of_a_counter_that_decides_every_clock() {
    let cases = [
        // target, vstart, a1, v1, amax, vmax, dmax, d1, vstop
        (1, 0, 65_535, 0, 65_535, 100_000, 65_535, 65_535, 10),
        (1, 100, 65_535, 1_000, 30_000, 100_000, 65_535, 20_000, 200),
        (2, 1, 20_000, 1_500, 65_535, 100_000, 40_000, 65_535, 10),
        (3, 500, 65_535, 2_000, 65_535, 2_500, 50_000, 65_535, 600),
        (3, 0, 65_535, 4_000, 65_535, 3_000, 50_000, 30_000, 100),
        (5, 10, 50_000, 100, 65_535, 100_000, 65_535, 65_535, 3_000),
        (8, 0, 65_535, 3_000, 10_000, 100_000, 65_535, 65_535, 10),
    ];
    for (target, vstart, a1, v1, amax, vmax, dmax, d1, vstop) in cases {
        let limits = Limits {
            mode: Mode::Position,
            target,
            vstart,
            a1,
            v1,
            amax,
            vmax,
            dmax,
            d1,
            vstop,
            zero_wait: Duration::from_ticks(0),
            barred: Barred::default(),
        };
        let mut ramp = Ramp::new();
        ramp.plan(at(0), &limits);
        let planned = ramp.arrival().unwrap().as_ticks();
        let counted = Counter::at_rest(limits).drive_to_target();
        // The peak in whole register units costs a few clocks.
        let tolerance = 8 + counted / 1_000;
        assert!(planned.abs_diff(counted) <= tolerance, "{planned}, counted {counted}: {limits:?}");
    }
}

fn any_limits() -> impl Strategy<Value = Limits> {
    let modes = prop_oneof![
        Just(Mode::Position),
        Just(Mode::VelocityPositive),
        Just(Mode::VelocityNegative),
        Just(Mode::Hold),
    ];
    // All magnitudes alike, with the values that the registers cannot hold.
    let register = || {
        (any::<u32>(), 0..=32u32).prop_map(|(value, shift)| value.checked_shr(shift).unwrap_or(0))
    };
    let registers = (register(), register(), register(), register(), register());
    let more = (register(), register(), register());
    (modes, any::<i32>(), registers, more, any::<u64>(), 0..64u32).prop_map(
        |(mode, target, (vstart, a1, v1, amax, vmax), (dmax, d1, vstop), wait, shift)| Limits {
            mode,
            target,
            vstart,
            a1,
            v1,
            amax,
            vmax,
            dmax,
            d1,
            vstop,
            zero_wait: Duration::from_ticks(wait >> shift),
            barred: Barred::default(),
        },
    )
}

fn ordinary_limits() -> impl Strategy<Value = Limits> {
    let accelerations = (20..65_536u32, 20..65_536u32, 20..65_536u32, 20..65_536u32);
    let speeds = (0..1_000u32, 0..100_000u32, 1_000..2_000_000u32, 1..1_000u32);
    (-3_000_000..3_000_000i32, accelerations, speeds).prop_map(
        |(target, (a1, amax, dmax, d1), (vstart, v1, vmax, vstop))| Limits {
            mode: Mode::Position,
            target,
            vstart,
            a1,
            v1,
            amax,
            vmax,
            dmax,
            d1,
            vstop,
            zero_wait: Duration::from_ticks(0),
            barred: Barred::default(),
        },
    )
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(256))]

    #[test]
    fn the_way_is_the_sum_of_the_speeds(limits in ordinary_limits()) {
        const SAMPLES: u64 = 2_000;
        let mut ramp = Ramp::new();
        ramp.plan(at(0), &limits);
        let end = ramp.arrival().unwrap().as_ticks();
        let span = (end / SAMPLES).max(1) as f64;
        let units = f64::from(1 << 24);
        let (mut way, mut tolerance) = (0.0, 2.0);
        let mut time = 0;
        while time < end {
            // Where the acceleration changes a sample begins, so that none goes up and down again.
            let bend = ramp.stretch(at(time)).until.map_or(end, |until| until.as_ticks());
            let next = (time + span as u64).min(end).min(bend);
            let clocks = (next - time) as f64;
            let speed = |time: u64| f64::from(ramp.velocity(at(time)));
            let mean = (speed(time) + speed(next)) / 2.0;
            way += mean * clocks / units;
            // A reading may be wrong by a unit.
            tolerance += clocks / units;
            time = next;
            let there = f64::from(ramp.position(at(time)));
            prop_assert!((way - there).abs() <= tolerance, "{way} at {time}, in fact {there}");
        }
    }

    #[test]
    fn nothing_in_the_registers_makes_the_ramp_panic_or_lose_its_events(
        steps in prop::collection::vec((any_limits(), any::<u64>(), 24..64u32, any::<Option<i32>>()), 1..12)
    ) {
        let mut ramp = Ramp::new();
        let mut now = 0u64;
        for (limits, wait, shift, position) in steps {
            ramp.plan(at(now), &limits);
            if let Some(position) = position {
                ramp.set_position(at(now), position);
                // A move of no length may end in the instant in which it begins.
                if ramp.arrival() != Some(at(now)) {
                    prop_assert_eq!(ramp.position(at(now)), position);
                }
            }
            let mut event = at(now);
            for _ in 0..16 {
                prop_assert!(ramp.velocity(event).unsigned_abs() < 1 << 23);
                match ramp.next_event(event) {
                    Some(next) => {
                        prop_assert!(next > event);
                        event = next;
                    }
                    None => break,
                }
            }
            prop_assert_eq!(ramp.next_event(event), None);
            now = now.saturating_add(wait >> shift);
        }
    }
}
