//! The step itself: set up, command, sample, stop, restore.

use opentmcl_catalog::{AxisParameter, Module, Servo};
use opentmcl_wire::{Duration, TICKS_PER_SECOND};

use super::health::{self, Trouble};
use super::line::Line;
use super::regulator::{Parameters, Regulator, named, parameter, unit};
use super::settings::Changed;
use crate::failure::Failure;

/// A motor that does not get slower for so long will not stop.
const PATIENCE: Duration = Duration::from_secs(1);

/// Longest time until a motor that gets slower stands.
const STOPPING: Duration = Duration::from_secs(30);

/// A motor of at most so many revolutions per minute is as good as stopped: friction takes the rest, and a coarse
/// sensor does not tell slower speeds at once.
const CREEPING: i32 = 20;

/// Between two questions whether it does.
const PAUSE: Duration = Duration::from_millis(10);

/// What is to be done.
pub(super) struct Plan {
    pub(super) module: &'static Module,
    pub(super) regulator: Regulator,
    pub(super) parameters: Parameters,
    /// The target; of the position, its distance from where the motor is.
    pub(super) step: i32,
    /// Parameters for the run in their order, and whether they keep their values.
    pub(super) settings: Vec<(&'static AxisParameter, i32, bool)>,
    pub(super) duration: Duration,
    /// Samples per second, at most.
    pub(super) rate: u32,
}

/// A quantity over time.
pub(super) struct Channel {
    /// What it is: `velocity`.
    pub(super) quantity: &'static str,
    pub(super) row: &'static AxisParameter,
    /// Time since the step, ascending, and value.
    pub(super) points: Vec<(Duration, i32)>,
}

/// What happened.
pub(super) struct Run {
    /// Value and target before and after the step.
    pub(super) from: i32,
    pub(super) to: i32,
    /// Gains during the run.
    pub(super) p: i32,
    pub(super) i: Option<i32>,
    /// The quantity that is regulated, and then the others.
    pub(super) channels: Vec<Channel>,
    /// What status flags told of, and when first.
    pub(super) troubles: Vec<(Duration, Trouble)>,
    /// The speed of the motor when it should have stood still after the run, so that its torque was set to 0; none if
    /// it stood.
    pub(super) still_turns: Option<i32>,
}

/// Carries it out. However it ends, the motor is stopped and the settings are restored.
pub(super) fn play(
    line: &mut Line,
    plan: &Plan,
    is_interrupted: &dyn Fn() -> bool,
) -> Result<Run, Failure> {
    let mut changed = Changed::default();
    let mut has_stepped = false;
    let result = step(line, plan, &mut changed, &mut has_stepped, is_interrupted);
    let stopped = if has_stepped { stop(line, plan.module, &mut changed) } else { Ok(None) };
    let restored = changed.restore(line);
    let mut run = result?;
    run.still_turns = stopped?;
    restored?;
    Ok(run)
}

fn step(
    line: &mut Line,
    plan: &Plan,
    changed: &mut Changed,
    has_stepped: &mut bool,
    is_interrupted: &dyn Fn() -> bool,
) -> Result<Run, Failure> {
    for &(row, value, is_kept) in &plan.settings {
        changed.set(line, row, value, is_kept)?;
    }
    health::must_be_ready(line, plan.module, is_interrupted)?;
    let Parameters { target, actual, p, i, limit, .. } = &plan.parameters;
    let from = line.read(actual)?;
    let to = match plan.regulator {
        Regulator::Position => from.saturating_add(plan.step),
        Regulator::Torque | Regulator::Velocity => plan.step,
    };
    if to == from {
        return Err(Failure::usage(format!(
            "there is no step: the {} is {to} {} already",
            plan.regulator.quantity(),
            unit(actual)
        )));
    }
    if let Some(limit) = limit {
        let highest = line.read(limit)?;
        if i64::from(to).abs() > i64::from(highest) {
            let message = format!(
                "the step to {to} {} is beyond {}, which is {highest}",
                unit(actual),
                named(limit)
            );
            return Err(Failure::usage(message).help(format!(
                "make a smaller step, or raise the limit for this run with --set {}={}",
                limit.id,
                i64::from(to).abs()
            )));
        }
    }
    let (p, i) = (line.read(p)?, i.map(|i| line.read(i)).transpose()?);
    *has_stepped = true;
    let start = line.now();
    line.write(target, to)?;
    let (channels, status) = sample(line, plan, start, is_interrupted)?;
    let troubles = health::over_time(status.row, &status.points);
    Ok(Run { from, to, p, i, channels, troubles, still_turns: None })
}

/// Reads all quantities and the status at a steady rate in virtual time. On a line each question takes its time:
/// there each turn has the quantity that is regulated and one of the others.
fn sample(
    line: &mut Line,
    plan: &Plan,
    start: Duration,
    is_interrupted: &dyn Fn() -> bool,
) -> Result<(Vec<Channel>, Channel), Failure> {
    let channel = |(quantity, row)| Channel { quantity, row, points: Vec::new() };
    let mut channels = vec![channel((plan.regulator.quantity(), plan.parameters.actual))];
    channels.extend(plan.parameters.companions.iter().copied().map(channel));
    let mut status = channel(("status", parameter(plan.module, Servo::StatusFlags)?));
    let mut turns: u64 = 0;
    loop {
        if is_interrupted() {
            return Err(Failure::new("interrupted"));
        }
        let (main, others) = channels.split_at_mut(1);
        main.iter_mut().try_for_each(|main| ask(line, main, start))?;
        let mut others: Vec<_> = others.iter_mut().chain([&mut status]).collect();
        if line.is_virtual() {
            others.into_iter().try_for_each(|other| ask(line, other, start))?;
        } else if let Some(other) = others.iter_mut().min_by_key(|other| other.points.len()) {
            ask(line, other, start)?;
        }
        turns += 1;
        let due = Duration::from_ticks(turns * TICKS_PER_SECOND / u64::from(plan.rate));
        // Behind its time it goes on as fast as it can.
        if due.max(line.now() - start) > plan.duration {
            break;
        }
        line.wait_until(start + due);
    }
    Ok((channels, status))
}

/// Adds a value. It is taken as that of the middle between question and answer.
fn ask(line: &mut Line, channel: &mut Channel, start: Duration) -> Result<(), Failure> {
    let asked = line.now();
    let value = line.read(channel.row)?;
    let time = (asked - start) + (line.now() - asked) / 2;
    channel.points.push((time, value));
    Ok(())
}

/// Stops the motor, along the ramp to spare the supply, and waits until it stands; its speed if it does not. Where
/// the sensor has the wrong direction, the regulator of the speed drives the motor faster and faster in place of
/// braking it: then it gets no current any more.
fn stop(
    line: &mut Line,
    module: &'static Module,
    changed: &mut Changed,
) -> Result<Option<i32>, Failure> {
    let ramp = parameter(module, Servo::RampEnable)?;
    // Stopped it must be, whatever comes of the ramp.
    let ramp = changed.set(line, ramp, 1, false);
    line.stop()?;
    ramp?;
    let speed = parameter(module, Servo::ActualVelocity)?;
    let halted = line.read(parameter(module, Servo::HaltedVelocity)?)?.max(1);
    let start = line.now();
    let mut slowest = (i32::MAX, start);
    loop {
        let turning = line.read(speed)?;
        let (now, size) = (line.now(), turning.saturating_abs());
        if size < halted {
            return Ok(None);
        }
        if size < slowest.0 {
            slowest = (size, now);
        }
        if now - slowest.1 >= PATIENCE || now - start >= STOPPING {
            if size <= CREEPING {
                return Ok(None);
            }
            line.write(parameter(module, Servo::TargetTorque)?, 0)?;
            return Ok(Some(turning));
        }
        line.wait_until(now + PAUSE);
    }
}
