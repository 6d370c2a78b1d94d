//! The module: all its state, power-up, and the order in which things happen.

use core::ops::ControlFlow;

use opentmcl_catalog as catalog;
use opentmcl_wire::limits::{COORDINATES, VARIABLES};
use opentmcl_wire::{Duration, Instant, Outgoing, TICKS_PER_SECOND, serial};

use crate::axis::{AxisNumber, AxisState, PerAxis};
use crate::board::Board;
use crate::cpu::Cpu;
use crate::drive::Memory;
use crate::events::{Arrivals, Heartbeat, Levels};
use crate::globals::GlobalSettings;
use crate::guard::Guards;
use crate::interrupts::Interrupts;
use crate::line::{Outbox, Port};
use crate::program::{Download, Program};
use crate::servo::Servo;
use crate::terminal::Terminals;
use crate::tmc429;
use crate::tmc5160::Chip;
use crate::watch::{Nobody, Watcher};

/// In [`Module::quiet_until`]: has to be found out.
pub(crate) const UNKNOWN: Instant = Instant::from_ticks(0);

/// In [`Module::quiet_until`]: nothing will happen by itself.
const NEVER: Instant = Instant::from_ticks(u64::MAX);

/// What may differ between two modules of the same kind.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Config {
    /// TMCL commands of a program per second, 1..=16 000 000. No source tells the real rate.
    pub program_rate: u32,
}

impl Default for Config {
    fn default() -> Self {
        Self { program_rate: 10_000 }
    }
}

/// Some of the commands that a module knows: bit n of word n / 64 for command n.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Commands([u64; 4]);

impl Commands {
    fn of(model: &catalog::Module, wanted: impl Fn(catalog::Mode) -> bool) -> Self {
        let mut words = [0; 4];
        for command in model.commands.iter().filter(|command| wanted(command.mode)) {
            if let Some(word) = words.get_mut(usize::from(command.number / 64)) {
                *word |= 1u64 << (command.number % 64);
            }
        }
        Self(words)
    }

    pub(crate) fn contain(&self, number: u8) -> bool {
        let word = self.0.get(usize::from(number / 64)).copied().unwrap_or_default();
        word >> (number % 64) & 1 != 0
    }
}

/// A TMCL module on a board.
pub struct Module<B> {
    pub(crate) model: &'static catalog::Module,
    pub(crate) board: B,
    pub(crate) now: Instant,
    /// Nothing happens by itself before this time, so that a poll before it has nothing to look at.
    /// Whatever changes the module's state sets it back to [`UNKNOWN`].
    pub(crate) quiet_until: Instant,
    /// Time that one command of a program takes.
    pub(crate) command_time: Duration,
    pub(crate) known_commands: Commands,
    /// Known ones that are for programs only.
    pub(crate) standalone_commands: Commands,
    pub(crate) axes: PerAxis<AxisState>,
    pub(crate) chips: PerAxis<Memory>,
    pub(crate) globals: GlobalSettings,
    pub(crate) variables: [i32; VARIABLES],
    pub(crate) coordinates: PerAxis<[i32; COORDINATES]>,
    pub(crate) cpu: Cpu,
    pub(crate) program: Program,
    pub(crate) download: Download,
    pub(crate) interrupts: Interrupts,
    pub(crate) arrivals: Arrivals,
    pub(crate) levels: Levels,
    pub(crate) heartbeat: Heartbeat,
    /// Axes with a reference search; a mask.
    pub(crate) searching: u8,
    pub(crate) guards: Guards,
    /// When to look next at what the drivers do not do themselves.
    pub(crate) next_tending: Option<Instant>,
    /// The servo axis of a module that has one.
    pub(crate) servo: Servo,
    pub(crate) outbox: Outbox,
    pub(crate) terminals: Terminals,
    pub(crate) digital_outputs: u8,
    /// Whether the motors had their supply when this was looked at last.
    pub(crate) had_motor_supply: bool,
}

