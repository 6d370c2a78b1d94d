//! Temperatures of winding and driver.
//!
//! Each warms up towards the one at which its losses flow off. A temperature is kept as the moment since which the
//! losses have been the same, and follows from that in closed form.

use super::{SECONDS_PER_TICK, WINDOW_TICKS};

/// How losses flow off.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct HeatPath {
    /// Kelvin above the surroundings per watt.
    pub resistance: f64,
    /// Time in seconds in which 63 % of a change has happened.
    pub time_constant: f64,
}

/// How winding and driver warm up. The resistance of the winding does not change with it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Thermal {
    /// The winding.
    pub winding: HeatPath,
    /// The driver's switches.
    pub driver: HeatPath,
    /// Temperature of the surroundings in degrees Celsius.
    pub ambient: f64,
}

/// 25 °C. Assumed for a motor of 42 mm: 4 K/W and a quarter of an hour, and for the switches on their board 12 K/W and
/// a minute.
impl Default for Thermal {
    fn default() -> Self {
        Self {
            winding: HeatPath { resistance: 4.0, time_constant: 900.0 },
            driver: HeatPath { resistance: 12.0, time_constant: 60.0 },
            ambient: 25.0,
        }
    }
}

/// Temperatures of a machine, as of the end of the last window.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Temperatures {
    pub(super) ambient: f64,
    /// Winding and driver at `since`, in degrees Celsius.
    winding: f64,
    driver: f64,
    since: u64,
    /// Mean square of the current since then, times the number of phases that a resistance counts for.
    square: f64,
    /// The same integrated since the beginning of the window.
    pub(super) collected: f64,
    pub(super) window: u64,
}

impl Temperatures {
    pub(super) fn new(ambient: f64) -> Self {
        Self {
            ambient,
            winding: ambient,
            driver: ambient,
            since: 0,
            square: 0.0,
            collected: 0.0,
            window: 0,
        }
    }

    /// Winding and driver at a time. The resistances in ohm are those that heat them.
    pub(super) fn at(&self, heat: &Heat, now: u64) -> [f64; 2] {
        let seconds = now.saturating_sub(self.since) as f64 * SECONDS_PER_TICK;
        [(self.winding, &heat.winding), (self.driver, &heat.driver)].map(|(from, part)| {
            let to = self.ambient + self.square * part.kelvin_per_square;
            to + (from - to) * libm::exp(-seconds * part.rate)
        })
    }

    /// Takes note of the losses since the beginning of the window when it is over.
    pub(super) fn pass(&mut self, heat: &Heat, now: u64) {
        let ticks = now - self.window;
        if ticks >= WINDOW_TICKS {
            self.end_window(heat, now, ticks);
        }
    }

    #[inline(never)]
    fn end_window(&mut self, heat: &Heat, now: u64, ticks: u64) {
        let square = self.collected / (ticks as f64 * SECONDS_PER_TICK);
        if square != self.square {
            self.restart(heat, self.window);
            self.square = square;
        }
        self.collected = 0.0;
        self.window = now;
    }

    /// Surroundings of another temperature from now on.
    pub(super) fn set_ambient(&mut self, celsius: f64, heat: &Heat, now: u64) {
        self.restart(heat, now);
        self.ambient = celsius;
    }

    pub(super) fn set_winding(&mut self, celsius: f64, heat: &Heat, now: u64) {
        self.restart(heat, now);
        self.winding = celsius;
    }

    pub(super) fn set_driver(&mut self, celsius: f64, heat: &Heat, now: u64) {
        self.restart(heat, now);
        self.driver = celsius;
    }

    /// The same window at another time.
    pub(super) fn later(&self, ticks: u64) -> Self {
        Self { window: self.window + ticks, ..*self }
    }

    fn restart(&mut self, heat: &Heat, now: u64) {
        let now = now.max(self.since);
        [self.winding, self.driver] = self.at(heat, now);
        self.since = now;
    }
}

/// What heats winding and driver, and how fast that flows off.
#[derive(Clone, Copy, Debug)]
pub(super) struct Heat {
    winding: HeatPart,
    driver: HeatPart,
}

#[derive(Clone, Copy, Debug)]
struct HeatPart {
    kelvin_per_square: f64,
    /// Per second.
    rate: f64,
}

impl Heat {
    /// With the resistances in ohm in which they arise.
    pub(super) fn new(thermal: &Thermal, winding: f64, driver: f64) -> Self {
        let part = |path: &HeatPath, ohms: f64| HeatPart {
            kelvin_per_square: path.resistance * ohms,
            rate: 1.0 / path.time_constant.max(1e-3),
        };
        Self { winding: part(&thermal.winding, winding), driver: part(&thermal.driver, driver) }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const SECOND: u64 = 16_000_000;

    #[test]
    fn constant_losses_warm_up_along_an_exponential_however_often_windows_end() {
        let heat = Heat::new(&Thermal::default(), 0.36, 0.004);
        let mut often = Temperatures::new(20.0);
        for window in 1..=900_000 / 60 {
            often.collected = 100.0 * 1e-3;
            often.pass(&heat, window * WINDOW_TICKS);
        }
        let [winding, driver] = often.at(&heat, 15 * SECOND);
        assert!((winding - (20.0 + 144.0 * (1.0 - (-15.0f64 / 900.0).exp()))).abs() < 1e-6);
        assert!((driver - (20.0 + 4.8 * (1.0 - (-15.0f64 / 60.0).exp()))).abs() < 1e-6);
        let [end, _] = often.at(&heat, 100_000 * SECOND);
        assert!((end - 164.0).abs() < 1e-6, "100 A² in 0.36 Ω are 36 W, times 4 K/W");
    }

    #[test]
    fn a_set_temperature_goes_back_to_that_of_the_surroundings() {
        let heat = Heat::new(&Thermal::default(), 0.36, 0.004);
        let mut cooling = Temperatures::new(25.0);
        cooling.set_driver(85.0, &heat, SECOND);
        assert_eq!(cooling.at(&heat, SECOND), [25.0, 85.0]);
        cooling.set_ambient(5.0, &heat, SECOND);
        let [_, driver] = cooling.at(&heat, 61 * SECOND);
        assert!((driver - (5.0 + 80.0 * (-1.0f64).exp())).abs() < 1e-9);
    }
}
