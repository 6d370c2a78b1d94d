//! Speed from a position counter, by the time between its edges.
//!
//! Some of the edges are marks. The speed is what was counted between marks, divided by the time between the
//! very edges, so that it is exact however few counts there are. While no edge comes, the rotor cannot be faster
//! than one count in the time since the last one.

use super::{PERIODS_PER_SECOND, saturated};

/// Parts of a control period in which ages are given.
const PARTS: i64 = 256;
/// How far intervals go back at most, if there is more than one: 5 ms.
const REACH: u32 = PERIODS_PER_SECOND / 200 * PARTS as u32;
/// Without an edge the speed is looked at in steps of this many periods.
const FALL_PERIODS: u32 = 20;
/// After two seconds without an edge the rotor stands.
const STANDSTILL: u32 = 2 * PERIODS_PER_SECOND;
/// From turns per part of a period to 1/256 revolution per minute.
const SPEED: i64 = 256 * 60 * PERIODS_PER_SECOND as i64 * PARTS;
const MOST_MARKS: u8 = 8;

/// What lies between two marks.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
struct Interval {
    counts: i32,
    /// In 1/256 period.
    time: u32,
}

/// Measures speed. A rotor that has stood for two seconds changes nothing in it any more.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Tachometer {
    counts_per_turn: u32,
    spacing: u16,
    marks: u8,
    /// The counter at the last step; `None` before the first one.
    count: Option<i32>,
    /// Sign of the last edge; 0 while none is known from which to measure.
    direction: i8,
    /// Periods since the last edge, and how old it was then.
    since_edge: u32,
    edge_age: u8,
    /// The last mark: counter, periods since then, and how old it was then.
    mark: i32,
    since_mark: u32,
    mark_age: u8,
    /// The last intervals, in a ring: where the newest one is, and how many there are.
    intervals: [Interval; MOST_MARKS as usize],
    newest: u8,
    known: u8,
    speed: i32,
}

impl Tachometer {
    /// A tachometer for a counter with so many counts per turn (0 acts as 1). An edge is a mark if `spacing`
    /// control periods have passed since the last mark; the speed is measured over up to `marks` of the last
    /// intervals between marks, 1 to 8.
    pub fn new(counts_per_turn: u32, spacing: u16, marks: u8) -> Self {
        Self {
            counts_per_turn: counts_per_turn.max(1),
            spacing,
            marks: marks.clamp(1, MOST_MARKS),
            count: None,
            direction: 0,
            since_edge: 0,
            edge_age: 0,
            mark: 0,
            since_mark: 0,
            mark_age: 0,
            intervals: [Interval::default(); MOST_MARKS as usize],
            newest: 0,
            known: 0,
            speed: 0,
        }
    }

    /// The counter, once per control period. `age` is how long ago in 1/256 period its last edge came; it is
    /// looked at only if the counter has changed. The first step takes the counter as it is.
    #[inline]
    pub fn step(&mut self, count: i32, age: u8) {
        let before = self.count.unwrap_or(count);
        self.count = Some(count);
        if self.direction != 0 {
            self.since_edge += 1;
            self.since_mark += 1;
        }
        if count != before {
            self.edge(count, count.wrapping_sub(before).signum() as i8, age);
        } else if self.direction != 0 && self.since_edge.is_multiple_of(FALL_PERIODS) {
            self.fall();
        }
    }

    /// Speed in 1/256 revolution per minute, positive if the counter counts up.
    #[inline]
    pub fn speed(&self) -> i32 {
        self.speed
    }

    /// The counter has been set to another value: this is no motion.
    pub fn set_count(&mut self, count: i32) {
        if let Some(before) = self.count.replace(count) {
            self.mark = self.mark.wrapping_add(count.wrapping_sub(before));
        }
    }

    #[inline]
    fn edge(&mut self, count: i32, direction: i8, age: u8) {
        self.since_edge = 0;
        self.edge_age = age;
        if direction != self.direction {
            self.begin(count, direction, age);
        } else if self.since_mark >= u32::from(self.spacing) {
            // At least one period has passed, so that this is at least 1.
            let time = self.since_mark * PARTS as u32 + u32::from(self.mark_age) - u32::from(age);
            self.newest = (self.newest + 1) % MOST_MARKS;
            self.known = (self.known + 1).min(self.marks);
            let counts = count.wrapping_sub(self.mark);
            self.intervals[usize::from(self.newest % MOST_MARKS)] = Interval { counts, time };
            (self.mark, self.since_mark, self.mark_age) = (count, 0, age);
            self.measure();
        }
    }

