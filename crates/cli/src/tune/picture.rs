//! `--plot`: target and answer over time, with what else changed below.

use opentmcl_wire::Duration;

use super::regulator::unit;
use super::report::{Report, gains};
use super::run::{Channel, Plan, Run};
use crate::plot::{Band, Curve, Marker, Panel, Plot, Size};

/// Styles of the curves.
const ACTUAL: usize = 0;
const TARGET: usize = 1;

/// The picture of a run.
pub(super) fn draw(plan: &Plan, run: &Run, report: &Report) -> String {
    let end = microseconds(plan.duration);
    let answer = report.answer.as_ref();
    let band = answer.and_then(|answer| answer.band).map(|(from, to)| Band {
        name: format!("±{} %", report.band_percent),
        from: from.round() as i64,
        to: to.round() as i64,
    });
    let settled = answer.and_then(|answer| answer.settling_s).map(|time| Marker {
        time: (time * 1e6).round() as i64,
        command: "settled".to_owned(),
        meaning: None,
    });
    let target = Curve {
        style: TARGET,
        points: vec![(0, run.from.into()), (0, run.to.into()), (end, run.to.into())],
    };
    let answers = run.channels.iter().take(1);
    let others = run.channels.iter().skip(1).filter(|channel| !is_flat(channel));
    let mut panels: Vec<Panel> = answers.chain(others).map(panel).collect();
    if let Some(Panel::Curves { curves, bands, .. }) = panels.first_mut() {
        curves.push(target);
        bands.extend(band);
    }
    let gains = gains(run.p, run.i);
    Plot {
        size: Size::default(),
        title: format!("{} of a {}, {gains}", plan.regulator.quantity(), plan.module.title),
        end,
        markers: settled.into_iter().collect(),
        marks: None,
        legend: vec![(ACTUAL, "actual".to_owned()), (TARGET, "target".to_owned())],
        panels,
    }
    .draw()
}

/// Whether there is nothing to see.
fn is_flat(channel: &Channel) -> bool {
    channel.points.windows(2).all(|pair| pair[0].1 == pair[1].1)
}

fn panel(channel: &Channel) -> Panel {
    let points = channel.points.iter();
    let points = points.map(|&(time, value)| (microseconds(time), i64::from(value))).collect();
    Panel::Curves {
        quantity: channel.quantity,
        unit: unit(channel.row),
        curves: vec![Curve { style: ACTUAL, points }],
        bands: Vec::new(),
    }
}

fn microseconds(time: Duration) -> i64 {
    i64::try_from(time.as_micros()).unwrap_or(i64::MAX)
}
