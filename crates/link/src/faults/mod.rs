//! Faults of a line: frames that are lost, damaged, doubled or late, as often as somebody asks for.
//!
//! [`Faults`] says what a line does to the frames of each direction; its text is
//! `drop=0.001,corrupt=1/1000,delay=20ms@0.01,requests.drop=0.01,seed=7`. An `Injector` does it, one
//! for each direction of a port.
//!
//! What happens to a frame depends on the seed, the direction and the number of the frame alone, not
//! on the time and not on the other faults. The same conversation with the same seed therefore meets
//! the same faults, and one more fault changes nothing about those that were there before.
//!
//! Text of the ASCII interface is no frame: it meets no faults and is not counted. It keeps its place behind
//! frames that are late.

mod counts;
mod injector;
mod random;
mod spec;

pub use counts::Counts;
pub use spec::{Fault, Faults, FaultsError, Rates};

pub(crate) use injector::{Framer, Injector, Piece};
