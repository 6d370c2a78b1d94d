//! Settings of a servo axis: the value of each parameter as it was set, by its effect.

use core::ops::{Index, IndexMut};

use opentmcl_catalog::{Block, Foc, Servo};

/// More than there are effects of both modules; powers of two, so that no bounds are checked.
const SHARED: usize = 32;
const OWN: usize = 128;

/// Values by effect. A module has effects of [`Foc`] or of [`Block`], never of both.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Settings {
    shared: [i32; SHARED],
    own: [i32; OWN],
}

impl Settings {
    pub(super) const fn new() -> Self {
        Self { shared: [0; SHARED], own: [0; OWN] }
    }
}

impl Index<Servo> for Settings {
    type Output = i32;

    #[inline]
    fn index(&self, effect: Servo) -> &i32 {
        &self.shared[effect as usize % SHARED]
    }
}

impl IndexMut<Servo> for Settings {
    fn index_mut(&mut self, effect: Servo) -> &mut i32 {
        &mut self.shared[effect as usize % SHARED]
    }
}

impl Index<Foc> for Settings {
    type Output = i32;

    #[inline]
    fn index(&self, effect: Foc) -> &i32 {
        &self.own[effect as usize % OWN]
    }
}

impl IndexMut<Foc> for Settings {
    fn index_mut(&mut self, effect: Foc) -> &mut i32 {
        &mut self.own[effect as usize % OWN]
    }
}

impl Index<Block> for Settings {
    type Output = i32;

    #[inline]
    fn index(&self, effect: Block) -> &i32 {
        &self.own[effect as usize % OWN]
    }
}

impl IndexMut<Block> for Settings {
    fn index_mut(&mut self, effect: Block) -> &mut i32 {
        &mut self.own[effect as usize % OWN]
    }
}
