//! The clients of the control socket: lines in, lines out.

use std::os::fd::{AsFd, BorrowedFd};
use std::os::unix::net::UnixStream;

use rustix::event::PollFlags;
use rustix::io::Errno;

use super::{BadLine, Device, ServedPort};
use crate::control::{ControlSocket, MAX_CONTROL_CLIENTS, MAX_CONTROL_LINE};

/// What a client may leave unread before it is dropped, in bytes.
const MAX_UNSENT: usize = 256 * 1024;

/// The control socket and whoever has connected to it.
#[derive(Debug)]
pub(super) struct Desk {
    pub(super) socket: ControlSocket,
    pub(super) clients: Vec<Client>,
    next_number: u8,
    /// What the device says, before it goes to the client.
    answer: String,
}

impl Desk {
    pub(super) fn new(socket: ControlSocket) -> Self {
        let clients = Vec::with_capacity(MAX_CONTROL_CLIENTS);
        Self { socket, clients, next_number: 0, answer: String::new() }
    }

    /// Answers what has come from the clients; `events` are theirs in order.
    pub(super) fn serve(
        &mut self,
        events: &[PollFlags],
        buffer: &mut [u8],
        device: &mut impl Device,
        ports: &mut [ServedPort],
    ) {
        for (client, events) in self.clients.iter_mut().zip(events) {
            if events.is_empty() {
                continue;
            }
            let count = client.read(*events, buffer);
            let number = client.number;
            let mut rest = &buffer[..count];
            while client.open && !rest.is_empty() {
                self.answer.clear();
                let line = client.take_line(&mut rest);
                match line {
                    Taken::Nothing => {}
                    Taken::Line => {
                        let line = client.line.strip_suffix(b"\r").unwrap_or(&client.line);
                        let line = std::str::from_utf8(line).map_err(|_| BadLine::NotUtf8);
                        device.control(number, line, ports, &mut self.answer);
                        client.line.clear();
                    }
                    Taken::TooLong => {
                        device.control(number, Err(BadLine::TooLong), ports, &mut self.answer);
                        client.closing = true;
                        rest = &[];
                    }
                }
                client.unsent.extend_from_slice(self.answer.as_bytes());
            }
        }
    }

    /// Sends what there is to report and what is still unsent; forgets clients that have gone.
    pub(super) fn flush(&mut self, device: &mut impl Device) {
        for client in &mut self.clients {
            self.answer.clear();
            device.report(client.number, &mut self.answer);
            client.unsent.extend_from_slice(self.answer.as_bytes());
            client.flush();
        }
        self.clients.retain(|client| {
            if !client.open {
                device.control_ended(client.number);
            }
            client.open
        });
    }

    /// Takes the next client.
    ///
    /// # Errors
    /// When the system cannot give another connection.
    pub(super) fn accept(&mut self) -> std::io::Result<()> {
        let Some(stream) = self.socket.accept()? else { return Ok(()) };
        if self.clients.len() == MAX_CONTROL_CLIENTS {
            // Dropping it tells the client at once; left waiting it would learn nothing.
            return Ok(());
        }
        let number = loop {
            let number = self.next_number;
            self.next_number = self.next_number.wrapping_add(1);
            if self.clients.iter().all(|client| client.number != number) {
                break number;
            }
        };
        self.clients.push(Client::new(number, stream));
        Ok(())
    }
}

/// One client.
#[derive(Debug)]
pub(super) struct Client {
    number: u8,
    stream: UnixStream,
    /// What has come of a line that is not complete yet.
    line: Vec<u8>,
    unsent: Vec<u8>,
    /// Whether it is dropped as soon as everything has been sent.
    closing: bool,
    open: bool,
}

enum Taken {
    Nothing,
    Line,
    TooLong,
}

impl Client {
    fn new(number: u8, stream: UnixStream) -> Self {
        Self { number, stream, line: Vec::new(), unsent: Vec::new(), closing: false, open: true }
    }

    /// A client that does not read its answers is not listened to until it does.
    pub(super) fn interest(&self) -> PollFlags {
        if self.unsent.is_empty() && !self.closing { PollFlags::IN } else { PollFlags::OUT }
    }

    fn read(&mut self, events: PollFlags, buffer: &mut [u8]) -> usize {
        self.flush();
        if !self.unsent.is_empty() || self.closing {
            self.open &= !events.intersects(PollFlags::HUP | PollFlags::ERR);
            return 0;
        }
        match rustix::io::read(&self.stream, buffer) {
            Ok(0) => self.closing = true,
            Ok(count) => return count,
            Err(Errno::AGAIN | Errno::INTR) => {}
            Err(_) => self.open = false,
        }
        0
    }

    /// Moves bytes up to the end of a line from `rest` to the line.
    fn take_line(&mut self, rest: &mut &[u8]) -> Taken {
        let end = rest.iter().position(|&byte| byte == b'\n');
        let (line, behind) = match end {
            Some(end) => (&rest[..end], &rest[end + 1..]),
            None => (*rest, &rest[rest.len()..]),
        };
        *rest = behind;
        if self.line.len() + line.len() > MAX_CONTROL_LINE {
            return Taken::TooLong;
        }
        self.line.extend_from_slice(line);
        if end.is_some() { Taken::Line } else { Taken::Nothing }
    }

    fn flush(&mut self) {
        if self.open && !self.unsent.is_empty() {
            match rustix::io::write(&self.stream, &self.unsent) {
                Ok(count) => {
                    self.unsent.drain(..count);
                }
                Err(Errno::AGAIN | Errno::INTR) => {}
                Err(_) => self.open = false,
            }
        }
        self.open &= self.unsent.len() <= MAX_UNSENT && !(self.closing && self.unsent.is_empty());
    }
}

impl AsFd for Client {
    fn as_fd(&self) -> BorrowedFd<'_> {
        self.stream.as_fd()
    }
}
