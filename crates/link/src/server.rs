//! Serves one device in real time to any number of clients, in one thread that sleeps whenever
//! there is nothing to do.

use std::io;
use std::net::TcpStream;
use std::os::fd::{AsFd, BorrowedFd};
use std::time::Duration;

use opentmcl_wire::Instant;
use opentmcl_wire::serial::{Decoder, FRAME_LEN, Request, WrongChecksum};
use rustix::event::{PollFd, PollFlags, Timespec};
use rustix::io::Errno;

use crate::clock::{Clock, Speed, line_time};
use crate::pty::Pty;
use crate::tcp::{Listener, MAX_CONNECTIONS};

/// The least time between two wake-ups that no client asked for. A running program wants to be
/// advanced thousands of times a second; it catches up exactly however late that comes.
const COALESCE: Duration = Duration::from_millis(1);

/// The most real time that the device catches up in one go before requests are looked at again.
const SLICE: Duration = Duration::from_millis(20);

/// A device that is further behind than this loses the excess: a host that is too slow, or was
/// suspended, slows the device down instead of piling up work.
const MAX_BEHIND: Duration = Duration::from_secs(1);

/// Replies that a TCP client may leave unread before it is dropped, in bytes.
const MAX_UNSENT: usize = 64 * 1024;

const READ_BUFFER: usize = 4096;

/// The listener and the stop signal, then one entry for each channel.
const FIXED_FDS: usize = 2;
const MAX_CHANNELS: usize = MAX_CONNECTIONS + 1;

/// What is served: something that takes requests, lives in time and sends replies.
///
/// Times are the device's own, counted from zero when the server starts to run.
pub trait Device {
    /// When the device next wants to be advanced; `None` when it is at rest until a request comes.
    fn next_event(&mut self) -> Option<Instant>;
    /// Everything that is due until then happens. A time in the past changes nothing.
    fn advance_to(&mut self, now: Instant);
    /// A request has arrived now.
    fn receive(&mut self, from: Peer, request: Result<Request, WrongChecksum>);
    /// The next frame that is due now and where it goes; called until it is `None`.
    fn transmit(&mut self) -> Option<(Peer, [u8; FRAME_LEN])>;
}

/// The kind of line that a client uses.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Endpoint {
    /// The pseudo terminal.
    Pty,
    /// A TCP connection.
    Tcp,
}

/// Who sent a request and gets the replies.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Peer {
    /// The kind of line.
    pub endpoint: Endpoint,
    /// Tells the TCP connections apart; not used again for the next connection.
    pub number: u8,
}

/// One device and the lines that lead to it.
#[derive(Debug)]
pub struct Server<D> {
    device: D,
    listener: Option<Listener>,
    next_number: u8,
    channels: Vec<Channel>,
}

impl<D: Device> Server<D> {
    /// A server with a pseudo terminal, a TCP listener, or both.
    pub fn new(device: D, pty: Option<Pty>, listener: Option<Listener>) -> Self {
        let mut channels = Vec::with_capacity(MAX_CHANNELS);
        let peer = Peer { endpoint: Endpoint::Pty, number: 0 };
        channels.extend(pty.map(|pty| Channel::new(peer, Stream::Pty(pty))));
        Self { device, listener, next_number: 0, channels }
    }

    /// Serves until something can be read from `stop`. The device's time is zero when this begins.
    ///
    /// # Errors
    /// When the system can no longer wait for events. Trouble with a client is no error: it ends
    /// that client's connection.
    pub fn run(&mut self, stop: impl AsFd, speed: Speed) -> io::Result<()> {
        let mut clock = Clock::start(speed);
        let mut buffer = [0; READ_BUFFER];
        let mut last_wake = Duration::ZERO;
        loop {
            let due = self.device.next_event();
            let asleep = clock.elapsed();
            let timeout =
                due.map(|due| clock.when(due).max(last_wake + COALESCE).saturating_sub(asleep));
            let ready = self.wait(stop.as_fd(), timeout)?;
            if !ready.stop.is_empty() {
                return Ok(());
            }
            last_wake = clock.elapsed();
            self.listened(last_wake - asleep);
            self.catch_up(&mut clock, due, last_wake);
            self.serve(&ready, &mut buffer);
        }
    }

