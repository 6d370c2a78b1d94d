//! Functions and operators of constant expressions.
//!
//! Computed in floating point by `libm`, so that a program has the same bytes wherever it is
//! assembled.

use crate::tree::BinaryOperator;

macro_rules! functions {
    ($($(#[doc = $doc:literal])+ $function:ident = $name:literal $compute:expr;)*) => {
        /// A function of constant expressions.
        #[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
        pub enum Function {
            $($(#[doc = $doc])+ $function,)*
        }

        impl Function {
            /// All functions.
            pub const ALL: &[Self] = &[$(Self::$function),*];

            /// Its name, upper case.
            pub const fn name(self) -> &'static str {
                match self { $(Self::$function => $name,)* }
            }

            /// What it computes, for people.
            pub const fn description(self) -> &'static str {
                match self { $(Self::$function => concat!($($doc),+).trim_ascii(),)* }
            }

            /// Its value; not a number where it has none.
            pub fn compute(self, x: f64) -> f64 {
                match self { $(Self::$function => ($compute)(x),)* }
            }
        }
    };
}

functions! {
    /// Sine of an angle in radians.
    Sin = "SIN" libm::sin;
    /// Cosine of an angle in radians.
    Cos = "COS" libm::cos;
    /// Tangent of an angle in radians.
    Tan = "TAN" libm::tan;
    /// Angle in radians whose sine is given.
    Asin = "ASIN" libm::asin;
    /// Angle in radians whose cosine is given.
    Acos = "ACOS" libm::acos;
    /// Angle in radians whose tangent is given.
    Atan = "ATAN" libm::atan;
    /// Logarithm to the base of 10.
    Log = "LOG" libm::log10;
    /// Natural logarithm.
    Ln = "LN" libm::log;
    /// Power of Euler's number.
    Exp = "EXP" libm::exp;
    /// Square root.
    Sqrt = "SQRT" libm::sqrt;
    /// Value without its sign.
    Abs = "ABS" libm::fabs;
    /// Value without its fraction.
    Int = "INT" libm::trunc;
    /// Nearest whole number; halves go away from zero.
    Round = "ROUND" libm::round;
    /// -1, 0 or 1.
    Sign = "SIGN" sign;
    /// Radians to degrees.
    Deg = "DEG" f64::to_degrees;
    /// Degrees to radians.
    Rad = "RAD" f64::to_radians;
}

fn sign(x: f64) -> f64 {
    f64::from(i8::from(x > 0.0) - i8::from(x < 0.0))
}

impl Function {
    /// The function with this name, in any case.
    pub fn find(name: &str) -> Option<Self> {
        Self::ALL.iter().copied().find(|function| function.name().eq_ignore_ascii_case(name))
    }
}

impl BinaryOperator {
    /// Its value; not a finite number where it has none.
    pub fn compute(self, left: f64, right: f64) -> f64 {
        match self {
            Self::Add => left + right,
            Self::Subtract => left - right,
            Self::Multiply => left * right,
            Self::Divide => left / right,
            Self::Power => libm::pow(left, right),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn functions_compute_what_a_pocket_calculator_does() {
        use std::f64::consts::{E, FRAC_PI_2, FRAC_PI_4, PI};
        for (name, x, expected) in [
            ("sin", FRAC_PI_2, 1.0),
            ("Cos", PI, -1.0),
            ("TAN", FRAC_PI_4, 1.0),
            ("ASIN", 1.0, FRAC_PI_2),
            ("ACOS", 0.0, FRAC_PI_2),
            ("ATAN", 1.0, FRAC_PI_4),
            ("LOG", 1000.0, 3.0),
            ("LN", E, 1.0),
            ("EXP", 1.0, E),
            ("SQRT", 144.0, 12.0),
            ("ABS", -2.5, 2.5),
            ("INT", -2.9, -2.0),
            ("ROUND", 2.5, 3.0),
            ("ROUND", -2.5, -3.0),
            ("SIGN", -0.1, -1.0),
            ("SIGN", 0.0, 0.0),
            ("DEG", PI, 180.0),
            ("RAD", 90.0, FRAC_PI_2),
        ] {
            let value = Function::find(name).unwrap().compute(x);
            assert!((value - expected).abs() < 1e-12, "{name}({x}) is {value}");
        }
        assert_eq!(Function::find("SINH"), None);
        assert!(Function::Ln.compute(-1.0).is_nan());
    }
}
