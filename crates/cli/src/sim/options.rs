//! Values of the options of `tmcl sim`: times, which others take as well, and `N=VALUE`.

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
pub(crate) fn parse_time(text: &str) -> Result<Duration, String> {
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

/// Level of an input: `N=high` or `N=low`.
pub(super) fn parse_input(text: &str) -> Result<(u8, bool), String> {
    let expected = || "write the number of the input and its level: 3=high or 3=low".to_owned();
    let (number, level) = text.split_once('=').ok_or_else(expected)?;
    let level = match level.to_ascii_lowercase().as_str() {
        "high" | "1" => true,
        "low" | "0" => false,
        _ => return Err(expected()),
    };
    Ok((number.parse().map_err(|_| expected())?, level))
}

/// Reading of an analog input: `N=READING`.
pub(super) fn parse_analog(text: &str) -> Result<(u8, u16), String> {
    let expected = || "write the number of the input and its reading: 0=2048".to_owned();
    let (number, reading) = text.split_once('=').ok_or_else(expected)?;
    Ok((number.parse().map_err(|_| expected())?, reading.parse().map_err(|_| expected())?))
}

/// Value of a user variable: `N=VALUE`.
pub(super) fn parse_variable(text: &str) -> Result<(u8, i32), String> {
    let expected = || "write a variable from 0 to 255 and its value: 42=1000".to_owned();
    let (number, value) = text.split_once('=').ok_or_else(expected)?;
    Ok((number.parse().map_err(|_| expected())?, value.parse().map_err(|_| expected())?))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn times_are_read_with_their_unit() {
        let ticks = |text| parse_time(text).unwrap().as_ticks();
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
            assert!(parse_time(text).is_err(), "{text}");
        }
    }
}
