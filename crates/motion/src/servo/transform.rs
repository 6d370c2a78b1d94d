//! Between the three phases, the two axes of the stator and the two axes of the rotor.
//!
//! The stator's axis alpha lies along phase A, beta 90° before it in the sense of rotation. The rotor's axis d
//! lies along its flux, q before it. All transforms keep amplitudes.

use super::saturated;

/// Bits of the fraction of sine and cosine.
const SINE_SHIFT: u32 = 15;
/// Steps of the table per turn, and the bits of an angle in between.
const STEPS: usize = 1024;
const STEP_SHIFT: u32 = 6;
/// Sine at each step, with a quarter turn more for the cosine and one step for the interpolation.
static SINE: [i32; STEPS + STEPS / 4 + 1] = sine_table();

/// 1 / sqrt 3 in 2^-30.
const INVERSE_ROOT_3: i64 = 619_925_131;

/// Fraction of the duties while they are calculated.
const DUTY_SHIFT: u32 = 24;
const FULL_DUTY: i64 = 65_535 << DUTY_SHIFT;
/// Duty per voltage along alpha: 65535 / (32767 sqrt 3), so that a line voltage of sqrt 3 * 32767 is the supply.
const DUTY_PER_ALPHA: i64 = 19_372_956;
/// The same times sqrt 3 / 2: 65535 / (2 * 32767).
const DUTY_PER_BETA: i64 = 16_777_472;

/// Sine of `step` / 1024 turn in 1/32768, by its power series in integers of 2^-60.
const fn sine_at(step: usize) -> i32 {
    const ONE: i128 = 1 << 60;
    const QUARTER_TURN: i128 = 1_811_004_864_519_280_710;
    let quarter = STEPS / 4;
    let within = step % quarter;
    let way = if (step / quarter).is_multiple_of(2) { within } else { quarter - within };
    let angle = QUARTER_TURN * way as i128 / quarter as i128;
    let square = angle * angle / ONE;
    let (mut term, mut sum, mut n) = (angle, 0, 1);
    while term != 0 {
        sum += term;
        term = -(term * square / ONE) / ((n + 1) * (n + 2));
        n += 2;
    }
    let unit = ONE >> SINE_SHIFT;
    let rounded = ((sum + unit / 2) / unit) as i32;
    if (step / (2 * quarter)).is_multiple_of(2) { rounded } else { -rounded }
}

const fn sine_table() -> [i32; STEPS + STEPS / 4 + 1] {
    let mut table = [0; STEPS + STEPS / 4 + 1];
    let mut step = 0;
    while step < table.len() {
        table[step] = sine_at(step);
        step += 1;
    }
    table
}

/// Sine and cosine of an angle in 1/65536 turn. Both are in 1/32768 and off by less than 1/10000.
#[inline]
pub fn sin_cos(angle: u16) -> (i32, i32) {
    const QUARTER: usize = STEPS / 4;
    // At most STEPS - 1, so that no index below is outside.
    let step = usize::from(angle >> STEP_SHIFT);
    let part = i32::from(angle & ((1 << STEP_SHIFT) - 1));
    let between =
        |low: i32, high: i32| low + (((high - low) * part + (1 << (STEP_SHIFT - 1))) >> STEP_SHIFT);
    (between(SINE[step], SINE[step + 1]), between(SINE[step + QUARTER], SINE[step + QUARTER + 1]))
}

/// The nearest integer to a sum of products with a sine, within 32 bits.
#[inline]
const fn without_fraction(value: i64) -> i32 {
    saturated((value + (1 << (SINE_SHIFT - 1))) >> SINE_SHIFT)
}

/// A vector in the axes of the stator, in any unit.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct AlphaBeta {
    /// The part along phase A.
    pub alpha: i32,
    /// The part 90° before it.
    pub beta: i32,
}

/// A vector in the axes of the rotor, in any unit.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Dq {
    /// The part along the rotor's flux.
    pub d: i32,
    /// The part 90° before it, which gives torque.
    pub q: i32,
}

/// The vector of three phases whose sum is zero, from two of them. Its length is the amplitude of the phases.
#[inline]
pub fn clarke(a: i32, b: i32) -> AlphaBeta {
    let across = i64::from(a) + 2 * i64::from(b);
    AlphaBeta { alpha: a, beta: saturated((across * INVERSE_ROOT_3 + (1 << 29)) >> 30) }
}

