//! The summary of a run for people.

use std::io::{self, Write};

use opentmcl_wire::Status;

use super::summary::{End, Moved, Output, Reason, Refused, Summary, Waiting};
use crate::print::counted;

/// Switchings of one output that are shown.
const SHOWN: usize = 4;

/// Writes the summary, a subject on the left and what is to say about it on the right.
pub(super) fn write(out: &mut impl Write, summary: &Summary) -> io::Result<()> {
    let Summary { program, module, length, .. } = summary;
    subject(out, "program", &format!("{program}, {}, on a {module}", counted(*length, "command")))?;
    for line in end(summary) {
        subject(out, if line.0 { "end" } else { "" }, &line.1)?;
    }
    subject(out, "executed", &counted(summary.executed, "command"))?;
    for (at, refused) in summary.refused.iter().enumerate() {
        subject(out, if at == 0 { "refused" } else { "" }, &refusal(refused))?;
    }
    if summary.axes.is_empty() {
        subject(out, "axes", "none moved")?;
    }
    for axis in &summary.axes {
        let way = Way::of(axis);
        subject(out, &format!("axis {}", way.axis), &way.words())?;
    }
    for output in &summary.outputs {
        subject(out, &format!("output {}", output.output), &switchings(output))?;
    }
    Ok(())
}

fn subject(out: &mut impl Write, name: &str, text: &str) -> io::Result<()> {
    writeln!(out, "{name:10} {text}")
}

/// Lines about the end; the first of them is marked.
fn end(summary: &Summary) -> Vec<(bool, String)> {
    let End { reason, time_s, place, command, waiting, .. } = &summary.end;
    let (at, place) = (seconds(*time_s), &place.words);
    let first = match reason {
        Reason::Stop => format!("STOP at {place}, after {at}"),
        Reason::NoStop => {
            format!("none with STOP: the program ran past its end at {place}, after {at}")
        }
        Reason::JumpOutside => {
            format!("jump out of program memory at {place}, {command}, after {at}")
        }
        Reason::TimeUp => format!("none, time up after {at}: at {place}, {command}"),
    };
    let mut lines = vec![(true, first)];
    if let Some(Waiting { since_s, until, may_end }) = waiting {
        lines.push((false, format!("waiting since {} until {until}", seconds(*since_s))));
        if !may_end {
            lines.push((false, "nothing is to come that would end this".to_owned()));
        }
    }
    let axes = summary.axes.iter().map(Way::of);
    let turning: Vec<_> = axes.filter(|axis| axis.end_speed != 0).collect();
    if *reason != Reason::TimeUp {
        for Way { axis, end_speed, speed_unit, .. } in &turning {
            lines.push((false, format!("axis {axis} still turns at {end_speed} {speed_unit}")));
        }
        if turning.is_empty() && summary.duration_s > *time_s {
            let rest = seconds(summary.duration_s);
            lines.push((false, format!("motion went on and came to rest after {rest}")));
        }
    }
    lines
}

fn refusal(refused: &Refused) -> String {
    let Refused { place, command, status, count, first_s, .. } = refused;
    let first = seconds(*first_s);
    let when = match count {
        1 => format!("at {first}"),
        _ => format!("{count} times, first at {first}"),
    };
    format!("{}: {command}: status {}, {when}", place.words, Status(*status))
}

/// What an axis did, whatever it is made of.
struct Way {
    axis: usize,
    from: i32,
    to: i32,
    lowest: i32,
    highest: i32,
    top_speed: u32,
    end_speed: i32,
    unit: &'static str,
    speed_unit: &'static str,
}

impl Way {
    fn of(moved: &Moved) -> Self {
        match moved {
            Moved::Stepper(axis) => Self {
                axis: axis.axis,
                from: axis.from,
                to: axis.to,
                lowest: axis.lowest,
                highest: axis.highest,
                top_speed: axis.top_speed_pps,
                end_speed: axis.end_speed_pps,
                unit: " microsteps",
                speed_unit: "pps",
            },
            Moved::Servo(axis) => Self {
                axis: axis.axis,
                from: axis.from,
                to: axis.to,
                lowest: axis.lowest,
                highest: axis.highest,
                top_speed: axis.top_speed_rpm,
                end_speed: axis.end_speed_rpm,
                // The parameters of the module say what one is.
                unit: "",
                speed_unit: "rpm",
            },
        }
    }

    fn words(&self) -> String {
        let Self { from, to, lowest, highest, top_speed, unit, speed_unit, .. } = self;
        let between = if lowest < from.min(to) || highest > from.max(to) {
            format!(", between {lowest} and {highest}")
        } else {
            String::new()
        };
        format!("from {from} to {to}{unit}{between}; top speed {top_speed} {speed_unit}")
    }
}

fn switchings(output: &Output) -> String {
    let level = |level: u8| if level == 0 { "low" } else { "high" };
    let mut text = String::new();
    for (at, switched) in output.switched.iter().take(SHOWN).enumerate() {
        let comma = if at == 0 { "" } else { ", " };
        text += &format!("{comma}{} at {}", level(switched.level), seconds(switched.time_s));
    }
    if output.count > SHOWN as u64 {
        let last = output.last;
        text += &format!(
            ", … {} at {}: {} times",
            level(last.level),
            seconds(last.time_s),
            output.count
        );
    }
    text
}

fn seconds(seconds: f64) -> String {
    format!("{seconds:.3} s")
}
