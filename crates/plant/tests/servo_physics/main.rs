//! The machine behind a servo module does what physics says.

mod bench;
mod currents;
mod energy;
mod motion;
mod random;
mod still;
mod supply;
