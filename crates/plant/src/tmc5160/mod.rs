//! The TMC5160: ramp generator and stepper driver in one chip.
//!
//! What moves is in [`opentmcl_motion::ramp`]; the registers are in [`registers`]. Here the two meet:
//! a write to a ramp register plans the motion anew at the time of the write, and a read of a status
//! register evaluates it.
//!
//! # What is modelled
//!
//! - The ramp generator with all its registers, RAMP_STAT with its events, TSTEP, MSCNT, MSCURACT, and
//!   the field that it turns, which GCONF.shaft reverses.
//! - The stop switches and what latches at their edges, the stop by StallGuard2.
//! - The thresholds of the speed: StealthChop, CoolStep, full steps, DcStep.
//! - The motor current: the standstill flag, the delayed and stepwise power-down, CoolStep,
//!   freewheeling, and what switches the driver off.
//! - The encoder, and what the driver measures of a motor.
//!
//! The motor is not here: whoever has one asks for the [`Field`] and the [`Coils`], and tells what the
//! driver would measure ([`Sense`]), when the encoder counts and when a switch closes. Without that the
//! motor follows every step, and nothing is measured.
//!
//! # Readings
//!
//! - The event "position reached" (RAMP_STAT bit 7) is set when a ramp comes to rest on its target, and
//!   when a write makes target and position equal at rest; not when an axis runs through its target.
//!   The flag (bit 9) is the plain comparison of XTARGET and XACTUAL at the moment of reading.
//! - An axis that creeps with less than one step in 2^20 clocks does not count as standing.
//! - Changes of V1, D1 and DMAX take effect at once, also for a second acceleration.
//! - VACTUAL reads as 24 bits: the reader extends the sign.

mod coils;
mod cool;
mod current;
mod encoder;
mod field;
mod insight;
mod load;
mod microstep;
pub mod registers;
mod rigged;
mod stops;
mod thresholds;

pub use crate::driver::{Coils, Sense};
pub use crate::field::Field;

use opentmcl_motion::ramp::{Limits, Mode, Phase, Ramp};
use opentmcl_motion::{Duration, Instant};

use crate::coolstep::Cool;
use encoder::Counter;
use field::Origin;
use registers::{Access, RAMP_STAT_EVENTS, Register, register};
use thresholds::Watch;