impl AlphaBeta {
    /// The same vector seen from the rotor at this electrical angle in 1/65536 turn. A part beyond 32 bits
    /// saturates.
    #[inline]
    pub fn park(self, angle: u16) -> Dq {
        let (sin, cos) = sin_cos(angle);
        let (sin, cos) = (i64::from(sin), i64::from(cos));
        let (alpha, beta) = (i64::from(self.alpha), i64::from(self.beta));
        Dq {
            d: without_fraction(alpha * cos + beta * sin),
            q: without_fraction(beta * cos - alpha * sin),
        }
    }
}

impl Dq {
    /// The same vector seen from the stator, the rotor being at this electrical angle in 1/65536 turn. A part
    /// beyond 32 bits saturates.
    #[inline]
    pub fn unpark(self, angle: u16) -> AlphaBeta {
        let (sin, cos) = sin_cos(angle);
        let (sin, cos) = (i64::from(sin), i64::from(cos));
        let (d, q) = (i64::from(self.d), i64::from(self.q));
        AlphaBeta {
            alpha: without_fraction(d * cos - q * sin),
            beta: without_fraction(d * sin + q * cos),
        }
    }

    /// The vector within a circle of this radius: `d` gets what it asks for as far as possible, `q` what
    /// remains. A negative radius acts as 0.
    #[inline]
    pub fn limited(self, limit: i32) -> Self {
        let radius = limit.max(0).unsigned_abs();
        let square = |value: u32| u64::from(value) * u64::from(value);
        let asked = square(self.d.unsigned_abs()) + square(self.q.unsigned_abs());
        if asked <= square(radius) {
            return self;
        }
        let limit = limit.max(0);
        let d = self.d.clamp(-limit, limit);
        let rest = square(radius) - square(d.unsigned_abs());
        // The root of 32 bits is the faster one, and enough for all that are voltages.
        let root = match u32::try_from(rest) {
            Ok(rest) => rest.isqrt() as i32,
            // Not above the radius, which has 31 bits.
            Err(_) => rest.isqrt() as i32,
        };
        Self { d, q: self.q.clamp(-root, root) }
    }
}

/// Duties of the three legs in 1/65535 that give the phases these voltages, in 1/32767 of the largest amplitude
/// that a turning vector can have: the supply divided by sqrt 3.
///
/// The star point is put so that the legs are equally far from supply and ground, as space vector modulation
/// does with two equal zero vectors. A vector outside the hexagon of what is possible loses what is beyond.
#[inline]
pub fn space_vector(voltage: AlphaBeta) -> [u16; 3] {
    let along = i64::from(voltage.alpha) * DUTY_PER_ALPHA;
    let across = i64::from(voltage.beta) * DUTY_PER_BETA;
    let (a, b, c) = (along, across - along / 2, -across - along / 2);
    let extremes = a.max(b).max(c) + a.min(b).min(c);
    let common = (FULL_DUTY - extremes) / 2 + (1 << (DUTY_SHIFT - 1));
    let duty = |phase: i64| ((phase + common) >> DUTY_SHIFT).clamp(0, 65_535) as u16;
    [duty(a), duty(b), duty(c)]
}

#[cfg(test)]
mod tests {
    use super::super::random::Random;
    use super::*;
    use std::f64::consts::{PI, TAU};

    fn radians(angle: u16) -> f64 {
        f64::from(angle) / 65_536.0 * TAU
    }

    #[test]
    fn sine_and_cosine_are_right_at_every_angle() {
        for angle in 0..=u16::MAX {
            let (sin, cos) = sin_cos(angle);
            let exact = radians(angle).sin_cos();
            assert!((f64::from(sin) / 32_768.0 - exact.0).abs() < 5e-5, "sine at {angle}");
            assert!((f64::from(cos) / 32_768.0 - exact.1).abs() < 5e-5, "cosine at {angle}");
        }
        assert_eq!(sin_cos(0), (0, 32_768));
        assert_eq!(sin_cos(0x4000), (32_768, 0));
        assert_eq!(sin_cos(0x8000), (0, -32_768));
        assert_eq!(sin_cos(0xC000), (-32_768, 0));
    }

    #[test]
    fn three_phases_are_a_vector_of_their_amplitude() {
        for angle in (0..=u16::MAX).step_by(97) {
            let phase = |behind: f64| 20_000.0 * (radians(angle) - behind).cos();
            let vector = clarke(phase(0.0).round() as i32, phase(TAU / 3.0).round() as i32);
            let (sin, cos) = radians(angle).sin_cos();
            assert!((f64::from(vector.alpha) - 20_000.0 * cos).abs() <= 1.0);
            assert!((f64::from(vector.beta) - 20_000.0 * sin).abs() <= 2.0);
        }
    }

