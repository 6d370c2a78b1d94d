//! What somebody does to a module from outside, and how that is written.

use std::fmt;

use opentmcl_plant::axis::{Coil, CoilFault, SwitchInput};
use opentmcl_plant::servo::LineFault;

/// Something that happens to a module without a command.
///
/// Its text ([`fmt::Display`]) is what [`std::str::FromStr`] reads:
///
/// ```
/// use opentmcl_virtual::Action;
///
/// let action: Action = "load axis 2 0.3 Nm".parse().unwrap();
/// assert_eq!(action.to_string(), "load axis 2 0.3 Nm");
/// let error = "laod axis 2 0.3 Nm".parse::<Action>().unwrap_err();
/// assert!(error.to_string().contains("did you mean \"load\"?"));
/// ```
#[derive(Clone, Debug, PartialEq)]
pub enum Action {
    /// `press left axis 0`, `release left axis 0`, `free left axis 0`: a switch is held actuated or not
    /// actuated, or the stage decides again.
    Switch {
        /// Which switch.
        switch: SwitchInput,
        /// Of which axis.
        axis: u8,
        /// Whether it is held actuated; none leaves it to the stage.
        held: Option<bool>,
    },
    /// `load axis 2 0.3 Nm`, `load axis 2 5 N`: something pushes towards positive positions, or with a
    /// negative value towards negative ones. Replaces the last such push; 0 ends it.
    Load {
        /// Which axis.
        axis: u8,
        /// How much.
        push: Push,
    },
    /// `block axis 1`, `unblock axis 1`: the rotor is held where it is, or let go.
    Block {
        /// Which axis.
        axis: u8,
        /// Whether it is held.
        blocked: bool,
    },
    /// `supply 18 V`: the supply voltage in volt.
    Supply(f64),
    /// `temperature driver 120 axis 0`, without an axis all of them, in degrees Celsius.
    DriverTemperature {
        /// Which axis; none is all.
        axis: Option<u8>,
        /// Degrees Celsius.
        celsius: f64,
    },
    /// `temperature motor 80 axis 0`, without an axis all of them: that of the winding of a servo motor in degrees
    /// Celsius.
    MotorTemperature {
        /// Which axis; none is all.
        axis: Option<u8>,
        /// Degrees Celsius.
        celsius: f64,
    },
    /// `temperature ambient 40`: that of the surroundings of a servo module and its motor in degrees Celsius.
    AmbientTemperature(f64),
    /// `temperature board 60` in degrees Celsius.
    BoardTemperature(f64),
    /// `power cycle`: the supply goes off and on.
    PowerCycle,
    /// `power on`, `power off`.
    Power(bool),
    /// `input 3 high`: the level of a digital input by its number with GIO.
    Input {
        /// Which input.
        input: u8,
        /// Its level.
        high: bool,
    },
    /// `analog 0 2048`, `analog 0 2.5 V`: the reading or the voltage of an analog input by its number
    /// with GIO.
    Analog {
        /// Which input.
        input: u8,
        /// What is on it.
        level: AnalogLevel,
    },
    /// `disconnect coil B axis 4`, `short coil A axis 4`, `connect coil B axis 4`.
    Coil {
        /// Which axis.
        axis: u8,
        /// Which coil.
        coil: Coil,
        /// What is wrong with its wires from now on; none if nothing is.
        fault: Option<CoilFault>,
    },
    /// `disconnect hall B axis 0`, `short hall B axis 0`, `connect hall B axis 0`: a wire that is off is pulled high,
    /// one that touches ground is low.
    Hall {
        /// Which axis.
        axis: u8,
        /// Which line, 0 to 2 for A to C.
        line: u8,
        /// What its level is from now on.
        fault: LineFault,
    },
    /// `disconnect phase C axis 0`, `connect phase C axis 0`: the wire of a phase of a servo motor.
    Phase {
        /// Which axis.
        axis: u8,
        /// Which phase, 0 to 2 for A to C.
        phase: u8,
        /// Whether its wire is off.
        open: bool,
    },
    /// `driver fault axis 0`, `driver ok axis 0`: whether the gate driver of a servo axis reports a fault.
    DriverFault {
        /// Which axis.
        axis: u8,
        /// Whether it does.
        fault: bool,
    },
    /// `set position axis 0 12.5 mm`: the stage is moved by hand.
    Position {
        /// Which axis.
        axis: u8,
        /// Where to.
        place: Place,
    },
    /// `torque off input 0`, `torque on input 0`: the level of a safe-torque-off input.
    Torque {
        /// Which of these inputs, from 0.
        input: u8,
        /// Whether it allows torque.
        allowed: bool,
    },
    /// `faults PORT SPEC`: faults of a line, for whoever serves the module; `SPEC` is not looked at here.
    Faults {
        /// Name of the port.
        port: String,
        /// What the line does to bytes.
        spec: String,
    },
}

