//! What a line has done so far.

use std::ops::Index;

use super::spec::Fault;

/// How many frames have come along one direction of a line, and how many of them met each fault.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Counts {
    /// All frames that were sent into this direction.
    pub frames: u64,
    by_fault: [u64; Fault::ALL.len()],
}

impl Counts {
    pub(super) fn note(&mut self, fault: Fault) {
        self.by_fault[fault as usize] += 1;
    }

    /// Adds those of another port.
    pub fn add(&mut self, other: &Self) {
        self.frames += other.frames;
        for (sum, more) in self.by_fault.iter_mut().zip(other.by_fault) {
            *sum += more;
        }
    }
}

impl Index<Fault> for Counts {
    type Output = u64;

    /// How many frames met this fault.
    fn index(&self, fault: Fault) -> &u64 {
        &self.by_fault[fault as usize]
    }
}
