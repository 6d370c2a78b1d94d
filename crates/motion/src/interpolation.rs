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

/// The most axes that move together.
pub const MAX_AXES: usize = 8;

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

    fn down(self, distance: u32) -> u32 {
        (self.quantity * u64::from(distance)).checked_div(self.distance).unwrap_or(0) as u32
    }

    fn up(self, distance: u32) -> u32 {
        let product = self.quantity * u64::from(distance);
        if self.distance == 0 { 0 } else { product.div_ceil(self.distance) as u32 }
    }
}

/// The axes of an interpolated move: how far each has to go, and its own limits.
#[derive(Clone, Copy, Debug, Default)]
pub struct Axes {
    axes: [(u32, Limits); MAX_AXES],
    count: usize,
}

impl Axes {
    /// Adds an axis that has `distance` microsteps to go. One that has none limits nobody; one beyond
    /// [`MAX_AXES`] is left out.
    pub fn add(&mut self, distance: u32, limits: Limits) {
        if let Some(place) = self.axes.get_mut(self.count).filter(|_| distance != 0) {
            // Without V1 the upper limits hold from standstill on.
            let Limits { v1, a_max, d_max, .. } = limits;
            let limits = if v1 == 0 { Limits { a1: a_max, d1: d_max, ..limits } } else { limits };
            *place = (distance, limits);
            self.count += 1;
        }
    }

    /// The fastest common profile that keeps every axis within its limits at every speed.
    pub fn profile(&self) -> Profile {
        let axes = || self.axes.iter().take(self.count);
        let longest = axes().map(|&(distance, _)| distance).max().unwrap_or(0);
        // The common V1 is that of one of the axes, or none.
        let candidates = axes().map(|&(distance, limits)| PerMicrostep::new(limits.v1, distance));
        let none = self.with_v1(PerMicrostep::new(0, 1), longest);
        candidates.map(|v1| self.with_v1(v1, longest)).fold(none, |best, profile| {
            let time = |profile: &Profile| duration(longest, profile.reference());
            if time(&profile) < time(&best) { profile } else { best }
        })
    }

    /// The fastest profile with this common V1.
    fn with_v1(&self, v1: PerMicrostep, longest: u32) -> Profile {
        let mut profile = Profile { v1, longest, ..Profile::UNLIMITED };
        for &(distance, limits) in self.axes.iter().take(self.count) {
            let Limits { v_max, a_max, d_max, a1, d1, .. } = limits;
            let own_v1 = PerMicrostep::new(limits.v1, distance);
            profile.v_max = profile.v_max.min(v_max, distance);
            // Below the common V1 an axis is below its own, and may be above it: then both count.
            let (low_a, low_d) =
                if own_v1.is_below(v1) { (a1.min(a_max), d1.min(d_max)) } else { (a1, d1) };
            let (high_a, high_d) =
                if v1.is_below(own_v1) { (a1.min(a_max), d1.min(d_max)) } else { (a_max, d_max) };
            profile.a1 = profile.a1.min(low_a, distance);
            profile.d1 = profile.d1.min(low_d, distance);
            profile.a_max = profile.a_max.min(high_a, distance);
            profile.d_max = profile.d_max.min(high_d, distance);
        }
        profile
    }
}

/// What the axes of an interpolated move have in common: limits per microstep of distance.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Profile {
    v_max: PerMicrostep,
    a_max: PerMicrostep,
    d_max: PerMicrostep,
    v1: PerMicrostep,
    a1: PerMicrostep,
    d1: PerMicrostep,
    longest: u32,
}

impl Profile {
    const UNLIMITED: Self = Self {
        v_max: PerMicrostep::UNKNOWN,
        a_max: PerMicrostep::UNKNOWN,
        d_max: PerMicrostep::UNKNOWN,
        v1: PerMicrostep::UNKNOWN,
        a1: PerMicrostep::UNKNOWN,
        d1: PerMicrostep::UNKNOWN,
        longest: 0,
    };

    /// The limits of the axis with the longest way: the one whose registers are finest.
    fn reference(&self) -> Limits {
        Limits {
            v_max: self.v_max.down(self.longest),
            a_max: self.a_max.down(self.longest).max(1),
            d_max: self.d_max.down(self.longest).max(1),
            v1: self.v1.up(self.longest),
            a1: self.a1.down(self.longest).max(1),
            d1: self.d1.down(self.longest).max(1),
        }
    }

    /// The limits for an axis that has `distance` microsteps to go; never above its own.
    pub fn for_distance(&self, distance: u32) -> Limits {
        let reference = self.reference();
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
        let mut axes = Axes::default();
        for &distance in distances {
            axes.add(distance, FACTORY);
        }
        let profile = axes.profile();
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

    /// Acceleration and deceleration that hold at a speed.
    fn at(limits: Limits, speed: u32) -> (u32, u32) {
        let Limits { a_max, d_max, v1, a1, d1, .. } = limits;
        if speed < v1 { (a1, d1) } else { (a_max, d_max) }
    }

    #[test]
    fn no_axis_exceeds_its_own_limits_at_any_speed() {
        let slow = Limits { v_max: 1000, a_max: 50, d_max: 60, v1: 500, a1: 20, d1: 30 };
        let steep = Limits { v_max: 90_000, a_max: 100, d_max: 90, v1: 5000, a1: 400, d1: 300 };
        let plain = Limits { v_max: 70_000, a_max: 300, d_max: 200, v1: 0, a1: 1, d1: 1 };
        for all in [
            &[(512_000, FACTORY), (100_000, slow)][..],
            &[(512_000, FACTORY), (500_000, steep), (3_000, slow)],
            &[(300_000, plain), (299_000, steep), (100_000, FACTORY), (9_000, FACTORY)],
        ] {
            let mut axes = Axes::default();
            all.iter().for_each(|&(distance, limits)| axes.add(distance, limits));
            let profile = axes.profile();
            for &(distance, own) in all {
                let own = if own.v1 == 0 { Limits { a1: 300, d1: 200, ..own } } else { own };
                let limits = profile.for_distance(distance);
                assert!(limits.v_max <= own.v_max, "{limits:?}");
                for speed in (0..limits.v_max).step_by(1 + limits.v_max as usize / 1000) {
                    let ((a, d), (own_a, own_d)) = (at(limits, speed), at(own, speed));
                    // A speed between the exact V1 and the register next to it counts as either.
                    let near = speed.abs_diff(own.v1) <= 1 + own.v1 / 1000;
                    assert!(near || a <= own_a && d <= own_d, "{speed}: {limits:?} and {own:?}");
                }
            }
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
        // Braking four times as hard as accelerating, up to the full speed and short of it.
        let uneven = Limits { v_max: 53687, a_max: 400, d_max: 1600, v1: 0, a1: 1, d1: 1 };
        let (a, d) = (400.0 * 116.41532, 1600.0 * 116.41532);
        let full = 512_000.0 / v + v / (2.0 * a) + v / (2.0 * d);
        assert!((seconds(512_000, uneven) - full).abs() < 1e-3, "{full}");
        let peak = (2.0 * 5_000.0 / (1.0 / a + 1.0 / d)).sqrt();
        let triangle = peak / a + peak / d;
        assert!((seconds(5_000, uneven) - triangle).abs() < 1e-3, "{triangle}");
        let trapezoid = Limits { v1: 0, ..FACTORY };
        assert!((seconds(512_000, trapezoid) - (10.0 + v / 51106.3)).abs() < 1e-3);
    }
}
