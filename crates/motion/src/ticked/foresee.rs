//! What an axis will do if nobody interferes.

use super::{Mode, Ramp, SPEED_SHIFT};
use crate::{Duration, Instant};

/// Ramp ticks to look ahead at most: a third of a millisecond of calculation.
const TICKS_AHEAD: u64 = 1 << 16;

/// How an axis moves at present.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Motion {
    /// Velocity in 1/256 of a register unit.
    pub velocity: i32,
    /// By how many 1/256 the velocity will change at `until`; 0 if it is constant.
    ///
    /// Whoever wants no steps in the velocity takes it for the slope up to there.
    pub change: i32,
    /// The next ramp tick at which the velocity may change; none if it stays until the axis stops on
    /// its target or is given something else to do.
    pub until: Option<Instant>,
    /// Time between two ramp ticks.
    pub period: Duration,
}

impl Ramp {
    /// How the axis moves at the time to which it was advanced last.
    pub fn motion(&self) -> Motion {
        let tick = self.next_change();
        Motion {
            velocity: self.velocity,
            change: self.next_velocity() - self.velocity,
            until: Some(tick).filter(|&tick| tick != u64::MAX).map(Instant::from_ticks),
            period: Duration::from_ticks(self.ramp_period()),
        }
    }

    /// When, after `now`, the axis next arrives, stops or reaches a constant speed; none if nothing of
    /// that kind is to come.
    ///
    /// Costs as much as advancing up to there. With a long acceleration in short ticks it looks 2^16 ramp
    /// ticks ahead and gives the end of that time, at which to ask again.
    pub fn next_event(&self, now: Instant) -> Option<Instant> {
        let mut ahead = self.clone();
        ahead.advance(now);
        ahead.events = super::Events::default();
        let period = self.ramp_period();
        let end = ahead.time.saturating_add(period * TICKS_AHEAD);
        while ahead.time < end {
            let tick = ahead.next_change();
            if tick == u64::MAX {
                return ahead.arrival().map(Instant::from_ticks);
            }
            ahead.step(tick);
            if ahead.events.stopped {
                return ahead.stopped_at.map(Instant::from_ticks);
            }
            if ahead.acceleration() != 0 && ahead.has_reached_its_speed() {
                break;
            }
            ahead.stride(ahead.time.saturating_add(period * TICKS_AHEAD));
            if ahead.acceleration() != 0 && ahead.has_reached_its_speed() {
                break;
            }
        }
        Some(Instant::from_ticks(ahead.time))
    }

    /// Whether the velocity is the one that the axis was after.
    fn has_reached_its_speed(&self) -> bool {
        let settings = &self.settings;
        let speed = self.velocity.unsigned_abs();
        match settings.mode {
            Mode::Velocity | Mode::Hold => self.next_change() == u64::MAX,
            Mode::Ramp | Mode::Soft => {
                speed == settings.v_max << SPEED_SHIFT && self.next_velocity() == self.velocity
                    || self.next_change() == u64::MAX
            }
        }
    }
}
