//! Watching a program from outside: what each command did, and where the program stands.
//!
//! Whoever watches calls [`Module::poll_watched`] in place of [`Module::poll`]. Both are the same code,
//! compiled once with a watcher and once without: nobody pays for a watcher that is not there, and
//! there is no second interpreter whose results could differ.

use core::ops::ControlFlow;

use opentmcl_wire::limits::PROGRAM_LEN;
use opentmcl_wire::{Command, Instant, Status};

use crate::axis::AxisNumber;
use crate::board::Board;
use crate::cpu::{Cpu, Flags, Mode};
use crate::module::Module;

/// A command that a program has executed, and the interpreter's registers after it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Executed {
    /// When it took effect; a WAIT does so when it is over.
    pub at: Instant,
    /// When the program came to it: earlier than `at` for a WAIT, otherwise the same.
    pub since: Instant,
    /// Where it stands.
    pub address: u16,
    /// The command itself.
    pub command: Command,
    /// [`Status::OK`], or why it did nothing while the program went on: what a host would be told that
    /// sends this command, [`Status::NOT_AVAILABLE`] for a call too deep and for a return from nowhere.
    pub status: Status,
    /// Whether JC, CALL or DJNZ went to its address; none for all other commands.
    pub branch: Option<bool>,
    /// Whether it belongs to an interrupt handler, its RETI included.
    pub in_interrupt: bool,
    /// The accumulator after it.
    pub accumulator: i32,
    /// The X register after it.
    pub x: i32,
    /// The flags after it.
    pub flags: Flags,
    /// What the interpreter does after it.
    pub mode: Mode,
    /// Address of the command that comes next, unless an interrupt comes first.
    pub next: u16,
    /// Subroutines that have been called and not returned from after it.
    pub depth: u8,
}

/// What the interpreter does at present, and its registers.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct ProgramState {
    /// Whether it executes commands.
    pub mode: Mode,
    /// Program counter: address of the next command, or of the WAIT that is not over yet.
    pub address: u16,
    /// The accumulator.
    pub accumulator: i32,
    /// The X register.
    pub x: i32,
    /// The flags.
    pub flags: Flags,
    /// Whether an interrupt handler is being executed.
    pub in_interrupt: bool,
    /// Subroutines that have been called and not returned from.
    pub depth: u8,
    /// Since when the WAIT at `address` lasts, if it has begun.
    pub waiting_since: Option<Instant>,
}

/// Who is told of each executed command.
pub(crate) trait Watcher {
    /// A command has been executed; [`ControlFlow::Break`] ends the poll right behind it.
    fn executed(&mut self, executed: impl FnOnce() -> Executed) -> ControlFlow<()>;
}

/// Costs nothing.
pub(crate) struct Nobody;

impl Watcher for Nobody {
    #[inline(always)]
    fn executed(&mut self, _: impl FnOnce() -> Executed) -> ControlFlow<()> {
        ControlFlow::Continue(())
    }
}

/// Somebody who wants to know of each command.
struct Each<F>(F);

impl<F: FnMut(&Executed) -> ControlFlow<()>> Watcher for Each<F> {
    #[inline]
    fn executed(&mut self, executed: impl FnOnce() -> Executed) -> ControlFlow<()> {
        self.0(&executed())
    }
}

/// What a command did, beside what stands in the registers.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Done {
    pub(crate) result: Result<(), Status>,
    pub(crate) branch: Option<bool>,
}

impl Done {
    pub(crate) const OK: Self = Self { result: Ok(()), branch: None };

    #[inline(always)]
    pub(crate) const fn branch(taken: bool) -> Self {
        Self { result: Ok(()), branch: Some(taken) }
    }

    #[inline(always)]
    pub(crate) const fn refused(status: Status) -> Self {
        Self { result: Err(status), branch: None }
    }

    /// A call or a return, which the depth of the stack may forbid.
    #[inline(always)]
    pub(crate) const fn if_possible(possible: bool) -> Self {
        if possible { Self::OK } else { Self::refused(Status::NOT_AVAILABLE) }
    }
}

/// What is no longer known when a command has been executed.
#[derive(Clone, Copy)]
pub(crate) struct Before {
    pub(crate) address: u16,
    pub(crate) command: Command,
    pub(crate) in_interrupt: bool,
}

impl Before {
    #[inline(always)]
    pub(crate) fn new(cpu: &Cpu, command: Command) -> Self {
        Self { address: cpu.pc, command, in_interrupt: cpu.in_interrupt() }
    }

    #[inline(always)]
    pub(crate) fn executed(self, since: Instant, at: Instant, done: Done, cpu: &Cpu) -> Executed {
        Executed {
            at,
            since,
            address: self.address,
            command: self.command,
            status: done.result.err().unwrap_or(Status::OK),
            branch: done.branch,
            in_interrupt: self.in_interrupt,
            accumulator: cpu.accumulator,
            x: cpu.x,
            flags: cpu.flags,
            mode: cpu.mode,
            next: cpu.pc,
            depth: cpu.depth(),
        }
    }
}

