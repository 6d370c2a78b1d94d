//! The module under test, and the time at which it is asked.

use std::time::Instant as HostInstant;

use opentmcl_catalog::AxisParameter;
use opentmcl_link::{Client, Connection, Uri};
use opentmcl_wire::{Command, Duration, Instant, Opcode, Reply, control};

use crate::connect::ConnectArgs;
use crate::failure::Failure;
use crate::local::LocalModule;
use crate::scenario;

/// The only motor of a servo module.
const MOTOR: u8 = 0;

/// A module that is asked at known times.
pub(super) struct Line {
    module: Way,
    address: u8,
}

enum Way {
    /// Its time is moved by whoever asks.
    Virtual(Box<LocalModule>),
    /// Its time is that of this machine.
    Port(Client, HostInstant),
}

impl Line {
    pub(super) fn open(args: &ConnectArgs) -> Result<Self, Failure> {
        let module = match args.uri() {
            Uri::Virtual(name) => {
                Way::Virtual(Box::new(LocalModule::new(&scenario::module(name)?)))
            }
            Uri::Port(port) => Way::Port(Client::open(port)?, HostInstant::now()),
        };
        Ok(Self { module, address: args.address })
    }

    pub(super) fn is_virtual(&self) -> bool {
        matches!(self.module, Way::Virtual(_))
    }

    /// Time since the line was opened.
    pub(super) fn now(&self) -> Duration {
        match &self.module {
            Way::Virtual(module) => module.now() - Instant::from_ticks(0),
            Way::Port(_, start) => Duration::from_micros(
                u64::try_from(start.elapsed().as_micros()).unwrap_or(u64::MAX),
            ),
        }
    }

    /// Lets time pass until then, if it has not.
    pub(super) fn wait_until(&mut self, time: Duration) {
        let now = self.now();
        if time <= now {
            return;
        }
        let left = time - now;
        match &mut self.module {
            Way::Virtual(module) => module.advance(left),
            Way::Port(..) => std::thread::sleep(std::time::Duration::from_micros(left.as_micros())),
        }
    }

    fn request(&mut self, command: Command) -> Result<Reply, Failure> {
        Ok(match &mut self.module {
            Way::Virtual(module) => module.request(self.address, command)?,
            Way::Port(client, _) => client.request(self.address, command)?,
        })
    }

    /// Executes a command that the module must take.
    fn execute(&mut self, command: Command) -> Result<i32, Failure> {
        let reply = self.request(command)?;
        if reply.status.is_ok() {
            return Ok(reply.value);
        }
        let message = format!("{command}: the module answers with status {}", reply.status);
        Err(Failure::new(message))
    }

    /// Number of the module, if it tells it.
    pub(super) fn module_number(&mut self) -> Result<Option<u16>, Failure> {
        let reply = self.request(Command::new(control::FIRMWARE_VERSION, 1, 0, 0))?;
        let [high, low, ..] = reply.value.to_be_bytes();
        Ok(reply.status.is_ok().then_some(u16::from_be_bytes([high, low])))
    }

    pub(super) fn read(&mut self, row: &AxisParameter) -> Result<i32, Failure> {
        self.execute(Command::new(Opcode::Gap.number(), row.number, MOTOR, 0))
    }

    pub(super) fn write(&mut self, row: &AxisParameter, value: i32) -> Result<(), Failure> {
        self.execute(Command::new(Opcode::Sap.number(), row.number, MOTOR, value)).map(drop)
    }

    /// Stops the motor.
    pub(super) fn stop(&mut self) -> Result<(), Failure> {
        self.execute(Command::new(Opcode::Mst.number(), 0, MOTOR, 0)).map(drop)
    }
}
