//! ASCII mode: lines of text in place of frames, on each port for itself.
//!
//! The mode of a port is kept exactly for all ports that there can be. Lines that are being typed are kept
//! for [`LINES`] ports: if more type at the same time, the line that has been left alone for longest is
//! forgotten.
//!
//! # Readings
//!
//! - Command 139 and the line BIN switch the port by which they come and no other, and are answered in the
//!   form in which they came. Type and value of 139 do not matter.
//! - Parameter 67 is looked at where it has its effect: its bit 0 when the module starts, its echo bits with
//!   each key.
//! - A module whose address has no letter cannot be meant by any line. It refuses 139 with status 6 and
//!   starts in binary mode whatever parameter 67 says, so that it can be reached.
//! - The letter is that of the address (66) on all kinds of line, USB too; the secondary address (87) has none.
//! - The echo does not wait for the telegram pause (75); replies do. An echo behind a reply that waits, waits
//!   with it.
//! - Without replies (255), lines are echoed all the same; a line that cannot be read and BIN take no
//!   reply then.
//! - A line that cannot be read is no sign of life for the heartbeat (68), as a damaged frame is none.
//! - A position report (138) has the form that the port has when it is sent.
//! - While a program is downloaded, lines are stored as frames are, with status 101.
//! - A frame for a port in ASCII mode is not understood, and not answered.

use opentmcl_catalog::Globals;
use opentmcl_wire::ascii::{self, Echo, LineEditor, Request};
use opentmcl_wire::{Instant, Reply, Status};

use crate::board::Board;
use crate::direct::Answer;
use crate::line::Port;
use crate::module::Module;

/// Lines that can be typed at the same time.
const LINES: usize = 4;

/// Kinds of line.
const KINDS: usize = 3;

/// Which ports are in ASCII mode, and what is being typed by them.
#[derive(Clone, Debug)]
pub(crate) struct Terminals {
    /// Whether ports are in ASCII mode if nothing else has been said.
    start_in_ascii: bool,
    /// Ports in the other mode: for each kind of line, bit n of word n / 64 is connection n.
    switched: [[u64; 4]; KINDS],
    /// Those used last come first.
    lines: [(Option<Port>, LineEditor); LINES],
}

impl Terminals {
    /// All ports are as they are after the start.
    pub(crate) fn new(start_in_ascii: bool) -> Self {
        let lines = core::array::from_fn(|_| (None, LineEditor::new()));
        Self { start_in_ascii, switched: [[0; 4]; KINDS], lines }
    }

    fn is_in_ascii_mode(&self, port: Port) -> bool {
        let words = self.switched.get(port.line as usize);
        let word = words.and_then(|words| words.get(usize::from(port.number / 64)));
        let is_switched = word.is_some_and(|word| word >> (port.number % 64) & 1 != 0);
        self.start_in_ascii != is_switched
    }

    fn set_mode(&mut self, port: Port, ascii: bool) {
        let words = self.switched.get_mut(port.line as usize);
        if let Some(word) = words.and_then(|words| words.get_mut(usize::from(port.number / 64))) {
            let bit = 1 << (port.number % 64);
            *word = if ascii == self.start_in_ascii { *word & !bit } else { *word | bit };
        }
    }

    pub(crate) fn enter(&mut self, port: Port) {
        self.set_mode(port, true);
    }

    fn leave(&mut self, port: Port) {
        self.set_mode(port, false);
    }

    /// The port is as after the start.
    fn forget(&mut self, port: Port) {
        self.set_mode(port, self.start_in_ascii);
        if let Some(line) = self.lines.iter_mut().find(|(owner, _)| *owner == Some(port)) {
            *line = (None, LineEditor::new());
        }
    }

    /// The line that is being typed by a port, or a new one.
    fn line(&mut self, port: Port) -> &mut LineEditor {
        let its_own = self.lines.iter().position(|(owner, _)| *owner == Some(port));
        let place = its_own.unwrap_or_else(|| {
            let free = self.lines.iter().rposition(|(_, line)| line.is_empty());
            free.unwrap_or(LINES - 1)
        });
        if let Some(lines) = self.lines.get_mut(..=place) {
            lines.rotate_right(1);
        }
        let [(owner, line), ..] = &mut self.lines;
        if its_own.is_none() {
            *owner = Some(port);
            *line = LineEditor::new();
        }
        line
    }
}

impl<B: Board> Module<B> {
    /// Whether a port takes bytes of text, for [`Module::receive_key`], and not frames. Only what comes by the
    /// port, a restart and [`Module::hang_up`] change that; so ask before each byte.
    pub fn is_in_ascii_mode(&self, port: Port) -> bool {
        self.terminals.is_in_ascii_mode(port)
    }

    /// A byte has arrived by a port in ASCII mode; by another one it changes nothing.
    pub fn receive_key(&mut self, port: Port, byte: u8, now: Instant) {
        self.poll(now);
        if !self.is_in_ascii_mode(port) {
            return;
        }
        let address = self.globals[Globals::SerialAddress] as u8;
        let echo = Echo::from_parameter(self.globals[Globals::AsciiMode]);
        let typed = self.terminals.line(port).push(byte, address, echo);
        self.outbox.push_text(self.now, port, typed.echo);
        if let Some(request) = typed.request {
            self.answer_line(port, request);
        }
    }

    /// A connection has ended, and the next one of this number is another: it begins in the mode in which
    /// the module started, with an empty line. A port that is always there never ends.
    pub fn hang_up(&mut self, port: Port) {
        self.terminals.forget(port);
    }

    fn answer_line(&mut self, port: Port, request: Result<Request, Status>) {
        let reply = match request {
            Ok(Request::Command(command)) => {
                match self.answer_command(command, Some(port)) {
                    Answer::Reply(reply) => reply,
                    // Commands with such answers cannot be typed.
                    Answer::Version(_) | Answer::Memory(_) | Answer::Silence => return,
                }
            }
            Ok(Request::Leave) => {
                self.restart_heartbeat();
                self.terminals.leave(port);
                Reply { status: Status::OK, number: 0, value: 0 }
            }
            Err(status) => Reply { status, number: 0, value: 0 },
        };
        if !self.is_suppressed(reply.number) {
            self.send_text(port, reply);
        }
        self.observe_touched();
    }

    /// The letter with which lines for this module begin.
    pub(crate) fn letter(&self) -> Option<u8> {
        ascii::letter(self.globals[Globals::SerialAddress] as u8)
    }

    pub(crate) fn starts_in_ascii_mode(&self) -> bool {
        self.globals.has(Globals::AsciiMode)
            && ascii::starts_in_ascii(self.globals[Globals::AsciiMode])
            && self.letter().is_some()
    }
}
