//! Stepper axes with a TMC429 for each three of them and a TMC26x for each motor, which follow every step.
//!
//! An axis has the addresses of its own motor's registers in the controller at 00h, those that the three axes
//! of a controller share at 30h, and its driver at 40h: writing sends a datagram there, reading gives the
//! reply that the next datagram would get.
//!
//! Machines behind these axes are not modelled: a motor follows its pulses, and nothing of it is measured.
//! Its switches can be held by hand.

use core::num::NonZeroU64;

use opentmcl_motion::Instant;

use crate::axis::{Rotor, SwitchInput, View};
use crate::tmc26x::{Coils, Motion, Tmc26x};
use crate::tmc429::Tmc429;
use crate::tmc429::registers::{DIVISORS, IF_CONFIGURATION, of_axis};

/// Axes of a controller.
const GROUP: usize = 3;

/// Where an axis has the registers of its motor, those of its controller, and its driver.
const MOTOR: core::ops::Range<u8> = 0x00..0x10;
const COMMON: core::ops::Range<u8> = 0x30..0x40;
const DRIVER: u8 = 0x40;

/// IF_CONFIGURATION: the direction pins of the three axes are inverted.
const INVERT_DIRECTION: u32 = 1 << 4;

/// The scale of currents with the low sense voltage (VSENSE = 1), for which modules are made.
const LOW_SCALE: f64 = 136.0;

/// Microsteps per second of a speed of 1 with a pulse divisor of 0.
const UNIT: f64 = 16e6 / 65_536.0;

/// Binary logarithm of the clocks in which [`Motion`] counts, less that of the clocks between two pulses with
/// a speed of 1 and a pulse divisor of 0.
const RATE_SHIFT: u32 = 37 - 16;

/// One axis: its driver, its switches, and how far its rotor has come.
#[derive(Clone, Debug)]
struct Stepper {
    driver: Tmc26x,
    /// Left, right, home; none is as nobody holds them, open.
    held: [Option<bool>; 3],
    /// Pulses that have been counted.
    pulses: i64,
    /// Position of the rotor in fine steps.
    rotor: f64,
}

/// All axes of a board with such chips.
///
/// Times must not run backwards from one call to the next.
#[derive(Clone, Debug)]
pub struct Steppers {
    controllers: Vec<Tmc429>,
    axes: Vec<Stepper>,
    /// Amplitude of the phase currents at full scale in ampere, with the low sense voltage.
    full_scale: f64,
}

impl Steppers {
    /// So many axes, switched on at time 0, with drivers of this full scale (amplitude in
    /// ampere, with the low sense voltage).
    pub fn new(axes: u8, full_scale: f64) -> Self {
        let axes = usize::from(axes);
        let stepper = Stepper { driver: Tmc26x::new(), held: [None; 3], pulses: 0, rotor: 0.0 };
        Self {
            controllers: vec![Tmc429::new(); axes.div_ceil(GROUP)],
            axes: vec![stepper; axes],
            full_scale,
        }
    }

    /// How many axes there are.
    pub fn len(&self) -> u8 {
        self.axes.len() as u8
    }

    /// Whether there is none.
    pub fn is_empty(&self) -> bool {
        self.axes.is_empty()
    }

    /// Axes that share a controller with this one, bit n for axis n.
    pub fn group_of(axis: u8) -> u8 {
        0b111 << (usize::from(axis) / GROUP * GROUP)
    }

    /// Switches all chips off and on. Rotors and switches stay as they are.
    pub fn reset(&mut self, now: Instant) {
        for axis in 0..self.len() {
            self.follow(axis, now);
        }
        for controller in &mut self.controllers {
            controller.reset(now);
        }
        for axis in 0..self.len() {
            if let Some(stepper) = self.axes.get_mut(usize::from(axis)) {
                stepper.driver.reset(now);
            }
            self.tell_switches(axis, now);
            self.follow(axis, now);
        }
    }

    /// Reads a register; 0 where there is none.
    pub fn read(&mut self, axis: u8, address: u8, now: Instant) -> u32 {
        if address == DRIVER {
            self.follow(axis, now);
            return self.axes.get(usize::from(axis)).map_or(0, |axis| axis.driver.status(now));
        }
        match (self.place(axis, address), self.controller(axis)) {
            (Some(address), Some(controller)) => controller.read(address, now),
            _ => 0,
        }
    }

    /// Writes a register.
    pub fn write(&mut self, axis: u8, address: u8, value: u32, now: Instant) {
        self.follow(axis, now);
        if address == DRIVER {
            if let Some(axis) = self.axes.get_mut(usize::from(axis)) {
                axis.driver.write(value, now);
            }
        } else if let Some(address) = self.place(axis, address)
            && let Some(controller) = self.controller(axis)
        {
            controller.write(address, value, now);
        }
        self.follow(axis, now);
    }

