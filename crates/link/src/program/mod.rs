//! Programs on a module: download, read back, run, stop, step, reset (firmware manual 3.6.58).
//!
//! A line loses and garbles bytes, and a module never asks twice. A [`Programmer`] gets every request
//! through once, or says that it could not:
//!
//! - **Doubt.** No reply, a part of one, or a damaged one leaves it open whether the module has
//!   executed the request. A reply with status 1 says that it has not.
//! - **Getting into step.** After any of these the line must be silent for a while. The module's
//!   receiver drops a frame that has begun after 5 ms, and what is late arrives here and is dropped.
//!   Then a command is exchanged whose reply cannot be taken for another: replies keep their order,
//!   so once it is here, none to an earlier request is on its way any more.
//! - **Repeating.** Most commands do the same when they are executed twice. Three kinds do not:
//!   - During a download, a command is stored at the address that follows. Command 132 goes to an
//!     address, so in doubt the download goes back with it: whether the command has been stored
//!     before or not, it then is at its place, and the next one comes behind it.
//!   - 129 (run) and 130 (step): before and after, the module is asked where the program stands. See
//!     [`Programmer::run`] and [`Programmer::step`].
//!
//! A reply also is checked for what a checksum of eight bits lets pass: the addresses and the command
//! number in it, and the value that a module returns of a command that it has stored.
//!
//! The state of the program is asked for with command 135 and not with the global parameters that
//! say the same: a module that is in download mode would store a `GGP` as a part of the program,
//! while control commands are always executed.

mod control;
mod download;
mod error;
mod exchange;
mod read;

use opentmcl_wire::{Command, Reply};

pub use control::{Mode, Registers, State};
pub use error::{Doubt, Step, TransferError};

use crate::connection::Connection;

/// Attempts that are made to get one command through.
pub const ATTEMPTS: u32 = 3;

/// Marks the end of a program in the module's memory.
pub const END_MARK: Command = Command::new(0, 0, 0, 0);

/// A host that is in step with one module and deals with its program.
pub struct Programmer<'a> {
    connection: &'a mut dyn Connection,
    /// Address that requests carry.
    address: u8,
    /// Commands that program memory holds.
    memory: usize,
    /// The addresses in the module's replies, from the first one on.
    signature: Option<Signature>,
    identity: Option<Identity>,
    /// Whether the reply to a stored command returns its value; unknown modules may not.
    echoes: bool,
}

/// With which addresses a module signs its replies: global parameters 76 and 66. The latter need not
/// be the address that requests carry, which means nothing by USB.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
struct Signature {
    host: u8,
    module: u8,
}

/// What a module says of itself (command 136).
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Identity {
    /// Number of the module, for example 6214.
    pub number: u16,
    /// Firmware version, major and minor.
    pub firmware: (u8, u8),
}

/// What may not be done with the program (global parameter 81).
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Protection {
    /// It cannot be read.
    pub reading: bool,
    /// It cannot be overwritten.
    pub overwriting: bool,
}

const AUTO_START: u8 = 77;
const CODE_PROTECTION: u8 = 81;

impl<'a> Programmer<'a> {
    /// Gets into step with the module at this address, whose program memory holds `memory`
    /// commands.
    ///
    /// # Errors
    /// When it does not answer.
    pub fn open(
        connection: &'a mut dyn Connection,
        address: u8,
        memory: usize,
    ) -> Result<Self, TransferError> {
        let (signature, identity) = (None, None);
        let mut programmer =
            Self { connection, address, memory, signature, identity, echoes: true };
        let step = Step::Identify;
        let answer = programmer.insist(step, |host, _| host.once(step.command()))?;
        programmer.signature = Some(Signature { host: answer.host, module: answer.module });
        programmer.identity = Identity::read(answer.reply);
        Ok(programmer)
    }

    /// What the module says of itself, if it can.
    pub fn identity(&self) -> Option<Identity> {
        self.identity
    }

    /// What may not be done with the program. Ends a download that somebody left unfinished, since
    /// the question would otherwise become a part of it.
    ///
    /// # Errors
    /// When the module does not answer. One that has no such parameter protects nothing.
    pub fn protection(&mut self) -> Result<Protection, TransferError> {
        self.ask(Step::EndDownload)?;
        let value = match self.ask(Step::GetParameter(CODE_PROTECTION)) {
            Ok(value) => value,
            Err(TransferError::Refused { .. }) => 0,
            Err(error) => return Err(error),
        };
        Ok(Protection { reading: value & 1 != 0, overwriting: value & 2 != 0 })
    }

    /// Sets whether the module starts its program at power-up, and reads it back.
    ///
    /// # Errors
    /// When the module does not answer, refuses it, or has not kept it.
    pub fn set_auto_start(&mut self, on: bool) -> Result<(), TransferError> {
        let value = i32::from(on);
        self.ask(Step::EndDownload)?;
        self.ask(Step::SetParameter(AUTO_START, value))?;
        let found = self.ask(Step::GetParameter(AUTO_START))?;
        if found == value {
            Ok(())
        } else {
            Err(TransferError::NotKept { parameter: AUTO_START, value, found })
        }
    }
}

impl Identity {
    /// From the reply to command 136 type 1.
    fn read(reply: Reply) -> Option<Self> {
        let [number @ .., major, minor] = reply.value.to_be_bytes();
        let number = u16::from_be_bytes(number);
        reply.status.is_ok().then_some(Self { number, firmware: (major, minor) })
    }
}
