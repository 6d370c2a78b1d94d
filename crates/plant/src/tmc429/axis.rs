//! One of the three axes: its registers around its ramp generator.

use opentmcl_motion::Instant;
use opentmcl_motion::ticked::{Barred, BrakingFactor, Mode, PLACE_SHIFT, Ramp, Settings};

use super::registers::{
    A_ACTUAL, A_MAX, AXIS_REGISTERS, DISABLE_STOP_LEFT, DISABLE_STOP_RIGHT, DIVISORS,
    DX_REF_TOLERANCE, FLAG_LEFT_CLOSED, FLAG_LEFT_OPENED, FLAG_REFERENCE_WRONG, FLAG_RIGHT_CLOSED,
    FLAG_RIGHT_OPENED, FLAG_STOPPED, FLAG_TARGET_REACHED, INTERRUPT, LATCH_WAITS, PMUL_FIXED,
    PMUL_PDIV, REF_CONF_RAMP_MODE, REFERENCE_IS_RIGHT, SOFT_STOP, USTEP_COUNT, V_ACTUAL, V_MAX,
    V_MIN, V_TARGET, X_ACTUAL, X_LATCHED, X_TARGET,
};

/// Bits of a velocity register.
const VELOCITY_BITS: u32 = 12;

/// Bits of a position register.
const POSITION_BITS: u32 = 24;

/// The next event, as far as it was looked for.
#[derive(Clone, Copy, Debug)]
enum Foreseen {
    Unknown,
    At(Option<Instant>),
}

/// Registers and ramp of an axis, and the levels of its switches.
#[derive(Clone, Debug)]
pub(super) struct Axis {
    /// What was written last, by index; computed registers are not kept here.
    stored: [u32; 16],
    ramp: Ramp,
    /// Microsteps made before the last reset.
    travel_before: i64,
    left: bool,
    right: bool,
    foreseen: Foreseen,
}

fn signed(value: u32, bits: u32) -> i32 {
    (value << (32 - bits)).cast_signed() >> (32 - bits)
}

impl Axis {
    pub(super) fn new() -> Self {
        let mut stored = [0; 16];
        for (cell, register) in stored.iter_mut().zip(&AXIS_REGISTERS) {
            *cell = register.reset;
        }
        Self {
            stored,
            ramp: Ramp::new(),
            travel_before: 0,
            left: false,
            right: false,
            foreseen: Foreseen::Unknown,
        }
    }

    pub(super) fn reset(&mut self, now: Instant) {
        let mut fresh = Self { travel_before: self.travel(now), ..Self::new() };
        fresh.ramp.advance(now);
        *self = fresh;
    }

    /// The ramp at this time.
    pub(super) fn ramp(&mut self, now: Instant) -> &Ramp {
        self.ramp.advance(now);
        self.settle();
        &self.ramp
    }

    pub(super) fn travel(&mut self, now: Instant) -> i64 {
        self.travel_before.wrapping_add(self.ramp(now).travel())
    }

    /// The place at the last reset.
    pub(super) fn before(&self) -> i128 {
        i128::from(self.travel_before) << PLACE_SHIFT
    }

    pub(super) fn next_event(&mut self, now: Instant) -> Option<Instant> {
        match self.foreseen {
            Foreseen::At(None) => None,
            Foreseen::At(Some(at)) if at > now => Some(at),
            _ => {
                let event = self.ramp(now).next_event(now);
                self.foreseen = Foreseen::At(event);
                event
            }
        }
    }

    pub(super) fn read(&mut self, index: u8, now: Instant) -> u32 {
        self.ramp(now);
        match index {
            X_ACTUAL => self.ramp.position().cast_unsigned(),
            V_TARGET if self.is_position_mode() => self.ramp.target_velocity().cast_unsigned(),
            V_ACTUAL => self.ramp.velocity().cast_unsigned(),
            A_ACTUAL => self.ramp.acceleration().cast_unsigned(),
            USTEP_COUNT => self.microstep(),
            _ => self.stored(index),
        }
    }

    /// Writes a register; the bits that do not exist are 0.
    pub(super) fn write(&mut self, index: u8, value: u32, now: Instant) {
        let was_at_target = self.ramp(now).at_target();
        match index {
            X_ACTUAL => self.ramp.set_position(now, signed(value, POSITION_BITS)),
            V_ACTUAL => {
                if self.mode() == Mode::Hold {
                    self.store(V_TARGET, value);
                    self.apply(now);
                }
                self.ramp.set_velocity(now, signed(value, VELOCITY_BITS));
            }
            USTEP_COUNT => {
                let difference = value.wrapping_sub(self.microstep());
                self.store(index, self.stored(index).wrapping_add(difference));
            }
            DIVISORS => {
                let before = self.microstep();
                self.store(index, value);
                let difference = before.wrapping_sub(self.microstep());
                self.store(USTEP_COUNT, self.stored(USTEP_COUNT).wrapping_add(difference));
                self.apply(now);
            }
            INTERRUPT => {
                let flags = self.stored(index) & !value & 0xFF;
                self.store(index, value & !0xFF | flags);
            }
            REF_CONF_RAMP_MODE => self.configure(value, now),
            PMUL_PDIV => {
                self.store(index, value | PMUL_FIXED);
                self.apply(now);
            }
            _ => {
                self.store(index, value);
                self.apply(now);
            }
        }
        if !was_at_target && self.ramp.at_target() && self.ramp.at_rest() && self.is_position_mode()
        {
            self.raise(FLAG_TARGET_REACHED);
        }
        self.settle();
        self.foreseen = Foreseen::Unknown;
    }

