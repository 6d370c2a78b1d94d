//! Real time as the time of a module.

use std::time::Duration;

use opentmcl_wire::{Instant, TICKS_PER_SECOND};

const NANOS_PER_SECOND: u128 = 1_000_000_000;
const MILLIONTHS: f64 = 1e6;

/// How many seconds pass for the module in one second of real time.
///
/// Kept in millionths, so that the conversion is integer arithmetic: exact, monotonic and without
/// drift over any run time.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Speed {
    millionths: u64,
}

impl Speed {
    /// Real time.
    pub const REAL_TIME: Self = Self { millionths: 1_000_000 };
    /// The slowest factor that makes sense to serve.
    pub const MIN: f64 = 0.001;
    /// The fastest factor that makes sense to serve.
    pub const MAX: f64 = 1000.0;

    /// A factor of [`Speed::MIN`]..=[`Speed::MAX`], rounded to a millionth; `None` outside.
    pub fn new(factor: f64) -> Option<Self> {
        // The range check makes the conversion lossless: at most 10^9 millionths.
        (Self::MIN..=Self::MAX)
            .contains(&factor)
            .then(|| Self { millionths: (factor * MILLIONTHS).round() as u64 })
    }

    /// Ticks of the module's clock in this much real time, rounded down.
    pub fn ticks(self, real: Duration) -> u64 {
        let per_second = u128::from(TICKS_PER_SECOND) * u128::from(self.millionths);
        let ticks = real.as_nanos() * per_second / (NANOS_PER_SECOND * 1_000_000);
        u64::try_from(ticks).unwrap_or(u64::MAX)
    }

    /// The least real time in which this many ticks pass.
    fn real(self, ticks: u64) -> Duration {
        let per_second = u128::from(TICKS_PER_SECOND) * u128::from(self.millionths);
        let nanos = (u128::from(ticks) * NANOS_PER_SECOND * 1_000_000).div_ceil(per_second);
        Duration::from_nanos(u64::try_from(nanos).unwrap_or(u64::MAX))
    }
}

/// Real time since a module was powered up, and the module's time that belongs to it.
///
/// The module's time is `elapsed · 16 MHz · speed`, less what [`Clock::lose`] took away.
#[derive(Clone, Debug)]
pub struct Clock {
    start: std::time::Instant,
    speed: Speed,
    lost: Duration,
}

impl Clock {
    /// A clock that starts now: the module's time is zero.
    pub fn start(speed: Speed) -> Self {
        Self { start: std::time::Instant::now(), speed, lost: Duration::ZERO }
    }

    /// Real time since the start; the time base of everything below.
    pub fn elapsed(&self) -> Duration {
        self.start.elapsed()
    }

    /// The module's time after this much real time since the start.
    pub fn module_time(&self, elapsed: Duration) -> Instant {
        Instant::from_ticks(self.speed.ticks(elapsed.saturating_sub(self.lost)))
    }

    /// The real time since the start at which the module's time reaches `at`.
    pub fn when(&self, at: Instant) -> Duration {
        self.speed.real(at.as_ticks()).saturating_add(self.lost)
    }

    /// Takes real time away from the module: from now on it is this much later in real time.
    pub fn lose(&mut self, real: Duration) {
        self.lost = self.lost.saturating_add(real);
    }
}

/// Real time as a receiver counts it, whatever the speed of the module: the gaps between the bytes
/// of a client are real.
pub(crate) fn line_time(real: Duration) -> Instant {
    Instant::from_ticks(Speed::REAL_TIME.ticks(real))
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn at(speed: f64) -> Clock {
        Clock::start(Speed::new(speed).expect("a speed in range"))
    }

    #[test]
    fn in_real_time_a_microsecond_is_sixteen_ticks() {
        let clock = at(1.0);
        assert_eq!(clock.module_time(Duration::from_micros(1)).as_ticks(), 16);
        assert_eq!(clock.module_time(Duration::from_nanos(62)).as_ticks(), 0);
        assert_eq!(clock.module_time(Duration::from_nanos(63)).as_ticks(), 1);
    }

    #[test]
    fn a_year_of_real_time_is_exact_to_the_tick() {
        let year = Duration::from_secs(365 * 24 * 3600);
        assert_eq!(at(1.0).module_time(year).as_ticks(), 365 * 24 * 3600 * 16_000_000);
        assert_eq!(at(0.5).module_time(year).as_ticks(), 365 * 24 * 3600 * 8_000_000);
        assert_eq!(at(1000.0).module_time(year).as_ticks(), 365 * 24 * 3600 * 16_000_000_000);
    }

    #[test]
    fn lost_time_delays_everything_after_it() {
        let mut clock = at(2.0);
        let due = Instant::from_ticks(32_000_000);
        assert_eq!(clock.when(due), Duration::from_secs(1));
        clock.lose(Duration::from_secs(3));
        assert_eq!(clock.when(due), Duration::from_secs(4));
        assert_eq!(clock.module_time(Duration::from_secs(4)), due);
    }

    #[test]
    fn speeds_outside_the_range_are_refused() {
        assert_eq!(Speed::new(1.0), Some(Speed::REAL_TIME));
        for factor in [0.0, -1.0, 0.000_9, 1000.1, f64::NAN, f64::INFINITY] {
            assert_eq!(Speed::new(factor), None, "{factor}");
        }
    }

    proptest! {
        /// Sleeping until `when(t)` is enough and not a nanosecond too much.
        #[test]
        fn waiting_for_a_tick_ends_at_that_tick(speed in 0.001f64..1000.0, ticks in 1u64..1 << 50) {
            let clock = at(speed);
            let due = Instant::from_ticks(ticks);
            let when = clock.when(due);
            prop_assert!(clock.module_time(when) >= due);
            prop_assert!(clock.module_time(when - Duration::from_nanos(1)) < due);
        }
    }
}
