//! Running a program: the time of its commands, waiting, interrupts.
//!
//! A command takes a fixed time. Commands that touch only registers and variables run in one go up to
//! the next moment at which anything else can happen; all others return to the order of time in
//! [`Module::poll`].

use core::ops::ControlFlow;

use opentmcl_catalog::Mode as CommandMode;
use opentmcl_wire::limits::VARIABLES;
use opentmcl_wire::{Command, Duration, Instant, Opcode, Status};

use crate::arithmetic;
use crate::board::Board;
use crate::commands::{Caller, Outcome};
use crate::cpu::{Cpu, Flags, Mode, Wait};
use crate::module::{Module, earliest};
use crate::watch::{Before, Done, Watcher};

/// One tick of WAIT.
const WAIT_TICK_MS: u64 = 10;

impl<B: Board> Module<B> {
    /// Starts the program at its present address; without motor supply a module that needs it does not.
    pub(crate) fn run_program(&mut self) {
        if !self.has_motor_supply() {
            return;
        }
        if !self.cpu.is_active() {
            self.cpu.next_at = self.now;
            self.cpu.look_again(self.now);
            self.forget_past_events();
            self.interrupts.restart_timers(self.now);
        }
        self.cpu.mode = Mode::Run;
        self.cpu.steps = 0;
    }

    /// Executes one command more and then stands still.
    pub(crate) fn step_program(&mut self) {
        let steps = if self.cpu.mode == Mode::Step { self.cpu.steps } else { 0 };
        if !self.cpu.is_active() {
            self.cpu.next_at = self.now;
            self.cpu.look_again(self.now);
        }
        self.cpu.mode = Mode::Step;
        self.cpu.steps = steps.saturating_add(1);
    }

    /// When the running program next does something; none while it waits for the hardware.
    pub(crate) fn next_command(&self) -> Option<Instant> {
        match self.cpu.wait {
            None => Some(self.cpu.next_at),
            Some(_) if self.interrupts.is_ready() && !self.cpu.in_interrupt() => Some(self.now),
            Some(wait) => earliest(wait.deadline, wait.look_at),
        }
    }

    /// Executes what is due at the present time, and register commands up to `limit` as long as
    /// nothing else can happen.
    pub(crate) fn run_until(
        &mut self,
        limit: Instant,
        watcher: &mut impl Watcher,
    ) -> ControlFlow<()> {
        if self.cpu.wait.is_some() {
            return self.run_wait(watcher);
        }
        if self.cpu.next_at > self.now {
            return ControlFlow::Continue(());
        }
        self.enter_interrupt();
        if self.cpu.mode == Mode::Run {
            let until = match self.next_disturbance() {
                Some(event) => limit.min(Instant::from_ticks(event.as_ticks().saturating_sub(1))),
                None => limit,
            };
            let flow = run_registers(
                &mut self.cpu,
                &mut self.variables,
                |at| self.program.get(at),
                until,
                self.command_time,
                watcher,
            );
            if let ControlFlow::Break(at) = flow {
                self.set_time(at);
                return ControlFlow::Break(());
            }
            if !self.cpu.is_active() || self.cpu.next_at > until {
                return ControlFlow::Continue(());
            }
            self.set_time(self.cpu.next_at);
        }
        self.run_command(watcher)
    }

    fn enter_interrupt(&mut self) {
        if !self.cpu.in_interrupt()
            && let Some(address) = self.interrupts.take()
        {
            self.cpu.enter_interrupt(address);
        }
    }

    fn run_wait(&mut self, watcher: &mut impl Watcher) -> ControlFlow<()> {
        if self.interrupts.is_ready() && !self.cpu.in_interrupt() {
            self.enter_interrupt();
            self.cpu.next_at = self.now;
            return ControlFlow::Continue(());
        }
        let Some(wait) = self.cpu.wait else { return ControlFlow::Continue(()) };
        if self.wait_is_over(wait) {
            let before = Before::new(&self.cpu, self.program.get(self.cpu.pc));
            self.cpu.wait = None;
            self.cpu.advance();
            self.cpu.next_at = self.now;
            self.finish_command();
            watcher.executed(|| before.executed(wait.since, self.now, Done::OK, &self.cpu))
        } else {
            self.cpu.wait = Some(Wait { look_at: None, ..wait });
            ControlFlow::Continue(())
        }
    }

