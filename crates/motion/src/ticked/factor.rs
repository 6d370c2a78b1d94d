//! The proportionality factor with which a TMC429 decides when to brake.
//!
//! Stopping from a speed v takes v² / (2048 p) microsteps, with
//!
//! ```text
//! p = a_max / (128 * 2^(ramp_div - pulse_div))
//! ```
//!
//! The chip does not calculate p. A firmware has to tell it, as p' = pmul / 2^(3 + pdiv), and again
//! whenever the acceleration or one of the divisors changes. A p' above p brakes too late.
//!
//! # Readings
//!
//! - The data sheet recommends p' about 5 % below p. The vendor's firmware aims at 0.988 p; so do we.
//! - The vendor's firmware calculates in single precision. The exact quotient, rounded down, gives the
//!   same for all settings: it is a multiple of 1/2000, which single precision tells from the whole
//!   number above it.
//! - Of several pairs the last one, with the greatest `pdiv`, would count. There is never a second one.

/// Largest `pdiv` that is tried.
const PDIV_MAX: u32 = 13;

/// p' as the chip stores it: `pmul / 2^(3 + pdiv)`.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct BrakingFactor {
    /// 128..=255, that is with bit 7 of the register set.
    pub pmul: u8,
    /// 0..=15; 0..=13 are specified.
    pub pdiv: u8,
}

impl BrakingFactor {
    /// What the vendor's firmware writes where no pair fits: 255 into both fields, of which the chip
    /// keeps four bits of `pdiv`. An axis with this factor brakes far too early.
    pub const UNFIT: Self = Self { pmul: 255, pdiv: 15 };
}

impl Default for BrakingFactor {
    /// What a chip has after power-up: all bits 0 but the one that is always set.
    fn default() -> Self {
        Self { pmul: 128, pdiv: 0 }
    }
}

/// The factor for an acceleration (0..=2047) and divisors (0..=13), 0 to 2 % below the ideal one.
///
/// None if the acceleration is 0 or does not fit the divisors: such an axis cannot reach its target
/// without creeping or swinging about it.
pub fn braking_factor(a_max: u32, ramp_div: u32, pulse_div: u32) -> Option<BrakingFactor> {
    // 0.988 p * 2^(3 + pdiv) = a_max * 247 * 2^(pulse_div + pdiv) / (4000 * 2^ramp_div)
    let divisor = 4000u64.checked_shl(ramp_div).filter(|_| ramp_div < 32)?;
    let scaled = u64::from(a_max.min(0xFFFF)) * 247;
    (0..=PDIV_MAX).rev().find_map(|pdiv| {
        let pmul = (scaled << (pulse_div.min(15) + pdiv)) / divisor;
        let pmul = u8::try_from(pmul).ok().filter(|pmul| *pmul >= 128)?;
        Some(BrakingFactor { pmul, pdiv: pdiv as u8 })
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn pair(a_max: u32, ramp_div: u32, pulse_div: u32) -> Option<(u8, u8)> {
        braking_factor(a_max, ramp_div, pulse_div).map(|factor| (factor.pmul, factor.pdiv))
    }

    #[test]
    fn the_examples_of_the_vendors_firmware_come_out() {
        assert_eq!(pair(500, 3, 2), Some((247, 4)));
        assert_eq!(pair(100, 7, 5), Some((197, 7)));
        assert_eq!(pair(2047, 0, 0), Some((252, 1)));
        assert_eq!(pair(1, 3, 2), Some((252, 13)));
    }

    #[test]
    fn the_calculation_in_single_precision_gives_the_same_for_all_settings() {
        for (ramp_div, pulse_div) in (0..14).flat_map(|r| (0..14).map(move |p| (r, p))) {
            for a_max in 0..=2047u32 {
                let ratio = 2f32.powi(ramp_div - pulse_div);
                let reduced = (f64::from(a_max as f32 / (128.0 * ratio)) * 0.988) as f32;
                let vendor = (0..14u8).rev().find_map(|pdiv| {
                    let pmul = (f64::from(reduced) * 8.0 * 2f64.powi(pdiv.into())) as i64;
                    (128..=255).contains(&pmul).then_some((pmul as u8, pdiv))
                });
                assert_eq!(pair(a_max, ramp_div as u32, pulse_div as u32), vendor);
            }
        }
    }

    #[test]
    fn a_pair_exists_where_its_bits_reach_and_is_1_to_2_percent_low() {
        // 128 / 2^16 <= 0.988 p < 256 / 2^3. The data sheet's limits for a_max, 2^(D - 1) and
        // 2^(D + 12) - 1 with D = ramp_div - pulse_div, lie within.
        for (ramp_div, pulse_div) in (0..14).flat_map(|r| (0..14).map(move |p| (r, p))) {
            let lower = 2f64.powi(ramp_div - pulse_div - 2) / 0.988;
            let upper = 2f64.powi(ramp_div - pulse_div + 12) / 0.988;
            for a_max in 0..=2047u32 {
                let a = f64::from(a_max);
                let factor = braking_factor(a_max, ramp_div as u32, pulse_div as u32);
                assert_eq!(factor.is_some(), lower <= a && a < upper, "{a_max} {ramp_div}");
                if let Some(BrakingFactor { pmul, pdiv }) = factor {
                    let p = a / 128.0 * 2f64.powi(pulse_div - ramp_div);
                    let quality = f64::from(pmul) / 2f64.powi(3 + i32::from(pdiv)) / p;
                    assert!((0.98..=0.988).contains(&quality), "{a_max} {ramp_div}: {quality}");
                }
            }
        }
    }

    #[test]
    fn any_number_has_an_answer() {
        for value in [0, 1, 13, 14, 31, 32, 63, 64, 2047, 2048, u32::MAX] {
            let _ = braking_factor(value, value, value);
            let _ = braking_factor(u32::MAX, value, 0);
            let _ = braking_factor(u32::MAX, 0, value);
        }
    }
}
