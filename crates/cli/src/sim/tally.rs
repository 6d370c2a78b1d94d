//! What a summary counts while a program runs.

use std::collections::BTreeMap;

use opentmcl_virtual::Event;
use opentmcl_wire::{Command, Duration, Instant, Status};

use super::run::Observer;
use crate::failure::Failure;

/// Switchings that are kept; more are counted only.
const KEPT: usize = 1000;

/// A command that the module refused, once or more often.
#[derive(Clone, Copy, Debug)]
pub(super) struct Refusal {
    pub(super) command: Command,
    pub(super) count: u64,
    /// When for the first time.
    pub(super) first: Duration,
}

/// An output that switched.
#[derive(Clone, Copy, Debug)]
pub(super) struct Switching {
    pub(super) time: Duration,
    pub(super) level: bool,
}

/// All switchings of one output.
#[derive(Clone, Debug, Default)]
pub(super) struct Switchings {
    pub(super) count: u64,
    /// The first ones.
    pub(super) kept: Vec<Switching>,
    /// The last one.
    pub(super) last: Option<Switching>,
}

/// Counts commands, refusals and switchings.
pub(super) struct Tally {
    start: Instant,
    pub(super) commands: u64,
    /// By address and status.
    pub(super) refused: BTreeMap<(u16, u8), Refusal>,
    /// By bit of the outputs.
    pub(super) outputs: [Switchings; 8],
}

impl Tally {
    pub(super) fn new(start: Instant) -> Self {
        Self { start, commands: 0, refused: BTreeMap::new(), outputs: Default::default() }
    }

    fn refuse(&mut self, address: u16, command: Command, status: Status, at: Instant) {
        let first = at - self.start;
        let new = Refusal { command, count: 0, first };
        self.refused.entry((address, status.0)).or_insert(new).count += 1;
    }
}

impl Observer for Tally {
    fn event(&mut self, event: &Event<'_>) -> Result<(), Failure> {
        match *event {
            Event::Executed(executed) => {
                self.commands += 1;
                if !executed.status.is_ok() {
                    self.refuse(executed.address, executed.command, executed.status, executed.at);
                }
            }
            Event::Outputs { at, before, after } => {
                for (bit, output) in self.outputs.iter_mut().enumerate() {
                    if (before ^ after) >> bit & 1 != 0 {
                        let level = after >> bit & 1 != 0;
                        let switching = Switching { time: at - self.start, level };
                        output.count += 1;
                        output.last = Some(switching);
                        if output.kept.len() < KEPT {
                            output.kept.push(switching);
                        }
                    }
                }
            }
        }
        Ok(())
    }
}
