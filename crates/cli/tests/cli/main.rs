//! The program `tmcl` as its users see it.
#![expect(clippy::unwrap_used, reason = "the panic of a test is its report")]

mod asm;
mod check;
mod common;
mod control;
mod coolstep;
mod disasm;
mod download;
mod exec;
mod faults;
mod files;
mod fmt;
mod lab;
mod modules;
mod scenario;
mod serve;
mod sim;
mod test_coverage;
mod test_programs;
mod tune;
mod usage;
mod workflow;
mod world;
