//! A module and its clock.

use std::ops::ControlFlow;

use embedded_storage::nor_flash::NorFlash;
use opentmcl_catalog::Module as Model;
use opentmcl_firmware::{Answer, Board as _, Config, Executed, Module, Port, ProgramState};
use opentmcl_plant::axis::View;
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

    /// Lets time pass as [`VirtualModule::advance_to`] does, and hands over each command that a program
    /// executes meanwhile, in its order.
    ///
    /// A watcher that breaks off leaves the module right behind that command, at its time. Watching
    /// changes nothing: go on with any method of the module. Commands that were due before a request
    /// at the same time are handed over only if the module is watched until that time first.
    ///
    /// ```
    /// use std::ops::ControlFlow;
    /// use opentmcl_virtual::VirtualModule;
    /// use opentmcl_wire::{Duration, mnemonic};
    ///
    /// let mut module = VirtualModule::new(opentmcl_catalog::find("tmcm-6214").unwrap());
    /// for text in ["132 0, 0, 0", "WAIT TICKS, 0, 100", "STOP", "133 0, 0, 0", "129 0, 0, 0"] {
    ///     module.execute(mnemonic::parse(text).unwrap());
    /// }
    /// let mut trace = Vec::new();
    /// let minute = module.now() + Duration::from_secs(60);
    /// let _ = module.advance_watched(minute, |executed| {
    ///     trace.push((executed.at.as_ticks() / 16_000, executed.command.to_string()));
    ///     ControlFlow::Continue(())
    /// });
    /// assert_eq!(trace, [(1000, "WAIT TICKS, 0, 100".into()), (1000, "STOP".into())]);
    /// ```
    pub fn advance_watched(
        &mut self,
        until: Instant,
        watcher: impl FnMut(&Executed) -> ControlFlow<()>,
    ) -> ControlFlow<()> {
        let flow = self.module.poll_watched(self.now.max(until), watcher);
        self.now = self.now.max(self.module.now());
        flow
    }

    /// What the program does at present.
    pub fn program_state(&self) -> ProgramState {
        self.module.program_state()
    }

    /// The command at an address of program memory; none beyond its end.
    pub fn program_command(&self, address: u16) -> Option<Command> {
        self.module.program_command(address)
    }

    /// The value of a user variable.
    pub fn variable(&self, number: u8) -> i32 {
        self.module.variable(number)
    }

    /// Levels of the general purpose outputs, bit n for output n.
    pub fn digital_outputs(&self) -> u8 {
        self.module.digital_outputs()
    }

    /// Where an axis stands, in microsteps; none if there is no such axis.
    pub fn position(&mut self, axis: u8) -> Option<i32> {
        self.module.position(axis)
    }

    /// How fast an axis turns, in microsteps per second whatever its unit mode, positive to the right;
    /// none if there is no such axis.
    pub fn speed(&mut self, axis: u8) -> Option<i32> {
        self.module.speed(axis)
    }

    /// When a motion next arrives, stops, reaches a constant speed or ends a wait between two moves by
    /// itself: between two such moments and two commands, speeds change steadily.
    pub fn next_motion_event(&mut self) -> Option<Instant> {
        self.module.board_mut().next_event()
    }

    /// What an axis really does, which no register tells; none if there is no such axis.
    pub fn view(&mut self, axis: u8) -> Option<View> {
        let now = self.now;
        self.module.board_mut().view(axis, now)
    }

    /// Whether there is a machine behind an axis.
    pub fn has_machine(&self, axis: u8) -> bool {
        self.board().machine(axis).is_some()
    }

    /// Why the firmware stopped an axis, as axis parameter 207 has it, without clearing it as GAP does: 0,
    /// since this firmware stops none by itself.
    pub fn stop_flags(&self, _axis: u8) -> u8 {
        0
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

    /// Sets the reading of an analog input, 0..=4095.
    pub fn set_analog_input(&mut self, input: u8, reading: u16) {
        self.board_mut().set_analog_input(input, reading);
        self.hardware_changed();
    }

    /// Switches the module off for good and gives its EEPROM back.
    pub fn into_flash(self) -> F {
        self.module.into_board().into_flash()
    }
}
