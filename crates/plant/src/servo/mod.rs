//! The machine behind a servo module: supply, bridge, motor, what the motor turns, and all that measures it.
//!
//! A module gives its machine [`Power`] in each control interrupt and gets [`Senses`] from it. In between the machine
//! moves on in steps of at most a control period, see `step`.
//!
//! - `motor`: motors and their presets.
//! - `bridge`: the legs and their diodes.
//! - `supply`: source, capacitor, brake chopper.
//! - `mechanics`: torques, friction, the holding brake, ends of the way.
//! - `decay`, `step`: how all of that goes on in time.
//! - `sensing`: converters of currents; `sensors`: halls and encoders.
//! - `thermal`: temperatures.
//! - `state`: the state of a machine, and what is done to it; `view`: what it really does.
//!
//! # What is approximated
//!
//! - Voltages are averaged over the period: there is no ripple of the pulse width modulation, no dead time, no drop of
//!   diodes.
//! - Inductances and magnets are the same at all positions, currents and temperatures; the EMF is sinusoidal.
//! - Shaft and load are rigid; play between motor and stage has no inertia and no impact.
//! - The holding brake brakes like dry friction.

mod bridge;
mod decay;
mod mechanics;
pub mod motor;
mod sensing;
mod sensors;
mod state;
mod step;
mod supply;
mod thermal;
mod view;

use std::sync::Arc;

use opentmcl_motion::Instant;
use opentmcl_motion::servo::{PERIOD_TICKS, Power, Senses};

use crate::axis::SwitchInput;
use crate::machine::{Encoder, Load, Stage, Switches};
use sensing::Converters;
use sensors::Sensors;
use state::State;
use step::Plan;

pub use bridge::Bridge;
pub use mechanics::HoldingBrake;
pub use motor::Motor;
pub use sensing::{Noise, Sensing, SingleShunt, TwoShunt};
pub use sensors::{Absolute, Halls, LineFault};
pub use supply::Supply;
pub use thermal::{HeatPath, Thermal};
pub use view::View;

const SECONDS_PER_TICK: f64 = 1.0 / opentmcl_motion::TICKS_PER_SECOND as f64;

const PERIOD_SECONDS: f64 = PERIOD_TICKS as f64 * SECONDS_PER_TICK;

/// Losses are averaged over so many ticks.
const WINDOW_TICKS: u64 = 20 * PERIOD_TICKS;

/// The machine behind a servo module.
#[derive(Clone, Debug, PartialEq)]
pub struct Machine {
    /// The motor.
    pub motor: Motor,
    /// What it turns.
    pub load: Load,
    /// Where the way ends and what lies along it.
    pub stage: Stage,
    /// Left limit switch, right limit switch, home switch.
    pub switches: Switches,
    /// Hall sensors; only brushless motors have them.
    pub halls: Option<Halls>,
    /// The incremental encoder, with lines A, B and index. One with sine and cosine counts as one whose counts are
    /// those after interpolation.
    pub encoder: Option<Encoder>,
    /// The absolute encoder.
    pub absolute: Option<Absolute>,
    /// The holding brake.
    pub brake: Option<HoldingBrake>,
    /// The switches of the bridge.
    pub bridge: Bridge,
    /// What feeds it.
    pub supply: Supply,
    /// How it warms up.
    pub thermal: Thermal,
}

impl Machine {
    /// A motor that turns nothing, with halls if it is brushless, and with an encoder of 4096 counts.
    pub fn new(motor: Motor) -> Self {
        Self {
            motor,
            load: Load::default(),
            stage: Stage::default(),
            switches: Switches::default(),
            halls: matches!(motor, Motor::Brushless(_)).then(Halls::default),
            encoder: Some(Encoder { counts: 4096.0, index: 0.0, reversed: false, on_stage: false }),
            absolute: None,
            brake: None,
            bridge: Bridge::default(),
            supply: Supply::default(),
            thermal: Thermal::default(),
        }
    }
}