/// A servo axis at present, as its parameters tell it, without what reading them would clear.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct ServoState {
    /// Target position, in the unit of the position parameters.
    pub target_position: i32,
    /// Where the ramp of the position is, in the same unit; the actual position without a ramp.
    pub ramp_position: i32,
    /// Actual position.
    pub position: i32,
    /// Target speed in revolutions per minute.
    pub target_speed: i32,
    /// What the ramp of the speed asks for, in revolutions per minute.
    pub ramp_speed: i32,
    /// Actual speed in revolutions per minute.
    pub speed: i32,
    /// Current that makes the torque in mA, as the regulator is asked for it.
    pub target_torque: i32,
    /// The same as it flows, mean of a millisecond.
    pub torque: i32,
    /// Current along the flux in mA, as the regulator is asked for it; 0 where there is no such regulator.
    pub target_flux: i32,
    /// The same as it flows, mean of a millisecond.
    pub flux: i32,
    /// What the torque regulator gives, in 1/32767 of the largest voltage; 0 while the bridge is off.
    pub voltage: i32,
    /// Status flags (parameter 156).
    pub status_flags: u32,
    /// Whether the axis will come to another speed than its present one by itself, that is, whether a motion is
    /// under way that has an end.
    pub is_on_its_way: bool,
}

impl<B: Board> Module<B> {
    /// Does what [`Module::poll`] does and hands over each command that a program executes meanwhile.
    ///
    /// When the watcher breaks off, the module stands right behind that command, at its time, and
    /// what is due until `now` is still to be done: the result is then a break as well. Looking and
    /// breaking off change nothing that the module does later.
    ///
    /// A request may bring a command of a program to execution at its own time. It is handed over by
    /// the next watched poll, unless another request comes first; poll before each request.
    pub fn poll_watched(
        &mut self,
        now: Instant,
        watcher: impl FnMut(&Executed) -> ControlFlow<()>,
    ) -> ControlFlow<()> {
        self.poll_with(now, &mut Each(watcher))
    }

    /// The module's time: that of the last poll, or of the command behind which it was broken off.
    pub fn now(&self) -> Instant {
        self.now
    }

    /// What the interpreter does at present.
    pub fn program_state(&self) -> ProgramState {
        let cpu = &self.cpu;
        ProgramState {
            mode: cpu.mode,
            address: cpu.pc,
            accumulator: cpu.accumulator,
            x: cpu.x,
            flags: cpu.flags,
            in_interrupt: cpu.in_interrupt(),
            depth: cpu.depth(),
            waiting_since: cpu.wait.map(|wait| wait.since),
        }
    }

    /// The command at an address of program memory, protected or not; none beyond its end.
    pub fn program_command(&self, address: u16) -> Option<Command> {
        (usize::from(address) < PROGRAM_LEN).then(|| self.program.get(address))
    }

    /// The value of a user variable.
    pub fn variable(&self, number: u8) -> i32 {
        self.variables[usize::from(number)]
    }

    /// Levels of the general purpose outputs, bit n for output n.
    pub fn digital_outputs(&self) -> u8 {
        self.digital_outputs
    }

    /// Where an axis stands, in microsteps, or a servo axis in the unit of its position parameters; none if there is no
    /// such axis.
    pub fn position(&mut self, axis: u8) -> Option<i32> {
        let axis = AxisNumber::new(axis, self.model.axes)?;
        Some(self.drive(axis).0.position())
    }

    /// Why the firmware stopped an axis, as axis parameter 207 has it, without clearing it as GAP does:
    /// bit 0 a stall, bit 1 a deviation of the encoder. None if there is no such axis.
    pub fn stop_flags(&self, axis: u8) -> Option<u8> {
        let axis = AxisNumber::new(axis, self.model.axes)?;
        Some(self.axes[axis].errors)
    }

    /// The servo axis; none if there is no such axis or if it has a stepper motor.
    pub fn servo_state(&self, axis: u8) -> Option<ServoState> {
        AxisNumber::new(axis, self.model.axes)?;
        self.has_servo().then(|| self.servo.watched())
    }

    /// When a servo axis next may do something that is to be seen: a millisecond is over. None while it sleeps, and
    /// for other axes.
    pub fn next_servo_look(&self) -> Option<Instant> {
        self.next_servo_tick()
    }

    /// How fast an axis turns, positive to the right: a stepper axis in microsteps per second whatever its unit mode, a
    /// servo axis in revolutions per minute. None if there is no such axis.
    pub fn speed(&mut self, axis: u8) -> Option<i32> {
        let axis = AxisNumber::new(axis, self.model.axes)?;
        Some(self.drive(axis).0.shown_speed())
    }
}
