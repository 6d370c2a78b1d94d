//! What can go wrong with a program on its way, in words.

use std::fmt;

use opentmcl_wire::serial::FRAME_LEN;
use opentmcl_wire::{Command, Status, control};

use super::Mode;
use crate::connection::ConnectionError;

/// What was being done when something went wrong.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Step {
    /// Asking which module it is.
    Identify,
    /// Entering download mode at an address.
    StartDownload(u16),
    /// Storing a command at an address.
    Store(u16, Command),
    /// Leaving download mode.
    EndDownload,
    /// Reading the command at an address.
    Read(u16),
    /// Starting the program where it stands, or at an address.
    Run(Option<u16>),
    /// Stopping it.
    Stop,
    /// Executing one command of it.
    Step,
    /// Resetting it.
    Reset,
    /// Asking for its state, with the type of command 135.
    State(u8),
    /// Reading a global parameter of bank 0.
    GetParameter(u8),
    /// Setting a global parameter of bank 0.
    SetParameter(u8, i32),
}

impl Step {
    /// The command that does it.
    pub const fn command(self) -> Command {
        const SGP: u8 = opentmcl_wire::Opcode::Sgp.number();
        const GGP: u8 = opentmcl_wire::Opcode::Ggp.number();
        match self {
            Self::Identify => Command::new(control::FIRMWARE_VERSION, 1, 0, 0),
            Self::StartDownload(address) => {
                Command::new(control::START_DOWNLOAD, 0, 0, address as i32)
            }
            Self::Store(_, command) => command,
            Self::EndDownload => Command::new(control::END_DOWNLOAD, 0, 0, 0),
            Self::Read(address) => Command::new(control::READ_PROGRAM, 0, 0, address as i32),
            Self::Run(None) => Command::new(control::RUN_PROGRAM, 0, 0, 0),
            Self::Run(Some(address)) => Command::new(control::RUN_PROGRAM, 1, 0, address as i32),
            Self::Stop => Command::new(control::STOP_PROGRAM, 0, 0, 0),
            Self::Step => Command::new(control::STEP_PROGRAM, 0, 0, 0),
            Self::Reset => Command::new(control::RESET_PROGRAM, 0, 0, 0),
            Self::State(kind) => Command::new(control::APPLICATION_STATUS, kind, 0, 0),
            Self::GetParameter(number) => Command::new(GGP, number, 0, 0),
            Self::SetParameter(number, value) => Command::new(SGP, number, 0, value),
        }
    }
}

impl fmt::Display for Step {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Identify => write!(f, "asking for the type of the module"),
            Self::StartDownload(address) => write!(f, "starting the download at address {address}"),
            Self::Store(address, command) => write!(f, "storing {command} at address {address}"),
            Self::EndDownload => write!(f, "leaving download mode"),
            Self::Read(address) => write!(f, "reading the command at address {address}"),
            Self::Run(None) => write!(f, "starting the program"),
            Self::Run(Some(address)) => write!(f, "starting the program at address {address}"),
            Self::Stop => write!(f, "stopping the program"),
            Self::Step => write!(f, "executing one command of the program"),
            Self::Reset => write!(f, "resetting the program"),
            Self::State(_) => write!(f, "asking for the state of the program"),
            Self::GetParameter(number) => write!(f, "reading global parameter {number}"),
            Self::SetParameter(number, value) => {
                write!(f, "setting global parameter {number} to {value}")
            }
        }?;
        write!(f, " (command {})", self.command().number)
    }
}

/// Why it was not known what had become of a request.
#[derive(Debug, thiserror::Error)]
pub enum Doubt {
    /// No reply, a part of one, or a damaged one.
    #[error("{0}")]
    Line(ConnectionError),
    /// The module received it damaged, and has not executed it.
    #[error(
        "the request arrived damaged: the module answers with status {}",
        Status::WRONG_CHECKSUM
    )]
    DamagedRequest,
    /// The reply belongs to another command, with this number.
    #[error("the reply belongs to command {0}")]
    OtherReply(u8),
    /// The reply is signed with other addresses than the module's.
    #[error("the reply does not come from this module: {0:02X?}")]
    OtherSender([u8; FRAME_LEN]),
    /// The reply can be read in two ways, and the next one was different.
    #[error("two replies to the same question differ")]
    Ambiguous,
    /// The module acknowledges another value than was sent.
    #[error("the reply has the value {found} instead of {expected}")]
    OtherValue {
        /// What was sent.
        expected: i32,
        /// What came back.
        found: i32,
    },
}

impl Doubt {
    /// Whether the reply may be the late one to an earlier request.
    pub(super) fn is_late(&self) -> bool {
        matches!(self, Self::OtherReply(_) | Self::OtherSender(_))
    }
}

