//! TMCL as it travels: commands, replies, status codes, the 9-byte serial frame and the text forms.
//!
//! The layers, bottom up:
//!
//! - [`command`]: a [`Command`] is what every TMCL request carries whatever the line: command
//!   number, type, motor or bank, value. A [`Reply`] is what comes back.
//! - [`opcode`]: the numbers and mnemonics of the language, and which operand of the mnemonic form
//!   goes into which field; [`control`]: the numbers of the commands that only hosts use;
//!   [`limits`]: how much a program has of everything.
//! - [`serial`]: the 9-byte frame of USB, RS485, RS232 and TCP, and a [`serial::Decoder`] that takes
//!   any bytes and finds back into step.
//! - [`mnemonic`]: one command as text, `ROR 0, 51200`, read and written.
//! - [`ascii`]: the other form of a serial line, for people at a terminal: `AMVP ABS, 1, 50000`
//!   answered by `BA 100 50000`.
//! - [`Outgoing`]: what a module sends in one form or the other.
//!
//! Nothing here performs I/O, allocates or reads a clock: bytes and times are arguments.
#![no_std]
#![forbid(unsafe_code)]
// The core cannot panic: whatever comes from outside has an answer.
#![cfg_attr(
    not(test),
    warn(clippy::unwrap_used, clippy::expect_used, clippy::panic, clippy::unreachable)
)]

#[cfg(test)]
extern crate std;

pub mod ascii;
pub mod command;
pub mod control;
pub mod limits;
pub mod mnemonic;
pub mod opcode;
mod outgoing;
pub mod serial;

pub use command::{Command, Reply, Status};
pub use opcode::Opcode;
pub use outgoing::Outgoing;

/// Periods of the 16 MHz clock from which the motion chips of all modules run.
///
/// Time is counted in these so that chip arithmetic (speeds in microsteps per 2^24 clocks) is exact.
pub const TICKS_PER_SECOND: u64 = 16_000_000;

/// A point in time since power-up, in periods of the 16 MHz clock.
pub type Instant = fugit::MonotonicInstant<u64, 1, TICKS_PER_SECOND>;

/// A span of time, in periods of the 16 MHz clock.
pub type Duration = fugit::Duration<u64, 1, TICKS_PER_SECOND>;
