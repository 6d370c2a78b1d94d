//! What moves an axis: a TMC5160, a TMC429 with a TMC26x behind it, or the regulators of a servo axis. Here is what
//! all can do; what only one of them can is in its own room.

use opentmcl_catalog::Motion;
use opentmcl_motion::interpolation::Limits;

use crate::axis::{AxisNumber, AxisState};
use crate::board::Board;
use crate::module::Module;
use crate::servo;
use crate::{tmc429, tmc5160, units};

/// Registers of an axis on the board; addresses have seven bits.
pub(crate) const REGISTERS: usize = 128;

/// What is known of the chips of an axis beside what they tell themselves.
#[derive(Clone, Debug)]
pub(crate) struct Memory {
    /// Last value written to each register, for those that cannot be read.
    written: [u32; REGISTERS],
    /// The ramp limits as set by parameters. The registers differ from them during interpolated moves,
    /// and the one for the speed also in velocity mode.
    pub(crate) settings: Limits,
}

impl Default for Memory {
    fn default() -> Self {
        Self { written: [0; REGISTERS], settings: Limits::default() }
    }
}

impl Memory {
    pub(crate) fn written(&self, address: u8) -> u32 {
        self.written[usize::from(address) % REGISTERS]
    }

    pub(crate) fn note(&mut self, address: u8, value: u32) {
        self.written[usize::from(address) % REGISTERS] = value;
    }

    /// The chips have been reset.
    pub(crate) fn forget(&mut self) {
        self.written = [0; REGISTERS];
    }
}

/// The chips of an axis and the way to them.
pub(crate) enum Drive<'a, B> {
    Tmc5160(tmc5160::Chip<'a, B>),
    Tmc429(tmc429::Chip<'a, B>),
    Servo(servo::axis::Axis<'a, B>),
}

/// The same call to whichever chip it is.
macro_rules! either {
    ($drive:expr, $chip:ident => $call:expr) => {
        match $drive {
            Drive::Tmc5160($chip) => $call,
            Drive::Tmc429($chip) => $call,
            Drive::Servo($chip) => $call,
        }
    };
}

impl<B: Board> Drive<'_, B> {
    /// Writes what no parameter sets.
    pub(crate) fn initialize(&mut self) {
        either!(self, chip => chip.initialize());
    }

    /// The ramp limits as set by parameters; a servo axis has none for moves together with others.
    pub(crate) fn settings(&self) -> Limits {
        match self {
            Self::Tmc5160(chip) => chip.state.settings,
            Self::Tmc429(chip) => chip.state.settings,
            Self::Servo(_) => Limits::default(),
        }
    }

    /// The position counter.
    pub(crate) fn position(&mut self) -> i32 {
        either!(self, chip => chip.position())
    }

    /// Sets the position counter; the axis must stand in velocity mode.
    pub(crate) fn set_position(&mut self, position: i32) {
        either!(self, chip => chip.set_position(position));
    }

    /// The target of the last move.
    pub(crate) fn target(&mut self) -> i32 {
        either!(self, chip => chip.target())
    }

    /// What the encoder of the axis counts; without one, the position counter.
    pub(crate) fn encoder_position(&mut self) -> i32 {
        match self {
            Self::Tmc5160(chip) => chip.encoder_position(),
            Self::Tmc429(chip) => chip.position(),
            Self::Servo(axis) => axis.position(),
        }
    }

    /// The speed in the chip's unit.
    pub(crate) fn velocity(&mut self) -> i32 {
        either!(self, chip => chip.velocity())
    }

    /// The speed for those who look on: of a stepper in microsteps per second, away from zero; of a servo in
    /// revolutions per minute.
    pub(crate) fn shown_speed(&mut self) -> i32 {
        match self {
            Self::Tmc5160(chip) => units::speed_from_register(i64::from(chip.velocity())),
            Self::Tmc429(chip) => chip.pps(),
            Self::Servo(axis) => axis.velocity(),
        }
    }

    /// Whether target and actual position are equal.
    pub(crate) fn position_reached(&mut self) -> bool {
        either!(self, chip => chip.position_reached())
    }

    /// Levels of the left and the right limit switch, after swapping and polarity.
    pub(crate) fn limit_switches(&mut self) -> (bool, bool) {
        either!(self, chip => chip.limit_switches())
    }

    /// Turns with this speed, positive to the right. Only the maximum acceleration counts.
    pub(crate) fn rotate(&mut self, axis: &mut AxisState, velocity: i32) {
        either!(self, chip => chip.rotate(axis, velocity));
    }

    /// Moves to a position with the limits set by parameters.
    pub(crate) fn move_to(&mut self, axis: &mut AxisState, position: i32) {
        either!(self, chip => chip.move_to(axis, position));
    }

    /// Moves to a position with other limits, which hold until the next motion command.
    pub(crate) fn move_to_within(&mut self, axis: &mut AxisState, position: i32, limits: Limits) {
        either!(self, chip => chip.move_to_within(axis, position, limits));
    }

    /// Stops with the largest deceleration there is, until the next motion command.
    pub(crate) fn stop_hard(&mut self, axis: &mut AxisState) {
        either!(self, chip => chip.stop_hard(axis));
    }

    /// Keeps the limit switches from stopping the axis; what to give back to [`Drive::restore_stops`].
    pub(crate) fn suspend_stops(&mut self) -> u32 {
        either!(self, chip => chip.suspend_stops())
    }

    /// Lets the limit switches stop the axis as before.
    pub(crate) fn restore_stops(&mut self, stops: u32) {
        either!(self, chip => chip.restore_stops(stops));
    }
}

impl<B: Board> Module<B> {
    /// The chips of an axis.
    pub(crate) fn drive(&mut self, axis: AxisNumber) -> (Drive<'_, B>, &mut AxisState) {
        let (state, board, now) = (&mut self.chips[axis], &mut self.board, self.now);
        let drive = match self.model.motion {
            Motion::Tmc5160 => Drive::Tmc5160(tmc5160::Chip { axis, state, board }),
            Motion::Tmc429 => Drive::Tmc429(tmc429::Chip { axis, state, board }),
            Motion::Foc | Motion::Block => {
                Drive::Servo(servo::axis::Axis { servo: &mut self.servo, board, now })
            }
        };
        (drive, &mut self.axes[axis])
    }
}
