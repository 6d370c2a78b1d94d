//! Numbers and times.

use opentmcl_wire::Duration;

/// A 32-bit value; hexadecimal ones are the bit pattern.
pub(super) fn value(text: &str) -> Result<i32, String> {
    let parsed = match text.strip_prefix('$') {
        Some(digits) => u32::from_str_radix(digits, 16).ok().map(u32::cast_signed),
        None => text.parse().ok(),
    };
    parsed.ok_or_else(|| {
        format!("{text:?} is no value; write -2147483648..2147483647 or $ and up to 8 digits")
    })
}

/// A number of at most 8 or 16 bits.
pub(super) fn small<T: std::str::FromStr>(text: &str) -> Result<T, String> {
    text.parse().map_err(|_| {
        format!("{text:?} is not a number up to {}", if size_of::<T>() == 1 { 255 } else { 65535 })
    })
}

pub(super) fn duration(amount: &str, unit: &str) -> Result<Duration, String> {
    let amount: u32 = amount
        .parse()
        .map_err(|_| format!("{amount:?} is no time; write for example: wait 1500 ms"))?;
    let amount = u64::from(amount);
    match unit {
        "us" => Ok(Duration::from_micros(amount)),
        "ms" => Ok(Duration::from_millis(amount)),
        "s" => Ok(Duration::from_secs(amount)),
        _ => Err(format!("{unit:?} is no unit of time; write s, ms or us")),
    }
}
