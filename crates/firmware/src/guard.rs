//! Stops by stall (parameter 181) and by deviation of the encoder (212), and what follows (207, 240).
//!
//! The chip itself stops the axis at a stall, if it is told to; this makes sense above some speed only,
//! so the firmware switches that function by the actual speed. It does so on a fixed grid of the module's
//! time, at each millisecond at which the speed can have crossed the threshold. How soon it can cross
//! follows from the accelerations, so between such moments, and while an axis stands or turns steadily,
//! there is nothing to look at and the module can sleep.

use opentmcl_catalog::InterruptBehaviour;
use opentmcl_wire::Instant;

use crate::axis::AxisNumber;
use crate::board::Board;
use crate::cpu::ErrorFlags;
use crate::module::{Module, earliest};
use crate::tmc5160::registers::*;

/// Distance of two looks at the speed, in ticks.
const GRID: u64 = 16_000;

/// Bits of the extended error flags (parameter 207).
pub(crate) const ERROR_STALL: u8 = 1;
const ERROR_DEVIATION: u8 = 2;

/// Bits of the deviation action (parameter 240).
const ACTION_OUTPUT_NUMBER: i32 = 0x0F;
const ACTION_SET_OUTPUT: i32 = 0x10;
const ACTION_TORQUE_OFF: i32 = 0x20;
const ACTION_ALL_TORQUE_OFF: i32 = 0x40;

/// Which axes are guarded. Masks of axes.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Guards {
    /// Axes that a stall stops.
    stall: u8,
    /// Axes that a deviation of the encoder stops.
    deviation: u8,
    /// When to look at the speeds next.
    pub(crate) next_look: Option<Instant>,
}

impl Guards {
    /// Axes of which the hardware may have to tell something.
    #[inline]
    pub(crate) fn axes(&self) -> u8 {
        self.stall | self.deviation
    }
}

/// The mask with the bit of this axis set or cleared.
const fn with(mask: u8, axis: AxisNumber, on: bool) -> u8 {
    if on { mask | axis.bit() } else { mask & !axis.bit() }
}

impl<B: Board> Module<B> {
    /// Sets the speed, in the chip's unit, above which a stall stops the axis; 0 is never.
    pub(crate) fn guard_stall(&mut self, axis: AxisNumber, speed: u32) {
        self.axes[axis].stall_speed = speed;
        if self.tended_axes() & axis.bit() != 0 {
            return;
        }
        self.guards.stall = with(self.guards.stall, axis, speed != 0);
        let (mut chip, _) = self.tmc5160(axis);
        if speed == 0 && chip.read_field(SG_STOP) != 0 {
            chip.write_field(SG_STOP, 0);
        }
    }

    /// Notes whether a deviation of the encoder stops the axis.
    pub(crate) fn guard_deviation(&mut self, axis: AxisNumber, on: bool) {
        self.guards.deviation = with(self.guards.deviation, axis, on);
        self.forget_deviation(axis);
    }

    /// A motion command ends a search and clears the error flags of its axis.
    pub(crate) fn begin_motion(&mut self, axis: AxisNumber) {
        self.end_search(axis);
        self.axes[axis].errors = 0;
        self.forget_deviation(axis);
    }

    /// Clears the chip's memory of a deviation; it sets it again at once while it lasts.
    pub(crate) fn forget_deviation(&mut self, axis: AxisNumber) {
        if self.guards.deviation & axis.bit() != 0 {
            self.tmc5160(axis).0.write(ENC_STATUS, ENC_STATUS_DEVIATION);
        }
    }

    /// The axis' speed has been changed by a command.
    pub(crate) fn touch_guarded(&mut self, axis: AxisNumber) {
        if (self.guards.axes() | self.tended_axes()) & axis.bit() != 0 {
            self.touch(axis);
        }
    }

    /// Stops axes that have stalled or deviate, before anything else makes use of their standstill.
    pub(crate) fn observe_guards(&mut self, axes: u8) {
        let axes = axes & self.guards.axes();
        for axis in AxisNumber::all(self.model.axes).filter(|axis| axes & axis.bit() != 0) {
            let has_stalled = self.guards.stall & axis.bit() != 0
                && self.tmc5160(axis).0.read_field(EVENT_STOP_SG) != 0;
            if has_stalled {
                self.stop_by_stall(axis);
            }
            if self.guards.deviation & axis.bit() != 0 && self.tmc5160(axis).0.deviates_in_motion()
            {
                self.stop_by_deviation(axis);
            }
        }
    }

