//! A module and its clock.

use std::ops::ControlFlow;

use embedded_storage::nor_flash::NorFlash;
use opentmcl_catalog::Module as Model;
use opentmcl_firmware::{
    Answer, Board as _, Config, Executed, Module, Port, ProgramState, ServoState,
};
use opentmcl_wire::{Command, Duration, Instant, Outgoing, Reply, Status, serial};

use crate::board::VirtualBoard;
use crate::flash::MemoryFlash;
use crate::scenario::ModuleSetup;
use crate::world::{Hands, World};

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
    world: World,
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
        Self::with_setup(&ModuleSetup::new(model), flash, options)
    }

    /// A module with all that a scenario puts around it, switched on at time 0. What happens at set
    /// times happens by itself while time passes.
    pub fn with_setup(setup: &ModuleSetup, flash: F, options: Options) -> Self {
        let now = Instant::from_ticks(0);
        let config = Config { program_rate: options.program_rate };
        let machines = setup.axes.iter().map(|axis| axis.machine.clone());
        let board = VirtualBoard::with_machines(setup.model, machines.collect(), flash);
        let module = Module::power_up(setup.model, board, config, now);
        let mut module = Self { module, now, world: World::new(setup) };
        for action in &setup.start {
            module.apply(action);
        }
        module.apply_due();
        module
    }

    /// Switches the module off and on again: the EEPROM is kept, everything else is not, and replies
    /// on their way are lost. The clock goes on, and machines stay where they are.
    pub fn power_cycle(&mut self) {
        self.settle();
        self.switch_off();
        self.switch_on();
    }

    /// The supply goes off: outputs fall, drivers let their motors go, and nothing is executed.
    pub(crate) fn switch_off(&mut self) {
        if self.world.powered {
            self.world.powered = false;
            self.module.board_mut().reset();
        }
    }

    /// The supply comes: the module starts.
    pub(crate) fn switch_on(&mut self) {
        if !self.world.powered {
            self.world.powered = true;
            self.module.switch_on(self.now);
        }
    }

    /// Whether the module has its supply.
    pub fn is_powered(&self) -> bool {
        self.world.powered
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
        let own = if self.world.powered { self.module.poll_at() } else { None };
        own.into_iter().chain(self.next_scheduled()).min()
    }

    /// Lets time pass until `now`; everything due until then happens in its order. Going back is
    /// ignored.
    pub fn advance_to(&mut self, now: Instant) {
        let until = self.now.max(now);
        while let Some(time) = self.next_scheduled().filter(|time| *time <= until) {
            self.pass(time);
            self.apply_due();
        }
        self.pass(until);
    }

    /// Lets time pass up to a moment before which nothing is scheduled.
    fn pass(&mut self, until: Instant) {
        self.now = self.now.max(until);
        if self.world.powered {
            self.module.poll(self.now);
        } else {
            self.module.board_mut().set_time(self.now);
        }
    }

    /// Does what is due at this time before something else happens.
    pub(crate) fn settle(&mut self) {
        self.advance_to(self.now);
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
        mut watcher: impl FnMut(&Executed) -> ControlFlow<()>,
    ) -> ControlFlow<()> {
        let until = self.now.max(until);
        loop {
            let scheduled = self.next_scheduled().filter(|time| *time <= until);
            let end = self.now.max(scheduled.unwrap_or(until));
            if self.world.powered {
                let flow = self.module.poll_watched(end, &mut watcher);
                self.now = self.now.max(self.module.now());
                flow?;
            } else {
                self.pass(end);
            }
            if scheduled.is_none() {
                return ControlFlow::Continue(());
            }
            self.apply_due();
        }
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
        if self.world.powered { self.module.digital_outputs() } else { 0 }
    }

    /// Where an axis stands, in microsteps, or a servo axis in the unit of its position parameters; none if there is no
    /// such axis.
    pub fn position(&mut self, axis: u8) -> Option<i32> {
        self.module.position(axis)
    }

    /// How fast an axis turns, positive to the right: a stepper axis in microsteps per second whatever its unit mode, a
    /// servo axis in revolutions per minute. None if there is no such axis.
    pub fn speed(&mut self, axis: u8) -> Option<i32> {
        self.module.speed(axis)
    }

    /// When a motion next arrives, stops, reaches a constant speed or ends a wait between two moves by
    /// itself: between two such moments and two commands, speeds change steadily. A servo axis is looked at each
    /// millisecond.
    pub fn next_motion_event(&mut self) -> Option<Instant> {
        let own = self.module.board_mut().next_event();
        let servo = self.module.next_servo_look();
        own.into_iter().chain(servo).chain(self.next_scheduled()).min()
    }

    /// Whether a motion is under way that has an end: an axis that keeps its speed until something new comes has none.
    pub fn is_on_its_way(&mut self) -> bool {
        match self.servo_state(0) {
            Some(servo) => servo.is_on_its_way,
            None => self.next_motion_event().is_some(),
        }
    }

    /// A servo axis as its parameters tell it, without what reading them would clear; none if there is no such axis.
    pub fn servo_state(&self, axis: u8) -> Option<ServoState> {
        self.module.servo_state(axis)
    }

    /// What is held, pushed and broken at an axis.
    pub(crate) fn hands_at(&self, axis: u8) -> Hands {
        self.world.hands.get(usize::from(axis)).copied().unwrap_or_default()
    }

    pub(crate) fn world(&self) -> &World {
        &self.world
    }

    pub(crate) fn world_mut(&mut self) -> &mut World {
        &mut self.world
    }

    /// The hardware at the module's time.
    pub(crate) fn hardware(&mut self) -> &mut VirtualBoard<F> {
        let now = self.now;
        let board = self.module.board_mut();
        board.set_time(now);
        board
    }

    /// Tells the firmware, if it runs, that pins may have changed.
    pub(crate) fn pins_changed(&mut self) {
        if self.world.powered {
            self.module.hardware_changed(self.now);
        }
    }

    /// Why the firmware stopped an axis, as axis parameter 207 has it, without clearing it as GAP does.
    pub fn stop_flags(&self, axis: u8) -> u8 {
        self.module.stop_flags(axis).unwrap_or_default()
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
        self.settle();
        if !self.world.powered {
            return Answer::Silence;
        }
        self.module.execute_direct(command, self.now)
    }

    /// A frame has arrived by a line. A port [in ASCII mode](VirtualModule::is_in_ascii_mode) does not
    /// understand frames.
    pub fn receive(&mut self, port: Port, request: Result<serial::Request, serial::WrongChecksum>) {
        self.settle();
        if self.world.powered {
            self.module.receive(port, request, self.now);
        }
    }

    /// Whether a port takes bytes of text, for [`VirtualModule::receive_key`], and not frames; ask before
    /// each byte. A module without supply takes neither.
    pub fn is_in_ascii_mode(&self, port: Port) -> bool {
        self.world.powered && self.module.is_in_ascii_mode(port)
    }

    /// A byte has arrived by a port in ASCII mode; by another one it changes nothing.
    pub fn receive_key(&mut self, port: Port, byte: u8) {
        self.settle();
        if self.world.powered {
            self.module.receive_key(port, byte, self.now);
        }
    }

    /// A connection has ended, and the next one of this number is another: it begins in the mode in which
    /// the module started.
    pub fn hang_up(&mut self, port: Port) {
        self.module.hang_up(port);
    }

    /// What is next due for the host; call until there is nothing.
    pub fn transmit(&mut self) -> Option<(Port, Outgoing)> {
        if self.world.powered { self.module.transmit(self.now) } else { None }
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
        self.settle();
        self.pins_changed();
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
