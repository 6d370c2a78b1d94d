//! A module and its clock.

use embedded_storage::nor_flash::NorFlash;
use opentmcl_catalog::Module as Model;
use opentmcl_firmware::{Answer, Config, Module, Port};
use opentmcl_wire::{Command, Duration, Instant, Reply, Status, serial};

use crate::board::VirtualBoard;
use crate::flash::MemoryFlash;

/// What may differ between two virtual modules of the same kind.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Options {
    /// TMCL commands of a program per second, 1..=16 000 000.
    pub program_rate: u32,
}

impl Default for Options {
    fn default() -> Self {
        Self { program_rate: Config::default().program_rate }
    }
}

/// A virtual module. See the crate's example.
pub struct VirtualModule<F = MemoryFlash> {
    module: Module<VirtualBoard<F>>,
    now: Instant,
}

impl VirtualModule {
    /// A new module with factory settings, switched on at time 0.
    pub fn new(model: &'static Model) -> Self {
        Self::with_flash(model, MemoryFlash::new(), Options::default())
    }
}

impl<F: NorFlash> VirtualModule<F> {
    /// A module whose EEPROM is this flash, switched on at time 0.
    pub fn with_flash(model: &'static Model, flash: F, options: Options) -> Self {
        let now = Instant::from_ticks(0);
        let config = Config { program_rate: options.program_rate };
        let board = VirtualBoard::new(model, flash);
        Self { module: Module::power_up(model, board, config, now), now }
    }

    /// Switches the module off and on again: the EEPROM is kept, everything else is not, and replies
    /// on their way are lost. The clock goes on.
    pub fn power_cycle(&mut self) {
        self.module.power_cycle(self.now);
    }

    /// What kind of module it is.
    pub fn model(&self) -> &'static Model {
        self.module.model()
    }

    /// The module's time.
    pub fn now(&self) -> Instant {
        self.now
    }

    /// When something will happen next by itself, a reply that becomes due included; `None` while the
    /// module is at rest.
    pub fn next_event(&mut self) -> Option<Instant> {
        self.module.poll_at()
    }

    /// Lets time pass until `now`; everything due until then happens in its order. Going back is
    /// ignored.
    pub fn advance_to(&mut self, now: Instant) {
        self.now = self.now.max(now);
        self.module.poll(self.now);
    }

    /// Lets time pass.
    pub fn advance(&mut self, by: Duration) {
        self.advance_to(self.now + by);
    }

    /// Executes a command at once, as if a host with no line had sent it.
    ///
    /// The two replies with a layout of their own (134, and 136 type 0) are given as a client sees them
    /// that takes their bytes for a general reply; [`VirtualModule::execute_direct`] has them as
    /// they are. A factory reset (137), which has no reply, gives status 100.
    pub fn execute(&mut self, command: Command) -> Reply {
        let silence = Reply { status: Status::OK, number: command.number, value: command.value };
        match self.execute_direct(command) {
            Answer::Reply(reply) => reply,
            answer => {
                answer.frame(0, 0).map_or(silence, |[_, _, status, number, value @ .., _]| Reply {
                    status: Status(status),
                    number,
                    value: i32::from_be_bytes(value),
                })
            }
        }
    }

    /// Executes a command at once and gives the module's answer in all its forms.
    pub fn execute_direct(&mut self, command: Command) -> Answer {
        self.module.execute_direct(command, self.now)
    }

    /// A frame has arrived by a line.
    pub fn receive(&mut self, port: Port, request: Result<serial::Request, serial::WrongChecksum>) {
        self.module.receive(port, request, self.now);
    }

    /// The next frame that is due for the host; call until there is none.
    pub fn transmit(&mut self) -> Option<(Port, [u8; serial::FRAME_LEN])> {
        self.module.transmit(self.now)
    }

    /// The hardware.
    pub fn board(&self) -> &VirtualBoard<F> {
        self.module.board()
    }

    /// The hardware, to change what is connected to it; then call
    /// [`VirtualModule::hardware_changed`].
    pub fn board_mut(&mut self) -> &mut VirtualBoard<F> {
        self.module.board_mut()
    }

    /// A pin of the hardware has changed.
    pub fn hardware_changed(&mut self) {
        self.module.hardware_changed(self.now);
    }

    /// Sets the level of a general purpose input, 0..=7.
    pub fn set_digital_input(&mut self, input: u8, level: bool) {
        self.board_mut().set_digital_input(input, level);
        self.hardware_changed();
    }

    /// Switches the module off for good and gives its EEPROM back.
    pub fn into_flash(self) -> F {
        self.module.into_board().into_flash()
    }
}
