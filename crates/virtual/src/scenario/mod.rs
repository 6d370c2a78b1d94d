//! Scenarios: modules and the machines behind their axes, described in a TOML text.
//!
//! [`Scenario::parse`] reads such a text and tells all that is wrong with it, each with its place. All
//! that comes out is checked: machines are in the units of the motor's shaft, actions name axes and
//! inputs that exist. The format is described in the book, `docs/scenarios.md`.

mod axis;
mod machine;
mod module;
mod motor;
mod plan;
mod read;
mod scale;
mod servo;

use std::fmt;
use std::path::PathBuf;

use opentmcl_catalog::{Module, Motion};
use opentmcl_plant::machine::{Encoder, Machine, Stage, Switches};
use opentmcl_plant::servo::{Halls, Machine as ServoMachine, Motor, Noise, motor as servo_motor};
use opentmcl_wire::Instant;
use toml::de::DeTable;

use crate::world::{Action, Wave};
use read::Reader;

pub(crate) use scale::SERVO_TURN;
pub use scale::{Scale, StageUnit};

/// One or more modules with their machines.
#[derive(Clone, Debug)]
pub struct Scenario {
    /// Where it comes from, as the user knows it.
    pub name: String,
    /// The modules; at least one, each with a name of its own.
    pub modules: Vec<ModuleSetup>,
}

/// A module and what is around it.
#[derive(Clone, Debug)]
pub struct ModuleSetup {
    /// Its name in the scenario.
    pub name: String,
    /// What kind of module it is.
    pub model: &'static Module,
    /// One for each axis of the model.
    pub axes: Vec<AxisSetup>,
    /// What is so from the beginning, in this order.
    pub start: Vec<Action>,
    /// What happens at set times, in the order in which it is written.
    pub timeline: Vec<(Instant, Action)>,
    /// What changes periodically.
    pub waves: Vec<Wave>,
    /// The file that keeps the EEPROM when the module is served, as it is written.
    pub eeprom: Option<PathBuf>,
    /// Where the module is served; empty leaves it to whoever serves it.
    pub ports: Vec<PortSetup>,
}

/// An axis.
#[derive(Clone, Debug, Default)]
pub struct AxisSetup {
    /// Its motor and what that turns. A stepper axis without follows every step, in empty space; a servo axis
    /// always has one.
    pub machine: Option<MachineSetup>,
    /// How its stage is measured.
    pub scale: Scale,
}

/// The machine behind an axis, with a motor of the kind that the module drives.
#[derive(Clone, Debug, PartialEq)]
pub enum MachineSetup {
    /// A stepper motor.
    Stepper(Box<Machine>),
    /// A servo motor.
    Servo(Box<ServoSetup>),
}

/// The machine behind a servo axis, and how its currents are measured.
#[derive(Clone, Debug, PartialEq)]
pub struct ServoSetup {
    /// The machine.
    pub machine: ServoMachine,
    /// Noise of the converters of the currents.
    pub noise: Noise,
}

/// The motor of a servo module about whose machine nothing is said.
const USUAL_MOTOR: &str = "qbl4208-61-04-013";

impl ServoSetup {
    /// What a servo module has behind it if nothing is said: a motor that turns nothing but itself, with halls, and
    /// with an encoder of 4096 counts.
    ///
    /// Behind field-oriented control, halls and encoder are wired as the vendor's examples for this motor expect
    /// them: with the polarity of the halls inverted and the direction of the encoder reversed.
    pub fn usual(motion: Motion) -> Self {
        let usual = servo_motor::preset(USUAL_MOTOR).unwrap_or(servo_motor::PRESETS[0].motor);
        let mut machine = ServoMachine::new(Motor::Brushless(usual));
        if motion == Motion::Foc {
            machine.halls = machine.halls.map(|halls| Halls { inverted: true, ..halls });
            machine.encoder = machine.encoder.map(|encoder| Encoder { reversed: true, ..encoder });
        }
        Self { machine, noise: Noise::default() }
    }
}

impl MachineSetup {
    /// Where the way ends.
    pub fn stage(&self) -> &Stage {
        match self {
            Self::Stepper(machine) => &machine.stage,
            Self::Servo(servo) => &servo.machine.stage,
        }
    }

    /// The switches along the way.
    pub fn switches(&self) -> &Switches {
        match self {
            Self::Stepper(machine) => &machine.switches,
            Self::Servo(servo) => &servo.machine.switches,
        }
    }

    /// The machine, if it has a stepper motor.
    pub fn stepper(&self) -> Option<&Machine> {
        match self {
            Self::Stepper(machine) => Some(machine),
            Self::Servo(_) => None,
        }
    }

