//! What came of a run, as data for `--json`; the field names are what other programs rely on.

use opentmcl_catalog::Module;
use opentmcl_firmware::Executed;
use opentmcl_virtual::Travel;
use opentmcl_wire::{Command, Opcode, Status};
use serde::Serialize;

use super::listing::Listing;
use super::ports;
use super::run::{Outcome, Run};
use super::tally::{Switching, Switchings, Tally};
use crate::time;

/// A run in numbers and words.
#[derive(Serialize)]
pub(super) struct Summary {
    pub(super) program: String,
    pub(super) module: &'static str,
    /// Commands of the program.
    pub(super) length: usize,
    /// Virtual time until the program had ended and the axes stood, or the time was up.
    pub(super) duration_s: f64,
    pub(super) end: End,
    /// Commands executed.
    pub(super) executed: u64,
    pub(super) refused: Vec<Refused>,
    pub(super) axes: Vec<Moved>,
    pub(super) outputs: Vec<Output>,
}

/// How the program ended, or where it was when the time was up.
#[derive(Serialize)]
pub(super) struct End {
    pub(super) reason: Reason,
    pub(super) time_s: f64,
    #[serde(flatten)]
    pub(super) place: Place,
    pub(super) command: String,
    /// The WAIT that is not over.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(super) waiting: Option<Waiting>,
}

#[derive(Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub(super) enum Reason {
    /// STOP.
    Stop,
    /// The program ran into empty memory or past its end.
    NoStop,
    /// A jump to where there is no program memory.
    JumpOutside,
    /// Still running.
    TimeUp,
}

/// Where a command stands.
#[derive(Serialize)]
pub(super) struct Place {
    pub(super) address: u16,
    /// Not for a binary, nor for what the assembler has added.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(super) file: Option<String>,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub(super) line: Option<u32>,
    /// For people.
    #[serde(skip)]
    pub(super) words: String,
}

impl Place {
    fn new(listing: &Listing, address: u16) -> Self {
        let (file, line) = listing.source(address).unzip();
        Self { address, file, line, words: listing.place(address) }
    }
}

/// A WAIT that is not over.
#[derive(Serialize)]
pub(super) struct Waiting {
    pub(super) since_s: f64,
    /// What for, in words.
    pub(super) until: String,
    /// Whether something is still to come that may end it.
    pub(super) may_end: bool,
}

#[derive(Serialize)]
pub(super) struct Refused {
    #[serde(flatten)]
    pub(super) place: Place,
    pub(super) command: String,
    pub(super) status: u8,
    pub(super) meaning: Option<&'static str>,
    pub(super) count: u64,
    pub(super) first_s: f64,
}

#[derive(Serialize)]
pub(super) struct Axis {
    pub(super) axis: usize,
    /// Positions in microsteps.
    pub(super) from: i32,
    pub(super) to: i32,
    pub(super) lowest: i32,
    pub(super) highest: i32,
    pub(super) top_speed_pps: u32,
    /// Speed at the end of the run: not 0 for an axis that turns on.
    pub(super) end_speed_pps: i32,
}

/// A servo axis that has turned.
#[derive(Serialize)]
pub(super) struct ServoAxis {
    pub(super) axis: usize,
    /// Positions in the unit of the axis' parameters.
    pub(super) from: i32,
    pub(super) to: i32,
    pub(super) lowest: i32,
    pub(super) highest: i32,
    pub(super) top_speed_rpm: u32,
    /// Speed at the end of the run: not 0 for an axis that turns on.
    pub(super) end_speed_rpm: i32,
}

/// An axis of either kind.
#[derive(Serialize)]
#[serde(untagged)]
pub(super) enum Moved {
    Stepper(Axis),
    Servo(ServoAxis),
}

#[derive(Serialize)]
pub(super) struct Output {
    pub(super) output: u8,
    /// How often it switched.
    pub(super) count: u64,
    /// The first thousand times.
    pub(super) switched: Vec<Switched>,
    pub(super) last: Switched,
}

#[derive(Clone, Copy, Serialize)]
pub(super) struct Switched {
    pub(super) time_s: f64,
    pub(super) level: u8,
}

