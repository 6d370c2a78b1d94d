//! Limits under which several axes start together and arrive together.
//!
//! Each axis gets speeds and accelerations in proportion to its distance, so that on the way the axes
//! stay on a straight line, each within its own limits. Registers are whole numbers; the axis with
//! the longest way takes the proportions rounded down, all others the speed with which their time
//! comes nearest to its time.

/// Limits of a six-point ramp in the ramp generator's units.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Limits {
    /// Largest speed.
    pub v_max: u32,
    /// Acceleration above `v1`.
    pub a_max: u32,
    /// Deceleration above `v1`.
    pub d_max: u32,
    /// Speed at which the accelerations change; 0: `a_max` and `d_max` hold from standstill on.
    pub v1: u32,
    /// Acceleration below `v1`.
    pub a1: u32,
    /// Deceleration below `v1`.
    pub d1: u32,
}

/// A quantity per microstep of distance, as a fraction. A distance of 0 is no limit yet.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
struct PerMicrostep {
    quantity: u64,
    distance: u64,
}

impl PerMicrostep {
    const UNKNOWN: Self = Self { quantity: 0, distance: 0 };

    fn new(quantity: u32, distance: u32) -> Self {
        Self { quantity: u64::from(quantity), distance: u64::from(distance) }
    }

    fn is_below(self, other: Self) -> bool {
        self.quantity * other.distance < other.quantity * self.distance
    }

    fn min(self, quantity: u32, distance: u32) -> Self {
        let other = Self::new(quantity, distance);
        if self.distance == 0 || other.is_below(self) { other } else { self }
    }

    fn max(self, quantity: u32, distance: u32) -> Self {
        let other = Self::new(quantity, distance);
        if self.distance == 0 || self.is_below(other) { other } else { self }
    }

    fn down(self, distance: u32) -> u32 {
        (self.quantity * u64::from(distance)).checked_div(self.distance).unwrap_or(0) as u32
    }

    fn up(self, distance: u32) -> u32 {
        let product = self.quantity * u64::from(distance);
        if self.distance == 0 { 0 } else { product.div_ceil(self.distance) as u32 }
    }
}

/// What the axes of an interpolated move have in common: limits per microstep of distance.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Profile {
    v_max: PerMicrostep,
    a_max: PerMicrostep,
    d_max: PerMicrostep,
    /// The last of the axes to pass its V1 decides, so that none accelerates too early.
    v1: PerMicrostep,
    a1: PerMicrostep,
    d1: PerMicrostep,
    longest: u32,
}

impl Profile {
    /// The profile before any axis has limited it.
    pub const UNLIMITED: Self = Self {
        v_max: PerMicrostep::UNKNOWN,
        a_max: PerMicrostep::UNKNOWN,
        d_max: PerMicrostep::UNKNOWN,
        v1: PerMicrostep::UNKNOWN,
        a1: PerMicrostep::UNKNOWN,
        d1: PerMicrostep::UNKNOWN,
        longest: 0,
    };

    /// The profile with one axis more, which has `distance` microsteps to go.
    #[must_use]
    pub fn limited(self, distance: u32, limits: Limits) -> Self {
        if distance == 0 {
            return self;
        }
        let Limits { v_max, a_max, d_max, v1, a1, d1 } = limits;
        // Below the common V1 an axis may be above its own: there the smaller limit holds.
        let (a1, d1) = if v1 == 0 { (a_max, d_max) } else { (a1.min(a_max), d1.min(d_max)) };
        Self {
            v_max: self.v_max.min(v_max, distance),
            a_max: self.a_max.min(a_max, distance),
            d_max: self.d_max.min(d_max, distance),
            v1: self.v1.max(v1, distance),
            a1: self.a1.min(a1, distance),
            d1: self.d1.min(d1, distance),
            longest: self.longest.max(distance),
        }
    }

    /// The limits for an axis that has `distance` microsteps to go; never above its own.
    pub fn for_distance(&self, distance: u32) -> Limits {
        let reference = Limits {
            v_max: self.v_max.down(self.longest),
            a_max: self.a_max.down(self.longest).max(1),
            d_max: self.d_max.down(self.longest).max(1),
            v1: self.v1.up(self.longest),
            a1: self.a1.down(self.longest).max(1),
            d1: self.d1.down(self.longest).max(1),
        };
        if distance >= self.longest || distance == 0 || reference.v_max == 0 {
            return reference;
        }
        let time = duration(self.longest, reference);
        let scaled = Limits {
            v_max: self.v_max.up(distance).max(1),
            a_max: self.a_max.up(distance).max(1),
            d_max: self.d_max.up(distance).max(1),
            v1: self.v1.up(distance),
            a1: self.a1.up(distance).max(1),
            d1: self.d1.up(distance).max(1),
        };
        let with = |v_max| Limits { v_max, ..scaled };
        // The time falls with the speed: find the slowest that is not late, and its neighbour.
        let (mut low, mut high) = (1, scaled.v_max);
        while low < high {
            let middle = low + (high - low) / 2;
            if duration(distance, with(middle)) <= time {
                high = middle;
            } else {
                low = middle + 1;
            }
        }
        let error = |v_max| duration(distance, with(v_max)).abs_diff(time);
        if low > 1 && error(low - 1) < error(low) { with(low - 1) } else { with(low) }
    }
}

