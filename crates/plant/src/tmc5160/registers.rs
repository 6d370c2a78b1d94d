//! The registers of the TMC5160: the table that the chip, its tests and the documentation share.
//!
//! Source: datasheet of the TMC5160/A, chapter 6. Where it names no reset value, the value is the one
//! that the vendor's open driver library starts from, or 0.

pub use crate::access::Access;

/// One register.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct Register {
    /// Address, 7 bits.
    pub address: u8,
    /// Name as the datasheet prints it.
    pub name: &'static str,
    /// Number of bits; those above read as 0 and ignore writes.
    pub bits: u8,
    /// What reading and writing does.
    pub access: Access,
    /// Value after a reset.
    pub reset: u32,
}

impl Register {
    /// The bits that exist.
    pub const fn mask(&self) -> u32 {
        match 1u32.checked_shl(self.bits as u32) {
            Some(end) => end - 1,
            None => u32::MAX,
        }
    }
}

const fn r(address: u8, name: &'static str, bits: u8, reset: u32) -> Register {
    Register { address, name, bits, access: Access::ReadOnly, reset }
}

const fn w(address: u8, name: &'static str, bits: u8, reset: u32) -> Register {
    Register { address, name, bits, access: Access::WriteOnly, reset }
}

const fn rw(address: u8, name: &'static str, bits: u8, reset: u32) -> Register {
    Register { address, name, bits, access: Access::ReadWrite, reset }
}

const fn w1c(address: u8, name: &'static str, bits: u8, clearable: u32, reset: u32) -> Register {
    Register { address, name, bits, access: Access::WriteOneToClear(clearable), reset }
}

/// All registers by address, ascending.
pub const REGISTERS: &[Register] = &[
    rw(GCONF, "GCONF", 18, 0x0000_0008),
    w1c(GSTAT, "GSTAT", 3, 0b111, 1),
    r(0x02, "IFCNT", 8, 0),
    w(0x03, "SLAVECONF", 12, 0),
    // The write side, OUTPUT, drives a pin that only exists with the single wire interface.
    r(IOIN, "IOIN", 32, VERSION << 24),
    w(0x05, "X_COMPARE", 32, 0),
    w(0x06, "OTP_PROG", 16, 0),
    r(0x07, "OTP_READ", 8, 0),
    rw(0x08, "FACTORY_CONF", 5, 0),
    w(0x09, "SHORT_CONF", 19, 0x0001_0606),
    w(0x0A, "DRV_CONF", 22, 0x0008_0400),
    w(GLOBAL_SCALER, "GLOBAL_SCALER", 8, 0),
    r(0x0C, "OFFSET_READ", 16, 0),
    w(IHOLD_IRUN, "IHOLD_IRUN", 20, 0x0007_0A03),
    w(TPOWERDOWN, "TPOWERDOWN", 8, 10),
    r(TSTEP, "TSTEP", 20, 0x000F_FFFF),
    w(TPWMTHRS, "TPWMTHRS", 20, 0),
    w(TCOOLTHRS, "TCOOLTHRS", 20, 0),
    w(THIGH, "THIGH", 20, 0),
    rw(RAMPMODE, "RAMPMODE", 2, 0),
    rw(XACTUAL, "XACTUAL", 32, 0),
    r(VACTUAL, "VACTUAL", 24, 0),
    w(VSTART, "VSTART", 18, 0),
    w(A1, "A1", 16, 0),
    w(V1, "V1", 20, 0),
    w(AMAX, "AMAX", 16, 0),
    w(VMAX, "VMAX", 23, 0),
    w(DMAX, "DMAX", 16, 0),
    w(D1, "D1", 16, 0),
    w(VSTOP, "VSTOP", 18, 1),
    w(TZEROWAIT, "TZEROWAIT", 16, 0),
    rw(XTARGET, "XTARGET", 32, 0),
    w(VDCMIN, "VDCMIN", 23, 0),
    rw(SW_MODE, "SW_MODE", 12, 0),
    // Standing on its target at VMAX = 0: velocity reached, position reached, speed zero.
    w1c(RAMP_STAT, "RAMP_STAT", 14, RAMP_STAT_EVENTS, 0b0111 << 8),
    r(XLATCH, "XLATCH", 32, 0),
    rw(ENCMODE, "ENCMODE", 11, 0),
    rw(X_ENC, "X_ENC", 32, 0),
    w(ENC_CONST, "ENC_CONST", 32, 65_536),
    w1c(ENC_STATUS, "ENC_STATUS", 2, 0b11, 0),
    r(ENC_LATCH, "ENC_LATCH", 32, 0),
    w(ENC_DEVIATION, "ENC_DEVIATION", 20, 0),
    w(MSLUT, "MSLUT[0]", 32, 0xAAAA_B554),
    w(0x61, "MSLUT[1]", 32, 0x4A95_54AA),
    w(0x62, "MSLUT[2]", 32, 0x2449_2929),
    w(0x63, "MSLUT[3]", 32, 0x1010_4222),
    w(0x64, "MSLUT[4]", 32, 0xFBFF_FFFF),
    w(0x65, "MSLUT[5]", 32, 0xB5BB_777D),
    w(0x66, "MSLUT[6]", 32, 0x4929_5556),
    w(0x67, "MSLUT[7]", 32, 0x0040_4222),
    w(MSLUTSEL, "MSLUTSEL", 32, 0xFFFF_8056),
    w(MSLUTSTART, "MSLUTSTART", 24, 0x00F7_0000),
    r(MSCNT, "MSCNT", 10, 0),
    r(MSCURACT, "MSCURACT", 25, 0x00F7_0000),
    rw(CHOPCONF, "CHOPCONF", 32, 0x1041_0150),
    w(COOLCONF, "COOLCONF", 25, 0),
    w(0x6E, "DCCTRL", 24, 0),
    r(DRV_STATUS, "DRV_STATUS", 32, 10 << 16),
    w(PWMCONF, "PWMCONF", 32, 0xC40C_001E),
    r(PWM_SCALE, "PWM_SCALE", 25, 0),
    r(0x72, "PWM_AUTO", 24, 0),
    r(0x73, "LOST_STEPS", 20, 0),
];

