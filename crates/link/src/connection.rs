//! A client's connection to a module.

use std::io::{self, Read, Write};
use std::net::{SocketAddr, TcpStream, ToSocketAddrs};
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

use opentmcl_wire::serial::{self, AddressedReply, FRAME_LEN};
use opentmcl_wire::{Command, Reply, Status, control};
use rustix::fs::FlockOperation;
use rustix::io::Errno;
use serial2::SerialPort;

use crate::uri::PortUri;

/// How long a reply may take.
pub const DEFAULT_TIMEOUT: Duration = Duration::from_secs(1);

/// Why a connection cannot be opened or used.
#[derive(Debug, thiserror::Error)]
pub enum ConnectionError {
    /// There is no such device.
    #[error("there is no port {}", path.display())]
    NoSuchPort {
        /// What was asked for.
        path: PathBuf,
        /// What there is instead.
        candidates: Vec<PathBuf>,
    },
    /// The user may not open the device.
    #[error("no permission to open {}", .0.display())]
    Permission(PathBuf),
    /// Another program holds the device.
    #[error("{} is in use by another program", .0.display())]
    Busy(PathBuf),
    /// Whatever it is, it is no serial port.
    #[error("{} is not a serial port", .0.display())]
    NotASerialPort(PathBuf),
    /// The device cannot be opened for another reason.
    #[error("cannot open {}: {source}", path.display())]
    Open {
        /// What was asked for.
        path: PathBuf,
        /// Why not.
        source: io::Error,
    },
    /// Nothing listens there.
    #[error("nothing listens on {0}")]
    Refused(String),
    /// No socket for another reason.
    #[error("cannot connect to {address}: {source}")]
    Connect {
        /// What was asked for.
        address: String,
        /// Why not.
        source: io::Error,
    },
    /// No reply came.
    #[error("no reply within {} ms", .0.as_millis())]
    Timeout(Duration),
    /// The reply ended too early.
    #[error("only {0} of 9 bytes of a reply arrived")]
    Fragment(usize),
    /// The reply is damaged.
    #[error("the reply has a wrong checksum: {0:02X?}")]
    DamagedReply([u8; FRAME_LEN]),
    /// The connection broke.
    #[error("the connection is lost: {0}")]
    Lost(#[from] io::Error),
}

impl ConnectionError {
    /// What the user can do about it.
    pub fn help(&self) -> String {
        match self {
            Self::NoSuchPort { candidates, .. } if candidates.is_empty() => {
                "this machine has no serial port; is the module plugged in and powered?".into()
            }
            Self::NoSuchPort { candidates, .. } => {
                let names: Vec<_> =
                    candidates.iter().map(|path| path.display().to_string()).collect();
                format!("this machine has {}", names.join(", "))
            }
            Self::Permission(_) => "become a member of the group that owns the port, most often: \
                                    sudo usermod -aG dialout $USER, then log in again"
                .into(),
            Self::Busy(_) => "close the other program, or wait until it is done".into(),
            Self::NotASerialPort(_) | Self::Open { .. } => {
                "name the port of a module, for example /dev/ttyACM0".into()
            }
            Self::Refused(_) => {
                "is `tmcl serve` running, and is this the port that it printed?".into()
            }
            Self::Connect { .. } => "write tcp:HOST:PORT as `tmcl serve` printed it".into(),
            Self::Timeout(_) => {
                "is this the address of the module (--address), and on RS485 and RS232 its bit \
                 rate (?baud=N)?"
                    .into()
            }
            Self::Fragment(_) | Self::DamagedReply(_) => {
                "is this the bit rate of the module (?baud=N), and is it the only one that answers?"
                    .into()
            }
            Self::Lost(_) => "is the module still plugged in, or `tmcl serve` running?".into(),
        }
    }
}

/// What every way of talking to a module can do.
pub trait Connection {
    /// Sends bytes as they are.
    ///
    /// # Errors
    /// When the connection is lost.
    fn send(&mut self, bytes: &[u8]) -> Result<(), ConnectionError>;

