//! `--plot`: what is to be drawn of a run, however long, in bounded memory.

mod machines;
mod servos;

use opentmcl_firmware::Executed;
use opentmcl_virtual::{Event, MachineSample, Recorder, ServoSample, VirtualModule};
use opentmcl_wire::{Duration, Instant, Opcode};

use super::listing::Listing;
use super::ports;
use super::run::{Observer, Run};
use crate::failure::Failure;
use crate::plot::{Curve, Marker, Marks, Panel, Plot, Row, Size};

/// Samples per second to begin with.
const RATE: u32 = 1000;

/// More moments than can be told apart in a picture; from then on every second one is left out.
const MOMENTS: usize = 4096;

/// Labels are named each time the program comes to them as long as it does so this often at most.
const VISITS: usize = 24;

/// Collects what is to be drawn.
pub(super) struct Picture<'a> {
    listing: &'a Listing,
    start: Instant,
    recorder: Recorder,
    samples: Vec<Sampled>,
    outputs: Thinned<u8>,
    /// Levels of switches, three bits for each axis.
    switches: Thinned<u32>,
    waits: Thinned<()>,
    /// When the program came to a label, as long as these are few.
    visits: Vec<(i64, u16)>,
    /// When it first came to each label.
    first_visits: Vec<(i64, u16)>,
    /// By address, whether it has a label to which the program has not come yet.
    unvisited: Vec<bool>,
    stop: Option<i64>,
}

struct Sampled {
    time: i64,
    positions: Vec<i32>,
    speeds: Vec<i32>,
    machines: Vec<Option<MachineSample>>,
    servos: Vec<Option<ServoSample>>,
}

impl<'a> Picture<'a> {
    pub(super) fn new(listing: &'a Listing, start: Instant) -> Self {
        Self {
            listing,
            start,
            recorder: Recorder::new(start, RATE, Vec::new()),
            samples: Vec::new(),
            outputs: Thinned::new(),
            switches: Thinned::new(),
            waits: Thinned::new(),
            visits: Vec::new(),
            first_visits: Vec::new(),
            unvisited: listing.rows().map(|row| !row.label.is_empty()).collect(),
            stop: None,
        }
    }

    /// The picture of the run, which is over.
    pub(super) fn draw(mut self, title: &str, run: &mut Run) -> String {
        self.sample(&mut run.module);
        let moved: Vec<usize> = (0..)
            .zip(run.axes())
            .filter_map(|(axis, travel)| {
                let moves = travel.has_moved() || machines::has_moved(&self.samples, axis);
                moves.then_some(axis)
            })
            .collect();
        let curves = |of: fn(&Sampled) -> &[i32]| -> Vec<Curve> {
            let curve = |&axis: &usize| Curve {
                style: axis,
                points: self
                    .samples
                    .iter()
                    .filter_map(|sample| Some((sample.time, i64::from(*of(sample).get(axis)?))))
                    .collect(),
            };
            moved.iter().map(curve).collect()
        };
        let mut legend: Vec<(usize, String)> =
            moved.iter().map(|&axis| (axis, format!("axis {axis}"))).collect();
        let mut panels = Vec::new();
        let rows = self.output_rows(run);
        if run.module.model().motion.is_servo() {
            if !moved.is_empty() || rows.is_empty() {
                panels = servos::panels(&self.samples);
                legend = servos::legend();
            }
        } else if !moved.is_empty() || rows.is_empty() {
            let (speed, mut position) = (curves(|s| &s.speeds), curves(|s| &s.positions));
            let real = machines::real_positions(&self.samples, &moved);
            for (axis, curve) in real {
                legend.push((curve.style, format!("axis {axis}, real")));
                position.push(curve);
            }
            let bands = match moved[..] {
                [axis] => machines::zones(&run.module, &self.samples, axis),
                _ => Vec::new(),
            };
            panels = vec![
                Panel::Curves { quantity: "speed", unit: "pps", curves: speed, bands: Vec::new() },
                Panel::Curves { quantity: "position", unit: "microsteps", curves: position, bands },
            ];
            panels.extend(machines::panels(&self.samples, &moved));
        }
        let switches = machines::switch_rows(&self.switches);
        if !switches.is_empty() {
            panels.push(Panel::Levels { quantity: "switch", rows: switches });
        }
        if !rows.is_empty() {
            panels.push(Panel::Levels { quantity: "output", rows });
        }
        Plot {
            size: Size::default(),
            title: title.to_owned(),
            end: microseconds(run.module.now() - self.start),
            markers: self.markers(),
            marks: Some(Marks { name: "WAIT over", times: self.waits.times() }),
            legend,
            panels,
        }
        .draw()
    }

    /// The outputs that switched.
    fn output_rows(&self, run: &Run) -> Vec<Row> {
        ports::outputs(run.module.model())
            .filter_map(|(number, bit)| {
                let mut changes: Vec<(i64, bool)> = self
                    .outputs
                    .moments
                    .iter()
                    .map(|&(time, levels)| (time, levels >> bit & 1 != 0))
                    .collect();
                changes.dedup_by_key(|change| change.1);
                let switches = changes.iter().any(|change| change.1);
                switches.then(|| Row { name: number.to_string(), changes })
            })
            .collect()
    }

