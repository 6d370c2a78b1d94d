//! What keeps a servo from following, in words, with the next step.

use opentmcl_catalog::{AxisBehaviour, AxisParameter, Foc, Module, Servo};
use opentmcl_wire::Duration;

use super::line::Line;
use super::regulator::{find, named, parameter};
use crate::failure::Failure;

/// Longer than any initialization of an encoder takes.
const INITIALIZATION: Duration = Duration::from_secs(20);

/// Between two questions whether it is over.
const PAUSE: Duration = Duration::from_millis(10);

/// Status flags that tell of trouble, by the words with which the catalogue begins to explain them: whether the
/// bridge is off meanwhile, and what to do.
const TROUBLES: [(&str, bool, &str); 7] = [
    (
        "overcurrent",
        false,
        "the current reached its limit; a smaller step, or a higher limit if motor and supply bear it",
    ),
    (
        "undervoltage",
        true,
        "check the supply of the motor, and whether it breaks down while the motor accelerates",
    ),
    (
        "overvoltage",
        true,
        "a braking motor feeds the supply; brake more slowly, or use a brake chopper",
    ),
    ("overtemperature", true, "let the driver cool down"),
    ("hall error", false, "check the wiring of the hall lines and their polarity"),
    (
        "driver error",
        true,
        "check the phases for a short circuit, then acknowledge the fault or switch the power off and on",
    ),
    ("initialization error", true, "let the motor turn freely and begin the initialization anew"),
];

/// Trouble that a status flag tells of.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Trouble {
    pub(super) name: &'static str,
    /// Whether the bridge is off meanwhile.
    stops: bool,
    pub(super) help: &'static str,
}

/// The one that is no fault: a regulator with much to do takes all the current that it may.
const OVERCURRENT: &str = "overcurrent";

impl Trouble {
    /// Whether it may be why a motor does not follow.
    pub(super) fn is_cause(self) -> bool {
        self.name != OVERCURRENT
    }
}

/// Looks at the status flags. Reading them may clear them.
fn troubles(line: &mut Line, module: &'static Module) -> Result<Vec<Trouble>, Failure> {
    let row = parameter(module, Servo::StatusFlags)?;
    let flags = line.read(row)?;
    Ok(told(row, flags))
}

/// Each trouble that status flags tell of over time, with the first time.
pub(super) fn over_time(
    row: &AxisParameter,
    flags: &[(Duration, i32)],
) -> Vec<(Duration, Trouble)> {
    let mut found: Vec<(Duration, Trouble)> = Vec::new();
    let mut before = 0;
    for &(time, flags) in flags {
        for trouble in told(row, flags & !before) {
            if found.iter().all(|(_, known)| *known != trouble) {
                found.push((time, trouble));
            }
        }
        before = flags;
    }
    found
}

fn told(row: &AxisParameter, flags: i32) -> Vec<Trouble> {
    let set = row.values.iter().filter(|(bit, _)| flags & bit != 0);
    set.filter_map(|(_, text)| {
        let name = text.split(':').next().unwrap_or_default();
        let (name, stops, help) = *TROUBLES.iter().find(|trouble| trouble.0 == name)?;
        Some(Trouble { name, stops, help })
    })
    .collect()
}

/// Waits for an initialization of the encoder, and fails if the motor could not turn.
pub(super) fn must_be_ready(
    line: &mut Line,
    module: &'static Module,
    is_interrupted: &dyn Fn() -> bool,
) -> Result<(), Failure> {
    must_commutate(line, module)?;
    await_initialization(line, module, is_interrupted)?;
    // What happened before the run is not of interest.
    troubles(line, module)?;
    match troubles(line, module)?.into_iter().find(|trouble| trouble.stops) {
        Some(Trouble { name, help, .. }) => {
            Err(Failure::new(format!("the motor is off: {name}")).help(help))
        }
        None => Ok(()),
    }
}

/// Fails if nothing leads the current through the phases as the rotor turns.
fn must_commutate(line: &mut Line, module: &'static Module) -> Result<(), Failure> {
    for (effect, useless, consequence) in [
        (Foc::CommutationMode, "disabled", "nothing turns"),
        (Foc::CommutationMode, "open loop", "nothing is regulated"),
        (Foc::MotorType, "none", "nothing turns"),
        (Foc::DriverEnable, "off", "nothing turns"),
    ] {
        let Some(row) = find(module, AxisBehaviour::Foc(effect)) else { continue };
        let value = line.read(row)?;
        let meaning = |value| {
            let found = row.values.iter().find(|(other, _)| *other == value);
            found.map_or("", |(_, text)| text.split(':').next().unwrap_or_default())
        };
        if meaning(value) != useless {
            continue;
        }
        let is_choice = |text: &str| !["disabled", "open loop", "none", "off"].contains(&text);
        let choices: Vec<_> = row
            .values
            .iter()
            .filter(|(value, _)| is_choice(meaning(*value)))
            .map(|(value, _)| format!("{value} ({})", meaning(*value)))
            .collect();
        let message = format!("{consequence} while {} is {value}, {useless}", named(row));
        return Err(Failure::new(message).help(format!(
            "set it on the module, or for this run with --set {}=N; N is {}",
            row.id,
            choices.join(", ")
        )));
    }
    Ok(())
}

fn await_initialization(
    line: &mut Line,
    module: &'static Module,
    is_interrupted: &dyn Fn() -> bool,
) -> Result<(), Failure> {
    let Some(row) = find(module, AxisBehaviour::Foc(Foc::EncoderInitState)) else { return Ok(()) };
    let end = line.now() + INITIALIZATION;
    // A change of the commutation takes effect in the next millisecond.
    line.wait_until(line.now() + PAUSE);
    while line.read(row)? != 0 {
        if is_interrupted() {
            return Err(Failure::new("interrupted"));
        }
        if line.now() >= end {
            let message = format!(
                "the encoder's initialization is not over after {} s, by {}",
                INITIALIZATION.as_secs(),
                named(row)
            );
            return Err(Failure::new(message)
                .help("can the motor turn, and does it have enough current meanwhile?"));
        }
        line.wait_until(line.now() + PAUSE);
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use opentmcl_catalog::MODULES;

    use super::*;

    #[test]
    fn each_trouble_is_a_flag_of_each_servo_module_and_no_other_flag_is() {
        let mut modules = 0;
        for module in MODULES {
            let Ok(row) = parameter(module, Servo::StatusFlags) else { continue };
            modules += 1;
            let names: Vec<_> = told(row, -1).iter().map(|trouble| trouble.name).collect();
            assert_eq!(names.len(), TROUBLES.len(), "{names:?}");
            assert_eq!(told(row, row.default), [], "a fresh {} has none", module.title);
        }
        assert!(modules >= 2);
    }
}
