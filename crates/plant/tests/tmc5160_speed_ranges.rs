//! Thresholds of the speed with their hysteresis, StealthChop, DcStep (datasheet 6.2; manual 6.7).

use opentmcl_motion::{Instant, TICKS_PER_SECOND};
use opentmcl_plant::tmc5160::{Sense, Tmc5160, registers::*};

const NOW: Instant = Instant::from_ticks(0);
const STEALTH: u32 = 1 << 14;
const STEALTHCHOP: u32 = 1 << 2;

fn seconds(seconds: u64) -> Instant {
    Instant::from_ticks(seconds * TICKS_PER_SECOND)
}

fn chip(registers: &[(u8, u32)]) -> Tmc5160 {
    let mut chip = Tmc5160::new();
    for &(address, value) in [(AMAX, 100), (RAMPMODE, 1)].iter().chain(registers) {
        chip.write(address, value, NOW);
    }
    chip
}

fn stealth(chip: &mut Tmc5160, now: Instant) -> bool {
    chip.read(DRV_STATUS, now) & STEALTH != 0
}

#[test]
fn an_axis_gets_faster_than_a_threshold_a_sixteenth_above_it_and_slower_at_it() {
    // T = 3200: faster at TSTEP < 2999, first at 5595 units; slower again at TSTEP >= 3200, first at
    // 2^24 / 3200 = 5242 units. With small_hysteresis: TSTEP < 3099, first at 5414 units.
    for (gconf, first) in [(STEALTHCHOP, 5_595), (STEALTHCHOP | 1 << 14, 5_414)] {
        let mut chip = chip(&[(GCONF, gconf), (TPWMTHRS, 3_200)]);
        let mut time = 0;
        let mut speeds = |vmax: u32| {
            time += 30;
            chip.write(VMAX, vmax, seconds(time));
            stealth(&mut chip, seconds(time + 29))
        };
        let slower = [first - 1, first, 5_243, 5_242].map(&mut speeds);
        assert_eq!(slower, [true, false, false, true], "{gconf:#x}");
        assert!(speeds(first - 1), "on the way up it is slower still");
    }
}

#[test]
fn the_next_threshold_is_the_clock_in_which_it_is_crossed() {
    // 100 / 2^17 per clock: 5595 units after 5595 * 1310.72 = 7333478.4 clocks.
    let mut chip = chip(&[(GCONF, STEALTHCHOP), (TPWMTHRS, 3_200), (VMAX, 50_000)]);
    let crossing = chip.next_threshold(NOW).unwrap();
    assert_eq!(crossing.as_ticks(), 7_333_479);
    assert!(stealth(&mut chip, Instant::from_ticks(7_333_478)));
    assert!(!stealth(&mut chip, crossing));
    assert_eq!(chip.next_threshold(crossing), None);
    // Down to 5242 units, a TSTEP of 3200.5: the speed is below 5243 then, 44757 units later.
    chip.write(VMAX, 0, seconds(10));
    let back = chip.next_threshold(seconds(10)).unwrap();
    assert!(stealth(&mut chip, back));
    assert!(chip.read(VACTUAL, back) == 5_242);
}

#[test]
fn a_comparison_remembers_a_speed_that_was_high_for_one_moment() {
    // Braking from 4000 units, a TSTEP of 4194, with microsteps of two fine steps from there on: 8000 fine
    // units, TSTEP 2097, faster than 3200. At 2700 units TSTEP is 3106: neither 2999 nor 3200 is passed.
    let mut chip = chip(&[(GCONF, STEALTHCHOP), (TPWMTHRS, 3_200), (CHOPCONF, 0), (VMAX, 4_000)]);
    chip.write(VMAX, 2_700, seconds(10));
    assert!(stealth(&mut chip, seconds(10)));
    chip.write(CHOPCONF, 1 << 24, seconds(10));
    assert!(!stealth(&mut chip, seconds(20)));
    assert_eq!(chip.read(TSTEP, seconds(20)), 3_106);
}

#[test]
fn stealthchop_needs_a_speed_below_all_three_thresholds() {
    for threshold in [TPWMTHRS, TCOOLTHRS, THIGH] {
        let mut chip = chip(&[(GCONF, STEALTHCHOP), (threshold, 3_200), (VMAX, 5_000)]);
        assert!(stealth(&mut chip, seconds(20)), "{threshold:#x}");
        chip.write(VMAX, 6_000, seconds(20));
        assert!(!stealth(&mut chip, seconds(40)), "{threshold:#x}");
    }
}

