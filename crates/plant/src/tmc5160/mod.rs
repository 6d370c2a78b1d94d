//! The TMC5160: ramp generator and stepper driver in one chip.
//!
//! What moves is in [`opentmcl_motion::ramp`]; the registers are in [`registers`]. Here the two meet:
//! a write to a ramp register plans the motion anew at the time of the write, and a read of a status
//! register evaluates it.
//!
//! # What is modelled
//!
//! - The ramp generator with all its registers, RAMP_STAT with its events, TSTEP, MSCNT, MSCURACT.
//! - The standstill flag, the delayed and stepwise power-down of the motor current, the StealthChop
//!   and full step flags of DRV_STATUS.
//! - The reference inputs as bits of IOIN and RAMP_STAT. They do not stop or latch anything.
//!
//! Registers of the load measurement, the encoder and the stop functions exist and hold what is
//! written, without an effect. GCONF.shaft turns the motor the other way and not the counters, so
//! nothing of it can be seen in a register.
//!
//! # Readings
//!
//! - The event "position reached" (RAMP_STAT bit 7) is set when a ramp comes to rest on its target, and
//!   when a write makes target and position equal at rest; not when an axis runs through its target.
//!   The flag (bit 9) is the plain comparison of XTARGET and XACTUAL at the moment of reading.
//! - An axis that creeps with less than one step in 2^20 clocks does not count as standing.
//! - Changes of V1, D1 and DMAX take effect at once, also for a second acceleration.
//! - VACTUAL reads as 24 bits: the reader extends the sign.

mod current;
mod microstep;
pub mod registers;
mod sense;

pub use sense::{Coils, Sense};

use opentmcl_motion::ramp::{Limits, Mode, Phase, Ramp};
use opentmcl_motion::{Duration, Instant};

use current::Currents;
use registers::{Access, RAMP_STAT_EVENTS, Register, register};

const EVENT_POS_REACHED: u32 = 1 << 7;
const VELOCITY_REACHED: u32 = 1 << 8;
const POSITION_REACHED: u32 = 1 << 9;
const VZERO: u32 = 1 << 10;
const T_ZEROWAIT_ACTIVE: u32 = 1 << 11;
const SECOND_MOVE: u32 = 1 << 12;

/// TSTEP of an axis that is too slow to measure.
const TSTEP_MAX: u32 = (1 << 20) - 1;

/// Unit of TZEROWAIT in clocks.
const ZERO_WAIT_UNIT: u64 = 512;

/// One TMC5160 with a motor that follows every step.
///
/// Times must not run backwards from one call to the next.
///
/// ```
/// use opentmcl_motion::Instant;
/// use opentmcl_plant::tmc5160::{Tmc5160, registers::*};
///
/// let mut chip = Tmc5160::new();
/// let now = Instant::from_ticks(0);
/// for (address, value) in [(AMAX, 439), (DMAX, 439), (VMAX, 53_687), (XTARGET, 512_000)] {
///     chip.write(address, value, now);
/// }
/// let mut time = now;
/// while let Some(next) = chip.next_event(time) {
///     time = next;
/// }
/// assert_eq!(chip.read(XACTUAL, time), 512_000);
/// ```
#[derive(Clone, Debug)]
pub struct Tmc5160 {
    /// What was written last, by address; computed registers are not kept here.
    stored: [u32; 128],
    ramp: Ramp,
    powered_at: Instant,
    /// Events of RAMP_STAT that have happened and not been cleared.
    events: u32,
    /// Events of the present plan that are to come.
    arrival: Option<Instant>,
    second_move: Option<Instant>,
    /// MSCNT at XACTUAL = 0: MSCNT counts on when XACTUAL is overwritten.
    microstep_origin: u32,
    left_input: bool,
    right_input: bool,
}

impl Default for Tmc5160 {
    fn default() -> Self {
        Self::new()
    }
}

impl Tmc5160 {
    /// A chip that is switched on at time 0.
    pub fn new() -> Self {
        let mut stored = [0; 128];
        for register in registers::REGISTERS {
            if let Some(cell) = stored.get_mut(usize::from(register.address)) {
                *cell = register.reset;
            }
        }
        Self {
            stored,
            ramp: Ramp::new(),
            powered_at: Instant::from_ticks(0),
            events: 0,
            arrival: None,
            second_move: None,
            microstep_origin: 0,
            left_input: false,
            right_input: false,
        }
    }

