//! What transcripts run against: a virtual module in this program, or whatever a connection leads
//! to.

use opentmcl_catalog::Module;
use opentmcl_conform::{Line, Target, TargetError};
use opentmcl_firmware as firmware;
use opentmcl_link::{Client, Connection, ConnectionError, PortUri};
use opentmcl_virtual::VirtualModule;
use opentmcl_wire::serial::{self, FRAME_LEN};
use opentmcl_wire::{Command, Duration, control};

/// A virtual module in virtual time.
pub(super) struct InProcessModule {
    model: &'static Module,
    module: VirtualModule,
}

impl InProcessModule {
    /// A new module as it leaves the factory.
    pub(super) fn new(model: &'static Module) -> Self {
        Self { model, module: VirtualModule::new(model) }
    }
}

impl Target for InProcessModule {
    fn send(&mut self, line: Option<Line>, frame: [u8; FRAME_LEN]) -> Result<(), TargetError> {
        let line = match line {
            None | Some(Line::Usb) => firmware::Line::Usb,
            Some(Line::Rs485) => firmware::Line::Rs485,
            Some(Line::Rs232) => firmware::Line::Rs232,
        };
        self.module.receive(firmware::Port::new(line), serial::decode_request(frame));
        Ok(())
    }

    fn receive(&mut self, timeout: Duration) -> Result<Option<[u8; FRAME_LEN]>, TargetError> {
        let end = self.module.now() + timeout;
        loop {
            if let Some((_, frame)) = self.module.transmit() {
                return Ok(Some(frame));
            }
            match self.module.next_event() {
                Some(event) if event <= end => self.module.advance_to(event),
                _ if self.module.now() < end => self.module.advance_to(end),
                _ => return Ok(None),
            }
        }
    }

    fn wait(&mut self, time: Duration) -> Result<(), TargetError> {
        self.module.advance(time);
        Ok(())
    }

    fn power_cycle(&mut self) -> Result<(), TargetError> {
        self.module.power_cycle();
        Ok(())
    }

    fn set_input(&mut self, number: u8, high: bool) -> Result<(), TargetError> {
        self.module.set_digital_input(number, high);
        Ok(())
    }

    fn set_analog(&mut self, number: u8, reading: u16) -> Result<(), TargetError> {
        self.module.board_mut().set_analog_input(number, reading);
        self.module.hardware_changed();
        Ok(())
    }

    fn fresh(&mut self) -> Result<(), TargetError> {
        self.module = VirtualModule::new(self.model);
        Ok(())
    }
}

/// A module behind a port of this machine or a socket.
pub(super) struct ConnectedModule {
    port: PortUri,
    client: Client,
}

/// What a software reset must be asked for with.
const CONFIRMATION: i32 = 1234;

/// How long a module that restarts may be away; on USB it goes and comes as a device.
const RESTART: std::time::Duration = std::time::Duration::from_secs(10);
/// How long to wait between two attempts to reach it again.
const PAUSE: std::time::Duration = std::time::Duration::from_millis(500);

impl ConnectedModule {
    /// Opens the port.
    pub(super) fn open(port: &PortUri) -> Result<Self, ConnectionError> {
        Ok(Self { port: port.clone(), client: Client::open(port)? })
    }

    /// Restarts the module, so that all it has in RAM is as after power-up.
    pub(super) fn restart(&mut self) -> Result<(), ConnectionError> {
        self.execute(Command::new(control::STOP_PROGRAM, 0, 0, 0))?;
        // The reply does not always get through (firmware manual 3.6.58).
        let _: Result<(), ConnectionError> =
            self.execute(Command::new(control::SOFTWARE_RESET, 0, 0, CONFIRMATION));
        let start = std::time::Instant::now();
        loop {
            std::thread::sleep(PAUSE);
            match self.reopen() {
                Err(_) if start.elapsed() < RESTART => {}
                result => return result,
            }
        }
    }

    fn execute(&mut self, command: Command) -> Result<(), ConnectionError> {
        self.client.request(opentmcl_conform::parse::DEFAULT_ADDRESS, command).map(drop)
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

    fn power_cycle(&mut self) -> Result<(), TargetError> {
        Err(unable("the power can be switched"))
    }

    fn set_input(&mut self, _: u8, _: bool) -> Result<(), TargetError> {
        Err(unable("an input can be set"))
    }

    fn set_analog(&mut self, _: u8, _: u16) -> Result<(), TargetError> {
        Err(unable("an input can be set"))
    }

    fn fresh(&mut self) -> Result<(), TargetError> {
        Ok(self.restart().map_err(Broken)?)
    }
}
