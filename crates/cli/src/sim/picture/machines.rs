//! What machines show in a picture: where they really are, how hard they have to work, their switches.

use opentmcl_virtual::{MachineSample, VirtualModule};

use super::{Sampled, Thinned};
use crate::plot::{Band, Curve, Panel, Row, beside};

/// Names of the switches in the order of a sample.
const SWITCHES: [&str; 3] = ["left", "right", "home"];

/// A deviation is drawn beside the position if it is at least this part of what the panel shows.
const VISIBLE: f64 = 0.01;

/// Quantity, unit and value of a panel.
type Quantity = (&'static str, &'static str, fn(&MachineSample) -> f64);

const QUANTITIES: [Quantity; 3] = [
    ("load", "%", |machine| machine.load * 100.0),
    ("StallGuard value", "", |machine| f64::from(machine.stallguard)),
    ("current", "mA", |machine| machine.current * 1000.0),
];

/// Whether a machine moved an axis by a microstep or more.
pub(super) fn has_moved(samples: &[Sampled], axis: usize) -> bool {
    let mut stages = samples.iter().filter_map(|sample| Some(machine(sample, axis)?.stage));
    let first = stages.next().unwrap_or_default();
    stages.any(|stage| (stage - first).abs() >= 1.0)
}

/// Axes with curves of their real positions, for axes where they differ visibly from the commanded ones.
pub(super) fn real_positions(samples: &[Sampled], axes: &[usize]) -> Vec<(usize, Curve)> {
    let commanded = |sample: &Sampled, axis: usize| sample.positions.get(axis).copied();
    let all = axes
        .iter()
        .flat_map(|&axis| samples.iter().filter_map(move |sample| commanded(sample, axis)))
        .map(f64::from);
    let (low, high) =
        all.fold((0.0f64, 0.0f64), |(low, high), value| (low.min(value), high.max(value)));
    let least = ((high - low) * VISIBLE).max(1.0);
    let differs = |axis: usize| {
        samples.iter().any(|sample| following_error(sample, axis).is_some_and(|e| e.abs() >= least))
    };
    axes.iter()
        .filter(|&&axis| differs(axis))
        .map(|&axis| {
            let stage = |sample: &Sampled| Some(machine(sample, axis)?.stage);
            (axis, curve(samples, beside(axis), stage))
        })
        .collect()
}

/// Zones of the switches of an axis, as far as they lie where it went.
pub(super) fn zones(module: &VirtualModule, samples: &[Sampled], axis: usize) -> Vec<Band> {
    let number = u8::try_from(axis).unwrap_or(u8::MAX);
    let Some(described) = module.machine(number) else { return Vec::new() };
    let mut machines = samples.iter().filter_map(|sample| machine(sample, axis));
    let (low, high) =
        machines.clone().fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), m| {
            (low.min(m.stage), high.max(m.stage))
        });
    let Some(fine_steps) = machines.next_back().map(|last| last.fine_steps) else {
        return Vec::new();
    };
    let switches = described.switches();
    let zones = [&switches.left, &switches.right, &switches.home].into_iter().zip(SWITCHES);
    zones
        .filter_map(|(switch, name)| {
            let switch = switch.as_ref()?;
            let (from, to) = (switch.from / fine_steps, switch.to / fine_steps);
            (from < high && to > low).then(|| Band {
                name: format!("{name} switch"),
                from: from.max(low).round() as i64,
                to: to.min(high).round() as i64,
            })
        })
        .collect()
}

/// The panels below the position, each only if there is something to be seen.
pub(super) fn panels(samples: &[Sampled], axes: &[usize]) -> Vec<Panel> {
    let error = |axis: usize| curve(samples, axis, |sample| following_error(sample, axis));
    let with_machine: Vec<usize> = axes
        .iter()
        .copied()
        .filter(|&axis| samples.iter().any(|sample| machine(sample, axis).is_some()))
        .collect();
    let errors = with_machine.iter().map(|&axis| error(axis)).collect();
    let mut panels = Vec::new();
    panels.extend(panel("following error", "microsteps", errors));
    for (quantity, unit, of) in QUANTITIES {
        let curves = with_machine
            .iter()
            .map(|&axis| curve(samples, axis, |sample| Some(of(&machine(sample, axis)?))))
            .collect();
        panels.extend(panel(quantity, unit, curves));
    }
    panels
}