    /// Finds out when the speeds of these axes have to be looked at; after all that changes them.
    pub(crate) fn plan_looks(&mut self, axes: u8) {
        let axes = axes & self.guards.stall;
        for axis in AxisNumber::all(self.model.axes).filter(|axis| axes & axis.bit() != 0) {
            let look = self.next_look(axis);
            self.guards.next_look = earliest(self.guards.next_look, look);
        }
    }

    /// Switches the stop by stall by the speeds, if it is time to look.
    pub(crate) fn look_at_speeds(&mut self) {
        if self.guards.next_look.is_none_or(|look| look > self.now) {
            return;
        }
        self.guards.next_look = None;
        let axes = self.guards.stall;
        for axis in AxisNumber::all(self.model.axes).filter(|axis| axes & axis.bit() != 0) {
            let (mut chip, state) = self.tmc5160(axis);
            let wanted = u32::from(chip.velocity().unsigned_abs() > state.stall_speed);
            if chip.read_field(SG_STOP) != wanted {
                chip.write_field(SG_STOP, wanted);
            }
        }
        // A stall that the chip knows of already may stop an axis at once.
        self.observe_guards(axes);
        self.plan_looks(axes);
    }

    fn next_look(&mut self, axis: AxisNumber) -> Option<Instant> {
        let now = self.now;
        let (mut chip, state) = self.tmc5160(axis);
        let threshold = state.stall_speed;
        let is_fast = chip.velocity().unsigned_abs() > threshold;
        if (chip.read_field(SG_STOP) != 0) != is_fast {
            return Some(grid_after(now));
        }
        if chip.is_at_rest() || !is_fast && chip.read_field(RAMP_STAT_VELOCITY_REACHED) != 0 {
            return None;
        }
        // No event tells when the axis begins to brake.
        let kept = if is_fast { chip.ticks_until_slower() } else { Some(0) };
        let until_crossing = kept?.saturating_add(chip.ticks_until_speed(threshold));
        Some(grid_after(Instant::from_ticks(now.as_ticks().saturating_add(until_crossing))))
    }

    fn stop_by_stall(&mut self, axis: AxisNumber) {
        self.stop_at_once(axis, ERROR_STALL);
        let (mut chip, _) = self.tmc5160(axis);
        // Only then: while the axis has a speed to reach, it would start again.
        chip.write_field(SG_STOP, 0);
        chip.write(RAMP_STAT, EVENT_STOP_SG.insert(0, 1));
        self.raise(InterruptBehaviour::Stallguard, axis.get());
    }

    fn stop_by_deviation(&mut self, axis: AxisNumber) {
        self.stop_at_once(axis, ERROR_DEVIATION);
        self.forget_deviation(axis);
        self.cpu.flags.errors.set(ErrorFlags::DEVIATION);
        self.raise(InterruptBehaviour::Deviation, axis.get());
        let action = self.axes[axis].deviation_action;
        if action & ACTION_SET_OUTPUT != 0 {
            // Numbers that no output has set none.
            let output = 1u32 << (action & ACTION_OUTPUT_NUMBER);
            self.write_outputs(self.digital_outputs | output as u8);
        }
        for other in AxisNumber::all(self.model.axes) {
            let this = other == axis && action & ACTION_TORQUE_OFF != 0;
            if this || action & ACTION_ALL_TORQUE_OFF != 0 {
                self.tmc5160(other).0.write_field(TOFF, 0);
            }
        }
    }

    pub(crate) fn stop_at_once(&mut self, axis: AxisNumber, error: u8) {
        self.give_up_target(axis);
        self.halt_search(axis);
        let (mut drive, state) = self.drive(axis);
        drive.stop_hard(state);
        state.errors |= error;
    }
}

/// The next moment of the grid.
const fn grid_after(now: Instant) -> Instant {
    Instant::from_ticks((now.as_ticks() / GRID).saturating_add(1).saturating_mul(GRID))
}
