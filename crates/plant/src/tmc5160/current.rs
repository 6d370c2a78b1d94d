//! The motor current: full while moving, and step by step down to the hold current at standstill.

use crate::driver::STANDSTILL;

/// Unit of TPOWERDOWN and of IHOLDDELAY in clocks.
const DELAY_UNIT: u64 = 1 << 18;

/// Settings of IHOLD_IRUN and TPOWERDOWN.
///
/// Source: datasheet 6.2. Currents are in 1/32 of full scale, less one.
#[derive(Clone, Copy, Debug)]
pub(super) struct Currents {
    run: u32,
    hold: u32,
    step_delay: u64,
    power_down_delay: u64,
}

impl Currents {
    pub(super) fn new(ihold_irun: u32, tpowerdown: u32) -> Self {
        Self {
            run: ihold_irun >> 8 & 0x1F,
            hold: ihold_irun & 0x1F,
            step_delay: u64::from(ihold_irun >> 16 & 0xF) * DELAY_UNIT,
            power_down_delay: u64::from(tpowerdown & 0xFF) * DELAY_UNIT,
        }
    }

    /// CS_ACTUAL of an axis that has been standing for this many clocks; `None` while it moves.
    ///
    /// After TPOWERDOWN the current goes one step every IHOLDDELAY toward IHOLD, upward as well if
    /// the hold current is the higher one; with IHOLDDELAY = 0 all steps at once.
    pub(super) fn actual(&self, standing: Option<u64>) -> u32 {
        let powering_down = standing.and_then(|clocks| clocks.checked_sub(self.power_down_start()));
        let Some(clocks) = powering_down else { return self.run };
        let all = self.run.abs_diff(self.hold);
        let steps = match clocks.checked_div(self.step_delay) {
            Some(steps) => u32::try_from(steps).unwrap_or(all).min(all),
            None => all,
        };
        if self.hold < self.run { self.run - steps } else { self.run + steps }
    }

    /// Whether an axis that has been standing for this many clocks has got to a hold current of 0.
    pub(super) fn rests(&self, standing: u64) -> bool {
        self.hold == 0 && standing >= self.power_down_end()
    }

    /// After how many clocks of standing the current next changes, or the power-down ends where that
    /// alone means something.
    pub(super) fn next_change(&self, standing: u64, end_matters: bool) -> Option<u64> {
        let (start, end) = (self.power_down_start(), self.power_down_end());
        if standing >= end || self.run == self.hold && !end_matters {
            return None;
        }
        match standing.saturating_sub(start).checked_div(self.step_delay) {
            Some(steps) if end > start => Some(start + (steps + 1) * self.step_delay),
            _ => Some(end),
        }
    }

    fn power_down_start(&self) -> u64 {
        STANDSTILL + self.power_down_delay
    }

    fn power_down_end(&self) -> u64 {
        self.power_down_start() + u64::from(self.run.abs_diff(self.hold)) * self.step_delay
    }
}

/// Whether an axis that has been standing for this many clocks counts as standing.
pub(super) fn stands(standing: Option<u64>) -> bool {
    standing.is_some_and(|clocks| clocks >= STANDSTILL)
}
