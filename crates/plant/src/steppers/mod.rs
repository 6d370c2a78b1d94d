//! Stepper axes with a TMC429 for each three of them and a TMC26x for each motor.
//!
//! An axis has the addresses of its own motor's registers in the controller at 00h, those that the three axes
//! of a controller share at 30h, and its driver at 40h: writing sends a datagram there, reading gives the
//! reply that the next datagram would get.
//!
//! An axis without a machine follows its pulses, and nothing of it is measured; its switches can be held by hand.
//! With one it has all that an axis with a TMC5160 has, see [`crate::axis`], but for an encoder: there are no inputs
//! for it.
//!
//! # What is approximated
//!
//! A machine feels a field that moves without steps, see `course`. What the controller counts stays exact.

mod chips;
mod course;

use opentmcl_motion::Instant;

use crate::axis::{Body, Influence, SwitchInput, View};
use crate::machine::Machine;
use crate::tmc26x::Coils;
use crate::tmc429::Tmc429;
use crate::tmc429::registers::{GLOBAL_PARAMETERS, THIRD_IS_RIGHT_OF_FIRST};
use chips::{Chips, Wires};

/// Axes of a controller.
const GROUP: usize = 3;

/// Where an axis has the registers of its motor and those of its controller.
const MOTOR: core::ops::Range<u8> = 0x00..0x10;
const COMMON: core::ops::Range<u8> = 0x30..0x40;

/// The address at which an axis has its driver.
pub const DRIVER: u8 = 0x40;

/// Microsteps per second of a speed of 1 with a pulse divisor of 0.
const UNIT: f64 = 16e6 / 65_536.0;

/// One axis: its chips, and what is behind them.
#[derive(Clone, Debug)]
struct Stepper {
    wires: Wires,
    body: Body,
}

/// All axes of a board with such chips.
///
/// Times must not run backwards from one call to the next.
#[derive(Clone, Debug)]
pub struct Steppers {
    controllers: Vec<Tmc429>,
    axes: Vec<Stepper>,
    /// Amplitude of the phase currents at full scale in ampere.
    full_scale: f64,
}

impl Steppers {
    /// So many axes, switched on at time 0, with drivers of this full scale (amplitude, ampere), and with motors
    /// that follow every step in empty space.
    pub fn new(axes: u8, full_scale: f64) -> Self {
        Self::with_machines((0..axes).map(|_| None), full_scale)
    }

    /// The same with one axis for each of these, and its machine, if it has one. Encoders are left out.
    pub fn with_machines(
        machines: impl IntoIterator<Item = Option<Machine>>,
        full_scale: f64,
    ) -> Self {
        let stepper = |machine: Option<Machine>| Stepper {
            wires: Wires::new(machine.is_some()),
            body: match machine {
                Some(machine) => {
                    Body::with_machine(Machine { encoder: None, ..machine }, full_scale)
                }
                None => Body::new(),
            },
        };
        let axes: Vec<Stepper> = machines.into_iter().map(stepper).collect();
        let controllers = vec![Tmc429::new(); axes.len().div_ceil(GROUP)];
        let mut steppers = Self { controllers, axes, full_scale };
        let start = Instant::from_ticks(0);
        for axis in 0..steppers.len() {
            steppers.settle(axis, start);
        }
        steppers
    }

    /// How many axes there are.
    pub fn len(&self) -> u8 {
        self.axes.len() as u8
    }

    /// Whether there is none.
    pub fn is_empty(&self) -> bool {
        self.axes.is_empty()
    }

    /// The machine of an axis, if it has one.
    pub fn machine(&self, axis: u8) -> Option<&Machine> {
        self.axes.get(usize::from(axis))?.body.machine()
    }

    /// Axes, bit n for axis n, of which the next event may change with a write to this register of one of them.
    pub fn touched_with(&self, axis: u8, address: u8) -> u8 {
        if COMMON.contains(&address) {
            return 0b111u8.checked_shl((usize::from(axis) / GROUP * GROUP) as u32).unwrap_or(0);
        }
        self.moved_with(axis)
    }

