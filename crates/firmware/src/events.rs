//! What happens without a command: targets reached, levels that change, silence of the host.

use opentmcl_catalog::{Globals, InterruptBehaviour};
use opentmcl_wire::{Duration, Instant, Opcode, Reply, Status, control};

use crate::axis::AxisNumber;
use crate::board::Board;
use crate::cpu::Wait;
use crate::line::Port;
use crate::module::Module;

/// Moves under way, and who wants to know that they have arrived. Masks of axes.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Arrivals {
    /// Axes that have been sent to a target and have not been seen there yet.
    moving: u8,
    /// Axes whose next MVP shall be reported to the host.
    asked: u8,
    /// Whether every MVP shall be reported and not only the next.
    every: bool,
    /// Axes whose present MVP is to be reported.
    awaited: u8,
    /// Who asked.
    port: Option<Port>,
    /// Axes on which a command may have brought about what the hardware reports no event for: a target
    /// at which the axis stands already, another position or polarity.
    touched: u8,
}

/// Levels of switches and inputs as seen last; their changes are edges.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Levels {
    stop_left: u8,
    stop_right: u8,
    inputs: u8,
}

/// Stops the motors when the host falls silent (global parameter 68).
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Heartbeat {
    /// When the silence becomes too long; none while it is off or has done its work.
    pub(crate) deadline: Option<Instant>,
}

impl<B: Board> Module<B> {
    /// A request has come or the time has been set: the silence starts anew.
    pub(crate) fn restart_heartbeat(&mut self) {
        let limit = u64::from(self.globals[Globals::SerialHeartbeat].unsigned_abs());
        self.heartbeat.deadline = (limit != 0).then(|| self.now + Duration::from_millis(limit));
        if let Some(deadline) = self.heartbeat.deadline {
            self.quiet_until = self.quiet_until.min(deadline);
        }
    }

    pub(crate) fn check_heartbeat(&mut self) {
        if self.heartbeat.deadline.is_some_and(|deadline| deadline <= self.now) {
            self.heartbeat.deadline = None;
            for axis in AxisNumber::all(self.model.axes) {
                self.stop_axis(axis);
            }
            self.observe_touched();
        }
    }

    /// Takes note of a request for position reports (command 138).
    pub(crate) fn ask_for_report(&mut self, port: Option<Port>, axes: u8, every: bool) {
        self.arrivals.asked = axes;
        self.arrivals.every = every;
        self.arrivals.awaited &= axes;
        self.arrivals.port = port;
    }

    /// An axis has been sent to a target; by an MVP command if `report`.
    pub(crate) fn depart(&mut self, axis: AxisNumber, report: bool) {
        let arrivals = &mut self.arrivals;
        arrivals.moving |= axis.bit();
        if report && arrivals.asked & axis.bit() != 0 {
            arrivals.awaited |= axis.bit();
            if !arrivals.every {
                arrivals.asked &= !axis.bit();
            }
        }
        self.touch(axis);
    }

    /// A command has changed what the hardware of an axis shows.
    pub(crate) fn touch(&mut self, axis: AxisNumber) {
        self.arrivals.touched |= axis.bit();
    }

    /// Looks at the axes that a command has touched; after the reply to that command, so that a report
    /// of arrival (138) does not overtake it.
    pub(crate) fn observe_touched(&mut self) {
        let touched = core::mem::take(&mut self.arrivals.touched);
        if touched != 0 {
            self.observe_axes(touched);
        }
    }

    /// An axis is no longer on its way to a target.
    pub(crate) fn give_up_target(&mut self, axis: AxisNumber) {
        self.arrivals.moving &= !axis.bit();
        self.arrivals.awaited &= !axis.bit();
    }

    /// Whether changes of the hardware have consequences at present.
    pub(crate) fn is_watching(&self) -> bool {
        if self.arrivals.awaited | self.searching | self.guards.axes() | self.tended_axes() != 0 {
            return true;
        }
        self.cpu.is_active() && (self.waits_for_hardware() || self.watches_interrupts())
    }

    fn waits_for_hardware(&self) -> bool {
        let command = self.program.get(self.cpu.pc);
        self.cpu.wait.is_some() && command.number == Opcode::Wait.number() && command.kind != 0
    }

    /// Whether an interrupt is enabled that is not a timer.
    fn watches_interrupts(&self) -> bool {
        self.interrupts.any_enabled_from(crate::interrupts::TIMERS as u8)
    }

