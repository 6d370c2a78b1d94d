//! A million random moves: every one ends on its target and keeps its limits on the way.

use opentmcl_motion::ramp::{Barred, Limits, Mode, Phase, Ramp};
use opentmcl_motion::{Duration, Instant};

/// SplitMix64: a seed gives the same moves on every platform.
struct Random(u64);

impl Random {
    fn next(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9E37_79B9_7F4A_7C15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
        z ^ (z >> 31)
    }

    fn below(&mut self, end: u64) -> u64 {
        self.next() % end
    }

    /// Up to `bits` bits, all magnitudes alike, so that small and large values meet.
    fn magnitude(&mut self, bits: u64) -> u32 {
        let width = self.below(bits + 1);
        (self.next() & ((1 << width) - 1)) as u32
    }

    fn chance(&mut self, one_in: u64) -> bool {
        self.below(one_in) == 0
    }

    fn distance(&mut self) -> i32 {
        let distance = self.magnitude(31) as i32;
        if self.chance(2) { -distance } else { distance }
    }

    /// Settings with which every target can be reached.
    fn limits(&mut self) -> Limits {
        Limits {
            mode: Mode::Position,
            target: 0,
            vstart: if self.chance(2) { 0 } else { self.magnitude(18) },
            a1: self.magnitude(16).max(1),
            v1: if self.chance(3) { 0 } else { self.magnitude(20) },
            amax: self.magnitude(16).max(1),
            vmax: self.magnitude(23).max(1),
            dmax: self.magnitude(16),
            d1: self.magnitude(16),
            vstop: self.magnitude(18),
            zero_wait: Duration::from_ticks(
                512 * u64::from(if self.chance(2) { 0 } else { self.magnitude(16) }),
            ),
            barred: Barred::default(),
        }
    }
}

fn at(ticks: u64) -> Instant {
    Instant::from_ticks(ticks)
}

/// The last planned moment: nothing happens after it.
fn end_of(ramp: &Ramp, from: Instant) -> Instant {
    let mut time = from;
    while let Some(next) = ramp.next_event(time) {
        assert!(next > time);
        time = next;
    }
    time
}

/// Moves at one microstep per second add up: after a thousand years a new axis takes over.
fn before_the_end_of_time(ramp: &mut Ramp, now: Instant) -> Instant {
    if now.as_ticks() < 1 << 59 {
        return now;
    }
    *ramp = Ramp::new();
    at(0)
}

/// Whether braking from this speed stays on one side of the 32-bit circle. Farther round, what is in
/// front of the axis and what behind it changes on the way.
fn brakes_within_half_the_circle(speed: i32, limits: &Limits) -> bool {
    let gentlest = limits.dmax.min(limits.d1).min(limits.amax).max(1);
    i64::from(speed).pow(2) / 256 / i64::from(gentlest) < 1 << 29
}

fn in_register_steps(acceleration: u32, clocks: u64) -> i64 {
    ((i128::from(acceleration) * i128::from(clocks)) >> 17) as i64
}

/// The clock before the arrival belongs to the way: at most a microstep is left, at a speed from
/// which the axis may stop.
fn check_last_clock(ramp: &Ramp, from: Instant) {
    let (limits, arrival) = (ramp.limits(), ramp.arrival().expect("the move ends"));
    if arrival <= from {
        return;
    }
    let before = at(arrival.as_ticks() - 1);
    let missing = limits.target.wrapping_sub(ramp.position(before));
    assert!(missing.unsigned_abs() <= 1, "{missing} left: {limits:?}");
    let last = ramp.velocity(before).unsigned_abs();
    assert!(last <= limits.vstop.max(1) + 1, "stops from {last}: {limits:?}");
}

/// Looks at the ramp at random times between `from` and its end: speed within VMAX, change of speed
/// within the highest acceleration, travel within speed times time.
fn check_limits(ramp: &Ramp, random: &mut Random, from: Instant, top_speed: u32, jump: u32) {
    let limits = ramp.limits();
    let end = end_of(ramp, from).as_ticks();
    let steepest = limits.a1.max(limits.amax).max(limits.dmax).max(limits.d1).max(1);
    let mut earlier = from.as_ticks();
    for _ in 0..4 {
        let later = earlier + random.below(end.saturating_sub(earlier) + 2);
        let (before, after) = (ramp.velocity(at(earlier)), ramp.velocity(at(later)));
        assert!(after.unsigned_abs() <= top_speed, "{after} exceeds {top_speed}: {limits:?}");
        let change = (i64::from(after) - i64::from(before)).abs();
        let allowed = in_register_steps(steepest, later - earlier) + 2 * i64::from(jump) + 8;
        assert!(change <= allowed, "{before} to {after}: {limits:?}");
        let travel = i64::from(ramp.position(at(later)).wrapping_sub(ramp.position(at(earlier))));
        let farthest = ((i128::from(top_speed) * i128::from(later - earlier)) >> 24) as i64 + 2;
        assert!(travel.abs() <= farthest, "{travel} microsteps: {limits:?}");
        earlier = later;
    }
}

