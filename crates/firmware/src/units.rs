//! Speeds and accelerations: microsteps per second against the chip's own units.
//!
//! With a 16 MHz clock a speed register counts microsteps per 2^24 clocks, an acceleration register
//! grows that by A / 2^17 per clock (TMC5160 datasheet 12.1). The directions of rounding are those of
//! the vendor's open firmware: towards zero on the way in, away from zero on the way out, so that a
//! speed reads back as it was written.

/// Clock of the motion chips in Hz.
const CLOCK: i64 = 16_000_000;

/// pps to register: v · 2^24 / clock, towards zero.
pub(crate) const fn speed_to_register(pps: i32) -> i64 {
    pps as i64 * (1 << 24) / CLOCK
}

/// Register to pps: V · clock / 2^24, away from zero.
pub(crate) const fn speed_from_register(register: i64) -> i32 {
    away_from_zero(register as i128 * CLOCK as i128, 1 << 24)
}

/// pps² to register: a · 2^41 / clock², towards zero.
pub(crate) const fn acceleration_to_register(pps2: i32) -> i64 {
    ((pps2 as i128 * (1 << 41)) / (CLOCK as i128 * CLOCK as i128)) as i64
}

/// Register to pps²: A · clock² / 2^41, away from zero.
pub(crate) const fn acceleration_from_register(register: i64) -> i32 {
    away_from_zero(register as i128 * CLOCK as i128 * CLOCK as i128, 1 << 41)
}

/// pps to the clocks between two microsteps, 20 bit; 0 pps is the longest time.
pub(crate) const fn threshold_to_register(pps: i32) -> u32 {
    const LONGEST: i64 = (1 << 20) - 1;
    if pps <= 0 {
        return LONGEST as u32;
    }
    let clocks = CLOCK / pps as i64;
    (if clocks < LONGEST { clocks } else { LONGEST }) as u32
}

/// Clocks between two microsteps to pps; none at all is the largest speed there is.
pub(crate) const fn threshold_from_register(register: u32) -> i32 {
    if register == 0 { 16_777_215 } else { (CLOCK / register as i64) as i32 }
}

const fn away_from_zero(numerator: i128, denominator: i128) -> i32 {
    let quotient = numerator / denominator;
    let rounded =
        if numerator % denominator == 0 { quotient } else { quotient + numerator.signum() };
    if rounded > i32::MAX as i128 {
        i32::MAX
    } else if rounded < i32::MIN as i128 {
        i32::MIN
    } else {
        rounded as i32
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn speeds_convert_as_in_the_vendors_firmware() {
        for (pps, register) in [(1, 1), (1000, 1048), (51200, 53687), (100_000, 104_857)] {
            assert_eq!(speed_to_register(pps), register);
            assert_eq!(speed_from_register(register), pps);
            assert_eq!(speed_to_register(-pps), -register);
            assert_eq!(speed_from_register(-register), -pps);
        }
        assert_eq!(speed_to_register(7_999_774), 8_388_371);
        assert_eq!(speed_from_register(8_388_371), 7_999_774);
    }

    #[test]
    fn accelerations_convert_as_in_the_vendors_firmware() {
        for (pps2, register, back) in
            [(51200, 439, 51107), (1000, 8, 932), (100_000, 858, 99885), (116, 0, 0)]
        {
            assert_eq!(acceleration_to_register(pps2), register);
            assert_eq!(acceleration_from_register(register), back);
        }
        assert_eq!(acceleration_from_register(65535), 7_629_279);
    }

    #[test]
    fn thresholds_are_times_between_microsteps() {
        assert_eq!(threshold_to_register(5000), 3200);
        assert_eq!(threshold_from_register(3200), 5000);
        assert_eq!(threshold_to_register(51200), 312);
        assert_eq!(threshold_from_register(312), 51282);
        assert_eq!(threshold_to_register(0), 1_048_575);
        assert_eq!(threshold_to_register(16_777_215), 0);
        assert_eq!(threshold_from_register(0), 16_777_215);
    }
}
