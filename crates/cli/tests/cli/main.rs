//! The program `tmcl` as its users see it.
#![expect(clippy::unwrap_used, reason = "the panic of a test is its report")]

mod common;
mod exec;
mod modules;
mod serve;
mod sim;
mod usage;
