//! The module: all its state, power-up, and the order in which things happen.

use core::ops::ControlFlow;

use opentmcl_catalog::{
    self as catalog, AxisBehaviour, AxisParameter, GlobalBehaviour, Globals, Motion, PortBehaviour,
    Variables,
};
use opentmcl_wire::limits::{COORDINATES, VARIABLES};
use opentmcl_wire::{Duration, Instant, Outgoing, Status, TICKS_PER_SECOND, serial};

use crate::axis::{AxisNumber, AxisState, PerAxis};
use crate::board::{Analog, Board};
use crate::cpu::Cpu;
use crate::drive::Memory;
use crate::events::{Arrivals, Heartbeat, Levels};
use crate::globals::GlobalSettings;
use crate::guard::Guards;
use crate::interrupts::{Interrupts, TIMERS};
use crate::line::{Outbox, Port};
use crate::program::{Download, Program};
use crate::storage;
use crate::terminal::Terminals;
use crate::tmc429;
use crate::tmc429::registers::{AXES_OF_A_TMC429, INVERT_DIRECTION, INVERT_SWITCHES};
use crate::tmc5160::Chip;
use crate::watch::{Nobody, Watcher};

/// Supply of the motors in 0.1 V from which on they have one. No source tells the threshold.
const LEAST_MOTOR_SUPPLY: i32 = 70;

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
    pub(crate) outbox: Outbox,
    pub(crate) terminals: Terminals,
    pub(crate) digital_outputs: u8,
    /// Whether the motors had their supply when this was looked at last.
    had_motor_supply: bool,
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
            outbox: Outbox::new(),
            terminals: Terminals::new(false),
            digital_outputs: 0,
            had_motor_supply: true,
        };
        module.start();
        module
    }

    /// What power-up, a software reset and a factory reset have in common, with all state new.
    fn start(&mut self) {
        self.load_eeprom();
        if self.has_lost_magic() {
            // A failed reset leaves what there is: the next start tries again.
            let _ = storage::factory_reset(self.board.flash());
            self.forget_settings();
        }
        self.terminals = Terminals::new(self.starts_in_ascii_mode());
        self.set_up_ports();
        for axis in AxisNumber::all(self.model.axes) {
            self.set_up_axis(axis);
        }
        self.had_motor_supply = self.has_motor_supply();
        self.set_up_groups();
        self.levels = self.read_levels();
        self.tend(u8::MAX);
        self.restart_heartbeat();
        if self.globals[Globals::AutoStart] != 0 {
            self.run_program();
        }
    }

    /// Switches the module off and on again. Only the EEPROM is kept.
    pub fn power_cycle(&mut self, now: Instant) {
        self.poll(now);
        self.switch_on(now);
    }

    /// Switches the module on that has been without its supply until now: what would have been due
    /// meanwhile never happens. Only the EEPROM is kept.
    pub fn switch_on(&mut self, now: Instant) {
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
        self.digital_outputs = 0;
        self.start();
    }

    /// What the EEPROM keeps takes its factory settings in memory.
    fn forget_settings(&mut self) {
        self.globals = GlobalSettings::new(self.model, self.now);
        self.variables = [0; VARIABLES];
        self.coordinates = PerAxis::new(|| [0; COORDINATES]);
        self.program.erase();
        self.interrupts = Interrupts::new();
    }

    /// Whether the EEPROM magic has been overwritten: whoever does that wants the factory settings back.
    fn has_lost_magic(&self) -> bool {
        let rows = self.model.global_parameters.iter();
        let effect = GlobalBehaviour::Globals(Globals::EepromMagic);
        let mut magic = rows.filter(|row| row.behaviour == effect);
        magic.any(|row| self.globals.number(row.number) != row.default)
    }

    /// Writes the defaults of the catalogue to an axis that has just been switched on.
    fn set_up_axis(&mut self, axis: AxisNumber) {
        let is_in_pps = self.model.motion == Motion::Tmc5160;
        let (mut drive, state) = self.drive(axis);
        // A TMC429 has no other units than its own, and its moves count from where the axis stands.
        state.internal_units = !is_in_pps;
        state.relative_positioning_option = i32::from(!is_in_pps);
        drive.initialize();
        for row in self.model.axis_parameters {
            // Where an axis stands and how it moves is no setting.
            let is_motion = matches!(
                row.behaviour,
                AxisBehaviour::Tmc5160(
                    catalog::Tmc5160::TargetPosition
                        | catalog::Tmc5160::ActualPosition
                        | catalog::Tmc5160::TargetSpeed
                        | catalog::Tmc5160::EncoderPosition
                ) | AxisBehaviour::Tmc429(
                    catalog::Tmc429::TargetPosition
                        | catalog::Tmc429::ActualPosition
                        | catalog::Tmc429::TargetSpeed
                        | catalog::Tmc429::RampMode
                )
            );
            if row.access.write && row.axes & axis.bit() != 0 && !is_motion {
                // The catalogue's defaults are within its ranges, so nothing is refused.
                let _: Result<(), Status> = self.write_axis_parameter(axis, row, row.default);
            }
        }
        self.restore_axis(axis);
    }

    /// Gives an axis the values that are stored for it.
    fn restore_axis(&mut self, axis: AxisNumber) {
        let storable = |row: &&AxisParameter| row.access.store && row.axes & axis.bit() != 0;
        for row in self.model.axis_parameters.iter().filter(storable) {
            let key = storage::Key::AxisParameter(row.number, axis.get());
            if let Ok(Some(value)) = storage::fetch(self.board.flash(), key) {
                // Only values that were in use are stored.
                let _: Result<(), Status> = self.write_axis_parameter(axis, row, value);
            }
        }
        if self.model.motion == Motion::Tmc429 {
            // The acceleration has been written before the divisors.
            let (now, has_supply) = (self.now, self.has_motor_supply());
            let (mut chip, state) = self.tmc429(axis);
            if !has_supply {
                chip.leave_half_restored();
            }
            chip.compute_braking_factor();
            state.stands_from(now);
        }
    }

    /// Whether the motors have their supply. A board with TMC429 also runs from the USB line alone, and then
    /// does not do everything.
    pub(crate) fn has_motor_supply(&mut self) -> bool {
        self.model.motion != Motion::Tmc429
            || self.board.analog(Analog::SupplyVoltage) >= LEAST_MOTOR_SUPPLY
    }

    /// When the motors get their supply back, the user variables are as after power-up: clients tell by
    /// them that it was gone.
    fn observe_supply(&mut self) {
        let has_supply = self.has_motor_supply();
        if has_supply && !self.had_motor_supply {
            self.restore_variables();
        }
        self.had_motor_supply = has_supply;
    }

    fn restore_variables(&mut self) {
        self.variables = [0; VARIABLES];
        if self.globals[Globals::DoNotRestoreUserVariables] != 0 {
            return;
        }
        let variables = GlobalBehaviour::Variables(Variables::UserVariable);
        let rows = self.model.global_parameters.iter();
        for row in rows.filter(|row| row.behaviour == variables && row.access.store) {
            for number in row.number..=row.last {
                let stored = storage::fetch(self.board.flash(), storage::Key::Variable(number));
                if let (Ok(Some(value)), Some(variable)) =
                    (stored, self.variables.get_mut(usize::from(number)))
                {
                    *variable = value;
                }
            }
        }
    }

    /// Tells each TMC429 the polarity of its switches and the direction of its motors.
    pub(crate) fn set_up_groups(&mut self) {
        if self.model.motion != Motion::Tmc429 {
            return;
        }
        let inverted = self.globals[Globals::EndSwitchPolarity];
        let reversed = self.globals[Globals::ReverseShaft];
        for axis in
            AxisNumber::all(self.model.axes).filter(|axis| axis.get() % AXES_OF_A_TMC429 == 0)
        {
            let bit = axis.get() / AXES_OF_A_TMC429;
            let (mut chip, _) = self.tmc429(axis);
            chip.write_field(INVERT_SWITCHES, (inverted >> bit) as u32 & 1);
            chip.write_field(INVERT_DIRECTION, (reversed >> bit) as u32 & 1);
        }
    }

    fn set_up_ports(&mut self) {
        for port in self.model.ports.iter().filter(|port| port.access.write) {
            match port.behaviour {
                PortBehaviour::PullUps => self.board.set_pull_ups(port.default as u8),
                PortBehaviour::AdcRange => {
                    self.board.set_analog_range(port.index, port.default as u8);
                }
                _ => {}
            }
        }
        self.board.set_digital_outputs(self.digital_outputs);
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
        earliest(step, self.outbox.next_due())
    }

    /// Tells that a pin has changed.
    pub fn hardware_changed(&mut self, now: Instant) {
        self.poll(now);
        self.quiet_until = UNKNOWN;
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
        if self.is_watching() { self.board.next_event() } else { None }
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

    fn load_eeprom(&mut self) {
        let Self { board, globals, variables, coordinates, program, model, interrupts, .. } = self;
        let (axes, now) = (model.axes, self.now);
        storage::load(board.flash(), |key, item| match (key, item) {
            (storage::Key::Global(number), storage::Item::Number(value)) => {
                let row = model.global_parameter(0, number);
                if row.is_some_and(|row| row.access.automatic) {
                    globals.set_number(number, value);
                }
            }
            (storage::Key::Variable(number), storage::Item::Number(value)) => {
                variables[usize::from(number)] = value;
            }
            (storage::Key::Coordinate(coordinate, axis), storage::Item::Number(value)) => {
                if let Some(axis) = AxisNumber::new(axis, axes)
                    && let Some(place) = coordinates[axis].get_mut(usize::from(coordinate))
                {
                    *place = value;
                }
            }
            (storage::Key::Chunk(chunk), storage::Item::Commands(bytes)) => {
                program.load_chunk(chunk, bytes);
            }
            (storage::Key::Interrupt(number), storage::Item::Number(value)) => {
                if usize::from(number) < TIMERS {
                    interrupts.set_timer_period(number, value as u32, now);
                } else {
                    interrupts.set_transitions(number, value as u8);
                }
            }
            _ => {}
        });
        if self.globals[Globals::DoNotRestoreUserVariables] != 0 {
            self.variables = [0; VARIABLES];
        }
    }
}

pub(crate) fn earliest(a: Option<Instant>, b: Option<Instant>) -> Option<Instant> {
    match (a, b) {
        (Some(a), Some(b)) => Some(a.min(b)),
        (a, b) => a.or(b),
    }
}
