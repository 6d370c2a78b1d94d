//! The encoder interface (datasheet 6.4).

use opentmcl_motion::Instant;
use opentmcl_plant::tmc5160::{Tmc5160, registers::*};

const NOW: Instant = Instant::from_ticks(0);
const DECIMAL: u32 = 1 << 10;
const IGNORE_AB: u32 = 1 << 3;
const CLEAR_ALWAYS: u32 = 1 << 4;
const CLEAR_ONCE: u32 = 1 << 5;
const CLEAR_X_ENC: u32 = 1 << 8;
const LATCH_X_ACT: u32 = 1 << 9;

fn chip(registers: &[(u8, u32)]) -> Tmc5160 {
    let mut chip = Tmc5160::new();
    for &(address, value) in registers {
        chip.write(address, value, NOW);
    }
    chip
}

fn x_enc(chip: &mut Tmc5160) -> i32 {
    chip.read(X_ENC, NOW).cast_signed()
}

#[test]
fn each_count_adds_the_constant() {
    // 51200 microsteps for 4000 counts are 12.8 each: decimal 12 and 8000; -12.8 is -13 and 2000.
    for (mode, constant, counts, expected) in [
        (0, 1 << 16, 1_000, 1_000),
        (0, 3 << 15, 1_001, 1_501),
        (0, 1 << 15, -1, -1),
        (0, (-(3i32 << 15)).cast_unsigned(), 1_000, -1_500),
        (DECIMAL, 12 << 16 | 8_000, 4_000, 51_200),
        (DECIMAL, (-13i32 << 16).cast_unsigned() | 2_000, 4_000, -51_200),
    ] {
        let mut chip = chip(&[(ENCMODE, mode), (ENC_CONST, constant)]);
        chip.set_encoder_count(counts, NOW);
        assert_eq!(x_enc(&mut chip), expected, "{constant:#x}");
    }
}

#[test]
fn nothing_drifts_over_a_million_turns_there_and_back() {
    let mut chip = chip(&[(ENCMODE, DECIMAL), (ENC_CONST, 3_333)]);
    for turn in 1..=1_000i64 {
        chip.set_encoder_count(turn * 4_000_003, NOW);
    }
    // 4000003000 * 0.3333 = 1333200999.9
    assert_eq!(x_enc(&mut chip), 1_333_200_999);
    chip.set_encoder_count(0, NOW);
    assert_eq!(x_enc(&mut chip), 0);
}

#[test]
fn a_new_constant_leaves_what_has_been_counted() {
    let mut chip = chip(&[]);
    chip.set_encoder_count(100, NOW);
    chip.write(ENC_CONST, 2 << 16, NOW);
    assert_eq!(x_enc(&mut chip), 100);
    chip.set_encoder_count(110, NOW);
    assert_eq!(x_enc(&mut chip), 120);
    chip.write(X_ENC, 7, NOW);
    chip.set_encoder_count(111, NOW);
    assert_eq!(x_enc(&mut chip), 9);
    chip.reset(NOW);
    assert_eq!(x_enc(&mut chip), 0);
    chip.set_encoder_count(112, NOW);
    assert_eq!(x_enc(&mut chip), 1, "the encoder stands where it stood");
}

#[test]
fn an_index_counts_only_with_its_levels_of_a_and_b() {
    for mode in 0..4 {
        for levels in 0..4 {
            let mut chip = chip(&[(ENCMODE, mode)]);
            chip.encoder_index(levels & 1 != 0, levels & 2 != 0, NOW);
            assert_eq!(chip.read(ENC_STATUS, NOW) == 1, levels == mode, "{mode} {levels}");
            chip.write(ENCMODE, mode | IGNORE_AB, NOW);
            chip.encoder_index(levels & 1 != 0, levels & 2 != 0, NOW);
            assert_eq!(chip.read(ENC_STATUS, NOW), 1);
        }
    }
}

/// A chip at XACTUAL 50 and X_ENC 200.
fn at_index(mode: u32) -> Tmc5160 {
    let mut chip = chip(&[(RAMPMODE, 3), (XACTUAL, 50), (ENCMODE, mode | IGNORE_AB)]);
    chip.set_encoder_count(200, NOW);
    chip.encoder_index(false, false, NOW);
    chip
}

#[test]
fn an_index_latches_and_clears_what_it_is_asked_to() {
    for (mode, enc_latch, x_latch, encoder) in [
        (0, 0, 0, 200),
        (CLEAR_X_ENC, 0, 0, 200),
        (CLEAR_ALWAYS, 200, 0, 200),
        (CLEAR_ALWAYS | LATCH_X_ACT, 200, 50, 200),
        (CLEAR_ONCE | CLEAR_X_ENC | LATCH_X_ACT, 200, 50, 0),
    ] {
        let mut chip = at_index(mode);
        assert_eq!(chip.read(ENC_LATCH, NOW), enc_latch, "{mode:#x}");
        assert_eq!(chip.read(XLATCH, NOW), x_latch, "{mode:#x}");
        assert_eq!(x_enc(&mut chip), encoder, "{mode:#x}");
    }
}

#[test]
fn clearing_once_is_once_for_each_write() {
    for (mode, again) in [(CLEAR_ONCE, 150), (CLEAR_ALWAYS, 0)] {
        let mut chip = at_index(mode | CLEAR_X_ENC);
        chip.set_encoder_count(350, NOW);
        assert_eq!(chip.wants_index(), mode == CLEAR_ALWAYS);
        chip.encoder_index(false, false, NOW);
        assert_eq!(x_enc(&mut chip), again);
        chip.write(ENCMODE, mode | CLEAR_X_ENC | IGNORE_AB, NOW);
        assert!(chip.wants_index());
        chip.encoder_index(false, false, NOW);
        assert_eq!(x_enc(&mut chip), 0);
    }
}

#[test]
fn the_deviation_is_that_of_the_two_positions_and_its_event_stays_until_cleared() {
    let mut chip = chip(&[(RAMPMODE, 3), (XACTUAL, 50)]);
    assert_eq!(chip.watches_deviation(), None);
    chip.write(ENC_DEVIATION, 100, NOW);
    assert_eq!(chip.watches_deviation(), Some(100));
    chip.set_encoder_count(-70, NOW);
    assert_eq!(chip.encoder_deviation(NOW), 120);
    chip.deviate(NOW);
    assert_eq!(chip.read(ENC_STATUS, NOW), 0b10);
    chip.write(ENC_STATUS, 0b10, NOW);
    assert_eq!(chip.read(ENC_STATUS, NOW), 0);
}
