//! What the firmware does every 10 ms for drivers that do not do it themselves (TMC26x): the currents of
//! running, boost, slow running and standstill, freewheeling, the stop by stall.
//!
//! It does so on a fixed grid of the module's time, and only where something can come of it: an axis that
//! runs with one current or has stood for long enough is left alone, so that the module can sleep.
//!
//! # Readings
//!
//! - Parameter 182 = 0 switches its function off: CoolStep is as parameter 172 says at every speed.
//! - Boost comes before the slow run current: it counts whenever the speed changes.
//! - An axis that is asked to move has its run current at once. One that its end switch keeps from moving
//!   counts as standing with parameter 150 only.

use opentmcl_catalog::{InterruptBehaviour, Motion};
use opentmcl_wire::{Duration, Instant};

use crate::axis::{AxisNumber, AxisState};
use crate::board::Board;
use crate::guard::ERROR_STALL;
use crate::module::{Module, earliest};
use crate::tmc429::registers::*;

/// Distance of two looks, and unit of the delays, in ticks.
const GRID: u64 = 160_000;

/// Currents of an axis, 0..=255 each, and what chooses among them, as set by parameters.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Currents {
    /// While the axis runs (6).
    pub(crate) run: i32,
    /// While it stands (7).
    pub(crate) standby: i32,
    /// While its speed changes; 0 is as `run` (200).
    pub(crate) boost: i32,
    /// While it is slower than `cool_speed` (183).
    pub(crate) slow: i32,
    /// Speed from which CoolStep is on, in the chip's unit; 0 is at every speed (182).
    pub(crate) cool_speed: u32,
    /// Time of standing before the standby current, in 10 ms (214).
    pub(crate) power_down_delay: i32,
    /// Time of standing before the bridges open, in 10 ms; 0 is never (204).
    pub(crate) freewheeling_delay: i32,
    /// Whether an axis that a limit switch holds is one that stands (150).
    pub(crate) power_down_at_switch: bool,
    /// CoolStep as set, which the driver has only above `cool_speed` (172).
    pub(crate) semin: u32,
    /// Off time as set, which the driver does not have while it freewheels (167).
    pub(crate) toff: u32,
    /// Since when the axis stands; none while it moves.
    standing_since: Option<Instant>,
}

impl<B: Board> Module<B> {
    /// Axes that are tended, as a mask: all of a module with such drivers.
    pub(crate) fn tended_axes(&self) -> u8 {
        match self.model.motion {
            Motion::Tmc5160 | Motion::Foc | Motion::Block => 0,
            Motion::Tmc429 => {
                AxisNumber::all(self.model.axes).fold(0, |axes, axis| axes | axis.bit())
            }
        }
    }

    /// Looks at some axes now, after a command or an event of theirs.
    pub(crate) fn tend(&mut self, axes: u8) {
        let axes = axes & self.tended_axes();
        for axis in AxisNumber::all(self.model.axes).filter(|axis| axes & axis.bit() != 0) {
            self.tend_axis(axis);
        }
    }

    /// Looks at all axes, if it is time.
    pub(crate) fn tend_if_due(&mut self) {
        if self.next_tending.is_some_and(|time| time <= self.now) {
            self.next_tending = None;
            self.tend(u8::MAX);
        }
    }

    fn tend_axis(&mut self, axis: AxisNumber) {
        let now = self.now;
        let (mut chip, state) = self.tmc429(axis);
        let speed = chip.velocity().unsigned_abs();
        let gives_up = state.currents.power_down_at_switch && chip.is_held_by_switch();
        let stands = speed == 0 && (!chip.is_asked_to_move() || gives_up);
        if state.stall_speed != 0 && speed > state.stall_speed && chip.has_stalled() {
            return self.stop_by_driver(axis);
        }
        let changes = speed != 0 && chip.read(A_ACTUAL) != 0;
        let next = state.currents.apply(stands, speed, changes, now, |field, value| {
            if chip.read_field(field) != value {
                chip.write_field(field, value);
            }
        });
        let watches_stall = state.stall_speed != 0 && speed != 0;
        let next = if watches_stall { earliest(next, Some(grid_after(now))) } else { next };
        self.next_tending = earliest(self.next_tending, next);
    }

    /// The driver has told a stall: the axis stops at once.
    fn stop_by_driver(&mut self, axis: AxisNumber) {
        self.stop_at_once(axis, ERROR_STALL);
        self.raise(InterruptBehaviour::Stallguard, axis.get());
        self.tend_axis(axis);
    }
}

impl Currents {
    /// Gives the driver what belongs to the present motion; when that next has to be looked at.
    fn apply(
        &mut self,
        stands: bool,
        speed: u32,
        changes: bool,
        now: Instant,
        mut write: impl FnMut(Field, u32),
    ) -> Option<Instant> {
        if !stands {
            self.standing_since = None;
            let is_slow = self.cool_speed != 0 && speed < self.cool_speed;
            let current = match (changes && self.boost != 0, is_slow) {
                (true, _) => self.boost,
                (false, true) => self.slow,
                (false, false) => self.run,
            };
            write(CS, current.unsigned_abs() / 8);
            write(SEMIN, if is_slow { 0 } else { self.semin });
            write(TOFF, self.toff);
            let depends = self.boost != 0 || self.cool_speed != 0;
            return depends.then(|| grid_after(now));
        }
        let since = *self.standing_since.get_or_insert(now);
        let after =
            |delay: i32| since + Duration::from_ticks(GRID * u64::from(delay.unsigned_abs()));
        let power_down = after(self.power_down_delay);
        let freewheeling =
            Some(after(self.freewheeling_delay)).filter(|_| self.freewheeling_delay != 0);
        let is_down = power_down <= now;
        write(CS, if is_down { self.standby } else { self.run }.unsigned_abs() / 8);
        write(SEMIN, if self.cool_speed == 0 { self.semin } else { 0 });
        let is_free = freewheeling.is_some_and(|time| time <= now);
        write(TOFF, if is_free { 0 } else { self.toff });
        earliest(Some(power_down).filter(|_| !is_down), freewheeling.filter(|_| !is_free))
            .map(grid_at)
    }
}

impl AxisState {
    /// The axis has been switched on: it stands from now on.
    pub(crate) fn stands_from(&mut self, now: Instant) {
        self.currents.standing_since = Some(now);
    }
}

/// The next moment of the grid.
const fn grid_after(now: Instant) -> Instant {
    Instant::from_ticks((now.as_ticks() / GRID).saturating_add(1).saturating_mul(GRID))
}

/// The moment itself if it is one of the grid, or the next one.
const fn grid_at(time: Instant) -> Instant {
    Instant::from_ticks(time.as_ticks().div_ceil(GRID).saturating_mul(GRID))
}
