//! One axis: a motion chip and, if it has one, the machine that its motor turns. [`Axis`] has a TMC5160; the axes of
//! [`crate::steppers`] have the same machines behind other chips.
//!
//! The chip tells where the field stands and how strong it is; the machine tells where the rotor then
//! is, and what of it comes back: switches, encoder, load. Between two events all of that is a function
//! of the time, so that asking changes nothing and an hour of cruising costs as much as a second.
//!
//! - `chip`: what a machine asks of its chips, whatever they are.
//! - `body`: machine and switches together, and what happens there by itself.
//! - `shaft`: torques, and how a shaft moves without a field.
//! - `rotor`: whether the rotor follows, is pressed against something, or is loose.
//! - `foresee`: when that next changes.
//! - `senses`: what comes back to the chip: StallGuard2, CoolStep, the encoder, faults.
//! - `switches`: contacts.
//!
//! # What is approximated
//!
//! - A rotor that follows the field does so at once, with the load angle at which the motor's torque is
//!   what the motion takes: `sin(angle) = demand / available`. It does not swing.
//! - A rotor that has lost the field gets no torque from it on average. It is caught again as soon as its
//!   swing in the field would stay within one period, and then loses whole electrical periods, which
//!   are four full steps each.
//! - A rotor without a field is moved on in steps of half a millisecond.
//! - A rotor that runs against something stays there until the field is half a period ahead, then falls
//!   back by a period and comes again if the field is slow enough to take it along.
//! - An open coil leaves no torque: half a motor holds, but does not turn.

mod body;
mod chip;
mod foresee;
mod rotor;
mod senses;
mod shaft;
mod switches;

use opentmcl_motion::Instant;

use crate::machine::Machine;
use crate::tmc5160::{Tmc5160, registers};

pub(crate) use body::Body;
pub(crate) use chip::Chip;
pub(crate) use switches::Contact;

/// A switch input of an axis.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum SwitchInput {
    /// Left limit switch.
    Left,
    /// Right limit switch.
    Right,
    /// Home switch.
    Home,
}

/// A coil of a motor.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Coil {
    /// Phase A.
    A,
    /// Phase B.
    B,
}

/// What is wrong with the wires of a coil.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum CoilFault {
    /// One of them is off.
    Open,
    /// One of them touches ground.
    ShortToGround,
}

/// How the rotor relates to the field.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Rotor {
    /// It follows the field.
    Following,
    /// Something stops it; the field presses it there.
    Pressed,
    /// It has lost the field: the motor has stalled.
    Slipping,
    /// There is no field; only friction, detent torque or shorted coils hold it.
    Free,
}

/// What an axis really does, which no register tells.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct View {
    /// Position of the rotor in fine steps (1/256 full step).
    pub rotor: f64,
    /// Position of the stage in fine steps: the rotor's, less the play.
    pub stage: f64,
    /// Speed of the rotor in fine steps per second.
    pub speed: f64,
    /// Angle by which the rotor lags behind the field, in electrical degrees, against the direction of
    /// the torque; 90 is the most that a motor can bear. 0 while it does not follow.
    pub load_angle: f64,
    /// Part of the torque available that the load takes, 0..1; 1 when it takes more.
    pub load: f64,
    /// StallGuard2 value, SG_RESULT.
    pub stallguard: u16,
    /// Amplitude of the phase currents in ampere.
    pub current: f64,
    /// Full steps that have been lost since power-up: the field's less the rotor's.
    pub lost_steps: i64,
    /// Whether and how the rotor follows.
    pub state: Rotor,
    /// Levels of the left, right and home input.
    pub switches: [bool; 3],
}

impl View {
    /// An axis whose motor follows every step, and carries a current of this amplitude.
    pub(crate) fn ideal(rotor: f64, speed: f64, current: f64, switches: [bool; 3]) -> Self {
        Self {
            rotor,
            stage: rotor,
            speed,
            load_angle: 0.0,
            load: 0.0,
            stallguard: 0,
            current,
            lost_steps: 0,
            state: Rotor::Following,
            switches,
        }
    }
}

/// What is done to a machine from outside.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Influence {
    /// Supply voltage of the driver in volt.
    Supply(f64),
    /// Temperature of the driver in degrees Celsius.
    DriverTemperature(f64),
    /// Whether torque is allowed (safe torque off).
    TorqueAllowed(bool),
    /// A further torque in Nm at the shaft, positive towards positive positions; replaces the last one.
    Torque(f64),
    /// Holds the rotor where it is, or lets it go.
    Blocked(bool),
    /// Breaks or mends the wires of a coil.
    Coil(Coil, Option<CoilFault>),
    /// Moves the rotor by hand to this position in fine steps, as far as the way goes.
    Position(f64),
}

/// A motion chip and its machine.
///
/// Times must not run backwards from one call to the next.
#[derive(Clone, Debug)]
pub struct Axis {
    chip: Tmc5160,
    body: Body,
}

impl Default for Axis {
    fn default() -> Self {
        Self::new()
    }
}