    /// Executes the command at the program counter, whatever it is.
    fn run_command(&mut self, watcher: &mut impl Watcher) -> ControlFlow<()> {
        let command = self.program.get(self.cpu.pc);
        let before = Before::new(&self.cpu, command);
        let done = match run_register_command(&mut self.cpu, &mut self.variables, command) {
            Some(done) => done,
            None => match Opcode::from_number(command.number) {
                Some(Opcode::Wait) => match self.begin_wait(command) {
                    Ok(()) => return self.run_wait(watcher),
                    Err(status) => {
                        self.cpu.advance();
                        Done::refused(status)
                    }
                },
                Some(Opcode::Reti) => Done::if_possible(self.cpu.return_from_interrupt(self.now)),
                _ => {
                    let result = self.run_other_command(command);
                    self.cpu.advance();
                    Done { result, branch: None }
                }
            },
        };
        self.finish_command();
        watcher.executed(|| before.executed(self.now, self.now, done, &self.cpu))
    }

    /// A command that is refused does nothing; the program goes on.
    fn run_other_command(&mut self, command: Command) -> Result<(), Status> {
        if !self.is_known(command.number) {
            return Err(Status::INVALID_COMMAND);
        }
        let mode = self.model.command(command.number).map(|row| row.mode);
        let outcome = if mode == Some(CommandMode::Direct) {
            Err(Status::NOT_AVAILABLE)
        } else {
            self.execute(command, Caller::Program)
        };
        if let Ok(Outcome::Read(value)) = outcome {
            self.cpu.accumulator = value;
            self.cpu.flags.test(value);
        }
        self.observe_touched();
        outcome.map(|_| ())
    }

    fn finish_command(&mut self) {
        self.cpu.next_at += self.command_time;
        self.cpu.steps = self.cpu.steps.saturating_sub(1);
    }

    /// Begins to wait; an error if there is no such condition or axis.
    fn begin_wait(&mut self, command: Command) -> Result<(), Status> {
        if command.kind > 4 {
            return Err(Status::WRONG_TYPE);
        }
        if command.kind != 0 {
            self.axis(command.motor)?;
        }
        let ticks = if command.value == -1 { self.cpu.accumulator } else { command.value };
        let time = Duration::from_millis(u64::from(ticks.max(0).unsigned_abs()) * WAIT_TICK_MS);
        // For all but TICKS the time is a time-out, and 0 is none.
        let ends = command.kind == 0 || ticks > 0;
        let deadline = ends.then(|| self.now + time);
        self.cpu.wait = Some(Wait { since: self.now, deadline, look_at: None });
        Ok(())
    }
}

/// Executes register commands until one is something else, is due after `until`, or the program ends;
/// a break is the time of the command behind which the watcher breaks off.
fn run_registers(
    cpu: &mut Cpu,
    variables: &mut [i32; VARIABLES],
    program: impl Fn(u16) -> Command,
    until: Instant,
    command_time: Duration,
    watcher: &mut impl Watcher,
) -> ControlFlow<Instant> {
    let mut next_at = cpu.next_at;
    let mut flow = ControlFlow::Continue(());
    while next_at <= until {
        let command = program(cpu.pc);
        let before = Before::new(cpu, command);
        let Some(done) = run_register_command(cpu, variables, command) else { break };
        let at = next_at;
        next_at += command_time;
        flow = watcher.executed(|| before.executed(at, at, done, cpu)).map_break(|()| at);
        if flow.is_break() || cpu.mode != Mode::Run {
            break;
        }
    }
    cpu.next_at = next_at;
    flow
}

/// Executes a command that touches nothing but the interpreter's registers and the user variables,
/// and moves the program counter. Gives none, having done nothing, for all others.
///
/// This and what it calls are always inlined: the loop around them is the interpreter's inner loop.
#[inline(always)]
fn run_register_command(
    cpu: &mut Cpu,
    variables: &mut [i32; VARIABLES],
    command: Command,
) -> Option<Done> {
    const END: u8 = 0;
    const JC: u8 = Opcode::Jc.number();
    const JA: u8 = Opcode::Ja.number();
    const CSUB: u8 = Opcode::Csub.number();
    const RSUB: u8 = Opcode::Rsub.number();
    const STOP: u8 = Opcode::Stop.number();
    const RST: u8 = Opcode::Rst.number();
    const DJNZ: u8 = Opcode::Djnz.number();
    const CALL: u8 = Opcode::Call.number();
    Some(match command.number {
        END => {
            cpu.stop();
            Done::OK
        }
        JA => {
            cpu.jump(command.value);
            Done::OK
        }
        JC | CALL => match cpu.flags.condition(command.kind) {
            Some(true) if command.number == JC => {
                cpu.jump(command.value);
                Done::branch(true)
            }
            Some(true) if cpu.call(command.value) => Done::branch(true),
            Some(true) => Done::refused(Status::NOT_AVAILABLE),
            Some(false) => {
                cpu.advance();
                Done::branch(false)
            }
            None => {
                cpu.advance();
                Done::refused(Status::WRONG_TYPE)
            }
        },
        CSUB => Done::if_possible(cpu.call(command.value)),
        RSUB => Done::if_possible(cpu.return_from_subroutine()),
        STOP => {
            cpu.advance();
            cpu.stop();
            Done::OK
        }
        RST => {
            cpu.reset();
            cpu.jump(command.value);
            Done::OK
        }
        DJNZ => {
            let variable = &mut variables[usize::from(command.kind)];
            *variable = variable.wrapping_sub(1);
            let taken = *variable != 0;
            if taken {
                cpu.jump(command.value)
            } else {
                cpu.advance()
            }
            Done::branch(taken)
        }
        _ => {
            // A refused operation does nothing; the program goes on.
            let result = calculate(cpu, variables, command)?;
            cpu.advance();
            Done { result, branch: None }
        }
    })
}

