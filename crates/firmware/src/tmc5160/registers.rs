//! Addresses and bit fields of the TMC5160 (datasheet chapter 6).

pub(crate) use crate::field::{Field, sign_extend};

pub(crate) const GCONF: u8 = 0x00;
pub(crate) const SHORT_CONF: u8 = 0x09;
pub(crate) const DRV_CONF: u8 = 0x0A;
pub(crate) const IHOLD_IRUN: u8 = 0x10;
pub(crate) const TPOWERDOWN: u8 = 0x11;
pub(crate) const TSTEP: u8 = 0x12;
pub(crate) const TPWMTHRS: u8 = 0x13;
pub(crate) const TCOOLTHRS: u8 = 0x14;
pub(crate) const THIGH: u8 = 0x15;
pub(crate) const RAMPMODE: u8 = 0x20;
pub(crate) const XACTUAL: u8 = 0x21;
pub(crate) const VACTUAL: u8 = 0x22;
pub(crate) const VSTART: u8 = 0x23;
pub(crate) const A1: u8 = 0x24;
pub(crate) const V1: u8 = 0x25;
pub(crate) const AMAX: u8 = 0x26;
pub(crate) const VMAX: u8 = 0x27;
pub(crate) const DMAX: u8 = 0x28;
pub(crate) const D1: u8 = 0x2A;
pub(crate) const VSTOP: u8 = 0x2B;
pub(crate) const TZEROWAIT: u8 = 0x2C;
pub(crate) const XTARGET: u8 = 0x2D;
pub(crate) const VDCMIN: u8 = 0x33;
pub(crate) const SW_MODE: u8 = 0x34;
pub(crate) const RAMP_STAT: u8 = 0x35;
pub(crate) const XLATCH: u8 = 0x36;
pub(crate) const ENCMODE: u8 = 0x38;
pub(crate) const X_ENC: u8 = 0x39;
pub(crate) const ENC_CONST: u8 = 0x3A;
pub(crate) const ENC_STATUS: u8 = 0x3B;
pub(crate) const ENC_LATCH: u8 = 0x3C;
pub(crate) const ENC_DEVIATION: u8 = 0x3D;
pub(crate) const CHOPCONF: u8 = 0x6C;
pub(crate) const COOLCONF: u8 = 0x6D;
pub(crate) const DCCTRL: u8 = 0x6E;
pub(crate) const DRV_STATUS: u8 = 0x6F;
pub(crate) const PWMCONF: u8 = 0x70;
pub(crate) const PWM_SCALE: u8 = 0x71;

/// Registers that the chip gives back, as in the datasheet's R, R/W and R+C columns.
const READABLE: [u8; 26] = [
    GCONF, 0x01, 0x02, 0x04, 0x07, 0x08, 0x0C, TSTEP, RAMPMODE, XACTUAL, VACTUAL, XTARGET, SW_MODE,
    RAMP_STAT, XLATCH, ENCMODE, X_ENC, ENC_STATUS, ENC_LATCH, 0x6A, 0x6B, CHOPCONF, DRV_STATUS,
    PWM_SCALE, 0x72, 0x73,
];

const READABLE_MASK: u128 = {
    let mut mask = 0;
    let mut at = 0;
    while at < READABLE.len() {
        mask |= 1 << READABLE[at];
        at += 1;
    }
    mask
};

/// Whether the chip gives this register back.
pub(crate) const fn is_readable(address: u8) -> bool {
    READABLE_MASK >> (address % 128) & 1 != 0
}

pub(crate) const RAMPMODE_POSITION: u32 = 0;
pub(crate) const RAMPMODE_VELOCITY_POSITIVE: u32 = 1;
pub(crate) const RAMPMODE_VELOCITY_NEGATIVE: u32 = 2;

/// What no axis parameter sets, as the vendor's open firmware for this chip leaves it.
pub(crate) const INITIAL: [(u8, u32); 7] = [
    (GCONF, 0x0000_0003),
    (CHOPCONF, 0x0041_0253),
    (SHORT_CONF, 0x0000_0306),
    (DRV_CONF, 0x0001_000A),
    (IHOLD_IRUN, 0x0007_0000),
    (PWMCONF, 0xC40C_001E),
    (RAMPMODE, RAMPMODE_POSITION),
];