/// What is done to a machine from outside. Numbers that are not finite change nothing.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Influence {
    /// Voltage of the source in volt.
    SourceVoltage(f64),
    /// Temperature of the surroundings in degrees Celsius.
    Ambient(f64),
    /// Temperature of the driver in degrees Celsius, from which it goes on.
    DriverTemperature(f64),
    /// Temperature of the winding in degrees Celsius, from which it goes on.
    WindingTemperature(f64),
    /// A further torque in Nm at the shaft, positive towards positive positions; replaces the last one.
    Torque(f64),
    /// Holds the rotor where it is, or lets it go.
    Blocked(bool),
    /// Moves the rotor by hand to this position in fine steps, as far as the way goes, and lets it go there.
    Position(f64),
    /// Breaks or mends the wire of a hall line, 0 to 2.
    HallLine(u8, LineFault),
    /// Whether the gate driver reports a fault. It then keeps all switches open.
    DriverFault(bool),
    /// Takes the wire of a motor phase, 0 to 2, off, or puts it on.
    PhaseOpen(u8, bool),
    /// Holds a switch actuated or not actuated, or leaves it to the stage again.
    Switch(SwitchInput, Option<bool>),
}

/// A machine in motion.
///
/// Times must not run backwards from one call to the next. At first the capacitor has the voltage of the source, the
/// rotor stands at the start of the stage, and nothing is driven.
#[derive(Clone, Debug)]
pub struct Servo {
    setup: Arc<Setup>,
    state: State,
}

/// What follows from the data of a machine.
#[derive(Debug)]
struct Setup {
    plan: Plan,
    sensors: Sensors,
    converters: Converters,
}

impl Servo {
    /// A machine, and how its currents are measured.
    pub fn new(machine: Machine, sensing: Sensing) -> Self {
        let sensors = Sensors::new(&machine);
        let converters = Converters::new(sensing);
        let setup = Setup { plan: Plan::new(machine), sensors, converters };
        let state = State::new(&setup);
        Self { setup: Arc::new(setup), state }
    }

    /// The machine.
    pub fn machine(&self) -> &Machine {
        &self.setup.plan.machine
    }

    /// What the control interrupt reads at `now`. What has happened since the last interrupt counts from the last
    /// call on.
    #[inline]
    pub fn sense(&mut self, now: Instant) -> Senses {
        self.come_to(now);
        self.state.sense(&self.setup)
    }

    /// Drives bridge, chopper and brake like this from `now` on.
    #[inline]
    pub fn drive(&mut self, power: &Power, now: Instant) {
        self.come_to(now);
        self.state.drive(&self.setup, power);
    }

    /// Does something to the machine.
    pub fn influence(&mut self, influence: Influence, now: Instant) {
        self.come_to(now);
        self.state.influence(&self.setup, influence);
    }

    /// Brings the machine to `now`.
    pub fn come_to(&mut self, now: Instant) {
        self.state.come_to(&self.setup, now.as_ticks());
    }

    /// What the machine really does at `now`; changes nothing. Costs little if it has been still since the last call.
    pub fn view(&self, now: Instant) -> View {
        let mut state = self.state;
        state.skip(&self.setup, now.as_ticks());
        state.view(&self.setup)
    }

    /// Levels of the left limit switch, the right one and the home switch at `now`; changes nothing.
    pub fn switches(&self, now: Instant) -> [bool; 3] {
        if !self.state.has_switches() {
            return [false; 3];
        }
        let mut state = self.state;
        state.skip(&self.setup, now.as_ticks());
        state.switches()
    }

    /// Temperatures of winding and driver in degrees Celsius at `now`; changes nothing.
    pub fn temperatures(&self, now: Instant) -> [f64; 2] {
        self.state.temperatures(&self.setup, now.as_ticks())
    }

    /// Whether nothing will change any more, except temperatures, as long as nobody drives or influences the machine
    /// otherwise: neither a reading nor a switch. Costs twenty control periods where it is so, and one where it is not.
    pub fn is_still(&self) -> bool {
        self.state.is_still(&self.setup)
    }

    /// Brings the machine to `now` exactly as if it had been asked for its senses in each control period on the way,
    /// but at once if it is still. The senses themselves are those of the last interrupt but for what they say of the
    /// period just past.
    pub fn skip(&mut self, now: Instant) {
        self.state.skip(&self.setup, now.as_ticks());
    }
}
