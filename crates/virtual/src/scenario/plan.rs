//! What happens by itself: actions by time, and waves.

use std::ops::Range;

use opentmcl_wire::{Instant, TICKS_PER_SECOND};
use toml::de::DeValue;

use super::ModuleSetup;
use super::module::{fitting, tables};
use super::read::{Reader, Table, Value};
use crate::quantity::Quantity;
use crate::world::{Action, Shape, Wave, between};

/// Seconds beyond which no plan reaches.
const LONGEST: f64 = 1e7;

/// Clocks between two values of a wave at least: a run with a faster one would not come to its end.
const FASTEST: u64 = TICKS_PER_SECOND / 10_000;

/// Adds an action to the plan of a module, at its beginning or at a time.
pub(super) fn action(
    reader: &mut Reader<'_>,
    span: Range<usize>,
    text: &str,
    setup: &mut ModuleSetup,
    time: Option<Instant>,
) {
    match fitting(text, setup) {
        Ok(action) => match time {
            Some(time) => setup.timeline.push((time, action)),
            None => setup.start.push(action),
        },
        Err(message) => reader.mistake(span, message),
    }
}

/// `[[module.at]]`.
pub(super) fn timeline<'a>(reader: &mut Reader<'a>, table: &Table<'a>, setup: &mut ModuleSetup) {
    for value in tables(reader, table, "at", "[[module.at]]") {
        let Some(at) = reader.table(value, "an entry of the plan", &["time", "do"]) else {
            continue;
        };
        let time = reader.required(&at, "time", "time = \"2 s\"");
        let time = time.and_then(|value| clocks(reader, value));
        let Some(what) = reader.required(&at, "do", "do = \"block axis 1\"") else { continue };
        let time = time.map_or(Instant::from_ticks(0), Instant::from_ticks);
        let actions = match what.get_ref() {
            DeValue::Array(list) => &**list,
            _ => std::slice::from_ref(what),
        };
        for value in actions {
            if let Some(text) = reader.text(value, "\"block axis 1\"") {
                action(reader, value.span(), text, setup, Some(time));
            }
        }
    }
}

/// `[[module.wave]]`.
pub(super) fn waves<'a>(reader: &mut Reader<'a>, table: &Table<'a>, setup: &mut ModuleSetup) {
    for value in tables(reader, table, "wave", "[[module.wave]]") {
        let keys = ["shape", "low", "high", "period", "every", "start", "end"];
        let Some(table) = reader.table(value, "a wave", &keys) else { continue };
        if let Some(wave) = wave(reader, &table, setup) {
            setup.waves.push(wave);
        }
    }
}

fn wave<'a>(reader: &mut Reader<'a>, table: &Table<'a>, setup: &ModuleSetup) -> Option<Wave> {
    let shape = reader.required(table, "shape", "shape = \"sine\"");
    let shape = shape.and_then(|value| reader.word(value, &["square", "ramp", "sine"]));
    let mut end_of = |key, example| {
        let value = reader.required(table, key, example)?;
        let text = reader.text(value, example)?;
        fitting(text, setup).map_err(|message| reader.mistake(value.span(), message)).ok()
    };
    let low = end_of("low", "low = \"analog 0 1 V\"");
    let high = end_of("high", "high = \"analog 0 4 V\"");
    let period = reader.required(table, "period", "period = \"2 s\"");
    let period = period.and_then(|value| clocks(reader, value));
    let every = table.get("every").map(|value| clocks(reader, value));
    let start = table.get("start").map_or(Some(0), |value| clocks(reader, value));
    let end = match table.get("end") {
        Some(value) => Some(Instant::from_ticks(clocks(reader, value)?)),
        None => None,
    };
    let (shape, low, high, period, start) = (shape?, low?, high?, period?, start?);
    let step = if shape == "square" {
        if every.is_some() {
            reader.mistake(table.place("every"), "a square has no times between; leave this out");
        }
        period / 2
    } else {
        every.unwrap_or(Some(period / 50))?
    };
    if step < FASTEST {
        let place = if every.is_some() { "every" } else { "period" };
        let message = "a wave changes at most every 100 us; let it be slower";
        reader.mistake(table.place(place), message);
        return None;
    }
    let shape = match shape {
        "square" => Shape::Square,
        "ramp" => Shape::Ramp { every: step },
        _ => Shape::Sine { every: step },
    };
    if shape != Shape::Square && !fits(reader, table, &low, &high) {
        return None;
    }
    Some(Wave { low, high, shape, start: Instant::from_ticks(start), period, end })
}

/// Whether there is something between the two ends of a wave.
fn fits(reader: &mut Reader<'_>, table: &Table<'_>, low: &Action, high: &Action) -> bool {
    let fits = between(low, high, 0.0).is_some();
    if !fits {
        let message = format!(
            "there is nothing between \"{low}\" and \"{high}\"; name the same thing with two values of \
             one unit, or let the shape be \"square\""
        );
        reader.mistake(table.place("high"), message);
    }
    fits
}

/// A time in clocks.
fn clocks<'a>(reader: &mut Reader<'a>, value: &'a Value<'a>) -> Option<u64> {
    let seconds = reader.amount(value, Quantity::Time, false)?;
    if seconds > LONGEST {
        reader.mistake(value.span(), format!("a time is at most {LONGEST} s"));
        return None;
    }
    Some((seconds * TICKS_PER_SECOND as f64).round() as u64)
}