    /// From here on, or with direction 0 from the next edge on, everything is new.
    fn begin(&mut self, count: i32, direction: i8, age: u8) {
        let new = Self::new(self.counts_per_turn, self.spacing, self.marks);
        *self = Self {
            count: Some(count),
            direction,
            edge_age: age,
            mark: count,
            mark_age: age,
            ..new
        };
    }

    fn measure(&mut self) {
        let (mut counts, mut time) = (0, 0);
        for back in 0..self.known {
            let at = (self.newest + MOST_MARKS - back) % MOST_MARKS;
            let interval = self.intervals[usize::from(at)];
            if back > 0 && time + interval.time > REACH {
                break;
            }
            counts += i64::from(interval.counts);
            time += interval.time;
        }
        self.speed = self.speed_of(counts, time);
    }

    /// One count in the time since the last edge is the most that the speed can be.
    fn fall(&mut self) {
        if self.since_edge >= STANDSTILL {
            self.begin(self.count.unwrap_or(0), 0, 0);
            return;
        }
        let time = self.since_edge * PARTS as u32 + u32::from(self.edge_age);
        let most = self.speed_of(1, time);
        self.speed = self.speed.clamp(-most, most);
    }

    /// `time` is in 1/256 period and below 2^26, as a mark is never older than its spacing and a standstill.
    fn speed_of(&self, counts: i64, time: u32) -> i32 {
        let divisor = i64::from(time.max(1)) * i64::from(self.counts_per_turn);
        saturated(counts.saturating_mul(SPEED) / divisor)
    }
}

#[cfg(test)]
mod tests {
    use super::super::random::Random;
    use super::*;

    /// A rotor at an even speed: the counter after a period, and the age of its last edge. In exact integers:
    /// the position in counts is `numerator` * parts / `denominator`.
    fn even(period: i64, numerator: i64, denominator: i64) -> (i32, u8) {
        let now = (period + 1) * PARTS;
        let count = (now * numerator).div_euclid(denominator);
        // To the right the last edge came where the position became `count`, rounded up to a part.
        let at = (count * denominator + numerator - 1).div_euclid(numerator);
        (count as i32, (now - at).clamp(0, 255) as u8)
    }

    /// Numerator and denominator for a speed in rpm.
    fn rate(rpm: i64, counts_per_turn: i64) -> (i64, i64) {
        (rpm * counts_per_turn, 60 * i64::from(PERIODS_PER_SECOND) * PARTS)
    }

    fn rpm(tachometer: &Tachometer) -> f64 {
        f64::from(tachometer.speed()) / 256.0
    }

    #[test]
    fn an_even_speed_is_measured_to_a_thousandth_at_any_resolution() {
        for (counts, spacing, marks) in
            [(24, 1, 8), (24, 20, 1), (6, 1, 8), (4_000, 20, 5), (65_536, 20, 5)]
        {
            for speed in [50, 777, 4_000, 20_000] {
                let (numerator, denominator) = rate(speed, counts);
                for mirrored in [false, true] {
                    let mut tachometer = Tachometer::new(counts as u32, spacing, marks);
                    for period in 0..20_000 {
                        let (count, age) = even(period, numerator, denominator);
                        tachometer.step(if mirrored { -count } else { count }, age);
                        // After some marks every single reading has to be right.
                        if period < 10_000 {
                            continue;
                        }
                        let expected = if mirrored { -speed } else { speed } as f64;
                        let off = (rpm(&tachometer) / expected - 1.0).abs();
                        assert!(off < 1e-3, "{} at {speed} with {counts}", rpm(&tachometer));
                    }
                }
            }
        }
    }

    /// 24 counts per turn, to the right with one edge each so many periods, and that many edges.
    fn turn(tachometer: &mut Tachometer, count: &mut i32, spacing: i32, edges: i32, age: u8) {
        for period in 1..=spacing * edges {
            *count += i32::from(period % spacing == 0);
            tachometer.step(*count, age);
        }
    }

    #[test]
    fn a_change_of_speed_is_seen_after_five_milliseconds() {
        let mut tachometer = Tachometer::new(24, 1, 8);
        let mut count = 0;
        turn(&mut tachometer, &mut count, 50, 40, 0);
        assert_eq!(tachometer.speed(), 1_000 * 256);
        // Half of the 5 ms are of the new speed: 2 + 1 counts in 100 periods.
        turn(&mut tachometer, &mut count, 25, 2, 0);
        assert_eq!(tachometer.speed(), 1_500 * 256);
        turn(&mut tachometer, &mut count, 25, 2, 0);
        assert_eq!(tachometer.speed(), 2_000 * 256);
        // 300 periods are more than 5 ms, and stand alone.
        turn(&mut tachometer, &mut count, 300, 1, 0);
        assert_eq!(tachometer.speed(), 166 * 256 + 170);
    }