impl Axis {
    /// A chip with a motor that follows every step, in empty space.
    pub fn new() -> Self {
        Self { chip: Tmc5160::new(), body: Body::new() }
    }

    /// A chip whose motor turns this machine. `full_scale` is the amplitude of the phase currents in
    /// ampere that the driver gives at most.
    pub fn with_machine(machine: Machine, full_scale: f64) -> Self {
        let mut axis = Self { chip: Tmc5160::new(), body: Body::with_machine(machine, full_scale) };
        axis.body.settle(&mut axis.chip, Instant::from_ticks(0));
        axis
    }

    /// The machine; none for an axis in empty space.
    pub fn machine(&self) -> Option<&Machine> {
        self.body.machine()
    }

    /// Switches the chip off and on. The machine stays where it is.
    pub fn reset(&mut self, now: Instant) {
        self.change(now, |axis| {
            axis.chip.reset(now);
            axis.body.forget_losses();
        });
    }

    /// Reads a register of the chip.
    pub fn read(&mut self, address: u8, now: Instant) -> u32 {
        self.run(now);
        let Self { chip, body } = self;
        match address {
            registers::DRV_STATUS | registers::PWM_SCALE => body.sense(chip, now),
            registers::RAMP_STAT if chip.tells_stalls() && !body.cannot_stall() => {
                body.sense_load(chip, now);
            }
            registers::X_ENC => body.count(chip, now),
            _ => {}
        }
        chip.read(address, now)
    }

    /// Writes a register of the chip.
    pub fn write(&mut self, address: u8, value: u32, now: Instant) {
        if self.chip.plans_with(address, value) {
            // A move writes registers that hold its limits already; nothing follows from that.
            return;
        }
        self.change(now, |axis| axis.chip.write(address, value, now));
    }

    /// When something next happens on this axis that a register or a switch shows, as far as it can be
    /// foreseen; later than `now`.
    pub fn next_event(&mut self, now: Instant) -> Option<Instant> {
        self.run(now);
        let ramp = self.chip.next_event(now);
        match (ramp, self.body.due()) {
            (Some(ramp), Some(due)) => Some(ramp.min(due)),
            (ramp, due) => ramp.or(due),
        }
    }

    /// Level of the home switch input.
    pub fn home_switch(&mut self, now: Instant) -> bool {
        self.run(now);
        let [_, _, home] = self.body.levels(now);
        home
    }

    /// What the axis really does.
    pub fn view(&mut self, now: Instant) -> View {
        self.run(now);
        self.body.view(&self.chip, now).unwrap_or_else(|| {
            let field = self.chip.field(now);
            let rotor = field.position_at(now);
            let switches = self.body.levels(now);
            View::ideal(rotor, field.speed_at(now) * shaft::CLOCK, 0.0, switches)
        })
    }

    /// Does something to the machine; most of it is without effect where there is none.
    pub fn influence(&mut self, influence: Influence, now: Instant) {
        self.change(now, |axis| axis.body.influence(&mut axis.chip, influence, now));
    }

    /// Supply voltage of the driver in volt.
    pub fn set_supply(&mut self, volts: f64, now: Instant) {
        self.influence(Influence::Supply(volts), now);
    }

    /// Temperature of the driver in degrees Celsius.
    pub fn set_driver_temperature(&mut self, celsius: f64, now: Instant) {
        self.influence(Influence::DriverTemperature(celsius), now);
    }

    /// Whether torque is allowed (safe torque off).
    pub fn set_torque_allowed(&mut self, allowed: bool, now: Instant) {
        self.influence(Influence::TorqueAllowed(allowed), now);
    }

    /// A further torque in Nm at the shaft, positive towards positive positions; replaces the last one.
    pub fn set_external_torque(&mut self, torque: f64, now: Instant) {
        self.influence(Influence::Torque(torque), now);
    }

    /// Holds the rotor where it is, or lets it go.
    pub fn set_blocked(&mut self, blocked: bool, now: Instant) {
        self.influence(Influence::Blocked(blocked), now);
    }

    /// Holds a switch actuated or not actuated, or leaves it to the stage again.
    pub fn hold_switch(&mut self, switch: SwitchInput, held: Option<bool>, now: Instant) {
        self.change(now, |axis| axis.body.hold_switch(switch, held));
    }

    /// Breaks or mends the wires of a coil.
    pub fn set_coil(&mut self, coil: Coil, fault: Option<CoilFault>, now: Instant) {
        self.influence(Influence::Coil(coil, fault), now);
    }

    /// Moves the rotor by hand to this position in fine steps, as far as the way goes.
    pub fn set_position(&mut self, fine_steps: f64, now: Instant) {
        self.influence(Influence::Position(fine_steps), now);
    }

    /// Changes something at `now`, and lets the rest follow.
    fn change(&mut self, now: Instant, change: impl FnOnce(&mut Self)) {
        self.run(now);
        self.body.before_change(&mut self.chip, now);
        change(self);
        self.body.settle(&mut self.chip, now);
    }

    fn run(&mut self, now: Instant) {
        self.body.run(&mut self.chip, now);
    }
}
