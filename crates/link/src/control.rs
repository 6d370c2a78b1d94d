//! A local socket with a text protocol: how programs on the same machine get at the world around
//! the modules that are served.
//!
//! It is a UNIX socket in the file system and never TCP: who may use it is what the file's
//! permissions say, and no web page in a browser can reach it.

use std::fs;
use std::io::{self, BufRead, BufReader, Write};
use std::os::fd::{AsFd, BorrowedFd};
use std::os::unix::fs::{FileTypeExt, MetadataExt, PermissionsExt};
use std::os::unix::net::{UnixListener, UnixStream};
use std::path::{Path, PathBuf};
use std::time::Duration;

use rustix::io::Errno;
use rustix::net::{AddressFamily, SocketAddrUnix, SocketType};

/// Clients that are served at the same time; one more is closed as soon as it is made.
pub const MAX_CONTROL_CLIENTS: usize = 8;

/// The longest line that a client may send, in bytes without its end.
pub const MAX_CONTROL_LINE: usize = 64 * 1024;

/// Why there is no socket to serve.
#[derive(Debug, thiserror::Error)]
pub enum ControlError {
    /// Somebody listens there.
    #[error("another program listens on {}", .0.display())]
    InUse(PathBuf),
    /// The socket would have replaced something.
    #[error("{} exists already and is left alone", .0.display())]
    Exists(PathBuf),
    /// The system has no room for such a long path.
    #[error("the path {} is too long for a socket", .0.display())]
    TooLong(PathBuf),
    /// It cannot be created.
    #[error("cannot create the socket {}: {source}", path.display())]
    Create {
        /// Where it should be.
        path: PathBuf,
        /// Why not.
        source: io::Error,
    },
}

impl ControlError {
    /// What the user can do about it.
    pub fn help(&self) -> String {
        match self {
            Self::InUse(_) => "stop the other `tmcl serve`, or choose another path".into(),
            Self::Exists(path) => format!(
                "choose another path, or remove {} if nothing uses it any more",
                path.display()
            ),
            Self::TooLong(_) => "choose a path of at most 100 bytes, for example in /tmp".into(),
            Self::Create { .. } => "choose a path in a directory that you may write to".into(),
        }
    }
}

/// Listens on a path without blocking. The socket can be opened by its user alone, and disappears
/// from the file system with this value.
#[derive(Debug)]
pub struct ControlSocket {
    listener: UnixListener,
    path: PathBuf,
    /// Device and number of the file, by which it is known again.
    identity: (u64, u64),
}

impl ControlSocket {
    /// Listens on `path`.
    ///
    /// # Errors
    /// When the socket cannot be created, above all because something is there: an existing file is
    /// never replaced, not even a socket that a killed program left behind.
    pub fn bind(path: &Path) -> Result<Self, ControlError> {
        let asked = path;
        let failed = |source: io::Error| ControlError::Create { path: asked.to_owned(), source };
        // Absolute, so that it is found again at the end whatever the working directory then is.
        let path = std::path::absolute(path).map_err(failed)?;
        let address = SocketAddrUnix::new(&path).map_err(|errno| match errno {
            Errno::NAMETOOLONG => ControlError::TooLong(path.clone()),
            errno => failed(errno.into()),
        })?;
        let socket = rustix::net::socket(AddressFamily::UNIX, SocketType::STREAM, None)
            .and_then(|socket| {
                rustix::io::fcntl_setfd(&socket, rustix::io::FdFlags::CLOEXEC)?;
                Ok(socket)
            })
            .map_err(|errno| failed(errno.into()))?;
        match rustix::net::bind(&socket, &address) {
            Ok(()) => {}
            Err(Errno::ADDRINUSE) if UnixStream::connect(&path).is_ok() => {
                return Err(ControlError::InUse(path));
            }
            Err(Errno::ADDRINUSE) => return Err(ControlError::Exists(path)),
            Err(errno) => return Err(failed(errno.into())),
        }
        // Nobody can connect before `listen`, so nobody slips in before the permissions are set.
        let permissions = fs::Permissions::from_mode(0o600);
        let prepared = fs::set_permissions(&path, permissions)
            .and_then(|()| Ok(rustix::net::listen(&socket, MAX_CONTROL_CLIENTS as i32)?))
            .and_then(|()| fs::symlink_metadata(&path));
        let listener = UnixListener::from(socket);
        let identity = match prepared.and_then(|file| {
            listener.set_nonblocking(true)?;
            Ok((file.dev(), file.ino()))
        }) {
            Ok(identity) => identity,
            Err(error) => {
                // There is nobody left to tell.
                let _ = fs::remove_file(&path);
                return Err(failed(error));
            }
        };
        Ok(Self { listener, path, identity })
    }

