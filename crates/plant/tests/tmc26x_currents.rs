//! The coils of a TMC26x, and what takes the driver off.

use core::num::NonZeroU64;

use opentmcl_motion::Instant;
use opentmcl_plant::tmc26x::registers::*;
use opentmcl_plant::tmc26x::{Coils, Motion, Sense, Tmc26x};

const NOW: Instant = Instant::from_ticks(0);
const ON: u32 = 0x8_0005;
const OFF: u32 = 0x8_0000;
const SENSE_OT: u32 = 1 << 25;
const SENSE_S2GA: u32 = 1 << 27;
const SENSE_S2GB: u32 = 1 << 28;

fn chip(cs: u32) -> Tmc26x {
    let mut chip = Tmc26x::new();
    chip.write(ON, NOW);
    chip.write(Register::SgcsConf.datagram(&[(CS, cs)]), NOW);
    chip
}

fn sense(flags: u32) -> Sense {
    Sense { flags, ..Sense::IDEAL }
}

fn flags(chip: &Tmc26x) -> u32 {
    chip.status(NOW) & 0xFF
}

#[test]
fn the_current_is_cs_plus_one_of_32_of_a_full_scale_that_vsense_lowers() {
    for cs in [0, 15, 31] {
        let mut chip = chip(cs);
        let scale = cs as u8 + 1;
        assert_eq!(chip.coils(NOW), Coils::Driven { scale, global: 256 });
        chip.write(Register::DrvConf.datagram(&[(VSENSE, 1)]), NOW);
        let Coils::Driven { scale: low_scale, global } = chip.coils(NOW) else { panic!() };
        assert_eq!(low_scale, scale);
        // 165 mV of 310 mV.
        assert!((f64::from(global) / 256.0 - 165.0 / 310.0).abs() < 1.0 / 256.0, "{global}");
    }
}

#[test]
fn without_toff_or_the_enable_pin_nothing_flows() {
    assert_eq!(Tmc26x::new().coils(NOW), Coils::Off, "after power-up TOFF is 0");
    let mut chip = chip(7);
    let driven = Coils::Driven { scale: 8, global: 256 };
    chip.set_enabled(false, NOW);
    assert_eq!(chip.coils(NOW), Coils::Off);
    chip.set_enabled(true, NOW);
    assert_eq!(chip.coils(NOW), driven);
    chip.write(OFF, NOW);
    assert_eq!(chip.coils(NOW), Coils::Off);
    chip.write(ON, NOW);
    assert_eq!(chip.coils(NOW), driven);
}

#[test]
fn overtemperature_takes_the_driver_off_as_long_as_it_lasts() {
    let mut chip = chip(7);
    chip.set_sense(sense(SENSE_OT), NOW);
    assert_eq!((chip.coils(NOW), flags(&chip)), (Coils::Off, OT));
    chip.set_sense(sense(1 << 26), NOW);
    assert_eq!((chip.coils(NOW), flags(&chip)), (Coils::Driven { scale: 8, global: 256 }, OTPW));
}

#[test]
fn a_short_takes_the_driver_off_until_it_is_switched_off_and_on() {
    type Restart = fn(&mut Tmc26x);
    let restarts: [Restart; 2] = [
        |chip| {
            chip.write(OFF, NOW);
            chip.write(ON, NOW);
        },
        |chip| {
            chip.set_enabled(false, NOW);
            chip.set_enabled(true, NOW);
        },
    ];
    for (bit, flag) in [(SENSE_S2GA, S2GA), (SENSE_S2GB, S2GB)] {
        for restart in restarts {
            let mut chip = chip(7);
            chip.set_sense(sense(bit), NOW);
            chip.set_sense(sense(0), NOW);
            assert_eq!((chip.coils(NOW), flags(&chip)), (Coils::Off, flag), "it stays");
            restart(&mut chip);
            assert_eq!(chip.coils(NOW), Coils::Driven { scale: 8, global: 256 });
            assert_eq!(flags(&chip), 0);
            chip.set_sense(sense(bit), NOW);
            restart(&mut chip);
            assert_eq!((chip.coils(NOW), flags(&chip)), (Coils::Off, flag), "it is there still");
        }
    }
}

#[test]
fn a_driver_that_is_off_sees_no_short_and_neither_does_one_without_the_protection() {
    let mut chip = chip(7);
    chip.write(OFF, NOW);
    chip.set_sense(sense(SENSE_S2GA), NOW);
    assert_eq!(flags(&chip), 0);
    chip.write(Register::DrvConf.datagram(&[(DISS2G, 1)]), NOW);
    chip.write(ON, NOW);
    assert_eq!((chip.coils(NOW), flags(&chip)), (Coils::Driven { scale: 8, global: 256 }, 0));
    chip.write(Register::DrvConf.datagram(&[]), NOW);
    assert_eq!((chip.coils(NOW), flags(&chip)), (Coils::Off, S2GA));
}

#[test]
fn open_load_is_told_only_while_the_motor_turns() {
    let mut chip = chip(7);
    let moving = Motion::Moving { rate: NonZeroU64::new(1 << 21).unwrap() };
    chip.set_sense(Sense { stallguard: 500, ..sense(1 << 29 | 1 << 30) }, NOW);
    assert_eq!(flags(&chip), 0);
    chip.set_motion(moving, NOW);
    assert_eq!(flags(&chip), OLA | OLB);
    chip.set_sense(Sense { stallguard: 500, ..sense(1 << 29) }, NOW);
    assert_eq!(flags(&chip), OLA);
    chip.set_motion(Motion::Standing { since: NOW }, NOW);
    assert_eq!(flags(&chip), 0);
}
