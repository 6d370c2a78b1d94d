//! What somebody does to a module from outside: actions, their text and what they do.

mod action;
mod apply;
mod check;
mod hands;
mod parse;
mod schedule;

pub use action::{Action, AnalogLevel, Place, Push};
pub use apply::Effect;
pub use parse::ActionError;
pub use schedule::{Shape, Wave};

pub(crate) use apply::World;
pub(crate) use hands::Hands;
pub(crate) use parse::{FAULTS_FORM, FORMS};
pub(crate) use schedule::between;
