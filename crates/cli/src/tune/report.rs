//! What came of a step, for people and as JSON.

use std::io::{self, Write};

use serde::Serialize;

use super::Args;
use super::analysis::{Moment, Outcome, Response, Step, analyse};
use super::health::Trouble;
use super::regulator::unit;
use super::run::{Channel, Plan, Run};
use crate::failure::Failure;
use crate::{lookup, time};

/// Fewer points within a rise do not show how long it is.
const POINTS_OF_RISE: usize = 3;

/// The report, as `--json` prints it.
#[derive(Serialize)]
pub(super) struct Report {
    module: &'static str,
    firmware: String,
    regulator: &'static str,
    unit: &'static str,
    from: i32,
    to: i32,
    p: i32,
    /// Null if the regulator has none.
    i: Option<i32>,
    ramp: bool,
    virtual_time: bool,
    samples: usize,
    duration_s: f64,
    /// Samples of the regulated quantity per second, as they came.
    rate_hz: f64,
    pub(super) band_percent: u8,
    /// Null if there were too few samples.
    #[serde(flatten)]
    pub(super) answer: Option<Answer>,
    /// Status flags that tell of trouble.
    troubles: Vec<&'static str>,
    #[serde(skip)]
    notes: Vec<String>,
    #[serde(skip)]
    help: Option<&'static str>,
}

/// Rounded to what a reader can use.
#[derive(Serialize)]
pub(super) struct Answer {
    outcome: &'static str,
    #[serde(skip)]
    kind: Outcome,
    rise_s: Option<f64>,
    overshoot_percent: Option<f64>,
    peak: f64,
    peak_s: f64,
    pub(super) settling_s: Option<f64>,
    #[serde(rename = "final")]
    pub(super) end: f64,
    ripple: f64,
    reached_percent: f64,
    error: f64,
    /// The band around the final value; none for a value that went nowhere.
    #[serde(skip)]
    pub(super) band: Option<(f64, f64)>,
}

fn rounded(value: f64, decimals: i32) -> f64 {
    let scale = 10f64.powi(decimals);
    let rounded = (value * scale).round() / scale;
    // No minus in front of nothing.
    if rounded == 0.0 { 0.0 } else { rounded }
}

impl Answer {
    fn new(response: &Response, from: f64, band: f64) -> Self {
        let Response { outcome, end, .. } = *response;
        let half = (end - from).abs() * band;
        let seconds = |time: f64| rounded(time, 6);
        Self {
            outcome: match outcome {
                Outcome::Followed => "followed",
                Outcome::Unchanged => "unchanged",
                Outcome::Reversed => "reversed",
            },
            kind: outcome,
            rise_s: response.rise.map(seconds),
            overshoot_percent: response.overshoot.map(|part| rounded(part * 100.0, 1)),
            peak: rounded(response.peak.value, 1),
            peak_s: seconds(response.peak.time),
            settling_s: response.settling.map(seconds),
            end: rounded(end, 1),
            ripple: rounded(response.ripple, 1),
            reached_percent: rounded(response.reached * 100.0, 1),
            error: rounded(response.error, 1),
            band: (outcome != Outcome::Unchanged).then_some((end - half, end + half)),
        }
    }
}

impl Report {
    pub(super) fn new(plan: &Plan, run: &Run, args: &Args, is_virtual: bool) -> Self {
        let (from, to) = (f64::from(run.from), f64::from(run.to));
        let band = f64::from(args.band) / 100.0;
        let points = run.channels.first().map_or(&[][..], |channel| &channel.points);
        let moments: Vec<Moment> = points
            .iter()
            .map(|&(at, value)| Moment { time: time::number(at), value: value.into() })
            .collect();
        let response = analyse(Step { from, to, band }, &moments);
        let length = moments.last().map_or(0.0, |moment| moment.time);
        let intervals = moments.len().saturating_sub(1) as f64;
        let rate = if length > 0.0 { intervals / length } else { 0.0 };
        let cause = run.troubles.iter().find(|(_, trouble)| trouble.is_cause());
        let mut report = Self {
            module: plan.module.title,
            firmware: lookup::version(plan.module.firmware),
            regulator: plan.regulator.quantity(),
            unit: unit(plan.parameters.actual),
            from: run.from,
            to: run.to,
            p: run.p,
            i: run.i,
            ramp: args.ramp,
            virtual_time: is_virtual,
            samples: moments.len(),
            duration_s: rounded(length, 6),
            rate_hz: rounded(rate, 1),
            band_percent: args.band,
            answer: response.as_ref().map(|response| Answer::new(response, from, band)),
            troubles: run.troubles.iter().map(|(_, trouble)| trouble.name).collect(),
            notes: Vec::new(),
            help: cause.map(|(_, trouble)| trouble.help),
        };
        report.take_notes(run, response.as_ref());
        report
    }

    fn take_notes(&mut self, run: &Run, response: Option<&Response>) {
        for (at, Trouble { name, help, .. }) in &run.troubles {
            let at = seconds(time::number(*at));
            self.notes.push(format!("{name} after {at}: {help}"));
        }
        if let Some(rpm) = run.still_turns {
            self.notes.push(format!(
                "MST did not stop the motor, which still turned with {rpm} rpm; its torque is 0 now"
            ));
        }
        if response.is_some_and(|response| {
            response.rise.is_some() && response.points_of_rise < POINTS_OF_RISE
        }) {
            let what = "the rise has hardly a sample: it may be shorter than this";
            self.notes.push(what.to_owned());
        }
    }

