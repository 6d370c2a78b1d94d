//! From the host into the module's program memory.

use opentmcl_wire::serial::AddressedReply;
use opentmcl_wire::{Command, Reply, Status, control};

use super::exchange::Failed;
use super::{Doubt, END_MARK, Programmer, Step, TransferError};

impl Programmer<'_> {
    /// Stops what runs and stores a program from address 0, with an end mark behind it where there
    /// is room. `progress` is told how many commands are stored.
    ///
    /// # Errors
    /// Before anything is sent, when the program is too long or has a command that a module never
    /// stores but executes; when a command cannot be got through or is refused. The module then has
    /// left download mode, if it can be reached, with a part of the program in its memory.
    pub fn download(
        &mut self,
        commands: &[Command],
        progress: &mut dyn FnMut(usize),
    ) -> Result<(), TransferError> {
        self.check(commands)?;
        let result = self.store_all(commands, progress);
        if result.is_err() {
            // What comes next would be stored otherwise. If this fails too, the first error tells
            // more.
            let _ = self.once(Step::EndDownload.command());
        }
        result
    }

    /// Whether the module can hold this program.
    fn check(&self, commands: &[Command]) -> Result<(), TransferError> {
        if commands.len() > self.memory {
            return Err(TransferError::TooLong { commands: commands.len(), memory: self.memory });
        }
        let control = (0..).zip(commands).find(|(_, command)| command.number >= control::FIRST);
        match control {
            Some((address, &command)) => Err(TransferError::NotStorable { address, command }),
            None => Ok(()),
        }
    }

    fn store_all(
        &mut self,
        commands: &[Command],
        progress: &mut dyn FnMut(usize),
    ) -> Result<(), TransferError> {
        let stored: Vec<Command> =
            commands.iter().copied().chain([END_MARK]).take(self.memory).collect();
        self.ask(Step::StartDownload(0))?;
        for (address, &command) in (0..).zip(&stored) {
            let mut other = None;
            self.insist(Step::Store(address, command), |host, doubt| {
                if doubt.is_some() {
                    host.go_back(&stored, address, &mut other)?;
                }
                host.store(address, command, &mut other)
            })?;
            progress(commands.len().min(usize::from(address) + 1));
        }
        let end = u16::try_from(stored.len()).unwrap_or(u16::MAX);
        self.insist(Step::EndDownload, |host, doubt| {
            if doubt.is_some() {
                host.go_back(&stored, end, &mut None)?;
            }
            host.once_ok(Step::EndDownload).map(drop)
        })
    }

    /// Goes to an address in the middle of a download, and stores the command before it once more:
    /// a byte that slipped in may have made a wrong command of it, with a correct checksum, and is
    /// noticed only at the request that follows.
    fn go_back(
        &mut self,
        stored: &[Command],
        address: u16,
        other: &mut Option<(u16, i32)>,
    ) -> Result<(), Failed> {
        let before = address.saturating_sub(1);
        self.once_ok(Step::StartDownload(before))?;
        match stored.get(usize::from(before)) {
            Some(&command) if before < address => self.store(before, command, other),
            _ => Ok(()),
        }
    }

    /// Stores a command at the address to which the download has come. `other` keeps the unexpected
    /// value of a reply: the same twice in a row is not the line's fault.
    fn store(
        &mut self,
        address: u16,
        command: Command,
        other: &mut Option<(u16, i32)>,
    ) -> Result<(), Failed> {
        let step = Step::Store(address, command);
        let AddressedReply { reply: Reply { status, value, .. }, .. } = self.once(command)?;
        match status {
            Status::LOADED if value == command.value || !self.echoes => Ok(()),
            Status::LOADED => {
                if other.replace((address, value)) == Some((address, value)) {
                    self.echoes = false;
                    return Ok(());
                }
                Err(Failed::Doubt(Doubt::OtherValue { expected: command.value, found: value }))
            }
            Status::OK => Err(TransferError::Executed { address, command }.into()),
            status => Err(TransferError::Refused { step, status }.into()),
        }
    }
}
