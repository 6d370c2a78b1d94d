//! What acts on the rotor besides the motor's currents.

use core::f64::consts::TAU;

use super::Machine;
use super::motor::{Cogging, Motor};
use crate::machine::Load;

/// Fine steps of a turn.
pub(super) const TURN: f64 = 65536.0;

/// Radians of a fine step.
pub(super) const RADIANS: f64 = TAU / TURN;

/// No rotor turns faster, in rad/s; keeps numbers finite under torques that no machine has.
const LARGEST_SPEED: f64 = 1e5;

/// Slower than that, in rad/s, a rotor stands.
const STANDSTILL: f64 = 1e-12;

/// What holds the shaft while it gets no power.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct HoldingBrake {
    /// Torque in Nm with which it holds, or brakes a shaft that turns.
    pub torque: f64,
    /// It opens at this duty of its output or more, 0..=255.
    pub release_duty: u8,
}

/// Constants of a machine's shaft.
#[derive(Clone, Copy, Debug)]
pub(super) struct Shaft {
    /// All that turns, in kg m².
    pub(super) inertia: f64,
    /// Nm per rad/s.
    pub(super) viscous: f64,
    /// Dry friction in Nm without the holding brake.
    pub(super) friction: f64,
    /// Lowest and highest position of the rotor in fine steps.
    pub(super) limits: (f64, f64),
    cogging: Cogging,
    /// Whether no torque depends on the position.
    even: bool,
}

/// Torques at a position: in Nm, and how fast they fall along the way in Nm per rad.
#[derive(Clone, Copy, Debug)]
pub(super) struct Acting {
    pub(super) torque: f64,
    pub(super) stiffness: f64,
}

/// How the rotor moves in a span of time.
#[derive(Clone, Copy, Debug)]
pub(super) struct Motion {
    /// Mean speed in rad/s.
    pub(super) mean: f64,
    /// Speed at the end in rad/s.
    pub(super) speed: f64,
    /// Position at the end in fine steps.
    pub(super) position: f64,
}

/// What follows from the length of a span of time.
#[derive(Clone, Copy, Debug)]
pub(super) struct ShaftSpan {
    /// Twice the inertia by the time in seconds.
    inertia: f64,
    seconds: f64,
    /// Fine steps at 1 rad/s.
    way: f64,
}

impl Shaft {
    pub(super) fn new(machine: &Machine) -> Self {
        let (friction, viscous, cogging) = match &machine.motor {
            Motor::Brushless(motor) => (motor.friction, motor.viscous, motor.cogging),
            Motor::Brushed(motor) => (motor.friction, motor.viscous, Cogging::default()),
        };
        let (load, stage) = (&machine.load, &machine.stage);
        let play = stage.backlash / 2.0;
        let linear = stage.circle.is_none();
        let limit = |limit: Option<f64>| limit.filter(|_| linear);
        Self {
            inertia: (machine.motor.inertia() + load.inertia).max(1e-10),
            viscous: viscous + load.viscous,
            friction: friction + load.friction,
            limits: (
                limit(stage.lowest).map_or(f64::NEG_INFINITY, |lowest| lowest - play),
                limit(stage.highest).map_or(f64::INFINITY, |highest| highest + play),
            ),
            cogging,
            even: !load.varies() && cogging.torque == 0.0,
        }
    }

    pub(super) fn span(&self, seconds: f64) -> ShaftSpan {
        ShaftSpan { inertia: 2.0 * self.inertia / seconds, seconds, way: seconds / RADIANS }
    }

    /// What acts on a rotor at this position in fine steps, with a torque from outside.
    #[inline(always)]
    pub(super) fn acting(&self, machine: &Machine, position: f64, external: f64) -> Acting {
        if self.even {
            return Acting { torque: machine.load.constant + external, stiffness: 0.0 };
        }
        self.acting_here(&machine.load, position, external)
    }

    #[inline(never)]
    fn acting_here(&self, load: &Load, position: f64, external: f64) -> Acting {
        let mut acting = Acting {
            torque: load.torque_at(position) + external,
            stiffness: load.stiffness_at(position) / RADIANS,
        };
        if self.cogging.torque != 0.0 {
            let periods = position / TURN * f64::from(self.cogging.per_turn);
            let (sine, cosine) = sine_cosine(periods);
            let steepest = self.cogging.torque * f64::from(self.cogging.per_turn);
            acting.torque -= self.cogging.torque * sine;
            acting.stiffness += (steepest * cosine).max(0.0);
        }
        acting
    }

