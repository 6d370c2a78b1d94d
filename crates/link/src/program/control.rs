//! Running, stopping and looking at the program on a module.

use std::fmt;

use opentmcl_wire::{Command, Opcode};

use super::exchange::Failed;
use super::{Doubt, Programmer, Step, TransferError};

/// What the interpreter does (firmware manual, global parameter 128).
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Mode {
    /// It stands still.
    Stopped,
    /// It executes the program.
    Running,
    /// It has been sent on by single steps.
    Stepping,
    /// It stands at the beginning after a reset.
    Reset,
    /// A number that the manual does not know.
    Other(u8),
}

impl From<u8> for Mode {
    fn from(number: u8) -> Self {
        match number {
            0 => Self::Stopped,
            1 => Self::Running,
            2 => Self::Stepping,
            3 => Self::Reset,
            other => Self::Other(other),
        }
    }
}

impl fmt::Display for Mode {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Stopped => f.write_str("stopped"),
            Self::Running => f.write_str("running"),
            Self::Stepping => f.write_str("single step"),
            Self::Reset => f.write_str("reset"),
            Self::Other(number) => write!(f, "unknown ({number})"),
        }
    }
}

/// Where a program stands.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct State {
    /// What the interpreter does.
    pub mode: Mode,
    /// Whether it is in a WAIT.
    pub waiting: bool,
    /// Address of the command that comes next.
    pub address: u16,
}

impl State {
    /// From the reply to command 135 type 1.
    fn read(value: i32) -> Self {
        let [mode, wait, high, low] = value.to_be_bytes();
        Self { mode: mode.into(), waiting: wait & 1 != 0, address: u16::from_be_bytes([high, low]) }
    }

    /// Whether an interpreter that stood here before still does. A WAIT may have ended meanwhile.
    fn is_same_place(self, before: Self) -> bool {
        (self.mode, self.address) == (before.mode, before.address)
    }
}

/// The interpreter's registers.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Registers {
    /// The accumulator, if the module tells it.
    pub accumulator: Option<i32>,
    /// The X register, if the module tells it.
    pub x: Option<i32>,
}

impl Programmer<'_> {
    /// Asks where the program stands.
    ///
    /// # Errors
    /// When the module does not answer or refuses.
    pub fn state(&mut self) -> Result<State, TransferError> {
        Ok(State::read(self.ask(Step::State(1))?))
    }

    /// Asks for the registers; of a running program each is of its own moment.
    ///
    /// # Errors
    /// When the module does not answer.
    pub fn registers(&mut self) -> Result<Registers, TransferError> {
        let mut register = |kind| match self.ask(Step::State(kind)) {
            Ok(value) => Ok(Some(value)),
            Err(TransferError::Refused { .. }) => Ok(None),
            Err(error) => Err(error),
        };
        Ok(Registers { accumulator: register(2)?, x: register(3)? })
    }

    /// Stops the program where it stands.
    ///
    /// # Errors
    /// When the module does not answer or refuses.
    pub fn stop(&mut self) -> Result<(), TransferError> {
        self.ask(Step::Stop).map(drop)
    }

    /// Stops the program and sets it back to its beginning.
    ///
    /// # Errors
    /// When the module does not answer or refuses.
    pub fn reset(&mut self) -> Result<(), TransferError> {
        self.ask(Step::Reset).map(drop)
    }

    /// Starts the program where it stands, or stops it and starts it at an address.
    ///
    /// In doubt whether the module has executed the command, it has if the program runs or has gone
    /// on. If all is as it was before, the command is repeated.
    ///
    /// # Errors
    /// When the module does not answer or refuses.
    pub fn run(&mut self, at: Option<u16>) -> Result<(), TransferError> {
        if at.is_some() {
            // So that a running program is the one that was started.
            self.stop()?;
        }
        self.perform(Step::Run(at), |_, before, now| {
            Ok(if now.is_same_place(before) { Performed::No } else { Performed::Yes })
        })
    }

    /// Executes one command of the program.
    ///
    /// In doubt whether the module has executed the step, it has if the program stands elsewhere or
    /// its mode has changed. If it was in single steps before and still stands at a command that may
    /// stay where it is, such as WAIT, nobody can tell, and the step is not repeated.
    ///
    /// # Errors
    /// When the module does not answer or refuses, or [`TransferError::Unknown`].
    pub fn step(&mut self) -> Result<(), TransferError> {
        self.perform(Step::Step, |host, before, now| {
            Ok(match before.mode {
                Mode::Running if now.mode == Mode::Running => Performed::No,
                _ if !now.is_same_place(before) => Performed::Yes,
                Mode::Stopped | Mode::Reset => Performed::No,
                _ if may_stay(host.read_at(now.address)?, now.address) => Performed::Unknown,
                _ => Performed::No,
            })
        })
    }

    /// Sends what must be executed once. `judge` compares where the program stood before and where
    /// it stands after a doubtful attempt.
    fn perform(
        &mut self,
        step: Step,
        judge: impl Fn(&mut Self, State, State) -> Result<Performed, TransferError>,
    ) -> Result<(), TransferError> {
        let before = self.state()?;
        let mut in_doubt = false;
        self.insist(step, |host, doubt| {
            if let Some(doubt) = doubt.filter(|_| in_doubt) {
                let now = host.state()?;
                match judge(host, before, now)? {
                    Performed::Yes => return Ok(()),
                    Performed::No => {}
                    Performed::Unknown => {
                        let State { mode, address, .. } = now;
                        return Err(TransferError::Unknown { address, mode, doubt }.into());
                    }
                }
            }
            host.once_ok(step).map(drop).inspect_err(|failed| {
                in_doubt = !matches!(failed, Failed::Doubt(Doubt::DamagedRequest));
            })
        })
    }
}

/// Whether the program may stand where it stood after this command has been executed. A protected
/// memory shows command 0, so that says nothing.
fn may_stay(command: Command, address: u16) -> bool {
    match Opcode::from_number(command.number) {
        None | Some(Opcode::Wait | Opcode::Rsub | Opcode::Reti) => true,
        Some(opcode) => opcode.may_jump() && command.value == i32::from(address),
    }
}

/// Whether the module has executed a command whose reply did not come.
enum Performed {
    Yes,
    No,
    Unknown,
}
