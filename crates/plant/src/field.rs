//! The magnetic field that a driver turns, as something that moves evenly.

use opentmcl_motion::Instant;

/// The field of the stator during a stretch of constant acceleration.
///
/// `n` clocks after `from` it is at `position + speed n + acceleration n² / 2`. Within a stretch it moves in one
/// direction.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Field {
    /// When the stretch begins.
    pub from: Instant,
    /// When it ends; none if it goes on until the next write.
    pub until: Option<Instant>,
    /// Position at `from` in fine steps (1/256 full step).
    pub position: f64,
    /// Speed at `from` in fine steps per clock.
    pub speed: f64,
    /// Acceleration in fine steps per clock².
    pub acceleration: f64,
}

impl Field {
    /// Position in fine steps at a time within the stretch.
    pub fn position_at(&self, time: Instant) -> f64 {
        let clocks = self.clocks(time);
        self.position + (self.speed + self.acceleration / 2.0 * clocks) * clocks
    }

    /// Speed in fine steps per clock at a time within the stretch.
    pub fn speed_at(&self, time: Instant) -> f64 {
        self.speed + self.acceleration * self.clocks(time)
    }

    fn clocks(&self, time: Instant) -> f64 {
        time.as_ticks().saturating_sub(self.from.as_ticks()) as f64
    }
}
