//! CoolStep: the current follows the load.
//!
//! Source: datasheets, TMC5160 chapter 14, TMC262 chapter 5. Each reading of StallGuard2 below SEMIN * 32
//! raises the current by SEUP, up to what is set. Readings of (SEMIN + SEMAX + 1) * 32 and more are counted,
//! and every 32nd, 8th, 2nd or each (SEDN) lowers it by one step, down to a half or a quarter (SEIMIN).
//!
//! # Readings
//!
//! - A half of a current CS is (CS + 1) / 2 - 1, rounded down and at least 0; a quarter likewise.
//! - Readings between the limits, and those that cannot change the current, leave the count as it is.

/// What CoolStep has done to the current.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Cool {
    /// Steps below the current that is set.
    lowered: u32,
    /// Readings counted for the next step down.
    counted: u32,
}

impl Cool {
    /// Ends the regulation: the current is the one that is set, and the count begins anew.
    pub(crate) fn release(&mut self) {
        *self = Self::default();
    }
}

/// The settings that CoolStep regulates by.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Settings {
    /// SEMIN 0-3, SEUP 5-6, SEMAX 8-11, SEDN 13-14, SEIMIN 15, as in COOLCONF and in SMARTEN.
    pub(crate) bits: u32,
    /// The current that is set, 0..=31: IRUN or CS.
    pub(crate) current: u32,
}

/// What a reading asks for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Demand {
    More,
    Less,
    Nothing,
}

impl Settings {
    /// Takes one result of StallGuard2.
    pub(crate) fn take(self, cool: &mut Cool, reading: u16) {
        match self.demand(cool, reading) {
            Demand::Nothing => {}
            Demand::More => {
                let step = 1 << (self.bits >> 5 & 0b11);
                *cool = Cool { lowered: self.lowered(cool).saturating_sub(step), counted: 0 };
            }
            Demand::Less => {
                cool.counted += 1;
                if cool.counted >= self.readings_per_step() {
                    *cool = Cool { lowered: self.lowered(cool) + 1, counted: 0 };
                }
            }
        }
    }

    /// After how many results of this value the current changes; none if it will not.
    pub(crate) fn readings_to_change(self, cool: &Cool, reading: u16) -> Option<u32> {
        match self.demand(cool, reading) {
            Demand::Nothing => None,
            Demand::More => Some(1),
            Demand::Less => Some(self.readings_per_step().saturating_sub(cool.counted).max(1)),
        }
    }

    /// The steps below the current that is set, as far as the present settings allow them.
    pub(crate) fn lowered(self, cool: &Cool) -> u32 {
        cool.lowered.min(self.lowest())
    }

    fn demand(self, cool: &Cool, reading: u16) -> Demand {
        let (semin, semax) = (self.bits & 0xF, self.bits >> 8 & 0xF);
        let reading = u32::from(reading);
        if reading < semin * 32 && self.lowered(cool) > 0 {
            Demand::More
        } else if reading >= (semin + semax + 1) * 32 && self.lowered(cool) < self.lowest() {
            Demand::Less
        } else {
            Demand::Nothing
        }
    }

    fn readings_per_step(self) -> u32 {
        match self.bits >> 13 & 0b11 {
            0 => 32,
            1 => 8,
            2 => 2,
            _ => 1,
        }
    }

    /// The most steps below the current that is set.
    fn lowest(self) -> u32 {
        let part = if self.bits >> 15 & 1 == 1 { 4 } else { 2 };
        self.current - ((self.current + 1) / part).saturating_sub(1)
    }
}
