//! The hardware that is not there: motion and driver chips at register level.
//!
//! A firmware talks to these chips as it talks to silicon: it writes and reads registers, and nothing
//! else. What a register means lives here; what a TMCL parameter means lives in the firmware.
//!
//! The chips own no clock. Every access carries the time, and between two accesses nothing runs:
//! what has happened in the meantime follows in closed form from the last change. [`tmc5160::Tmc5160`]
//! moves its axis with a ramp of `opentmcl-motion`, so reading a position after an hour of cruising
//! costs as much as reading it after a microsecond. `next_event` tells when a status flag will change
//! next, which is how far virtual time may jump. [`tmc429::Tmc429`] does the same for three axes with the
//! ramps of an older kind; [`tmc26x::Tmc26x`] has no ramp: whoever generates its step pulses tells it of
//! them. [`steppers::Steppers`] are both together.
//!
//! [`servo::Servo`] is the machine behind a servo module, whose firmware is the regulator itself: it goes on in steps
//! of a control period.
//!
//! A chip is a function of its accesses and their times. Registers follow from
//! integers alone. Where a motor needs real numbers, as for the field that turns it, they come from sums
//! and products. So the same accesses give the same answers on every platform.
#![forbid(unsafe_code)]

mod access;
pub mod axis;
mod coolstep;
pub mod driver;
pub mod field;
pub mod machine;
pub mod servo;
pub mod steppers;
pub mod tmc26x;
pub mod tmc429;
pub mod tmc5160;
