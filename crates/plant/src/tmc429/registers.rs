//! The registers of the TMC429: the tables that the chip, its tests and its drivers share.
//!
//! An address has 7 bits: which axis (0..=2, or 3 for what all have in common) in the upper three, an index
//! in the lower four. On the chip's serial interface it stands above the bit for reading.
//!
//! Source: data sheet of the TMC429, chapters 9 and 10; places of the fields also from the vendor's open
//! driver library.

pub use crate::access::Access;

/// One register.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct Register {
    /// Index within the axis, or within the common registers.
    pub index: u8,
    /// Name as the data sheet prints it, in capitals.
    pub name: &'static str,
    /// The bits that exist; others read as 0 and ignore writes.
    pub mask: u32,
    /// What reading and writing does.
    pub access: Access,
    /// Value after a reset.
    pub reset: u32,
}

const fn r(index: u8, name: &'static str, mask: u32, reset: u32) -> Register {
    Register { index, name, mask, access: Access::ReadOnly, reset }
}

const fn w(index: u8, name: &'static str, mask: u32) -> Register {
    Register { index, name, mask, access: Access::WriteOnly, reset: 0 }
}

const fn rw(index: u8, name: &'static str, mask: u32, reset: u32) -> Register {
    Register { index, name, mask, access: Access::ReadWrite, reset }
}

const fn w1c(index: u8, name: &'static str, mask: u32, clearable: u32) -> Register {
    Register { index, name, mask, access: Access::WriteOneToClear(clearable), reset: 0 }
}

/// The registers that each axis has, by index.
pub const AXIS_REGISTERS: [Register; 16] = [
    rw(X_TARGET, "X_TARGET", 0xFF_FFFF, 0),
    rw(X_ACTUAL, "X_ACTUAL", 0xFF_FFFF, 0),
    rw(V_MIN, "V_MIN", 0x7FF, 0),
    rw(V_MAX, "V_MAX", 0x7FF, 0),
    rw(V_TARGET, "V_TARGET", 0xFFF, 0),
    rw(V_ACTUAL, "V_ACTUAL", 0xFFF, 0),
    rw(A_MAX, "A_MAX", 0x7FF, 0),
    r(A_ACTUAL, "A_ACTUAL", 0xFFF, 0),
    rw(A_THRESHOLD, "A_THRESHOLD", 0x77_77FF, 0),
    rw(PMUL_PDIV, "PMUL_PDIV", 0xFF0F, PMUL_FIXED),
    rw(REF_CONF_RAMP_MODE, "REF_CONF_RAMP_MODE", 0x1_0F03, 0),
    w1c(INTERRUPT, "INTERRUPT", 0xFFFF, 0xFF),
    rw(DIVISORS, "PULSE_DIV_RAMP_DIV_USRS", 0xFF07, 0),
    rw(DX_REF_TOLERANCE, "DX_REF_TOLERANCE", 0xFFF, 0),
    r(X_LATCHED, "X_LATCHED", 0xFF_FFFF, 0),
    rw(USTEP_COUNT, "USTEP_COUNT", 0xFF, 0),
];

/// The registers that exist once, by index; their addresses begin at [`COMMON`].
pub const COMMON_REGISTERS: [Register; 11] = [
    r(0x0, "DATAGRAM_LOW_WORD", 0xFF_FFFF, 0),
    r(0x1, "DATAGRAM_HIGH_WORD", 0xFF_FFFF, 0),
    rw(0x2, "COVER_POS_LEN", 0x3F1F, 0),
    w(0x3, "COVER_DATAGRAM", 0xFF_FFFF),
    rw(IF_CONFIGURATION & 0xF, "IF_CONFIGURATION", 0x1FF, 0),
    rw(0x5, "POS_COMP", 0xFF_FFFF, 0),
    w1c(0x6, "POS_COMP_INT", 0x101, 1),
    w(0x8, "POWER_DOWN", 0xFF_FFFF),
    r(TYPE_VERSION & 0xF, "TYPE_VERSION", 0xFF_FFFF, VERSION),
    r(REFERENCE_SWITCHES & 0xF, "REFERENCE_SWITCHES", 0x3F, 0),
    rw(GLOBAL_PARAMETERS & 0xF, "STEPPER_MOTOR_GLOBAL_PARAMETERS", 0x31_FFFF, 0),
];

/// Address of an axis' register: the index is one of those below.
pub const fn of_axis(axis: u8, index: u8) -> u8 {
    axis << 4 | index
}