/// A force or a torque upon an axis.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Push {
    /// At the motor's shaft, in Nm.
    Torque(f64),
    /// At a stage that moves along a line, in N.
    Force(f64),
}

/// What is on an analog input.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum AnalogLevel {
    /// What its converter reads, 0..=4095, whatever range is selected.
    Reading(u16),
    /// Volt.
    Volts(f64),
}

/// A position of the stage.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Place {
    /// In mm.
    Millimetres(f64),
    /// In degrees.
    Degrees(f64),
    /// In 1/256 full steps of the motor.
    Microsteps(f64),
}

/// The word for a switch.
fn switch_word(switch: SwitchInput) -> &'static str {
    match switch {
        SwitchInput::Left => "left",
        SwitchInput::Right => "right",
        SwitchInput::Home => "home",
    }
}

fn coil_word(coil: Coil) -> char {
    match coil {
        Coil::A => 'A',
        Coil::B => 'B',
    }
}

/// The letter of a hall line or a phase.
pub(super) fn letter(number: u8) -> char {
    match number {
        0 => 'A',
        1 => 'B',
        _ => 'C',
    }
}

impl fmt::Display for Action {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match *self {
            Self::Switch { switch, axis, held } => {
                let word = match held {
                    Some(true) => "press",
                    Some(false) => "release",
                    None => "free",
                };
                write!(f, "{word} {} axis {axis}", switch_word(switch))
            }
            Self::Load { axis, push: Push::Torque(torque) } => {
                write!(f, "load axis {axis} {torque} Nm")
            }
            Self::Load { axis, push: Push::Force(force) } => {
                write!(f, "load axis {axis} {force} N")
            }
            Self::Block { axis, blocked: true } => write!(f, "block axis {axis}"),
            Self::Block { axis, blocked: false } => write!(f, "unblock axis {axis}"),
            Self::Supply(volts) => write!(f, "supply {volts} V"),
            Self::DriverTemperature { axis: None, celsius } => {
                write!(f, "temperature driver {celsius}")
            }
            Self::DriverTemperature { axis: Some(axis), celsius } => {
                write!(f, "temperature driver {celsius} axis {axis}")
            }
            Self::MotorTemperature { axis: None, celsius } => {
                write!(f, "temperature motor {celsius}")
            }
            Self::MotorTemperature { axis: Some(axis), celsius } => {
                write!(f, "temperature motor {celsius} axis {axis}")
            }
            Self::AmbientTemperature(celsius) => write!(f, "temperature ambient {celsius}"),
            Self::BoardTemperature(celsius) => write!(f, "temperature board {celsius}"),
            Self::PowerCycle => f.write_str("power cycle"),
            Self::Power(true) => f.write_str("power on"),
            Self::Power(false) => f.write_str("power off"),
            Self::Input { input, high: true } => write!(f, "input {input} high"),
            Self::Input { input, high: false } => write!(f, "input {input} low"),
            Self::Analog { input, level: AnalogLevel::Reading(reading) } => {
                write!(f, "analog {input} {reading}")
            }
            Self::Analog { input, level: AnalogLevel::Volts(volts) } => {
                write!(f, "analog {input} {volts} V")
            }
            Self::Coil { axis, coil, fault } => {
                let word = match fault {
                    None => "connect",
                    Some(CoilFault::Open) => "disconnect",
                    Some(CoilFault::ShortToGround) => "short",
                };
                write!(f, "{word} coil {} axis {axis}", coil_word(coil))
            }
            Self::Hall { axis, line, fault } => {
                let word = match fault {
                    LineFault::None => "connect",
                    LineFault::StuckHigh => "disconnect",
                    LineFault::StuckLow => "short",
                };
                write!(f, "{word} hall {} axis {axis}", letter(line))
            }
            Self::Phase { axis, phase, open } => {
                let word = if open { "disconnect" } else { "connect" };
                write!(f, "{word} phase {} axis {axis}", letter(phase))
            }
            Self::DriverFault { axis, fault } => {
                write!(f, "driver {} axis {axis}", if fault { "fault" } else { "ok" })
            }
            Self::Position { axis, place } => {
                let (value, unit) = match place {
                    Place::Millimetres(value) => (value, "mm"),
                    Place::Degrees(value) => (value, "deg"),
                    Place::Microsteps(value) => (value, "usteps"),
                };
                write!(f, "set position axis {axis} {value} {unit}")
            }
            Self::Torque { input, allowed } => {
                write!(f, "torque {} input {input}", if allowed { "on" } else { "off" })
            }
            Self::Faults { ref port, ref spec } => write!(f, "faults {port} {spec}"),
        }
    }
}
