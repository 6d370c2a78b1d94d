//! Values with units, as people of laboratories write them: `12.5 mm`, `0.3 Nm`, `24 V`.

use std::f64::consts::PI;

/// What a value measures.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Quantity {
    /// In mm.
    Length,
    /// In degrees.
    Angle,
    /// In microsteps of 1/256 full step, as the position counter counts with factory settings.
    Microsteps,
    /// In kg.
    Mass,
    /// In kg m².
    Inertia,
    /// In N.
    Force,
    /// In Nm.
    Torque,
    /// In N s/m.
    LinearDamping,
    /// In Nm s/rad.
    RotaryDamping,
    /// In N/m.
    LinearRate,
    /// In Nm/rad.
    RotaryRate,
    /// In V.
    Voltage,
    /// In A.
    Current,
    /// In ohm.
    Resistance,
    /// In H.
    Inductance,
    /// In F.
    Capacitance,
    /// In Nm/A.
    TorqueConstant,
    /// In s.
    Time,
    /// In °C.
    Temperature,
}

/// A unit as it is compared ([`plain`]), and as it is written; how many of the quantity's unit it is.
type Unit = (&'static str, &'static str, f64);

impl Quantity {
    /// What it is called, with its article.
    fn name(self) -> &'static str {
        match self {
            Self::Length => "a length",
            Self::Angle => "an angle",
            Self::Microsteps => "a number of microsteps",
            Self::Mass => "a mass",
            Self::Inertia => "a moment of inertia",
            Self::Force => "a force",
            Self::Torque => "a torque",
            Self::LinearDamping | Self::RotaryDamping => "a viscous friction",
            Self::LinearRate | Self::RotaryRate => "the rate of a spring",
            Self::Voltage => "a voltage",
            Self::Current => "a current",
            Self::Resistance => "a resistance",
            Self::Inductance => "an inductance",
            Self::Capacitance => "a capacitance",
            Self::TorqueConstant => "a torque constant",
            Self::Time => "a time",
            Self::Temperature => "a temperature",
        }
    }

    /// Its units; the first one stands in examples.
    fn units(self) -> &'static [Unit] {
        match self {
            Self::Length => &[
                ("mm", "mm", 1.0),
                ("um", "um", 1e-3),
                ("cm", "cm", 10.0),
                ("m", "m", 1000.0),
                ("in", "in", 25.4),
            ],
            Self::Angle => &[
                ("°", "°", 1.0),
                ("deg", "deg", 1.0),
                ("rad", "rad", 180.0 / PI),
                ("turn", "turn", 360.0),
                ("turns", "turns", 360.0),
            ],
            Self::Microsteps => &[("usteps", "usteps", 1.0), ("microsteps", "microsteps", 1.0)],
            Self::Mass => &[("kg", "kg", 1.0), ("g", "g", 1e-3)],
            Self::Inertia => &[("kgm2", "kg m2", 1.0), ("gcm2", "g cm2", 1e-7)],
            Self::Force => &[("N", "N", 1.0), ("mN", "mN", 1e-3), ("kN", "kN", 1000.0)],
            Self::Torque => &[("Nm", "Nm", 1.0), ("mNm", "mNm", 1e-3), ("Ncm", "Ncm", 1e-2)],
            Self::LinearDamping => &[("Ns/m", "N s/m", 1.0), ("Ns/mm", "N s/mm", 1000.0)],
            Self::RotaryDamping => &[("Nms/rad", "Nm s/rad", 1.0), ("mNms/rad", "mNm s/rad", 1e-3)],
            Self::LinearRate => &[("N/mm", "N/mm", 1000.0), ("N/m", "N/m", 1.0)],
            Self::RotaryRate => &[
                ("Nm/rad", "Nm/rad", 1.0),
                ("Nm/°", "Nm/°", 180.0 / PI),
                ("Nm/deg", "Nm/deg", 180.0 / PI),
                ("Nm/turn", "Nm/turn", 0.5 / PI),
            ],
            Self::Voltage => &[("V", "V", 1.0), ("mV", "mV", 1e-3)],
            Self::Current => &[("A", "A", 1.0), ("mA", "mA", 1e-3)],
            Self::Resistance => &[("ohm", "ohm", 1.0), ("mohm", "mohm", 1e-3)],
            Self::Inductance => &[("mH", "mH", 1e-3), ("uH", "uH", 1e-6), ("H", "H", 1.0)],
            Self::Capacitance => &[("mF", "mF", 1e-3), ("uF", "uF", 1e-6), ("F", "F", 1.0)],
            Self::TorqueConstant => &[
                ("mNm/A", "mNm/A", 1e-3),
                ("Nm/A", "Nm/A", 1.0),
                ("Ncm/A", "Ncm/A", 1e-2),
                ("Vs/rad", "V s/rad", 1.0),
            ],
            Self::Time => &[
                ("s", "s", 1.0),
                ("ms", "ms", 1e-3),
                ("us", "us", 1e-6),
                ("min", "min", 60.0),
                ("h", "h", 3600.0),
            ],
            Self::Temperature => &[("°C", "°C", 1.0), ("C", "C", 1.0)],
        }
    }

    /// What would be right: `a length such as "5 mm" (mm, um, cm, m or in)`.
    pub(crate) fn expected(self) -> String {
        let units = self.units();
        let (name, example) = (self.name(), units.first().map_or("", |unit| unit.1));
        if let [_] = units {
            return format!("{name} such as \"5 {example}\"");
        }
        let names: Vec<&str> = units.iter().map(|unit| unit.1).collect();
        format!("{name} such as \"5 {example}\" ({})", names.join(", "))
    }
}

