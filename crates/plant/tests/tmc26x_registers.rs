//! Registers of the TMC26x, datagrams and replies (datasheet chapter 6).

use core::num::NonZeroU64;

use opentmcl_motion::Instant;
use opentmcl_plant::tmc26x::registers::*;
use opentmcl_plant::tmc26x::{Coils, Motion, Sense, Tmc26x};

const NOW: Instant = Instant::from_ticks(0);

#[test]
fn fields_do_not_overlap_and_leave_room_for_the_address() {
    for register in Register::ALL {
        let mut taken = 0b111 << 17;
        for field in FIELDS.iter().filter(|field| field.register == register) {
            let bits = field.insert(0, u32::MAX);
            assert_eq!(bits.count_ones(), u32::from(field.width), "{}", field.name);
            assert_eq!(taken & bits, 0, "{}", field.name);
            taken |= bits;
        }
        assert_eq!(register.mask(), taken & 0x1_FFFF, "{}", register.name());
    }
    // The vendor's header for the TMC262 has these masks with the address above them, and two bits more that
    // no field has in step/dir mode: 17 of DRVCTRL and 16 of SMARTEN.
    assert_eq!(Register::DrvCtrl.mask(), 0x3_FFFF & !(0xF << 4 | 0xFF << 10));
    assert_eq!(Register::ChopConf.mask(), 0x1_FFFF);
    assert_eq!(Register::SmartEn.mask(), 0x1_FFFF & !(1 << 4 | 1 << 7 | 1 << 12 | 1 << 16));
    assert_eq!(Register::SgcsConf.mask(), 0x1_FFFF & !(0x7 << 5 | 1 << 15));
    assert_eq!(Register::DrvConf.mask(), 0x1_FFFF & !(0xF | 1 << 11));
}

#[test]
fn datagrams_are_those_of_the_vendors_first_settings() {
    // Addresses by the bits that the vendor's firmware for a TMC262 sets, fields by its shifts.
    let chopper = [(TBL, 2), (HEND, 2), (HSTRT, 3), (TOFF, 5)];
    assert_eq!(Register::ChopConf.datagram(&chopper), 1 << 19 | 2 << 15 | 2 << 7 | 3 << 4 | 5);
    let cool = [(SEIMIN, 1), (SEDN, 3), (SEMAX, 10), (SEUP, 2), (SEMIN, 6)];
    assert_eq!(
        Register::SmartEn.datagram(&cool),
        1 << 19 | 1 << 17 | 1 << 15 | 3 << 13 | 10 << 8 | 2 << 5 | 6
    );
    let load = [(SFILT, 1), (SGT, 5), (CS, 5)];
    assert_eq!(Register::SgcsConf.datagram(&load), 0b110 << 17 | 1 << 16 | 5 << 8 | 5);
    let driver = [(SLPH, 3), (SLPL, 3), (VSENSE, 1), (RDSEL, 2)];
    assert_eq!(
        Register::DrvConf.datagram(&driver),
        0b111 << 17 | 3 << 14 | 3 << 12 | 1 << 6 | 2 << 4
    );
    let steps = [(INTPOL, 1), (DEDGE, 1), (MRES, 4)];
    assert_eq!(Register::DrvCtrl.datagram(&steps), 1 << 9 | 1 << 8 | 4);
}

#[test]
fn a_negative_threshold_has_seven_bits() {
    let datagram = Register::SgcsConf.datagram(&[(SGT, (-10i32).cast_unsigned())]);
    assert_eq!(datagram, 0b110 << 17 | 0x76 << 8);
    assert_eq!(SGT.extract_signed(datagram), -10);
    for threshold in [-64, -1, 0, 63] {
        assert_eq!(SGT.extract_signed(SGT.insert(u32::MAX, threshold as u32)), threshold);
    }
}

#[test]
fn each_datagram_finds_its_register() {
    let found = |datagram| Register::addressed_by(datagram);
    assert_eq!(found(0x0_0000), Some(Register::DrvCtrl));
    assert_eq!(found(0x3_FFFF), Some(Register::DrvCtrl));
    assert_eq!(found(0x4_0000), None);
    assert_eq!(found(0x7_FFFF), None);
    assert_eq!(found(0x9_FFFF), Some(Register::ChopConf));
    assert_eq!(found(0xA_0000), Some(Register::SmartEn));
    assert_eq!(found(0xC_0000), Some(Register::SgcsConf));
    assert_eq!(found(0xE_0000), Some(Register::DrvConf));
    assert_eq!(found(0xFFFC_0000), Some(Register::SgcsConf), "there are 20 bits");
}