    /// Where it is in the file system, from the root.
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// The next client that waits, non-blocking; `None` when none does or it has already gone.
    ///
    /// # Errors
    /// When the system cannot give another connection, for example for lack of file descriptors.
    pub(crate) fn accept(&self) -> io::Result<Option<UnixStream>> {
        match self.listener.accept() {
            Ok((stream, _)) => Ok(stream.set_nonblocking(true).is_ok().then_some(stream)),
            Err(error) => match error.kind() {
                io::ErrorKind::WouldBlock
                | io::ErrorKind::Interrupted
                | io::ErrorKind::ConnectionAborted => Ok(None),
                _ => Err(error),
            },
        }
    }
}

impl AsFd for ControlSocket {
    fn as_fd(&self) -> BorrowedFd<'_> {
        self.listener.as_fd()
    }
}

impl Drop for ControlSocket {
    fn drop(&mut self) {
        // Whoever replaced the socket meanwhile keeps theirs.
        let is_ours = |file: fs::Metadata| (file.dev(), file.ino()) == self.identity;
        if fs::symlink_metadata(&self.path).is_ok_and(is_ours) {
            // There is nobody left to tell.
            let _ = fs::remove_file(&self.path);
        }
    }
}

/// Why a server's socket cannot be used.
#[derive(Debug, thiserror::Error)]
pub enum ControlClientError {
    /// There is no such file.
    #[error("there is no socket {}", .0.display())]
    NoSuchSocket(PathBuf),
    /// It is some other file.
    #[error("{} is not a socket", .0.display())]
    NotASocket(PathBuf),
    /// Its server has ended.
    #[error("nothing listens on {} any more", .0.display())]
    Stale(PathBuf),
    /// The user may not open it.
    #[error("no permission to open {}", .0.display())]
    Permission(PathBuf),
    /// It cannot be opened for another reason.
    #[error("cannot connect to {}: {source}", path.display())]
    Connect {
        /// What was asked for.
        path: PathBuf,
        /// Why not.
        source: io::Error,
    },
    /// The server has ended or does not want this client.
    #[error("the server has closed the connection")]
    Closed,
    /// No answer came.
    #[error("no answer within {} s", .0.as_secs())]
    Timeout(Duration),
    /// The answer is no text.
    #[error("the answer is not a line of UTF-8")]
    NotText,
    /// The connection broke.
    #[error("the connection is lost: {0}")]
    Lost(#[source] io::Error),
}

impl ControlClientError {
    /// What the user can do about it.
    pub fn help(&self) -> String {
        match self {
            Self::NoSuchSocket(_) | Self::NotASocket(_) => {
                "`tmcl serve SCENARIO.toml` and `tmcl serve MODULE --world PATH` print the path of \
                 their socket; is one of them running?"
                    .into()
            }
            Self::Stale(path) => format!(
                "its server was killed: remove {} and start `tmcl serve` again",
                path.display()
            ),
            Self::Permission(_) => "only the user who runs `tmcl serve` may use its socket".into(),
            Self::Connect { .. } => "is it the path that `tmcl serve` prints?".into(),
            Self::Closed => format!(
                "has `tmcl serve` ended, or are there {MAX_CONTROL_CLIENTS} clients already?"
            ),
            Self::Timeout(_) => "is the server stopped, or very busy?".into(),
            Self::NotText => "is it really `tmcl serve` that listens there?".into(),
            Self::Lost(_) => "is `tmcl serve` still running?".into(),
        }
    }
}

/// A client of a [`ControlSocket`].
#[derive(Debug)]
pub struct ControlClient {
    stream: BufReader<UnixStream>,
    /// What has come of a line that is not complete yet.
    line: Vec<u8>,
}

impl ControlClient {
    /// Connects to the server that listens on `path`.
    ///
    /// # Errors
    /// When there is no socket, or nobody behind it.
    pub fn open(path: &Path) -> Result<Self, ControlClientError> {
        let stream = UnixStream::connect(path).map_err(|source| {
            let path = path.to_owned();
            let is_socket = fs::metadata(&path).map(|file| file.file_type().is_socket());
            match (source.kind(), is_socket) {
                (io::ErrorKind::NotFound, _) => ControlClientError::NoSuchSocket(path),
                (io::ErrorKind::PermissionDenied, _) => ControlClientError::Permission(path),
                (_, Ok(false)) => ControlClientError::NotASocket(path),
                (io::ErrorKind::ConnectionRefused, _) => ControlClientError::Stale(path),
                _ => ControlClientError::Connect { path, source },
            }
        })?;
        Ok(Self { stream: BufReader::new(stream), line: Vec::new() })
    }

