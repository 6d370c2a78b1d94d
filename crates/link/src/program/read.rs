//! From the module's program memory to the host.
//!
//! The reply to command 134 has neither status nor address: the command of the program stands where
//! other replies have module address, status and command number. So it has to be told from a
//! refusal, from the answer to a damaged request, and from the late reply to another request.

use opentmcl_wire::serial::{self, FRAME_LEN, Request};
use opentmcl_wire::{Command, Status, control};

use super::exchange::{Failed, SILENCE};
use super::{Doubt, END_MARK, Programmer, Signature, Step, TransferError};
use crate::connection::ConnectionError;

/// What nine bytes with a correct checksum say in answer to command 134.
#[derive(PartialEq, Eq)]
enum Answer {
    Stored(Command),
    Refusal(Status),
    /// A command of the program, or something else with the same bytes.
    Ambiguous(Command),
}

impl Programmer<'_> {
    /// Reads the program from address 0 up to the end mark, which is not returned, or to the end of
    /// the memory. `progress` is told how many commands have been read.
    ///
    /// A module whose program is [protected](Programmer::protection) against it may show an empty
    /// memory.
    ///
    /// # Errors
    /// When the module does not answer or refuses address 0.
    pub fn read(&mut self, progress: &mut dyn FnMut(usize)) -> Result<Vec<Command>, TransferError> {
        let mut commands = Vec::new();
        for address in (0..=u16::MAX).take(self.memory) {
            match self.read_at(address) {
                Ok(command) if command.number == END_MARK.number => break,
                Ok(command) => commands.push(command),
                // A module with less memory.
                Err(TransferError::Refused { status: Status::INVALID_VALUE, .. })
                    if address > 0 =>
                {
                    break;
                }
                Err(error) => return Err(error),
            }
            progress(commands.len());
        }
        Ok(commands)
    }

    /// Reads a program back and compares it, end mark included.
    ///
    /// # Errors
    /// The first address at which the module has something else; when it does not answer or refuses
    /// an address.
    pub fn verify(
        &mut self,
        commands: &[Command],
        progress: &mut dyn FnMut(usize),
    ) -> Result<(), TransferError> {
        let expected = commands.iter().chain([&END_MARK]).take(self.memory);
        for (address, &expected) in (0..).zip(expected) {
            let found = self.read_at(address)?;
            if found != expected {
                return Err(TransferError::Different { address, expected, found });
            }
            progress(commands.len().min(usize::from(address) + 1));
        }
        Ok(())
    }

    /// Looks whether the last command of a program that was just stored and the end mark are where
    /// they should be. What another host has sent during the download was stored, too, and has moved
    /// them: two requests find what nobody would notice otherwise.
    ///
    /// # Errors
    /// As [`Programmer::verify`].
    pub fn verify_end(&mut self, commands: &[Command]) -> Result<(), TransferError> {
        let expected = (0..).zip(commands.iter().chain([&END_MARK]).take(self.memory));
        for (address, &expected) in expected.skip(commands.len().saturating_sub(1)) {
            let found = self.read_at(address)?;
            if found != expected {
                return Err(TransferError::Different { address, expected, found });
            }
        }
        Ok(())
    }

    /// The command of the program at an address; none behind the end of the program, and where a
    /// [protected](Programmer::protection) module shows nothing.
    ///
    /// # Errors
    /// When the module does not answer.
    pub fn command_at(&mut self, address: u16) -> Result<Option<Command>, TransferError> {
        match self.read_at(address) {
            Ok(command) => Ok(Some(command).filter(|command| command.number != END_MARK.number)),
            Err(TransferError::Refused { .. }) => Ok(None),
            Err(error) => Err(error),
        }
    }

    pub(super) fn read_at(&mut self, address: u16) -> Result<Command, TransferError> {
        let step = Step::Read(address);
        self.insist(step, |host, doubt| {
            if doubt.is_some() {
                host.pass_marker()?;
            }
            match host.answer_to(step)? {
                Answer::Stored(command) => Ok(command),
                Answer::Refusal(status) => Err(TransferError::Refused { step, status }.into()),
                first @ Answer::Ambiguous(command) => {
                    // Twice in a row is not the line's fault.
                    host.wait_for_silence(SILENCE)?;
                    host.pass_marker()?;
                    if host.answer_to(step)? == first {
                        Ok(command)
                    } else {
                        Err(Failed::Doubt(Doubt::Ambiguous))
                    }
                }
            }
        })
    }

    fn answer_to(&mut self, step: Step) -> Result<Answer, Failed> {
        let signature = self.signature;
        self.exchange(step.command(), |frame| classify(frame, signature), Doubt::is_late)
    }
}

/// What a reply from a module says that signs its replies so.
fn classify(frame: [u8; FRAME_LEN], signature: Option<Signature>) -> Result<Answer, Doubt> {
    let damaged = Doubt::Line(ConnectionError::DamagedReply(frame));
    let Ok(Request { command: stored, .. }) = serial::decode_request(frame) else {
        return Err(damaged);
    };
    let Some(Signature { host, module }) = signature else { return Err(damaged) };
    // Where other replies have the address of the module, the status and the command number.
    let (sender, status, number) = (stored.number, Status(stored.kind), stored.motor);
    // In a program only the commands that calculate with two variables have a control command's
    // number for a motor. None of them has the type 100; and to be taken for a refusal, its own
    // number would have to be the address of the module.
    Ok(match number {
        control::READ_PROGRAM if sender == module && !status.is_ok() => Answer::Refusal(status),
        control::FIRST.. if sender == module && status == Status::OK => {
            return Err(Doubt::OtherReply(number));
        }
        // The answer to a damaged request.
        0 if sender == module && status == Status::WRONG_CHECKSUM => Answer::Ambiguous(stored),
        // A stray byte and the beginning of the reply.
        _ if sender == host => Answer::Ambiguous(stored),
        _ => Answer::Stored(stored),
    })
}
