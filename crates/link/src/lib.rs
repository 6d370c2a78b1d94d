//! Ports and clients: how bytes reach a module and how replies come back.
//!
//! Two sides meet here, and neither knows the other:
//!
//! - The module's side. A [`Server`] runs one [`Device`], one module or several, in real time and
//!   serves it over pseudo terminals ([`Pty`]) and TCP ([`Listener`]), with or without [`faults`] of
//!   these lines. A [`ControlSocket`] leads to the world around the modules. [`Clock`] turns real
//!   time into the device's time; [`FileFlash`] keeps an EEPROM in a file.
//! - The client's side. A [`ControlClient`] talks to a control socket. A [`Uri`] names a connection, [`Client`] opens it, and [`Connection`] is
//!   what every way of talking to a module can do. A [`program::Programmer`] brings programs onto
//!   a module over any of them, however bad the line.
//!
//! Besides the command line this is the only room that knows operating systems.

pub mod faults;
pub mod program;

mod clock;
mod connection;
mod control;
mod eeprom_file;
mod pty;
mod server;
mod tcp;
mod uri;

pub use clock::{Clock, Speed};
pub use connection::{Client, Connection, ConnectionError, DEFAULT_TIMEOUT, answers_with_text};
pub use control::{
    ControlClient, ControlClientError, ControlError, ControlSocket, MAX_CONTROL_CLIENTS,
    MAX_CONTROL_LINE,
};
pub use eeprom_file::{EepromFileError, FileFlash, FlashError};
pub use pty::{Pty, PtyError};
pub use server::{BadLine, Device, Endpoint, NewPort, Peer, ServedPort, Server, Transport};
pub use tcp::{Listener, MAX_CONNECTIONS, TcpError};
pub use uri::{DEFAULT_BAUD, PortUri, Uri, UriError};