/// The commands that calculate with registers and variables, in a program and in direct mode.
///
/// `None` if the command is not one of them; an error if there is no such operation or variable.
#[inline(always)]
pub(crate) fn calculate(
    cpu: &mut Cpu,
    variables: &mut [i32; VARIABLES],
    command: Command,
) -> Option<Result<(), Status>> {
    const CALC: u8 = Opcode::Calc.number();
    const COMP: u8 = Opcode::Comp.number();
    const CALCX: u8 = Opcode::Calcx.number();
    const CALCVV: u8 = Opcode::Calcvv.number();
    const CALCVA: u8 = Opcode::Calcva.number();
    const CALCAV: u8 = Opcode::Calcav.number();
    const CALCVX: u8 = Opcode::Calcvx.number();
    const CALCXV: u8 = Opcode::Calcxv.number();
    const CALCV: u8 = Opcode::Calcv.number();
    const SIV: u8 = Opcode::Siv.number();
    const GIV: u8 = Opcode::Giv.number();
    const AIV: u8 = Opcode::Aiv.number();
    const NOT: u8 = 8;
    const LOAD: u8 = 9;
    const SWAP: u8 = 10;

    let Command { number, kind, motor, value } = command;
    let Cpu { accumulator, x, flags, .. } = cpu;
    let variable = usize::from(motor);
    // CALC and CALCV name one place only: NOT inverts it.
    let constant = |destination: i32| if kind == NOT { destination } else { value };
    let done = match number {
        COMP => {
            flags.compare(*accumulator, value);
            true
        }
        CALC if kind <= LOAD => apply(kind, accumulator, &mut constant(*accumulator), flags),
        CALC => false,
        CALCV if kind == SWAP => false,
        CALCV => {
            let place = &mut variables[variable];
            apply(kind, place, &mut constant(*place), flags)
        }
        CALCX => match kind {
            LOAD => {
                *x = *accumulator;
                flags.test(*x);
                true
            }
            0..=SWAP => apply(kind, accumulator, x, flags),
            _ => false,
        },
        CALCVV => match usize::try_from(value) {
            Ok(second) if second < VARIABLES => {
                let mut source = variables[second];
                let mut destination = variables[variable];
                let done = apply(kind, &mut destination, &mut source, flags);
                variables[second] = source;
                variables[variable] = destination;
                done
            }
            _ => return Some(Err(Status::INVALID_VALUE)),
        },
        CALCVA => apply(kind, &mut variables[variable], accumulator, flags),
        CALCAV => apply(kind, accumulator, &mut variables[variable], flags),
        CALCVX => apply(kind, &mut variables[variable], x, flags),
        CALCXV => apply(kind, x, &mut variables[variable], flags),
        // An index outside the variables is ignored (firmware manual 3.6.53..55).
        SIV => {
            if let Some(place) = indexed(variables, *x) {
                *place = value;
            }
            true
        }
        GIV => {
            if let Some(place) = indexed(variables, *x) {
                *accumulator = *place;
                flags.test(*accumulator);
            }
            true
        }
        AIV => {
            if let Some(place) = indexed(variables, *x) {
                *place = *accumulator;
            }
            true
        }
        _ => return None,
    };
    Some(if done { Ok(()) } else { Err(Status::WRONG_TYPE) })
}

fn indexed(variables: &mut [i32; VARIABLES], index: i32) -> Option<&mut i32> {
    variables.get_mut(usize::try_from(index).ok()?)
}

#[inline(always)]
fn apply(operation: u8, destination: &mut i32, source: &mut i32, flags: &mut Flags) -> bool {
    match arithmetic::operate(operation, *destination, *source) {
        Some(arithmetic::Effect::Assign(result)) => {
            *destination = result;
            flags.test(result);
        }
        Some(arithmetic::Effect::Swap) => {
            core::mem::swap(destination, source);
            flags.test(*destination);
        }
        Some(arithmetic::Effect::Compare) => flags.compare(*destination, *source),
        None => return false,
    }
    true
}