    /// Sleeps until a client, the stop signal or the end of `timeout`.
    fn wait(&self, stop: BorrowedFd<'_>, timeout: Option<Duration>) -> io::Result<Ready> {
        let timeout = timeout.map(|timeout| {
            // A day is short enough for every system's limit, and waking up early does no harm.
            let timeout = timeout.min(Duration::from_secs(86_400));
            Timespec { tv_sec: timeout.as_secs() as i64, tv_nsec: timeout.subsec_nanos().into() }
        });
        let mut fds: [PollFd<'_>; FIXED_FDS + MAX_CHANNELS] = std::array::from_fn(|at| {
            let channel = at.checked_sub(FIXED_FDS).and_then(|at| self.channels.get(at));
            match (at, channel, &self.listener) {
                (_, Some(channel), _) => PollFd::new(&channel.stream, channel.interest()),
                (1, _, Some(listener)) => PollFd::new(listener, PollFlags::IN),
                (0, ..) => PollFd::from_borrowed_fd(stop, PollFlags::IN),
                _ => PollFd::from_borrowed_fd(stop, PollFlags::empty()),
            }
        });
        let used = FIXED_FDS + self.channels.len();
        match rustix::event::poll(&mut fds[..used], timeout.as_ref()) {
            Ok(_) | Err(Errno::INTR) => {}
            Err(error) => return Err(error.into()),
        }
        Ok(Ready {
            stop: fds[0].revents(),
            listener: fds[1].revents(),
            channels: std::array::from_fn(|at| fds[FIXED_FDS + at].revents()),
        })
    }

    /// Advances the device to the present, or a slice towards it if it is far behind.
    fn catch_up(&mut self, clock: &mut Clock, due: Option<Instant>, elapsed: Duration) {
        let behind = due.map_or(Duration::ZERO, |due| elapsed.saturating_sub(clock.when(due)));
        clock.lose(behind.saturating_sub(MAX_BEHIND));
        let left_out = behind.min(MAX_BEHIND).saturating_sub(SLICE);
        self.device.advance_to(clock.module_time(elapsed.saturating_sub(left_out)));
        self.collect();
    }

    /// Counts the time for which nothing came from the clients that were listened to.
    fn listened(&mut self, time: Duration) {
        for channel in &mut self.channels {
            if channel.interest().contains(PollFlags::IN) {
                channel.listened += time;
            }
        }
    }

    /// Does what the clients want.
    fn serve(&mut self, ready: &Ready, buffer: &mut [u8]) {
        for at in 0..self.channels.len() {
            if ready.channels[at].is_empty() {
                continue;
            }
            let count = self.channels[at].read(ready.channels[at], buffer);
            let now = line_time(self.channels[at].listened);
            for &byte in &buffer[..count] {
                if let Some(request) = self.channels[at].decoder.push(byte, now) {
                    self.device.receive(self.channels[at].peer, request);
                    self.collect();
                }
            }
        }
        self.channels.iter_mut().for_each(Channel::flush);
        self.channels.retain(|channel| channel.open);
        if !ready.listener.is_empty() {
            self.accept();
        }
    }

    /// Puts every frame that the device has ready into its channel. What is meant for a client that
    /// has gone is dropped.
    fn collect(&mut self) {
        while let Some((peer, frame)) = self.device.transmit() {
            if let Some(channel) = self.channels.iter_mut().find(|channel| channel.peer == peer) {
                channel.unsent.extend_from_slice(&frame);
            }
        }
    }

    fn accept(&mut self) {
        let Some(listener) = &self.listener else { return };
        let stream = match listener.accept() {
            Ok(Some(stream)) => stream,
            Ok(None) => return,
            Err(_) => {
                // The client still waits and would be reported again at once; the system needs
                // time to find the means for another connection.
                std::thread::sleep(COALESCE);
                return;
            }
        };
        let of_tcp = |channel: &&Channel| channel.peer.endpoint == Endpoint::Tcp;
        if self.channels.iter().filter(of_tcp).count() == MAX_CONNECTIONS {
            // Dropping it tells the client at once; left waiting it would learn nothing.
            return;
        }
        let peer = loop {
            let peer = Peer { endpoint: Endpoint::Tcp, number: self.next_number };
            self.next_number = self.next_number.wrapping_add(1);
            if self.channels.iter().all(|channel| channel.peer != peer) {
                break peer;
            }
        };
        self.channels.push(Channel::new(peer, Stream::Tcp(stream)));
    }
}

/// What has happened on each file descriptor.
struct Ready {
    stop: PollFlags,
    listener: PollFlags,
    channels: [PollFlags; MAX_CHANNELS],
}

#[derive(Debug)]
enum Stream {
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

/// One client's line.
#[derive(Debug)]
struct Channel {
    peer: Peer,
    stream: Stream,
    decoder: Decoder,
    /// How long the server has slept and would have been woken by this client. This is the
    /// decoder's time: what was not read because the server was busy is not a silence on the line.
    listened: Duration,
    /// Replies on their way; empty between two requests unless a TCP client does not read.
    unsent: Vec<u8>,
    open: bool,
}

impl Channel {
    fn new(peer: Peer, stream: Stream) -> Self {
        // Room for the replies to one full read, so that serving a request allocates nothing.
        let unsent = Vec::with_capacity(READ_BUFFER + FRAME_LEN);
        let listened = Duration::ZERO;
        Self { peer, stream, decoder: Decoder::new(), listened, unsent, open: true }
    }

    /// A TCP client that does not read its replies is not listened to until it does.
    fn interest(&self) -> PollFlags {
        if self.unsent.is_empty() { PollFlags::IN } else { PollFlags::OUT }
    }

    /// Reads what has arrived, at most one buffer full. A client that has gone closes its channel;
    /// a pseudo terminal waits for the next one.
    fn read(&mut self, events: PollFlags, buffer: &mut [u8]) -> usize {
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

    /// Writes what it can of the replies.
    fn flush(&mut self) {
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
            Stream::Pty(_) => self.decoder = Decoder::new(),
            Stream::Tcp(_) => self.open = false,
        }
    }
}

#[cfg(test)]
mod tests;
