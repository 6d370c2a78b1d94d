//! What is printed when the modules can be connected to.

use std::io::{self, Write};
use std::net::SocketAddr;
use std::path::{Path, PathBuf};

use opentmcl_catalog::Module;
use opentmcl_link::faults::Faults;
use opentmcl_link::{NewPort, Transport};
use opentmcl_virtual::Scenario;
use serde::{Serialize, Serializer};

use crate::{lookup, print};

/// A plain module, as `--json` prints it.
#[derive(Serialize)]
struct Plain<'a> {
    module: &'static str,
    firmware: String,
    pty: Option<&'a Path>,
    tcp: Option<SocketAddr>,
    #[serde(skip_serializing_if = "Option::is_none")]
    world: Option<&'a Path>,
}

/// A scenario, as `--json` prints it.
#[derive(Serialize)]
struct Several<'a> {
    scenario: &'a str,
    modules: Vec<Served<'a>>,
    world: Option<&'a Path>,
}

/// One module of a scenario.
#[derive(Serialize)]
struct Served<'a> {
    name: &'a str,
    module: &'static str,
    firmware: String,
    /// The first port of its kind.
    pty: Option<&'a Path>,
    tcp: Option<SocketAddr>,
    ports: Vec<Port<'a>>,
}

/// One port of a module.
#[derive(Serialize)]
struct Port<'a> {
    name: &'a str,
    #[serde(flatten)]
    endpoint: Endpoint<'a>,
    #[serde(serialize_with = "as_text")]
    faults: Faults,
}

fn as_text<S: Serializer>(faults: &Faults, serializer: S) -> Result<S::Ok, S::Error> {
    serializer.collect_str(faults)
}

#[derive(Clone, Copy, Serialize)]
#[serde(rename_all = "lowercase")]
enum Endpoint<'a> {
    Pty(&'a Path),
    Tcp(SocketAddr),
}

/// Everything there is to announce.
pub(super) struct Announcement<'a> {
    pub(super) scenario: &'a Scenario,
    /// Whether the user named a module and no scenario.
    pub(super) is_plain: bool,
    pub(super) ports: &'a [NewPort],
    pub(super) world: Option<PathBuf>,
}

impl Announcement<'_> {
    fn ports(&self, module: usize) -> impl Iterator<Item = Port<'_>> {
        self.ports.iter().filter(move |port| port.module == module).map(|port| Port {
            name: &port.name,
            endpoint: match &port.transport {
                Transport::Pty(pty) => Endpoint::Pty(pty.path()),
                Transport::Tcp(listener) => Endpoint::Tcp(listener.address()),
            },
            faults: port.faults,
        })
    }

    fn pty(&self, module: usize) -> Option<&Path> {
        self.ports(module).find_map(|port| match port.endpoint {
            Endpoint::Pty(path) => Some(path),
            Endpoint::Tcp(_) => None,
        })
    }

    fn tcp(&self, module: usize) -> Option<SocketAddr> {
        self.ports(module).find_map(|port| match port.endpoint {
            Endpoint::Tcp(address) => Some(address),
            Endpoint::Pty(_) => None,
        })
    }

    /// Prints one line of JSON.
    pub(super) fn json(&self, out: &mut impl Write) -> io::Result<()> {
        let world = self.world.as_deref();
        if let [setup] = self.scenario.modules.as_slice()
            && self.is_plain
        {
            let plain = Plain {
                module: setup.model.name,
                firmware: lookup::version(setup.model.firmware),
                pty: self.pty(0),
                tcp: self.tcp(0),
                world,
            };
            return print::json_line(out, &plain);
        }
        let modules = self.scenario.modules.iter().enumerate().map(|(at, setup)| Served {
            name: &setup.name,
            module: setup.model.name,
            firmware: lookup::version(setup.model.firmware),
            pty: self.pty(at),
            tcp: self.tcp(at),
            ports: self.ports(at).collect(),
        });
        let several = Several { scenario: &self.scenario.name, modules: modules.collect(), world };
        print::json_line(out, &several)
    }

    /// Prints for people.
    pub(super) fn text(&self, out: &mut impl Write) -> io::Result<()> {
        for (at, setup) in self.scenario.modules.iter().enumerate() {
            let Module { title, firmware, .. } = setup.model;
            let firmware = lookup::version(*firmware);
            match (self.is_plain, at) {
                (true, _) => {
                    writeln!(out, "Virtual {title}, firmware {firmware}. Ctrl-C ends it.")?;
                }
                (false, 0) => {
                    let count = print::counted(self.scenario.modules.len(), "virtual module");
                    writeln!(out, "{}: {count}. Ctrl-C ends it.", self.scenario.name)?;
                }
                _ => {}
            }
            if !self.is_plain {
                writeln!(out, "\n{}: {title}, firmware {firmware}", setup.name)?;
            }
            for port in self.ports(at) {
                port.print(out, speed_to_try(setup.model))?;
            }
        }
        if let Some(path) = self.world.as_deref().map(Path::display) {
            let example = match self.scenario.modules.as_slice() {
                [_] => "press left axis 0".to_owned(),
                [first, ..] => format!("{}: press left axis 0", first.name),
                [] => "state".to_owned(),
            };
            writeln!(out, "\n  world         {path}")?;
            writeln!(out, "    tmcl world -c {path} '{example}'")?;
        }
        writeln!(out, "\nConnectionManager is PyTrinamic's, from pytrinamic.connections.")
    }
}

impl Port<'_> {
    fn print(&self, out: &mut impl Write, speed: i32) -> io::Result<()> {
        match self.endpoint {
            Endpoint::Pty(path) => {
                let path = path.display();
                writeln!(out, "\n  serial port   {path}")?;
                writeln!(out, "    tmcl exec -c {path} 'ROR 0, {speed}'")?;
                writeln!(out, "    ConnectionManager(\"--interface serial_tmcl --port {path}\")")?;
            }
            Endpoint::Tcp(address) => {
                writeln!(out, "\n  TCP           {address}")?;
                writeln!(out, "    tmcl exec -c tcp:{address} 'ROR 0, {speed}'")?;
                writeln!(
                    out,
                    "    ConnectionManager(\"--interface socket_serial_tmcl --port {address}\")"
                )?;
            }
        }
        if !self.faults.is_none() {
            writeln!(out, "    faults: {}", self.faults)?;
        }
        Ok(())
    }
}

/// A speed for a first try: a turn per second with 256 microsteps, or half of what the module has in its own
/// units.
fn speed_to_try(model: &Module) -> i32 {
    const TURN: i32 = 51_200;
    model.target_speed().map_or(TURN, |row| TURN.min(row.max / 2))
}
