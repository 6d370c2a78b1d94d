//! `tmcl serve`: virtual modules that any TMCL client can connect to.

mod announce;
mod device;
mod eeprom;
mod faults;

use std::io::{self, Write};
use std::os::unix::net::UnixStream;
use std::path::{Path, PathBuf};

use opentmcl_link::{ControlSocket, FileFlash, Listener, NewPort, Pty, Server, Speed, Transport};
use opentmcl_virtual::flash::MemoryFlash;
use opentmcl_virtual::{Lab, ModuleSetup, PortKind, PortSetup, Scenario};
use signal_hook::consts::{SIGINT, SIGTERM};
use tempfile::TempDir;

use crate::failure::Failure;
use crate::virtual_args::VirtualArgs;
use crate::{lookup, scenario};
use announce::Announcement;
use device::Served;
use eeprom::Eeprom;
use faults::PortFaults;

/// Run virtual modules in real time until Ctrl-C
///
/// Software that talks to real modules connects to them unchanged. A scenario describes one or more
/// modules and the machines behind their axes. Without --pty and --tcp, and without ports in the
/// scenario, a module is served on both. The pseudo terminal behaves as the module's USB port, a TCP
/// connection as its RS485 bus.
#[derive(clap::Args)]
#[command(after_help = EXAMPLES)]
pub(crate) struct Args {
    /// Name of a module, see `tmcl modules`, or a file SCENARIO.toml
    #[arg(value_name = "MODULE|SCENARIO")]
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
    /// Faults of the lines, of all or of one port: drop=0.01,seed=7 or tcp:delay=20ms@0.1
    #[arg(long, value_name = "[PORT:]SPEC", value_parser = faults::parse_option)]
    faults: Vec<PortFaults>,
    /// Serve the world around the modules on a local socket [default for a scenario: a new path]
    #[arg(long, value_name = "PATH", num_args = 0..=1)]
    world: Option<Option<PathBuf>>,
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
  tmcl serve tmcm-6214 --tcp 127.0.0.1:4016 --speed 10
  tmcl serve tmcm-6214 --faults drop=0.001,corrupt=1/1000,seed=7
  tmcl serve lab.toml --world /tmp/lab";

fn parse_speed(text: &str) -> Result<Speed, String> {
    text.parse()
        .ok()
        .and_then(Speed::new)
        .ok_or_else(|| format!("write a number from {} to {}", Speed::MIN, Speed::MAX))
}

/// Serves the modules until SIGINT or SIGTERM.
pub(crate) fn run(args: &Args) -> Result<(), Failure> {
    let is_plain = !names_a_file(&args.module);
    let mut scenario = if is_plain {
        Scenario::of_model(lookup::module(&args.module)?)
    } else {
        read_scenario(&args.module)?
    };
    apply_options(args, &mut scenario)?;
    faults::check(&scenario)?;
    // Before anybody can know that the modules are there and send the first signal.
    let stop = stop_signal()
        .map_err(|error| Failure::new(format!("cannot listen to signals: {error}")))?;
    let lab = Lab::with_flashes(scenario.clone(), args.virtual_module.options(), open_eeprom)?;
    let ports = open_ports(args, &scenario)?;
    let world = open_world(args, is_plain)?;
    let announcement = Announcement {
        scenario: &scenario,
        is_plain,
        ports: &ports,
        world: world.as_ref().map(|(socket, _)| socket.path().to_owned()),
    };
    announce(args, &announcement)?;
    let (socket, _folder) = world.unzip();
    Server::new(Served::new(lab, args.speed), ports, socket)
        .run(stop, args.speed)
        .map_err(|error| Failure::new(format!("cannot wait for clients: {error}")))
}

/// No module has such a name.
fn names_a_file(text: &str) -> bool {
    text.contains('/') || Path::new(text).extension().is_some_and(|extension| extension == "toml")
}

/// Reads a scenario. The files and links that it names are in its folder.
fn read_scenario(path: &str) -> Result<Scenario, Failure> {
    let mut scenario = scenario::load(Path::new(path))?;
    let folder = Path::new(path).parent().unwrap_or(Path::new(""));
    for module in &mut scenario.modules {
        module.eeprom = module.eeprom.take().map(|file| folder.join(file));
        for port in &mut module.ports {
            if let PortKind::Pty(Some(link)) = &mut port.kind {
                *link = folder.join(&link);
            }
        }
    }
    Ok(scenario)
}

/// Lets the command line have its say about where the modules are served.
fn apply_options(args: &Args, scenario: &mut Scenario) -> Result<(), Failure> {
    match scenario.modules.as_mut_slice() {
        [module] => {
            if args.eeprom.is_some() {
                module.eeprom.clone_from(&args.eeprom);
            }
            if args.pty.is_some() || args.tcp.is_some() {
                module.ports.clear();
            }
            let pty = args.pty.clone().map(PortKind::Pty);
            let tcp = args.tcp.clone();
            let tcp = tcp.map(|tcp| PortKind::Tcp(tcp.unwrap_or_else(|| "127.0.0.1".to_owned())));
            module.ports.extend(pty.into_iter().chain(tcp).map(port));
        }
        _ if args.eeprom.is_some() || args.pty.is_some() || args.tcp.is_some() => {
            return Err(Failure::usage("--pty, --tcp and --eeprom are for one module")
                .help("write [[module.port]] and eeprom = \"FILE\" into the scenario"));
        }
        _ => {}
    }
    for module in &mut scenario.modules {
        if module.ports.is_empty() {
            let both = [PortKind::Pty(None), PortKind::Tcp("127.0.0.1".to_owned())];
            module.ports.extend(both.map(port));
        }
    }
    Ok(())
}

/// A port with the name of its kind.
fn port(kind: PortKind) -> PortSetup {
    let name = match kind {
        PortKind::Pty(_) => "pty",
        PortKind::Tcp(_) => "tcp",
    };
    PortSetup { name: name.to_owned(), kind, faults: None, line: 0 }
}

fn open_eeprom(module: &ModuleSetup) -> Result<Eeprom, Failure> {
    Ok(match &module.eeprom {
        Some(path) => Eeprom::File(FileFlash::open(path)?),
        None => Eeprom::Memory(MemoryFlash::new()),
    })
}

fn open_ports(args: &Args, scenario: &Scenario) -> Result<Vec<NewPort>, Failure> {
    let mut ports = Vec::new();
    for (module, setup) in scenario.modules.iter().enumerate() {
        for PortSetup { name, kind, faults, .. } in &setup.ports {
            let transport = match kind {
                PortKind::Pty(link) => Transport::Pty(Pty::open(link.as_deref())?),
                PortKind::Tcp(address) => Transport::Tcp(Listener::bind(address)?),
            };
            let faults = match faults {
                Some(spec) => faults::parse(spec).map_err(Failure::new)?,
                None => Default::default(),
            };
            ports.push(NewPort { module, name: name.clone(), transport, faults });
        }
    }
    for PortFaults { port, faults } in &args.faults {
        let is_meant = |name: &String| port.as_ref().is_none_or(|port| port == name);
        if !ports.iter().any(|port| is_meant(&port.name)) {
            let mut names: Vec<&str> = ports.iter().map(|port| port.name.as_str()).collect();
            names.dedup();
            let wrong = port.as_deref().unwrap_or_default();
            return Err(Failure::usage(format!("--faults: there is no port {wrong:?}"))
                .help(format!("the ports are {}", names.join(", "))));
        }
        let meant = ports.iter_mut().filter(|port| is_meant(&port.name));
        meant.for_each(|port| port.faults = *faults);
    }
    Ok(ports)
}

/// The socket to the world, and the folder that was made for it.
fn open_world(
    args: &Args,
    is_plain: bool,
) -> Result<Option<(ControlSocket, Option<TempDir>)>, Failure> {
    match &args.world {
        Some(Some(path)) => Ok(Some((ControlSocket::bind(path)?, None))),
        None if is_plain => Ok(None),
        Some(None) | None => {
            // Both are folders of this user alone: the one that the system has for such things, and
            // the new one.
            let base = std::env::var_os("XDG_RUNTIME_DIR").map(PathBuf::from);
            let base = base.filter(|base| base.is_dir()).unwrap_or_else(std::env::temp_dir);
            let folder =
                tempfile::Builder::new().prefix("tmcl-").tempdir_in(&base).map_err(|error| {
                    let base = base.display();
                    Failure::new(format!("cannot make a folder in {base}: {error}"))
                        .help("choose a path for the socket: --world PATH")
                })?;
            let socket = ControlSocket::bind(&folder.path().join("world"))?;
            Ok(Some((socket, Some(folder))))
        }
    }
}

/// Becomes readable with the first signal that shall end the program.
fn stop_signal() -> io::Result<UnixStream> {
    let (stop, signal) = UnixStream::pair()?;
    for number in [SIGINT, SIGTERM] {
        signal_hook::low_level::pipe::register(number, signal.try_clone()?)?;
    }
    Ok(stop)
}

fn announce(args: &Args, announcement: &Announcement<'_>) -> Result<(), Failure> {
    let mut out = anstream::stdout().lock();
    if args.json {
        announcement.json(&mut out)?;
    } else {
        announcement.text(&mut out)?;
    }
    out.flush()?;
    Ok(())
}
