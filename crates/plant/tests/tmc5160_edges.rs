//! Edges of single registers: bits that do not exist, bits that cannot be written, thresholds met exactly.

use opentmcl_motion::Instant;
use opentmcl_plant::tmc5160::{Tmc5160, registers::*};

const NOW: Instant = Instant::from_ticks(0);

#[test]
fn a_write_to_one_of_the_status_registers_clears_no_other_bits() {
    // RAMP_STAT after a move: position reached (bits 7 and 9). Writing to bit 9 clears nothing.
    let mut chip = Tmc5160::new();
    for (address, value) in [(AMAX, 439), (DMAX, 439), (VMAX, 53_687), (XTARGET, 100)] {
        chip.write(address, value, NOW);
    }
    let later = Instant::from_ticks(16_000_000);
    assert_eq!(chip.read(RAMP_STAT, later) & (1 << 7 | 1 << 9), 1 << 7 | 1 << 9);
    chip.write(RAMP_STAT, 1 << 9, later);
    assert_eq!(chip.read(RAMP_STAT, later) & (1 << 7 | 1 << 9), 1 << 7 | 1 << 9);
    chip.write(RAMP_STAT, 1 << 7, later);
    assert_eq!(chip.read(RAMP_STAT, later) & (1 << 7 | 1 << 9), 1 << 9);
}

#[test]
fn latches_take_no_writes() {
    let mut chip = Tmc5160::new();
    chip.write(0x36, 77, NOW);
    assert_eq!(chip.read(0x36, NOW), 0);
}

#[test]
fn the_thresholds_of_stealthchop_and_full_step_include_the_speed_itself() {
    // Datasheet 6.2, 6.5: StealthChop while TSTEP >= TPWMTHRS, full step while TSTEP <= THIGH; bits 14
    // and 15 of DRV_STATUS. At 65536 units with 256 microsteps TSTEP is 2^24 / 2^16 = 256.
    let mut chip = Tmc5160::new();
    for (address, value) in [(CHOPCONF, 1 << 18), (GCONF, 1 << 2), (AMAX, 65_535), (VMAX, 65_536)] {
        chip.write(address, value, NOW);
    }
    chip.write(RAMPMODE, 1, NOW);
    let cruising = Instant::from_ticks(16_000_000);
    assert_eq!(chip.read(TSTEP, cruising), 256);
    let mut flags = |register: u8, threshold: u32| {
        chip.write(register, threshold, cruising);
        chip.read(DRV_STATUS, cruising) >> 14 & 3
    };
    assert_eq!([255, 256, 257].map(|threshold| flags(TPWMTHRS, threshold)), [0b01, 0b01, 0b00]);
    flags(TPWMTHRS, 0);
    // Manual 6.7: StealthChop is used below all the threshold speeds, so full steps exclude it.
    assert_eq!([255, 256, 257].map(|threshold| flags(THIGH, threshold)), [0b01, 0b10, 0b10]);
}