impl<B: Board> Module<B> {
    /// Switches the module on: loads the EEPROM, sets up the chips, starts the program if the
    /// auto-start parameter says so.
    pub fn power_up(
        model: &'static catalog::Module,
        mut board: B,
        config: Config,
        now: Instant,
    ) -> Self {
        board.set_time(now);
        let rate = u64::from(config.program_rate).clamp(1, TICKS_PER_SECOND);
        let mut module = Self {
            model,
            board,
            now,
            quiet_until: UNKNOWN,
            command_time: Duration::from_ticks(TICKS_PER_SECOND / rate),
            known_commands: Commands::of(model, |_| true),
            standalone_commands: Commands::of(model, |mode| mode == catalog::Mode::Standalone),
            axes: PerAxis::new(AxisState::default),
            chips: PerAxis::new(Memory::default),
            globals: GlobalSettings::new(model, now),
            variables: [0; VARIABLES],
            coordinates: PerAxis::new(|| [0; COORDINATES]),
            cpu: Cpu::new(now),
            program: Program::new(),
            download: Download::default(),
            interrupts: Interrupts::new(),
            arrivals: Arrivals::default(),
            levels: Levels::default(),
            heartbeat: Heartbeat::default(),
            searching: 0,
            guards: Guards::default(),
            next_tending: None,
            servo: Servo::new(model.motion, now),
            outbox: Outbox::new(),
            terminals: Terminals::new(false),
            digital_outputs: 0,
            had_motor_supply: true,
        };
        module.start();
        module
    }

    /// Switches the module off and on again. Only the EEPROM is kept.
    pub fn power_cycle(&mut self, now: Instant) {
        self.poll(now);
        self.switch_on(now);
    }

    /// Switches the module on that has been without its supply until now: what would have been due
    /// meanwhile never happens. Only the EEPROM is kept.
    pub fn switch_on(&mut self, now: Instant) {
        // Nobody has regulated anything without a supply.
        self.servo = Servo::new(self.model.motion, now);
        self.set_time(now);
        self.outbox = Outbox::new();
        self.restart();
    }

    /// Restarts the firmware and resets the board, as command 255 does. Replies under way still go.
    pub(crate) fn restart(&mut self) {
        self.quiet_until = UNKNOWN;
        self.board.reset();
        self.axes = PerAxis::new(AxisState::default);
        self.chips = PerAxis::new(Memory::default);
        self.forget_settings();
        self.cpu = Cpu::new(self.now);
        self.download = Download::default();
        self.arrivals = Arrivals::default();
        self.searching = 0;
        self.guards = Guards::default();
        self.next_tending = None;
        self.servo = Servo::new(self.model.motion, self.now);
        self.digital_outputs = 0;
        self.start();
    }

    /// Does everything that is due until `now`, in the order of time. Times never go back.
    pub fn poll(&mut self, now: Instant) {
        // Nobody breaks off.
        let _: ControlFlow<()> = self.poll_with(now, &mut Nobody);
    }

    pub(crate) fn poll_with(
        &mut self,
        now: Instant,
        watcher: &mut impl Watcher,
    ) -> ControlFlow<()> {
        while self.quiet_until <= now {
            let hardware = self.next_hardware_event();
            let due = earliest(self.next_own_step(), hardware).unwrap_or(NEVER);
            if due > now {
                self.quiet_until = due;
                break;
            }
            self.set_time(due);
            if hardware.is_some_and(|event| event <= due) {
                let axes = self.board.axes_with_event();
                self.observe_axes(axes);
            }
            self.look_at_speeds();
            self.tend_if_due();
            self.check_heartbeat();
            if self.cpu.is_active() {
                self.interrupts.run_timers(self.now);
                self.run_until(now, watcher)?;
            }
        }
        self.set_time(now);
        ControlFlow::Continue(())
    }