/// A unit without all that people write in different ways: blanks, dots and hats, squares, Greek letters.
fn plain(unit: &str) -> String {
    unit.chars()
        .filter(|letter| !letter.is_whitespace() && !matches!(letter, '·' | '⋅' | '*' | '^'))
        .map(|letter| match letter {
            '²' => '2',
            'µ' | 'μ' => 'u',
            'Ω' | '\u{2126}' => 'Ω',
            letter => letter,
        })
        .collect::<String>()
        .replace('Ω', "ohm")
}

/// The number and the unit of a text.
fn split(text: &str) -> (&str, &str) {
    let text = text.trim();
    let end = text.find(char::is_whitespace).unwrap_or_else(|| {
        text.find(|letter: char| !letter.is_ascii_digit() && !matches!(letter, '.' | '-' | '+'))
            .unwrap_or(text.len())
    });
    let (number, unit) = text.split_at(end);
    (number, unit.trim())
}

/// A finite number in decimal notation.
pub(crate) fn number(text: &str) -> Option<f64> {
    let decimal = text.bytes().all(|byte| byte.is_ascii_digit() || b"+-.eE".contains(&byte));
    text.parse().ok().filter(|value: &f64| decimal && value.is_finite())
}

/// Reads a value that is one of these quantities, with which of them it is.
///
/// # Errors
/// What is wrong with the text, and what would be right.
pub(crate) fn parse(text: &str, quantities: &[Quantity]) -> Result<(Quantity, f64), String> {
    let (digits, unit) = split(text);
    let unit = plain(unit);
    let expected = || {
        let expected: Vec<String> = quantities.iter().map(|one| one.expected()).collect();
        expected.join(" or ")
    };
    let Some(value) = number(digits) else {
        return Err(format!("{text:?} does not begin with a number; write {}", expected()));
    };
    for &quantity in quantities {
        if let Some(&(_, _, factor)) = quantity.units().iter().find(|&&(name, _, _)| name == unit) {
            let value = value * factor;
            if value.abs() <= LARGEST {
                return Ok((quantity, value));
            }
            return Err(format!("{text:?} is out of all range"));
        }
    }
    if unit.is_empty() {
        return Err(format!("{text:?} has no unit; write {}", expected()));
    }
    Err(format!("{text:?} has another unit; write {}", expected()))
}

/// No laboratory has more of anything; sums and products of such values stay finite.
const LARGEST: f64 = 1e12;

#[cfg(test)]
mod tests {
    use super::Quantity::*;
    use super::*;

    #[test]
    fn each_way_to_write_a_unit_is_read() {
        for (text, quantity, value) in [
            ("12.5 mm", Length, 12.5),
            ("12.5mm", Length, 12.5),
            ("-2 cm", Length, -20.0),
            ("1e-3 m", Length, 1.0),
            ("250 µm", Length, 0.25),
            ("1 in", Length, 25.4),
            ("90°", Angle, 90.0),
            ("0.5 turn", Angle, 180.0),
            ("54 g·cm²", Inertia, 5.4e-6),
            ("54 g cm^2", Inertia, 5.4e-6),
            ("2 N/mm", LinearRate, 2000.0),
            ("1.5 Ω", Resistance, 1.5),
            ("30 Ncm", Torque, 0.3),
            ("0.2 N s/m", LinearDamping, 0.2),
            ("120 °C", Temperature, 120.0),
            ("1.5 min", Time, 90.0),
        ] {
            let (read, got) = parse(text, &[quantity]).unwrap();
            assert_eq!(read, quantity);
            assert!((got - value).abs() <= value.abs() * 1e-15, "{text}: {got}");
        }
    }

    #[test]
    fn what_is_no_such_value_is_answered_with_one_that_is() {
        let error = parse("5 kg", &[Length]).unwrap_err();
        assert!(error.contains("another unit") && error.contains("\"5 mm\""), "{error}");
        let error = parse("5", &[Torque, Force]).unwrap_err();
        assert!(error.contains("no unit") && error.contains("Nm") && error.contains("5 N"));
        for text in ["", "mm", "inf mm", "nan mm", "1e999 mm", "1e300 mm", "- mm", "--1 mm"] {
            assert!(parse(text, &[Length]).is_err(), "{text}");
        }
    }
}
