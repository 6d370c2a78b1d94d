//! Programs get onto a module and back over a line that fails at any place.
#![expect(clippy::unwrap_used, reason = "the panic of a test is its report")]

mod control;
mod line;
mod noise;
mod transfer;
