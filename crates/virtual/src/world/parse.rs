//! Reading an action.

use std::str::FromStr;

use opentmcl_plant::axis::{Coil, CoilFault, SwitchInput};
use opentmcl_plant::servo::LineFault;

use super::action::{Action, AnalogLevel, Place, Push};
use crate::quantity::{self, Quantity};
use crate::suggest::did_you_mean;

/// What is wrong with the text of an action, and what would be right.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("{0}")]
pub struct ActionError(pub(super) String);

impl ActionError {
    /// There is no module with this number.
    pub(crate) fn no_module(module: usize) -> Self {
        Self(format!("there is no module {module}"))
    }
}

/// First word of each action, and how the action is written.
pub(crate) const FORMS: [(&str, &str); 17] = [
    ("press", "press left axis 0 (left, right or home)"),
    ("release", "release left axis 0 (left, right or home)"),
    ("free", "free left axis 0 (left, right or home)"),
    ("load", "load axis 0 0.3 Nm, or load axis 0 5 N"),
    ("block", "block axis 0"),
    ("unblock", "unblock axis 0"),
    ("supply", "supply 18 V"),
    (
        "temperature",
        "temperature driver 120, temperature driver 120 axis 0, temperature motor 80, temperature ambient 40 or \
         temperature board 60",
    ),
    ("power", "power cycle, power off or power on"),
    ("input", "input 3 high or input 3 low"),
    ("analog", "analog 0 2048, or analog 0 2.5 V"),
    (
        "disconnect",
        "disconnect coil A axis 0, disconnect hall A axis 0 or disconnect phase A axis 0",
    ),
    ("connect", "connect coil A axis 0, connect hall A axis 0 or connect phase A axis 0"),
    ("short", "short coil A axis 0 or short hall A axis 0"),
    ("driver", "driver fault axis 0 or driver ok axis 0"),
    ("set", "set position axis 0 12.5 mm (mm, deg or usteps)"),
    ("torque", "torque off input 0 or torque on input 0"),
];

/// How faults are written; their rest is not for us to read.
pub(crate) const FAULTS_FORM: &str = "faults PORT and what the line shall do";

impl FromStr for Action {
    type Err = ActionError;

    fn from_str(text: &str) -> Result<Self, ActionError> {
        let words: Vec<&str> = text.split_whitespace().collect();
        let Some((&word, rest)) = words.split_first() else {
            return Err(ActionError(
                "an action is missing; write for example press left axis 0".into(),
            ));
        };
        if word == "faults" {
            return faults(text);
        }
        let Some(&(_, form)) = FORMS.iter().find(|(name, _)| *name == word) else {
            let names = || FORMS.iter().map(|form| form.0).chain(["faults"]);
            let near = did_you_mean(word, names());
            let all: Vec<&str> = names().collect();
            return Err(ActionError(format!(
                "{word:?} is no action{near} (actions begin with {})",
                all.join(", ")
            )));
        };
        read(word, rest).map_err(|wrong| {
            ActionError(match wrong {
                Wrong::Form => {
                    format!("{text:?} is not complete or has too much; write {form}")
                }
                Wrong::Word { word, expected } => {
                    let near = did_you_mean(word, expected.iter().copied());
                    format!("{word:?} is not {}{near} (write {form})", one_of(expected))
                }
                Wrong::Value(message) => format!("{message} (write {form})"),
            })
        })
    }
}