#[test]
fn a_standing_axis_is_slower_than_any_threshold() {
    // Manual 6.8 expects StealthChop at standstill with parameter 186 = 0, which is 2^20 - 1.
    let all = [(GCONF, STEALTHCHOP), (TPWMTHRS, 0xF_FFFF), (TCOOLTHRS, 0xF_FFFF), (VMAX, 100)];
    let mut chip = chip(&all);
    // 20 units are a TSTEP of 838860, faster than 983038.
    let moving = Instant::from_ticks(20 * 1_311);
    assert!(stealth(&mut chip, NOW));
    assert!(!stealth(&mut chip, moving));
    chip.write(VMAX, 0, seconds(1));
    assert!(stealth(&mut chip, seconds(3)));
}

#[test]
fn the_amplitude_of_stealthchop_grows_with_the_speed() {
    // PWM_OFS 30 + PWM_GRAD 15 * 256 * 50000 / 2^24 = 30 + 11; clamped to 255 with PWM_GRAD 255:
    // 255 * 256 * 50000 / 2^24 = 194, and 30 + 194 = 224; with PWM_OFS 100 that is beyond 255.
    for (pwmconf, scale) in [(15 << 8 | 30, 41), (255 << 8 | 30, 224), (255 << 8 | 100, 255)] {
        let mut chip = chip(&[(GCONF, STEALTHCHOP), (PWMCONF, pwmconf), (VMAX, 50_000)]);
        assert_eq!(chip.read(PWM_SCALE, NOW), pwmconf & 0xFF);
        assert_eq!(chip.read(PWM_SCALE, seconds(10)), scale);
        chip.set_sense(Sense { pwm_scale: Some(99), ..Sense::IDEAL }, seconds(10));
        assert_eq!(chip.read(PWM_SCALE, seconds(10)), scale, "not automatic");
        chip.write(PWMCONF, pwmconf | 1 << 18, seconds(10));
        assert_eq!(chip.read(PWM_SCALE, seconds(10)), 99);
        chip.write(GCONF, 0, seconds(10));
        assert_eq!(chip.read(PWM_SCALE, seconds(10)), 0);
    }
}

/// vhighfs and vhighchm, VDCMIN 10000.
const DCSTEP: [(u8, u32); 3] = [(CHOPCONF, 3 << 18), (VDCMIN, 10_000), (VMAX, 50_000)];

#[test]
fn in_dcstep_the_load_limits_the_true_speed_and_vactual_shows_the_one_asked_for() {
    let mut chip = chip(&DCSTEP);
    assert!(!chip.dcstep_active(seconds(0)));
    assert!(chip.dcstep_active(seconds(10)));
    chip.set_speed_limit(Some(20_000), seconds(10));
    assert_eq!(chip.read(VACTUAL, seconds(20)), 50_000);
    // 2^24 / 20000 = 838; in 2^24 clocks the counter moves by 20000.
    assert_eq!(chip.read(TSTEP, seconds(20)), 838);
    let before = chip.read(XACTUAL, seconds(20));
    let later = Instant::from_ticks(seconds(20).as_ticks() + (1 << 24));
    assert_eq!(chip.read(XACTUAL, later) - before, 20_000);
    chip.set_speed_limit(None, later);
    assert_eq!(chip.read(TSTEP, seconds(40)), 335);
}

#[test]
fn dcstep_slows_down_to_vdcmin_at_most_and_only_if_it_is_configured() {
    let mut slow = chip(&DCSTEP);
    slow.set_speed_limit(Some(1), seconds(10));
    assert_eq!(slow.read(TSTEP, seconds(30)), 1_677, "2^24 / 10000");
    for (address, value) in [(VDCMIN, 0), (CHOPCONF, 1 << 18), (CHOPCONF, 1 << 19)] {
        let mut chip = chip(&DCSTEP);
        chip.write(address, value, NOW);
        chip.set_speed_limit(Some(20_000), seconds(10));
        assert!(!chip.dcstep_active(seconds(20)));
        let velocity = chip.field(seconds(20)).speed_at(seconds(20)) * f64::from(1 << 24);
        assert!((velocity - 50_000.0).abs() < 1.0, "{velocity}");
    }
}

#[test]
fn a_reading_comes_with_every_full_step_or_with_four() {
    // 256 fine steps at 50000 units: 256 * 2^24 / 50000 = 85899 clocks.
    let chip = chip(&[(CHOPCONF, 0), (VMAX, 50_000)]);
    assert_eq!(chip.reading_interval(NOW), None);
    assert_eq!(chip.reading_interval(seconds(10)), Some(85_899));
    let mut filtered = chip.clone();
    filtered.write(COOLCONF, 1 << 24, NOW);
    assert_eq!(filtered.reading_interval(seconds(10)), Some(343_597));
}