    /// Sends one line; it must not contain a line's end.
    ///
    /// # Errors
    /// When the connection is broken.
    pub fn send(&mut self, line: &str) -> Result<(), ControlClientError> {
        let sent = self.stream.get_mut().write_all(format!("{line}\n").as_bytes());
        sent.map_err(|error| match error.kind() {
            io::ErrorKind::BrokenPipe | io::ErrorKind::ConnectionReset => {
                ControlClientError::Closed
            }
            _ => ControlClientError::Lost(error),
        })
    }

    /// The next line without its end; waits for it as long as `timeout` says, or for ever.
    ///
    /// # Errors
    /// When none comes in this time, when it is no text, and when the connection ends. After a
    /// timeout nothing is lost.
    pub fn receive(&mut self, timeout: Option<Duration>) -> Result<String, ControlClientError> {
        self.stream.get_ref().set_read_timeout(timeout).map_err(ControlClientError::Lost)?;
        match self.stream.read_until(b'\n', &mut self.line) {
            Ok(_) if self.line.pop_if(|end| *end == b'\n').is_some() => {
                String::from_utf8(std::mem::take(&mut self.line))
                    .map_err(|_| ControlClientError::NotText)
            }
            Ok(_) => Err(ControlClientError::Closed),
            Err(error) => Err(match error.kind() {
                io::ErrorKind::WouldBlock | io::ErrorKind::TimedOut => {
                    ControlClientError::Timeout(timeout.unwrap_or_default())
                }
                io::ErrorKind::ConnectionReset => ControlClientError::Closed,
                _ => ControlClientError::Lost(error),
            }),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_the_user_may_open_it_and_it_goes_at_the_end() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("world");
        let socket = ControlSocket::bind(&path).unwrap();
        assert_eq!(socket.path(), path);
        assert_eq!(fs::metadata(&path).unwrap().permissions().mode() & 0o777, 0o600);
        drop(socket);
        assert!(fs::symlink_metadata(&path).is_err());
    }

    #[test]
    fn nothing_that_exists_is_replaced() {
        let folder = tempfile::tempdir().unwrap();
        let file = folder.path().join("file");
        fs::write(&file, "precious").unwrap();
        // What a killed server leaves behind.
        let stale = folder.path().join("stale");
        drop(UnixListener::bind(&stale).unwrap());
        for path in [&file, &stale] {
            let error = ControlSocket::bind(path).unwrap_err();
            assert!(matches!(&error, ControlError::Exists(at) if at == path), "{error}");
            assert!(error.help().contains("remove"), "{}", error.help());
        }
        assert_eq!(fs::read_to_string(&file).unwrap(), "precious");

        let used = folder.path().join("used");
        let _socket = ControlSocket::bind(&used).unwrap();
        let error = ControlSocket::bind(&used).unwrap_err();
        assert!(matches!(&error, ControlError::InUse(at) if *at == used), "{error}");
    }

    #[test]
    fn what_replaced_the_socket_meanwhile_stays() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("world");
        let socket = ControlSocket::bind(&path).unwrap();
        fs::remove_file(&path).unwrap();
        fs::write(&path, "someone else's").unwrap();
        drop(socket);
        assert_eq!(fs::read_to_string(&path).unwrap(), "someone else's");
    }

    #[test]
    fn a_path_that_no_socket_can_have_is_explained() {
        let error = ControlSocket::bind(Path::new("/no/such/place")).unwrap_err();
        assert!(error.to_string().starts_with("cannot create the socket /no/such/place: "));
        let long = PathBuf::from(format!("/tmp/{}", "x".repeat(200)));
        let error = ControlSocket::bind(&long).unwrap_err();
        assert!(matches!(error, ControlError::TooLong(_)), "{error}");
    }

    #[test]
    fn what_cannot_be_connected_to_is_explained() {
        let folder = tempfile::tempdir().unwrap();
        let open = |name: &str| ControlClient::open(&folder.path().join(name)).unwrap_err();

        assert!(matches!(open("nowhere"), ControlClientError::NoSuchSocket(_)));
        fs::write(folder.path().join("file"), "").unwrap();
        assert!(matches!(open("file"), ControlClientError::NotASocket(_)));
        drop(UnixListener::bind(folder.path().join("stale")).unwrap());
        let error = open("stale");
        assert!(matches!(error, ControlClientError::Stale(_)), "{error}");
        assert!(error.help().contains("remove"), "{}", error.help());
    }
}
