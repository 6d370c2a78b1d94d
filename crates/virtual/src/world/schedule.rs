//! What happens by itself at set times.

use opentmcl_wire::Instant;

use super::action::{Action, AnalogLevel, Push};

/// A periodic change, sampled at times that depend on nothing else.
#[derive(Clone, Debug, PartialEq)]
pub struct Wave {
    /// What its smallest value does.
    pub low: Action,
    /// What its largest value does.
    pub high: Action,
    /// How it goes from one to the other.
    pub shape: Shape,
    /// When it begins.
    pub start: Instant,
    /// Length of one period in clocks, at least 2.
    pub period: u64,
    /// When it ends, if ever; the last value stays.
    pub end: Option<Instant>,
}

/// How a wave goes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Shape {
    /// High for the first half of a period, low for the second.
    Square,
    /// Steadily from low to high, and again; a value every so many clocks.
    Ramp {
        /// Clocks between two values, at least 1.
        every: u64,
    },
    /// A sine that begins in the middle and goes up; a value every so many clocks.
    Sine {
        /// Clocks between two values, at least 1.
        every: u64,
    },
}

impl Wave {
    /// Time of a value, counted from 0.
    fn time(&self, number: u64) -> Option<Instant> {
        let clocks = match self.shape {
            Shape::Square => u128::from(number) * u128::from(self.period) / 2,
            Shape::Ramp { every } | Shape::Sine { every } => u128::from(number) * u128::from(every),
        };
        let ticks = self.start.as_ticks().checked_add(u64::try_from(clocks).ok()?)?;
        Some(Instant::from_ticks(ticks)).filter(|time| self.end.is_none_or(|end| *time <= end))
    }

    fn action(&self, number: u64) -> Action {
        let phase = |every: u64| {
            let clocks = u128::from(number) * u128::from(every) % u128::from(self.period.max(1));
            clocks as f64 / self.period.max(1) as f64
        };
        let part = match self.shape {
            Shape::Square if number.is_multiple_of(2) => return self.high.clone(),
            Shape::Square => return self.low.clone(),
            Shape::Ramp { every } => phase(every),
            Shape::Sine { every } => 0.5 + 0.5 * libm::sin(std::f64::consts::TAU * phase(every)),
        };
        between(&self.low, &self.high, part).unwrap_or_else(|| self.low.clone())
    }
}

/// The action between two that differ in nothing but a number; `part` is 0 for the first one and 1 for
/// the second.
pub(crate) fn between(low: &Action, high: &Action, part: f64) -> Option<Action> {
    let mix = |low: f64, high: f64| low + (high - low) * part;
    Some(match (low, high) {
        (Action::Supply(low), Action::Supply(high)) => Action::Supply(mix(*low, *high)),
        (Action::BoardTemperature(low), Action::BoardTemperature(high)) => {
            Action::BoardTemperature(mix(*low, *high))
        }
        (Action::AmbientTemperature(low), Action::AmbientTemperature(high)) => {
            Action::AmbientTemperature(mix(*low, *high))
        }
        (
            &Action::MotorTemperature { axis, celsius },
            &Action::MotorTemperature { axis: other, celsius: high },
        ) if axis == other => Action::MotorTemperature { axis, celsius: mix(celsius, high) },
        (
            &Action::DriverTemperature { axis, celsius },
            &Action::DriverTemperature { axis: other, celsius: high },
        ) if axis == other => Action::DriverTemperature { axis, celsius: mix(celsius, high) },
        (&Action::Load { axis, push }, &Action::Load { axis: other, push: high })
            if axis == other =>
        {
            let push = match (push, high) {
                (Push::Torque(low), Push::Torque(high)) => Push::Torque(mix(low, high)),
                (Push::Force(low), Push::Force(high)) => Push::Force(mix(low, high)),
                _ => return None,
            };
            Action::Load { axis, push }
        }
        (&Action::Analog { input, level }, &Action::Analog { input: other, level: high })
            if input == other =>
        {
            let level = match (level, high) {
                (AnalogLevel::Reading(low), AnalogLevel::Reading(high)) => {
                    AnalogLevel::Reading((mix(low.into(), high.into()) + 0.5) as u16)
                }
                (AnalogLevel::Volts(low), AnalogLevel::Volts(high)) => {
                    AnalogLevel::Volts(mix(low, high))
                }
                _ => return None,
            };
            Action::Analog { input, level }
        }
        _ => return None,
    })
}