    /// Motion in a span of time of a rotor at a position (fine steps) with a speed (rad/s), on which `acting`
    /// acts, and which `drag` (Nm per rad/s) and dry friction brake.
    ///
    /// Torques count with the mean of their values at both ends, so that springs of any stiffness keep the energy.
    /// Dry friction holds a rotor that stands until more acts on it, and a rotor that it has stopped stands for the
    /// rest of the span.
    #[inline(always)]
    pub(super) fn motion(
        &self,
        (position, speed): (f64, f64),
        acting: Acting,
        drag: f64,
        friction: f64,
        span: &ShaftSpan,
    ) -> Motion {
        let rest = Motion { mean: 0.0, speed: 0.0, position };
        let direction = if speed != 0.0 {
            speed
        } else if acting.torque.abs() > friction {
            acting.torque
        } else {
            return rest;
        };
        let inertia = span.inertia;
        let torque = acting.torque - friction.copysign(direction);
        let drag = drag + self.viscous + acting.stiffness * (span.seconds / 2.0);
        // The divisor is known early, the torque is not.
        let mut mean = (inertia * speed + torque) * (1.0 / (inertia + drag));
        let mut after = 2.0 * mean - speed;
        if friction > 0.0 && speed * after < 0.0 {
            mean = speed / 2.0 * (speed / (speed - after));
            after = 0.0;
        }
        if !(STANDSTILL..LARGEST_SPEED).contains(&after.abs()) {
            after = sane(after);
        }
        let reached = position + mean * span.way;
        let (lowest, highest) = self.limits;
        if reached < lowest || reached > highest {
            // It stops without bouncing back.
            let stop = reached.clamp(lowest, highest);
            let mean = (stop - position) / span.way;
            return Motion { mean, speed: 0.0, position: stop };
        }
        Motion { mean, speed: after, position: reached }
    }
}

/// A speed that is too low to be one, or too high.
#[cold]
#[inline(never)]
fn sane(speed: f64) -> f64 {
    if speed.abs() < STANDSTILL { 0.0 } else { speed.clamp(-LARGEST_SPEED, LARGEST_SPEED) }
}

/// Whole part towards negative infinity, for numbers within the range of an i64.
pub(super) fn floor(number: f64) -> i64 {
    let whole = number as i64;
    if (whole as f64) > number { whole.saturating_sub(1) } else { whole }
}

/// What is left beyond the nearest whole number, -0.5..=0.5, of a number within ±2^51; and the lowest bits of that
/// whole number.
#[inline(always)]
fn nearest(number: f64) -> (f64, u64) {
    // Numbers of this size have no places behind the point.
    const WHOLE: f64 = 6_755_399_441_055_744.0;
    let shifted = number + WHOLE;
    (number - (shifted - WHOLE), shifted.to_bits())
}

/// Sine and cosine of an angle within an eighth of a turn, in radians: the first terms of their series, of which the
/// next ones are below 1e-16. Half as much work as a function that takes any angle.
#[inline(always)]
fn within_eighth(angle: f64) -> (f64, f64) {
    let square = angle * angle;
    let series =
        |terms: [f64; 8]| terms.iter().rev().fold(0.0, |sum: f64, term| sum * square + term);
    let sine = series([
        1.0,
        -1.0 / 6.0,
        1.0 / 120.0,
        -1.0 / 5040.0,
        1.0 / 362_880.0,
        -1.0 / 39_916_800.0,
        1.0 / 6_227_020_800.0,
        -1.0 / 1_307_674_368_000.0,
    ]);
    let cosine = series([
        1.0,
        -1.0 / 2.0,
        1.0 / 24.0,
        -1.0 / 720.0,
        1.0 / 40_320.0,
        -1.0 / 3_628_800.0,
        1.0 / 479_001_600.0,
        -1.0 / 87_178_291_200.0,
    ]);
    (angle * sine, cosine)
}

/// Sine and cosine of an angle in turns.
#[inline(always)]
pub(super) fn sine_cosine(turns: f64) -> (f64, f64) {
    let (left, quarters) = nearest(4.0 * turns);
    let (sine, cosine) = within_eighth(left * (TAU / 4.0));
    let (sine, cosine) = if quarters & 1 == 0 { (sine, cosine) } else { (cosine, -sine) };
    // Minus one in the second half of the turn; both products are one operation of the processor.
    let sign = f64::from_bits(1f64.to_bits() | (quarters & 2) << 62);
    (sine * sign, cosine * sign)
}

#[cfg(test)]
mod tests {
    use super::super::motor::{Brushless, preset};
    use super::*;

    #[test]
    fn friction_stops_a_rotor_after_the_way_that_its_energy_lasts() {
        let motor = Brushless { viscous: 0.0, ..preset("qbl4208-61-04-013").unwrap() };
        let shaft = Shaft::new(&Machine::new(Motor::Brushless(motor)));
        let acting = Acting { torque: 0.0, stiffness: 0.0 };
        let end = shaft.motion((0.0, 2.0), acting, 0.0, 0.4, &shaft.span(1e-3));
        assert_eq!(end.speed, 0.0);
        let way = 0.5 * 48e-6 * 4.0 / 0.4;
        assert!((end.position * RADIANS - way).abs() < 1e-12);
        assert!((end.mean - way / 1e-3).abs() < 1e-9);
    }

    #[test]
    fn sine_and_cosine_are_those_of_the_angle_in_all_quarters() {
        for degrees in (-1000..1000).map(f64::from) {
            let (sine, cosine) = sine_cosine(degrees / 360.0);
            assert!((sine - degrees.to_radians().sin()).abs() < 1e-14, "{degrees}");
            assert!((cosine - degrees.to_radians().cos()).abs() < 1e-14, "{degrees}");
        }
    }

    #[test]
    fn whole_parts_are_towards_negative_infinity() {
        let numbers = [-1.5, -1.0, -0.1, 0.0, 0.9, 1.0, 1e300];
        assert_eq!(numbers.map(floor), [-2, -1, -1, 0, 0, 1, i64::MAX]);
    }
}
