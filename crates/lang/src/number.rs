//! Numbers as the language writes them.

/// The value of a number: decimal with or without a fraction and an exponent, `$FF` or `0xFF`, or
/// `%1010`. `None` if it is not one, or has more than 32 binary digits.
pub(crate) fn value(text: &str) -> Option<f64> {
    let bytes = text.as_bytes();
    match bytes {
        // Most numbers: so few digits that nothing can overflow.
        [first, rest @ ..] if first.is_ascii_digit() && rest.len() < 9 => {
            if let Some(value) = decimal(bytes) {
                return Some(f64::from(value));
            }
        }
        _ => {}
    }
    if let Some(digits) = text.strip_prefix('$') {
        return with_radix(digits, 16);
    }
    if let Some(digits) = text.strip_prefix("0x").or_else(|| text.strip_prefix("0X")) {
        return with_radix(digits, 16);
    }
    if let Some(digits) = text.strip_prefix('%') {
        return with_radix(digits, 2);
    }
    // The standard library also knows words such as `inf`, which do not begin with a digit.
    let begins = matches!(bytes, [b'0'..=b'9', ..] | [b'.', b'0'..=b'9', ..]);
    text.parse().ok().filter(|value: &f64| begins && value.is_finite())
}

fn decimal(digits: &[u8]) -> Option<u32> {
    digits.iter().try_fold(0, |value, &digit| {
        digit.is_ascii_digit().then(|| value * 10 + u32::from(digit - b'0'))
    })
}

fn with_radix(digits: &str, radix: u32) -> Option<f64> {
    if digits.starts_with('+') {
        return None;
    }
    u32::from_str_radix(digits, radix).ok().map(f64::from)
}

#[cfg(test)]
mod tests {
    use super::value;

    #[test]
    fn every_notation_is_read() {
        for (text, expected) in [
            ("0", 0.0),
            ("51200", 51200.0),
            ("999999999", 999_999_999.0),
            ("2147483648", 2_147_483_648.0),
            ("$47", 71.0),
            ("0xff", 255.0),
            ("0XFf", 255.0),
            ("$FFFFFFFF", 4_294_967_295.0),
            ("%1010101", 85.0),
            ("3.25", 3.25),
            (".5", 0.5),
            ("1.5e3", 1500.0),
            ("2E-1", 0.2),
        ] {
            assert_eq!(value(text), Some(expected), "{text}");
        }
    }

    #[test]
    fn what_is_no_number_has_no_value() {
        for text in [
            "12abc",
            "$",
            "$XY",
            "%12",
            "%",
            "0x",
            "1.2.3",
            "$100000000",
            "1e999",
            "",
            "$+1",
            "inf",
            "+1",
        ] {
            assert_eq!(value(text), None, "{text}");
        }
    }
}