    /// Switches the chip off and on: all registers take their reset values, the axis stands at
    /// position 0. The levels of the input pins stay, they come from outside.
    pub fn reset(&mut self, now: Instant) {
        let (left_input, right_input) = (self.left_input, self.right_input);
        *self = Self { powered_at: now, left_input, right_input, ..Self::new() };
    }

    /// Levels of the reference inputs REFL and REFR.
    pub fn set_reference_inputs(&mut self, left: bool, right: bool, now: Instant) {
        self.collect_events(now);
        self.left_input = left;
        self.right_input = right;
    }

    /// Reads a register. A register that can only be written, or does not exist, reads as 0.
    pub fn read(&mut self, address: u8, now: Instant) -> u32 {
        let Some(register) = register(address) else { return 0 };
        if register.access == Access::WriteOnly {
            return 0;
        }
        self.collect_events(now);
        self.value(register, now)
    }

    /// Writes a register: the bits that exist, and only if it takes writes.
    pub fn write(&mut self, address: u8, value: u32, now: Instant) {
        let Some(register) = register(address) else { return };
        self.collect_events(now);
        let value = value & register.mask();
        match register.access {
            Access::ReadOnly => {}
            Access::WriteOneToClear(clearable) => self.clear(address, value & clearable),
            Access::WriteOnly | Access::ReadWrite => self.set(address, value, now),
        }
    }

    /// When the ramp next arrives or stops, reaches a constant speed, or ends the wait at zero;
    /// `None` if nothing of that kind is to come without a write.
    pub fn next_event(&self, now: Instant) -> Option<Instant> {
        self.ramp.next_event(now)
    }

    fn stored(&self, address: u8) -> u32 {
        self.stored.get(usize::from(address)).copied().unwrap_or(0)
    }

    fn store(&mut self, address: u8, value: u32) {
        if let Some(cell) = self.stored.get_mut(usize::from(address)) {
            *cell = value;
        }
    }

    fn clear(&mut self, address: u8, bits: u32) {
        if address == registers::RAMP_STAT {
            self.events &= !bits;
        } else {
            self.store(address, self.stored(address) & !bits);
        }
    }

    fn set(&mut self, address: u8, value: u32, now: Instant) {
        let is_limit = (registers::VSTART..=registers::XTARGET).contains(&address);
        if self.stored(address) == value && (is_limit || address == registers::RAMPMODE) {
            // The plan is already the one for this value.
            return;
        }
        let at_target = self.is_at_target(now);
        let mscnt = self.mscnt(now);
        self.store(address, value);
        match address {
            registers::XACTUAL => self.ramp.set_position(now, value.cast_signed()),
            registers::RAMPMODE..=registers::XTARGET => self.ramp.plan(now, &self.limits()),
            registers::CHOPCONF => return self.keep_mscnt(mscnt, now),
            _ => return,
        }
        self.keep_mscnt(mscnt, now);
        let arrived_before = at_target && self.ramp.arrival() == Some(now);
        self.arrival = self.ramp.arrival().filter(|_| !arrived_before);
        self.second_move = self.ramp.second_move();
        self.collect_events(now);
    }

    /// Notes what has happened up to now. Must precede every change of the plan.
    fn collect_events(&mut self, now: Instant) {
        if self.arrival.take_if(|time| *time <= now).is_some() {
            self.events |= EVENT_POS_REACHED;
        }
        if self.second_move.take_if(|time| *time <= now).is_some() {
            self.events |= SECOND_MOVE;
        }
    }

    fn limits(&self) -> Limits {
        Limits {
            mode: match self.stored(registers::RAMPMODE) {
                0 => Mode::Position,
                1 => Mode::VelocityPositive,
                2 => Mode::VelocityNegative,
                _ => Mode::Hold,
            },
            target: self.stored(registers::XTARGET).cast_signed(),
            vstart: self.stored(registers::VSTART),
            a1: self.stored(registers::A1),
            v1: self.stored(registers::V1),
            amax: self.stored(registers::AMAX),
            vmax: self.stored(registers::VMAX),
            dmax: self.stored(registers::DMAX),
            d1: self.stored(registers::D1),
            vstop: self.stored(registers::VSTOP),
            zero_wait: Duration::from_ticks(
                u64::from(self.stored(registers::TZEROWAIT)) * ZERO_WAIT_UNIT,
            ),
        }
    }

