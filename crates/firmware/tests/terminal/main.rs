//! The ASCII interface of a module.

mod bench;
#[path = "../stage/flash.rs"]
mod flash;
mod lines;
mod modes;
mod ports;
