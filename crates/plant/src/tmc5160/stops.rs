//! The stop switches, what latches at their edges, and the stop by StallGuard2.
//!
//! Source: datasheet 6.3.2.1, 6.3.2.2. A switch bars one direction; the way from it is always free, and
//! the motion goes on by itself when the switch opens. The stop by StallGuard2 bars both directions
//! until its event is cleared or sg_stop is switched off.

use opentmcl_motion::Instant;
use opentmcl_motion::ramp::Barred;

use super::registers::{ENC_LATCH, SW_MODE, XLATCH};
use super::{EVENT_STOP_SG, Tmc5160};

/// RAMP_STAT bits 4, 5 have the order of bits 0, 1.
const EVENT_STOP_SHIFT: u32 = 4;

const EVENT_LATCH_LEFT: u32 = 1 << 2;
const EVENT_LATCH_RIGHT: u32 = 1 << 3;

impl Tmc5160 {
    /// Levels of the reference inputs REFL and REFR.
    pub fn set_reference_inputs(&mut self, left: bool, right: bool, now: Instant) {
        self.settle(now);
        let before = self.switches();
        self.left_input = left;
        self.right_input = right;
        let after = self.switches();
        self.latch(before, after, now);
        self.plan_anew(now);
    }

    /// Whether SG_RESULT = 0 would stop the motor now: sg_stop is set, TSTEP is not above TCOOLTHRS,
    /// and the motor moves without StealthChop.
    pub fn stall_stops(&self, now: Instant) -> bool {
        self.stored(SW_MODE) >> 10 & 1 == 1 && self.measures_stalls(now)
    }

    /// The stop by StallGuard2: the speed is zero at once and RAMP_STAT bit 6 is set.
    ///
    /// The axis stands until that bit or sg_stop is cleared, and then goes on where target or speed
    /// still ask for it, not before TZEROWAIT has passed since the stop.
    pub fn stall(&mut self, now: Instant) {
        self.settle(now);
        self.mark(now);
        let place = self.place(now);
        self.ramp.stop_now(now);
        self.events |= EVENT_STOP_SG;
        self.ramp.plan(now, &self.limits());
        self.keep_field(place, now);
        self.expect_events(false, now);
    }

    /// Bits 0, 1 of RAMP_STAT: left and right switch after swap and polarity.
    pub(super) fn switches(&self) -> u32 {
        let mode = self.stored(SW_MODE);
        let (left, right) = (u32::from(self.left_input), u32::from(self.right_input));
        let levels = if mode >> 4 & 1 == 1 { right | left << 1 } else { left | right << 1 };
        levels ^ mode >> 2 & 0b11
    }

    /// Bits 0, 1, 4 and 5 of RAMP_STAT.
    pub(super) fn switch_status(&self) -> u32 {
        self.switches() | self.stopping_switches() << EVENT_STOP_SHIFT
    }

    pub(super) fn barred(&self) -> Barred {
        let mode = self.stored(SW_MODE);
        if mode >> 10 & 1 == 1 && self.events & EVENT_STOP_SG != 0 {
            return Barred { negative: true, positive: true, soft: false };
        }
        let switches = self.stopping_switches();
        Barred {
            negative: switches & 1 != 0,
            positive: switches & 2 != 0,
            soft: mode >> 11 & 1 == 1,
        }
    }

    fn stopping_switches(&self) -> u32 {
        self.switches() & self.stored(SW_MODE) & 0b11
    }

    fn latch(&mut self, before: u32, after: u32, now: Instant) {
        let mode = self.stored(SW_MODE);
        let (closed, opened) = (after & !before, before & !after);
        let happens = |switch: u32, enables: u32| {
            closed & switch != 0 && mode >> enables & 1 == 1
                || opened & switch != 0 && mode >> enables & 2 == 2
        };
        let left = if happens(1, 5) { EVENT_LATCH_LEFT } else { 0 };
        let right = if happens(2, 7) { EVENT_LATCH_RIGHT } else { 0 };
        if left | right == 0 {
            return;
        }
        self.events |= left | right;
        self.store(XLATCH, self.ramp.position(now).cast_unsigned());
        if mode >> 9 & 1 == 1 {
            self.store(ENC_LATCH, self.encoder_position().cast_unsigned());
        }
    }

    /// Clears events of RAMP_STAT; the one of the stall lets the axis go on.
    pub(super) fn clear_events(&mut self, bits: u32, now: Instant) {
        self.events &= !bits;
        self.plan_anew(now);
    }
}
