//! Virtual time as text, by whole numbers: every machine writes the same.

use opentmcl_wire::Duration;

const TICKS_PER_MICROSECOND: u64 = 16;

/// Seconds to the microsecond, for columns: `1.250000`.
pub(crate) fn column(time: Duration) -> String {
    let micros = time.as_ticks() / TICKS_PER_MICROSECOND;
    format!("{}.{:06}", micros / 1_000_000, micros % 1_000_000)
}

/// Seconds to the millisecond, with the unit: `1.250 s`.
pub(crate) fn text(time: Duration) -> String {
    let millis = (time.as_ticks() + 500 * TICKS_PER_MICROSECOND) / (1000 * TICKS_PER_MICROSECOND);
    format!("{}.{:03} s", millis / 1000, millis % 1000)
}

/// Seconds as a number of JSON, to the microsecond.
pub(crate) fn number(time: Duration) -> f64 {
    (time.as_ticks() / TICKS_PER_MICROSECOND) as f64 / 1e6
}