/// Clocks that a move from rest to rest takes.
fn duration(distance: u32, limits: Limits) -> u128 {
    let Limits { v_max, a_max, d_max, v1, a1, d1 } = limits;
    // A ramp up and down to v covers v²/2^8 · (1/a + 1/d) microsteps in v · 2^17 · (1/a + 1/d) clocks.
    let distance = u128::from(distance) << (8 + INVERSE);
    let (lower, upper) = (inverse_sum(a1, d1), inverse_sum(a_max, d_max));
    let (v, v1) = (u128::from(v_max.max(1)), u128::from(v1.min(v_max)));
    let to_v1 = v1 * v1 * lower;
    let peak = if distance <= to_v1 {
        (distance / lower).isqrt()
    } else {
        (v1 * v1 + (distance - to_v1) / upper).isqrt().min(v)
    };
    let below = peak.min(v1);
    let ramps = below * below * lower + (peak * peak - below * below) * upper;
    let clocks = below * lower + (peak - below) * upper;
    let cruise = (distance.saturating_sub(ramps) << 16) / peak.max(1);
    ((clocks << 17) + cruise) >> INVERSE
}

/// Fraction bits of [`inverse_sum`].
const INVERSE: u32 = 40;

/// 1/a + 1/d.
fn inverse_sum(a: u32, d: u32) -> u128 {
    let (a, d) = (u128::from(a.max(1)), u128::from(d.max(1)));
    (((a + d) << INVERSE) / (a * d)).max(1)
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::vec::Vec;

    /// The factory settings of a TMC5160 module.
    const FACTORY: Limits =
        Limits { v_max: 53687, a_max: 439, d_max: 439, v1: 26843, a1: 220, d1: 220 };

    fn limits(distances: &[u32]) -> Vec<Limits> {
        let profile = distances
            .iter()
            .fold(Profile::UNLIMITED, |profile, &distance| profile.limited(distance, FACTORY));
        distances.iter().map(|&distance| profile.for_distance(distance)).collect()
    }

    #[test]
    fn a_single_axis_keeps_its_limits() {
        assert_eq!(limits(&[512_000]), [FACTORY]);
    }

    #[test]
    fn half_the_way_is_gone_with_half_the_speed() {
        let limits = limits(&[512_000, 256_000]);
        assert_eq!(limits[0], FACTORY);
        assert!(limits[1].v_max.abs_diff(53687 / 2) < 30, "{limits:?}");
        assert_eq!((limits[1].a_max, limits[1].v1, limits[1].a1), (220, 13422, 110));
    }

    #[test]
    fn all_axes_take_the_same_time_within_a_thousandth() {
        for distances in [
            &[512_000, 300_000, 51_200, 7_000][..],
            &[110_000, 50_000, 15_000],
            &[100_000, 99_999, 12_345],
            &[5_000, 4_000, 3_000],
        ] {
            let limits = limits(distances);
            let time = duration(distances[0], limits[0]);
            for (&distance, &limits) in distances.iter().zip(&limits) {
                let other = duration(distance, limits);
                assert!(other.abs_diff(time) * 1000 <= time, "{distance}: {other} and {time}");
            }
        }
    }

    #[test]
    fn no_axis_exceeds_its_own_limits() {
        let slow = Limits { v_max: 1000, a_max: 50, d_max: 60, v1: 500, a1: 20, d1: 30 };
        let profile = Profile::UNLIMITED.limited(512_000, FACTORY).limited(100_000, slow);
        for (distance, own) in [(512_000, FACTORY), (100_000, slow)] {
            let limits = profile.for_distance(distance);
            assert!(limits.v_max <= own.v_max && limits.v1 >= own.v1.min(limits.v_max));
            assert!(limits.a_max <= own.a_max && limits.d_max <= own.d_max, "{limits:?}");
            assert!(limits.a1 <= own.a1 && limits.d1 <= own.d1, "{limits:?}");
        }
    }

    #[test]
    fn the_time_of_a_move_agrees_with_the_formulas() {
        let seconds = |distance, limits| duration(distance, limits) as f64 / 16e6;
        // The factory settings in pps and pps²: 51200, 51107 above and 25612 below 25600.
        let (v, a, v1, a1) = (51200.0, 51106.3, 25599.5, 25611.4);
        let ramp_time: f64 = v1 / a1 + (v - v1) / a;
        let ramp_way: f64 = v1 * v1 / (2.0 * a1) + (v * v - v1 * v1) / (2.0 * a);
        let long = 2.0 * ramp_time + (512_000.0 - 2.0 * ramp_way) / v;
        assert!((seconds(512_000, FACTORY) - long).abs() < 1e-3, "{long}");
        // A short move, all below V1: 2 · √(way / a1).
        let short = 2.0 * (5_000.0 / a1).sqrt();
        assert!((seconds(5_000, FACTORY) - short).abs() < 1e-3, "{short}");
        let trapezoid = Limits { v1: 0, ..FACTORY };
        assert!((seconds(512_000, trapezoid) - (10.0 + v / a)).abs() < 1e-3);
    }
}
