//! What a servo axis shows in a picture: speed and position with what its ramps ask for, the current that makes its
//! torque, and the supply if that moves.

use opentmcl_virtual::ServoSample;

use super::Sampled;
use crate::plot::{Curve, Panel, beside};

/// Style of what is, and of what the ramps or regulators ask for.
const ACTUAL: usize = 0;
const WANTED: usize = beside(ACTUAL);

/// The supply is drawn if it leaves its first value by so many volt.
const VISIBLE_VOLTAGE: f64 = 1.0;

/// Names of the curves in the legend.
pub(super) fn legend() -> Vec<(usize, String)> {
    vec![(ACTUAL, "actual".to_owned()), (WANTED, "wanted".to_owned())]
}

/// All panels of the one axis.
pub(super) fn panels(samples: &[Sampled]) -> Vec<Panel> {
    let mut panels = vec![
        pair(samples, "speed", "rpm", |servo| {
            (servo.state.speed.into(), servo.state.ramp_speed.into())
        }),
        pair(samples, "position", "", |servo| {
            (servo.state.position.into(), servo.state.ramp_position.into())
        }),
        pair(samples, "torque current", "mA", |servo| {
            (servo.state.torque.into(), servo.state.target_torque.into())
        }),
    ];
    let volts = || samples.iter().filter_map(|sample| Some(servo(sample)?.view.bus));
    let first = volts().next().unwrap_or_default();
    if volts().any(|bus| (bus - first).abs() >= VISIBLE_VOLTAGE) {
        let points = samples.iter().filter_map(|sample| {
            Some((sample.time, (servo(sample)?.view.bus * 1000.0).round() as i64))
        });
        let curves = vec![Curve { style: ACTUAL, points: points.collect() }];
        panels.push(Panel::Curves { quantity: "supply", unit: "mV", curves, bands: Vec::new() });
    }
    panels
}

/// Levels of the switches of a sample, three bits for each axis.
pub(super) fn switches(servos: &[Option<ServoSample>]) -> u32 {
    let levels = servos.iter().flat_map(|servo| servo.map_or([false; 3], |s| s.view.switches));
    (0..30).zip(levels).fold(0, |all, (bit, level)| all | u32::from(level) << bit)
}

fn servo(sample: &Sampled) -> Option<&ServoSample> {
    sample.servos.first()?.as_ref()
}

/// A panel with what is and what is wanted.
fn pair(
    samples: &[Sampled],
    quantity: &'static str,
    unit: &'static str,
    of: fn(&ServoSample) -> (i64, i64),
) -> Panel {
    let points = || samples.iter().filter_map(|sample| Some((sample.time, of(servo(sample)?))));
    let actual = points().map(|(time, (actual, _))| (time, actual)).collect();
    let wanted = points().map(|(time, (_, wanted))| (time, wanted)).collect();
    let curves =
        vec![Curve { style: ACTUAL, points: actual }, Curve { style: WANTED, points: wanted }];
    Panel::Curves { quantity, unit, curves, bands: Vec::new() }
}
