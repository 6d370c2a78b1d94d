//! Registers of the TMCL interpreter: what a running program is, beside its text.

use core::cmp::Ordering;

use opentmcl_wire::Instant;
use opentmcl_wire::limits::{PROGRAM_LEN, STACK_DEPTH};

/// What the interpreter does, with the numbers of global parameter 128.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Mode {
    /// Stands still.
    #[default]
    Stop = 0,
    /// Executes one command after the other.
    Run = 1,
    /// Executes as many commands as it was asked to, one by one, and then stands still.
    Step = 2,
    /// Stands still at address 0 after a reset.
    Reset = 3,
}

/// Error flags that JC tests and CLE clears.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct ErrorFlags(u8);

impl ErrorFlags {
    /// A WAIT has ended by its time-out (ETO).
    pub const TIMEOUT: u8 = 1;
    /// External alarm (EAL).
    pub const ALARM: u8 = 2;
    /// Motor and encoder deviate (EDV).
    pub const DEVIATION: u8 = 4;
    /// Position error (EPO).
    pub const POSITION: u8 = 8;
    /// The driver has shut down (ESD).
    pub const SHUTDOWN: u8 = 16;
    pub(crate) const ALL: u8 = 31;

    pub(crate) fn set(&mut self, flag: u8) {
        self.0 |= flag;
    }

    pub(crate) fn clear(&mut self, flags: u8) {
        self.0 &= !flags;
    }

    /// Whether this flag is set.
    pub const fn has(self, flag: u8) -> bool {
        self.0 & flag != 0
    }
}

/// The flags: the last comparison and result, kept as the values themselves, and the errors.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Flags {
    /// Left side of the last comparison.
    left: i32,
    /// Right side of the last comparison.
    right: i32,
    /// What ZE and NZ test: the last value read or calculated, or whether a comparison differed.
    tested: i32,
    pub(crate) errors: ErrorFlags,
}

impl Flags {
    #[inline]
    pub(crate) fn compare(&mut self, left: i32, right: i32) {
        self.left = left;
        self.right = right;
        self.tested = left ^ right;
    }

    /// A value has been read or calculated. Only ZE and NZ see it: in the manual's example of CALL
    /// (3.6.42) the outcome of a comparison outlives a calculation.
    #[inline]
    pub(crate) fn test(&mut self, value: i32) {
        self.tested = value;
    }

    /// Whether the last value read or calculated was 0, or the last comparison was of equal values,
    /// whichever came last: what ZE tests.
    pub const fn is_zero(self) -> bool {
        self.tested == 0
    }

    /// How the left side of the last comparison compares to the right one: what EQ to LE test.
    pub fn comparison(self) -> Ordering {
        self.left.cmp(&self.right)
    }

    /// The error flags.
    pub const fn errors(self) -> ErrorFlags {
        self.errors
    }

    /// Whether the condition with this number holds; no condition has a number above 12.
    #[inline]
    pub(crate) const fn condition(self, number: u8) -> Option<bool> {
        let Self { left, right, tested, errors } = self;
        Some(match number {
            0 => tested == 0,
            1 => tested != 0,
            2 => left == right,
            3 => left != right,
            4 => left > right,
            5 => left >= right,
            6 => left < right,
            7 => left <= right,
            8 => errors.has(ErrorFlags::TIMEOUT),
            9 => errors.has(ErrorFlags::ALARM),
            10 => errors.has(ErrorFlags::DEVIATION),
            11 => errors.has(ErrorFlags::POSITION),
            12 => errors.has(ErrorFlags::SHUTDOWN),
            _ => return None,
        })
    }
}

/// A WAIT that has begun.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Wait {
    /// When it began.
    pub(crate) since: Instant,
    /// When it ends by itself: the time waited for, or the time-out.
    pub(crate) deadline: Option<Instant>,
    /// When to look at its condition although no event is foreseen: after something else has
    /// happened that may have fulfilled it.
    pub(crate) look_at: Option<Instant>,
}

/// What an interrupt puts aside.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Context {
    accumulator: i32,
    x: i32,
    flags: Flags,
    pc: u16,
    wait: Option<Wait>,
}