/// Why the words after the first one are no action.
enum Wrong<'a> {
    Form,
    Word { word: &'a str, expected: &'static [&'static str] },
    Value(String),
}

fn one_of(words: &[&str]) -> String {
    match words {
        [] => String::new(),
        [one] => format!("{one:?}"),
        [front @ .., last] => {
            let front: Vec<String> = front.iter().map(|word| format!("{word:?}")).collect();
            format!("{} or {last:?}", front.join(", "))
        }
    }
}

fn faults(text: &str) -> Result<Action, ActionError> {
    let rest = text.trim_start().strip_prefix("faults").unwrap_or_default().trim();
    match rest.split_once(char::is_whitespace) {
        Some((port, spec)) => {
            Ok(Action::Faults { port: port.to_owned(), spec: spec.trim().to_owned() })
        }
        None => Err(ActionError(format!("{text:?} is not complete; write {FAULTS_FORM}"))),
    }
}

fn read<'a>(word: &'a str, rest: &[&'a str]) -> Result<Action, Wrong<'a>> {
    match (word, rest) {
        ("press" | "release" | "free", &[switch, axis_word, number]) => {
            let switch = match switch {
                "left" => SwitchInput::Left,
                "right" => SwitchInput::Right,
                "home" => SwitchInput::Home,
                word => return Err(Wrong::Word { word, expected: &["left", "right", "home"] }),
            };
            let held = match word {
                "press" => Some(true),
                "release" => Some(false),
                _ => None,
            };
            Ok(Action::Switch { switch, axis: axis(axis_word, number)?, held })
        }
        ("load", &[axis_word, number, ref push @ ..]) if !push.is_empty() => {
            let axis = axis(axis_word, number)?;
            let push = match value(push, &[Quantity::Torque, Quantity::Force])? {
                (Quantity::Force, force) => Push::Force(force),
                (_, torque) => Push::Torque(torque),
            };
            Ok(Action::Load { axis, push })
        }
        ("block" | "unblock", &[axis_word, number]) => {
            Ok(Action::Block { axis: axis(axis_word, number)?, blocked: word == "block" })
        }
        ("supply", volts) if !volts.is_empty() => {
            let (_, volts) = value(volts, &[Quantity::Voltage])?;
            if !(0.0..=100.0).contains(&volts) {
                return Err(Wrong::Value(format!(
                    "a supply of {volts} V is not from 0 V to 100 V"
                )));
            }
            Ok(Action::Supply(volts))
        }
        ("temperature", &["driver", celsius]) => {
            Ok(Action::DriverTemperature { axis: None, celsius: temperature(celsius)? })
        }
        ("temperature", &["driver", celsius, axis_word, number]) => {
            let axis = Some(axis(axis_word, number)?);
            Ok(Action::DriverTemperature { axis, celsius: temperature(celsius)? })
        }
        ("temperature", &["motor", celsius]) => {
            Ok(Action::MotorTemperature { axis: None, celsius: temperature(celsius)? })
        }
        ("temperature", &["motor", celsius, axis_word, number]) => {
            let axis = Some(axis(axis_word, number)?);
            Ok(Action::MotorTemperature { axis, celsius: temperature(celsius)? })
        }
        ("temperature", &["ambient", celsius]) => {
            Ok(Action::AmbientTemperature(temperature(celsius)?))
        }
        ("temperature", &["board", celsius]) => Ok(Action::BoardTemperature(temperature(celsius)?)),
        ("temperature", &[word, ..]) if !TEMPERATURES.contains(&word) => {
            Err(Wrong::Word { word, expected: &TEMPERATURES })
        }
        ("power", &["cycle"]) => Ok(Action::PowerCycle),
        ("power", &["on"]) => Ok(Action::Power(true)),
        ("power", &["off"]) => Ok(Action::Power(false)),
        ("power", &[word]) => Err(Wrong::Word { word, expected: &["cycle", "off", "on"] }),
        ("input", &[input, level]) => {
            let high = match level {
                "high" => true,
                "low" => false,
                word => return Err(Wrong::Word { word, expected: &["high", "low"] }),
            };
            Ok(Action::Input { input: small(input)?, high })
        }
        ("analog", &[input, reading]) if reading.bytes().all(|byte| byte.is_ascii_digit()) => {
            let reading = reading.parse().ok().filter(|&reading| reading <= 4095);
            let reading = reading
                .ok_or_else(|| Wrong::Value("a reading is a number from 0 to 4095".into()))?;
            Ok(Action::Analog { input: small(input)?, level: AnalogLevel::Reading(reading) })
        }
        ("analog", &[input, ref volts @ ..]) if !volts.is_empty() => {
            let (_, volts) = value(volts, &[Quantity::Voltage])?;
            Ok(Action::Analog { input: small(input)?, level: AnalogLevel::Volts(volts) })
        }
        ("disconnect" | "connect" | "short", &["coil", coil, axis_word, number]) => {
            let coil = match coil {
                "A" | "a" => Coil::A,
                "B" | "b" => Coil::B,
                word => return Err(Wrong::Word { word, expected: &["A", "B"] }),
            };
            let fault = match word {
                "disconnect" => Some(CoilFault::Open),
                "short" => Some(CoilFault::ShortToGround),
                _ => None,
            };
            Ok(Action::Coil { axis: axis(axis_word, number)?, coil, fault })
        }
        ("disconnect" | "connect" | "short", &["hall", line, axis_word, number]) => {
            let fault = match word {
                "disconnect" => LineFault::StuckHigh,
                "short" => LineFault::StuckLow,
                _ => LineFault::None,
            };
            Ok(Action::Hall { axis: axis(axis_word, number)?, line: lettered(line)?, fault })
        }
        ("disconnect" | "connect", &["phase", phase, axis_word, number]) => {
            let (axis, phase) = (axis(axis_word, number)?, lettered(phase)?);
            Ok(Action::Phase { axis, phase, open: word == "disconnect" })
        }
        ("disconnect" | "connect", &[word, _, _, _]) => {
            Err(Wrong::Word { word, expected: &["coil", "hall", "phase"] })
        }
        ("short", &[word, _, _, _]) => Err(Wrong::Word { word, expected: &["coil", "hall"] }),
        ("driver", &[state, axis_word, number]) => {
            let fault = match state {
                "fault" => true,
                "ok" => false,
                word => return Err(Wrong::Word { word, expected: &["fault", "ok"] }),
            };
            Ok(Action::DriverFault { axis: axis(axis_word, number)?, fault })
        }
        ("set", &["position", axis_word, number, ref place @ ..]) if !place.is_empty() => {
            let axis = axis(axis_word, number)?;
            let kinds = [Quantity::Length, Quantity::Angle, Quantity::Microsteps];
            let place = match value(place, &kinds)? {
                (Quantity::Length, value) => Place::Millimetres(value),
                (Quantity::Angle, value) => Place::Degrees(value),
                (_, value) => Place::Microsteps(value),
            };
            Ok(Action::Position { axis, place })
        }
        ("torque", &[level, "input", input]) => {
            let allowed = match level {
                "on" => true,
                "off" => false,
                word => return Err(Wrong::Word { word, expected: &["off", "on"] }),
            };
            Ok(Action::Torque { input: small(input)?, allowed })
        }
        _ => Err(Wrong::Form),
    }
}

/// What has a temperature.
const TEMPERATURES: [&str; 4] = ["driver", "motor", "ambient", "board"];

/// A hall line or a phase by its letter.
fn lettered(text: &str) -> Result<u8, Wrong<'_>> {
    match text {
        "A" | "a" => Ok(0),
        "B" | "b" => Ok(1),
        "C" | "c" => Ok(2),
        word => Err(Wrong::Word { word, expected: &["A", "B", "C"] }),
    }
}

fn axis<'a>(word: &'a str, number: &'a str) -> Result<u8, Wrong<'a>> {
    if word != "axis" {
        return Err(Wrong::Word { word, expected: &["axis"] });
    }
    small(number)
}

fn small(number: &str) -> Result<u8, Wrong<'_>> {
    number.parse().map_err(|_| Wrong::Value(format!("{number:?} is not a number from 0 to 255")))
}

fn value<'a>(words: &[&'a str], quantities: &[Quantity]) -> Result<(Quantity, f64), Wrong<'a>> {
    quantity::parse(&words.join(" "), quantities).map_err(Wrong::Value)
}

/// Degrees Celsius with or without the unit.
fn temperature(text: &str) -> Result<f64, Wrong<'_>> {
    let celsius = match quantity::number(text) {
        Some(celsius) => celsius,
        None => quantity::parse(text, &[Quantity::Temperature]).map_err(Wrong::Value)?.1,
    };
    if (-55.0..=250.0).contains(&celsius) {
        return Ok(celsius);
    }
    Err(Wrong::Value(format!("a temperature of {celsius} °C is not from -55 to 250 °C")))
}