    /// The machine, if it has a servo motor.
    pub fn servo(&self) -> Option<&ServoSetup> {
        match self {
            Self::Stepper(_) => None,
            Self::Servo(servo) => Some(servo),
        }
    }
}

/// A port where a module is served.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct PortSetup {
    /// Its name, unique in the module: as written, or `pty` or `tcp`.
    pub name: String,
    /// What it is.
    pub kind: PortKind,
    /// Faults of its line, as they are written; whoever serves it reads them.
    pub faults: Option<String>,
    /// Line of the file where the port begins, for messages about `faults`.
    pub line: usize,
}

/// What a port is.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum PortKind {
    /// A pseudo terminal, and the path of a link to it if there is one.
    Pty(Option<PathBuf>),
    /// A socket: `HOST:PORT`, `HOST` or `PORT`.
    Tcp(String),
}

/// One thing that is wrong with a scenario.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Mistake {
    /// The file, as given to [`Scenario::parse`].
    pub file: String,
    /// Line, counted from 1.
    pub line: usize,
    /// Character in the line, counted from 1.
    pub column: usize,
    /// What is wrong and what would be right.
    pub message: String,
}

impl fmt::Display for Mistake {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { file, line, column, message } = self;
        write!(f, "{file}:{line}:{column}: {message}")
    }
}

/// All that is wrong with a scenario, in the order of the text; at least one thing.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Mistakes(pub Vec<Mistake>);

impl fmt::Display for Mistakes {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        for (at, mistake) in self.0.iter().enumerate() {
            write!(f, "{}{mistake}", if at == 0 { "" } else { "\n" })?;
        }
        Ok(())
    }
}

impl std::error::Error for Mistakes {}

impl Scenario {
    /// Reads a scenario; `name` is what messages call it.
    ///
    /// # Errors
    /// All that is wrong with it.
    ///
    /// ```
    /// use opentmcl_virtual::Scenario;
    ///
    /// let text = r#"
    /// [[module]]
    /// model = "tmcm-6214"
    /// [[module.axis]]
    /// axis = 0
    /// motor = "nema17"
    /// transmission = { screw = "5 kg" }
    /// "#;
    /// let mistakes = Scenario::parse("lab.toml", text).unwrap_err();
    /// assert!(mistakes.to_string().starts_with("lab.toml:7:26: \"5 kg\" has another unit"));
    /// ```
    pub fn parse(name: &str, text: &str) -> Result<Self, Mistakes> {
        let mut reader = Reader::new(name, text);
        let (document, errors) = DeTable::parse_recoverable(text);
        for error in &errors {
            reader.mistake(error.span().unwrap_or(0..0), one_line(error.message()));
        }
        if !errors.is_empty() {
            // A table that was not understood to its end would be told to lack what stands there.
            return Err(Mistakes(reader.mistakes()));
        }
        let root = reader.known(document.get_ref(), 0..0, "a scenario", &["module"]);
        let modules = module::modules(&mut reader, &root);
        let mistakes = reader.mistakes();
        if mistakes.is_empty() {
            Ok(Self { name: name.to_owned(), modules })
        } else {
            Err(Mistakes(mistakes))
        }
    }

    /// A single module with nothing around it.
    pub fn of_model(model: &'static Module) -> Self {
        Self { name: model.name.to_owned(), modules: vec![ModuleSetup::new(model)] }
    }

    /// The module with this name.
    pub fn module(&self, name: &str) -> Option<&ModuleSetup> {
        self.modules.iter().find(|module| module.name == name)
    }
}

impl ModuleSetup {
    /// A module with ideal axes and nothing around it, called as its model is. A servo module has its
    /// [usual machine](ServoSetup::usual).
    pub fn new(model: &'static Module) -> Self {
        let axis = if model.motion.is_servo() {
            let usual = MachineSetup::Servo(Box::new(ServoSetup::usual(model.motion)));
            AxisSetup { machine: Some(usual), scale: Scale::rotary(scale::SERVO_TURN, 1.0) }
        } else {
            AxisSetup::default()
        };
        Self {
            name: model.name.to_owned(),
            model,
            axes: vec![axis; usize::from(model.axes)],
            start: Vec::new(),
            timeline: Vec::new(),
            waves: Vec::new(),
            eeprom: None,
            ports: Vec::new(),
        }
    }
}

/// A message of the TOML parser without its line breaks.
fn one_line(message: &str) -> String {
    message.split_whitespace().collect::<Vec<_>>().join(" ")
}
