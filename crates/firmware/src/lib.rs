//! A TMCL module as a pure state machine.
//!
//! [`Module`] owns no thread, no clock and no port. The world hands it requests and the time, it
//! hands back replies and the time at which it next wants to be called; below it is a [`Board`]:
//! registers, pins, a flash. The same code runs in virtual time, in real time and on a
//! microcontroller, and a run is a function of its inputs: calling [`Module::poll`] more often than
//! needed changes nothing.
//!
//! The rooms, from the line to the chip:
//!
//! - `line`: addresses, the pause before a reply, replies on their way.
//! - `direct`: a request becomes an answer; `terminal`: ASCII mode, in which requests are lines of text.
//! - `commands`: what each family of commands does.
//! - `cpu`, `program`, `interpreter`, `arithmetic`, `interrupts`: a program running on the module.
//! - `watch`: what a program does, seen from outside.
//! - `search`: the reference search; `guard`: stops by stall and by deviation of the encoder.
//! - `drive`: what every set of chips can do; `tmc5160`, `tmc429`: their drivers, by registers only; `tend`:
//!   what the firmware does for drivers that do not do it themselves; `units`: units of the TMC5160.
//! - `servo`: the regulators of a servo axis.
//! - `power_up`: what happens when the supply comes.
//! - `globals`, `axis`: settings in memory; `storage`: settings in the EEPROM.
//!
//! No parameter is described here: numbers, ranges, defaults and access rights come from
//! `opentmcl-catalog`, whose effects the rooms match exhaustively.
#![no_std]
#![forbid(unsafe_code)]
// The core cannot panic: whatever comes from outside has an answer.
#![cfg_attr(
    not(test),
    warn(clippy::unwrap_used, clippy::expect_used, clippy::panic, clippy::unreachable)
)]

#[cfg(test)]
extern crate std;

mod arithmetic;
mod axis;
pub mod board;
mod commands;
mod cpu;
mod direct;
mod drive;
mod events;
mod field;
mod globals;
mod guard;
mod interpreter;
mod interrupts;
mod line;
mod module;
mod power_up;
mod program;
mod search;
mod servo;
pub mod storage;
mod tend;
mod terminal;
mod tmc429;
mod tmc5160;
mod units;
mod watch;

pub use board::{Analog, Board, Power, Senses};
pub use cpu::{ErrorFlags, Flags, Mode};
pub use direct::Answer;
pub use line::{Line, Port};
pub use module::{Config, Module};
pub use watch::{Executed, ProgramState, ServoState};