    /// The next nine bytes; `None` when not one byte comes within `timeout`.
    ///
    /// # Errors
    /// When the connection is lost, or only a part of nine bytes comes.
    fn receive(&mut self, timeout: Duration) -> Result<Option<[u8; FRAME_LEN]>, ConnectionError>;

    /// Forgets what has arrived and was not received.
    ///
    /// # Errors
    /// When the connection is lost.
    fn discard(&mut self) -> Result<(), ConnectionError>;

    /// How long [`Connection::exchange`] waits.
    fn timeout(&self) -> Duration;

    /// Sends a frame and returns the nine bytes that answer it, whatever they are. What arrived
    /// before is dropped, so that an earlier mishap does not shift the answers; the late second
    /// reply to an earlier command 138 is passed over.
    ///
    /// # Errors
    /// When nothing comes within [`Connection::timeout`], and as [`Connection::receive`].
    fn exchange(&mut self, frame: [u8; FRAME_LEN]) -> Result<[u8; FRAME_LEN], ConnectionError> {
        self.discard()?;
        self.send(&frame)?;
        let timeout = self.timeout();
        loop {
            let answer = self.receive(timeout)?.ok_or(ConnectionError::Timeout(timeout))?;
            // The number too: a command of the program, in answer to 134, may have the type 128.
            let late =
                serial::decode_reply(answer).is_ok_and(|AddressedReply { reply, .. }| {
                    reply.status == Status::DELAYED && reply.number == control::POSITION_REPORT
                });
            if !late {
                return Ok(answer);
            }
        }
    }

    /// Executes a command on the module with this address.
    ///
    /// Not for a command that [answers with text](answers_with_text); use
    /// [`Connection::exchange`].
    ///
    /// # Errors
    /// When no reply comes, or a damaged one.
    fn request(&mut self, address: u8, command: Command) -> Result<Reply, ConnectionError> {
        let frame = self.exchange(serial::encode_request(address, command))?;
        let answer = serial::decode_reply(frame);
        Ok(answer.map_err(|_| ConnectionError::DamagedReply(frame))?.reply)
    }
}

/// Whether the reply is the host address and eight characters, without a status and a checksum:
/// command 136 type 0, the version as text (firmware manual 3.5.7).
pub const fn answers_with_text(command: Command) -> bool {
    command.number == control::FIRMWARE_VERSION && command.kind == 0
}

/// A connection to a serial port or a socket.
#[derive(Debug)]
pub struct Client {
    stream: Stream,
    timeout: Duration,
}

#[derive(Debug)]
enum Stream {
    Serial(SerialPort),
    Tcp(TcpStream),
}

impl Client {
    /// Opens the port, a serial one for this program alone. Replies may take
    /// [`DEFAULT_TIMEOUT`].
    ///
    /// # Errors
    /// When it is not there, not accessible or in use.
    pub fn open(uri: &PortUri) -> Result<Self, ConnectionError> {
        let stream = match uri {
            PortUri::Serial { path, baud } => Stream::Serial(open_serial(path, *baud)?),
            PortUri::Tcp { host, port } => Stream::Tcp(open_tcp(&format!("{host}:{port}"))?),
        };
        Ok(Self { stream, timeout: DEFAULT_TIMEOUT })
    }

