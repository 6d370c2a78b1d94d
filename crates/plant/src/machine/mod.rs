//! What a motor turns: the description of the machine behind one axis.
//!
//! Everything is told as the motor's shaft feels it: torques in Nm at the shaft, inertias in kg m²,
//! positions and distances in "fine steps", positive as the position counter counts up. A fine step is 1/256 full
//! step of a stepper motor, and 1/65536 turn of a servo motor. Whoever thinks in millimetres, newtons and gears
//! converts before.
//!
//! [`Machine`] has a stepper motor; [`crate::servo::Machine`] has a servo motor and shares load, stage, switches and
//! encoder.

mod load;
pub mod motor;

pub use motor::Motor;

/// The machine behind one axis with a stepper motor.
#[derive(Clone, Debug, PartialEq)]
pub struct Machine {
    /// The motor.
    pub motor: Motor,
    /// What it turns.
    pub load: Load,
    /// Where the way ends and what lies along it.
    pub stage: Stage,
    /// Left limit switch, right limit switch, home switch.
    pub switches: Switches,
    /// The encoder, if there is one.
    pub encoder: Option<Encoder>,
}

/// What a motor turns, seen at its shaft.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Load {
    /// Inertia of all that turns or moves, in kg m², without the motor's own rotor.
    pub inertia: f64,
    /// Torque of dry friction in Nm, against any motion and against its beginning.
    pub friction: f64,
    /// Viscous friction in Nm per rad/s.
    pub viscous: f64,
    /// Torque in Nm that acts always, as that of a hanging weight; positive towards positive positions.
    pub constant: f64,
    /// Springs: torque that grows with the distance from their rest position.
    pub springs: Vec<Spring>,
    /// Torque in Nm along the way: (position in fine steps, torque), ascending, linear in between and
    /// constant beyond its ends. Empty is none.
    pub along: Vec<(f64, f64)>,
}

/// A spring.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Spring {
    /// Torque in Nm per fine step of distance, pulling back to `rest`; not negative.
    pub rate: f64,
    /// Position without torque, in fine steps.
    pub rest: f64,
}

/// The way of a stage.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Stage {
    /// Hard stop in negative direction, in fine steps.
    pub lowest: Option<f64>,
    /// Hard stop in positive direction, in fine steps.
    pub highest: Option<f64>,
    /// Fine steps after which a circular axis is where it was; none on a linear one. A circular axis has
    /// no hard stops.
    pub circle: Option<f64>,
    /// Play between motor and stage in fine steps.
    pub backlash: f64,
    /// Where the stage stands at first, in fine steps.
    pub start: f64,
}

/// The switches of an axis.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Switches {
    /// Left limit switch.
    pub left: Option<Switch>,
    /// Right limit switch.
    pub right: Option<Switch>,
    /// Home switch.
    pub home: Option<Switch>,
}

/// A switch along the way: it is actuated while the stage stands within its zone.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Switch {
    /// Lower end of its zone in fine steps; may be -infinity.
    pub from: f64,
    /// Upper end of its zone in fine steps; may be infinity.
    pub to: f64,
    /// How much farther, in fine steps, the stage has to leave the zone for the switch to open again.
    pub hysteresis: f64,
    /// For so many clocks after an edge the contact bounces.
    pub bounce: u64,
    /// Whether its contact is closed at rest and opens when it is actuated.
    pub normally_closed: bool,
}

/// An incremental encoder.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Encoder {
    /// Counts per turn of the motor.
    pub counts: f64,
    /// Where its index is, in fine steps; it comes again with every turn.
    pub index: f64,
    /// Whether it counts down while the position counts up.
    pub reversed: bool,
    /// Whether it sits behind the play, on the stage, and not on the motor's shaft.
    pub on_stage: bool,
}
