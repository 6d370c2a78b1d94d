//! Serves one device in real time to any number of clients, in one thread that sleeps whenever
//! there is nothing to do.

mod channel;
mod desk;
mod port;

use std::io;
use std::os::fd::{AsFd, BorrowedFd};
use std::time::Duration;

use opentmcl_wire::serial::{Request, WrongChecksum};
use opentmcl_wire::{Instant, Outgoing};
use rustix::event::{PollFd, PollFlags, Timespec};
use rustix::io::Errno;

use crate::clock::{Clock, Speed};
use crate::control::ControlSocket;
use crate::faults::Faults;
use crate::pty::Pty;
use crate::tcp::{Listener, MAX_CONNECTIONS};
use channel::{Channel, Stream};
use desk::Desk;

pub use port::ServedPort;

/// The least time between two wake-ups that no client asked for. A running program wants to be
/// advanced thousands of times a second; it catches up exactly however late that comes.
const COALESCE: Duration = Duration::from_millis(1);

/// The most real time that the device catches up in one go before requests are looked at again.
const SLICE: Duration = Duration::from_millis(20);

/// A device that is further behind than this loses the excess: a host that is too slow, or was
/// suspended, slows the device down instead of piling up work.
const MAX_BEHIND: Duration = Duration::from_secs(1);

const READ_BUFFER: usize = 4096;

/// What is served: one module or several that take requests, live in time and send replies.
///
/// Times are the device's own, counted from zero when the server starts to run.
pub trait Device {
    /// When the device next wants to be advanced; `None` when it is at rest until a request comes.
    fn next_event(&mut self) -> Option<Instant>;
    /// Everything that is due until then happens. A time in the past changes nothing.
    fn advance_to(&mut self, now: Instant);
    /// A request has arrived now.
    fn receive(&mut self, from: Peer, request: Result<Request, WrongChecksum>);
    /// What is due next and where it goes; called until it is `None`.
    fn transmit(&mut self) -> Option<(Peer, Outgoing)>;

    /// Whether what arrives from there now is text, and not part of a frame. Asked before each byte, since
    /// each may change it.
    fn takes_text(&self, from: Peer) -> bool {
        let _ = from;
        false
    }

    /// A byte of text has arrived now.
    fn receive_key(&mut self, from: Peer, byte: u8) {
        // A device that takes no text is never given any.
        let _ = (from, byte);
    }

    /// A TCP connection has gone; its number may come again. Pseudo terminals stay, whoever opens them.
    fn connection_ended(&mut self, peer: Peer) {
        let _ = peer;
    }

    /// Changes what the ports do to frames, where something that has just happened asks for it.
    fn set_faults(&mut self, ports: &mut [ServedPort]) {
        let _ = ports;
    }

    /// A line has come now from a client of the control socket. The answer is appended to `answer`,
    /// with the end of each of its lines.
    fn control(
        &mut self,
        client: u8,
        line: Result<&str, BadLine>,
        ports: &mut [ServedPort],
        answer: &mut String,
    ) {
        // A device without a control socket is never asked.
        let _ = (client, line, ports, answer);
    }

    /// A client of the control socket has gone; its number may come again.
    fn control_ended(&mut self, client: u8) {
        let _ = client;
    }

    /// When a client of the control socket is next to be told something that comes by itself.
    fn next_report(&mut self) -> Option<Instant> {
        None
    }

    /// Appends the lines that this client is to be told now without having asked. Called whenever
    /// something may have happened.
    fn report(&mut self, client: u8, lines: &mut String) {
        let _ = (client, lines);
    }
}

/// Why a line of a client of the control socket means nothing.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum BadLine {
    /// It is not UTF-8.
    NotUtf8,
    /// It has more than [`crate::MAX_CONTROL_LINE`] bytes. The connection ends after the answer.
    TooLong,
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
    /// Which module's line it is, from 0.
    pub module: usize,
    /// The kind of line.
    pub endpoint: Endpoint,
    /// Tells terminals, or TCP connections, of the module apart; not used again for the next
    /// connection.
    pub number: u8,
}

/// A port as it is when the server begins.
#[derive(Debug)]
pub struct NewPort {
    /// Which module it belongs to, from 0.
    pub module: usize,
    /// What it is called by who controls the server.
    pub name: String,
    /// What clients connect to.
    pub transport: Transport,
    /// What it does to frames. The connections of a listener share one sequence of faults.
    pub faults: Faults,
}

/// What clients connect to.
#[derive(Debug)]
pub enum Transport {
    /// A pseudo terminal.
    Pty(Pty),
    /// A socket that accepts TCP connections.
    Tcp(Listener),
}

