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
