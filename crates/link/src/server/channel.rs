//! One client's line.
//!
//! What comes from the client is frames or, in the device's ASCII mode, text. The device is asked before each
//! byte that arrives, since the last one may have changed it.
//!
//! Faults act on frames. Text passes unharmed, but overtakes nothing that was sent before it. A client that
//! does not wait for the reply to command 139 types into a line that still carries frames: what it types
//! meets their faults, and is lost where it fills no frame.

use std::collections::VecDeque;
use std::net::TcpStream;
use std::os::fd::{AsFd, BorrowedFd};
use std::time::Duration;

use opentmcl_wire::serial::{Decoder, FRAME_LEN};
use opentmcl_wire::{Instant, Outgoing};
use rustix::event::PollFlags;
use rustix::io::Errno;

use super::{Device, Peer, READ_BUFFER, ServedPort};
use crate::clock::line_time;
use crate::faults::{Framer, Injector, Piece};
use crate::pty::Pty;

/// Replies that a TCP client may leave unread before it is dropped, in bytes.
const MAX_UNSENT: usize = 64 * 1024;

/// Frames and texts that a slow line keeps on their way; what comes on top is lost.
const MAX_HELD: usize = 4096;

#[derive(Debug)]
pub(super) enum Stream {
    Pty(Pty),
    Tcp(TcpStream),
}

impl AsFd for Stream {
    fn as_fd(&self) -> BorrowedFd<'_> {
        match self {
            Self::Pty(pty) => pty.as_fd(),
            Self::Tcp(stream) => stream.as_fd(),
        }
    }
}

/// A connection and everything that belongs to it alone.
#[derive(Debug)]
pub(super) struct Channel {
    pub(super) peer: Peer,
    /// Which of the server's ports it came by.
    pub(super) port: usize,
    pub(super) stream: Stream,
    decoder: Decoder,
    framer: Framer,
    /// How long the server has slept and would have been woken by this client. This is the
    /// decoder's time: what was not read because the server was busy is not a silence on the line.
    pub(super) listened: Duration,
    requests: Delayed,
    replies: Delayed,
    /// Replies on their way; empty between two requests unless a TCP client does not read.
    unsent: Vec<u8>,
    pub(super) open: bool,
}

impl Channel {
    pub(super) fn new(peer: Peer, port: usize, stream: Stream) -> Self {
        Self {
            peer,
            port,
            stream,
            decoder: Decoder::new(),
            framer: Framer::default(),
            listened: Duration::ZERO,
            requests: Delayed::default(),
            replies: Delayed::default(),
            // Room for the replies to one full read of frames, so that serving a request allocates nothing.
            unsent: Vec::with_capacity(READ_BUFFER + FRAME_LEN),
            open: true,
        }
    }

    /// A TCP client that does not read its replies is not listened to until it does.
    pub(super) fn interest(&self) -> PollFlags {
        if self.unsent.is_empty() { PollFlags::IN } else { PollFlags::OUT }
    }

    /// Reads what has arrived, at most one buffer full. A client that has gone closes its channel;
    /// a pseudo terminal waits for the next one.
    pub(super) fn read(&mut self, events: PollFlags, buffer: &mut [u8]) -> usize {
        self.flush();
        if !self.unsent.is_empty() {
            self.open &= !events.intersects(PollFlags::HUP | PollFlags::ERR);
            return 0;
        }
        match rustix::io::read(&self.stream, buffer) {
            Ok(0) => self.hang_up(),
            Ok(count) => return count,
            Err(Errno::AGAIN | Errno::INTR) => {}
            Err(_) => self.hang_up(),
        }
        0
    }

    /// A byte has come from the client at this time of the line. Whether the device has been given
    /// something.
    pub(super) fn push(
        &mut self,
        byte: u8,
        now: Duration,
        port: &mut ServedPort,
        device: &mut impl Device,
    ) -> bool {
        let time = line_time(self.listened);
        if device.takes_text(self.peer) {
            !self.requests.hold_up(&[byte]) && self.arrive(byte, time, device)
        } else if port.requests.is_idle() && self.requests.is_empty() {
            let asked = self.arrive(byte, time, device);
            if asked {
                port.requests.pass();
            }
            asked
        } else if let Some(frame) = self.framer.push(byte, time)
            && let Some(piece) = self.requests.send(frame, now, &mut port.requests)
        {
            self.arrive_all(&piece, time, device)
        } else {
            false
        }
    }

    /// A byte has reached the device. Whether it was given something.
    fn arrive(&mut self, byte: u8, time: Instant, device: &mut impl Device) -> bool {
        if device.takes_text(self.peer) {
            device.receive_key(self.peer, byte);
            return true;
        }
        let request = self.decoder.push(byte, time);
        request.map(|request| device.receive(self.peer, request)).is_some()
    }

