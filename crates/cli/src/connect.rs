//! The module that a subcommand talks to, as every one of them is told.

use opentmcl_link::program::Programmer;
use opentmcl_link::{Client, Connection, Uri};
use opentmcl_wire::limits::PROGRAM_LEN;

use crate::failure::Failure;
use crate::local::LocalModule;
use crate::{lookup, scenario};

/// Options of every subcommand that talks to a module.
#[derive(clap::Args)]
pub(crate) struct ConnectArgs {
    /// Module: /dev/ttyACM0, serial:PATH?baud=N, tcp:HOST:PORT, virtual:NAME or virtual:SCENARIO.toml
    #[arg(short, long, value_name = "URI", value_parser = lookup::uri)]
    connect: Uri,
    /// Address of the module
    #[arg(long, value_name = "N", default_value_t = 1)]
    pub(crate) address: u8,
}

impl ConnectArgs {
    /// Opens the port, or switches a new virtual module on.
    pub(crate) fn open(&self) -> Result<Box<dyn Connection>, Failure> {
        Ok(match &self.connect {
            Uri::Virtual(name) => Box::new(LocalModule::new(&scenario::module(name)?)),
            Uri::Port(port) => Box::new(Client::open(port)?),
        })
    }

    /// What is to be connected, for those who do it themselves.
    pub(crate) fn uri(&self) -> &Uri {
        &self.connect
    }

    /// The program on the module behind this connection.
    pub(crate) fn programmer<'a>(
        &self,
        connection: &'a mut dyn Connection,
    ) -> Result<Programmer<'a>, Failure> {
        Ok(Programmer::open(connection, self.address, PROGRAM_LEN)?)
    }
}
