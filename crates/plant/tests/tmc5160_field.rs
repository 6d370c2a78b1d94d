//! The field of the stator: what the registers do to it, and what they do not.

use opentmcl_motion::Instant;
use opentmcl_plant::tmc5160::{Tmc5160, registers::*};

const NOW: Instant = Instant::from_ticks(0);
const LATER: Instant = Instant::from_ticks(1_000_003);
const FULL_STEPS: u32 = 0x1841_0153;
const FINE_STEPS: u32 = 0x1041_0153;

fn running() -> Tmc5160 {
    let mut chip = Tmc5160::new();
    for (address, value) in [(CHOPCONF, FINE_STEPS), (AMAX, 1_000), (VMAX, 70_000), (RAMPMODE, 1)] {
        chip.write(address, value, NOW);
    }
    chip
}

#[test]
fn the_field_moves_as_the_data_sheet_says() {
    // Speed 1000 / 2^17 per clock, in units of 2^-24 steps: after n clocks n² * 1000 / 2^42 steps.
    let field = running().field(NOW);
    assert_eq!(field.position, 0.0);
    let n = 1_000_003.0f64;
    assert!((field.position_at(LATER) - n * n * 1_000.0 / 2f64.powi(42)).abs() < 1e-6);
    assert!((field.speed_at(LATER) - n * 1_000.0 / 2f64.powi(41)).abs() < 1e-12);
}

#[test]
fn the_field_stays_where_it_is_while_registers_change() {
    for (address, value) in [
        (XACTUAL, 77),
        (XACTUAL, i32::MAX.cast_unsigned()),
        (CHOPCONF, FULL_STEPS),
        (GCONF, 1 << 4),
        (XTARGET, 5),
        (RAMPMODE, 2),
    ] {
        let mut chip = running();
        let before = chip.field(LATER).position_at(LATER);
        let mscnt = chip.read(MSCNT, LATER);
        chip.write(address, value, LATER);
        let after = chip.field(LATER).position_at(LATER);
        assert!((after - before).abs() < 1e-6, "{address:#x}: {before} {after}");
        assert_eq!(chip.read(MSCNT, LATER), mscnt, "{address:#x}");
    }
}

#[test]
fn the_field_goes_on_over_the_wrap_of_the_counter() {
    let mut chip = running();
    chip.write(XACTUAL, i32::MAX.cast_unsigned(), LATER);
    let before = chip.field(LATER).position_at(LATER);
    let after = Instant::from_ticks(80_000_000);
    assert!(chip.read(XACTUAL, after).cast_signed() < 0);
    let middle = chip.field(after).position_at(after);
    let mut stalled = chip.clone();
    stalled.stall(after);
    assert!((stalled.field(after).position_at(after) - middle).abs() < 1e-6);
    chip.write(VMAX, 60_000, after);
    let replanned = chip.field(after).position_at(after);
    assert!(middle > before && (middle - replanned).abs() < 1e-6);
}

#[test]
fn the_shaft_bit_turns_the_field_the_other_way_and_not_the_counter() {
    let mut chip = Tmc5160::new();
    let writes = [(CHOPCONF, FINE_STEPS), (GCONF, 1 << 4), (AMAX, 1_000), (VMAX, 70_000)];
    for (address, value) in writes.into_iter().chain([(XTARGET, 300)]) {
        chip.write(address, value, NOW);
    }
    let arrived = Instant::from_ticks(1 << 30);
    assert_eq!(chip.read(XACTUAL, arrived), 300);
    assert_eq!(chip.field(arrived).position_at(arrived), -300.0);
    assert_eq!(chip.read(MSCNT, arrived), 1_024 - 300);
}

#[test]
fn a_full_step_is_256_fine_steps() {
    let mut chip = Tmc5160::new();
    for (address, value) in [(CHOPCONF, FULL_STEPS), (AMAX, 1_000), (VMAX, 700), (XTARGET, 3)] {
        chip.write(address, value, NOW);
    }
    let arrived = Instant::from_ticks(1 << 30);
    assert_eq!(chip.field(arrived).position_at(arrived), 768.0);
}

#[test]
fn a_reset_lets_the_field_jump_to_the_nearest_period() {
    for (target, place) in [(1_300, 1_024.0), (1_600, 2_048.0), (-1_300, -1_024.0)] {
        let mut chip = running();
        chip.write(XTARGET, i32::cast_unsigned(target), NOW);
        chip.write(RAMPMODE, 0, NOW);
        let arrived = Instant::from_ticks(1 << 30);
        assert_eq!(chip.read(XACTUAL, arrived).cast_signed(), target);
        chip.reset(arrived);
        assert_eq!(chip.field(arrived).position_at(arrived), place);
        assert_eq!(chip.read(MSCNT, arrived), 0);
    }
}
