//! Direct mode: a request from the host becomes an answer, in the form in which it came.

use opentmcl_catalog::Globals;
use opentmcl_wire::{Command, Duration, Instant, Opcode, Outgoing, Reply, Status, ascii, serial};

use crate::board::Board;
use crate::commands::{Caller, Outcome};
use crate::line::{Line, Port};
use crate::module::{Module, UNKNOWN};

/// What the module answers to a command.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Answer {
    /// The general reply (firmware manual 3.2).
    Reply(Reply),
    /// Command 136 type 0: eight characters in place of all that follows the host address, without
    /// checksum.
    Version([u8; 8]),
    /// Command 134: the seven bytes of a command in place of all between host address and checksum.
    Memory(Command),
    /// Nothing, after a factory reset.
    Silence,
}

impl Answer {
    /// The bytes that the line carries; none if the module says nothing.
    pub const fn frame(self, host: u8, module: u8) -> Option<[u8; serial::FRAME_LEN]> {
        Some(match self {
            Self::Reply(reply) => serial::encode_reply(host, module, reply),
            Self::Version([a, b, c, d, e, f, g, h]) => [host, a, b, c, d, e, f, g, h],
            Self::Memory(command) => serial::encode_request(host, command),
            Self::Silence => return None,
        })
    }
}

impl<B: Board> Module<B> {
    /// Executes a command in direct mode as if it came by a line without addresses.
    pub fn execute_direct(&mut self, command: Command, now: Instant) -> Answer {
        self.poll(now);
        let answer = self.answer_command(command, None);
        self.observe_touched();
        answer
    }

    /// Answers a frame from a line.
    pub(crate) fn answer(
        &mut self,
        port: Port,
        request: Result<serial::Request, serial::WrongChecksum>,
    ) {
        let address = match request {
            Ok(request) => request.address,
            Err(damaged) => damaged.address,
        };
        if !self.behaviour().hears() || port.line != Line::Usb && !self.is_my_address(address) {
            return;
        }
        match request {
            Ok(request) => {
                let answer = self.answer_command(request.command, Some(port));
                if !self.is_suppressed(request.command.number) {
                    self.send_answer(port, answer);
                }
                self.observe_touched();
            }
            Err(_) => {
                let reply = Reply { status: Status::WRONG_CHECKSUM, number: 0, value: 0 };
                if !self.is_suppressed(reply.number) {
                    self.send_answer(port, Answer::Reply(reply));
                }
            }
        }
    }

    fn is_my_address(&self, address: u8) -> bool {
        let address = i32::from(address);
        let secondary = self.globals[Globals::SerialSecondaryAddress];
        address == self.globals[Globals::SerialAddress] || secondary != 0 && address == secondary
    }

    /// Global parameter 255 silences all but the commands that ask for a value.
    pub(crate) fn is_suppressed(&self, command: u8) -> bool {
        let asks =
            matches!(Opcode::from_number(command), Some(Opcode::Gap | Opcode::Ggp | Opcode::Gio));
        if self.has_servo() {
            // What suppresses replies there suppresses all of them.
            return self.globals[Globals::SuppressReply] != 0 || !self.behaviour().speaks();
        }
        self.globals[Globals::SuppressReply] != 0 && !asks
    }

    pub(crate) fn answer_command(&mut self, command: Command, port: Option<Port>) -> Answer {
        self.restart_heartbeat();
        let result = if !self.is_known(command.number) && !self.download.active {
            Err(Status::INVALID_COMMAND)
        } else {
            self.execute(command, Caller::Host(port))
        };
        if !matches!(result, Ok(Outcome::Read(_))) {
            self.quiet_until = UNKNOWN;
            self.cpu.look_again(self.now);
        }
        let (status, value) = match result {
            Ok(Outcome::Done) => (Status::OK, command.value),
            Ok(Outcome::Reply(value) | Outcome::Read(value)) => (Status::OK, value),
            Ok(Outcome::Loaded) => (Status::LOADED, command.value),
            Ok(Outcome::Answer(answer)) => return answer,
            Err(status) => (status, command.value),
        };
        Answer::Reply(Reply { status, number: command.number, value })
    }

    pub(crate) fn is_known(&self, number: u8) -> bool {
        self.known_commands.contain(number)
    }

    /// Sends what nobody has asked for just now, in the form that the port has at present.
    pub(crate) fn send(&mut self, port: Port, reply: Reply) {
        if self.is_in_ascii_mode(port) {
            self.send_text(port, reply);
        } else {
            self.send_answer(port, Answer::Reply(reply));
        }
    }

    pub(crate) fn send_answer(&mut self, port: Port, answer: Answer) {
        let (host, module) = self.serial_addresses();
        if let Some(frame) = answer.frame(host, module) {
            self.outbox.push(self.after_pause(port), port, Outgoing::Frame(frame));
        }
    }

    pub(crate) fn send_text(&mut self, port: Port, reply: Reply) {
        let (host, module) = self.serial_addresses();
        let text = ascii::encode_reply(host, module, reply);
        self.outbox.push(self.after_pause(port), port, Outgoing::Text(text));
    }

    /// The host's and the module's.
    fn serial_addresses(&self) -> (u8, u8) {
        let host = self.globals[Globals::SerialHostAddress] as u8;
        (host, self.globals[Globals::SerialAddress] as u8)
    }

    /// When a reply leaves.
    fn after_pause(&self, port: Port) -> Instant {
        let pause = match port.line {
            Line::Rs485 => self.globals[Globals::TelegramPauseTime].unsigned_abs(),
            Line::Usb | Line::Rs232 => 0,
        };
        self.now + Duration::from_millis(u64::from(pause))
    }
}