impl Summary {
    pub(super) fn new(
        program: String,
        listing: &Listing,
        run: &mut Run,
        tally: &Tally,
        outcome: &Outcome,
    ) -> Self {
        let model = run.module.model();
        Self {
            program,
            module: model.title,
            length: listing.rows().count(),
            duration_s: time::number(outcome.end),
            end: End::new(listing, run, outcome),
            executed: tally.commands,
            refused: refused(listing, tally),
            axes: axes(model, run.axes()),
            outputs: outputs(model, tally),
        }
    }
}

impl End {
    fn new(listing: &Listing, run: &mut Run, outcome: &Outcome) -> Self {
        match outcome.last {
            Some(last) => Self {
                reason: reason(&last),
                time_s: time::number(last.at - run.start),
                place: Place::new(listing, last.address),
                command: listing.row(last.address, last.command).text.clone(),
                waiting: None,
            },
            None => {
                let state = run.module.program_state();
                let command = run.module.program_command(state.address).unwrap_or_default();
                let may_end = run.module.next_event().is_some();
                Self {
                    reason: Reason::TimeUp,
                    time_s: time::number(outcome.end),
                    place: Place::new(listing, state.address),
                    command: listing.row(state.address, command).text.clone(),
                    waiting: state.waiting_since.map(|since| Waiting {
                        since_s: time::number(since - run.start),
                        until: awaited(command),
                        may_end,
                    }),
                }
            }
        }
    }
}

fn reason(last: &Executed) -> Reason {
    match Opcode::from_number(last.command.number) {
        Some(Opcode::Stop) => Reason::Stop,
        Some(opcode) if opcode.may_jump() && last.branch != Some(false) => Reason::JumpOutside,
        _ => Reason::NoStop,
    }
}

/// What a WAIT waits for.
fn awaited(wait: Command) -> String {
    let Command { kind, motor, .. } = wait;
    match kind {
        0 => "its time is over".to_owned(),
        1 => format!("axis {motor} is at its target"),
        2 => format!("the home switch of axis {motor} is closed"),
        3 => format!("a limit switch of axis {motor} is closed"),
        _ => format!("the reference search of axis {motor} has ended"),
    }
}

fn refused(listing: &Listing, tally: &Tally) -> Vec<Refused> {
    let refusals = tally.refused.iter();
    refusals
        .map(|(&(address, status), refusal)| Refused {
            place: Place::new(listing, address),
            command: listing.row(address, refusal.command).text.clone(),
            status,
            meaning: Status(status).meaning(),
            count: refusal.count,
            first_s: time::number(refusal.first),
        })
        .collect()
}

fn axes(model: &'static Module, travels: &[Travel]) -> Vec<Moved> {
    let moved = travels.iter().enumerate().filter(|(_, travel)| travel.has_moved());
    moved
        .map(|(axis, &Travel { from, to, lowest, highest, speed, top_speed })| {
            if model.motion.is_servo() {
                let (top_speed_rpm, end_speed_rpm) = (top_speed, speed);
                let axis =
                    ServoAxis { axis, from, to, lowest, highest, top_speed_rpm, end_speed_rpm };
                return Moved::Servo(axis);
            }
            let (top_speed_pps, end_speed_pps) = (top_speed, speed);
            Moved::Stepper(Axis { axis, from, to, lowest, highest, top_speed_pps, end_speed_pps })
        })
        .collect()
}

fn outputs(model: &'static Module, tally: &Tally) -> Vec<Output> {
    ports::outputs(model)
        .filter_map(|(number, bit)| {
            let Switchings { count, kept, last } = tally.outputs.get(usize::from(bit))?;
            Some(Output {
                output: number,
                count: *count,
                switched: kept.iter().map(Switched::from).collect(),
                last: last.as_ref().map(Switched::from)?,
            })
        })
        .collect()
}

impl From<&Switching> for Switched {
    fn from(switching: &Switching) -> Self {
        Self { time_s: time::number(switching.time), level: u8::from(switching.level) }
    }
}
