//! The name of a connection, the same on every command line: `tcp:127.0.0.1:4016`.

use std::fmt;
use std::path::PathBuf;
use std::str::FromStr;

/// Bits per second of a serial port unless the name says otherwise: the modules' factory setting.
/// On USB it does not matter.
pub const DEFAULT_BAUD: u32 = 9600;

/// What a connection leads to.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Uri {
    /// `virtual:NAME`: a new virtual module inside the program, of the catalogue, or of a scenario:
    /// `virtual:lab.toml`, `virtual:lab.toml#name`.
    Virtual(String),
    /// Anything outside of the program.
    Port(PortUri),
}

/// A port of this machine or a socket.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum PortUri {
    /// `serial:PATH`, `serial:PATH?baud=N`, or just the path if it begins with `/` or `.`.
    Serial {
        /// The device.
        path: PathBuf,
        /// Bits per second.
        baud: u32,
    },
    /// `tcp:HOST:PORT`.
    Tcp {
        /// Name or address, IPv6 in brackets.
        host: String,
        /// Port.
        port: u16,
    },
}

/// Why a text names no connection.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum UriError {
    /// It begins with nothing that is known.
    #[error("{0:?} names no connection")]
    UnknownScheme(String),
    /// `virtual:` without a name.
    #[error("the name of a module is missing after \"virtual:\"")]
    NoModule,
    /// `serial:` without a path.
    #[error("the path of a port is missing after \"serial:\"")]
    NoPath,
    /// What follows the question mark is not `baud=N`.
    #[error("{0:?} is not a setting of a serial port")]
    Setting(String),
    /// `tcp:` without both a host and a port of 1..=65535.
    #[error("{0:?} is not a host and a port")]
    HostPort(String),
}

impl UriError {
    /// What would be right.
    pub fn help(&self) -> &'static str {
        match self {
            Self::UnknownScheme(_) => {
                "write /dev/ttyACM0, serial:/dev/ttyUSB0?baud=115200, tcp:127.0.0.1:4016 or \
                 virtual:tmcm-6214"
            }
            Self::NoModule => {
                "write for example virtual:tmcm-6214, `tmcl modules` lists them, or virtual:lab.toml"
            }
            Self::NoPath => "write for example serial:/dev/ttyACM0",
            Self::Setting(_) => "write for example serial:/dev/ttyUSB0?baud=115200",
            Self::HostPort(_) => "write for example tcp:127.0.0.1:4016",
        }
    }
}

impl FromStr for Uri {
    type Err = UriError;

    fn from_str(text: &str) -> Result<Self, UriError> {
        if text.starts_with(['/', '.']) {
            return Ok(Self::Port(serial(text)?));
        }
        match text.split_once(':') {
            Some(("virtual", "")) => Err(UriError::NoModule),
            Some(("virtual", name)) => Ok(Self::Virtual(name.to_owned())),
            Some(("serial", "")) => Err(UriError::NoPath),
            Some(("serial", rest)) => Ok(Self::Port(serial(rest)?)),
            Some(("tcp", rest)) => Ok(Self::Port(tcp(rest)?)),
            _ => Err(UriError::UnknownScheme(text.to_owned())),
        }
    }
}

fn serial(text: &str) -> Result<PortUri, UriError> {
    let (path, baud) = match text.split_once('?') {
        None => (text, DEFAULT_BAUD),
        Some((path, setting)) => {
            let baud = setting.strip_prefix("baud=").and_then(|baud| baud.parse().ok());
            let baud = baud.filter(|&baud| baud > 0);
            (path, baud.ok_or_else(|| UriError::Setting(setting.to_owned()))?)
        }
    };
    if path.is_empty() {
        return Err(UriError::NoPath);
    }
    Ok(PortUri::Serial { path: PathBuf::from(path), baud })
}

fn tcp(text: &str) -> Result<PortUri, UriError> {
    let wrong = || UriError::HostPort(text.to_owned());
    let (host, port) = text.rsplit_once(':').ok_or_else(wrong)?;
    let port = port.parse().ok().filter(|&port| port > 0).ok_or_else(wrong)?;
    let bracketed = host.starts_with('[') && host.ends_with(']');
    if host.is_empty() || (host.contains(':') && !bracketed) {
        return Err(wrong());
    }
    Ok(PortUri::Tcp { host: host.to_owned(), port })
}

impl fmt::Display for Uri {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Virtual(name) => write!(f, "virtual:{name}"),
            Self::Port(port) => port.fmt(f),
        }
    }
}

impl fmt::Display for PortUri {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Serial { path, baud: DEFAULT_BAUD } => write!(f, "serial:{}", path.display()),
            Self::Serial { path, baud } => write!(f, "serial:{}?baud={baud}", path.display()),
            Self::Tcp { host, port } => write!(f, "tcp:{host}:{port}"),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn port(path: &str, baud: u32) -> Uri {
        Uri::Port(PortUri::Serial { path: path.into(), baud })
    }

    fn socket(host: &str, port: u16) -> Uri {
        Uri::Port(PortUri::Tcp { host: host.into(), port })
    }

    #[track_caller]
    fn reads(text: &str, expected: Uri) {
        let uri: Uri = text.parse().unwrap();
        assert_eq!(uri, expected, "{text}");
        assert_eq!(uri.to_string().parse(), Ok(uri));
    }

    #[test]
    fn every_form_is_read() {
        reads("virtual:tmcm-6214", Uri::Virtual("tmcm-6214".into()));
        reads("/dev/ttyACM0", port("/dev/ttyACM0", 9600));
        reads("./module", port("./module", 9600));
        reads("serial:/dev/ttyUSB0?baud=115200", port("/dev/ttyUSB0", 115_200));
        reads("/dev/ttyUSB0?baud=57600", port("/dev/ttyUSB0", 57_600));
        reads("serial:module", port("module", 9600));
        reads("tcp:127.0.0.1:4016", socket("127.0.0.1", 4016));
        reads("tcp:[::1]:4016", socket("[::1]", 4016));
        reads("tcp:lab.example:4016", socket("lab.example", 4016));
    }

    #[test]
    fn errors_say_what_would_be_right() {
        let cases = [
            ("", UriError::UnknownScheme(String::new())),
            ("usb:0", UriError::UnknownScheme("usb:0".into())),
            ("tmcm-6214", UriError::UnknownScheme("tmcm-6214".into())),
            ("virtual:", UriError::NoModule),
            ("serial:", UriError::NoPath),
            ("serial:?baud=9600", UriError::NoPath),
            ("/dev/ttyUSB0?speed=9600", UriError::Setting("speed=9600".into())),
            ("/dev/ttyUSB0?baud=0", UriError::Setting("baud=0".into())),
            ("tcp:127.0.0.1", UriError::HostPort("127.0.0.1".into())),
            ("tcp::4016", UriError::HostPort(":4016".into())),
            ("tcp:host:0", UriError::HostPort("host:0".into())),
            ("tcp:::1:4016", UriError::HostPort("::1:4016".into())),
        ];
        for (text, error) in cases {
            assert!(error.help().contains("write "));
            assert_eq!(text.parse::<Uri>(), Err(error), "{text:?}");
        }
    }
}
