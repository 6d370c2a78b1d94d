//! Random machines behind the axes of both kinds of chips.

mod described;
mod field;
mod machines;
mod steppers;
