//! Torques of a load along its way.

use super::Load;

impl Load {
    /// Torque in Nm that acts on a shaft at this position in fine steps, whether it turns or not.
    pub fn torque_at(&self, position: f64) -> f64 {
        let springs: f64 =
            self.springs.iter().map(|spring| (spring.rest - position) * spring.rate).sum();
        self.constant + springs + self.along_at(position)
    }

    /// How fast that torque falls along the way in Nm per fine step, where it holds a position; 0 where
    /// it pushes away from it.
    pub fn stiffness_at(&self, position: f64) -> f64 {
        let springs: f64 = self.springs.iter().map(|spring| spring.rate).sum();
        springs + (-self.slope_along(position)).max(0.0)
    }

    /// Whether the torque depends on the position.
    pub fn varies(&self) -> bool {
        !self.springs.is_empty() || !self.along.is_empty()
    }

    /// The largest torque in either direction between two positions.
    pub fn largest_between(&self, from: f64, to: f64) -> f64 {
        let (low, high) = (from.min(to), from.max(to));
        let inside = self.along.iter().map(|point| point.0).filter(|at| (low..high).contains(at));
        inside.chain([low, high]).map(|position| self.torque_at(position).abs()).fold(0.0, f64::max)
    }

    fn along_at(&self, position: f64) -> f64 {
        match self.next_point(position) {
            0 => self.along.first().map_or(0.0, |point| point.1),
            next => match self.along.get(next - 1..=next) {
                Some(&[(from, before), (to, after)]) => {
                    before + (position - from) * (after - before) / (to - from)
                }
                _ => self.along.last().map_or(0.0, |point| point.1),
            },
        }
    }

    fn slope_along(&self, position: f64) -> f64 {
        let next = self.next_point(position);
        let piece = next.checked_sub(1).and_then(|before| self.along.get(before..=next));
        match piece {
            Some(&[(from, before), (to, after)]) => (after - before) / (to - from),
            _ => 0.0,
        }
    }

    /// Which point of the profile comes behind a position.
    fn next_point(&self, position: f64) -> usize {
        self.along.partition_point(|point| point.0 <= position)
    }
}

#[cfg(test)]
mod tests {
    use super::super::{Load, Spring};

    #[test]
    fn torques_along_the_way_are_linear_between_points_and_constant_beyond() {
        let load = Load { along: vec![(0.0, 0.1), (100.0, 0.3)], ..Load::default() };
        for (position, torque) in [(-50.0, 0.1), (0.0, 0.1), (25.0, 0.15), (100.0, 0.3), (1e9, 0.3)]
        {
            assert!((load.torque_at(position) - torque).abs() < 1e-12, "{position}");
        }
        assert_eq!(load.stiffness_at(50.0), 0.0, "it pushes away");
    }

    #[test]
    fn springs_pull_back_and_add_to_what_acts_always() {
        let spring = Spring { rate: 0.002, rest: 10.0 };
        let load = Load { constant: -0.01, springs: vec![spring, spring], ..Load::default() };
        assert!((load.torque_at(30.0) - (-0.01 - 0.08)).abs() < 1e-12);
        assert!((load.stiffness_at(30.0) - 0.004).abs() < 1e-12);
        assert!((load.largest_between(-10.0, 10.0) - 0.07).abs() < 1e-12);
    }
}