/// Target position in microsteps, 24 bits with sign.
pub const X_TARGET: u8 = 0x0;
/// Actual position in microsteps, 24 bits with sign.
pub const X_ACTUAL: u8 = 0x1;
/// Speed from which an axis stops at once on its target.
pub const V_MIN: u8 = 0x2;
/// Highest speed.
pub const V_MAX: u8 = 0x3;
/// Velocity to run at, 12 bits with sign; what the generator aims at in the position modes.
pub const V_TARGET: u8 = 0x4;
/// Actual velocity, 12 bits with sign.
pub const V_ACTUAL: u8 = 0x5;
/// Acceleration.
pub const A_MAX: u8 = 0x6;
/// Actual acceleration, 12 bits with sign.
pub const A_ACTUAL: u8 = 0x7;
/// Scales of the current: is_agtat 20-22, is_aleat 16-18, is_v0 12-14; their threshold 0-10.
pub const A_THRESHOLD: u8 = 0x8;
/// Braking factor: pmul 8-15, of which bit 15 is always set; pdiv 0-3.
pub const PMUL_PDIV: u8 = 0x9;
/// Position latch is armed 16; configuration of the switches 8-11; ramp mode 0-1.
pub const REF_CONF_RAMP_MODE: u8 = 0xA;
/// Mask 8-15 and flags 0-7 of the interrupts.
pub const INTERRUPT: u8 = 0xB;
/// pulse_div 12-15, ramp_div 8-11, microstep resolution 0-2.
pub const DIVISORS: u8 = 0xC;
/// How far from 0 the reference switch may close, in microsteps.
pub const DX_REF_TOLERANCE: u8 = 0xD;
/// Position at the last latching; writing arms the latch.
pub const X_LATCHED: u8 = 0xE;
/// Place in the electrical period, 256 per period.
pub const USTEP_COUNT: u8 = 0xF;

/// First address of the common registers.
pub const COMMON: u8 = 0x30;
/// Interface: switches inverted 0, right switches exist 8.
pub const IF_CONFIGURATION: u8 = 0x34;
/// Type and version of the chip.
pub const TYPE_VERSION: u8 = 0x39;
/// Levels of the switches: right of axis 0, left of axis 0, right of axis 1, and so on.
pub const REFERENCE_SWITCHES: u8 = 0x3E;
/// Number of drivers 0-1, their polarities 2-6, clock 8-15; multiplexed switches 20; the third switch is the
/// right one of axis 0: 21.
pub const GLOBAL_PARAMETERS: u8 = 0x3F;

/// What TYPE_VERSION reads.
pub const VERSION: u32 = 0x42_9101;

/// PMUL_PDIV: the bit of pmul that is always set.
pub const PMUL_FIXED: u32 = 1 << 15;
/// REF_CONF_RAMP_MODE: the left switch does not stop the axis.
pub const DISABLE_STOP_LEFT: u32 = 1 << 8;
/// REF_CONF_RAMP_MODE: the right switch does not stop the axis.
pub const DISABLE_STOP_RIGHT: u32 = 1 << 9;
/// REF_CONF_RAMP_MODE: a switch stops the axis with a_max.
pub const SOFT_STOP: u32 = 1 << 10;
/// REF_CONF_RAMP_MODE: the reference switch is the right one.
pub const REFERENCE_IS_RIGHT: u32 = 1 << 11;
/// REF_CONF_RAMP_MODE: the latch waits for the reference switch.
pub const LATCH_WAITS: u32 = 1 << 16;
/// IF_CONFIGURATION: switches are inverted.
pub const INVERT_SWITCHES: u32 = 1 << 0;
/// IF_CONFIGURATION: each axis has an input for its right switch.
pub const ENABLE_RIGHT_SWITCHES: u32 = 1 << 8;
/// GLOBAL_PARAMETERS: left and right switches take turns on the inputs.
pub const SWITCHES_MULTIPLEXED: u32 = 1 << 20;
/// GLOBAL_PARAMETERS: the input of axis 2 is the right switch of axis 0.
pub const THIRD_IS_RIGHT_OF_FIRST: u32 = 1 << 21;

/// INTERRUPT: the target is reached.
pub const FLAG_TARGET_REACHED: u32 = 1 << 0;
/// INTERRUPT: the reference switch closed outside its tolerance.
pub const FLAG_REFERENCE_WRONG: u32 = 1 << 1;
/// INTERRUPT: the axis passed 0 without its reference switch.
pub const FLAG_REFERENCE_MISSED: u32 = 1 << 2;
/// INTERRUPT: the speed has become zero.
pub const FLAG_STOPPED: u32 = 1 << 3;
/// INTERRUPT: the left switch has opened.
pub const FLAG_LEFT_OPENED: u32 = 1 << 4;
/// INTERRUPT: the right switch has opened.
pub const FLAG_RIGHT_OPENED: u32 = 1 << 5;
/// INTERRUPT: the left switch has closed.
pub const FLAG_LEFT_CLOSED: u32 = 1 << 6;
/// INTERRUPT: the right switch has closed.
pub const FLAG_RIGHT_CLOSED: u32 = 1 << 7;

/// The register at an address, if there is one.
pub fn register(address: u8) -> Option<&'static Register> {
    let index = address & 0xF;
    match address >> 4 {
        0..=2 => AXIS_REGISTERS.get(usize::from(index)),
        3 => COMMON_REGISTERS.iter().find(|register| register.index == index),
        _ => None,
    }
}
