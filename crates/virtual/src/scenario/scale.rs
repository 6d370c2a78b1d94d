//! From the stage to the motor's shaft: millimetres and degrees, newtons and newton metres.

use std::f64::consts::TAU;

use crate::quantity::Quantity;

/// Fine steps of one full step of a stepper motor.
const FINE_STEPS: f64 = 256.0;

/// Fine steps of a turn of a servo motor.
pub(crate) const SERVO_TURN: f64 = 65_536.0;

/// Fine steps of a turn of a stepper motor.
pub(crate) fn stepper_turn(full_steps: u32) -> f64 {
    f64::from(full_steps) * FINE_STEPS
}

/// Acceleration of gravity in m/s².
pub(crate) const GRAVITY: f64 = 9.80665;

/// How a stage's way is measured.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum StageUnit {
    /// It moves along a line: positions are in mm.
    Millimetres,
    /// It turns: positions are in degrees.
    Degrees,
}

impl StageUnit {
    /// `mm` or `deg`.
    pub fn symbol(self) -> &'static str {
        match self {
            Self::Millimetres => "mm",
            Self::Degrees => "deg",
        }
    }
}

/// How a stage relates to the shaft of its motor.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Scale {
    unit: StageUnit,
    /// Fine steps of the motor for one mm or degree of the stage.
    fine_per_unit: f64,
    /// Way of the stage for one radian of the motor: in m, or in rad.
    lever: f64,
    /// Fine steps of one radian of the motor.
    fine_per_radian: f64,
}

impl Scale {
    /// A stage that turns, `gear` turns of the motor for one of the stage; `turn` is a turn of the motor in
    /// fine steps.
    pub fn rotary(turn: f64, gear: f64) -> Self {
        Self {
            unit: StageUnit::Degrees,
            fine_per_unit: turn * gear / 360.0,
            lever: 1.0 / gear,
            fine_per_radian: turn / TAU,
        }
    }

    /// A stage that moves along a line: by `travel` mm for each turn behind a gear.
    pub fn linear(turn: f64, gear: f64, travel: f64) -> Self {
        Self {
            unit: StageUnit::Millimetres,
            fine_per_unit: turn * gear / travel,
            lever: travel * 1e-3 / (gear * TAU),
            fine_per_radian: turn / TAU,
        }
    }

    /// The unit of the stage's positions.
    pub fn unit(&self) -> StageUnit {
        self.unit
    }

    /// Whether the stage moves along a line.
    pub fn is_linear(&self) -> bool {
        self.unit == StageUnit::Millimetres
    }

    /// A position or distance of the stage in fine steps.
    pub fn to_fine(&self, value: f64) -> f64 {
        value * self.fine_per_unit
    }

    /// A position, distance or speed in fine steps in the stage's unit.
    pub fn to_stage(&self, fine_steps: f64) -> f64 {
        fine_steps / self.fine_per_unit
    }

    /// The torque in Nm at the motor's shaft of a force in N or a torque in Nm at the stage.
    pub fn torque(&self, force: f64) -> f64 {
        force * self.lever
    }

    /// The inertia in kg m² at the motor's shaft of a mass in kg or an inertia in kg m² at the stage.
    pub fn inertia(&self, mass: f64) -> f64 {
        mass * self.lever * self.lever
    }

    /// Viscous friction in Nm s/rad at the motor's shaft of one in N s/m or Nm s/rad at the stage.
    pub(crate) fn damping(&self, viscous: f64) -> f64 {
        viscous * self.lever * self.lever
    }

    /// Torque in Nm at the motor's shaft for each fine step, of a spring of so many N/m or Nm/rad.
    pub(crate) fn spring(&self, rate: f64) -> f64 {
        rate * self.lever * self.lever / self.fine_per_radian
    }

    pub(crate) fn length(&self) -> Quantity {
        if self.is_linear() { Quantity::Length } else { Quantity::Angle }
    }

    pub(crate) fn force(&self) -> Quantity {
        if self.is_linear() { Quantity::Force } else { Quantity::Torque }
    }
}

impl Default for Scale {
    /// A stepper motor of 200 full steps with nothing behind its shaft.
    fn default() -> Self {
        Self::rotary(stepper_turn(200), 1.0)
    }
}

#[cfg(test)]
mod tests {
    use std::f64::consts::PI;

    use super::*;

    #[track_caller]
    fn near(got: f64, expected: f64) {
        assert!((got - expected).abs() <= expected.abs() * 1e-12, "{got} is not {expected}");
    }

    #[test]
    fn a_lead_screw_is_seen_at_the_shaft_as_by_hand() {
        // 200 full steps · 256 = 51200 fine steps for 5 mm.
        let screw = Scale::linear(stepper_turn(200), 1.0, 5.0);
        near(screw.to_fine(12.5), 128_000.0);
        near(screw.to_stage(128_000.0), 12.5);
        // T = F · lead / 2π: 3 N · 0.005 m / 2π.
        near(screw.torque(3.0), 0.015 / (2.0 * PI));
        // J = m · (lead / 2π)²: 2.4 kg.
        near(screw.inertia(2.4), 2.4 * (0.005 / (2.0 * PI)) * (0.005 / (2.0 * PI)));
        // 2000 N/m: a turn moves 5 mm, which is 10 N or 10 · 0.005 / 2π Nm; by 51200 for a fine step.
        near(screw.spring(2000.0) * 51_200.0, 10.0 * 0.005 / (2.0 * PI));
    }

    #[test]
    fn a_gear_is_seen_at_the_shaft_as_by_hand() {
        // 400 full steps, 10 turns of the motor for one of the stage.
        let gear = Scale::rotary(stepper_turn(400), 10.0);
        near(gear.to_fine(360.0), 1_024_000.0);
        near(gear.torque(2.0), 0.2);
        near(gear.inertia(1e-3), 1e-5);
        // 1 Nm/rad: a turn of the motor is 36° = π/5 rad, π/5 Nm at the stage, π/50 Nm at the motor.
        near(gear.spring(1.0) * 102_400.0, PI / 50.0);
        // 1 Nm s/rad at the stage, which turns at a tenth: 0.1 Nm there, 0.01 Nm at the motor.
        near(gear.damping(1.0), 0.01);
    }

    #[test]
    fn a_screw_behind_a_gear_is_seen_through_both() {
        // 3 turns for 6 mm are 2 mm for each.
        let both = Scale::linear(stepper_turn(200), 3.0, 6.0);
        near(both.to_fine(2.0), 51_200.0);
        near(both.torque(1.0), 0.002 / (2.0 * PI));
    }
}