    #[test]
    fn a_vector_that_turns_with_the_rotor_stands_for_it() {
        for angle in (0..=u16::MAX).step_by(89) {
            let (sin, cos) = (radians(angle) + 0.3).sin_cos();
            let alpha = (30_000.0 * cos).round() as i32;
            let beta = (30_000.0 * sin).round() as i32;
            let seen = AlphaBeta { alpha, beta }.park(angle);
            assert!((f64::from(seen.d) - 30_000.0 * 0.3f64.cos()).abs() <= 3.0, "{angle}");
            assert!((f64::from(seen.q) - 30_000.0 * 0.3f64.sin()).abs() <= 3.0, "{angle}");
            let back = seen.unpark(angle);
            assert!(back.alpha.abs_diff(alpha) <= 4 && back.beta.abs_diff(beta) <= 4, "{angle}");
        }
    }

    #[test]
    fn the_flux_comes_first_within_the_circle() {
        let limited = |d, q, limit| {
            let Dq { d, q } = Dq { d, q }.limited(limit);
            (d, q)
        };
        assert_eq!(limited(3, -4, 5), (3, -4));
        assert_eq!(limited(3, -400, 5), (3, -4));
        assert_eq!(limited(-300, 1, 5), (-5, 0));
        // 13178² = 173659684 is the last square below 32767² - 30000² = 173676289.
        assert_eq!(limited(30_000, 30_000, 32_767), (30_000, 13_178));
        assert_eq!(limited(7, 7, 0), (0, 0));
        assert_eq!(limited(7, 7, -1), (0, 0));
        assert_eq!(limited(i32::MIN, i32::MIN, i32::MAX), (-i32::MAX, 0));
        assert_eq!(limited(0, i32::MIN, i32::MAX), (0, -i32::MAX));
    }

    /// Line voltages in 1/65535 of the supply, which sqrt 3 times an amplitude of 32767 is.
    fn line_voltages(amplitude: f64, angle: f64) -> [f64; 3] {
        let phase = |k: f64| (angle - k * TAU / 3.0).cos() * amplitude / 32_767.0 * 65_535.0;
        let [a, b, c] = [phase(0.0), phase(1.0), phase(2.0)].map(|v| v / 3f64.sqrt());
        [a - b, b - c, c - a]
    }

    #[test]
    fn the_duties_give_the_line_voltages_that_are_asked_for() {
        for amplitude in [0.0, 1.0, 500.0, 16_384.0, 32_767.0] {
            for step in 0..720 {
                let angle = f64::from(step) * PI / 360.0;
                let alpha = (amplitude * angle.cos()).round() as i32;
                let beta = (amplitude * angle.sin()).round() as i32;
                let [a, b, c] = space_vector(AlphaBeta { alpha, beta }).map(f64::from);
                let asked = line_voltages(amplitude, angle);
                for (given, asked) in [a - b, b - c, c - a].into_iter().zip(asked) {
                    assert!((given - asked).abs() < 4.0, "{amplitude} at {angle}: {given} {asked}");
                }
                let centre = a.max(b).max(c) + a.min(b).min(c);
                assert!((centre - 65_535.0).abs() <= 2.0, "off centre at {angle}: {centre}");
            }
        }
    }

    #[test]
    fn any_vector_has_an_answer_within_bounds() {
        let mut random = Random::new(0x7a5f);
        for _ in 0..200_000 {
            let (a, b, angle) = (random.signed(), random.signed(), random.next() as u16);
            let limit = random.signed();
            let vector = clarke(a, b);
            let seen = vector.park(angle);
            let limited = seen.limited(limit);
            let length = f64::from(limited.d).hypot(f64::from(limited.q));
            assert!(length <= f64::from(limit.max(0)) * (1.0 + 1e-12), "{limited:?} {limit}");
            assert!(limited.d.abs() <= seen.d.saturating_abs());
            // As much as possible: one more of q would be outside.
            if limited.q != seen.q {
                let more = (i128::from(limited.q).abs() + 1).pow(2) + i128::from(limited.d).pow(2);
                assert!(more > i128::from(limit.max(0)).pow(2), "{limited:?} {limit}");
            }
            let duties = space_vector(limited.unpark(angle));
            let [low, high] = [duties.iter().min(), duties.iter().max()].map(|d| *d.unwrap());
            // Too much is clipped at both ends alike.
            assert!((i32::from(low) + i32::from(high) - 65_535).abs() <= 2, "{duties:?}");
        }
    }
}
