//! The three regulators of a servo, one around the other, and their parameters in the catalogue.

use opentmcl_catalog::{AxisBehaviour, AxisParameter, MODULES, Module, Servo, Unit};

use crate::failure::Failure;

/// What is regulated.
#[derive(Clone, Copy, Debug, PartialEq, Eq, clap::ValueEnum)]
pub(super) enum Regulator {
    /// The current, in mA, as a measure of the torque; the innermost regulator
    Torque,
    /// The speed, in rpm
    Velocity,
    /// The position, by a distance in the module's own units; the outermost regulator
    Position,
}

/// Parameters of one of the regulators of a module.
pub(super) struct Parameters {
    pub(super) target: &'static AxisParameter,
    pub(super) actual: &'static AxisParameter,
    pub(super) p: &'static AxisParameter,
    /// The position regulator has none.
    pub(super) i: Option<&'static AxisParameter>,
    /// The parameter that limits the target: the largest current or speed.
    pub(super) limit: Option<&'static AxisParameter>,
    /// What else is recorded, each with its quantity.
    pub(super) companions: Vec<(&'static str, &'static AxisParameter)>,
}

impl Regulator {
    /// What it regulates, as plots name it.
    pub(super) const fn quantity(self) -> &'static str {
        match self {
            Self::Torque => TORQUE,
            Self::Velocity => VELOCITY,
            Self::Position => "position",
        }
    }

    /// Its parameters.
    ///
    /// # Errors
    /// When the module has no servo, with the modules that have one.
    pub(super) fn parameters(self, module: &'static Module) -> Result<Parameters, Failure> {
        let row = |effect| parameter(module, effect);
        let torque = (TORQUE, row(Servo::ActualTorque)?);
        let velocity = (VELOCITY, row(Servo::ActualVelocity)?);
        Ok(match self {
            Self::Torque => Parameters {
                target: row(Servo::TargetTorque)?,
                actual: torque.1,
                p: row(Servo::TorqueP)?,
                i: Some(row(Servo::TorqueI)?),
                limit: Some(row(Servo::MaxCurrent)?),
                companions: vec![velocity],
            },
            Self::Velocity => Parameters {
                target: row(Servo::TargetVelocity)?,
                actual: velocity.1,
                p: row(Servo::VelocityP)?,
                i: Some(row(Servo::VelocityI)?),
                limit: Some(row(Servo::MaxVelocity)?),
                companions: vec![torque],
            },
            Self::Position => Parameters {
                target: row(Servo::TargetPosition)?,
                actual: row(Servo::ActualPosition)?,
                p: row(Servo::PositionP)?,
                i: None,
                limit: None,
                companions: vec![velocity, torque],
            },
        })
    }
}

const TORQUE: &str = "torque";
const VELOCITY: &str = "velocity";

/// The parameter of a servo module with this effect.
///
/// # Errors
/// When the module has no servo.
pub(super) fn parameter(
    module: &'static Module,
    effect: Servo,
) -> Result<&'static AxisParameter, Failure> {
    find(module, AxisBehaviour::Servo(effect)).ok_or_else(|| {
        let message = format!("a {} has no regulators: it drives no servo motor", module.title);
        let has_servo =
            |module: &&&Module| find(module, AxisBehaviour::Servo(Servo::TargetTorque)).is_some();
        let names: Vec<_> = MODULES.iter().filter(has_servo).map(|module| module.name).collect();
        Failure::usage(message).help(format!("modules that have them: {}", names.join(", ")))
    })
}

/// The parameter with this effect, if the firmware of the module has it.
pub(super) fn find(module: &Module, effect: AxisBehaviour) -> Option<&'static AxisParameter> {
    let mut rows = module.axis_parameters.iter();
    rows.find(|row| row.behaviour == effect && module.has(row.since))
}

/// The unit of a parameter, as it is printed; empty for plain numbers.
pub(super) fn unit(row: &AxisParameter) -> &'static str {
    match row.unit {
        Unit::None => "",
        Unit::Microsteps => "microsteps",
        Unit::Pps => "pps",
        Unit::Pps2 => "pps²",
        Unit::Other(text) => text,
    }
}

/// A parameter as failures name it: `parameter 15 (commutation_mode)`.
pub(super) fn named(row: &AxisParameter) -> String {
    format!("parameter {} ({})", row.number, row.id)
}
