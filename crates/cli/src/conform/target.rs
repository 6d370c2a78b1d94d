//! A module behind a connection, for transcripts.

use std::time::Instant;

use opentmcl_conform::{Line, Moment, ScenarioFile, Target, TargetError};
use opentmcl_link::{Client, Connection, ConnectionError, PortUri};
use opentmcl_wire::serial::FRAME_LEN;
use opentmcl_wire::{Command, Duration, control};

/// A module behind a port of this machine or a socket.
pub(super) struct ConnectedModule {
    port: PortUri,
    client: Client,
    since: Instant,
}

/// How long a module that restarts may be away; on USB it goes and comes as a device.
const RESTART: std::time::Duration = std::time::Duration::from_secs(10);
/// How long nothing is asked while a condition is awaited.
const CONDITION_PAUSE: Duration = Duration::from_millis(5);
/// How long to wait between two attempts to reach it again.
const PAUSE: std::time::Duration = std::time::Duration::from_millis(500);

impl ConnectedModule {
    /// Opens the port.
    pub(super) fn open(port: &PortUri) -> Result<Self, ConnectionError> {
        Ok(Self { port: port.clone(), client: Client::open(port)?, since: Instant::now() })
    }

    /// Restarts the module, so that all it has in RAM is as after power-up.
    pub(super) fn restart(&mut self) -> Result<(), ConnectionError> {
        self.execute(Command::new(control::STOP_PROGRAM, 0, 0, 0))?;
        // The reply does not always get through (firmware manual 3.6.58).
        let _: Result<(), ConnectionError> =
            self.execute(Command::new(control::SOFTWARE_RESET, 0, 0, control::CONFIRMATION));
        let start = Instant::now();
        loop {
            std::thread::sleep(PAUSE);
            match self.reopen() {
                Err(_) if start.elapsed() < RESTART => {}
                result => return result,
            }
        }
    }

    fn execute(&mut self, command: Command) -> Result<(), ConnectionError> {
        self.client.request(opentmcl_conform::transcript::DEFAULT_ADDRESS, command).map(drop)
    }

    /// Opens the port again, and waits until the module behind it answers.
    fn reopen(&mut self) -> Result<(), ConnectionError> {
        if self.execute(Command::new(control::STOP_PROGRAM, 0, 0, 0)).is_ok() {
            return Ok(());
        }
        self.client = Client::open(&self.port)?;
        self.execute(Command::new(control::STOP_PROGRAM, 0, 0, 0))
    }
}

impl From<Broken> for TargetError {
    fn from(Broken(error): Broken) -> Self {
        Self::Broken(error.to_string())
    }
}

struct Broken(ConnectionError);

fn unable(what: &str) -> TargetError {
    TargetError::Unable(format!("{what} only on a virtual module in this program"))
}

impl Target for ConnectedModule {
    fn send(&mut self, line: Option<Line>, frame: [u8; FRAME_LEN]) -> Result<(), TargetError> {
        // A serial port does not tell whether USB, RS485 or RS232 is behind it.
        let is_tcp = matches!(self.port, PortUri::Tcp { .. });
        if line.is_some() && !(is_tcp && line == Some(Line::Rs485)) {
            return Err(unable("the line can be chosen"));
        }
        Ok(self.client.send(&frame).map_err(Broken)?)
    }

    fn receive(&mut self, timeout: Duration) -> Result<Option<[u8; FRAME_LEN]>, TargetError> {
        // Without any time nothing would be read.
        let timeout = std::time::Duration::from_micros(timeout.as_micros().max(1000));
        Ok(self.client.receive(timeout).map_err(Broken)?)
    }

    fn wait(&mut self, time: Duration) -> Result<(), TargetError> {
        std::thread::sleep(std::time::Duration::from_micros(time.as_micros()));
        Ok(())
    }

    fn pause(&mut self, at_most: Duration) -> Result<(), TargetError> {
        self.wait(at_most.min(CONDITION_PAUSE))
    }

    fn moment(&mut self) -> Moment {
        let micros = u64::try_from(self.since.elapsed().as_micros()).unwrap_or(u64::MAX);
        Moment { time: Duration::from_micros(micros), program: None }
    }

    fn power_cycle(&mut self) -> Result<(), TargetError> {
        Err(unable("the power can be switched"))
    }

    fn set_input(&mut self, _: u8, _: bool) -> Result<(), TargetError> {
        Err(unable("an input can be set"))
    }

    fn set_analog(&mut self, _: u8, _: u16) -> Result<(), TargetError> {
        Err(unable("an input can be set"))
    }

    fn scenario(&mut self, _: &ScenarioFile) -> Result<(), TargetError> {
        Err(unable("there is a scenario"))
    }

    fn world(&mut self, _: &str) -> Result<(), TargetError> {
        Err(unable("something can be done from outside"))
    }

    fn stage(&mut self, _: u8, _: &str) -> Result<Option<f64>, TargetError> {
        Err(unable("it can be known where the stage is"))
    }

    fn fresh(&mut self) -> Result<(), TargetError> {
        Ok(self.restart().map_err(Broken)?)
    }
}
