//! What a module has: its axis and global parameters, ports, interrupts and commands, as typed
//! constant tables.
//!
//! The tables are generated at build time from `modules/*.toml`, the only place where a parameter
//! is described. Ranges, defaults, access rights and help texts all come from there.
//!
//! **A parameter that exists in the data and not in the code, or in the code and not in the data,
//! does not compile.** Every row names its effect as `room.effect`. For each room the build
//! generates an enum of all effects that any module names ([`Tmc5160`], [`Tmc429`], [`Servo`], [`Globals`], …),
//! and the file of the firmware that is that room matches on it exhaustively.
//!
//! Nothing outside this crate knows a module by name.
#![no_std]
#![forbid(unsafe_code)]
// The core cannot panic: whatever comes from outside has an answer.
#![cfg_attr(
    not(test),
    warn(clippy::unwrap_used, clippy::expect_used, clippy::panic, clippy::unreachable)
)]

include!(concat!(env!("OUT_DIR"), "/modules.rs"));

/// Everything that is known of one module.
#[derive(Debug)]
pub struct Module {
    /// Name on the command line, lower case: `tmcm-6214`.
    pub name: &'static str,
    /// Name in print: `TMCM-6214`.
    pub title: &'static str,
    /// What the module is, one sentence.
    pub description: &'static str,
    /// Module number as the binary form of command 136 reports it: 6214.
    pub number: u16,
    /// Version of the firmware that the tables describe, major and minor: (1, 16).
    pub firmware: (u8, u8),
    /// Answer of command 136 type 0: `6214V116`.
    pub version: [u8; 8],
    /// Number of axes.
    pub axes: u8,
    /// What drives the axes.
    pub motion: Motion,
    /// Amplitude of the phase currents that a motor driver gives at most, in mA.
    pub peak_current_ma: u32,
    /// Electrical and mechanical ratings.
    pub ratings: &'static [Rating],
    /// Axis parameters by number, ascending.
    pub axis_parameters: &'static [AxisParameter],
    /// Position in `axis_parameters` for each parameter number; 255 where there is none.
    pub axis_parameter_index: &'static [u8; 256],
    /// Global parameters by bank and number, ascending.
    pub global_parameters: &'static [GlobalParameter],
    /// Interrupts by number, ascending: the lower the number, the higher the priority.
    pub interrupts: &'static [Interrupt],
    /// Input and output ports by bank and number, ascending. A number may stand for one port with
    /// GIO and for another with SIO; then it has two rows.
    pub ports: &'static [Port],
    /// Commands by number, ascending.
    pub commands: &'static [Command],
}

/// What drives the axes of a module; it decides in which rooms the effects of its axis
/// parameters are.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Motion {
    /// One TMC5160 per axis, ramp generator and driver in one: the room `tmc5160`.
    Tmc5160,
    /// One TMC429 for each three axes makes the ramps, and a TMC26x (TMC260, TMC262) per axis drives
    /// the motor: the rooms `tmc429` and `tmc26x`.
    Tmc429,
    /// Field-oriented control of a servo motor: the rooms `servo` and `foc`.
    Foc,
    /// Block commutation of a brushless motor by its hall lines: the rooms `servo` and `block`.
    Block,
}

impl Motion {
    /// Whether the regulators of a servo motor are in the firmware.
    pub const fn is_servo(self) -> bool {
        matches!(self, Self::Foc | Self::Block)
    }
}

/// One rated value of a module, for people.
#[derive(Debug)]
pub struct Rating {
    /// What is rated.
    pub name: &'static str,
    /// The value with its unit.
    pub value: &'static str,
}

/// Which commands may touch a parameter.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Access {
    /// R: can be read (GAP, GGP, GIO).
    pub read: bool,
    /// W: can be written (SAP, SGP, SIO and the accumulator forms).
    pub write: bool,
    /// E: can be stored in and restored from the EEPROM on request (STAP, RSAP, STGP, RSGP); what is
    /// stored comes back at power-up.
    pub store: bool,
    /// A: is stored in the EEPROM by each write.
    pub automatic: bool,
}

/// Unit of a value; decides how it is converted and checked.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Unit {
    /// A number, flag or choice.
    None,
    /// Microsteps.
    Microsteps,
    /// Microsteps per second; with unit mode 0 the ramp generator's own unit.
    Pps,
    /// Microsteps per second squared; with unit mode 0 the ramp generator's own unit.
    Pps2,
    /// Any other unit, as printed; `v` and `a` are a TMC429's own units of speed and acceleration.
    Other(&'static str),
}

