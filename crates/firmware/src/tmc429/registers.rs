//! Addresses and bit fields of the TMC429 and of the TMC26x behind it.
//!
//! An axis sees the sixteen registers of its own motor in its TMC429, and those that three axes share from
//! 30h on. The TMC26x has no addresses: a datagram of 20 bits names its register itself. It is written to
//! 40h, and read there it is the answer to the last one.

pub(crate) use crate::field::{Field, sign_extend};

pub(crate) const X_TARGET: u8 = 0x00;
pub(crate) const X_ACTUAL: u8 = 0x01;
pub(crate) const V_MIN: u8 = 0x02;
pub(crate) const V_MAX: u8 = 0x03;
pub(crate) const V_TARGET: u8 = 0x04;
pub(crate) const V_ACTUAL: u8 = 0x05;
pub(crate) const A_MAX: u8 = 0x06;
pub(crate) const A_ACTUAL: u8 = 0x07;
pub(crate) const PMUL_PDIV: u8 = 0x09;
pub(crate) const REF_CONF: u8 = 0x0A;
pub(crate) const DIVISORS: u8 = 0x0C;
pub(crate) const DX_REF_TOLERANCE: u8 = 0x0D;
pub(crate) const SWITCHES: u8 = 0x3E;
/// Interface of a chip, which its three axes share.
pub(crate) const IF_CONFIGURATION: u8 = 0x34;

/// Axes that share a TMC429.
pub(crate) const AXES_OF_A_TMC429: u8 = 3;

/// The driver chip: datagrams to it, and its last answer.
pub(crate) const DRIVER: u8 = 0x40;

pub(crate) const INVERT_SWITCHES: Field = Field::new(IF_CONFIGURATION, 0, 1);
pub(crate) const INVERT_DIRECTION: Field = Field::new(IF_CONFIGURATION, 4, 1);
/// Step and direction outputs, and an input for each right switch.
pub(crate) const ENABLE_STEP_DIRECTION: Field = Field::new(IF_CONFIGURATION, 5, 1);
pub(crate) const ENABLE_RIGHT_SWITCHES: Field = Field::new(IF_CONFIGURATION, 8, 1);
pub(crate) const RAMP_MODE: Field = Field::new(REF_CONF, 0, 2);
pub(crate) const DISABLE_STOP_LEFT: Field = Field::new(REF_CONF, 8, 1);
pub(crate) const DISABLE_STOP_RIGHT: Field = Field::new(REF_CONF, 9, 1);
pub(crate) const SOFT_STOP: Field = Field::new(REF_CONF, 10, 1);
pub(crate) const PULSE_DIV: Field = Field::new(DIVISORS, 12, 4);
pub(crate) const RAMP_DIV: Field = Field::new(DIVISORS, 8, 4);

pub(crate) const RAMP_MODE_RAMP: u32 = 0;
pub(crate) const RAMP_MODE_VELOCITY: u32 = 2;

/// Registers of the TMC26x, by the upper three bits of a datagram; only the driver's memory knows them by
/// these numbers.
pub(crate) const DRVCTRL: u8 = 0x50;
pub(crate) const CHOPCONF: u8 = 0x54;
pub(crate) const SMARTEN: u8 = 0x55;
pub(crate) const SGCSCONF: u8 = 0x56;
pub(crate) const DRVCONF: u8 = 0x57;

/// Bits of a datagram below those that name its register.
pub(crate) const DATAGRAM_BITS: u32 = 17;

pub(crate) const MRES: Field = Field::new(DRVCTRL, 0, 4);
pub(crate) const DEDGE: Field = Field::new(DRVCTRL, 8, 1);
pub(crate) const INTPOL: Field = Field::new(DRVCTRL, 9, 1);
pub(crate) const TOFF: Field = Field::new(CHOPCONF, 0, 4);
pub(crate) const HSTRT: Field = Field::new(CHOPCONF, 4, 3);
pub(crate) const HEND: Field = Field::new(CHOPCONF, 7, 4);
pub(crate) const HDEC: Field = Field::new(CHOPCONF, 11, 2);
pub(crate) const RNDTF: Field = Field::new(CHOPCONF, 13, 1);
pub(crate) const CHM: Field = Field::new(CHOPCONF, 14, 1);
pub(crate) const TBL: Field = Field::new(CHOPCONF, 15, 2);
pub(crate) const SEMIN: Field = Field::new(SMARTEN, 0, 4);
pub(crate) const SEUP: Field = Field::new(SMARTEN, 5, 2);
pub(crate) const SEMAX: Field = Field::new(SMARTEN, 8, 4);
pub(crate) const SEDN: Field = Field::new(SMARTEN, 13, 2);
pub(crate) const SEIMIN: Field = Field::new(SMARTEN, 15, 1);
pub(crate) const CS: Field = Field::new(SGCSCONF, 0, 5);
pub(crate) const SGT: Field = Field::new(SGCSCONF, 8, 7);
pub(crate) const SFILT: Field = Field::new(SGCSCONF, 16, 1);
pub(crate) const RDSEL: Field = Field::new(DRVCONF, 4, 2);
pub(crate) const VSENSE: Field = Field::new(DRVCONF, 6, 1);
pub(crate) const TS2G: Field = Field::new(DRVCONF, 8, 2);
pub(crate) const DISS2G: Field = Field::new(DRVCONF, 10, 1);
pub(crate) const SLPL: Field = Field::new(DRVCONF, 12, 2);
pub(crate) const SLPH: Field = Field::new(DRVCONF, 14, 2);

/// What RDSEL makes the driver answer besides its flags.
pub(crate) const RDSEL_STALLGUARD: u32 = 1;
pub(crate) const RDSEL_CURRENT: u32 = 2;

/// The answer of the driver: flags, load, and the current that CoolStep has chosen.
pub(crate) const FLAGS: Field = Field::new(DRIVER, 0, 8);
pub(crate) const FLAG_STALLED: Field = Field::new(DRIVER, 0, 1);
pub(crate) const LOAD: Field = Field::new(DRIVER, 10, 10);
pub(crate) const ACTUAL_CURRENT: Field = Field::new(DRIVER, 10, 5);