pub(crate) const GCONF_STEALTHCHOP: Field = Field::new(GCONF, 2, 1);
pub(crate) const GCONF_SHAFT: Field = Field::new(GCONF, 4, 1);
pub(crate) const IHOLD: Field = Field::new(IHOLD_IRUN, 0, 5);
pub(crate) const IRUN: Field = Field::new(IHOLD_IRUN, 8, 5);
pub(crate) const IHOLDDELAY: Field = Field::new(IHOLD_IRUN, 16, 4);
pub(crate) const STOP_LEFT_ENABLE: Field = Field::new(SW_MODE, 0, 1);
pub(crate) const STOP_RIGHT_ENABLE: Field = Field::new(SW_MODE, 1, 1);
pub(crate) const STOP_LEFT_POLARITY: Field = Field::new(SW_MODE, 2, 1);
pub(crate) const STOP_RIGHT_POLARITY: Field = Field::new(SW_MODE, 3, 1);
pub(crate) const SWAP_LEFT_RIGHT: Field = Field::new(SW_MODE, 4, 1);
pub(crate) const SG_STOP: Field = Field::new(SW_MODE, 10, 1);
pub(crate) const SOFT_STOP: Field = Field::new(SW_MODE, 11, 1);
pub(crate) const RAMP_STAT_STOP_LEFT: Field = Field::new(RAMP_STAT, 0, 1);
pub(crate) const RAMP_STAT_STOP_RIGHT: Field = Field::new(RAMP_STAT, 1, 1);
/// Whether a limit switch holds the axis, left and right.
pub(crate) const EVENT_STOP_SWITCH: Field = Field::new(RAMP_STAT, 4, 2);
pub(crate) const EVENT_STOP_SG: Field = Field::new(RAMP_STAT, 6, 1);
pub(crate) const RAMP_STAT_VELOCITY_REACHED: Field = Field::new(RAMP_STAT, 8, 1);
pub(crate) const RAMP_STAT_POSITION_REACHED: Field = Field::new(RAMP_STAT, 9, 1);
pub(crate) const ENCMODE_DECIMAL: Field = Field::new(ENCMODE, 10, 1);
pub(crate) const ENCMODE_SETTINGS: Field = Field::new(ENCMODE, 0, 10);
/// What a null channel event triggers: bit 0 each one, bit 1 the next one only.
pub(crate) const ENCMODE_ACTIONS: Field = Field::new(ENCMODE, 4, 2);
pub(crate) const ENCMODE_LATCH_ONCE: u32 = 2;
pub(crate) const ENCMODE_CLEAR: Field = Field::new(ENCMODE, 8, 1);
pub(crate) const ENCMODE_LATCH_POSITION: Field = Field::new(ENCMODE, 9, 1);
/// Bits of ENC_STATUS; written as 1 they are cleared.
pub(crate) const ENC_STATUS_N_EVENT: u32 = 1;
pub(crate) const ENC_STATUS_DEVIATION: u32 = 2;
pub(crate) const TOFF: Field = Field::new(CHOPCONF, 0, 4);
pub(crate) const HSTRT: Field = Field::new(CHOPCONF, 4, 3);
pub(crate) const HEND: Field = Field::new(CHOPCONF, 7, 4);
pub(crate) const FAST_DECAY_TIME: Field = Field::new(CHOPCONF, 4, 3);
pub(crate) const FAST_DECAY_TIME_MSB: Field = Field::new(CHOPCONF, 11, 1);
pub(crate) const SINE_OFFSET: Field = Field::new(CHOPCONF, 7, 4);
pub(crate) const DISFDCC: Field = Field::new(CHOPCONF, 12, 1);
pub(crate) const RNDTF: Field = Field::new(CHOPCONF, 13, 1);
pub(crate) const CHM: Field = Field::new(CHOPCONF, 14, 1);
pub(crate) const TBL: Field = Field::new(CHOPCONF, 15, 2);
pub(crate) const VHIGHFS: Field = Field::new(CHOPCONF, 18, 1);
pub(crate) const VHIGHCHM: Field = Field::new(CHOPCONF, 19, 1);
pub(crate) const TPFD: Field = Field::new(CHOPCONF, 20, 4);
pub(crate) const MRES: Field = Field::new(CHOPCONF, 24, 4);
pub(crate) const SEMIN: Field = Field::new(COOLCONF, 0, 4);
pub(crate) const SEUP: Field = Field::new(COOLCONF, 5, 2);
pub(crate) const SEMAX: Field = Field::new(COOLCONF, 8, 4);
pub(crate) const SEDN: Field = Field::new(COOLCONF, 13, 2);
pub(crate) const SEIMIN: Field = Field::new(COOLCONF, 15, 1);
pub(crate) const SGT: Field = Field::new(COOLCONF, 16, 7);
pub(crate) const SFILT: Field = Field::new(COOLCONF, 24, 1);
pub(crate) const DC_TIME: Field = Field::new(DCCTRL, 0, 10);
pub(crate) const DC_SG: Field = Field::new(DCCTRL, 16, 8);
pub(crate) const SG_RESULT: Field = Field::new(DRV_STATUS, 0, 10);
pub(crate) const STEALTH_ACTIVE: Field = Field::new(DRV_STATUS, 14, 1);
pub(crate) const CS_ACTUAL: Field = Field::new(DRV_STATUS, 16, 5);
pub(crate) const DRIVER_FLAGS: Field = Field::new(DRV_STATUS, 24, 8);
pub(crate) const PWM_OFS: Field = Field::new(PWMCONF, 0, 8);
pub(crate) const PWM_GRAD: Field = Field::new(PWMCONF, 8, 8);
pub(crate) const PWM_FREQ: Field = Field::new(PWMCONF, 16, 2);
pub(crate) const PWM_AUTOSCALE: Field = Field::new(PWMCONF, 18, 1);
pub(crate) const FREEWHEEL: Field = Field::new(PWMCONF, 20, 2);
pub(crate) const PWM_SCALE_SUM: Field = Field::new(PWM_SCALE, 0, 8);

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_a_virtual_axis_never_shows_lies_where_the_datasheet_puts_it() {
        // DRV_STATUS: load in bits 0..=9, the driver's flags in the top byte. XLATCH is register 36h.
        assert_eq!(SG_RESULT.register, 0x6F);
        assert_eq!(SG_RESULT.extract(0xFFFF_FD55), 0x155);
        assert_eq!(SG_RESULT.extract(0x0000_03FF), 0x3FF);
        assert_eq!(DRIVER_FLAGS.extract(0xA500_0000), 0xA5);
        assert_eq!((XLATCH, X_ENC, ENC_LATCH), (0x36, 0x39, 0x3C));
        assert_eq!(PWM_SCALE_SUM.extract(0xFFFF_FF42), 0x42);
    }
}
