//! A motor and its machine behind a chip, against what can be worked out by hand.

mod bench;
mod motion;
mod stallguard;
mod switches;
