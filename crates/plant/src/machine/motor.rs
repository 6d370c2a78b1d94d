//! Two-phase stepper motors.

/// A two-phase hybrid stepper motor.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Motor {
    /// Full steps per turn.
    pub full_steps: u32,
    /// Resistance of a phase in ohm.
    pub resistance: f64,
    /// Inductance of a phase in henry.
    pub inductance: f64,
    /// Holding torque in Nm with the rated current in both phases.
    pub holding_torque: f64,
    /// Rated current of a phase in ampere RMS.
    pub rated_current: f64,
    /// Torque in Nm that holds the rotor without current; 0 where it is not known.
    pub detent_torque: f64,
    /// Inertia of the rotor in kg m².
    pub inertia: f64,
}

/// A motor under the name by which it is ordered.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Preset {
    /// Name in lower case.
    pub name: &'static str,
    /// Its data.
    pub motor: Motor,
}

const fn preset(
    name: &'static str,
    rated_current: f64,
    resistance: f64,
    millihenry: f64,
    holding_torque: f64,
    detent_torque: f64,
    gram_square_centimetre: f64,
) -> Preset {
    let motor = Motor {
        full_steps: 200,
        resistance,
        inductance: millihenry * 1e-3,
        holding_torque,
        rated_current,
        detent_torque,
        inertia: gram_square_centimetre * 1e-7,
    };
    Preset { name, motor }
}

/// Motors by name. Sources: the manufacturer's manuals of QSH4218 V1.10, QSH5718 V2.6 and QSH6018 V1.20;
/// the generic one has the round figures of its size.
pub const PRESETS: &[Preset] = &[
    preset("qsh4218-35-10-027", 1.0, 5.3, 6.6, 0.27, 0.022, 35.0),
    preset("qsh4218-41-10-035", 1.0, 4.5, 7.5, 0.35, 0.025, 54.0),
    preset("qsh4218-51-10-049", 1.0, 5.0, 8.0, 0.49, 0.028, 68.0),
    preset("qsh4218-47-28-040", 2.8, 0.5, 0.6, 0.40, 0.0, 68.0),
    preset("qsh5718-41-28-055", 2.8, 0.7, 1.4, 0.55, 0.020, 120.0),
    preset("qsh5718-51-28-101", 2.8, 0.83, 2.2, 1.01, 0.035, 275.0),
    preset("qsh5718-56-28-126", 2.8, 0.9, 2.5, 1.26, 0.039, 300.0),
    preset("qsh5718-76-28-189", 2.8, 1.13, 3.6, 1.89, 0.066, 480.0),
    preset("qsh6018-45-28-110", 2.8, 0.75, 2.0, 1.10, 0.0, 275.0),
    preset("qsh6018-56-28-165", 2.8, 0.9, 3.6, 1.65, 0.0, 400.0),
    preset("qsh6018-65-28-210", 2.8, 1.2, 4.6, 2.10, 0.0, 570.0),
    preset("qsh6018-86-28-310", 2.8, 1.5, 6.8, 3.10, 0.0, 840.0),
    preset("nema17", 1.5, 1.5, 2.8, 0.40, 0.015, 54.0),
];

impl Motor {
    /// Pole pairs: a turn has as many electrical periods.
    pub fn pole_pairs(&self) -> f64 {
        f64::from(self.full_steps) / 4.0
    }

    /// Torque in Nm per ampere of amplitude, and back EMF of a phase in volt per rad/s.
    ///
    /// At the holding point both phases carry the rated RMS current, so that the current vector is longer
    /// by the square root of two.
    pub fn torque_constant(&self) -> f64 {
        self.holding_torque / (core::f64::consts::SQRT_2 * self.rated_current)
    }

    /// Largest torque in Nm at a speed in rad/s, with this amplitude of the phase currents in ampere from
    /// this supply in volt.
    ///
    /// At low speed the chopper keeps the amplitude, and the torque is that of the current. At high speed
    /// the voltage no longer suffices: a synchronous machine with resistance R and inductance L on an
    /// amplitude V gives at most `K (V/Z - K ω R/Z²)` with `Z² = R² + (p ω L)²`.
    pub fn pull_out_torque(&self, speed: f64, amplitude: f64, supply: f64) -> f64 {
        let constant = self.torque_constant();
        let speed = speed.abs();
        let reactance = self.pole_pairs() * speed * self.inductance;
        let square = self.resistance * self.resistance + reactance * reactance;
        let by_voltage = supply / square.sqrt() - constant * speed * self.resistance / square;
        constant * amplitude.min(by_voltage).max(0.0)
    }

    /// Torque in Nm per rad/s with which shorted coils brake at a speed in rad/s.
    pub fn short_circuit_brake(&self, speed: f64) -> f64 {
        let constant = self.torque_constant();
        let reactance = self.pole_pairs() * speed * self.inductance;
        let square = self.resistance * self.resistance + reactance * reactance;
        constant * constant * self.resistance / square
    }

    /// Amplitude in volt that drives this amplitude of current through a phase at a speed in rad/s, when
    /// the load takes this part (-1..1) of the torque.
    pub fn phase_voltage(&self, speed: f64, amplitude: f64, load: f64) -> f64 {
        let emf = self.torque_constant() * speed.abs();
        let reactance = self.pole_pairs() * speed.abs() * self.inductance;
        let along = self.resistance * amplitude + emf * load.abs();
        let across = reactance * amplitude + emf * (1.0 - load * load).max(0.0).sqrt();
        (along * along + across * across).sqrt()
    }
}