    /// The same for what is done to the machine or the switches of an axis. The input of a third axis can be the
    /// right switch of the first.
    pub fn moved_with(&self, axis: u8) -> u8 {
        let own = 1u8.checked_shl(axis.into()).unwrap_or(0);
        if self.is_right_of_first(axis) { own | own >> 2 } else { own }
    }

    /// Switches all chips off and on. Rotors and switches stay as they are.
    pub fn reset(&mut self, now: Instant) {
        for axis in 0..self.len() {
            self.run(axis, now);
            self.before_change(axis, now);
        }
        for controller in &mut self.controllers {
            controller.reset(now);
        }
        for axis in 0..self.len() {
            if let Some((mut chips, body)) = self.parts(axis) {
                chips.reset_driver(now);
                body.forget_losses();
            }
        }
        for axis in 0..self.len() {
            self.settle(axis, now);
        }
    }

    /// Reads a register; 0 where there is none.
    pub fn read(&mut self, axis: u8, address: u8, now: Instant) -> u32 {
        self.run(axis, now);
        let place = self.place(axis, address);
        let Some((mut chips, body)) = self.parts(axis) else { return 0 };
        if address == DRIVER {
            chips.advance(now);
            body.sense(&mut chips, now);
            return chips.wires.driver.status(now);
        }
        place.map_or(0, |address| chips.controller.read(address, now))
    }

    /// Writes a register.
    pub fn write(&mut self, axis: u8, address: u8, value: u32, now: Instant) {
        let place = self.place(axis, address);
        if place.is_none() && address != DRIVER {
            return;
        }
        self.run(axis, now);
        if let (None, Some((mut chips, _))) = (place, self.parts(axis))
            && !chips.wires.driver.changes_with(value)
        {
            // Whoever reads the driver chooses first what its replies hold; the machine feels nothing of that.
            chips.advance(now);
            chips.wires.driver.write(value, now);
            return;
        }
        self.change(self.touched_with(axis, address), now, |steppers| {
            let Some((mut chips, _)) = steppers.parts(axis) else { return };
            let scale = chips.scale(now);
            match place {
                Some(address) => chips.controller.write(address, value, now),
                None => drop(chips.wires.driver.write(value, now)),
            }
            // Most of what is sent to a driver leaves the field as it is.
            if place.is_some() || chips.scale(now) != scale {
                steppers.renew(steppers.touched_with(axis, address), now);
            }
        });
    }

    /// When something next happens on this axis that a register or a switch shows, as far as it can be foreseen;
    /// later than `now`.
    pub fn next_event(&mut self, axis: u8, now: Instant) -> Option<Instant> {
        self.run(axis, now);
        let (chips, body) = self.parts(axis)?;
        let ramp = chips.controller.next_event_of(chips.motor, now);
        match (ramp, body.due()) {
            (Some(ramp), Some(due)) => Some(ramp.min(due)),
            (ramp, due) => ramp.or(due),
        }
    }

    /// Holds a switch actuated or not actuated, or leaves it to the stage again.
    pub fn hold_switch(&mut self, axis: u8, switch: SwitchInput, held: Option<bool>, now: Instant) {
        self.change(self.moved_with(axis), now, |steppers| {
            if let Some(stepper) = steppers.axes.get_mut(usize::from(axis)) {
                stepper.body.hold_switch(switch, held);
            }
        });
    }

    /// Does something to the machine of an axis; most of it is without effect where there is none.
    pub fn influence(&mut self, axis: u8, influence: Influence, now: Instant) {
        self.change(self.moved_with(axis), now, |steppers| {
            if let Some((mut chips, body)) = steppers.parts(axis) {
                body.influence(&mut chips, influence, now);
            }
        });
    }

    /// Whether the home switch of an axis is closed.
    pub fn home_switch(&mut self, axis: u8, now: Instant) -> bool {
        self.run(axis, now);
        self.axes.get(usize::from(axis)).is_some_and(|axis| axis.body.levels(now)[2])
    }

