//! Virtual time as text and back, by whole numbers: every machine writes the same.

use opentmcl_wire::{Duration, TICKS_PER_SECOND};

/// Units of time, the first one that ends the text; longer names before their endings.
const UNITS: [(&str, u64); 4] = [
    ("ms", TICKS_PER_SECOND / 1000),
    ("min", 60 * TICKS_PER_SECOND),
    ("s", TICKS_PER_SECOND),
    ("h", 3600 * TICKS_PER_SECOND),
];

/// Longer than any run makes sense, and far from where clocks overflow.
const LONGEST: u64 = 10_000 * 3600 * TICKS_PER_SECOND;

/// Reads a time with its unit: `500ms`, `1.5s`, `2min`, `1h`.
pub(crate) fn parse(text: &str) -> Result<Duration, String> {
    let expected = || "write a number with ms, s, min or h: 500ms, 1.5s, 2min, 1h".to_owned();
    let (number, unit) = UNITS
        .iter()
        .find_map(|&(name, ticks)| Some((text.strip_suffix(name)?, ticks)))
        .ok_or_else(expected)?;
    let (whole, fraction) = number.trim_end().split_once('.').unwrap_or((number.trim_end(), ""));
    let digits = |text: &str| text.bytes().all(|byte| byte.is_ascii_digit());
    if whole.is_empty() || !digits(whole) || !digits(fraction) || fraction.len() > 9 {
        return Err(expected());
    }
    let scale = 10u128.pow(fraction.len() as u32);
    let too_long = || "at most 10000h".to_owned();
    let number: u128 = format!("{whole}{fraction}").parse().map_err(|_| too_long())?;
    let ticks = number.checked_mul(u128::from(unit)).ok_or_else(too_long)? / scale;
    match u64::try_from(ticks) {
        Ok(0) => Err("write a time longer than nothing".to_owned()),
        Ok(ticks) if ticks <= LONGEST => Ok(Duration::from_ticks(ticks)),
        _ => Err(too_long()),
    }
}

/// Seconds to the microsecond, for columns: `1.250000`.
pub(crate) fn column(time: Duration) -> String {
    let micros = time.as_micros();
    format!("{}.{:06}", micros / 1_000_000, micros % 1_000_000)
}

/// Seconds to the millisecond, with the unit: `1.250 s`.
pub(crate) fn text(time: Duration) -> String {
    // To the nearest one.
    let millis = (time + Duration::from_micros(500)).as_millis();
    format!("{}.{:03} s", millis / 1000, millis % 1000)
}

/// Seconds as a number of JSON, to the microsecond.
pub(crate) fn number(time: Duration) -> f64 {
    time.as_micros() as f64 / 1e6
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn times_are_read_with_their_unit() {
        let ticks = |text| parse(text).unwrap().as_ticks();
        assert_eq!(ticks("500ms"), 8_000_000);
        assert_eq!(ticks("10s"), 160_000_000);
        assert_eq!(ticks("0.5 s"), 8_000_000);
        assert_eq!(ticks("1.5s"), 24_000_000);
        assert_eq!(ticks("2min"), 1_920_000_000);
        assert_eq!(ticks("1h"), 57_600_000_000);
    }

    #[test]
    fn what_is_no_time_is_refused() {
        for text in ["", "s", "10", "-1s", "1.s.", "1e3s", "0s", "10001h", "99999999999999999999h"]
        {
            assert!(parse(text).is_err(), "{text}");
        }
    }
}