    /// Whether the motor did not do what it was told.
    pub(super) fn has_failed(&self) -> bool {
        self.answer.as_ref().is_none_or(|answer| answer.kind != Outcome::Followed)
    }

    /// In one line and the next step.
    pub(super) fn failure(&self) -> Failure {
        let Some(answer) = &self.answer else {
            return Failure::new(format!("{} samples are too few", self.samples))
                .help("watch for longer with --duration");
        };
        let (message, usual) = match answer.kind {
            Outcome::Reversed => (
                format!("the {} went the other way", self.regulator),
                "is the direction of the sensor that of the phases? Swap two phases, or change \
                 the direction or polarity of the sensor",
            ),
            _ => (
                format!("the {} did not follow", self.regulator),
                "is the gain too low, does something hold the shaft, or has the sensor the wrong \
                 direction or polarity? A larger --p helps the first",
            ),
        };
        Failure::new(message).help(self.help.unwrap_or(usual))
    }

    /// A line of the report for each number.
    pub(super) fn write(&self, out: &mut impl Write) -> io::Result<()> {
        let Self { module, firmware, regulator, unit, from, to, samples, .. } = self;
        subject(out, "module", &format!("{module}, firmware {firmware}"))?;
        let gains = gains(self.p, self.i);
        let ramp = match (*regulator, self.ramp) {
            ("torque", _) => "",
            (_, true) => ", with the ramp",
            (_, false) => ", without ramp",
        };
        subject(out, "step", &format!("{regulator} from {from} to {to} {unit}, {gains}{ramp}"))?;
        let clock = if self.virtual_time { " of virtual time" } else { "" };
        let rate = format!("{} per second{clock}", plain(self.rate_hz));
        subject(out, "samples", &format!("{samples} in {}, {rate}", seconds(self.duration_s)))?;
        if let Some(answer) = &self.answer {
            self.write_answer(out, answer)?;
        }
        for note in &self.notes {
            subject(out, "note", note)?;
        }
        Ok(())
    }

    fn write_answer(&self, out: &mut impl Write, answer: &Answer) -> io::Result<()> {
        let unit = self.unit;
        let peak = format!("{} {unit} after {}", plain(answer.peak), seconds(answer.peak_s));
        if let Some(rise) = answer.rise_s {
            subject(out, "rise", &format!("{}, from 10 % to 90 %", seconds(rise)))?;
        }
        match answer.overshoot_percent {
            Some(0.0) => subject(out, "overshoot", "none")?,
            Some(percent) => subject(out, "overshoot", &format!("{percent} %, {peak}"))?,
            None => subject(out, "peak", &peak)?,
        }
        match (answer.settling_s, answer.band) {
            (Some(time), _) => {
                let band = self.band_percent;
                subject(out, "settled", &format!("after {}, to ±{band} %", seconds(time)))?;
            }
            (None, Some(_)) => {
                subject(out, "settled", &format!("not to ±{} %", self.band_percent))?;
            }
            (None, None) => {}
        }
        let mut end =
            format!("{} {unit}, {} % of the step", plain(answer.end), answer.reached_percent);
        if answer.ripple > 0.0 {
            end += &format!("; ripple ±{} {unit}", plain(answer.ripple));
        }
        subject(out, "final", &end)?;
        subject(out, "error", &format!("{} {unit}", plain(answer.error)))
    }
}

/// `P 800, I 500`.
pub(super) fn gains(p: i32, i: Option<i32>) -> String {
    match i {
        Some(i) => format!("P {p}, I {i}"),
        None => format!("P {p}"),
    }
}

fn subject(out: &mut impl Write, name: &str, text: &str) -> io::Result<()> {
    writeln!(out, "{name:10} {text}")
}

/// A number with a decimal only if it is small or has one that matters.
fn plain(value: f64) -> String {
    if value.abs() >= 100.0 { format!("{value:.0}") } else { format!("{}", rounded(value, 1)) }
}

fn seconds(time: f64) -> String {
    if time < 1.0 { format!("{} ms", rounded(time * 1000.0, 1)) } else { format!("{time:.3} s") }
}

/// The last value of each channel at each time of the first one, which has the most.
pub(super) fn rows(channels: &[Channel]) -> Vec<(opentmcl_wire::Duration, Vec<i32>)> {
    let Some(main) = channels.first() else { return Vec::new() };
    let mut places = vec![0; channels.len()];
    main.points
        .iter()
        .map(|&(at, _)| {
            let values = channels.iter().zip(&mut places).map(|(channel, place)| {
                while channel.points.get(*place + 1).is_some_and(|next| next.0 <= at) {
                    *place += 1;
                }
                channel.points.get(*place).map_or(0, |point| point.1)
            });
            (at, values.collect())
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_are_as_exact_as_they_are_useful() {
        assert_eq!(
            (plain(1163.4), plain(-12.34), plain(0.0)),
            ("1163".into(), "-12.3".into(), "0".into())
        );
        assert_eq!(
            (seconds(0.01234), seconds(1.0), seconds(0.0)),
            ("12.3 ms".into(), "1.000 s".into(), "0 ms".into())
        );
        assert_eq!(rounded(-0.04, 1).to_string(), "0");
    }
}