/// Where a default value comes from.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Source {
    /// The module's manual names it; where a row is not exact, the one that its source names.
    Manual,
    /// The manual is silent; the vendor's open firmware for the same chip sets the register so, or
    /// leaves it as the chip's reset does.
    OpenFirmware,
    /// Neither says it; chosen here, and the description says why.
    Chosen,
}

/// How sure it is that the module has a row and that the row says what it does.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Certainty {
    /// The manual of this module and firmware says it.
    Exact,
    /// Documents or software of the vendor for a module with the same chips and language, or for
    /// another firmware of this module, say it.
    Sister,
    /// Others have seen it on real modules, or their programs rely on it.
    Observed,
    /// It follows from what is known of other rows.
    Inferred,
    /// Known of the family of modules, without a document at hand.
    Recalled,
}

/// One axis parameter.
#[derive(Debug)]
pub struct AxisParameter {
    /// Parameter number.
    pub number: u8,
    /// Name in programs, `snake_case`.
    pub id: &'static str,
    /// Name in print.
    pub name: &'static str,
    /// Unit.
    pub unit: Unit,
    /// Smallest value, in the unit.
    pub min: i32,
    /// Largest value, in the unit.
    pub max: i32,
    /// Largest value with unit mode 0, for speeds and accelerations; otherwise `max`. Where `min` is
    /// negative, the smallest value with unit mode 0 is minus this.
    pub internal_max: i32,
    /// Value after power-up, in the unit, until another one is stored. A speed or acceleration is the value that its register
    /// reads back as, so converting it gives exactly the register's default.
    pub default: i32,
    /// Where the default comes from.
    pub default_source: Source,
    /// Who may touch it.
    pub access: Access,
    /// Bit n is set if axis n has the parameter.
    pub axes: u8,
    /// What happens.
    pub behaviour: AxisBehaviour,
    /// Firmware version from which the row exists, major and minor; see [`Module::has`].
    pub since: Option<(u8, u8)>,
    /// How sure the row is.
    pub certainty: Certainty,
    /// Where the row comes from, if not from the manual of the module.
    pub source: Option<&'static str>,
    /// Meaning, for people.
    pub description: &'static str,
    /// Meaning of each value of a choice or bit field.
    pub values: &'static [(i32, &'static str)],
}

/// One global parameter, or a row of equal ones (user variables).
#[derive(Debug)]
pub struct GlobalParameter {
    /// Bank.
    pub bank: u8,
    /// Parameter number; the first one of a row of equal ones.
    pub number: u8,
    /// The last one of a row of equal ones; otherwise the same as `number`.
    pub last: u8,
    /// Name in programs, `snake_case`.
    pub id: &'static str,
    /// Name in print.
    pub name: &'static str,
    /// Unit.
    pub unit: Unit,
    /// Smallest value.
    pub min: i64,
    /// Largest value; a 32-bit unsigned period reaches beyond `i32`.
    pub max: i64,
    /// Factory setting.
    pub default: i32,
    /// Where the default comes from.
    pub default_source: Source,
    /// Who may touch it.
    pub access: Access,
    /// What happens.
    pub behaviour: GlobalBehaviour,
    /// Firmware version from which the row exists, major and minor; see [`Module::has`].
    pub since: Option<(u8, u8)>,
    /// How sure the row is.
    pub certainty: Certainty,
    /// Where the row comes from, if not from the manual of the module.
    pub source: Option<&'static str>,
    /// Meaning, for people.
    pub description: &'static str,
    /// Meaning of each value of a choice or bit field.
    pub values: &'static [(i32, &'static str)],
}

/// One interrupt.
#[derive(Debug)]
pub struct Interrupt {
    /// Interrupt number; the lower, the higher the priority.
    pub number: u8,
    /// Name in programs, `snake_case`.
    pub id: &'static str,
    /// Name in print.
    pub name: &'static str,
    /// What triggers it.
    pub behaviour: InterruptBehaviour,
    /// Which timer, axis or input.
    pub index: u8,
    /// Firmware version from which the row exists, major and minor; see [`Module::has`].
    pub since: Option<(u8, u8)>,
    /// How sure the row is.
    pub certainty: Certainty,
    /// Where the row comes from, if not from the manual of the module.
    pub source: Option<&'static str>,
    /// Meaning, for people.
    pub description: &'static str,
}

