//! Global parameters of bank 0 in memory.

use core::ops::Index;

use opentmcl_catalog::{GlobalBehaviour, Globals, Module};
use opentmcl_wire::Instant;

/// Values of bank 0 by parameter number, and the two that live: tick timer and random numbers.
#[derive(Clone, Debug)]
pub(crate) struct GlobalSettings {
    values: [i32; 256],
    /// Parameter number of each effect, since the catalogue alone knows numbers.
    numbers: [u8; Self::EFFECTS],
    /// Time at which the tick timer was 0.
    tick_origin: u64,
    /// The bits that it has.
    tick_mask: u32,
    random: u32,
}

impl GlobalSettings {
    /// More than there are effects; a power of two, so that no bounds are checked.
    const EFFECTS: usize = 64;

    /// Ticks of the clock in a millisecond.
    const MILLISECOND: u64 = 16_000;

    /// The factory settings.
    pub(crate) fn new(model: &Module, now: Instant) -> Self {
        let mut values = [0; 256];
        let mut numbers = [0; Self::EFFECTS];
        let mut tick_mask = i32::MAX as u32;
        for row in model.global_parameters.iter().filter(|row| row.bank == 0) {
            values[usize::from(row.number)] = row.default;
            if let GlobalBehaviour::Globals(effect) = row.behaviour {
                numbers[effect as usize % Self::EFFECTS] = row.number;
                if effect == Globals::TickTimer && row.max > i64::from(i32::MAX) {
                    tick_mask = u32::MAX;
                }
            }
        }
        Self { values, numbers, tick_origin: now.as_ticks(), tick_mask, random: 1 }
    }

    /// Whether the module has a parameter with this effect. Bank 0 has no number 0.
    pub(crate) fn has(&self, effect: Globals) -> bool {
        self.numbers[effect as usize % Self::EFFECTS] != 0
    }

    pub(crate) fn number(&self, number: u8) -> i32 {
        self.values[usize::from(number)]
    }

    /// Sets the parameter with this effect, if the module has one.
    pub(crate) fn set(&mut self, effect: Globals, value: i32) {
        if self.has(effect) {
            self.values[usize::from(self.numbers[effect as usize % Self::EFFECTS])] = value;
        }
    }

    pub(crate) fn set_number(&mut self, number: u8, value: i32) {
        self.values[usize::from(number)] = value;
    }

    /// Milliseconds counted by the tick timer. It comes round after the largest value of its row, of 31 or 32 bits.
    pub(crate) fn ticks(&self, now: Instant) -> i32 {
        let elapsed = now.as_ticks().wrapping_sub(self.tick_origin) / Self::MILLISECOND;
        (elapsed as u32 & self.tick_mask) as i32
    }

    pub(crate) fn set_ticks(&mut self, now: Instant, value: i32) {
        let elapsed = u64::from(value as u32 & self.tick_mask) * Self::MILLISECOND;
        self.tick_origin = now.as_ticks().wrapping_sub(elapsed);
    }

    /// The next random number, 31 bit: the same after the same seed (xorshift, Marsaglia 2003).
    pub(crate) fn random(&mut self) -> i32 {
        self.random ^= self.random << 13;
        self.random ^= self.random >> 17;
        self.random ^= self.random << 5;
        (self.random & 0x7FFF_FFFF) as i32
    }

    pub(crate) fn seed_random(&mut self, seed: i32) {
        // The generator would stay at 0 for ever.
        self.random = if seed == 0 { 1 } else { seed as u32 };
    }
}

impl Index<Globals> for GlobalSettings {
    type Output = i32;

    fn index(&self, effect: Globals) -> &i32 {
        let number = self.numbers[effect as usize % Self::EFFECTS];
        &self.values[usize::from(number)]
    }
}
