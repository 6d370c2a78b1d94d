//! What `expect` and `wait until` look at.

use std::ops::RangeInclusive;

use opentmcl_wire::{Command, Duration, Opcode, control};

use super::names::{Names, is_name, nearest};
use super::number::duration;
use crate::transcript::{Condition, Meaning};

/// How long `wait until` waits unless it says otherwise.
pub(super) const DEFAULT_LIMIT: Duration = Duration::from_secs(10);

/// Axis parameters.
const POSITION: u8 = 1;
const SPEED: u8 = 3;
const POSITION_REACHED: u8 = 8;
/// Banks of ports.
const INPUTS: u8 = 0;
const ANALOG_INPUTS: u8 = 1;
const OUTPUTS: u8 = 2;
/// Banks of global parameters.
const SETTINGS: u8 = 0;
const VARIABLES: u8 = 2;
/// Global parameters: state and counter of the program.
const APPLICATION: u8 = 128;
const COUNTER: u8 = 130;
/// Types of command 135.
const ACCUMULATOR: u8 = 2;
const X: u8 = 3;

const SUBJECTS: [&str; 9] =
    ["position", "speed", "output", "input", "analog", "variable", "program", "accumulator", "x"];

/// The comparisons; the longer ones first, as the shorter ones are parts of them.
const OPERATORS: [&str; 6] = ["<=", ">=", "!=", "<", ">", "="];

/// Conditions with commas between them.
pub(super) fn conditions(text: &str, names: Names<'_>) -> Result<Vec<Condition>, String> {
    text.split(',').map(|condition| one(condition.trim(), names)).collect()
}

/// Conditions, and behind them how long they may take to come true.
pub(super) fn conditions_and_limit(
    text: &str,
    names: Names<'_>,
) -> Result<(Vec<Condition>, Duration), String> {
    let (before, last) = text.rsplit_once(',').unwrap_or(("", text));
    let Some(limit) = last.trim().strip_prefix("at most") else {
        return Ok((conditions(text, names)?, DEFAULT_LIMIT));
    };
    let words: Vec<&str> = limit.split_whitespace().collect();
    let [amount, unit] = words[..] else {
        return Err("the time is missing; write for example: at most 10 s".into());
    };
    Ok((conditions(before, names)?, duration(amount, unit)?))
}

fn one(text: &str, names: Names<'_>) -> Result<Condition, String> {
    let found = OPERATORS.iter().find_map(|operator| Some((operator, text.split_once(operator)?)));
    match found {
        Some((operator, (subject, wanted))) => {
            let subject: Vec<&str> = subject.split_whitespace().collect();
            let (command, meaning) = number_of(&subject, names).map_err(|m| m.in_text(text))?;
            let (range, outside) = compared(operator, wanted.trim(), names)?;
            let expected = described(operator, wanted.trim(), &range);
            Ok(Condition { text: text.to_owned(), command, meaning, range, outside, expected })
        }
        None => state(text, names),
    }
}

/// Why a subject means nothing.
enum NoSubject {
    Unknown,
    Because(String),
}

impl From<String> for NoSubject {
    fn from(message: String) -> Self {
        Self::Because(message)
    }
}

impl NoSubject {
    fn in_text(self, text: &str) -> String {
        match self {
            Self::Because(message) => message,
            Self::Unknown => no_condition(text),
        }
    }
}

fn no_condition(text: &str) -> String {
    let first = text.split_whitespace().next().unwrap_or_default();
    let near = match SUBJECTS.contains(&first) {
        true => String::new(),
        false => nearest(first, SUBJECTS.into_iter()),
    };
    format!(
        "{text:?} is no condition{near}; write for example position 0 = 5000, position 0 reached, \
         speed 0 = 0, variable 42 > 3, output 1 high, input 3 low, analog 0 = 100..200, \
         program stopped, program running, program at Label, accumulator = 5 or x = 2"
    )
}

