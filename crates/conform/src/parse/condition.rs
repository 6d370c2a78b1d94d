//! What `expect` and `wait until` look at.

use std::ops::RangeInclusive;

use opentmcl_wire::limits::VARIABLE_BANK;
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
/// Bank of global parameters about the module.
const SETTINGS: u8 = 0;
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
    if !SUBJECTS.contains(&first) {
        let near = nearest(first, SUBJECTS.into_iter());
        if !near.is_empty() {
            return format!("{text:?} is no condition{near}");
        }
    }
    format!(
        "{text:?} is no condition; write for example position 0 = 5000, position 0 reached, \
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
            (Command::new(Opcode::Ggp.number(), number, VARIABLE_BANK, 0), Meaning::Number)
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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::programs::Assembled;

    fn program() -> Assembled {
        Assembled {
            labels: vec![("Loop".into(), 12), ("Hold".into(), 3)],
            constants: vec![("Home".into(), 5000), ("Motor0".into(), 2), ("Huge".into(), 70000)],
            ..Assembled::default()
        }
    }

    #[track_caller]
    fn read(text: &str) -> Result<Condition, String> {
        let program = program();
        let module = opentmcl_catalog::find("tmcm-6214");
        one(text, Names { program: Some(&program), module })
    }

    /// Command by number, type and motor as the manual has them, and the values that are met.
    #[track_caller]
    fn asks(text: &str, command: (u8, u8, u8), met: &[i32], unmet: &[i32]) {
        let condition = read(text).unwrap();
        let (number, kind, motor) = command;
        assert_eq!(condition.command, Command::new(number, kind, motor, 0), "{text}");
        for &value in met {
            assert!(condition.is_met(value), "{text} with {value}");
        }
        for &value in unmet {
            assert!(!condition.is_met(value), "{text} with {value}");
        }
    }

    #[test]
    fn each_condition_asks_with_the_command_that_a_host_would_send() {
        asks("position 0 = 5", (6, 1, 0), &[5], &[4, 6]);
        asks("position 3 reached", (6, 8, 3), &[1], &[0]);
        asks("speed 1 = 0", (6, 3, 1), &[0], &[1]);
        asks("variable 42 = 3", (10, 42, 2), &[3], &[2]);
        asks("output 1 high", (15, 1, 2), &[1], &[0]);
        asks("output 1 low", (15, 1, 2), &[0], &[1]);
        asks("input 3 high", (15, 3, 0), &[1], &[0]);
        asks("analog 4 = 7", (15, 4, 1), &[7], &[8]);
        // Global parameter 128: 0 stopped, 1 running, 2 in steps, 3 after a reset.
        asks("program running", (10, 128, 0), &[1, 2], &[0, 3]);
        asks("program stopped", (10, 128, 0), &[0, 3], &[1, 2]);
        asks("program at 7", (10, 130, 0), &[7], &[8]);
        asks("accumulator = -1", (135, 2, 0), &[-1], &[0]);
        asks("x = $10", (135, 3, 0), &[16], &[10]);
    }

    #[test]
    fn every_comparison_has_the_values_that_it_says() {
        let position = (6, 1, 0);
        asks("position 0 = -5..5", position, &[-5, 5], &[-6, 6]);
        asks("position 0 != 5", position, &[4, 6], &[5]);
        asks("position 0 < 5", position, &[4, i32::MIN], &[5]);
        asks("position 0 <= 5", position, &[5], &[6]);
        asks("position 0 > 5", position, &[6, i32::MAX], &[5]);
        asks("position 0>=5", position, &[5], &[4]);
    }

    #[test]
    fn names_of_the_program_stand_for_numbers() {
        asks("position Motor0 = HOME", (6, 1, 2), &[5000], &[0]);
        asks("position 0 = -Home..home", (6, 1, 0), &[-5000, 5000], &[-5001, 5001]);
        asks("program at loop", (10, 130, 0), &[12], &[3]);
        assert_eq!(read("position 0 = Home").unwrap().expected, "Home (5000)");
        assert_eq!(read("position 0 < Home").unwrap().expected, "< Home (5000)");
        assert_eq!(read("position 0 > Home").unwrap().expected, "> Home (5000)");
        assert_eq!(read("position 0 = -Home..7").unwrap().expected, "-Home..7 (-5000..7)");
        assert_eq!(read("position 0 = 7..8").unwrap().expected, "7..8");
    }

    #[test]
    fn what_is_wrong_is_named_with_what_would_be_right() {
        for (text, message) in [
            ("position 6 = 5", "there is no axis 6; TMCM-6214 has axes 0 to 5"),
            ("position 0 = Hme", "the program has no constant Hme; did you mean Home?"),
            ("position 0 = Loop", "the program has no constant Loop; it is a label"),
            ("program at Loup", "the program has no label Loup; did you mean Loop?"),
            ("program at Home", "the program has no label Home"),
            ("variable Huge = 5", "Huge is 70000, which is not a number from 0 to 255"),
            ("variable 256 = 5", "256 is not a number from 0 to 255"),
            ("output 9 high", "TMCM-6214 has no output 9"),
            ("position 0 =", "a value is missing behind ="),
            ("position 0 = 5..4", "the range 5..4 is empty"),
            ("position 0 = 99999999999", "\"99999999999\" is no value"),
            ("position 0 > 2147483647", "no value is larger than 2147483647"),
            ("postion 0 = 5", "\"postion 0 = 5\" is no condition; did you mean position?"),
            ("program asleep", "\"program asleep\" is no condition; write"),
            ("output 1 = ", "a value is missing"),
            ("", "\"\" is no condition"),
        ] {
            let told = read(text).unwrap_err();
            assert!(told.starts_with(message), "{text}: {told}");
        }
        let none = Names { program: None, module: None };
        assert!(one("x = Home", none).unwrap_err().contains("no program is loaded from a file"));
    }

    #[test]
    fn a_limit_may_follow_and_is_ten_seconds_otherwise() {
        let names = Names { program: None, module: None };
        let (found, limit) =
            conditions_and_limit("x = 1, accumulator = 2, at most 3 ms", names).unwrap();
        assert_eq!((found.len(), limit), (2, Duration::from_millis(3)));
        let (found, limit) = conditions_and_limit("x = 1, accumulator = 2", names).unwrap();
        assert_eq!((found.len(), limit), (2, Duration::from_secs(10)));
        for (text, message) in [
            ("x = 1, at most", "the time is missing"),
            ("x = 1, at most 3 minutes", "\"minutes\" is no unit of time"),
            ("at most 3 s", "\"\" is no condition"),
        ] {
            let told = conditions_and_limit(text, names).unwrap_err();
            assert!(told.starts_with(message), "{text}: {told}");
        }
    }
}