    fn value(&self, register: &Register, now: Instant) -> u32 {
        let value = match register.address {
            registers::IOIN => {
                let inputs = u32::from(self.left_input) | u32::from(self.right_input) << 1;
                registers::VERSION << 24 | inputs
            }
            registers::TSTEP => self.tstep(now),
            registers::XACTUAL => self.ramp.position(now).cast_unsigned(),
            registers::VACTUAL => self.ramp.velocity(now).cast_unsigned(),
            registers::RAMP_STAT => self.ramp_stat(now),
            registers::MSCNT => self.mscnt(now),
            registers::MSCURACT => self.table().currents(self.mscnt(now)),
            registers::DRV_STATUS => self.drv_status(now),
            address => self.stored(address),
        };
        value & register.mask()
    }

    fn is_at_target(&self, now: Instant) -> bool {
        self.ramp.position(now) == self.stored(registers::XTARGET).cast_signed()
    }

    fn ramp_stat(&self, now: Instant) -> u32 {
        let mode = self.stored(registers::SW_MODE);
        let swapped = mode >> 4 & 1 == 1;
        let (left, right) = if swapped {
            (self.right_input, self.left_input)
        } else {
            (self.left_input, self.right_input)
        };
        let bit = |on: bool, mask: u32| if on { mask } else { 0 };
        bit(left, 1) ^ (mode >> 2 & 1)
            | (bit(right, 2) ^ (mode >> 2 & 2))
            | self.events & RAMP_STAT_EVENTS
            | bit(self.ramp.velocity_reached(now), VELOCITY_REACHED)
            | bit(self.is_at_target(now), POSITION_REACHED)
            | bit(self.ramp.velocity(now) == 0, VZERO)
            | bit(self.ramp.zero_wait_active(now), T_ZEROWAIT_ACTIVE)
    }

    /// Binary logarithm of the 1/256 steps in one microstep.
    fn microstep_shift(&self) -> u32 {
        (self.stored(registers::CHOPCONF) >> 24 & 0xF).min(8)
    }

    fn tstep(&self, now: Instant) -> u32 {
        let speed = u64::from(self.ramp.velocity(now).unsigned_abs()) << self.microstep_shift();
        match (1u64 << 24).checked_div(speed) {
            Some(clocks) => u32::try_from(clocks).unwrap_or(TSTEP_MAX).min(TSTEP_MAX),
            None => TSTEP_MAX,
        }
    }

    fn mscnt(&self, now: Instant) -> u32 {
        let travelled = self.ramp.position(now).cast_unsigned() << self.microstep_shift();
        self.microstep_origin.wrapping_add(travelled) % microstep::PERIOD
    }

    /// The position in the microstep table belongs to the motor: it stays when a register changes.
    fn keep_mscnt(&mut self, mscnt: u32, now: Instant) {
        self.microstep_origin =
            self.microstep_origin.wrapping_add(mscnt).wrapping_sub(self.mscnt(now));
    }

    fn table(&self) -> microstep::Table {
        let mut differences = [0; 8];
        for (word, address) in differences.iter_mut().zip(registers::MSLUT..) {
            *word = self.stored(address);
        }
        microstep::Table {
            differences,
            select: self.stored(registers::MSLUTSEL),
            start: self.stored(registers::MSLUTSTART),
        }
    }

    /// How many clocks the axis has been standing; `None` while it moves.
    fn standing(&self, now: Instant) -> Option<u64> {
        match self.ramp.phase(now) {
            Phase::Standstill | Phase::Waiting => {
                let since = self.ramp.stopped_at(now).unwrap_or(self.powered_at);
                Some(now.as_ticks().saturating_sub(since.as_ticks()))
            }
            _ => None,
        }
    }

    fn drv_status(&self, now: Instant) -> u32 {
        let standing = self.standing(now);
        let currents =
            Currents::new(self.stored(registers::IHOLD_IRUN), self.stored(registers::TPOWERDOWN));
        let tstep = self.tstep(now);
        let stealth = self.stored(registers::GCONF) >> 2 & 1 == 1
            && tstep >= self.stored(registers::TPWMTHRS);
        let full_step = self.stored(registers::CHOPCONF) >> 18 & 1 == 1
            && tstep <= self.stored(registers::THIGH);
        u32::from(stealth) << 14
            | u32::from(full_step) << 15
            | currents.actual(standing) << 16
            | u32::from(current::stands(standing)) << 31
    }
}
