//! `--trace`: a line for each executed command, with columns that fit the program.

use std::cmp::Ordering;
use std::io::Write;

use opentmcl_firmware::{ErrorFlags, Executed, Flags};
use opentmcl_virtual::Event;
use opentmcl_wire::Instant;

use super::listing::Listing;
use super::run::Observer;
use crate::failure::Failure;
use crate::time;

/// Error flags by the names of their conditions.
const ERRORS: [(u8, &str); 5] = [
    (ErrorFlags::TIMEOUT, "ETO"),
    (ErrorFlags::ALARM, "EAL"),
    (ErrorFlags::DEVIATION, "EDV"),
    (ErrorFlags::POSITION, "EPO"),
    (ErrorFlags::SHUTDOWN, "ESD"),
];

/// Writes each executed command.
pub(super) struct Trace<'a, W> {
    out: W,
    listing: &'a Listing,
    start: Instant,
    place: usize,
    label: usize,
    text: usize,
}

impl<'a, W: Write> Trace<'a, W> {
    /// Writes the heads of the columns.
    pub(super) fn new(mut out: W, listing: &'a Listing, start: Instant) -> Result<Self, Failure> {
        let widest = |of: fn(&super::listing::Row) -> usize, head: &str| {
            listing.rows().map(of).max().unwrap_or(0).max(head.len())
        };
        let place = widest(|row| row.place.chars().count(), "line");
        let label = widest(|row| row.label.chars().count(), "label");
        let text = widest(|row| row.text.chars().count(), "command");
        writeln!(
            out,
            "{:>11}  {:>4}  {:place$}  {:label$}  {:text$}  {:>11}  {:>11}  {:5}  what",
            "time s", "addr", "line", "label", "command", "A", "X", "flags",
        )?;
        Ok(Self { out, listing, start, place, label, text })
    }
}

impl<W: Write> Observer for Trace<'_, W> {
    fn event(&mut self, event: &Event<'_>) -> Result<(), Failure> {
        let Event::Executed(executed) = event else { return Ok(()) };
        let Self { place, label, text, .. } = *self;
        let row = self.listing.row(executed.address, executed.command);
        let line = format!(
            "{:>11}  {:>4}  {:place$}  {:label$}  {:text$}  {:>11}  {:>11}  {:5}  {}",
            time::column(executed.at - self.start),
            executed.address,
            row.place,
            row.label,
            row.text,
            executed.accumulator,
            executed.x,
            flags(executed.flags),
            notes(executed),
        );
        writeln!(self.out, "{}", line.trim_end())?;
        Ok(())
    }
}

/// `Z` where ZE holds, the outcome of the last comparison, and the error flags that are set.
fn flags(flags: Flags) -> String {
    let zero = if flags.is_zero() { 'Z' } else { '-' };
    let comparison = match flags.comparison() {
        Ordering::Less => '<',
        Ordering::Equal => '=',
        Ordering::Greater => '>',
    };
    let mut text = format!("{zero}{comparison}");
    for (flag, name) in ERRORS {
        if flags.errors().has(flag) {
            text.push(' ');
            text.push_str(name);
        }
    }
    text
}

/// What the registers do not show.
fn notes(executed: &Executed) -> String {
    let mut notes = Vec::new();
    match executed.branch {
        Some(true) => notes.push("taken".to_owned()),
        Some(false) => notes.push("not taken".to_owned()),
        None => {}
    }
    if executed.at != executed.since {
        notes.push(format!("waited {}", time::text(executed.at - executed.since)));
    }
    if !executed.status.is_ok() {
        notes.push(format!("refused: status {}", executed.status));
    }
    if executed.in_interrupt {
        notes.push("interrupt".to_owned());
    }
    notes.join(", ")
}