const EVENT_STOP_SG: u32 = 1 << 6;
const EVENT_POS_REACHED: u32 = 1 << 7;
const VELOCITY_REACHED: u32 = 1 << 8;
const POSITION_REACHED: u32 = 1 << 9;
const VZERO: u32 = 1 << 10;
const T_ZEROWAIT_ACTIVE: u32 = 1 << 11;
const SECOND_MOVE: u32 = 1 << 12;
const STATUS_SG: u32 = 1 << 13;

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
    origin: Origin,
    left_input: bool,
    right_input: bool,
    encoder: Counter,
    watch: Watch,
    cool: Cool,
    /// What the load allows in DcStep.
    speed_limit: Option<u32>,
    /// Pin DRV_ENN.
    enabled: bool,
    /// What the driver measures; none as long as it is not known to have a motor.
    sense: Option<Sense>,
    /// Shorts that have switched the driver off.
    shorts: u32,
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
            origin: Origin::default(),
            left_input: false,
            right_input: false,
            encoder: Counter::default(),
            watch: Watch::at_rest(Instant::from_ticks(0)),
            cool: Cool::default(),
            speed_limit: None,
            enabled: true,
            sense: None,
            shorts: 0,
        }
    }

    /// Switches the chip off and on: all registers take their reset values, the axis stands at
    /// position 0. The field goes to the nearest place where MSCNT is 0. What comes from outside stays:
    /// the levels of the pins, the encoder, the motor.
    pub fn reset(&mut self, now: Instant) {
        let fresh = Self::new();
        *self = Self {
            powered_at: now,
            origin: self.nearest_period(now),
            left_input: self.left_input,
            right_input: self.right_input,
            encoder: Counter::at(self.encoder.count),
            watch: Watch::at_rest(now),
            speed_limit: self.speed_limit,
            enabled: self.enabled,
            sense: self.sense,
            ..fresh
        };
    }

    /// Reads a register. A register that can only be written, or does not exist, reads as 0.
    pub fn read(&mut self, address: u8, now: Instant) -> u32 {
        let Some(register) = register(address) else { return 0 };
        if register.access == Access::WriteOnly {
            return 0;
        }
        self.settle(now);
        self.value(register, now)
    }

    /// Writes a register: the bits that exist, and only if it takes writes.
    pub fn write(&mut self, address: u8, value: u32, now: Instant) {
        let Some(register) = register(address) else { return };
        self.settle(now);
        let value = value & register.mask();
        match register.access {
            Access::ReadOnly => {}
            Access::WriteOneToClear(clearable) => self.clear(address, value & clearable, now),
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

    fn clear(&mut self, address: u8, bits: u32, now: Instant) {
        if address == registers::RAMP_STAT {
            self.clear_events(bits, now);
        } else {
            self.store(address, self.stored(address) & !bits);
        }
    }

    fn set(&mut self, address: u8, value: u32, now: Instant) {
        if self.plans_with(address, value) {
            return;
        }
        self.mark(now);
        let at_target = self.is_at_target(now);
        let place = self.place(now);
        match address {
            registers::X_ENC | registers::ENCMODE | registers::ENC_CONST => {
                return self.set_encoder(address, value);
            }
            _ => self.store(address, value),
        }
        match address {
            registers::TPWMTHRS | registers::TCOOLTHRS | registers::THIGH => {
                return self.compare_anew(address, now);
            }
            registers::XACTUAL => self.ramp.set_position(now, value.cast_signed()),
            registers::RAMPMODE..=registers::XTARGET => self.ramp.plan(now, &self.limits()),
            registers::GCONF => return self.keep_field(place, now),
            registers::CHOPCONF => {
                self.keep_field(place, now);
                self.notice_faults();
                return self.plan_anew(now);
            }
            registers::SW_MODE | registers::VDCMIN => return self.plan_anew(now),
            _ => return,
        }
        self.keep_field(place, now);
        self.expect_events(at_target, now);
    }

    /// Whether this value stands in a register of the ramp already, so that the plan is the one for it.
    pub(crate) fn plans_with(&self, address: u8, value: u32) -> bool {
        let is_limit = (registers::VSTART..=registers::XTARGET).contains(&address);
        (is_limit || address == registers::RAMPMODE) && self.stored(address) == value
    }

    /// Plans the motion anew, if what it follows from has changed.
    fn plan_anew(&mut self, now: Instant) {
        let limits = self.limits();
        if limits == *self.ramp.limits() {
            return;
        }
        self.mark(now);
        let place = self.place(now);
        let at_target = self.is_at_target(now);
        self.ramp.plan(now, &limits);
        self.keep_field(place, now);
        self.expect_events(at_target, now);
    }

    /// Takes the events of a new plan, made with the axis on its target or not.
    fn expect_events(&mut self, at_target: bool, now: Instant) {
        let arrived_before = at_target && self.ramp.arrival() == Some(now);
        self.arrival = self.ramp.arrival().filter(|_| !arrived_before);
        self.second_move = self.ramp.second_move();
        self.settle(now);
    }

    /// Notes what has happened up to now. Must precede every change of the plan.
    fn settle(&mut self, now: Instant) {
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
            vmax: self.speed_ceiling(self.stored(registers::VMAX)),
            dmax: self.stored(registers::DMAX),
            d1: self.stored(registers::D1),
            vstop: self.stored(registers::VSTOP),
            zero_wait: Duration::from_ticks(
                u64::from(self.stored(registers::TZEROWAIT)) * ZERO_WAIT_UNIT,
            ),
            barred: self.barred(),
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
            registers::VACTUAL => self.nominal_velocity(now).cast_unsigned(),
            registers::RAMP_STAT => self.ramp_stat(now),
            registers::MSCNT => self.mscnt(now),
            registers::MSCURACT => self.table().currents(self.mscnt(now)),
            registers::X_ENC => self.encoder_position().cast_unsigned(),
            registers::PWM_SCALE => self.pwm_scale(now),
            registers::DRV_STATUS => self.drv_status(now),
            address => self.stored(address),
        };
        value & register.mask()
    }

    fn is_at_target(&self, now: Instant) -> bool {
        self.ramp.position(now) == self.stored(registers::XTARGET).cast_signed()
    }

    fn ramp_stat(&self, now: Instant) -> u32 {
        let bit = |on: bool, mask: u32| if on { mask } else { 0 };
        self.switch_status()
            | self.events & RAMP_STAT_EVENTS
            | bit(self.ramp.velocity_reached(now), VELOCITY_REACHED)
            | bit(self.is_at_target(now), POSITION_REACHED)
            | bit(self.ramp.velocity(now) == 0, VZERO)
            | bit(self.ramp.zero_wait_active(now), T_ZEROWAIT_ACTIVE)
            | bit(self.stall_status(now), STATUS_SG)
    }

    /// Binary logarithm of the 1/256 steps in one microstep.
    fn microstep_shift(&self) -> u32 {
        (self.stored(registers::CHOPCONF) >> 24 & 0xF).min(8)
    }

    fn tstep(&self, now: Instant) -> u32 {
        self.tstep_at(self.ramp.velocity(now))
    }

    fn tstep_at(&self, velocity: i32) -> u32 {
        let speed = u64::from(velocity.unsigned_abs()) << self.microstep_shift();
        match (1u64 << 24).checked_div(speed) {
            Some(clocks) => u32::try_from(clocks).unwrap_or(TSTEP_MAX).min(TSTEP_MAX),
            None => TSTEP_MAX,
        }
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
}
