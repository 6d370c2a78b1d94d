//! Status flags (parameter 156), and what switches the bridge off.
//!
//! # Readings
//!
//! - The flag of overcurrent says that the current has reached its limit: a regulator at its limit exceeds it all
//!   the time by a little, as the manual itself says of the limit. It is the mean of a millisecond that counts, so
//!   that a single reading does not set it.
//! - Flags 0, 5 and 6 stay until they are read, or, of a TMCM-1613, flag 6 until parameter 215 acknowledges it. So do
//!   flags 1, 2 and 3 if they have stopped the motor.
//!   All others follow what they tell.
//! - Under- and overvoltage, overtemperature and a fault of the gate driver switch the bridge off and lead to stop
//!   mode, which a motion command ends when the cause is gone.

use opentmcl_catalog::{Foc, Motion, Servo as Shared};
use opentmcl_motion::servo::hall;

use super::init::State;
use super::{DISABLED, Mode, NO_MOTOR, Servo, Surroundings};

const OVERCURRENT: u32 = 1 << 0;
const UNDERVOLTAGE: u32 = 1 << 1;
const OVERVOLTAGE: u32 = 1 << 2;
const OVERTEMPERATURE: u32 = 1 << 3;
const HALTED: u32 = 1 << 4;
const HALL_ERROR: u32 = 1 << 5;
const DRIVER_ERROR: u32 = 1 << 6;
const STOP_MODE: u32 = 1 << 8;
const VELOCITY_MODE: u32 = 1 << 9;
const POSITION_MODE: u32 = 1 << 10;
const TORQUE_MODE: u32 = 1 << 11;
const POSITION_END: u32 = 1 << 14;
const INITIALIZED: u32 = 1 << 15;

/// Supply in 0.1 V and temperature in °C at which the bridge goes off and comes back.
struct Thresholds {
    undervoltage: (i32, i32),
    overvoltage: (i32, i32),
    overtemperature: (i32, i32),
}

/// The TMCM-1613 is made for 6 to 24 V.
const BLOCK: Thresholds =
    Thresholds { undervoltage: (55, 60), overvoltage: (300, 290), overtemperature: (110, 100) };

/// The TMCM-1636 for up to 48 V from 8 V on; the upper ends are those of open firmware for a sister module.
const FOC: Thresholds =
    Thresholds { undervoltage: (75, 80), overvoltage: (560, 550), overtemperature: (110, 100) };

/// Flags, and why the bridge may be off.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(super) struct Status {
    /// Flags that follow what they tell.
    conditions: u32,
    /// Flags that stay until they are read.
    latched: u32,
    /// Whether position and speed are within the window of the target.
    pub(super) reached: bool,
    /// Whether the gate driver is cut off for access to its registers (parameter 216).
    pub(super) driver_spi: bool,
    /// Whether program memory is being filled.
    pub(super) downloading: bool,
    enabled: bool,
}

impl Servo {
    /// The value of parameter 156. Reading it clears what has been latched.
    pub(super) fn take_flags(&mut self) -> i32 {
        let flags = self.flags();
        let keeps = if self.motion == Motion::Block { DRIVER_ERROR } else { 0 };
        self.status.latched &= keeps;
        flags as i32
    }

    /// The same without clearing anything.
    pub(super) fn flags(&self) -> u32 {
        let status = &self.status;
        let end = if status.reached { POSITION_END } else { 0 };
        let ready = if self.is_initialized() { INITIALIZED } else { 0 };
        status.conditions | status.latched | self.mode.flag() | end | ready
    }

    fn is_initialized(&self) -> bool {
        match self.motion {
            Motion::Foc => {
                self.settings[Foc::CommutationMode] != DISABLED && self.init.state == State::Idle
            }
            _ => true,
        }
    }

    pub(super) fn latch_hall_error(&mut self) {
        self.status.latched |= HALL_ERROR;
    }

    pub(super) fn latch_driver_fault(&mut self) {
        self.status.latched |= DRIVER_ERROR;
        self.set_mode(Mode::Stop);
        self.update_enabled();
    }

    pub(super) fn acknowledge_driver(&mut self) {
        self.status.latched &= !DRIVER_ERROR;
        self.status.driver_spi = false;
        self.update_enabled();
    }

