//! The TMC26x: a stepper driver that turns step pulses into coil currents (TMC260, TMC261, TMC262, TMC2660).
//!
//! The registers are in [`registers`]. The chip has no ramp: pulses come from a motion controller, which
//! tells by [`Tmc26x::set_motion`] how fast they come and by [`Tmc26x::step`] how many.
//!
//! # What is modelled
//!
//! - The five registers, and the three forms of a reply.
//! - MSTEP, the standstill flag, StallGuard2 with its output SG_TST, CoolStep.
//! - What switches the bridges off: TOFF, the enable pin, shorts, overtemperature.
//! - SPI mode (SDOFF) as far as it makes the chip deaf to step pulses.
//!
//! The motor is not here: whoever has one asks for the [`Coils`] and tells what the driver would measure
//! ([`Sense`]). Without that nothing is measured. Times of the chopper, slopes and the delay of the detection
//! of shorts change nothing here.
//!
//! What a machine asks of the chip has the form that it has with a [`Tmc5160`](crate::tmc5160::Tmc5160), the
//! time included, even where nothing depends on it.
//!
//! # Readings
//!
//! - A reply shows the state before its datagram takes effect, in the form that RDSEL had before. The
//!   vendor's open driver reads it so.
//! - RDSEL = 3, which is reserved, answers as 2. Reserved bits of a reply are 0.
//! - In SPI mode DRVCTRL sets coil currents, which are not modelled: such a write changes nothing, and
//!   the resolution stays.

mod coils;
mod load;
mod motion;
pub mod registers;

pub use crate::driver::{Coils, Sense};
pub use coils::LOW_SENSE_VOLTAGE;
pub use motion::Motion;

use opentmcl_motion::Instant;

use crate::coolstep::Cool;
use registers::{
    Field, RDSEL, REPLY_SE_SHIFT, REPLY_SG_UPPER_SHIFT, REPLY_VALUE_SHIFT, Register, SDOFF, SG,
    STST,
};

/// One TMC26x.
///
/// Times must not run backwards from one call to the next.
///
/// ```
/// use opentmcl_motion::Instant;
/// use opentmcl_plant::tmc26x::{Coils, Tmc26x, registers::*};
///
/// let mut chip = Tmc26x::new();
/// let now = Instant::from_ticks(0);
/// chip.write(Register::SgcsConf.datagram(&[(CS, 15)]), now);
/// chip.write(Register::ChopConf.datagram(&[(TBL, 2), (HSTRT, 3), (HEND, 2), (TOFF, 5)]), now);
/// assert_eq!(chip.coils(now), Coils::Driven { scale: 16, global: 256 });
/// ```
#[derive(Clone, Debug)]
pub struct Tmc26x {
    /// What was written last, in the order of [`Register`].
    stored: [u32; 5],
    powered_at: Instant,
    motion: Motion,
    /// Place in the sine table, 0..1024.
    mstep: i64,
    cool: Cool,
    /// Pin ENN.
    enabled: bool,
    /// What the driver measures; none as long as it is not known to have a motor.
    sense: Option<Sense>,
    /// Shorts that have switched the driver off, as in [`Sense::flags`].
    shorts: u32,
}

impl Default for Tmc26x {
    fn default() -> Self {
        Self::new()
    }
}

impl Tmc26x {
    /// A chip that is switched on at time 0, before any step pulse.
    pub fn new() -> Self {
        let start = Instant::from_ticks(0);
        Self {
            stored: [0; 5],
            powered_at: start,
            motion: Motion::Standing { since: start },
            mstep: 0,
            cool: Cool::default(),
            enabled: true,
            sense: None,
            shorts: 0,
        }
    }

    /// Switches the chip off and on: all registers and MSTEP are 0. What comes from outside stays: the level
    /// of the enable pin, the step pulses, the motor.
    pub fn reset(&mut self, now: Instant) {
        *self = Self {
            powered_at: now,
            motion: self.motion,
            enabled: self.enabled,
            sense: self.sense,
            ..Self::new()
        };
    }

    /// Sends a datagram of 20 bits, higher ones are ignored, and gives back the reply, 20 bits.
    pub fn write(&mut self, datagram: u32, now: Instant) -> u32 {
        let reply = self.status(now);
        if let Some(register) = Register::addressed_by(datagram)
            && !self.sets_coil_currents(register)
        {
            self.stored[register as usize] = datagram & register.mask();
            self.settle();
        }
        reply
    }

    /// Whether a datagram would change more than what replies hold.
    pub(crate) fn changes_with(&self, datagram: u32) -> bool {
        Register::addressed_by(datagram).is_some_and(|register| {
            let without_form = |content| match register {
                Register::DrvConf => RDSEL.insert(content, 0),
                _ => content,
            };
            without_form(datagram & register.mask()) != without_form(self.register(register))
        })
    }

    /// The reply that a datagram would get now.
    pub fn status(&self, now: Instant) -> u32 {
        let result = self.result();
        let load = u32::from(result.unwrap_or(0));
        let value = match self.field(RDSEL) {
            0 => (self.mstep as u32) << REPLY_VALUE_SHIFT,
            1 => load << REPLY_VALUE_SHIFT,
            _ => load >> 5 << REPLY_SG_UPPER_SHIFT | self.actual_current() << REPLY_SE_SHIFT,
        };
        let bit = |on: bool, mask: u32| if on { mask } else { 0 };
        value | self.fault_flags() | bit(result == Some(0), SG) | bit(self.stands(now), STST)
    }

    /// What a register holds.
    fn register(&self, register: Register) -> u32 {
        self.stored[register as usize]
    }

    fn field(&self, field: Field) -> u32 {
        field.extract(self.register(field.register))
    }

    fn sets_coil_currents(&self, register: Register) -> bool {
        register == Register::DrvCtrl && self.field(SDOFF) == 1
    }

    /// Draws the conclusions from a change of anything.
    fn settle(&mut self) {
        self.notice_faults();
        if !self.regulates() {
            self.cool.release();
        }
    }
}