/// The interpreter's registers.
#[derive(Clone, Debug)]
pub(crate) struct Cpu {
    pub(crate) mode: Mode,
    /// Commands still to execute in [`Mode::Step`].
    pub(crate) steps: u32,
    /// Address of the next command; `PROGRAM_LEN` past the last one.
    pub(crate) pc: u16,
    pub(crate) accumulator: i32,
    pub(crate) x: i32,
    pub(crate) flags: Flags,
    /// Time at which the next command is due, if one is.
    pub(crate) next_at: Instant,
    /// The WAIT at `pc`, if it has begun.
    pub(crate) wait: Option<Wait>,
    /// The program that an interrupt handler interrupts.
    interrupted: Option<Context>,
    stack: [u16; STACK_DEPTH],
    depth: u8,
}

impl Cpu {
    pub(crate) fn new(now: Instant) -> Self {
        Self {
            mode: Mode::Stop,
            steps: 0,
            pc: 0,
            accumulator: 0,
            x: 0,
            flags: Flags::default(),
            next_at: now,
            wait: None,
            interrupted: None,
            stack: [0; STACK_DEPTH],
            depth: 0,
        }
    }

    /// Whether commands are being executed.
    pub(crate) fn is_active(&self) -> bool {
        match self.mode {
            Mode::Run => true,
            Mode::Step => self.steps > 0,
            Mode::Stop | Mode::Reset => false,
        }
    }

    /// Clears the registers, the stack and a pending interrupt return (131, RST).
    pub(crate) fn reset(&mut self) {
        *self = Self { mode: self.mode, next_at: self.next_at, ..Self::new(self.next_at) };
    }

    /// Goes to an address from outside the program: what was under way, calls and an interrupt handler
    /// included, is given up. The registers stay.
    pub(crate) fn start_at(&mut self, address: u16) {
        self.pc = address;
        self.depth = 0;
        self.interrupted = None;
        self.wait = None;
    }

    /// Stands still, by command or at the end of the program.
    pub(crate) fn stop(&mut self) {
        self.mode = Mode::Stop;
        self.steps = 0;
        self.wait = None;
    }

    /// Goes to an address; outside program memory the program ends and stands at 0.
    #[inline]
    pub(crate) fn jump(&mut self, address: i32) {
        match u16::try_from(address) {
            Ok(address) if usize::from(address) < PROGRAM_LEN => self.pc = address,
            _ => self.leave(),
        }
    }

    #[cold]
    fn leave(&mut self) {
        self.pc = 0;
        self.stop();
    }

    /// Goes on behind the current command.
    #[inline]
    pub(crate) fn advance(&mut self) {
        let next = self.pc.wrapping_add(1);
        if usize::from(next) < PROGRAM_LEN { self.pc = next } else { self.leave() }
    }

    /// Calls a subroutine; ignored, and false, when the stack is full.
    #[inline]
    pub(crate) fn call(&mut self, address: i32) -> bool {
        match self.stack.get_mut(usize::from(self.depth)) {
            Some(place) => {
                *place = self.pc + 1;
                self.depth += 1;
                self.jump(address);
                true
            }
            None => {
                self.advance();
                false
            }
        }
    }

    /// Returns from a subroutine; ignored, and false, when there is nothing to return to.
    #[inline]
    pub(crate) fn return_from_subroutine(&mut self) -> bool {
        let depth = usize::from(self.depth).wrapping_sub(1);
        match self.stack.get(depth) {
            Some(&address) => {
                self.depth -= 1;
                self.jump(i32::from(address));
                true
            }
            None => {
                self.advance();
                false
            }
        }
    }

    /// Subroutines under way.
    pub(crate) fn depth(&self) -> u8 {
        self.depth
    }

    /// Whether an interrupt handler is being executed.
    pub(crate) fn in_interrupt(&self) -> bool {
        self.interrupted.is_some()
    }

    /// Puts the program aside and goes to an interrupt handler.
    pub(crate) fn enter_interrupt(&mut self, address: u16) {
        self.interrupted = Some(Context {
            accumulator: self.accumulator,
            x: self.x,
            flags: self.flags,
            pc: self.pc,
            wait: self.wait.take(),
        });
        self.jump(i32::from(address));
    }

    /// Takes the program up again; ignored, and false, outside a handler.
    pub(crate) fn return_from_interrupt(&mut self, now: Instant) -> bool {
        match self.interrupted.take() {
            Some(context) => {
                self.accumulator = context.accumulator;
                self.x = context.x;
                self.flags = context.flags;
                self.pc = context.pc;
                self.wait = context.wait;
                self.look_again(now);
                true
            }
            None => {
                self.advance();
                false
            }
        }
    }

    /// Something has happened that may have ended a WAIT.
    pub(crate) fn look_again(&mut self, now: Instant) {
        if let Some(wait) = &mut self.wait {
            wait.look_at = Some(now);
        }
    }
}