    /// Whether the gate driver reports a fault, or has done so and nobody has acknowledged it.
    pub(super) fn has_driver_error(&self) -> bool {
        self.status.latched & DRIVER_ERROR != 0 || self.senses.driver_fault
    }

    /// Whether the bridge may be on.
    #[inline]
    pub(super) fn is_enabled(&self) -> bool {
        self.status.enabled
    }

    /// Whether a motion command can have an effect: there is a motor, commutation and a bridge that may be on.
    pub(super) fn is_ready(&self) -> bool {
        self.status.enabled
    }

    pub(super) fn update_enabled(&mut self) {
        let status = &self.status;
        let off = UNDERVOLTAGE | OVERVOLTAGE | OVERTEMPERATURE;
        let driver_is_well = match self.motion {
            Motion::Block => !self.has_driver_error() && !self.shunt.is_measuring(),
            _ => !self.senses.driver_fault && self.settings[Foc::DriverEnable] != 0,
        };
        let is_set_up = self.motion != Motion::Foc
            || self.settings[Foc::CommutationMode] != DISABLED
                && self.settings[Foc::MotorType] != NO_MOTOR;
        self.status.enabled = status.conditions & off == 0
            && driver_is_well
            && is_set_up
            && !status.driver_spi
            && !status.downloading;
    }

    /// Looks at all that has flags, each millisecond.
    pub(super) fn step_status(&mut self, around: &Surroundings) {
        let thresholds = if self.motion == Motion::Block { &BLOCK } else { &FOC };
        let supply = i32::from(self.senses.supply) / 10;
        let before = self.status.conditions;
        let mut conditions = 0;
        let mut note = |flag: u32, is_beyond: bool, is_back: bool| {
            if is_beyond || before & flag != 0 && !is_back {
                conditions |= flag;
            }
        };
        let (off, on) = thresholds.undervoltage;
        note(UNDERVOLTAGE, supply < off, supply >= on);
        let (off, on) = thresholds.overvoltage;
        note(OVERVOLTAGE, supply > off, supply <= on);
        let (off, on) = thresholds.overtemperature;
        note(OVERTEMPERATURE, around.temperature >= off, around.temperature < on);
        let halted = self.settings[Shared::HaltedVelocity];
        let speed = self.counted_rpm();
        // A speed of 0 is a standstill whatever the parameter says.
        note(HALTED, speed == 0 || speed < halted.unsigned_abs(), true);
        self.status.conditions = conditions;
        let off = conditions & (UNDERVOLTAGE | OVERVOLTAGE | OVERTEMPERATURE);
        if off != 0 {
            // Whoever finds the motor stopped shall find out why, however short the cause was.
            if self.mode != Mode::Stop {
                self.status.latched |= off;
            }
            self.set_mode(Mode::Stop);
        }
        let inverted = self.reading.hall_inverted;
        if self.uses_halls() && hall::sector(self.senses.halls, inverted).is_none() {
            self.latch_hall_error();
        }
        self.update_enabled();
        self.note_overcurrent();
        self.note_arrival();
    }

    fn note_overcurrent(&mut self) {
        let limit = self.settings[Shared::MaxCurrent];
        let flows = i64::from(self.measured.mean.q).abs();
        if limit > 0 && self.is_driven() && flows * 64 >= i64::from(limit) * 63 {
            self.status.latched |= OVERCURRENT;
        }
    }

    fn note_arrival(&mut self) {
        if self.mode != Mode::Position {
            self.status.reached = false;
            return;
        }
        let position = self.external(self.position());
        let distance = i64::from(self.target_position) - i64::from(position);
        let speed = self.counted_rpm();
        if distance.unsigned_abs() <= self.settings[Shared::ReachedDistance].unsigned_abs().into()
            && speed <= self.settings[Shared::ReachedVelocity].unsigned_abs()
        {
            self.status.reached = true;
        }
    }

    pub(super) fn is_hot(&self) -> bool {
        self.status.conditions & OVERTEMPERATURE != 0
    }
}

impl Mode {
    const fn flag(self) -> u32 {
        match self {
            Self::Stop => STOP_MODE,
            Self::Velocity => VELOCITY_MODE,
            Self::Position => POSITION_MODE,
            Self::Torque => TORQUE_MODE,
        }
    }
}
