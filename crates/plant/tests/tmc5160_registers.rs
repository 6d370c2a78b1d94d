//! The register file of the TMC5160: which registers exist, what they hold after a reset, and what
//! reading and writing does to them.

use opentmcl_motion::Instant;
use opentmcl_plant::tmc5160::Tmc5160;
use opentmcl_plant::tmc5160::registers::*;

const START: Instant = Instant::from_ticks(0);

#[test]
fn addresses_are_unique_ascending_and_seven_bits_wide() {
    assert!(REGISTERS.is_sorted_by(|a, b| a.address < b.address));
    assert!(REGISTERS.iter().all(|row| row.address < 0x80));
    for row in REGISTERS {
        assert_eq!(register(row.address), Some(row));
        assert_eq!(row.reset & !row.mask(), 0, "{}", row.name);
    }
}

#[test]
fn every_readable_register_has_its_reset_value() {
    let mut chip = Tmc5160::new();
    for row in REGISTERS {
        let expected = if row.access == Access::WriteOnly { 0 } else { row.reset };
        assert_eq!(chip.read(row.address, START), expected, "{}", row.name);
    }
}

#[test]
fn the_reset_values_are_those_of_the_datasheet() {
    // Datasheet chapter 6 and 18; IOIN carries the version of the chip.
    let expected = [
        (IOIN, 0x3000_0000),
        (0x09, 0x0001_0606),
        (0x0A, 0x0008_0400),
        (TPOWERDOWN, 10),
        (VSTOP, 1),
        (0x3A, 65_536),
        (MSLUT, 0xAAAA_B554),
        (MSLUTSEL, 0xFFFF_8056),
        (MSLUTSTART, 0x00F7_0000),
        (CHOPCONF, 0x1041_0150),
        (0x70, 0xC40C_001E),
    ];
    for (address, reset) in expected {
        let row = register(address).unwrap();
        assert_eq!(row.reset, reset, "{}", row.name);
    }
}

#[test]
fn a_register_that_reads_and_writes_keeps_the_bits_it_has() {
    for row in REGISTERS.iter().filter(|row| row.access == Access::ReadWrite) {
        let mut chip = Tmc5160::new();
        chip.write(row.address, u32::MAX, START);
        assert_eq!(chip.read(row.address, START), row.mask(), "{}", row.name);
        chip.write(row.address, 0x5555_5555, START);
        let expected = 0x5555_5555 & row.mask();
        assert_eq!(chip.read(row.address, START), expected, "{}", row.name);
    }
}

#[test]
fn a_read_only_register_ignores_writes() {
    for row in REGISTERS.iter().filter(|row| row.access == Access::ReadOnly) {
        let mut chip = Tmc5160::new();
        chip.write(row.address, !row.reset, START);
        assert_eq!(chip.read(row.address, START), row.reset, "{}", row.name);
    }
}

#[test]
fn a_write_only_register_reads_as_zero_after_a_write() {
    for row in REGISTERS.iter().filter(|row| row.access == Access::WriteOnly) {
        let mut chip = Tmc5160::new();
        chip.write(row.address, u32::MAX, START);
        assert_eq!(chip.read(row.address, START), 0, "{}", row.name);
    }
}

#[test]
fn addresses_without_a_register_read_as_zero_and_take_writes_silently() {
    let mut chip = Tmc5160::new();
    let before: Vec<u32> = (0..=255).map(|address| chip.read(address, START)).collect();
    for address in 0..=255 {
        if register(address).is_none() {
            chip.write(address, u32::MAX, START);
            assert_eq!(chip.read(address, START), 0, "address {address:#04x}");
        }
    }
    let after: Vec<u32> = (0..=255).map(|address| chip.read(address, START)).collect();
    assert_eq!(before, after);
}

#[test]
fn the_reset_flag_of_gstat_is_cleared_by_writing_a_one_and_set_by_a_reset() {
    let mut chip = Tmc5160::new();
    assert_eq!(chip.read(GSTAT, START), 1);
    assert_eq!(chip.read(GSTAT, START), 1, "reading does not clear");
    chip.write(GSTAT, 0, START);
    assert_eq!(chip.read(GSTAT, START), 1, "writing a zero does not clear");
    chip.write(GSTAT, 0b110, START);
    assert_eq!(chip.read(GSTAT, START), 1, "writing a one clears that bit alone");
    chip.write(GSTAT, 1, START);
    assert_eq!(chip.read(GSTAT, START), 0);
    chip.reset(START);
    assert_eq!(chip.read(GSTAT, START), 1);
}

#[test]
fn a_reset_forgets_every_setting_and_stops_the_axis() {
    let mut chip = Tmc5160::new();
    for row in REGISTERS {
        chip.write(row.address, 0x1234_5677, START);
    }
    let later = Instant::from_ticks(123_456_789);
    assert_ne!(chip.read(XTARGET, later), 0);
    chip.reset(later);
    for row in REGISTERS {
        let expected = if row.access == Access::WriteOnly { 0 } else { row.reset };
        assert_eq!(chip.read(row.address, later), expected, "{}", row.name);
    }
    assert_eq!(chip.next_event(later), None);
}

#[test]
fn reference_inputs_show_in_ioin_and_after_swap_and_polarity_in_ramp_stat() {
    let mut chip = Tmc5160::new();
    let switches = |chip: &mut Tmc5160| chip.read(RAMP_STAT, START) & 0b11;
    chip.set_reference_inputs(true, false, START);
    assert_eq!(chip.read(IOIN, START) & 0b11, 0b01);
    assert_eq!(switches(&mut chip), 0b01);
    chip.write(SW_MODE, 1 << 4, START);
    assert_eq!(switches(&mut chip), 0b10, "swapped");
    assert_eq!(chip.read(IOIN, START) & 0b11, 0b01, "a pin is where it is");
    chip.write(SW_MODE, 1 << 2, START);
    assert_eq!(switches(&mut chip), 0b00, "left inverted");
    chip.write(SW_MODE, 1 << 3, START);
    assert_eq!(switches(&mut chip), 0b11, "right inverted");
    chip.write(SW_MODE, 1 << 4 | 1 << 2, START);
    assert_eq!(switches(&mut chip), 0b11, "swapped, then left inverted");
}
