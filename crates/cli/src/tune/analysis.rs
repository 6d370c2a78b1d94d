//! What a step response says of a regulator: numbers from points, nothing else.
//!
//! Rise, overshoot and settling are told of the way from the start to where the value ended, so that they say
//! something of a regulator without an integral part as well, which does not reach its target. How far it is from
//! there is a number of its own.

/// The part of the time at whose end the value counts as final.
const FINAL_PART: f64 = 0.1;

/// A way of less than this part of the step is none.
const LEAST_WAY: f64 = 0.02;

/// Between these parts of its way the value rises.
const RISE: (f64, f64) = (0.1, 0.9);

/// Fewer points say nothing.
const LEAST_POINTS: usize = 5;

/// What was asked for.
#[derive(Clone, Copy, Debug)]
pub(super) struct Step {
    /// The value before the step.
    pub(super) from: f64,
    /// The target.
    pub(super) to: f64,
    /// Half of the band in which the value has settled, as a part of its way.
    pub(super) band: f64,
}

/// Where the value went.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Outcome {
    /// Towards the target.
    Followed,
    /// It ended where it was.
    Unchanged,
    /// Away from the target.
    Reversed,
}

/// A value and when it was there, in seconds after the step.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Moment {
    pub(super) time: f64,
    pub(super) value: f64,
}

/// What came of a step.
#[derive(Clone, Copy, Debug)]
pub(super) struct Response {
    pub(super) outcome: Outcome,
    /// Mean of the last tenth.
    pub(super) end: f64,
    /// The part of the step that was made: 1 is the target.
    pub(super) reached: f64,
    /// Largest distance from `end` within the last tenth.
    pub(super) ripple: f64,
    /// Target less `end`.
    pub(super) error: f64,
    /// The value farthest beyond the target, seen from the start, and when.
    pub(super) peak: Moment,
    /// Seconds from 10 % to 90 % of the way; none if the value did not make it.
    pub(super) rise: Option<f64>,
    /// How many points lie within the rise.
    pub(super) points_of_rise: usize,
    /// How far the peak is beyond `end`, as a part of the way; none for a value that went nowhere.
    pub(super) overshoot: Option<f64>,
    /// Seconds until the value is within the band for good; none if it still left it in the last tenth,
    /// or if the last tenth is on average elsewhere than the one before.
    pub(super) settling: Option<f64>,
}

/// Analyses points in order of time; none if they are too few, or if there was no step.
pub(super) fn analyse(step: Step, points: &[Moment]) -> Option<Response> {
    let (first, last) = (points.first()?, points.last()?);
    let height = step.to - step.from;
    if points.len() < LEAST_POINTS || height == 0.0 {
        return None;
    }
    let final_from = last.time - (last.time - first.time) * FINAL_PART;
    let final_points = || points.iter().filter(|point| point.time >= final_from);
    let end = mean(final_points())?;
    let before_from = final_from - (last.time - final_from);
    let is_before = |point: &&Moment| point.time >= before_from && point.time < final_from;
    let before = mean(points.iter().filter(is_before)).unwrap_or(end);
    let ripple = final_points().map(|point| (point.value - end).abs()).fold(0.0, f64::max);

    let way = end - step.from;
    let reached = way / height;
    let outcome = match reached {
        reached if reached.abs() < LEAST_WAY => Outcome::Unchanged,
        reached if reached < 0.0 => Outcome::Reversed,
        _ => Outcome::Followed,
    };
    // A value that came back is told by how far it was away on the side of the target.
    let direction = if outcome == Outcome::Reversed { -height.signum() } else { height.signum() };
    let peak = points.iter().fold(*first, |peak, point| {
        if (point.value - peak.value) * direction > 0.0 { *point } else { peak }
    });
    let mut response = Response {
        outcome,
        end,
        reached,
        ripple,
        error: step.to - end,
        peak,
        rise: None,
        points_of_rise: 0,
        overshoot: None,
        settling: None,
    };
    if outcome == Outcome::Unchanged {
        return Some(response);
    }
    let part = |point: &Moment| (point.value - step.from) / way;
    if let (Some(low), Some(high)) =
        (crossing(points, RISE.0, part), crossing(points, RISE.1, part))
    {
        response.rise = Some(high - low);
        let within = |point: &&Moment| point.time >= low && point.time <= high;
        response.points_of_rise = points.iter().filter(within).count();
    }
    let beyond = part(&peak) - 1.0;
    // What the value does all the time is ripple and no overshoot.
    let is_ripple = beyond * way.abs() <= ripple;
    response.overshoot = Some(if is_ripple { 0.0 } else { beyond });
    let creeps = (end - before).abs() > step.band / 2.0 * way.abs();
    let settled = settling(points, step.band, part);
    response.settling = settled.filter(|&settled| settled <= final_from && !creeps);
    Some(response)
}

