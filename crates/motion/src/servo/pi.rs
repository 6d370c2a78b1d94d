//! A regulator with a proportional and an integral part.

use super::saturated;

/// Fraction of the integral part.
const INTEGRAL_SHIFT: u32 = 16;
/// Fraction of the proportional part.
const PROPORTIONAL_SHIFT: u32 = 8;

/// How strongly a regulator answers an error.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Gains {
    /// Output per error, in 1/256.
    pub p: i32,
    /// What a call adds to the output per error, in 1/65536. With 0 there is no integral part.
    pub i: i32,
}

/// A regulator: P * error / 256 and the sum of I * error / 65536, within limits.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Pi {
    /// The integral part of the output in 1/65536.
    integral: i64,
    error: i32,
}

impl Pi {
    /// One step of the regulator: the output, rounded, within ±`limit`. A negative limit acts as 0.
    ///
    /// The integral part alone stays within the limit too, and it does not grow further in the direction in
    /// which the output is beyond the limit.
    #[inline]
    pub fn step(&mut self, gains: Gains, target: i32, actual: i32, limit: i32) -> i32 {
        let error = target.saturating_sub(actual);
        self.error = error;
        let limit = i64::from(limit.max(0));
        let bound = limit << INTEGRAL_SHIFT;
        let before = if gains.i == 0 { 0 } else { self.integral.clamp(-bound, bound) };
        let change = i64::from(gains.i) * i64::from(error);
        // Both parts in 1/256. 2^62 and 2^39 at most, so that their sum has its 64 bits.
        let proportional = i64::from(gains.p) * i64::from(error);
        let after = (before + change).clamp(-bound, bound);
        let sum = proportional + (after >> (INTEGRAL_SHIFT - PROPORTIONAL_SHIFT));
        let output = (sum + (1 << (PROPORTIONAL_SHIFT - 1))) >> PROPORTIONAL_SHIFT;
        let winds_up = output > limit && change > 0 || output < -limit && change < 0;
        self.integral = if winds_up { before } else { after };
        output.clamp(-limit, limit) as i32
    }

    /// Target minus actual value at the last step.
    #[inline]
    pub fn error(&self) -> i32 {
        self.error
    }

    /// The sum of errors that gives the integral part with these gains, within 32 bits; 0 without an integral
    /// gain.
    pub fn error_sum(&self, gains: Gains) -> i32 {
        saturated(self.integral.checked_div(i64::from(gains.i)).unwrap_or(0))
    }

    /// Forgets the integral part and the error.
    pub fn reset(&mut self) {
        *self = Self::default();
    }

    /// Puts the integral part to this output, so that a regulator that takes over goes on from there. The next
    /// step brings it within its limit. Without an integral gain there is nothing to put.
    pub fn preset(&mut self, gains: Gains, output: i32) {
        self.integral = if gains.i == 0 { 0 } else { i64::from(output) << INTEGRAL_SHIFT };
    }
}

#[cfg(test)]
mod tests {
    use super::super::random::Random;
    use super::*;

    #[test]
    fn the_proportional_part_is_p_times_the_error_by_256() {
        let mut pi = Pi::default();
        let gains = Gains { p: 512, i: 0 };
        assert_eq!(pi.step(gains, 150, 50, 1_000), 200);
        assert_eq!(pi.error(), 100);
        assert_eq!(pi.step(gains, -50, 50, 1_000), -200);
        assert_eq!(pi.step(gains, 600, 0, 1_000), 1_000);
        assert_eq!(pi.step(gains, -600, 0, 1_000), -1_000);
    }

    #[test]
    fn the_integral_part_is_i_times_the_sum_of_errors_by_65536() {
        let mut pi = Pi::default();
        let gains = Gains { p: 0, i: 1_000 };
        for calls in 1..=500 {
            let exact = f64::from(calls * 7) * 1_000.0 / 65_536.0;
            assert!((f64::from(pi.step(gains, 7, 0, 1_000)) - exact).abs() <= 0.51);
            assert_eq!(pi.error_sum(gains), calls * 7);
        }
        // It remains when the error has gone, and falls with a negative one.
        assert_eq!(pi.step(gains, 0, 0, 1_000), 53);
        for _ in 0..500 {
            pi.step(gains, 0, 7, 1_000);
        }
        assert_eq!(pi.step(gains, 0, 0, 1_000), 0);
        assert_eq!(pi.error_sum(gains), 0);
    }

    #[test]
    fn a_regulator_at_its_limit_comes_back_at_once() {
        let mut pi = Pi::default();
        let gains = Gains { p: 256, i: 65_536 };
        for _ in 0..10_000 {
            assert!(pi.step(gains, 60, 0, 100) <= 100);
        }
        // Nothing is summed up: already the first error would have led beyond the limit.
        assert_eq!(pi.error_sum(gains), 0);
        assert_eq!(pi.step(gains, 30, 0, 100), 60);
        assert_eq!(pi.step(gains, -30, 0, 100), -30);

        let mut slow = Pi::default();
        let gains = Gains { p: 0, i: 6_554 };
        for _ in 0..10_000 {
            slow.step(gains, 60, 0, 100);
        }
        assert_eq!(slow.step(gains, 60, 0, 100), 100);
        // 6 per call: below the limit with the first error of the other sign.
        assert_eq!(slow.step(gains, -60, 0, 100), 94);
    }

    #[test]
    fn a_lower_limit_holds_for_what_was_summed_before() {
        let mut pi = Pi::default();
        let gains = Gains { p: 0, i: 65_536 };
        assert_eq!(pi.step(gains, 800, 0, 1_000), 800);
        assert_eq!(pi.step(gains, 0, 0, 100), 100);
        assert_eq!(pi.step(gains, 0, 0, 1_000), 100);
        assert_eq!(pi.step(gains, 0, 0, -5), 0);
    }

    #[test]
    fn a_regulator_goes_on_from_its_preset() {
        let mut pi = Pi::default();
        let gains = Gains { p: 300, i: 20 };
        pi.preset(gains, 1_234);
        assert_eq!(pi.step(gains, 5, 5, 2_000), 1_234);
        assert_eq!(pi.error_sum(gains), 1_234 * 65_536 / 20);
        pi.preset(gains, -5_000);
        assert_eq!(pi.step(gains, 5, 5, 2_000), -2_000);
        pi.preset(Gains { p: 300, i: 0 }, 1_234);
        assert_eq!(pi.step(Gains { p: 300, i: 0 }, 5, 5, 2_000), 0);
        // What is there when the gain is taken away goes with it.
        pi.preset(gains, 1_234);
        assert_eq!(pi.step(Gains { p: 300, i: 0 }, 5, 5, 2_000), 0);
        pi.step(gains, 1_000, 0, 2_000);
        pi.reset();
        assert_eq!(pi, Pi::default());
    }

    #[test]
    fn any_input_has_an_output_within_its_limit() {
        let mut random = Random::new(0x91);
        let mut pi = Pi::default();
        for _ in 0..300_000 {
            let gains = Gains { p: random.signed(), i: random.signed() };
            let (target, actual, limit) = (random.signed(), random.signed(), random.signed());
            if random.below(50) == 0 {
                pi.preset(gains, random.signed());
            }
            let output = pi.step(gains, target, actual, limit);
            assert!(i64::from(output).abs() <= i64::from(limit.max(0)));
            let integral = i128::from(pi.integral).abs();
            assert!(integral <= i128::from(limit.max(0)) << 16);
            pi.error_sum(gains);
        }
    }
}
