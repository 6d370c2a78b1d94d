//! One request and its reply: doubts, getting into step, and the attempts that are made.

use std::time::Duration;

use opentmcl_wire::serial::{self, AddressedReply, FRAME_LEN};
use opentmcl_wire::{Command, Status};

use super::{ATTEMPTS, Doubt, Programmer, Signature, Step, TransferError};
use crate::connection::ConnectionError;

/// How long the line must be silent to begin anew: far more than the 5 ms of the module's
/// receiver, for adapters and systems that pass bytes on late. It grows with the attempts.
pub(super) const SILENCE: Duration = Duration::from_millis(50);

/// Frames that are received at most while waiting for silence; on a line that never falls silent the
/// next attempt shows what is wrong.
const STALE_FRAMES: usize = 32;

/// Replies that may be late: no more requests are made in all attempts for one command.
const LATE_REPLIES: usize = 12;

/// Why an attempt has failed.
pub(super) enum Failed {
    /// Another one may succeed.
    Doubt(Doubt),
    /// No other one would.
    Finally(TransferError),
}

impl From<TransferError> for Failed {
    fn from(error: TransferError) -> Self {
        Self::Finally(error)
    }
}

impl From<ConnectionError> for Failed {
    fn from(error: ConnectionError) -> Self {
        match error {
            ConnectionError::Timeout(_)
            | ConnectionError::Fragment(_)
            | ConnectionError::DamagedReply(_) => Self::Doubt(Doubt::Line(error)),
            lost => Self::Finally(lost.into()),
        }
    }
}

impl Programmer<'_> {
    /// Makes attempts until one succeeds. `attempt` is told what was wrong with the one before it;
    /// the line has been silent since then.
    pub(super) fn insist<T>(
        &mut self,
        step: Step,
        mut attempt: impl FnMut(&mut Self, Option<Doubt>) -> Result<T, Failed>,
    ) -> Result<T, TransferError> {
        let mut before = None;
        let mut attempts = 0;
        loop {
            let doubt = match attempt(self, before.take()) {
                Ok(value) => return Ok(value),
                Err(Failed::Finally(error)) => return Err(error),
                Err(Failed::Doubt(doubt)) => doubt,
            };
            attempts += 1;
            if attempts == ATTEMPTS {
                return Err(TransferError::NoAnswer { step, attempts, doubt });
            }
            self.wait_for_silence(SILENCE * attempts)?;
            before = Some(doubt);
        }
    }

    pub(super) fn wait_for_silence(&mut self, silence: Duration) -> Result<(), TransferError> {
        for _ in 0..STALE_FRAMES {
            match self.connection.receive(silence) {
                Ok(None) => break,
                Ok(Some(_)) | Err(ConnectionError::Fragment(_)) => {}
                Err(error) => return Err(error.into()),
            }
        }
        Ok(())
    }

    /// Asks what may be asked as often as one likes, and returns the value of the reply.
    pub(super) fn ask(&mut self, step: Step) -> Result<i32, TransferError> {
        self.insist(step, |host, before| {
            if before.is_some() {
                host.pass_marker()?;
            }
            host.once_ok(step)
        })
    }

    /// Sends a request once and returns the value of the reply, if it was executed.
    pub(super) fn once_ok(&mut self, step: Step) -> Result<i32, Failed> {
        let AddressedReply { reply, .. } = self.once(step.command())?;
        if reply.status == Status::OK {
            Ok(reply.value)
        } else {
            Err(TransferError::Refused { step, status: reply.status }.into())
        }
    }

    /// Exchanges a command whose reply is the same each time and cannot be taken for another one. All
    /// replies before it are late, even one that reads as if a request had been damaged: a command of
    /// the program, in the reply to 134, may have the same bytes.
    pub(super) fn pass_marker(&mut self) -> Result<(), Failed> {
        let (command, signature) = (Step::Identify.command(), self.signature);
        let read = |frame| read_reply(frame, command, signature);
        let is_late = |doubt: &Doubt| doubt.is_late() || matches!(doubt, Doubt::DamagedRequest);
        self.exchange(command, read, is_late).map(drop)
    }

    /// Sends a request once and returns its reply, if there is one that is surely that.
    pub(super) fn once(&mut self, command: Command) -> Result<AddressedReply, Failed> {
        let signature = self.signature;
        self.exchange(command, |frame| read_reply(frame, command, signature), Doubt::is_late)
    }

    /// Sends a request once and returns what `read` makes of its reply. Replies that are late are
    /// passed over: this one comes behind them.
    pub(super) fn exchange<T>(
        &mut self,
        command: Command,
        read: impl Fn([u8; FRAME_LEN]) -> Result<T, Doubt>,
        is_late: impl Fn(&Doubt) -> bool,
    ) -> Result<T, Failed> {
        self.connection.discard()?;
        self.connection.send(&serial::encode_request(self.address, command))?;
        let timeout = self.connection.timeout();
        let mut doubt = Doubt::Line(ConnectionError::Timeout(timeout));
        for _ in 0..=LATE_REPLIES {
            let Some(frame) = self.connection.receive(timeout)? else { break };
            match read(frame) {
                Err(late) if is_late(&late) => doubt = late,
                result => return result.map_err(Failed::Doubt),
            }
        }
        Err(Failed::Doubt(doubt))
    }
}

/// Reads the reply to a command, from a module that signs its replies so, if that is known.
fn read_reply(
    frame: [u8; FRAME_LEN],
    command: Command,
    signature: Option<Signature>,
) -> Result<AddressedReply, Doubt> {
    let Ok(answer) = serial::decode_reply(frame) else {
        return Err(Doubt::Line(ConnectionError::DamagedReply(frame)));
    };
    let sender = Signature { host: answer.host, module: answer.module };
    match answer.reply {
        // A late reply to 134, or a stray byte and the beginning of a reply with, by chance, a
        // correct checksum.
        _ if signature.is_some_and(|signature| signature != sender) => {
            Err(Doubt::OtherSender(frame))
        }
        reply if reply.status == Status::WRONG_CHECKSUM => Err(Doubt::DamagedRequest),
        reply if reply.number != command.number => Err(Doubt::OtherReply(reply.number)),
        _ => Ok(answer),
    }
}
