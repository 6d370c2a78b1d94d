//! TCP: the serial frames of TMCL over a socket, as through an Ethernet-to-serial converter.

use std::io;
use std::net::{IpAddr, Ipv4Addr, SocketAddr, TcpListener, TcpStream, ToSocketAddrs};
use std::os::fd::{AsFd, BorrowedFd};

/// Connections that are served at the same time; one more is closed as soon as it is made.
pub const MAX_CONNECTIONS: usize = 16;

/// Why nothing listens.
#[derive(Debug, thiserror::Error)]
pub enum TcpError {
    /// The text is not an address.
    #[error("{text:?} is not an address to listen on")]
    Address {
        /// What was written.
        text: String,
    },
    /// The address cannot be had.
    #[error("cannot listen on {address}: {source}")]
    Listen {
        /// What was asked for.
        address: SocketAddr,
        /// Why not.
        source: io::Error,
    },
}

impl TcpError {
    /// What the user can do about it.
    pub fn help(&self) -> String {
        match self {
            Self::Address { .. } => {
                "write HOST:PORT, HOST or PORT, for example 127.0.0.1:4016; port 0 takes a free one"
                    .into()
            }
            Self::Listen { address, source } => match source.kind() {
                io::ErrorKind::AddrInUse => {
                    "another program listens there; choose another port, or 0 for a free one".into()
                }
                io::ErrorKind::AddrNotAvailable => {
                    format!("{} is not an address of this machine", address.ip())
                }
                io::ErrorKind::PermissionDenied => "choose a port from 1024 on".into(),
                _ => "choose another address, for example 127.0.0.1".into(),
            },
        }
    }
}

/// Accepts connections without blocking.
#[derive(Debug)]
pub struct Listener {
    listener: TcpListener,
    address: SocketAddr,
}

impl Listener {
    /// Listens on `address`: `HOST:PORT`, `HOST` (a free port) or `PORT` (of the loopback
    /// interface). Nobody but this machine can connect unless the address says otherwise.
    ///
    /// # Errors
    /// When the text is no address, or the address is in use or not this machine's.
    pub fn bind(address: &str) -> Result<Self, TcpError> {
        let address = parse(address)?;
        let failed = |source| TcpError::Listen { address, source };
        let listener = TcpListener::bind(address).map_err(failed)?;
        listener.set_nonblocking(true).map_err(failed)?;
        let address = listener.local_addr().map_err(failed)?;
        Ok(Self { listener, address })
    }

    /// The address with the port that was chosen.
    pub fn address(&self) -> SocketAddr {
        self.address
    }

    /// The next connection that waits, non-blocking and without Nagle's delay; `None` when none
    /// does or it has already gone.
    ///
    /// # Errors
    /// When the system cannot give another connection, for example for lack of file descriptors.
    pub(crate) fn accept(&self) -> io::Result<Option<TcpStream>> {
        let stream = match self.listener.accept() {
            Ok((stream, _)) => stream,
            Err(error) => {
                return match error.kind() {
                    io::ErrorKind::WouldBlock
                    | io::ErrorKind::Interrupted
                    | io::ErrorKind::ConnectionAborted
                    | io::ErrorKind::ConnectionReset => Ok(None),
                    _ => Err(error),
                };
            }
        };
        // Keep-alive finds out about a peer whose machine or cable has gone.
        let prepared = stream
            .set_nonblocking(true)
            .and_then(|()| stream.set_nodelay(true))
            .and_then(|()| Ok(rustix::net::sockopt::set_socket_keepalive(&stream, true)?));
        // A connection that fails here has been reset meanwhile.
        Ok(prepared.is_ok().then_some(stream))
    }
}

impl AsFd for Listener {
    fn as_fd(&self) -> BorrowedFd<'_> {
        self.listener.as_fd()
    }
}

fn parse(text: &str) -> Result<SocketAddr, TcpError> {
    if let Ok(port) = text.parse::<u16>() {
        return Ok(SocketAddr::from((Ipv4Addr::LOCALHOST, port)));
    }
    if let Ok(ip) = text.trim_matches(['[', ']']).parse::<IpAddr>() {
        return Ok(SocketAddr::from((ip, 0)));
    }
    let wrong = || TcpError::Address { text: text.to_owned() };
    // The system would read a lone number too large for a port as an address of the internet.
    if text.bytes().all(|byte| byte.is_ascii_digit()) {
        return Err(wrong());
    }
    let resolved =
        if text.contains(':') { text.to_socket_addrs() } else { (text, 0).to_socket_addrs() };
    resolved.ok().and_then(|mut addresses| addresses.next()).ok_or_else(wrong)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[track_caller]
    fn reads(text: &str, address: &str) {
        assert_eq!(parse(text).unwrap(), address.parse().unwrap(), "{text}");
    }

    #[test]
    fn host_and_port_may_each_be_left_out() {
        reads("127.0.0.1:4016", "127.0.0.1:4016");
        reads("0.0.0.0:4016", "0.0.0.0:4016");
        reads("127.0.0.1", "127.0.0.1:0");
        reads("4016", "127.0.0.1:4016");
        reads("[::1]:4016", "[::1]:4016");
        reads("::1", "[::1]:0");
        reads("[::1]", "[::1]:0");
    }

    #[test]
    fn what_is_no_address_is_refused_with_the_forms() {
        for text in ["", "127.0.0.1:70000", ":", "70000"] {
            let error = parse(text).unwrap_err();
            assert!(matches!(error, TcpError::Address { .. }), "{text:?}: {error}");
            assert!(error.help().contains("127.0.0.1:4016"));
        }
    }

    #[test]
    fn a_free_port_is_chosen_and_named() {
        let listener = Listener::bind("127.0.0.1").unwrap();
        assert!(listener.address().ip().is_loopback());
        assert_ne!(listener.address().port(), 0);
    }

    #[test]
    fn a_port_in_use_is_an_error_that_says_so() {
        let first = Listener::bind("127.0.0.1").unwrap();
        let error = Listener::bind(&first.address().to_string()).unwrap_err();
        assert!(error.to_string().contains(&first.address().to_string()), "{error}");
        assert!(error.help().starts_with("another program listens there"), "{}", error.help());
    }

    #[test]
    fn accepting_without_a_client_does_not_block() {
        assert!(Listener::bind("127.0.0.1").unwrap().accept().unwrap().is_none());
    }
}
