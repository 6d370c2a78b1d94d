//! Ramp generators: where an axis is and how fast, at any time, without a step in between.
//!
//! A [`ramp::Ramp`] is planned when its target or its limits change and evaluated as often as
//! anybody asks. A plan is a short list of segments of constant acceleration, so that evaluating it
//! costs a multiplication and virtual time may jump over an hour of cruising.
//!
//! A [`ticked::Ramp`] is the older kind, which decides anew with every tick and cannot be planned. It steps
//! through its ticks while it accelerates or brakes, and jumps over the rest.
//!
//! # Exactness
//!
//! The chips with planned ramps count in whole clocks and in register units: a speed of V means V microsteps in
//! 2^24 clocks, an acceleration of A raises V by A/2^17 per clock. With speed kept in units of
//! V/2^17 and position in units of 2^-42 microstep, a segment with start values `x0`, `v0` and
//! acceleration `a` has after `n` clocks
//!
//! ```text
//! v(n) = v0 + a n
//! x(n) = x0 + 2 v0 n + a n²
//! ```
//!
//! and these are integers. Nothing is rounded, so it does not matter how often, or when, a ramp is
//! evaluated or planned anew: the same inputs give the same positions on every platform.
//!
//! The crate knows nothing of TMCL, of registers or of chips. It performs no I/O, allocates nothing,
//! and time is an argument.
#![no_std]
#![forbid(unsafe_code)]
// The core cannot panic: whatever comes from outside has an answer.
#![cfg_attr(
    not(test),
    warn(clippy::unwrap_used, clippy::expect_used, clippy::panic, clippy::unreachable)
)]

#[cfg(test)]
extern crate std;

pub mod interpolation;
pub mod ramp;
pub mod servo;
pub mod ticked;

/// Periods of the clock from which the ramp generators run: 16 MHz.
pub const TICKS_PER_SECOND: u64 = 16_000_000;

/// A point in time since power-up, in periods of the 16 MHz clock.
pub type Instant = fugit::MonotonicInstant<u64, 1, TICKS_PER_SECOND>;

/// A span of time, in periods of the 16 MHz clock.
pub type Duration = fugit::Duration<u64, 1, TICKS_PER_SECOND>;