/// What has a number as its value.
fn number_of(subject: &[&str], names: Names<'_>) -> Result<(Command, Meaning), NoSubject> {
    let gap = |kind, axis| Command::new(Opcode::Gap.number(), kind, axis, 0);
    let gio = |bank, port| Command::new(Opcode::Gio.number(), port, bank, 0);
    let status = |kind| Command::new(control::APPLICATION_STATUS, kind, 0, 0);
    Ok(match *subject {
        ["position", axis] => (gap(POSITION, names.axis(axis)?), Meaning::Number),
        ["speed", axis] => (gap(SPEED, names.axis(axis)?), Meaning::Number),
        ["variable", number] => {
            let number = names.small(number)?;
            (Command::new(Opcode::Ggp.number(), number, VARIABLES, 0), Meaning::Number)
        }
        ["output", port] => (gio(OUTPUTS, names.port(OUTPUTS, "output", port)?), Meaning::Level),
        ["input", port] => (gio(INPUTS, names.port(INPUTS, "input", port)?), Meaning::Level),
        ["analog", port] => {
            let port = names.port(ANALOG_INPUTS, "analog input", port)?;
            (gio(ANALOG_INPUTS, port), Meaning::Number)
        }
        ["accumulator"] => (status(ACCUMULATOR), Meaning::Number),
        ["x"] => (status(X), Meaning::Number),
        _ => return Err(NoSubject::Unknown),
    })
}

/// What is said in words.
fn state(text: &str, names: Names<'_>) -> Result<Condition, String> {
    let words: Vec<&str> = text.split_whitespace().collect();
    let condition = |command, meaning, range, outside, expected: &str| {
        let expected = expected.to_owned();
        Ok(Condition { text: text.to_owned(), command, meaning, range, outside, expected })
    };
    let setting = |number| Command::new(Opcode::Ggp.number(), number, SETTINGS, 0);
    match words[..] {
        [subject @ ("output" | "input"), port, level @ ("high" | "low")] => {
            let (command, meaning) =
                number_of(&[subject, port], names).map_err(|m| m.in_text(text))?;
            let value = i32::from(level == "high");
            condition(command, meaning, value..=value, false, level)
        }
        ["position", axis, "reached"] => {
            let axis = names.axis(axis)?;
            let command = Command::new(Opcode::Gap.number(), POSITION_REACHED, axis, 0);
            condition(command, Meaning::Reached, 1..=1, false, "reached")
        }
        // Besides 0 and 1 there are 2 while a host makes steps, and 3 after a reset.
        ["program", state @ ("running" | "stopped")] => {
            condition(setting(APPLICATION), Meaning::Application, 1..=2, state == "stopped", state)
        }
        ["program", "at", place] => {
            let address = names.address(place)?;
            let expected = if is_name(place) {
                format!("at {place} (address {address})")
            } else {
                format!("at address {address}")
            };
            condition(setting(COUNTER), Meaning::Address, address..=address, false, &expected)
        }
        _ => Err(no_condition(text)),
    }
}

/// The values for which a comparison holds: a range, or all outside of it.
fn compared(
    operator: &str,
    wanted: &str,
    names: Names<'_>,
) -> Result<(RangeInclusive<i32>, bool), String> {
    if wanted.is_empty() {
        return Err(format!("a value is missing behind {operator}"));
    }
    let never = |than: &str| format!("no value is {than} than {wanted}");
    Ok(match operator {
        "=" => (names.range(wanted)?, false),
        "!=" => (names.range(wanted)?, true),
        "<=" => (i32::MIN..=names.value(wanted)?, false),
        ">=" => (names.value(wanted)?..=i32::MAX, false),
        "<" => {
            let below = names.value(wanted)?.checked_sub(1).ok_or_else(|| never("smaller"))?;
            (i32::MIN..=below, false)
        }
        _ => {
            let above = names.value(wanted)?.checked_add(1).ok_or_else(|| never("larger"))?;
            (above..=i32::MAX, false)
        }
    })
}

/// What is expected, with the numbers behind names.
fn described(operator: &str, wanted: &str, range: &RangeInclusive<i32>) -> String {
    let sign = if operator == "=" { String::new() } else { format!("{operator} ") };
    let has_name = wanted.split("..").any(|part| is_name(part.trim().trim_start_matches('-')));
    if !has_name {
        return format!("{sign}{wanted}");
    }
    let (low, high) = (range.start(), range.end());
    let numbers = match operator {
        "=" | "!=" if low != high => format!("{low}..{high}"),
        "<=" => high.to_string(),
        "<" => (i64::from(*high) + 1).to_string(),
        ">" => (i64::from(*low) - 1).to_string(),
        _ => low.to_string(),
    };
    format!("{sign}{wanted} ({numbers})")
}