    fn markers(&self) -> Vec<Marker> {
        let visits = if self.visits.len() > VISITS { &self.first_visits } else { &self.visits };
        let named = |&(time, address): &(i64, u16)| Marker {
            time,
            command: self.listing.label(address).to_owned(),
            meaning: None,
        };
        let stop = self.stop.map(|time| Marker { time, command: "STOP".into(), meaning: None });
        visits.iter().map(named).chain(stop).collect()
    }

    fn sample(&mut self, module: &mut VirtualModule) {
        let sample = self.recorder.take(module);
        let levels = machines::switches(&sample.machines) | servos::switches(&sample.servos);
        let (time, switches) = (microseconds(sample.time), levels);
        if self.switches.moments.last().is_none_or(|last| last.1 != switches) {
            self.switches.push(time, switches);
        }
        self.samples.push(Sampled {
            time,
            positions: sample.positions.clone(),
            speeds: sample.speeds.clone(),
            machines: sample.machines.clone(),
            servos: sample.servos.clone(),
        });
        if self.samples.len() >= MOMENTS {
            let mut at = 0;
            self.samples.retain(|_| {
                at += 1;
                at % 2 == 1
            });
            self.recorder.halve_rate();
        }
    }

    fn executed(&mut self, executed: &Executed) {
        let since = microseconds(executed.since - self.start);
        let at = microseconds(executed.at - self.start);
        let address = executed.address;
        match Opcode::from_number(executed.command.number) {
            Some(Opcode::Wait) if at != since => self.waits.push(at, ()),
            Some(Opcode::Stop) => self.stop = Some(at),
            _ => {}
        }
        if self.listing.label(address).is_empty() {
            return;
        }
        if self.visits.len() <= VISITS {
            self.visits.push((since, address));
        }
        if self.unvisited.get_mut(usize::from(address)).is_some_and(std::mem::take) {
            self.first_visits.push((since, address));
        }
    }
}

impl Observer for Picture<'_> {
    fn event(&mut self, event: &Event<'_>) -> Result<(), Failure> {
        match *event {
            Event::Executed(executed) => self.executed(executed),
            Event::Outputs { at, after, .. } => {
                self.outputs.push(microseconds(at - self.start), after);
            }
        }
        Ok(())
    }

    fn due(&self) -> Option<Instant> {
        Some(self.recorder.due())
    }

    fn look(&mut self, module: &mut VirtualModule) -> Result<(), Failure> {
        self.sample(module);
        Ok(())
    }
}

/// Moments in order of time, at most one in each stretch of time; the stretches grow so that there are
/// never too many.
struct Thinned<T> {
    stretch: i64,
    moments: Vec<(i64, T)>,
}

impl<T> Thinned<T> {
    fn new() -> Self {
        Self { stretch: 1, moments: Vec::new() }
    }

    /// Adds a moment; of those in one stretch the last one is kept.
    fn push(&mut self, time: i64, value: T) {
        match self.moments.last_mut() {
            Some(last) if last.0 / self.stretch == time / self.stretch => *last = (time, value),
            _ => self.moments.push((time, value)),
        }
        while self.moments.len() > MOMENTS {
            self.stretch *= 2;
            let stretch = self.stretch;
            // Of two, `dedup_by` drops the later one, which is the one to keep.
            self.moments.dedup_by(|later, earlier| {
                let is_same = later.0 / stretch == earlier.0 / stretch;
                if is_same {
                    std::mem::swap(later, earlier);
                }
                is_same
            });
        }
    }

    fn times(&self) -> Vec<i64> {
        self.moments.iter().map(|moment| moment.0).collect()
    }
}

fn microseconds(time: Duration) -> i64 {
    i64::try_from(time.as_micros()).unwrap_or(i64::MAX)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn moments_that_are_far_apart_are_all_kept() {
        let mut thinned = Thinned::new();
        (0..1000).for_each(|time| thinned.push(time * 50, time));
        assert_eq!(thinned.moments.len(), 1000);
    }

    #[test]
    fn of_too_many_moments_the_last_one_of_each_stretch_is_kept() {
        let mut thinned = Thinned::new();
        // The values say which moment was the last one of the stretch.
        (0..100_000).for_each(|time| thinned.push(time, time));
        let stretch = thinned.stretch;
        assert!(thinned.moments.len() <= MOMENTS && thinned.moments.len() > MOMENTS / 4);
        for (at, (time, value)) in (1..).zip(&thinned.moments[..thinned.moments.len() - 1]) {
            assert_eq!((*time, *value), (at * stretch - 1, at * stretch - 1));
        }
        assert_eq!(thinned.moments.last(), Some(&(99_999, 99_999)));
    }
}
