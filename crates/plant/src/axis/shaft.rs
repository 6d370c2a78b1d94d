//! Torques at a shaft: what a motion asks for, what the motor can give, and how a shaft moves that no
//! field guides.

use core::f64::consts::{PI, TAU};

use crate::machine::Machine;

/// Fine steps of an electrical period: four full steps.
pub(super) const PERIOD: f64 = 1024.0;

/// Half a period: farther away another position of rest is nearer.
pub(super) const HALF_PERIOD: f64 = PERIOD / 2.0;

/// Clocks per second.
pub(super) const CLOCK: f64 = 16e6;

/// What drives the coils.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Drive {
    /// A field turns the rotor: amplitude of the phase currents in ampere, supply in volt.
    Field { amplitude: f64, supply: f64 },
    /// Nothing flows.
    Off,
    /// Currents flow that the rotor itself induces.
    Shorted,
}

/// A shaft with its machine, and what acts on it besides.
#[derive(Clone, Debug)]
pub(super) struct Shaft {
    pub(super) machine: Machine,
    /// Radians in a fine step.
    radians: f64,
    /// All that turns, in kg m².
    inertia: f64,
    /// A torque from outside in Nm.
    pub(super) external: f64,
    /// Where the rotor is held, if it is.
    pub(super) blocked: Option<f64>,
}

impl Shaft {
    pub(super) fn new(machine: Machine) -> Self {
        let radians = TAU / (f64::from(machine.motor.full_steps.max(1)) * 256.0);
        let inertia = machine.motor.inertia + machine.load.inertia;
        Self { machine, radians, inertia, external: 0.0, blocked: None }
    }

    /// Fine steps of a turn.
    pub(super) fn turn(&self) -> f64 {
        TAU / self.radians
    }

    /// A speed in rad/s, from one in fine steps per second.
    pub(super) fn radians_per_second(&self, speed: f64) -> f64 {
        speed * self.radians
    }

    /// The lowest and the highest position that the rotor can take.
    pub(super) fn limits(&self) -> (f64, f64) {
        if let Some(position) = self.blocked {
            return (position, position);
        }
        let stage = &self.machine.stage;
        let play = stage.backlash / 2.0;
        (
            stage.lowest.map_or(f64::NEG_INFINITY, |lowest| lowest - play),
            stage.highest.map_or(f64::INFINITY, |highest| highest + play),
        )
    }

    /// Torque in Nm that acts at a position.
    pub(super) fn acting(&self, position: f64) -> f64 {
        self.machine.load.torque_at(position) + self.external
    }

    /// Torque in Nm that the motor must give so that the rotor moves like this: fine steps, per second,
    /// per second squared.
    pub(super) fn demand(&self, position: f64, speed: f64, acceleration: f64) -> f64 {
        let load = &self.machine.load;
        let acting = self.acting(position);
        if speed == 0.0 && acceleration == 0.0 {
            // At rest friction helps to hold.
            let holding = -acting;
            return holding.signum() * (holding.abs() - load.friction).max(0.0);
        }
        let direction = if speed == 0.0 { acceleration.signum() } else { speed.signum() };
        self.inertia * self.radians * acceleration
            + load.viscous * self.radians * speed
            + load.friction * direction
            - acting
    }

    /// No demand between two positions and up to this speed is larger, in either direction.
    pub(super) fn largest_demand(&self, from: f64, to: f64, speed: f64, acceleration: f64) -> f64 {
        let load = &self.machine.load;
        self.inertia * self.radians * acceleration.abs()
            + load.viscous * self.radians * speed.abs()
            + load.friction
            + load.largest_between(from, to)
            + self.external.abs()
    }

    /// Torque in Nm that the field can give at a speed in fine steps per second; 0 without a field.
    pub(super) fn available(&self, drive: Drive, speed: f64) -> f64 {
        match drive {
            Drive::Field { amplitude, supply } => {
                self.machine.motor.pull_out_torque(speed * self.radians, amplitude, supply)
            }
            Drive::Off | Drive::Shorted => 0.0,
        }
    }

    /// By how many fine steps the rotor lags behind when the load takes this part of the torque.
    pub(super) fn lag(load: f64) -> f64 {
        if load == 0.0 { 0.0 } else { libm::asin(load.clamp(-1.0, 1.0)) * (PERIOD / TAU) }
    }

    /// Whether a field at `field_speed` catches a rotor that turns with `speed`, when following would take
    /// this part of the torque available: whether the swing of the rotor in the field stays on this side
    /// of the point of no return, from the phase that is best for it.
    pub(super) fn catches(&self, available: f64, load: f64, field_speed: f64, speed: f64) -> bool {
        let load = load.abs();
        if available <= 0.0 || load >= 1.0 {
            return false;
        }
        let rest = libm::asin(load);
        let well = available * (2.0 * libm::cos(rest) - (PI - 2.0 * rest) * load);
        let slip = (field_speed - speed) * self.radians;
        let pole_pairs = self.machine.motor.pole_pairs();
        0.5 * self.inertia * slip * slip * pole_pairs <= well
    }

    /// Whether a rotor that stands at a position without a field stays there.
    pub(super) fn stays(&self, position: f64) -> bool {
        let acting = self.acting(position);
        let (lowest, highest) = self.limits();
        acting.abs() <= self.machine.load.friction + self.machine.motor.detent_torque
            || acting > 0.0 && position >= highest
            || acting < 0.0 && position <= lowest
    }

    /// Position and speed (fine steps, per second) that a rotor without a guiding field has after
    /// `seconds`, which should be short.
    ///
    /// The torque counts with the mean of its values at both ends, so that springs of any stiffness keep
    /// the energy, and the way follows from the mean of both speeds, so that constant torques give the exact
    /// way. Brakes count with the speed at the end, so that strong ones stop the rotor and do no more.
    pub(super) fn coast(
        &self,
        drive: Drive,
        position: f64,
        speed: f64,
        seconds: f64,
    ) -> (f64, f64) {
        if speed == 0.0 && self.stays(position) || seconds <= 0.0 {
            return (position, speed);
        }
        let Machine { load, motor, .. } = &self.machine;
        let acting = self.acting(position);
        let before = speed * self.radians;
        let direction = if before == 0.0 { acting.signum() } else { before.signum() };
        let torque = acting - load.friction * direction;
        let brake = match drive {
            Drive::Shorted => load.viscous + motor.short_circuit_brake(before),
            Drive::Off | Drive::Field { .. } => load.viscous,
        };
        let stiffness = load.stiffness_at(position) / self.radians;
        let swing = seconds * seconds * stiffness / (4.0 * self.inertia);
        let after = (before * (1.0 - swing) + seconds * torque / self.inertia)
            / (1.0 + swing + seconds * brake / self.inertia);
        let (way, after) = if before != 0.0 && after * direction <= 0.0 {
            // It comes to rest on the way, where torque and spring have taken all its energy.
            let (energy, ahead) = (self.inertia * before * before, torque * direction);
            let opposing = libm::sqrt(ahead * ahead + stiffness * energy) - ahead;
            (direction * energy / opposing, 0.0)
        } else {
            ((before + after) * seconds / 2.0, after)
        };
        let reached = position + way / self.radians;
        let (lowest, highest) = self.limits();
        if reached <= lowest {
            (lowest, 0.0)
        } else if reached >= highest {
            (highest, 0.0)
        } else {
            (reached, after / self.radians)
        }
    }
}