    /// When the module next wants to be called, if nothing comes from outside: `None` is at rest.
    ///
    /// Hardware whose changes [`Board::next_event`] cannot foresee is told by
    /// [`Module::hardware_changed`].
    pub fn poll_at(&mut self) -> Option<Instant> {
        let step = if self.quiet_until > self.now {
            Some(self.quiet_until).filter(|&quiet_until| quiet_until != NEVER)
        } else {
            earliest(self.next_own_step(), self.next_hardware_event())
        };
        earliest(earliest(step, self.next_catching_up()), self.outbox.next_due())
    }

    /// Tells that a pin has changed.
    pub fn hardware_changed(&mut self, now: Instant) {
        self.poll(now);
        self.quiet_until = UNKNOWN;
        self.wake_servo();
        self.observe_supply();
        self.observe();
        self.cpu.look_again(self.now);
    }

    /// A frame has arrived from the host. A port [in ASCII mode](Module::is_in_ascii_mode) does not
    /// understand frames.
    pub fn receive(
        &mut self,
        port: Port,
        request: Result<serial::Request, serial::WrongChecksum>,
        now: Instant,
    ) {
        self.poll(now);
        if !self.is_in_ascii_mode(port) {
            self.answer(port, request);
        }
    }

    /// What is next due for the host; call until there is nothing.
    pub fn transmit(&mut self, now: Instant) -> Option<(Port, Outgoing)> {
        self.outbox.pop(now)
    }

    /// What kind of module it is.
    pub fn model(&self) -> &'static catalog::Module {
        self.model
    }

    /// What is below the firmware.
    pub fn board(&self) -> &B {
        &self.board
    }

    /// What is below the firmware, to change it; then call [`Module::hardware_changed`].
    pub fn board_mut(&mut self) -> &mut B {
        &mut self.board
    }

    /// Switches the module off, leaving the board.
    pub fn into_board(self) -> B {
        self.board
    }

    pub(crate) fn set_time(&mut self, now: Instant) {
        if now > self.now {
            self.run_servo(now);
            self.now = now;
            self.board.set_time(now);
        }
    }

    /// When the firmware next does something of its own accord.
    fn next_own_step(&self) -> Option<Instant> {
        let mut next = self.next_chore();
        if self.cpu.is_active() {
            next = earliest(next, self.next_command());
            next = earliest(next, self.interrupts.next_timer());
        }
        next
    }

    /// When the firmware next does something whatever runs on it.
    fn next_chore(&self) -> Option<Instant> {
        let looks = earliest(self.guards.next_look, self.next_tending);
        earliest(self.heartbeat.deadline, looks)
    }

    /// When the hardware next changes something that has consequences.
    fn next_hardware_event(&mut self) -> Option<Instant> {
        if !self.is_watching() {
            return None;
        }
        earliest(self.board.next_event(), self.next_servo_tick())
    }

    /// Until when a program may run on undisturbed by anything but itself.
    pub(crate) fn next_disturbance(&mut self) -> Option<Instant> {
        let own = earliest(self.next_chore(), self.interrupts.next_timer());
        earliest(own, self.next_hardware_event())
    }

    /// The TMC5160 of an axis, for what only that can do.
    pub(crate) fn tmc5160(&mut self, axis: AxisNumber) -> (Chip<'_, B>, &mut AxisState) {
        let chip = Chip { axis, state: &mut self.chips[axis], board: &mut self.board };
        (chip, &mut self.axes[axis])
    }

    /// The TMC429 of an axis and its driver, for what only they can do.
    pub(crate) fn tmc429(&mut self, axis: AxisNumber) -> (tmc429::Chip<'_, B>, &mut AxisState) {
        let chip = tmc429::Chip { axis, state: &mut self.chips[axis], board: &mut self.board };
        (chip, &mut self.axes[axis])
    }
}

pub(crate) fn earliest(a: Option<Instant>, b: Option<Instant>) -> Option<Instant> {
    match (a, b) {
        (Some(a), Some(b)) => Some(a.min(b)),
        (a, b) => a.or(b),
    }
}