/// One device and the lines that lead to it.
#[derive(Debug)]
pub struct Server<D> {
    device: D,
    ports: Vec<ServedPort>,
    /// Each with the number of its port.
    listeners: Vec<(usize, Listener)>,
    next_number: u8,
    channels: Vec<Channel>,
    desk: Option<Desk>,
}

impl<D: Device> Server<D> {
    /// A server with these ports, and a control socket or none.
    pub fn new(device: D, ports: Vec<NewPort>, control: Option<ControlSocket>) -> Self {
        let desk = control.map(Desk::new);
        let mut server = Self {
            device,
            ports: Vec::with_capacity(ports.len()),
            listeners: Vec::new(),
            next_number: 0,
            channels: Vec::with_capacity(ports.len() * MAX_CONNECTIONS),
            desk,
        };
        for NewPort { module, name, transport, faults } in ports {
            let port = server.ports.len();
            let endpoint = match transport {
                Transport::Pty(pty) => {
                    // Terminals are there before any other connection and stay to the end.
                    let of_module = |channel: &&Channel| channel.peer.module == module;
                    let number = server.channels.iter().filter(of_module).count() as u8;
                    let peer = Peer { module, endpoint: Endpoint::Pty, number };
                    server.channels.push(Channel::new(peer, port, Stream::Pty(pty)));
                    Endpoint::Pty
                }
                Transport::Tcp(listener) => {
                    server.listeners.push((port, listener));
                    Endpoint::Tcp
                }
            };
            server.ports.push(ServedPort::new(module, name, endpoint, faults));
        }
        server
    }

    /// Serves until something can be read from `stop`. The device's time is zero when this begins.
    ///
    /// # Errors
    /// When the system can no longer wait for events. Trouble with a client is no error: it ends
    /// that client's connection.
    pub fn run(&mut self, stop: impl AsFd, speed: Speed) -> io::Result<()> {
        let mut clock = Clock::start(speed);
        let mut buffer = [0; READ_BUFFER];
        let mut ready = Ready::default();
        let mut last_wake = Duration::ZERO;
        loop {
            let due = self.device.next_event();
            let report = if self.is_controlled() { self.device.next_report() } else { None };
            let asleep = clock.elapsed();
            let wake = due.into_iter().chain(report).min();
            let wake = wake.map(|wake| clock.when(wake).max(last_wake + COALESCE));
            let delayed = self.channels.iter().filter_map(Channel::next_delayed).min();
            let wake = wake.into_iter().chain(delayed).min();
            self.wait(stop.as_fd(), wake.map(|wake| wake.saturating_sub(asleep)), &mut ready)?;
            if !ready.stop().is_empty() {
                return Ok(());
            }
            last_wake = clock.elapsed();
            self.listened(last_wake - asleep);
            self.catch_up(&mut clock, due, last_wake);
            self.release(last_wake);
            self.serve(&ready, last_wake, &mut buffer);
        }
    }

    fn is_controlled(&self) -> bool {
        self.desk.as_ref().is_some_and(|desk| !desk.clients.is_empty())
    }

    /// Sleeps until a client, the stop signal or the end of `timeout`.
    fn wait(
        &self,
        stop: BorrowedFd<'_>,
        timeout: Option<Duration>,
        ready: &mut Ready,
    ) -> io::Result<()> {
        let timeout = timeout.map(|timeout| {
            // A day is short enough for every system's limit, and waking up early does no harm.
            let timeout = timeout.min(Duration::from_secs(86_400));
            Timespec { tv_sec: timeout.as_secs() as i64, tv_nsec: timeout.subsec_nanos().into() }
        });
        let mut fds = recycled(std::mem::take(&mut ready.fds));
        fds.push(PollFd::from_borrowed_fd(stop, PollFlags::IN));
        ready.first_listener = fds.len();
        fds.extend(self.listeners.iter().map(|(_, socket)| PollFd::new(socket, PollFlags::IN)));
        ready.first_channel = fds.len();
        let of_clients = self.channels.iter();
        fds.extend(of_clients.map(|client| PollFd::new(&client.stream, client.interest())));
        ready.control = fds.len();
        if let Some(desk) = &self.desk {
            fds.push(PollFd::new(&desk.socket, PollFlags::IN));
            fds.extend(desk.clients.iter().map(|client| PollFd::new(client, client.interest())));
        }
        match rustix::event::poll(&mut fds, timeout.as_ref()) {
            Ok(_) | Err(Errno::INTR) => {}
            Err(error) => return Err(error.into()),
        }
        ready.events.clear();
        ready.events.extend(fds.iter().map(PollFd::revents));
        ready.fds = recycled(fds);
        Ok(())
    }

