//! Ranges of values with round ticks.

/// A range, from left to right or from bottom to top.
#[derive(Clone, Copy)]
pub(super) struct Span {
    pub(super) from: i64,
    pub(super) to: i64,
}

impl Span {
    /// Where a value lies if this range is spread over another one.
    fn spread(self, value: i64, over: Self) -> i64 {
        over.from + (value - self.from) * (over.to - over.from) / (self.to - self.from)
    }
}

/// Most intervals between two ticks.
const VALUE_INTERVALS: i64 = 8;
const TIME_INTERVALS: i64 = 12;

/// The smallest of 1, 2, 5, 10, 20, … that divides a range into at most so many intervals.
fn round_step(range: i64, intervals: i64) -> i64 {
    let mut power = 1;
    loop {
        for step in [power, 2 * power, 5 * power] {
            if range <= step * intervals {
                return step;
            }
        }
        power *= 10;
    }
}

/// A value in units of `unit`, with as many decimals as the steps between its like need.
fn label(value: i64, step: i64, unit: i64) -> String {
    let mut decimals = 0;
    let mut scale = 1;
    while step * scale % unit != 0 && decimals < 6 {
        decimals += 1;
        scale *= 10;
    }
    let minus = if value < 0 { "\u{2212}" } else { "" };
    let scaled = value.abs() * scale / unit;
    let (whole, fraction) = (scaled / scale, scaled % scale);
    match decimals {
        0 => format!("{minus}{whole}"),
        _ => format!("{minus}{whole}.{fraction:0decimals$}"),
    }
}

/// The scale of a panel's values: from tick to tick, zero included.
pub(super) struct Scale {
    span: Span,
    step: i64,
}

impl Scale {
    /// A scale on which these values have their places.
    pub(super) fn around(values: impl Iterator<Item = i64>) -> Self {
        let (low, high) =
            values.fold((0, 0), |(low, high), value| (value.min(low), value.max(high)));
        let step = round_step((high - low).max(1), VALUE_INTERVALS);
        let down = |value: i64| value.div_euclid(step) * step;
        let span = Span { from: down(low), to: -down(-high.max(low + 1)) };
        Self { span, step }
    }

    pub(super) fn place(&self, value: i64, over: Span) -> i64 {
        self.span.spread(value, over)
    }

    /// Values with their labels.
    pub(super) fn ticks(&self) -> impl Iterator<Item = (i64, String)> {
        let count = (self.span.to - self.span.from) / self.step;
        (0..=count).map(|at| {
            let value = self.span.from + at * self.step;
            (value, label(value, self.step, self.unit()))
        })
    }

    /// `speed in 1000 pps`.
    pub(super) fn title(&self, quantity: &str, unit: &str) -> String {
        match self.unit() {
            1 if unit.is_empty() => quantity.to_owned(),
            1 => format!("{quantity} in {unit}"),
            1000 if unit == "µm" => format!("{quantity} in mm"),
            1000 if unit == "mV" => format!("{quantity} in V"),
            1000 => format!("{quantity} in 1000 {unit}"),
            _ => format!("{quantity} in million {unit}"),
        }
    }

    fn unit(&self) -> i64 {
        match self.span.to.max(-self.span.from) {
            ..10_000 => 1,
            10_000..2_000_000 => 1000,
            _ => 1_000_000,
        }
    }
}

/// Units of the time axis in microseconds, each with the end from which it is used.
const TIME_UNITS: [(i64, i64, &str); 4] = [
    (3 * 3_600_000_000, 3_600_000_000, "h"),
    (300_000_000, 60_000_000, "min"),
    (100_000, 1_000_000, "s"),
    (i64::MIN, 1000, "ms"),
];

/// The time axis, from 0 to the end, with ticks inside.
pub(super) struct TimeScale {
    end: i64,
    step: i64,
    unit: i64,
    name: &'static str,
}

impl TimeScale {
    /// A time axis that ends at `end` microseconds.
    pub(super) fn new(end: i64) -> Self {
        let end = end.max(1);
        let [.., last] = TIME_UNITS;
        let (_, unit, name) =
            TIME_UNITS.into_iter().find(|&(from, ..)| end >= from).unwrap_or(last);
        // Round steps are those of the unit where it is longer than they.
        let whole = round_step(end, TIME_INTERVALS);
        let step = if whole < unit { whole } else { round_step(end / unit, TIME_INTERVALS) * unit };
        Self { end, step, unit, name }
    }

    pub(super) fn place(&self, time: i64, over: Span) -> i64 {
        Span { from: 0, to: self.end }.spread(time.clamp(0, self.end), over)
    }

    /// Times with their labels.
    pub(super) fn ticks(&self) -> impl Iterator<Item = (i64, String)> {
        (0..=self.end / self.step).map(|at| {
            let time = at * self.step;
            (time, label(time, self.step, self.unit))
        })
    }

    pub(super) fn title(&self) -> String {
        format!("time in {}", self.name)
    }
}
