//! The servo axis for those who look on.

use opentmcl_catalog::Servo as Shared;

use super::{Mode, Servo};
use crate::watch::ServoState;

impl Servo {
    /// What parameters tell, without what reading them would clear.
    pub(crate) fn watched(&self) -> ServoState {
        let position = self.external(self.position());
        let unit = self.current_unit();
        ServoState {
            target_position: self.target_position,
            ramp_position: self.watched_ramp(position),
            position,
            target_speed: self.target_velocity,
            ramp_speed: self.counted_speed(self.speed_ramp.speed()),
            speed: self.counted_speed(self.speed()),
            target_torque: self.demand.q.saturating_mul(unit),
            torque: self.measured.mean.q,
            target_flux: self.demand.d.saturating_mul(unit),
            flux: self.measured.mean.d,
            voltage: if self.is_driven() { self.voltage } else { 0 },
            status_flags: self.flags(),
            is_on_its_way: self.is_on_its_way(),
        }
    }

    fn watched_ramp(&self, position: i32) -> i32 {
        if self.position_ramp_is_on() {
            return self.external(i64::from(self.position_ramp.position()));
        }
        position
    }

    /// Whether a motion is under way that has an end. A motor that keeps turning has none.
    fn is_on_its_way(&self) -> bool {
        let turns = self.counted_speed(self.speed()) != 0;
        match self.mode {
            Mode::Stop => turns,
            Mode::Torque => false,
            Mode::Velocity => {
                let limit = self.settings[Shared::MaxVelocity];
                let target = self.target_velocity.clamp(-limit, limit);
                self.counted_speed(self.speed_ramp.speed()) != target || target == 0 && turns
            }
            Mode::Position => !self.has_arrived() || turns,
        }
    }
}
