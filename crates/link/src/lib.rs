//! Ports and clients: how bytes reach a module and how replies come back.
//!
//! Two sides meet here, and neither knows the other:
//!
//! - The module's side. A [`Server`] runs one [`Device`] in real time and serves it over a pseudo
//!   terminal ([`Pty`]) and TCP ([`Listener`]). [`Clock`] turns real time into the device's time;
//!   [`FileFlash`] keeps its EEPROM in a file.
//! - The client's side. A [`Uri`] names a connection, [`Client`] opens it, and [`Connection`] is
//!   what every way of talking to a module can do. A [`program::Programmer`] brings programs onto
//!   a module over any of them, however bad the line.
//!
//! Besides the command line this is the only room that knows operating systems.

pub mod faults;
pub mod program;

mod clock;
mod connection;
mod eeprom_file;
mod pty;
mod server;
mod tcp;
mod uri;

pub use clock::{Clock, Speed};
pub use connection::{Client, Connection, ConnectionError, DEFAULT_TIMEOUT, answers_with_text};
pub use eeprom_file::{EepromFileError, FileFlash, FlashError};
pub use pty::{Pty, PtyError};
pub use server::{Device, Endpoint, Peer, Server};
pub use tcp::{Listener, MAX_CONNECTIONS, TcpError};
pub use uri::{DEFAULT_BAUD, PortUri, Uri, UriError};