    #[test]
    fn without_edges_the_speed_falls_to_zero() {
        let mut tachometer = Tachometer::new(24, 1, 8);
        let mut count = 0;
        turn(&mut tachometer, &mut count, 25, 40, 200);
        let mut before = tachometer.speed();
        for period in 1..STANDSTILL {
            tachometer.step(count, 0);
            assert!(tachometer.speed() <= before);
            before = tachometer.speed();
            // One count of 24 since the last edge, looked at up to 19 periods ago.
            let looked = f64::from(period / FALL_PERIODS * FALL_PERIODS) + 200.0 / 256.0;
            let most = 60.0 * 20_000.0 / 24.0 / looked;
            assert!((rpm(&tachometer) - most.min(2_000.0)).abs() < 0.01, "{period}");
        }
        tachometer.step(count, 0);
        assert_eq!(tachometer.speed(), 0);
        let standing = tachometer;
        for _ in 0..1_000 {
            tachometer.step(count, 0);
        }
        assert_eq!(tachometer, standing, "a standing rotor changes nothing");
    }

    #[test]
    fn a_reversal_begins_anew() {
        let mut tachometer = Tachometer::new(24, 1, 8);
        let mut count = 0;
        turn(&mut tachometer, &mut count, 25, 40, 0);
        assert_eq!(tachometer.speed(), 2_000 * 256);
        // Back over the same edge: nothing is known but that it turns the other way.
        tachometer.step(count - 1, 0);
        assert_eq!(tachometer.speed(), 0);
        for period in 1..=50 {
            tachometer.step(count - 1 - period / 50, 0);
        }
        assert_eq!(tachometer.speed(), -1_000 * 256);
    }

    #[test]
    fn a_counter_that_is_set_or_wraps_is_no_motion() {
        let mut tachometer = Tachometer::new(24, 1, 8);
        let mut count = i32::MAX - 20;
        for period in 1..=2_000 {
            count = count.wrapping_add(i32::from(period % 25 == 0));
            tachometer.step(count, 0);
            if period == 1_510 {
                count = 1_000_000;
                tachometer.set_count(count);
            }
            assert!(period < 75 || tachometer.speed() == 2_000 * 256, "{period}");
        }
    }

    #[test]
    fn the_speed_has_the_sign_of_the_last_edge_and_no_more_than_what_was_counted() {
        let mut random = Random::new(0x519);
        let mut tachometer = Tachometer::new(4_096, 3, 8);
        let (mut count, mut direction) = (0i32, 1);
        for _ in 0..200_000 {
            if random.below(20) == 0 {
                direction = -direction;
            }
            let counts = if random.below(2) == 0 { random.magnitude(7) as i32 } else { 0 };
            count = count.wrapping_add(direction * counts);
            tachometer.step(count, random.next() as u8);
            if counts != 0 {
                assert!(tachometer.speed() * direction >= 0);
            }
            // 127 counts in each period, and a mark not less than two whole periods after the last one, in
            // which three readings may lie.
            let most = 127.0 * 3.0 / 2.0 * 20_000.0 * 60.0 / 4_096.0;
            assert!(rpm(&tachometer).abs() <= most, "{}", rpm(&tachometer));
        }
    }

    #[test]
    fn any_counter_has_a_speed() {
        let mut random = Random::new(0x7ac0);
        for _ in 0..2_000 {
            let mut tachometer = Tachometer::new(
                random.unsigned(),
                random.magnitude(16) as u16,
                random.next() as u8,
            );
            let mut count = 0i32;
            for _ in 0..random.magnitude(9) {
                count = match random.below(3) {
                    0 => count.wrapping_add(random.signed()),
                    1 => count.wrapping_add(1),
                    _ => count,
                };
                if random.below(30) == 0 {
                    tachometer.set_count(random.signed());
                }
                tachometer.step(count, random.next() as u8);
            }
        }
        // An edge at the last moment before the standstill, with the widest spacing.
        let mut tachometer = Tachometer::new(u32::MAX, u16::MAX, 1);
        for count in 0..5 {
            for _ in 0..STANDSTILL - 1 {
                tachometer.step(count, 255);
            }
        }
        assert_eq!(tachometer.speed(), 0);
    }
}