    /// What an axis really does; none if there is no such axis.
    pub fn view(&mut self, axis: u8, now: Instant) -> Option<View> {
        self.run(axis, now);
        let full_scale = self.full_scale;
        let (mut chips, body) = self.parts(axis)?;
        chips.advance(now);
        if let Some(view) = body.view(&chips, now) {
            return Some(view);
        }
        let microsteps = f64::from(chips.controller.velocity(chips.motor, now)) * UNIT
            / f64::from(1u32 << chips.pulse_divisor(now));
        let speed = microsteps * chips.scale(now) as f64;
        let current = match chips.wires.driver.coils(now) {
            Coils::Driven { scale, global } => {
                full_scale * f64::from(scale) / 32.0 * f64::from(global) / 256.0
            }
            Coils::Off | Coils::Shorted => 0.0,
        };
        Some(View::ideal(chips.wires.counted, speed, current, body.levels(now)))
    }

    /// The chips of an axis, and what is behind them.
    fn parts(&mut self, axis: u8) -> Option<(Chips<'_>, &mut Body)> {
        let axis = usize::from(axis);
        let controller = self.controllers.get_mut(axis / GROUP)?;
        let Stepper { wires, body } = self.axes.get_mut(axis)?;
        Some((Chips { controller, motor: axis % GROUP, wires }, body))
    }

    /// The controller's address of a register that the axis sees.
    fn place(&self, axis: u8, address: u8) -> Option<u8> {
        let motor = (usize::from(axis) % GROUP) as u8;
        if MOTOR.contains(&address) {
            Some(motor << 4 | address)
        } else {
            COMMON.contains(&address).then_some(address)
        }
    }

    /// Whether the input of this axis is the right switch of the first one of its controller.
    fn is_right_of_first(&self, axis: u8) -> bool {
        usize::from(axis) % GROUP == 2
            && self.controllers.get(usize::from(axis) / GROUP).is_some_and(|controller| {
                controller.register(GLOBAL_PARAMETERS) & THIRD_IS_RIGHT_OF_FIRST != 0
            })
    }

    /// Changes something on some axes at `now`, and lets the rest follow.
    fn change(&mut self, axes: u8, now: Instant, change: impl FnOnce(&mut Self)) {
        let changed = move |axis: &u8| axes >> *axis & 1 == 1;
        for axis in (0..self.len()).filter(changed) {
            self.run(axis, now);
            self.before_change(axis, now);
        }
        change(self);
        self.settle_all(axes, now);
    }

    /// Does what happens by itself until `now` on the axes that share a controller with this one, in the order in
    /// which it happens.
    fn run(&mut self, axis: u8, now: Instant) {
        let first = axis - axis % GROUP as u8;
        let group = first..(first + GROUP as u8).min(self.len());
        let due = |steppers: &Self, axis: u8| steppers.axes.get(usize::from(axis))?.body.due();
        while let Some((due, axis)) = group
            .clone()
            .filter_map(|axis| Some((due(self, axis)?, axis)))
            .filter(|(due, _)| *due <= now)
            .min()
        {
            let moved = self.moved_with(axis);
            for axis in group.clone().filter(|axis| moved >> axis & 1 == 1) {
                self.before_change(axis, due);
            }
            self.settle_all(moved, due);
        }
        for axis in group {
            if let Some((mut chips, body)) = self.parts(axis)
                && body.machine().is_some()
            {
                chips.advance(now);
            }
        }
    }

    /// Brings an axis to `now`, before which nothing happens any more.
    fn before_change(&mut self, axis: u8, now: Instant) {
        if let Some((mut chips, body)) = self.parts(axis) {
            chips.advance(now);
            body.before_change(&mut chips, now);
        }
    }

    /// Finds out anew how some axes go on.
    fn renew(&mut self, axes: u8, now: Instant) {
        for axis in (0..self.len()).filter(|axis| axes >> axis & 1 == 1) {
            if let Some((mut chips, _)) = self.parts(axis) {
                chips.renew(now);
            }
        }
    }

    /// Brings some axes into accord with their machines; first those whose switches move others.
    fn settle_all(&mut self, axes: u8, now: Instant) {
        for axis in (0..self.len()).rev().filter(|axis| axes >> axis & 1 == 1) {
            if self.is_right_of_first(axis + 2) {
                self.renew(1 << axis, now);
            }
            self.settle(axis, now);
        }
    }

    fn settle(&mut self, axis: u8, now: Instant) {
        if let Some((mut chips, body)) = self.parts(axis) {
            chips.advance(now);
            body.settle(&mut chips, now);
        }
    }
}