    /// Sets how long a reply may take.
    pub fn set_timeout(&mut self, timeout: Duration) {
        self.timeout = timeout;
    }
}

fn open_serial(path: &Path, baud: u32) -> Result<SerialPort, ConnectionError> {
    let port = SerialPort::open(path, baud).map_err(|source| {
        let path = path.to_owned();
        match source.kind() {
            io::ErrorKind::NotFound => {
                let mut candidates = SerialPort::available_ports().unwrap_or_default();
                candidates.sort();
                ConnectionError::NoSuchPort { path, candidates }
            }
            io::ErrorKind::PermissionDenied => ConnectionError::Permission(path),
            io::ErrorKind::ResourceBusy => ConnectionError::Busy(path),
            _ if Errno::from_io_error(&source) == Some(Errno::NOTTY) => {
                ConnectionError::NotASerialPort(path)
            }
            _ => ConnectionError::Open { path, source },
        }
    })?;
    // An advisory lock, as pyserial and picocom use it: the kernel would enforce TIOCEXCL, but on
    // a pseudo terminal it outlives a client that crashed.
    match rustix::fs::flock(&port, FlockOperation::NonBlockingLockExclusive) {
        Err(Errno::WOULDBLOCK) => Err(ConnectionError::Busy(path.to_owned())),
        // A system that cannot lock a device can still use it.
        _ => Ok(port),
    }
}

fn open_tcp(address: &str) -> Result<TcpStream, ConnectionError> {
    let failed = |source| ConnectionError::Connect { address: address.to_owned(), source };
    let candidates: Vec<SocketAddr> = address.to_socket_addrs().map_err(failed)?.collect();
    let mut last = io::Error::new(io::ErrorKind::NotFound, "the name has no address");
    for candidate in candidates {
        match TcpStream::connect_timeout(&candidate, DEFAULT_TIMEOUT) {
            Ok(stream) => {
                stream.set_nodelay(true).map_err(failed)?;
                return Ok(stream);
            }
            Err(error) => last = error,
        }
    }
    Err(match last.kind() {
        io::ErrorKind::ConnectionRefused => ConnectionError::Refused(address.to_owned()),
        _ => failed(last),
    })
}

/// No byte within the time is not an error of the connection.
fn is_timeout(error: &io::Error) -> bool {
    matches!(error.kind(), io::ErrorKind::TimedOut | io::ErrorKind::WouldBlock)
}

impl Stream {
    /// Reads what is there, at most `buffer`; zero when nothing comes within `timeout`.
    fn read_within(&mut self, buffer: &mut [u8], timeout: Duration) -> io::Result<usize> {
        // Zero would mean "for ever" to the one and is refused by the other.
        let timeout = timeout.max(Duration::from_millis(1));
        let read = match self {
            Self::Serial(port) => {
                port.set_read_timeout(timeout)?;
                port.read(buffer)
            }
            Self::Tcp(stream) => {
                stream.set_read_timeout(Some(timeout))?;
                stream.read(buffer)
            }
        };
        match read {
            Ok(0) => Err(io::Error::new(io::ErrorKind::UnexpectedEof, "the other side closed it")),
            Ok(count) => Ok(count),
            Err(error) if is_timeout(&error) => Ok(0),
            Err(error) if error.kind() == io::ErrorKind::Interrupted => Ok(0),
            Err(error) => Err(error),
        }
    }
}

impl Connection for Client {
    fn send(&mut self, bytes: &[u8]) -> Result<(), ConnectionError> {
        match &mut self.stream {
            Stream::Serial(port) => port.write_all(bytes)?,
            Stream::Tcp(stream) => stream.write_all(bytes)?,
        }
        Ok(())
    }

    fn receive(&mut self, timeout: Duration) -> Result<Option<[u8; FRAME_LEN]>, ConnectionError> {
        let start = Instant::now();
        let mut frame = [0; FRAME_LEN];
        let mut len = 0;
        while len < FRAME_LEN {
            let left = timeout.saturating_sub(start.elapsed());
            if left.is_zero() {
                return if len == 0 { Ok(None) } else { Err(ConnectionError::Fragment(len)) };
            }
            len += self.stream.read_within(&mut frame[len..], left)?;
        }
        Ok(Some(frame))
    }

    fn discard(&mut self) -> Result<(), ConnectionError> {
        match &mut self.stream {
            Stream::Serial(port) => port.discard_input_buffer()?,
            Stream::Tcp(stream) => {
                stream.set_nonblocking(true)?;
                let drained = drain(stream);
                stream.set_nonblocking(false)?;
                drained?;
            }
        }
        Ok(())
    }

    fn timeout(&self) -> Duration {
        self.timeout
    }
}

fn drain(stream: &mut TcpStream) -> io::Result<()> {
    let mut stale = [0; 256];
    loop {
        match stream.read(&mut stale) {
            // The end of the stream is told by whoever reads next.
            Ok(0) => return Ok(()),
            Ok(_) => {}
            Err(error) if is_timeout(&error) => return Ok(()),
            Err(error) if error.kind() == io::ErrorKind::Interrupted => {}
            Err(error) => return Err(error),
        }
    }
}