fn mean<'a>(points: impl Iterator<Item = &'a Moment>) -> Option<f64> {
    let (sum, count) =
        points.fold((0.0, 0u32), |(sum, count), point| (sum + point.value, count + 1));
    (count > 0).then(|| sum / f64::from(count))
}

/// When the value first comes to a part of its way, between two points by a straight line.
fn crossing(points: &[Moment], level: f64, part: impl Fn(&Moment) -> f64) -> Option<f64> {
    let at = points.iter().position(|point| part(point) >= level)?;
    let point = &points[at];
    let Some(before) = at.checked_sub(1).map(|before| &points[before]) else {
        return Some(point.time);
    };
    let (low, high) = (part(before), part(point));
    Some(before.time + (point.time - before.time) * (level - low) / (high - low))
}

/// When the value comes into the band for good, between two points by a straight line.
fn settling(points: &[Moment], band: f64, part: impl Fn(&Moment) -> f64) -> Option<f64> {
    let Some(at) = points.iter().rposition(|point| (part(point) - 1.0).abs() > band) else {
        return points.first().map(|point| point.time);
    };
    let (outside, inside) = (&points[at], points.get(at + 1)?);
    let edge = if part(outside) < 1.0 { 1.0 - band } else { 1.0 + band };
    let (low, high) = (part(outside), part(inside));
    Some(outside.time + (inside.time - outside.time) * (edge - low) / (high - low))
}

#[cfg(test)]
mod tests {
    use std::f64::consts::PI;

    use super::*;

    /// A step from 0 to 1000 and what follows it: so many parts of 1000 each 1/1000 of the time.
    fn response(seconds: f64, of: impl Fn(f64) -> f64) -> Response {
        let step = Step { from: 0.0, to: 1000.0, band: 0.05 };
        analyse(step, &points(seconds, |time| 1000.0 * of(time))).unwrap()
    }

    fn points(seconds: f64, of: impl Fn(f64) -> f64) -> Vec<Moment> {
        let times = (0..=1000).map(|at| f64::from(at) * seconds / 1000.0);
        times.map(|time| Moment { time, value: of(time) }).collect()
    }

    #[track_caller]
    fn is_about(value: Option<f64>, expected: f64) {
        let value = value.expect("a number");
        assert!((value - expected).abs() <= expected.abs() * 0.005, "{value} for {expected}");
    }

    /// Unit step of a second-order lag with damping below 1 and a natural frequency of 1 rad/s.
    fn second_order(damping: f64, time: f64) -> f64 {
        let damped = (1.0 - damping * damping).sqrt();
        let angle = damped * time;
        1.0 - (-damping * time).exp() * (angle.cos() + damping / damped * angle.sin())
    }

    #[test]
    fn a_first_order_lag_rises_in_2_197_and_settles_in_3_time_constants() {
        let tau = 0.02;
        let got = response(10.0 * tau, |time| 1.0 - (-time / tau).exp());
        assert_eq!(got.outcome, Outcome::Followed);
        is_about(got.rise, 9f64.ln() * tau);
        is_about(got.settling, 20f64.ln() * tau);
        assert_eq!(got.overshoot, Some(0.0));
        assert!((got.reached - 1.0).abs() < 1e-4 && got.error.abs() < 0.1, "{got:?}");
    }

    #[test]
    fn a_second_order_lag_overshoots_as_its_damping_says() {
        for damping in [0.2, 0.5, 0.7] {
            let damped: f64 = (1.0f64 - damping * damping).sqrt();
            let got = response(60.0, |time| second_order(damping, time));
            is_about(got.overshoot, (-PI * damping / damped).exp());
            assert!((got.peak.time - PI / damped).abs() < 0.06, "{got:?}");
        }
        // exp(-pi * 0.5 / sqrt(0.75)) is 16.3 %; the rise takes 1.64 / ω, the band is left for the last time at
        // 5.29 / ω (both from the closed form).
        let got = response(60.0, |time| second_order(0.5, time));
        is_about(got.overshoot, 0.163);
        assert!((got.rise.unwrap() - 1.64).abs() < 0.02, "{got:?}");
        assert!((got.settling.unwrap() - 5.29).abs() < 0.02, "{got:?}");
    }