    /// Advances the device to the present, or a slice towards it if it is far behind.
    fn catch_up(&mut self, clock: &mut Clock, due: Option<Instant>, elapsed: Duration) {
        let behind = due.map_or(Duration::ZERO, |due| elapsed.saturating_sub(clock.when(due)));
        clock.lose(behind.saturating_sub(MAX_BEHIND));
        let left_out = behind.min(MAX_BEHIND).saturating_sub(SLICE);
        self.device.advance_to(clock.module_time(elapsed.saturating_sub(left_out)));
        self.device.set_faults(&mut self.ports);
        self.collect(elapsed);
    }

    /// Counts the time for which nothing came from the clients that were listened to.
    fn listened(&mut self, time: Duration) {
        for channel in &mut self.channels {
            if channel.interest().contains(PollFlags::IN) {
                channel.listened += time;
            }
        }
    }

    /// Lets arrive what the lines have delayed until now.
    fn release(&mut self, now: Duration) {
        for channel in &mut self.channels {
            channel.release(now, &mut self.device);
        }
        self.collect(now);
    }

    /// Does what the clients want.
    fn serve(&mut self, ready: &Ready, now: Duration, buffer: &mut [u8]) {
        for at in 0..self.channels.len() {
            let events = ready.channel(at);
            if events.is_empty() {
                continue;
            }
            let count = self.channels[at].read(events, buffer);
            for &byte in &buffer[..count] {
                let channel = &mut self.channels[at];
                let port = &mut self.ports[channel.port];
                if channel.push(byte, now, port, &mut self.device) {
                    self.collect(now);
                }
            }
        }
        if let Some(desk) = &mut self.desk {
            desk.serve(ready.control_clients(), buffer, &mut self.device, &mut self.ports);
            self.collect(now);
        }
        self.channels.iter_mut().for_each(Channel::flush);
        self.channels.retain(|channel| {
            if !channel.open {
                self.device.connection_ended(channel.peer);
            }
            channel.open
        });
        for at in 0..self.listeners.len() {
            if !ready.listener(at).is_empty() {
                self.accept(at);
            }
        }
        if let Some(desk) = &mut self.desk {
            desk.flush(&mut self.device);
            if !ready.control().is_empty() && desk.accept().is_err() {
                std::thread::sleep(COALESCE);
            }
        }
    }

    /// Puts everything that the device has ready into its channel. What is meant for a client that
    /// has gone is dropped.
    fn collect(&mut self, now: Duration) {
        while let Some((peer, content)) = self.device.transmit() {
            if let Some(channel) = self.channels.iter_mut().find(|channel| channel.peer == peer) {
                let port = &mut self.ports[channel.port];
                channel.reply(content, now, port);
            }
        }
    }

    /// Takes the next client of this listener.
    fn accept(&mut self, listener: usize) {
        let (port, listener) = &self.listeners[listener];
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
        let of_port = |channel: &&Channel| channel.port == *port;
        if self.channels.iter().filter(of_port).count() == MAX_CONNECTIONS {
            // Dropping it tells the client at once; left waiting it would learn nothing.
            return;
        }
        let module = self.ports[*port].module();
        let peer = loop {
            let peer = Peer { module, endpoint: Endpoint::Tcp, number: self.next_number };
            self.next_number = self.next_number.wrapping_add(1);
            if self.channels.iter().all(|channel| channel.peer != peer) {
                break peer;
            }
        };
        self.channels.push(Channel::new(peer, *port, Stream::Tcp(stream)));
    }
}

/// What has happened on each file descriptor: the stop signal, the listeners, the channels, the
/// control socket, its clients.
#[derive(Default)]
struct Ready {
    events: Vec<PollFlags>,
    first_listener: usize,
    first_channel: usize,
    control: usize,
    /// Empty; kept for its memory.
    fds: Vec<PollFd<'static>>,
}

impl Ready {
    fn stop(&self) -> PollFlags {
        self.events[0]
    }

    fn listener(&self, at: usize) -> PollFlags {
        self.events[self.first_listener + at]
    }

    fn channel(&self, at: usize) -> PollFlags {
        self.events[self.first_channel + at]
    }

    fn control(&self) -> PollFlags {
        self.events.get(self.control).copied().unwrap_or(PollFlags::empty())
    }

    fn control_clients(&self) -> &[PollFlags] {
        self.events.get(self.control + 1..).unwrap_or_default()
    }
}

/// An empty list in the memory of another one, so that waiting allocates nothing.
fn recycled<'new>(mut fds: Vec<PollFd<'_>>) -> Vec<PollFd<'new>> {
    fds.clear();
    fds.into_iter().map_while(|_| None).collect()
}

#[cfg(test)]
mod tests;