/// One input or output as SIO and GIO see it.
#[derive(Debug)]
pub struct Port {
    /// Bank: 0 digital inputs and settings, 1 analog inputs, 2 digital outputs.
    pub bank: u8,
    /// Port number.
    pub number: u8,
    /// Name in programs, `snake_case`.
    pub id: &'static str,
    /// Name in print.
    pub name: &'static str,
    /// Unit.
    pub unit: Unit,
    /// Smallest value.
    pub min: i32,
    /// Largest value.
    pub max: i32,
    /// Value after power-up with nothing connected.
    pub default: i32,
    /// R: GIO, W: SIO.
    pub access: Access,
    /// What is behind it.
    pub behaviour: PortBehaviour,
    /// Which input, output or setting of that kind.
    pub index: u8,
    /// Firmware version from which the row exists, major and minor; see [`Module::has`].
    pub since: Option<(u8, u8)>,
    /// How sure the row is.
    pub certainty: Certainty,
    /// Where the row comes from, if not from the manual of the module.
    pub source: Option<&'static str>,
    /// Meaning, for people.
    pub description: &'static str,
}

/// Where a command may be used.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Mode {
    /// By a host and in a program.
    Both,
    /// By a host only.
    Direct,
    /// In a program only; a host gets status 6 (not available).
    Standalone,
}

/// One command that the module knows.
#[derive(Debug)]
pub struct Command {
    /// Command number.
    pub number: u8,
    /// Mnemonic, or a short name in lower case for control commands, which have none.
    pub mnemonic: &'static str,
    /// Where it may be used.
    pub mode: Mode,
    /// Why it is refused with status 6 (not available) although the module knows it.
    pub unavailable: Option<&'static str>,
    /// Firmware version from which the row exists, major and minor; see [`Module::has`].
    pub since: Option<(u8, u8)>,
    /// How sure the row is.
    pub certainty: Certainty,
    /// Where the row comes from, if not from the manual of the module.
    pub source: Option<&'static str>,
    /// Meaning, for people.
    pub description: &'static str,
}

impl AxisParameter {
    /// Whether an axis has it.
    pub const fn is_on(&self, axis: u8) -> bool {
        is_in(self.axes, axis)
    }
}

/// Whether an axis is in a mask, bit n for axis n.
pub const fn is_in(mask: u8, axis: u8) -> bool {
    axis < 8 && mask >> axis & 1 == 1
}

impl Module {
    /// Whether the module's firmware is new enough for a row with this [`since`](Command::since).
    /// If it is not, the module must answer as if there were no such row; the functions that look up
    /// a row find it in either case, so that tools can say what later firmware has.
    pub fn has(&self, since: Option<(u8, u8)>) -> bool {
        since.is_none_or(|since| since <= self.firmware)
    }

    /// The axis parameter with this number.
    pub fn axis_parameter(&self, number: u8) -> Option<&'static AxisParameter> {
        let at = self.axis_parameter_index.get(usize::from(number))?;
        self.axis_parameters.get(usize::from(*at))
    }

    /// The parameter of the speed that an axis turns with, whose range is that of ROR and ROL.
    pub fn target_speed(&self) -> Option<&'static AxisParameter> {
        self.axis_parameters.iter().find(|row| {
            matches!(
                row.behaviour,
                AxisBehaviour::Tmc5160(Tmc5160::TargetSpeed)
                    | AxisBehaviour::Tmc429(Tmc429::TargetSpeed)
                    | AxisBehaviour::Servo(Servo::TargetVelocity)
            )
        })
    }

    /// The global parameter with this number in this bank.
    pub fn global_parameter(&self, bank: u8, number: u8) -> Option<&'static GlobalParameter> {
        self.global_parameters
            .iter()
            .find(|row| row.bank == bank && (row.number..=row.last).contains(&number))
    }

    /// The interrupt with this number.
    pub fn interrupt(&self, number: u8) -> Option<&'static Interrupt> {
        self.interrupts.iter().find(|row| row.number == number)
    }

    /// The port that GIO reads under this number in this bank.
    pub fn input_port(&self, bank: u8, number: u8) -> Option<&'static Port> {
        self.ports.iter().find(|row| row.bank == bank && row.number == number && row.access.read)
    }

    /// The port that SIO writes under this number in this bank; it may be another one than the
    /// port that GIO reads there.
    pub fn output_port(&self, bank: u8, number: u8) -> Option<&'static Port> {
        self.ports.iter().find(|row| row.bank == bank && row.number == number && row.access.write)
    }

    /// The port of this kind with this number, in whichever bank it is.
    pub fn port(&self, behaviour: PortBehaviour, number: u8) -> Option<&'static Port> {
        self.ports.iter().find(|row| row.behaviour == behaviour && row.number == number)
    }

    /// The command with this number.
    pub fn command(&self, number: u8) -> Option<&'static Command> {
        let at = self.commands.binary_search_by_key(&number, |row| row.number).ok()?;
        self.commands.get(at)
    }
}

/// The module with this name, in any case.
pub fn find(name: &str) -> Option<&'static Module> {
    MODULES.iter().copied().find(|module| module.name.eq_ignore_ascii_case(name))
}
