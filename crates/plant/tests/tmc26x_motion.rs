//! Step pulses of a TMC26x: the microstep position, standstill, times between readings.

use core::num::NonZeroU64;

use opentmcl_motion::{Instant, TICKS_PER_SECOND};
use opentmcl_plant::tmc26x::registers::*;
use opentmcl_plant::tmc26x::{Motion, Tmc26x};

const NOW: Instant = Instant::from_ticks(0);

fn chip(fields: &[(Field, u32)]) -> Tmc26x {
    let mut chip = Tmc26x::new();
    for register in Register::ALL {
        chip.write(register.datagram(fields), NOW);
    }
    chip
}

/// The speed v of a TMC429 with a PULSE_DIV.
fn tmc429(v: u64, pulse_div: u32) -> Motion {
    Motion::Moving { rate: NonZeroU64::new(v << (21 - pulse_div)).unwrap() }
}

fn mstep(chip: &Tmc26x) -> u32 {
    chip.status(NOW) >> 10
}

#[test]
fn four_full_steps_are_a_period_at_every_resolution() {
    for mres in 0..=8 {
        let mut chip = chip(&[(MRES, mres)]);
        let per_full_step = 256 >> mres;
        chip.step(1);
        assert_eq!(mstep(&chip), 1 << mres);
        chip.step(per_full_step - 1);
        assert_eq!(mstep(&chip), 256);
        chip.step(3 * per_full_step);
        assert_eq!(mstep(&chip), 0);
        chip.step(-1);
        assert_eq!(mstep(&chip), 1024 - (1 << mres));
    }
    assert_eq!(mstep(&chip(&[(MRES, 15)])), 0);
    let mut coarse = chip(&[(MRES, 15)]);
    coarse.step(1);
    assert_eq!(mstep(&coarse), 256, "beyond full steps there is nothing");
}

#[test]
fn large_counts_and_single_pulses_come_to_the_same() {
    let mut at_once = chip(&[(MRES, 2)]);
    let mut one_by_one = at_once.clone();
    at_once.step(-12_345);
    (0..12_345).for_each(|_| one_by_one.step(-1));
    // -12345 * 4 = -49 * 1024 + 796
    assert_eq!((mstep(&at_once), mstep(&one_by_one)), (796, 796));
    for pulses in [i32::MIN, i32::MAX] {
        let mut chip = chip(&[(MRES, 8), (DEDGE, 1)]);
        chip.step(pulses);
        assert_eq!(mstep(&chip), if pulses > 0 { 512 } else { 0 });
    }
}

#[test]
fn another_resolution_leaves_the_field_where_it_is() {
    let mut chip = chip(&[(MRES, 0)]);
    chip.step(77);
    chip.write(Register::DrvCtrl.datagram(&[(MRES, 4)]), NOW);
    assert_eq!(mstep(&chip), 77);
    chip.step(2);
    assert_eq!(mstep(&chip), 77 + 2 * 16);
}

#[test]
fn with_both_edges_each_pulse_is_two_microsteps() {
    let mut chip = chip(&[(MRES, 4), (DEDGE, 1)]);
    chip.step(5);
    assert_eq!(mstep(&chip), 5 * 2 * 16);
    let both = chip.reading_interval(NOW);
    assert_eq!(both, None, "it stands");
    chip.set_motion(tmc429(1024, 4), NOW);
    // 8 pulses, each 2^20 / 2^10 clocks after the last.
    assert_eq!(chip.reading_interval(NOW), Some(8 << 10));
}

#[test]
fn in_spi_mode_pulses_do_nothing_and_drvctrl_is_something_else() {
    let mut chip = chip(&[(MRES, 3), (SDOFF, 1)]);
    chip.set_motion(tmc429(1000, 2), NOW);
    chip.step(5);
    assert_eq!(mstep(&chip), 0);
    assert_eq!(chip.reading_interval(NOW), None);
    chip.write(0x0_1234, NOW);
    chip.write(Register::DrvConf.datagram(&[]), NOW);
    chip.step(1);
    assert_eq!(mstep(&chip), 8, "the resolution is still 32");
}

#[test]
fn a_reading_comes_with_each_full_step_or_each_fourth() {
    // v microsteps per second are 16 MHz * v / (2^PULSE_DIV * 2048 * 32).
    for (v, pulse_div) in [(1, 13), (2047, 0), (1000, 5), (7, 2)] {
        for mres in [0, 2, 8] {
            for (sfilt, full_steps) in [(0, 1.0), (1, 4.0)] {
                let mut chip = chip(&[(MRES, mres), (SFILT, sfilt)]);
                chip.set_motion(tmc429(v, pulse_div), NOW);
                let pulses = 16e6 * v as f64 / f64::from((1 << pulse_div) * 2048 * 32);
                let seconds = full_steps * f64::from(256 >> mres) / pulses;
                let clocks = chip.reading_interval(NOW).unwrap() as f64;
                let exact = seconds * TICKS_PER_SECOND as f64;
                assert!((clocks - exact).abs() <= 1.0, "{clocks}, exactly {exact}");
            }
        }
    }
    let mut fastest = chip(&[]);
    fastest.set_motion(Motion::Moving { rate: NonZeroU64::MAX }, NOW);
    assert_eq!(fastest.reading_interval(NOW), Some(1));
}

#[test]
fn standstill_is_told_2_to_the_20_clocks_after_the_last_pulse() {
    let stst = |chip: &Tmc26x, ticks: u64| chip.status(Instant::from_ticks(ticks)) & 0x80 != 0;
    let mut chip = chip(&[]);
    assert_eq!([(1 << 20) - 1, 1 << 20].map(|ticks| stst(&chip, ticks)), [false, true]);
    chip.set_motion(tmc429(1, 13), NOW);
    assert!(!stst(&chip, 1 << 40), "creeping is not standing");
    assert_eq!(chip.next_event(NOW), None);
    let last = Instant::from_ticks(5_000_000);
    chip.set_motion(Motion::Standing { since: last }, Instant::from_ticks(5_000_100));
    assert_eq!([6_048_575, 6_048_576].map(|ticks| stst(&chip, ticks)), [false, true]);
    let event = chip.next_event(Instant::from_ticks(5_500_000));
    assert_eq!(event, Some(Instant::from_ticks(6_048_576)));
    assert_eq!(chip.next_event(Instant::from_ticks(6_048_576)), None);
    chip.reset(Instant::from_ticks(9_000_000));
    let event = chip.next_event(Instant::from_ticks(9_000_000));
    assert_eq!(event, Some(Instant::from_ticks(10_048_576)), "counted from power-up");
}