    /// Arms the latch: it takes the position when the reference switch next closes.
    pub(super) fn arm_latch(&mut self) {
        self.store(REF_CONF_RAMP_MODE, self.stored(REF_CONF_RAMP_MODE) | LATCH_WAITS);
    }

    /// Takes the levels of the switches, after their polarity.
    pub(super) fn set_switches(&mut self, left: bool, right: bool, now: Instant) {
        if (left, right) == (self.left, self.right) {
            return;
        }
        let position = self.ramp(now).position();
        let edge = |was: bool, is: bool, opened: u32, closed: u32| match (was, is) {
            (true, false) => opened,
            (false, true) => closed,
            _ => 0,
        };
        let configuration = self.stored(REF_CONF_RAMP_MODE);
        let reference_closed = if configuration & REFERENCE_IS_RIGHT != 0 {
            right && !self.right
        } else {
            left && !self.left
        };
        self.raise(
            edge(self.left, left, FLAG_LEFT_OPENED, FLAG_LEFT_CLOSED)
                | edge(self.right, right, FLAG_RIGHT_OPENED, FLAG_RIGHT_CLOSED),
        );
        if reference_closed {
            if position.unsigned_abs() > self.stored(DX_REF_TOLERANCE) {
                self.raise(FLAG_REFERENCE_WRONG);
            }
            if configuration & LATCH_WAITS != 0 {
                self.store(REF_CONF_RAMP_MODE, configuration & !LATCH_WAITS);
                self.store(X_LATCHED, position.cast_unsigned() & 0xFF_FFFF);
            }
        }
        (self.left, self.right) = (left, right);
        self.apply(now);
        self.settle();
        self.foreseen = Foreseen::Unknown;
    }

    /// Levels of the switches after their polarity: left, right.
    pub(super) fn switches(&self) -> (bool, bool) {
        (self.left, self.right)
    }

    /// Whether a flag is set whose interrupt is enabled.
    pub(super) fn interrupts(&mut self, now: Instant) -> bool {
        self.ramp(now);
        let word = self.stored(INTERRUPT);
        word & word >> 8 & 0xFF != 0
    }

    /// Writes switches and mode. A mode that does not calculate its velocity starts with the one that the
    /// mode before had in view, or keeps the one that the axis has if it has no ramp.
    fn configure(&mut self, value: u32, now: Instant) {
        let before = self.mode();
        let latch = self.stored(REF_CONF_RAMP_MODE) & LATCH_WAITS;
        let aim = self.ramp.target_velocity();
        self.store(REF_CONF_RAMP_MODE, value & !LATCH_WAITS | latch);
        match (before, self.mode()) {
            (before, after) if before == after => {}
            (_, Mode::Hold) => self.store(V_TARGET, self.ramp.velocity().cast_unsigned() & 0xFFF),
            (Mode::Ramp | Mode::Soft, Mode::Velocity) => {
                self.store(V_TARGET, aim.cast_unsigned() & 0xFFF);
            }
            _ => {}
        }
        self.apply(now);
    }

    fn mode(&self) -> Mode {
        match self.stored(REF_CONF_RAMP_MODE) & 0b11 {
            0 => Mode::Ramp,
            1 => Mode::Soft,
            2 => Mode::Velocity,
            _ => Mode::Hold,
        }
    }

    fn is_position_mode(&self) -> bool {
        matches!(self.mode(), Mode::Ramp | Mode::Soft)
    }

    /// Gives the registers to the ramp.
    fn apply(&mut self, now: Instant) {
        let configuration = self.stored(REF_CONF_RAMP_MODE);
        let factor = self.stored(PMUL_PDIV);
        let divisors = self.stored(DIVISORS);
        let settings = Settings {
            mode: self.mode(),
            target: signed(self.stored(X_TARGET), POSITION_BITS),
            v_min: self.stored(V_MIN),
            v_max: self.stored(V_MAX),
            v_target: signed(self.stored(V_TARGET), VELOCITY_BITS),
            a_max: self.stored(A_MAX),
            factor: BrakingFactor { pmul: (factor >> 8) as u8, pdiv: (factor & 0xF) as u8 },
            pulse_div: divisors >> 12 & 0xF,
            ramp_div: divisors >> 8 & 0xF,
            barred: Barred {
                negative: self.left && configuration & DISABLE_STOP_LEFT == 0,
                positive: self.right && configuration & DISABLE_STOP_RIGHT == 0,
                soft: configuration & SOFT_STOP != 0,
            },
        };
        self.ramp.set(now, &settings);
    }

    /// Turns what has happened to the ramp into flags.
    fn settle(&mut self) {
        let events = self.ramp.take_events();
        if events.arrived {
            self.raise(FLAG_TARGET_REACHED);
        }
        if events.stopped {
            self.raise(FLAG_STOPPED);
        }
    }

    fn raise(&mut self, flags: u32) {
        self.store(INTERRUPT, self.stored(INTERRUPT) | flags);
    }

    /// The place in the electrical period: a microstep is 1/64 of a full step, or more of them with a lower
    /// resolution.
    fn microstep(&self) -> u32 {
        let resolution = (self.stored(DIVISORS) & 0b111).min(6);
        let units = (self.ramp.travel() as u32).wrapping_shl(6 - resolution);
        self.stored(USTEP_COUNT).wrapping_add(units) & 0xFF
    }

    fn stored(&self, index: u8) -> u32 {
        self.stored.get(usize::from(index)).copied().unwrap_or(0)
    }

    fn store(&mut self, index: u8, value: u32) {
        if let Some(cell) = self.stored.get_mut(usize::from(index)) {
            *cell = value;
        }
    }
}