/// General configuration.
pub const GCONF: u8 = 0x00;
/// Global status: bit 0 reset, bit 1 driver error, bit 2 charge pump undervoltage.
pub const GSTAT: u8 = 0x01;
/// Input pins and version.
pub const IOIN: u8 = 0x04;
/// Scale of all currents in 1/256; 0 counts as 256.
pub const GLOBAL_SCALER: u8 = 0x0B;
/// Standstill current 0-4, run current 8-12, delay of the steps between them 16-19.
pub const IHOLD_IRUN: u8 = 0x10;
/// Time from standstill to the beginning of the power-down, in 2^18 clocks.
pub const TPOWERDOWN: u8 = 0x11;
/// Clocks between two 1/256 steps.
pub const TSTEP: u8 = 0x12;
/// Smallest TSTEP for StealthChop.
pub const TPWMTHRS: u8 = 0x13;
/// Largest TSTEP for CoolStep and the stop by StallGuard2.
pub const TCOOLTHRS: u8 = 0x14;
/// Largest TSTEP for the high-speed modes.
pub const THIGH: u8 = 0x15;
/// 0 position, 1 velocity positive, 2 velocity negative, 3 hold.
pub const RAMPMODE: u8 = 0x20;
/// Actual position in microsteps.
pub const XACTUAL: u8 = 0x21;
/// Actual velocity, 24 bits with sign.
pub const VACTUAL: u8 = 0x22;
/// Start speed.
pub const VSTART: u8 = 0x23;
/// Acceleration from VSTART to V1.
pub const A1: u8 = 0x24;
/// Speed at which the accelerations change.
pub const V1: u8 = 0x25;
/// Acceleration from V1 to VMAX; the acceleration of the velocity modes.
pub const AMAX: u8 = 0x26;
/// Target speed.
pub const VMAX: u8 = 0x27;
/// Deceleration from VMAX to V1.
pub const DMAX: u8 = 0x28;
/// Deceleration from V1 to VSTOP.
pub const D1: u8 = 0x2A;
/// Stop speed.
pub const VSTOP: u8 = 0x2B;
/// Wait at zero, in 512 clocks.
pub const TZEROWAIT: u8 = 0x2C;
/// Target position in microsteps.
pub const XTARGET: u8 = 0x2D;
/// Smallest speed for DcStep; 0 switches it off.
pub const VDCMIN: u8 = 0x33;
/// Configuration of the reference switches.
pub const SW_MODE: u8 = 0x34;
/// Status of ramp and switches.
pub const RAMP_STAT: u8 = 0x35;
/// Position latched by a switch or by the encoder's index.
pub const XLATCH: u8 = 0x36;
/// Configuration of the encoder.
pub const ENCMODE: u8 = 0x38;
/// Position of the encoder.
pub const X_ENC: u8 = 0x39;
/// What one count of the encoder adds to X_ENC.
pub const ENC_CONST: u8 = 0x3A;
/// Events of the encoder: bit 0 index, bit 1 deviation.
pub const ENC_STATUS: u8 = 0x3B;
/// X_ENC at the last index event.
pub const ENC_LATCH: u8 = 0x3C;
/// Largest deviation of X_ENC from XACTUAL; 0 switches the watch off.
pub const ENC_DEVIATION: u8 = 0x3D;
/// First of the eight registers of the microstep table.
pub const MSLUT: u8 = 0x60;
/// Segments of the microstep table.
pub const MSLUTSEL: u8 = 0x68;
/// Start values of the microstep table.
pub const MSLUTSTART: u8 = 0x69;
/// Position in the microstep table, 1024 per electrical period.
pub const MSCNT: u8 = 0x6A;
/// Currents of both coils according to the microstep table.
pub const MSCURACT: u8 = 0x6B;
/// Chopper configuration; the microstep resolution is in bits 24-27.
pub const CHOPCONF: u8 = 0x6C;
/// Configuration of CoolStep and StallGuard2.
pub const COOLCONF: u8 = 0x6D;
/// Status of the driver.
pub const DRV_STATUS: u8 = 0x6F;
/// Configuration of StealthChop: amplitude 0-7, gradient 8-15, automatic scale 18, freewheeling 20-21.
pub const PWMCONF: u8 = 0x70;
/// Amplitude of StealthChop at present, bits 0-7.
pub const PWM_SCALE: u8 = 0x71;

/// Version of the chip, bits 24-31 of IOIN.
pub const VERSION: u32 = 0x30;

/// The events of RAMP_STAT that stay until they are cleared: latch left and right, stop by
/// StallGuard2, position reached, second move.
pub const RAMP_STAT_EVENTS: u32 = 1 << 2 | 1 << 3 | 1 << 6 | 1 << 7 | 1 << 12;

/// The register at an address, if there is one.
pub fn register(address: u8) -> Option<&'static Register> {
    const INDEX: [u8; 128] = {
        let mut index = [u8::MAX; 128];
        let mut at = 0;
        while at < REGISTERS.len() {
            index[REGISTERS[at].address as usize] = at as u8;
            at += 1;
        }
        index
    };
    REGISTERS.get(usize::from(*INDEX.get(usize::from(address))?))
}
