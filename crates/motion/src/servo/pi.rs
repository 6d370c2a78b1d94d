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