#[test]
fn a_million_moves_from_rest_end_on_their_targets_within_their_limits() {
    let mut random = Random(1);
    let mut ramp = Ramp::new();
    let mut now = at(0);
    for _ in 0..1_000_000 {
        let start = ramp.position(now);
        let mut limits = random.limits();
        limits.target = start.wrapping_add(random.distance());
        ramp.plan(now, &limits);
        let arrival = ramp.arrival().unwrap_or_else(|| panic!("never arrives: {limits:?}"));
        assert_eq!(ramp.position(arrival), limits.target, "{limits:?}");
        assert_eq!(ramp.velocity(arrival), 0);
        assert_eq!(ramp.phase(arrival), Phase::Standstill);
        assert_eq!(ramp.second_move(), None, "from rest every move is direct: {limits:?}");
        check_last_clock(&ramp, now);
        check_limits(&ramp, &mut random, now, limits.vmax, limits.vstart.max(limits.vstop).max(1));
        now = before_the_end_of_time(&mut ramp, arrival);
    }
}

#[test]
fn a_target_changed_on_the_fly_is_still_reached_exactly() {
    let mut random = Random(2);
    let mut ramp = Ramp::new();
    let mut now = at(0);
    let mut second_moves = 0;
    for _ in 0..200_000 {
        let mut limits = random.limits();
        limits.target = ramp.position(now).wrapping_add(random.distance() >> 2);
        ramp.plan(now, &limits);
        let mut top_speed = limits.vmax;
        for _ in 0..random.below(4) {
            let end = ramp.arrival().unwrap_or(now).max(now);
            now = at(now.as_ticks() + random.below(end.as_ticks() - now.as_ticks() + 1));
            let speed = ramp.velocity(now).unsigned_abs();
            match random.below(4) {
                0 => limits.target = limits.target.wrapping_add(random.distance() >> 3),
                1 => limits.vmax = random.magnitude(23).max(1),
                2 => limits = Limits { target: limits.target, ..random.limits() },
                _ => limits.target = ramp.position(now),
            }
            top_speed = limits.vmax.max(speed + 1);
            ramp.plan(now, &limits);
            second_moves += u32::from(ramp.second_move().is_some());
        }
        let jump = limits.vstart.max(limits.vstop).max(1);
        check_limits(&ramp, &mut random, now, top_speed, jump);
        let arrival = ramp.arrival().unwrap_or_else(|| panic!("never arrives: {limits:?}"));
        assert_eq!(ramp.position(arrival), limits.target, "{limits:?}");
        assert_eq!(ramp.velocity(arrival), 0);
        check_last_clock(&ramp, now);
        now = before_the_end_of_time(&mut ramp, arrival);
    }
    assert!(second_moves > 10_000, "only {second_moves} moves had to turn round");
}

#[test]
fn planning_again_on_the_way_changes_nothing() {
    let mut random = Random(3);
    for _ in 0..100_000 {
        let mut limits = random.limits();
        let mut ramp = Ramp::new();
        limits.target = random.distance();
        ramp.plan(at(0), &limits);
        // In one of two cases from the middle of a motion, possibly in the wrong direction.
        let mut now = at(0);
        if random.chance(2) {
            now = at(random.below(ramp.arrival().unwrap().as_ticks() + 1));
            limits = Limits { target: random.distance() >> 1, ..random.limits() };
            let (position, velocity) = (ramp.position(now), ramp.velocity(now));
            limits.target = position.wrapping_add(limits.target);
            if !brakes_within_half_the_circle(velocity, &limits) {
                continue;
            }
            ramp.plan(now, &limits);
        }
        let planned_once = ramp.clone();
        let arrival = planned_once.arrival().unwrap();
        for _ in 0..4 {
            now = at(now.as_ticks() + random.below(arrival.as_ticks() - now.as_ticks() + 1));
            ramp.plan(now, &limits);
            assert_eq!(ramp.position(now), planned_once.position(now));
            assert_eq!(ramp.arrival(), Some(arrival), "at {now:?}: {limits:?}");
            let later = at(now.as_ticks() + random.below(arrival.as_ticks() - now.as_ticks() + 1));
            assert_eq!(ramp.position(later), planned_once.position(later), "{limits:?}");
            assert_eq!(ramp.velocity(later), planned_once.velocity(later), "{limits:?}");
        }
    }
}