    #[test]
    fn a_regulator_that_does_not_reach_its_target_has_times_and_an_error() {
        let got = response(1.0, |time| 0.48 * (1.0 - (-time / 0.05).exp()));
        is_about(Some(got.reached), 0.48);
        is_about(Some(got.error), 520.0);
        is_about(got.rise, 9f64.ln() * 0.05);
        is_about(got.settling, 20f64.ln() * 0.05);
    }

    #[test]
    fn a_step_from_any_value_to_any_other_is_measured_alike() {
        let rising = response(60.0, |time| second_order(0.5, time));
        let step = Step { from: 300.0, to: -1700.0, band: 0.05 };
        let falling = points(60.0, |time| 300.0 - 2000.0 * second_order(0.5, time));
        let falling = analyse(step, &falling).unwrap();
        for (one, other) in [
            (rising.rise, falling.rise),
            (rising.overshoot, falling.overshoot),
            (rising.settling, falling.settling),
        ] {
            assert!((one.unwrap() - other.unwrap()).abs() < 1e-6);
        }
        assert!((falling.end + 1700.0).abs() < 1.0);
    }

    #[test]
    fn noise_is_ripple_and_no_overshoot() {
        // Of both signs, no period of the points, at most 3 % of the step.
        let noise = |time: f64| 0.03 * (time * 7919.0).sin();
        let got = response(1.0, |time| 1.0 - (-time / 0.05).exp() + noise(time));
        assert_eq!(got.overshoot, Some(0.0));
        assert!((25.0..=31.0).contains(&got.ripple), "{got:?}");
        assert!((got.reached - 1.0).abs() < 0.005, "{got:?}");
        // Within the noise of the values that a lag alone has: 3 % are at most 0.03 / 0.1 time constants there.
        assert!((got.rise.unwrap() - 9f64.ln() * 0.05).abs() < 0.02, "{got:?}");
        assert!(got.settling.is_some_and(|time| time > 0.1 && time < 0.3), "{got:?}");
    }

    #[test]
    fn what_swings_on_has_not_settled() {
        let got = response(1.0, |time| 1.0 - (time * 100.0).cos());
        assert_eq!((got.settling, got.outcome), (None, Outcome::Followed));
        assert!(got.ripple > 900.0);
    }

    #[test]
    fn what_still_creeps_at_the_end_has_not_settled() {
        assert_eq!(response(1.0, |time| time).settling, None);
        assert_eq!(response(1.0, |time| 1.0 + time).settling, None);
        // By 4 % of its way in each tenth of the time.
        assert_eq!(response(1.0, |time| 0.6 + 0.4 * time).settling, None);
    }

    #[test]
    fn what_goes_the_other_way_is_reversed() {
        let got = response(1.0, |time| -0.6 * (1.0 - (-time / 0.05).exp()));
        assert_eq!(got.outcome, Outcome::Reversed);
        is_about(Some(got.reached), -0.6);
        assert!((got.peak.value + 600.0).abs() < 1.0, "{got:?}");
    }

    #[test]
    fn what_stays_or_comes_back_is_unchanged_and_has_no_times() {
        for got in [
            response(1.0, |_| 0.0),
            response(1.0, |time| 0.015 * time),
            response(1.0, |time| if time < 0.5 { 0.4 } else { 0.0 }),
        ] {
            assert_eq!(got.outcome, Outcome::Unchanged);
            assert_eq!((got.rise, got.overshoot, got.settling), (None, None, None));
        }
        let came_back = response(1.0, |time| if time < 0.5 { 0.4 } else { 0.0 });
        assert_eq!(came_back.peak.value, 400.0);
    }

    #[test]
    fn a_jump_takes_no_time() {
        let got = response(1.0, |_| 1.0);
        assert_eq!((got.rise, got.settling, got.overshoot), (Some(0.0), Some(0.0), Some(0.0)));
    }

    #[test]
    fn too_few_points_and_no_step_say_nothing() {
        let few = &points(1.0, |_| 1.0)[..LEAST_POINTS - 1];
        assert!(analyse(Step { from: 0.0, to: 1.0, band: 0.05 }, few).is_none());
        let none = Step { from: 1.0, to: 1.0, band: 0.05 };
        assert!(analyse(none, &points(1.0, |_| 1.0)).is_none());
    }
}
