//! The register file of the TMC429: which registers exist, what they hold after a reset, and what reading
//! and writing does to them.

use opentmcl_motion::Instant;
use opentmcl_plant::tmc429::Tmc429;
use opentmcl_plant::tmc429::registers::*;

const START: Instant = Instant::from_ticks(0);

/// Addresses with their registers.
fn all() -> impl Iterator<Item = (u8, &'static Register)> {
    (0..=255).filter_map(|address| Some((address, register(address)?)))
}

#[test]
fn three_axes_have_sixteen_registers_each_and_eleven_are_common() {
    assert_eq!(all().count(), 3 * 16 + 11);
    for (index, row) in AXIS_REGISTERS.iter().enumerate() {
        assert_eq!(usize::from(row.index), index, "{}", row.name);
    }
    assert!(COMMON_REGISTERS.is_sorted_by(|a, b| a.index < b.index));
    for (_, row) in all() {
        assert_eq!(row.reset & !row.mask, 0, "{}", row.name);
        assert!(row.mask < 1 << 24, "{}: a datagram has 24 bits", row.name);
    }
}

#[test]
fn addresses_are_those_of_the_data_sheet() {
    // The vendor's library has them with the bit for reading below: 0x5C is X_LATCHED of the third axis.
    let expected = [
        (0x00, "X_TARGET"),
        (0x0B, "INTERRUPT"),
        (0x14, "V_TARGET"),
        (0x5C >> 1, "X_LATCHED"),
        (0x60 >> 1, "DATAGRAM_LOW_WORD"),
        (0x68 >> 1, "IF_CONFIGURATION"),
        (0x70 >> 1, "POWER_DOWN"),
        (0x72 >> 1, "TYPE_VERSION"),
        (0x7C >> 1, "REFERENCE_SWITCHES"),
        (0x7E >> 1, "STEPPER_MOTOR_GLOBAL_PARAMETERS"),
    ];
    for (address, name) in expected {
        assert_eq!(register(address).map(|row| row.name), Some(name));
    }
    assert_eq!(of_axis(2, X_LATCHED), 0x2E);
    for address in [0x37, 0x3A, 0x3B, 0x3C, 0x3D, 0x40, 0x7F, 0xFF] {
        assert_eq!(register(address), None);
    }
}

#[test]
fn every_readable_register_has_its_reset_value() {
    let mut chip = Tmc429::new();
    for (address, row) in all() {
        let expected = if row.access == Access::WriteOnly { 0 } else { row.reset };
        assert_eq!(chip.read(address, START), expected, "{}", row.name);
    }
    assert_eq!(chip.read(TYPE_VERSION, START), 0x42_9101);
}

#[test]
fn a_register_that_reads_and_writes_keeps_the_bits_it_has() {
    // A target velocity is calculated in ramp mode; it keeps what is written in velocity mode.
    for (address, row) in all().filter(|(_, row)| row.access == Access::ReadWrite) {
        for value in [0xFF_FFFF, 0x55_5555] {
            let mut chip = Tmc429::new();
            for axis in 0..3 {
                chip.write(of_axis(axis, REF_CONF_RAMP_MODE), 2, START);
            }
            chip.write(address, value, START);
            let index = address & 0xF;
            let expected = match index {
                _ if address >= COMMON => value & row.mask,
                PMUL_PDIV => value & row.mask | PMUL_FIXED,
                REF_CONF_RAMP_MODE => value & row.mask & !LATCH_WAITS,
                _ => value & row.mask,
            };
            assert_eq!(chip.read(address, START), expected, "{}", row.name);
        }
    }
}

#[test]
fn a_read_only_register_ignores_writes_and_one_without_reading_reads_as_zero() {
    for (address, row) in all() {
        let mut chip = Tmc429::new();
        chip.write(address, !row.reset, START);
        match row.access {
            Access::ReadOnly => assert_eq!(chip.read(address, START), row.reset, "{}", row.name),
            Access::WriteOnly => assert_eq!(chip.read(address, START), 0, "{}", row.name),
            _ => {}
        }
    }
}

#[test]
fn addresses_without_a_register_read_as_zero_and_take_writes_silently() {
    let mut chip = Tmc429::new();
    let read_all = |chip: &mut Tmc429| -> Vec<u32> {
        (0..=255).map(|address| chip.read(address, START)).collect()
    };
    let before = read_all(&mut chip);
    for address in (0..=255).filter(|&address| register(address).is_none()) {
        chip.write(address, u32::MAX, START);
        assert_eq!(chip.read(address, START), 0, "address {address:#04x}");
    }
    assert_eq!(before, read_all(&mut chip));
    for axis in [3, 4, usize::MAX] {
        chip.set_reference_inputs(axis, true, true, START);
        assert_eq!((chip.position(axis, START), chip.motion(axis, START)), (0, None));
        assert_eq!((chip.next_event_of(axis, START), chip.stopped_at(axis, START)), (None, None));
    }
    assert_eq!(before, read_all(&mut chip));
}

#[test]
fn axes_do_not_share_registers() {
    let mut chip = Tmc429::new();
    for axis in 0..3u8 {
        chip.write(of_axis(axis, V_MAX), 100 + u32::from(axis), START);
    }
    for axis in 0..3u8 {
        assert_eq!(chip.read(of_axis(axis, V_MAX), START), 100 + u32::from(axis));
    }
}

#[test]
fn the_interrupt_mask_is_written_and_flags_are_cleared_by_ones() {
    let mut chip = Tmc429::new();
    chip.write(IF_CONFIGURATION, ENABLE_RIGHT_SWITCHES, START);
    for _ in 0..2 {
        chip.set_reference_inputs(1, true, true, START);
        chip.set_reference_inputs(1, false, false, START);
    }
    let address = of_axis(1, INTERRUPT);
    assert_eq!(chip.read(address, START), 0xF0);
    chip.write(address, 0x4110, START);
    assert_eq!(chip.read(address, START), 0x41E0);
    assert_eq!(chip.status(START) >> 7, 1, "the left switch has closed, and that is enabled");
    chip.write(address, 0x4140, START);
    assert_eq!(chip.read(address, START), 0x41A0);
    assert_eq!(chip.status(START) >> 7, 0);
}

#[test]
fn a_reset_forgets_every_setting_and_stops_the_axes() {
    let mut chip = Tmc429::new();
    for (address, _) in all() {
        chip.write(address, 0x0024_5677, START);
    }
    // In hold mode, with which the loop above has ended, this is the velocity.
    chip.write(V_TARGET, 0x677, START);
    let later = Instant::from_ticks(123_456_789);
    assert_ne!(chip.travel(0, later), 0);
    let travel = chip.travel(0, later);
    chip.reset(later);
    for (address, row) in all() {
        let expected = if row.access == Access::WriteOnly { 0 } else { row.reset };
        assert_eq!(chip.read(address, later), expected, "{}", row.name);
    }
    assert_eq!(chip.next_event(later), None);
    assert_eq!(chip.travel(0, later), travel, "the motor stays where it is");
}