/// Why a program could not be transferred, or was not controlled.
#[derive(Debug, thiserror::Error)]
pub enum TransferError {
    /// The connection is lost.
    #[error(transparent)]
    Connection(#[from] ConnectionError),
    /// A request could not be got through.
    #[error("{step} failed in {attempts} attempts; at last: {doubt}")]
    NoAnswer {
        /// What was being done.
        step: Step,
        /// How often it was tried.
        attempts: u32,
        /// What was wrong with the last attempt.
        doubt: Doubt,
    },
    /// The module does not want to.
    #[error("{step}: the module answers with status {status}")]
    Refused {
        /// What was being done.
        step: Step,
        /// Why not.
        status: Status,
    },
    /// The module was not in download mode and has executed a command of the program.
    #[error(
        "the module executed {command}, which was to be stored at address {address}: it has left \
         download mode"
    )]
    Executed {
        /// Where it was to be stored.
        address: u16,
        /// What was executed.
        command: Command,
    },
    /// The program does not fit.
    #[error("the program has {commands} commands, the module's memory holds {memory}")]
    TooLong {
        /// Length of the program.
        commands: usize,
        /// Length of the memory.
        memory: usize,
    },
    /// The program has a command that would be executed during the download.
    #[error("command {} at address {address} cannot be part of a program", .command.number)]
    NotStorable {
        /// Where it stands.
        address: u16,
        /// Which one.
        command: Command,
    },
    /// The module has something else in its memory.
    #[error("address {address} holds {found} instead of {expected}")]
    Different {
        /// The first address with a difference.
        address: u16,
        /// What was to be there.
        expected: Command,
        /// What is there.
        found: Command,
    },
    /// The module has not kept a global parameter.
    #[error("global parameter {parameter} was set to {value} and reads {found}")]
    NotKept {
        /// Its number, in bank 0.
        parameter: u8,
        /// What it was set to.
        value: i32,
        /// What it reads.
        found: i32,
    },
    /// A step was sent and may have been executed or not.
    #[error(
        "it is not known whether the step was executed: {doubt}; the program stands at address \
         {address}, mode {mode}, as before"
    )]
    Unknown {
        /// Where the program stands.
        address: u16,
        /// What it does.
        mode: Mode,
        /// What was wrong.
        doubt: Doubt,
    },
}

impl TransferError {
    /// What the user can do about it.
    pub fn help(&self) -> String {
        match self {
            Self::Connection(error) => error.help(),
            Self::NoAnswer { step: Step::Store(..) | Step::EndDownload, .. } => {
                "check cable, termination and bit rate (?baud=N); the program on the module is not \
                 complete, so download it again before it runs"
                    .into()
            }
            Self::NoAnswer { doubt: Doubt::Line(ConnectionError::Timeout(_)), .. } => {
                "check cable, power and termination, the address of the module (--address), and on \
                 RS485 and RS232 its bit rate (?baud=N)"
                    .into()
            }
            Self::NoAnswer { .. } => {
                "check cable, termination and bit rate (?baud=N), and that no \
                                      other program talks to the module"
                    .into()
            }
            // The manual names no status; modules of this family answer with one of these.
            Self::Refused { step: Step::StartDownload(_), status: Status(5 | 8 | 10) } => {
                "the program on the module may be protected against overwriting: global parameter \
                 81 is then 2 or 3, and `tmcl exec -c URI 'SGP 81, 0, 0'` lifts the protection; if \
                 it was 3, this erases the program"
                    .into()
            }
            Self::Refused { status: Status::LOADED, .. } => {
                "the module is in download mode, and another program may be downloading; otherwise \
                 `tmcl exec -c URI '133 0, 0, 0'` ends it"
                    .into()
            }
            Self::Refused { step: Step::Store(..) | Step::EndDownload, .. } => {
                "the program on the module is not complete; does the module have this command, and \
                 memory for so long a program?"
                    .into()
            }
            Self::Refused { step, .. } => {
                format!("does the module have command {}?", step.command().number)
            }
            Self::Executed { .. } => {
                "was it switched off, or does another program talk to it? See \
                                      whether a motor turns, then download again"
                    .into()
            }
            Self::TooLong { .. } => "shorten it, for example with subroutines (CSUB, RSUB)".into(),
            Self::NotStorable { .. } => "commands from 128 on are for hosts only, and a module \
                                         executes them at once; is this a TMCL program?"
                .into(),
            Self::Different { .. } => {
                "does another program talk to the module? What it sends during a download is \
                 stored, too; end it and download again, and if it stays so, check the line"
                    .into()
            }
            Self::NotKept { .. } => "does the module have this parameter?".into(),
            Self::Unknown { .. } => {
                "look with `tmcl status -c URI`, then step again if the program is to go on".into()
            }
        }
    }
}