#[test]
fn a_reply_has_the_form_that_was_selected_before() {
    let mut chip = Tmc26x::new();
    chip.write(Register::SgcsConf.datagram(&[(CS, 21)]), NOW);
    chip.step(3);
    let select =
        |chip: &mut Tmc26x, rdsel| chip.write(Register::DrvConf.datagram(&[(RDSEL, rdsel)]), NOW);
    // MSTEP 3, then SG 0, then SE 21.
    assert_eq!(select(&mut chip, 1), 3 << 10);
    assert_eq!(select(&mut chip, 2), 0);
    assert_eq!(select(&mut chip, 3), 21 << 10);
    assert_eq!(select(&mut chip, 0), 21 << 10);
    assert_eq!(chip.status(NOW), 3 << 10);
}

#[test]
fn a_reply_shows_the_state_before_its_datagram() {
    let mut chip = Tmc26x::new();
    chip.write(Register::DrvConf.datagram(&[(RDSEL, 2)]), NOW);
    assert_eq!(chip.write(Register::SgcsConf.datagram(&[(CS, 31)]), NOW), 0);
    assert_eq!(chip.status(NOW), 31 << 10);
}

#[test]
fn the_flags_of_a_reply_stand_where_the_datasheet_puts_them() {
    let mut chip = Tmc26x::new();
    chip.write(Register::ChopConf.datagram(&[(TOFF, 5)]), NOW);
    // Standing since long ago, with everything wrong that can be; open load is not seen at standstill.
    let flags = 0b11_1111 << 25;
    chip.set_sense(Sense { flags, ..Sense::IDEAL }, NOW);
    let later = Instant::from_ticks(1 << 20);
    assert_eq!(chip.status(later) & 0x3FF, 0b1001_1110);
    for (bit, flag) in [(25, 1), (26, 2)] {
        chip.set_sense(Sense { flags: 1 << bit, ..Sense::IDEAL }, NOW);
        assert_eq!(chip.status(NOW) & 0b110, 1 << flag);
    }
}

#[test]
fn a_datagram_without_a_register_and_reserved_bits_change_nothing() {
    let mut chip = Tmc26x::new();
    chip.write(Register::ChopConf.datagram(&[(TOFF, 5)]), NOW);
    chip.write(Register::SgcsConf.datagram(&[(CS, 10)]), NOW);
    let before = format!("{chip:?}");
    chip.write(0x4_0000 | 0x1F, NOW);
    chip.write(Register::SgcsConf.datagram(&[(CS, 10)]) | 0b111 << 5 | 1 << 15, NOW);
    chip.write(Register::DrvConf.datagram(&[]) | 0xF | 1 << 11, NOW);
    assert_eq!(format!("{chip:?}"), before);
}

#[test]
fn a_reset_clears_all_registers_and_keeps_what_comes_from_outside() {
    let mut chip = Tmc26x::new();
    for register in Register::ALL {
        chip.write(register.datagram(&[]) | 0x1_FF5F, NOW);
    }
    chip.set_sense(Sense { flags: 1 << 26, ..Sense::IDEAL }, NOW);
    chip.set_enabled(false, NOW);
    chip.step(101);
    let later = Instant::from_ticks(1 << 20);
    chip.reset(later);
    assert_eq!(chip.status(later), 1 << 2, "MSTEP 0, the warning, and STST begins anew");
    let mut fresh = Tmc26x::new();
    fresh.set_sense(Sense { flags: 1 << 26, ..Sense::IDEAL }, NOW);
    fresh.set_enabled(false, NOW);
    fresh.reset(later);
    assert_eq!(format!("{chip:?}"), format!("{fresh:?}"));
    chip.write(Register::ChopConf.datagram(&[(TOFF, 5)]), later);
    assert_eq!(chip.coils(later), Coils::Off, "the enable pin is off still");
    chip.set_motion(Motion::Moving { rate: NonZeroU64::MIN }, later);
    chip.reset(later);
    assert_eq!(chip.next_event(later), None, "pulses still come in");
}