    /// When an axis of the controller of this one next arrives, stops or reaches a constant speed; none if
    /// nothing of that kind is to come.
    pub fn next_event(&mut self, axis: u8, now: Instant) -> Option<Instant> {
        self.controller(axis)?.next_event(now)
    }

    /// Holds a switch actuated or not actuated, or lets go of it.
    pub fn hold_switch(&mut self, axis: u8, switch: SwitchInput, held: Option<bool>, now: Instant) {
        if let Some(stepper) = self.axes.get_mut(usize::from(axis)) {
            stepper.held[match switch {
                SwitchInput::Left => 0,
                SwitchInput::Right => 1,
                SwitchInput::Home => 2,
            }] = held;
        }
        self.tell_switches(axis, now);
    }

    /// Whether the home switch of an axis is closed.
    pub fn home_switch(&self, axis: u8) -> bool {
        self.levels(axis)[2]
    }

    /// What an axis really does; none if there is no such axis.
    pub fn view(&mut self, axis: u8, now: Instant) -> Option<View> {
        self.follow(axis, now);
        let switches = self.levels(axis);
        let speed = self.speed(axis, now)?;
        let stepper = self.axes.get(usize::from(axis))?;
        let coils = stepper.driver.coils(now);
        Some(View {
            rotor: stepper.rotor,
            stage: stepper.rotor,
            speed,
            load_angle: 0.0,
            load: 0.0,
            stallguard: 0,
            current: match coils {
                Coils::Driven { scale, global } => {
                    self.full_scale * f64::from(scale) / 32.0 * f64::from(global) / LOW_SCALE
                }
                Coils::Off | Coils::Shorted => 0.0,
            },
            lost_steps: 0,
            state: Rotor::Following,
            switches,
        })
    }

    fn controller(&mut self, axis: u8) -> Option<&mut Tmc429> {
        self.controllers.get_mut(usize::from(axis) / GROUP)
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

    fn levels(&self, axis: u8) -> [bool; 3] {
        let held = self.axes.get(usize::from(axis)).map_or([None; 3], |axis| axis.held);
        held.map(|level| level == Some(true))
    }

    fn tell_switches(&mut self, axis: u8, now: Instant) {
        let [left, right, _] = self.levels(axis);
        let motor = usize::from(axis) % GROUP;
        if let Some(controller) = self.controller(axis) {
            controller.set_reference_inputs(motor, left, right, now);
        }
        self.follow(axis, now);
    }

    /// Fine steps per second.
    fn speed(&mut self, axis: u8, now: Instant) -> Option<f64> {
        let motor = usize::from(axis) % GROUP;
        let fine = f64::from(1u32 << self.resolution(axis));
        let controller = self.controller(axis)?;
        let pulses = f64::from(controller.velocity(motor, now)) * UNIT;
        Some(pulses / f64::from(1u32 << pulse_divisor(controller, motor, now)) * fine)
    }

    /// Binary logarithm of the fine steps in a microstep.
    fn resolution(&self, axis: u8) -> u32 {
        self.axes.get(usize::from(axis)).map_or(0, |axis| axis.driver.resolution())
    }

    /// Lets driver and rotor follow what the controller has done until `now`.
    fn follow(&mut self, axis: u8, now: Instant) {
        let motor = usize::from(axis) % GROUP;
        let fine = f64::from(1u32 << self.resolution(axis));
        let Some(controller) = self.controllers.get_mut(usize::from(axis) / GROUP) else { return };
        let pulses = controller.travel(motor, now);
        let is_reversed = controller.read(IF_CONFIGURATION, now) & INVERT_DIRECTION != 0;
        let speed = u64::from(controller.velocity(motor, now).unsigned_abs());
        let rate = speed << (RATE_SHIFT - pulse_divisor(controller, motor, now));
        let since = controller.stopped_at(motor, now).unwrap_or(Instant::from_ticks(0));
        let Some(stepper) = self.axes.get_mut(usize::from(axis)) else { return };
        let new = pulses - core::mem::replace(&mut stepper.pulses, pulses);
        let new = if is_reversed { -new } else { new };
        stepper.driver.step(new as i32);
        stepper.rotor += new as f64 * fine;
        let motion = match NonZeroU64::new(rate) {
            Some(rate) => Motion::Moving { rate },
            None => Motion::Standing { since },
        };
        stepper.driver.set_motion(motion, now);
    }
}

fn pulse_divisor(controller: &mut Tmc429, motor: usize, now: Instant) -> u32 {
    controller.read(of_axis(motor as u8, DIVISORS), now) >> 12 & 0xF
}
