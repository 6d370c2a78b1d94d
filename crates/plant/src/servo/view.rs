//! What a machine really does, which no converter tells.

use super::Setup;
use super::bridge::{Wiring, dot};
use super::mechanics::{RADIANS, TURN};
use super::state::State;

/// What a machine really does.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct View {
    /// Position of the rotor in turns.
    pub turns: f64,
    /// Position of the rotor in fine steps (1/65536 turn).
    pub rotor: f64,
    /// Position of the stage in fine steps: the rotor's, less the play.
    pub stage: f64,
    /// Speed of the rotor in revolutions per minute.
    pub speed: f64,
    /// Electrical angle of the rotor in turns, 0..1; 0 for a motor with brushes.
    pub electrical_angle: f64,
    /// Currents of the three legs in ampere, positive into the motor.
    pub currents: [f64; 3],
    /// Current along the flux in ampere; 0 for a motor with brushes.
    pub direct_current: f64,
    /// Current at right angles to the flux in ampere, which makes the torque; of a motor with brushes its current.
    pub torque_current: f64,
    /// Amplitude of the currents in ampere.
    pub amplitude: f64,
    /// Torque of the currents in Nm.
    pub torque: f64,
    /// Bus voltage in volt.
    pub bus: f64,
    /// Mean current in ampere that the bridge has taken from the bus in the last step, negative if it has given.
    pub bus_current: f64,
    /// Current in ampere that the source gives.
    pub source_current: f64,
    /// Current in ampere through the resistor of the brake chopper.
    pub chopper_current: f64,
    /// Temperature of the winding in degrees Celsius.
    pub winding_temperature: f64,
    /// Temperature of the driver in degrees Celsius.
    pub driver_temperature: f64,
    /// Levels of the left, right and home input.
    pub switches: [bool; 3],
}

impl State {
    pub(super) fn view(&self, setup: &Setup) -> View {
        let plan = &setup.plan;
        let winding = &plan.winding;
        let dynamics = &self.dynamics;
        let current = dynamics.current;
        let (direct, torque, angle) = match winding.wiring {
            Wiring::Single => (0.0, current[0], 0.0),
            Wiring::Star => {
                let field = plan.direction(dynamics.position);
                let turns = dynamics.position * winding.turns;
                let along = dot(current, [field[1], -field[0]]);
                (along, dot(current, field), turns - libm::floor(turns))
            }
        };
        let [winding_temperature, driver_temperature] = self.temperatures(setup, self.now);
        let supply = &plan.machine.supply;
        let source_current = (self.inputs.source - dynamics.bus) * supply.source_conductance();
        let chopper = if self.inputs.chopper { supply.chopper_conductance() } else { 0.0 };
        View {
            turns: dynamics.position / TURN,
            rotor: dynamics.position,
            stage: self.stage,
            speed: dynamics.speed / (TURN * RADIANS) * 60.0,
            electrical_angle: angle,
            currents: winding.wiring.currents(current),
            direct_current: direct,
            torque_current: torque,
            amplitude: libm::sqrt(dot(current, current)),
            torque: winding.scale * winding.emf * torque,
            bus: dynamics.bus,
            bus_current: dynamics.bus_current,
            source_current: source_current.max(0.0),
            chopper_current: dynamics.bus * chopper,
            winding_temperature,
            driver_temperature,
            switches: self.switches(),
        }
    }
}
