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