/// Actions and waves, in the order of their times.
#[derive(Clone, Debug, Default)]
pub(crate) struct Schedule {
    /// Ascending; what has the same time stays in the order in which it was written.
    actions: Vec<(Instant, Action)>,
    /// How many of them are over.
    over: usize,
    /// Each wave, and the number of its next value.
    waves: Vec<(Wave, u64)>,
}

impl Schedule {
    pub(crate) fn new(mut actions: Vec<(Instant, Action)>, waves: Vec<Wave>) -> Self {
        actions.sort_by_key(|(time, _)| *time);
        Self { actions, over: 0, waves: waves.into_iter().map(|wave| (wave, 0)).collect() }
    }

    /// When something happens next.
    pub(crate) fn next_time(&self) -> Option<Instant> {
        let action = self.actions.get(self.over).map(|(time, _)| *time);
        let waves = self.waves.iter().filter_map(|(wave, number)| wave.time(*number));
        action.into_iter().chain(waves).min()
    }

    /// The next action that is due; actions come before waves of the same time.
    pub(crate) fn pop(&mut self, now: Instant) -> Option<Action> {
        let next = self.next_time().filter(|next| *next <= now)?;
        if let Some((time, action)) = self.actions.get(self.over)
            && *time == next
        {
            self.over += 1;
            return Some(action.clone());
        }
        let (wave, number) =
            self.waves.iter_mut().find(|(wave, number)| wave.time(*number) == Some(next))?;
        let action = wave.action(*number);
        *number += 1;
        Some(action)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn volts(level: f64) -> Action {
        Action::Analog { input: 0, level: AnalogLevel::Volts(level) }
    }

    fn played(wave: Wave, until: u64) -> Vec<(u64, Action)> {
        let mut schedule = Schedule::new(Vec::new(), vec![wave]);
        let mut played = Vec::new();
        while let Some(time) = schedule.next_time().filter(|time| time.as_ticks() <= until) {
            played.push((time.as_ticks(), schedule.pop(time).unwrap()));
        }
        played
    }

    fn wave(shape: Shape) -> Wave {
        let start = Instant::from_ticks(1000);
        Wave { low: volts(1.0), high: volts(5.0), shape, start, period: 400, end: None }
    }

    #[test]
    fn a_square_is_high_for_the_first_half() {
        let expected = [(1000, volts(5.0)), (1200, volts(1.0)), (1400, volts(5.0))];
        assert_eq!(played(wave(Shape::Square), 1599), expected);
    }

    #[test]
    fn a_ramp_rises_steadily_and_falls_back() {
        // 1 V + 4 V · k/4, and after a whole period from the beginning.
        let expected = [
            (1000, volts(1.0)),
            (1100, volts(2.0)),
            (1200, volts(3.0)),
            (1300, volts(4.0)),
            (1400, volts(1.0)),
        ];
        assert_eq!(played(wave(Shape::Ramp { every: 100 }), 1400), expected);
    }

    #[test]
    fn a_sine_begins_in_the_middle_and_goes_up() {
        let played = played(wave(Shape::Sine { every: 100 }), 1300);
        // 3 V + 2 V · sin: 0, 1, 0, -1.
        for ((_, action), expected) in played.iter().zip([3.0, 5.0, 3.0, 1.0]) {
            let Action::Analog { level: AnalogLevel::Volts(volts), .. } = action else { panic!() };
            assert!((volts - expected).abs() < 1e-12, "{volts}");
        }
        assert_eq!(played.len(), 4);
    }

    #[test]
    fn a_wave_ends() {
        let end = Some(Instant::from_ticks(1250));
        assert_eq!(played(Wave { end, ..wave(Shape::Square) }, 9999).len(), 2);
    }

    #[test]
    fn what_has_the_same_time_happens_in_the_order_in_which_it_is_written() {
        let at = Instant::from_ticks;
        let actions = vec![
            (at(7), Action::PowerCycle),
            (at(5), Action::Supply(1.0)),
            (at(5), Action::Supply(2.0)),
        ];
        let wave = Wave { start: at(5), ..wave(Shape::Square) };
        let mut schedule = Schedule::new(actions, vec![wave]);
        let played: Vec<_> = std::iter::from_fn(|| schedule.pop(at(7))).collect();
        let expected = [Action::Supply(1.0), Action::Supply(2.0), volts(5.0), Action::PowerCycle];
        assert_eq!(played, expected);
    }
}