/// The switches of all axes that changed, three bits for each axis.
pub(super) fn switch_rows(levels: &Thinned<u32>) -> Vec<Row> {
    let row = |bit: usize| {
        let mut changes: Vec<(i64, bool)> =
            levels.moments.iter().map(|&(time, levels)| (time, levels >> bit & 1 != 0)).collect();
        changes.dedup_by_key(|change| change.1);
        let name = format!("{} {}", SWITCHES[bit % 3], bit / 3);
        (changes.len() > 1).then_some(Row { name, changes })
    };
    (0..30).filter_map(row).collect()
}

/// Levels of the switches of a sample, three bits for each axis.
pub(super) fn switches(machines: &[Option<MachineSample>]) -> u32 {
    let levels = machines.iter().flat_map(|machine| machine.map_or([false; 3], |m| m.switches));
    (0..30).zip(levels).fold(0, |all, (bit, level)| all | u32::from(level) << bit)
}

/// How far the stage is behind the counter.
fn following_error(sample: &Sampled, axis: usize) -> Option<f64> {
    Some(f64::from(*sample.positions.get(axis)?) - machine(sample, axis)?.stage)
}

fn machine(sample: &Sampled, axis: usize) -> Option<MachineSample> {
    sample.machines.get(axis).copied().flatten()
}

fn curve(samples: &[Sampled], style: usize, of: impl Fn(&Sampled) -> Option<f64>) -> Curve {
    let points =
        samples.iter().filter_map(|sample| Some((sample.time, of(sample)?.round() as i64)));
    Curve { style, points: points.collect() }
}

/// A panel, if one of its curves is not zero all the time.
fn panel(quantity: &'static str, unit: &'static str, curves: Vec<Curve>) -> Option<Panel> {
    let mut values = curves.iter().flat_map(|curve| &curve.points);
    let is_visible = values.any(|&(_, value)| value != 0);
    is_visible.then_some(Panel::Curves { quantity, unit, curves, bands: Vec::new() })
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Two axes with the same way of 1000 microsteps, the second one with a machine that stalls after 600 and
    /// touches its left switch on the way.
    fn stalled() -> Vec<Sampled> {
        let sampled = |at: i32| {
            let stage = f64::from(at.min(600));
            let machine = MachineSample {
                fine_steps: 1.0,
                rotor: stage,
                stage,
                speed: 0.0,
                load_angle: 0.0,
                load: 0.25,
                stallguard: 0,
                current: 1.5,
                lost_steps: 0,
                switches: [(300..=500).contains(&at), false, false],
                stop_flags: 0,
                driver_flags: 0,
            };
            Sampled {
                time: i64::from(at) * 1000,
                positions: vec![at, at],
                speeds: vec![0, 0],
                machines: vec![None, Some(machine)],
                servos: vec![None, None],
            }
        };
        (0..=10).map(|at| sampled(at * 100)).collect()
    }

    #[test]
    fn the_real_position_is_drawn_where_a_machine_is_elsewhere() {
        let [(axis, curve)] = &real_positions(&stalled(), &[0, 1])[..] else { panic!() };
        assert_eq!((*axis, curve.style), (1, beside(1)));
        assert_eq!(curve.points.last(), Some(&(1_000_000, 600)));
        // Half a microstep behind is not to be seen.
        let mut samples = stalled();
        for sample in &mut samples {
            let commanded = f64::from(sample.positions[1]);
            sample.machines[1].as_mut().unwrap().stage = commanded - 0.5;
        }
        assert!(real_positions(&samples, &[0, 1]).is_empty());
    }

    #[test]
    fn panels_are_there_for_what_is_to_be_seen() {
        let panels = panels(&stalled(), &[0, 1]);
        let seen: Vec<_> = panels
            .iter()
            .map(|panel| match panel {
                Panel::Curves { quantity, curves, .. } => (*quantity, curves[0].points[10].1),
                Panel::Levels { quantity, .. } => (*quantity, 0),
            })
            .collect();
        // 1000 commanded less 600, a quarter, one and a half ampere; no StallGuard value.
        assert_eq!(seen, [("following error", 400), ("load", 25), ("current", 1500)]);
        assert!(super::panels(&stalled(), &[0]).is_empty(), "there is no machine behind axis 0");
    }

    #[test]
    fn switches_that_change_have_a_row() {
        let mut levels = Thinned::new();
        stalled().iter().for_each(|sample| levels.push(sample.time, switches(&sample.machines)));
        let [row] = &switch_rows(&levels)[..] else { panic!() };
        assert_eq!(row.name, "left 1");
        assert_eq!(row.changes, [(0, false), (300_000, true), (600_000, false)]);
    }
}
