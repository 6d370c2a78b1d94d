//! The specific behaviours of a TMCM-1613 (global parameter 78): who sets its speed, and whether it speaks.
//!
//! # Readings
//!
//! - 10 V at the analog input are the maximum speed in analog mode, as the chapter on that mode says; the table of
//!   the parameter has 15 V.
//! - In analog mode no command is received; in mixed mode commands are carried out and not answered.
//! - Input 1 stops the motor in all modes but the default one. Its text in DC mode, that it chooses the direction,
//!   belongs to input 0 in analog mode.
//! - A motor that the stop input holds has the target speed 0.

use opentmcl_catalog::{Globals, Servo as Shared};

use super::{Mode, Servo, Surroundings};
use crate::board::Board;
use crate::module::Module;

/// Reading of analog input 0 of 15 V at power-up, from which on the stored behaviour counts: 20 V are 4095.
const USUAL_START: i32 = 3072;

/// Readings of analog input 0: 10 V, and what counts as 0 V.
const FULL_SPEED: i32 = 2048;
const NO_VOLTAGE: i32 = 8;

/// Supply in 0.1 V at which the speed is the maximum in DC mode.
const FULL_SUPPLY: i32 = 240;

/// Levels of the digital inputs.
const DIRECTION_INPUT: u8 = 1 << 0;
const STOP_INPUT: u8 = 1 << 1;
const SUPPLY_IS_POSITIVE: u8 = 1 << 2;

/// Values of the parameter.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(crate) enum Behaviour {
    /// The host commands.
    #[default]
    Default,
    /// The supply sets the speed.
    Dc,
    /// Analog input 0 sets the speed.
    Analog,
    /// The host commands and gets no answer.
    Mixed,
}

impl Behaviour {
    /// Of a value of the parameter; other values are the default.
    pub(crate) const fn of(value: i32) -> Self {
        match value {
            1 => Self::Dc,
            2 => Self::Analog,
            3 => Self::Mixed,
            _ => Self::Default,
        }
    }

    /// That of a module which finds this reading at analog input 0 when it starts.
    pub(crate) const fn at_start(stored: i32, reading: i32) -> Self {
        if reading < USUAL_START { Self::Analog } else { Self::of(stored) }
    }

    /// Whether it receives what a host sends.
    pub(crate) const fn hears(self) -> bool {
        !matches!(self, Self::Analog)
    }

    /// Whether it answers.
    pub(crate) const fn speaks(self) -> bool {
        matches!(self, Self::Default | Self::Dc)
    }
}

impl Servo {
    /// Takes another behaviour.
    pub(crate) fn behave(&mut self, behaviour: Behaviour) {
        self.behaviour = behaviour;
        self.is_armed = behaviour != Behaviour::Analog;
    }

    /// Sets the speed that inputs or the supply ask for, each millisecond.
    pub(super) fn step_behaviour(&mut self, around: &Surroundings) {
        let is_stopped = around.inputs & STOP_INPUT != 0;
        let largest = i64::from(self.settings[Shared::MaxVelocity]);
        let (part, whole, to_the_right) = match self.behaviour {
            Behaviour::Default => return,
            Behaviour::Mixed => {
                if is_stopped && self.mode != Mode::Stop {
                    self.turn(0);
                }
                return;
            }
            Behaviour::Dc => {
                let supply = i32::from(self.senses.supply) / 10;
                (supply.min(FULL_SUPPLY), FULL_SUPPLY, around.inputs & SUPPLY_IS_POSITIVE != 0)
            }
            Behaviour::Analog => {
                let reading = around.analog;
                // A motor does not start because its supply comes back.
                self.is_armed |= is_stopped || reading <= NO_VOLTAGE;
                let part = reading.min(FULL_SPEED);
                (part, FULL_SPEED, around.inputs & DIRECTION_INPUT == 0)
            }
        };
        let speed = (largest * i64::from(part) / i64::from(whole)) as i32;
        let speed = if is_stopped || !self.is_armed { 0 } else { speed };
        let speed = if to_the_right { speed } else { -speed };
        if self.is_ready() && (self.mode != Mode::Velocity || self.target_velocity != speed) {
            self.turn(speed);
        }
    }
}

impl<B: Board> Module<B> {
    /// Takes another behaviour of global parameter 78.
    pub(crate) fn behave(&mut self, behaviour: Behaviour) {
        self.globals.set(Globals::ModuleBehaviour, behaviour as i32);
        self.servo.behave(behaviour);
    }

    /// The present behaviour; that of other modules is the default one.
    pub(crate) fn behaviour(&self) -> Behaviour {
        self.servo.behaviour
    }
}
