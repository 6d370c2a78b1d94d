//! Program memory and the download into it.

use opentmcl_wire::Command;
use opentmcl_wire::limits::PROGRAM_LEN;

/// Commands that are stored together in one EEPROM item.
pub(crate) const CHUNK_LEN: usize = 32;

/// Number of EEPROM items that hold the whole program.
pub(crate) const CHUNKS: usize = PROGRAM_LEN / CHUNK_LEN;

/// The commands of the program. An empty place holds command 0, which ends a program.
#[derive(Clone, Debug)]
pub(crate) struct Program {
    commands: [Command; PROGRAM_LEN],
}

impl Program {
    pub(crate) const fn new() -> Self {
        Self { commands: [Command::new(0, 0, 0, 0); PROGRAM_LEN] }
    }

    /// The command at an address; command 0 beyond the end.
    #[inline]
    pub(crate) fn get(&self, address: u16) -> Command {
        self.commands.get(usize::from(address)).copied().unwrap_or_default()
    }

    pub(crate) fn set(&mut self, address: u16, command: Command) {
        if let Some(place) = self.commands.get_mut(usize::from(address)) {
            *place = command;
        }
    }

    pub(crate) fn erase(&mut self) {
        self.commands.fill(Command::default());
    }

    pub(crate) fn chunk(&self, chunk: usize) -> &[Command] {
        let start = chunk * CHUNK_LEN;
        self.commands.get(start..start + CHUNK_LEN).unwrap_or_default()
    }

    /// Takes a chunk as the EEPROM holds it: seven bytes for each command, what is missing is empty.
    pub(crate) fn load_chunk(&mut self, chunk: u8, bytes: &[u8]) {
        let start = usize::from(chunk) * CHUNK_LEN;
        let Some(places) = self.commands.get_mut(start..start + CHUNK_LEN) else { return };
        places.fill(Command::default());
        for (place, bytes) in places.iter_mut().zip(bytes.chunks_exact(Command::LEN)) {
            *place = bytes.try_into().map(Command::from_bytes).unwrap_or_default();
        }
    }

    /// Whether a chunk holds nothing.
    pub(crate) fn is_empty(&self, chunk: usize) -> bool {
        self.chunk(chunk).iter().all(|command| *command == Command::default())
    }
}

/// A download in progress (132 to 133).
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Download {
    /// Whether commands are being stored instead of executed.
    pub(crate) active: bool,
    /// Address for the next command.
    pub(crate) address: u16,
    /// A chunk with commands that are not in the EEPROM yet.
    pub(crate) unsaved: Option<usize>,
}