    /// Looks at the hardware and draws the consequences.
    pub(crate) fn observe(&mut self) {
        self.observe_axes(u8::MAX);
    }

    /// Looks at some of the axes and draws the consequences.
    pub(crate) fn observe_axes(&mut self, axes: u8) {
        self.observe_arrivals(axes);
        if axes & (self.searching | self.guards.axes()) != 0 {
            self.observe_guards(axes);
            self.observe_searches(axes);
            self.plan_looks(axes);
        }
        self.tend(axes);
        if self.watches_interrupts() {
            self.observe_levels();
        }
    }

    fn observe_arrivals(&mut self, axes: u8) {
        let mut reported = 0;
        let looked_at = self.arrivals.moving & axes;
        for axis in AxisNumber::all(self.model.axes) {
            if looked_at & axis.bit() != 0 && self.drive(axis).0.position_reached() {
                self.arrivals.moving &= !axis.bit();
                reported |= self.arrivals.awaited & axis.bit();
                self.raise(InterruptBehaviour::PositionReached, axis.get());
            }
        }
        self.arrivals.awaited &= !reported;
        if let (Some(port), 1..) = (self.arrivals.port, reported) {
            let status = Status::DELAYED;
            let reply =
                Reply { status, number: control::POSITION_REPORT, value: i32::from(reported) };
            self.send(port, reply);
        }
    }

    fn observe_levels(&mut self) {
        let (before, now) = (self.levels, self.read_levels());
        self.levels = now;
        for index in 0..8 {
            let pairs = [
                (InterruptBehaviour::StopLeft, before.stop_left, now.stop_left),
                (InterruptBehaviour::StopRight, before.stop_right, now.stop_right),
                (InterruptBehaviour::InputChange, before.inputs, now.inputs),
            ];
            for (source, before, now) in pairs {
                let (before, now) = (before >> index & 1, now >> index & 1);
                if before != now
                    && let Some(number) = self.interrupt_number(source, index)
                {
                    self.interrupts.edge(number, now != 0);
                }
            }
        }
    }

    pub(crate) fn read_levels(&mut self) -> Levels {
        let mut levels = Levels { inputs: self.board.digital_inputs(), ..Levels::default() };
        for axis in AxisNumber::all(self.model.axes) {
            let (left, right) = self.drive(axis).0.limit_switches();
            if left {
                levels.stop_left |= axis.bit();
            }
            if right {
                levels.stop_right |= axis.bit();
            }
        }
        levels
    }

    /// What happened before an interrupt was enabled does not trigger it.
    pub(crate) fn forget_past_events(&mut self) {
        self.observe();
        self.levels = self.read_levels();
    }

    pub(crate) fn raise(&mut self, source: InterruptBehaviour, index: u8) {
        if let Some(number) = self.interrupt_number(source, index) {
            self.interrupts.raise(number);
        }
    }

    fn interrupt_number(&self, source: InterruptBehaviour, index: u8) -> Option<u8> {
        let mut rows = self.model.interrupts.iter();
        rows.find(|row| row.behaviour == source && row.index == index).map(|row| row.number)
    }

    /// Whether what a WAIT of this kind waits for is the case.
    fn wait_condition(&mut self, kind: u8, motor: u8) -> bool {
        const POSITION: u8 = 1;
        const HOME_SWITCH: u8 = 2;
        const LIMIT_SWITCH: u8 = 3;
        const SEARCH: u8 = 4;
        let Ok(axis) = self.axis(motor) else { return true };
        match kind {
            POSITION => self.drive(axis).0.position_reached(),
            HOME_SWITCH => self.board.home_switch(axis.get()),
            LIMIT_SWITCH => {
                let (left, right) = self.drive(axis).0.limit_switches();
                left || right
            }
            SEARCH => !self.axes[axis].search.is_active(),
            _ => true,
        }
    }

    /// Whether the WAIT at the program counter is over; sets the time-out flag if by time-out.
    pub(crate) fn wait_is_over(&mut self, wait: Wait) -> bool {
        let command = self.program.get(self.cpu.pc);
        let expired = wait.deadline.is_some_and(|deadline| deadline <= self.now);
        if command.kind == 0 {
            return expired;
        }
        if self.wait_condition(command.kind, command.motor) {
            return true;
        }
        if expired {
            self.cpu.flags.errors.set(crate::cpu::ErrorFlags::TIMEOUT);
        }
        expired
    }
}