    fn arrive_all(&mut self, piece: &Piece, time: Instant, device: &mut impl Device) -> bool {
        let mut asked = false;
        for &byte in piece.bytes() {
            asked |= self.arrive(byte, time, device);
        }
        asked
    }

    /// The device sends this.
    pub(super) fn reply(&mut self, content: Outgoing, now: Duration, port: &mut ServedPort) {
        match content {
            Outgoing::Text(text) => {
                if !self.replies.hold_up(text.as_bytes()) {
                    self.unsent.extend_from_slice(text.as_bytes());
                }
            }
            Outgoing::Frame(frame) if port.replies.is_idle() && self.replies.is_empty() => {
                port.replies.pass();
                self.unsent.extend_from_slice(&frame);
            }
            Outgoing::Frame(frame) => {
                if let Some(piece) = self.replies.send(frame, now, &mut port.replies) {
                    self.unsent.extend_from_slice(piece.bytes());
                }
            }
        }
    }

    /// When the next delayed frame arrives, in one direction or the other.
    pub(super) fn next_delayed(&self) -> Option<Duration> {
        self.requests.due().into_iter().chain(self.replies.due()).min()
    }

    /// Lets arrive what is due.
    pub(super) fn release(&mut self, now: Duration, device: &mut impl Device) {
        while let Some(piece) = self.requests.release(now) {
            let time = line_time(self.listened);
            self.arrive_all(&piece, time, device);
        }
        while let Some(piece) = self.replies.release(now) {
            self.unsent.extend_from_slice(piece.bytes());
        }
    }

    /// Writes what it can of the replies.
    pub(super) fn flush(&mut self) {
        if self.unsent.is_empty() || !self.open {
            return;
        }
        let written = rustix::io::write(&self.stream, &self.unsent);
        match (&self.stream, written) {
            (_, Ok(count)) if count == self.unsent.len() => self.unsent.clear(),
            (Stream::Pty(_), _) => {
                // A serial line does not wait: nobody has read for thousands of replies, and the
                // next client must not be sent those of the last one.
                self.unsent.clear();
            }
            (Stream::Tcp(_), Ok(count)) => {
                self.unsent.drain(..count);
            }
            (Stream::Tcp(_), Err(Errno::AGAIN | Errno::INTR)) => {}
            (Stream::Tcp(_), Err(_)) => self.hang_up(),
        }
        self.open &= self.unsent.len() <= MAX_UNSENT;
    }

    fn hang_up(&mut self) {
        match self.stream {
            Stream::Pty(_) => {
                self.decoder = Decoder::new();
                self.framer = Framer::default();
            }
            Stream::Tcp(_) => self.open = false,
        }
    }
}

/// One direction of a connection: what the line has not delivered yet.
#[derive(Debug, Default)]
struct Delayed {
    withheld: Option<[u8; FRAME_LEN]>,
    /// In the order of their arrival, which is the order in which they were sent.
    pieces: VecDeque<(Duration, Piece)>,
}

impl Delayed {
    fn is_empty(&self) -> bool {
        self.withheld.is_none() && self.pieces.is_empty()
    }

    /// What arrives at once if this is sent now.
    fn send(
        &mut self,
        frame: [u8; FRAME_LEN],
        now: Duration,
        line: &mut Injector,
    ) -> Option<Piece> {
        let piece = line.send(frame, &mut self.withheld);
        if piece.bytes().is_empty() {
            return None;
        }
        // Nothing on a line overtakes what was sent before it.
        let before = self.pieces.back().map_or(now, |&(due, _)| due);
        let due = before.max(now + piece.delay);
        if due == now && self.pieces.is_empty() {
            return Some(piece);
        }
        if self.pieces.len() < MAX_HELD {
            self.pieces.push_back((due, piece));
        } else {
            line.overflow();
        }
        None
    }

    /// Sends text, which waits for what is on its way; false if there is nothing, and it arrives at once.
    fn hold_up(&mut self, text: &[u8]) -> bool {
        let Some(&(due, _)) = self.pieces.back() else {
            return false;
        };
        if self.pieces.len() < MAX_HELD {
            self.pieces.push_back((due, Piece::unharmed(text)));
        }
        true
    }

    fn due(&self) -> Option<Duration> {
        self.pieces.front().map(|&(due, _)| due)
    }

    fn release(&mut self, now: Duration) -> Option<Piece> {
        self.pieces.pop_front_if(|(due, _)| *due <= now).map(|(_, piece)| piece)
    }
}
