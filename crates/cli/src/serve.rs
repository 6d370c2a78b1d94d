//! `tmcl serve`: a virtual module that any TMCL client can connect to.

use std::io::{self, Write};
use std::net::SocketAddr;
use std::os::unix::net::UnixStream;
use std::path::{Path, PathBuf};

use embedded_storage::nor_flash::NorFlash;
use opentmcl_catalog::Module;
use opentmcl_firmware::{Line, Port};
use opentmcl_link::{Device, Endpoint, FileFlash, Listener, Peer, Pty, Server, Speed};
use opentmcl_virtual::VirtualModule;
use opentmcl_virtual::flash::{FLASH_SIZE, MemoryFlash, PAGE_SIZE, WORD_SIZE};
use opentmcl_wire::Instant;
use opentmcl_wire::serial::{FRAME_LEN, Request, WrongChecksum};
use serde::Serialize;
use signal_hook::consts::{SIGINT, SIGTERM};

use crate::failure::Failure;
use crate::lookup;
use crate::print;
use crate::virtual_args::VirtualArgs;

/// Run a virtual module in real time until Ctrl-C
///
/// Software that talks to real modules connects to it unchanged. Without --pty and --tcp it is
/// served on both. The pseudo terminal behaves as the module's USB port, a TCP connection as its
/// RS485 bus.
#[derive(clap::Args)]
#[command(after_help = EXAMPLES)]
pub(crate) struct Args {
    /// Name of the module, see `tmcl modules`
    module: String,
    /// Serve on a serial port; PATH becomes a link to it while the module runs
    #[arg(long, value_name = "PATH", num_args = 0..=1)]
    pty: Option<Option<PathBuf>>,
    /// Serve on TCP: HOST:PORT, HOST or PORT [default: 127.0.0.1 and a free port]
    #[arg(long, value_name = "ADDR", num_args = 0..=1)]
    tcp: Option<Option<String>>,
    /// Keep the EEPROM in this file, which is created if it is missing [default: in memory]
    #[arg(long, value_name = "FILE")]
    eeprom: Option<PathBuf>,
    /// Let time pass for the module this many times as fast, 0.001..1000
    #[arg(long, value_name = "FACTOR", default_value = "1", value_parser = parse_speed)]
    speed: Speed,
    #[command(flatten)]
    virtual_module: VirtualArgs,
    /// Print the endpoints as one line of JSON
    #[arg(long)]
    json: bool,
}

const EXAMPLES: &str = "\
Examples:
  tmcl serve tmcm-6214
  tmcl serve tmcm-6214 --pty /tmp/stage --eeprom stage.bin
  tmcl serve tmcm-6214 --tcp 127.0.0.1:4016 --speed 10";

fn parse_speed(text: &str) -> Result<Speed, String> {
    text.parse()
        .ok()
        .and_then(Speed::new)
        .ok_or_else(|| format!("write a number from {} to {}", Speed::MIN, Speed::MAX))
}

/// Serves the module until SIGINT or SIGTERM.
pub(crate) fn run(args: &Args) -> Result<(), Failure> {
    let model = lookup::module(&args.module)?;
    let options = args.virtual_module.options();
    match &args.eeprom {
        Some(path) => {
            let flash = FileFlash::<FLASH_SIZE, PAGE_SIZE, WORD_SIZE>::open(path)?;
            serve(args, model, VirtualModule::with_flash(model, flash, options))
        }
        None => serve(args, model, VirtualModule::with_flash(model, MemoryFlash::new(), options)),
    }
}

fn serve<F: NorFlash>(
    args: &Args,
    model: &'static Module,
    module: VirtualModule<F>,
) -> Result<(), Failure> {
    // Before anybody can know that the module is there and send the first signal.
    let stop = stop_signal()
        .map_err(|error| Failure::new(format!("cannot listen to signals: {error}")))?;
    let both = args.pty.is_none() && args.tcp.is_none();
    let pty = match &args.pty {
        Some(path) => Some(Pty::open(path.as_deref())?),
        None if both => Some(Pty::open(None)?),
        None => None,
    };
    let listener = match &args.tcp {
        Some(address) => Some(Listener::bind(address.as_deref().unwrap_or("127.0.0.1"))?),
        None if both => Some(Listener::bind("127.0.0.1")?),
        None => None,
    };
    let endpoints = Endpoints {
        module: model.name,
        firmware: lookup::version(model.firmware),
        pty: pty.as_ref().map(|pty| pty.path().to_owned()),
        tcp: listener.as_ref().map(Listener::address),
    };
    announce(args, model, &endpoints)?;
    Server::new(Served(module), pty, listener)
        .run(stop, args.speed)
        .map_err(|error| Failure::new(format!("cannot wait for clients: {error}")))
}

/// Becomes readable with the first signal that shall end the program.
fn stop_signal() -> io::Result<UnixStream> {
    let (stop, signal) = UnixStream::pair()?;
    for number in [SIGINT, SIGTERM] {
        signal_hook::low_level::pipe::register(number, signal.try_clone()?)?;
    }
    Ok(stop)
}

/// What `--json` prints.
#[derive(Serialize)]
struct Endpoints {
    module: &'static str,
    firmware: String,
    pty: Option<PathBuf>,
    tcp: Option<SocketAddr>,
}

fn announce(args: &Args, model: &Module, endpoints: &Endpoints) -> Result<(), Failure> {
    let mut out = anstream::stdout().lock();
    if args.json {
        print::json_line(&mut out, endpoints)?;
    } else {
        print(&mut out, model, endpoints)?;
    }
    out.flush()?;
    Ok(())
}

fn print(out: &mut impl Write, model: &Module, endpoints: &Endpoints) -> io::Result<()> {
    let Endpoints { firmware, pty, tcp, .. } = endpoints;
    writeln!(out, "Virtual {}, firmware {firmware}. Ctrl-C ends it.", model.title)?;
    let pty = pty.as_deref().map(Path::display);
    if let Some(path) = &pty {
        writeln!(out, "\n  serial port   {path}")?;
        writeln!(out, "    tmcl exec -c {path} 'ROR 0, 51200'")?;
        writeln!(out, "    ConnectionManager(\"--interface serial_tmcl --port {path}\")")?;
    }
    if let Some(address) = tcp {
        writeln!(out, "\n  TCP           {address}")?;
        writeln!(out, "    tmcl exec -c tcp:{address} 'ROR 0, 51200'")?;
        writeln!(
            out,
            "    ConnectionManager(\"--interface socket_serial_tmcl --port {address}\")"
        )?;
    }
    writeln!(out, "\nConnectionManager is PyTrinamic's, from pytrinamic.connections.")
}

/// A virtual module as the server sees it.
struct Served<F: NorFlash>(VirtualModule<F>);

impl<F: NorFlash> Device for Served<F> {
    fn next_event(&mut self) -> Option<Instant> {
        self.0.next_event()
    }

    fn advance_to(&mut self, now: Instant) {
        self.0.advance_to(now);
    }

    fn receive(&mut self, from: Peer, request: Result<Request, WrongChecksum>) {
        let line = match from.endpoint {
            Endpoint::Pty => Line::Usb,
            Endpoint::Tcp => Line::Rs485,
        };
        self.0.receive(Port { line, number: from.number }, request);
    }

    fn transmit(&mut self) -> Option<(Peer, [u8; FRAME_LEN])> {
        let (port, frame) = self.0.transmit()?;
        let endpoint = match port.line {
            Line::Usb => Endpoint::Pty,
            Line::Rs485 | Line::Rs232 => Endpoint::Tcp,
        };
        Some((Peer { endpoint, number: port.number }, frame))
    }
}
