//! Stop by stall (181), stop by deviation of the encoder (212), and what follows (207, 240), on a simple
//! stage.

mod stage;

use opentmcl_firmware::ErrorFlags;
use opentmcl_wire::{Instant, mnemonic};
use stage::{Bench, Stage, Switch};

const MILLISECOND: u64 = 16_000;

fn sg_stop(bench: &mut Bench) -> i32 {
    // SW_MODE is register 34h, sg_stop its bit 10.
    bench.ask("148 52, 3, 0") >> 10 & 1
}

/// Default acceleration: register 439, 51107 pps^2; 20000 pps are reached after 391.4 ms.
fn stalling_at(time_ms: u64) -> Bench {
    let mut stage = Stage::new();
    stage.stall_at = Some(time_ms * MILLISECOND);
    Bench::new(stage)
}

#[test]
fn a_stall_stops_the_axis_above_the_speed_only() {
    let mut bench = stalling_at(300);
    bench.ask("SAP 181, 3, 20000");
    bench.ask("ROR 3, 51200");
    bench.wait_ms(391);
    assert_eq!((sg_stop(&mut bench), bench.ask("GAP 207, 3")), (0, 0));
    // At 391.4 ms the speed is exceeded; the firmware looks at 392 ms.
    bench.wait_ms(1);
    assert_eq!(bench.ask("GAP 3, 3"), 0);
    assert_eq!(bench.ask("GAP 207, 3"), 1);
    // Reading has cleared it.
    assert_eq!(bench.ask("GAP 207, 3"), 0);
    // Stopped for good, until the next command.
    bench.wait_ms(1_000);
    assert_eq!((bench.ask("GAP 3, 3"), bench.ask("GAP 2, 3")), (0, 0));
    bench.ask("ROR 3, 30000");
    bench.wait_ms(1_000);
    assert_eq!(bench.ask("GAP 3, 3"), 30_000);
}

#[test]
fn without_parameter_181_the_axis_goes_on() {
    let mut bench = stalling_at(500);
    bench.ask("ROR 3, 51200");
    bench.wait_ms(2_000);
    assert_eq!((bench.ask("GAP 3, 3"), bench.ask("GAP 207, 3")), (51_200, 0));
    assert_eq!(sg_stop(&mut bench), 0);
}

#[test]
fn a_motion_command_clears_the_error_flag() {
    for command in
        ["ROR 3, 1000", "ROL 3, 1000", "MST 3", "MVP ABS, 3, 0", "RFS START, 3", "SAP 2, 3, 0"]
    {
        let mut bench = stalling_at(500);
        bench.ask("SAP 181, 3, 1000");
        bench.ask("ROR 3, 51200");
        bench.wait_ms(600);
        assert_eq!(bench.ask("GAP 3, 3"), 0);
        bench.ask(command);
        assert_eq!(bench.ask("GAP 207, 3"), 0, "{command}");
    }
}

#[test]
fn below_the_speed_the_stop_is_off_again_while_braking() {
    let mut bench = Bench::new(Stage::new());
    bench.ask("SAP 181, 3, 20000");
    bench.ask("MVP ABS, 3, 400000");
    bench.wait_ms(2_000);
    assert_eq!((bench.ask("GAP 3, 3"), sg_stop(&mut bench)), (51_200, 1));
    while bench.ask("GAP 3, 3") > 20_000 {
        bench.wait_ms(1);
    }
    bench.wait_ms(1);
    assert!(bench.ask("GAP 3, 3") > 15_000);
    assert_eq!(sg_stop(&mut bench), 0);
    bench.wait_ms(3_000);
    assert_eq!(bench.ask("GAP 1, 3"), 400_000);
}

#[test]
fn nobody_looks_at_an_axis_that_stands_or_turns_steadily() {
    let mut bench = Bench::new(Stage::new());
    bench.ask("SAP 181, 3, 20000");
    assert_eq!(bench.module.poll_at(), None);
    bench.ask("ROR 3, 51200");
    // While it accelerates, at the millisecond after the one in which it can be fast enough, 391.4 ms.
    bench.wait_ms(100);
    let next = Instant::from_ticks(392 * MILLISECOND);
    assert_eq!(bench.module.poll_at(), Some(next));
    // 51200 pps are reached after 1002 ms. The board of this test then looks ahead half a second.
    bench.wait_ms(1_000);
    let next = Instant::from_ticks((bench.now_ms() + 2) * MILLISECOND);
    assert!(bench.module.poll_at() > Some(next));
    bench.ask("MST 3");
    bench.wait_ms(2_000);
    assert_eq!(bench.module.poll_at(), None);
}

/// A linear congruential generator: the same numbers everywhere.
fn next(random: &mut u64, end: u64) -> u64 {
    *random =
        random.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
    (*random >> 33) % end
}

#[test]
fn the_stop_is_on_in_each_millisecond_in_which_the_speed_is_above() {
    // 20000 pps are 20971.5 of the chip's unit.
    const THRESHOLD: u32 = 20_971;
    let mut random = 1;
    let mut seen = [0; 2];
    for _ in 0..60 {
        let mut bench = Bench::new(Stage::new());
        bench.ask("SAP 181, 3, 20000");
        // Ramps of all six points: A1, V1, AMAX, DMAX, D1, start and stop speed.
        for (parameter, least, most) in [
            (15, 0, 400_000),
            (16, 0, 60_000),
            (5, 20_000, 400_000),
            (17, 20_000, 400_000),
            (18, 0, 400_000),
            (19, 0, 30_000),
            (20, 1, 30_000),
        ] {
            let value = least + next(&mut random, most - least);
            bench.ask(&format!("SAP {parameter}, 3, {value}"));
        }
        for _ in 0..8 {
            let (kind, value) = (next(&mut random, 5), next(&mut random, 60_000));
            match kind {
                0 => bench.ask(&format!("ROR 3, {value}")),
                1 => bench.ask(&format!("ROL 3, {value}")),
                2 => bench.ask(&format!("SAP 4, 3, {value}")),
                _ => bench.ask(&format!("MVP ABS, 3, {}", value as i64 * 2 - 60_000)),
            };
            for _ in 0..1 + next(&mut random, 900) {
                bench.wait_ms(1);
                // VACTUAL is register 22h, 24 bits with sign.
                let speed = (bench.ask("148 34, 3, 0") << 8 >> 8).unsigned_abs();
                if speed.abs_diff(THRESHOLD) > 1 {
                    let is_above = speed > THRESHOLD;
                    assert_eq!(
                        sg_stop(&mut bench) == 1,
                        is_above,
                        "{speed} at {} ms",
                        bench.now_ms()
                    );
                    seen[usize::from(is_above)] += 1;
                }
            }
        }
    }
    assert!(seen.iter().all(|&count| count > 20_000), "{seen:?}");
}

#[test]
fn a_stall_during_a_search_stops_the_axis_and_keeps_its_state() {
    let mut bench = stalling_at(600);
    bench.ask("SAP 181, 3, 1000");
    bench.ask("RFS START, 3");
    bench.wait_ms(5_000);
    assert_eq!((bench.ask("GAP 3, 3"), bench.ask("RFS STATUS, 3")), (0, 6));
    assert_eq!(bench.ask("GAP 207, 3"), 1);
    bench.ask("RFS STOP, 3");
    assert_eq!(bench.ask("RFS STATUS, 3"), 0);
}

/// An axis whose encoder stays behind from place 10000 on.
fn blocked() -> Bench {
    let mut stage = Stage::new();
    stage.barrier = Some(10_000);
    let mut bench = Bench::new(stage);
    bench.ask("SAP 212, 3, 500");
    bench
}

/// Runs a program that does nothing but exist, so that flags and interrupts work.
fn run(bench: &mut Bench, program: &[&str]) {
    let now = Instant::from_ticks(bench.now_ms() * MILLISECOND);
    for command in program {
        bench.module.execute_direct(mnemonic::parse(command).unwrap(), now);
    }
}

#[test]
fn an_encoder_that_stays_behind_stops_the_axis() {
    let mut bench = blocked();
    bench.ask("ROR 3, 10000");
    bench.wait_ms(3_000);
    let position = bench.ask("GAP 1, 3");
    // At 10501 the difference exceeds 500. Register 65535 brakes from 10000 pps within 10 microsteps.
    assert!((10_501..10_515).contains(&position), "{position}");
    assert_eq!((bench.ask("GAP 3, 3"), bench.ask("GAP 209, 3")), (0, 10_000));
    assert!(bench.module.program_state().flags.errors().has(ErrorFlags::DEVIATION));
    assert_eq!((bench.ask("GAP 207, 3"), bench.ask("GAP 207, 3")), (2, 0));
    // The acceleration is the user's again.
    assert_eq!(bench.ask("GAP 5, 3"), 51_107);
    // As long as it deviates it is stopped again.
    bench.ask("MVP ABS, 3, 0");
    assert_eq!(bench.ask("GAP 207, 3"), 2);
    bench.wait_ms(1_000);
    assert_eq!(bench.ask("GAP 1, 3"), position);
    // With the encoder set to the position it can move.
    bench.stage().barrier = None;
    bench.ask(&format!("SAP 209, 3, {position}"));
    bench.ask("MVP ABS, 3, 0");
    bench.wait_ms(3_000);
    assert_eq!((bench.ask("GAP 1, 3"), bench.ask("GAP 207, 3")), (0, 0));
    // AMAX, register 24h: 439 = 51107 pps^2 once more.
    assert_eq!(bench.ask("148 38, 3, 0"), 439);
}

#[test]
fn without_parameter_212_nothing_follows() {
    let mut bench = blocked();
    bench.ask("SAP 212, 3, 0");
    bench.ask("ROR 3, 10000");
    bench.wait_ms(3_000);
    assert_eq!((bench.ask("GAP 3, 3"), bench.ask("GAP 207, 3")), (10_000, 0));
}

#[test]
fn the_deviation_action_sets_an_output_and_takes_torque_away() {
    // Action, outputs afterwards, TOFF (167) of axis 3 and of axis 0. The default of 167 is 3.
    for (action, outputs, this, other) in
        [(0, 0, 3, 3), (16 + 5, 32, 3, 3), (16 + 9, 0, 3, 3), (32 + 5, 0, 0, 3), (64, 0, 0, 0)]
    {
        let mut bench = blocked();
        assert_eq!(bench.ask("GAP 167, 3"), 3);
        bench.ask(&format!("SAP 240, 3, {action}"));
        bench.ask("ROR 3, 10000");
        bench.wait_ms(3_000);
        assert_eq!(i32::from(bench.stage().outputs), outputs, "{action}");
        assert_eq!(bench.ask("GIO 255, 2"), outputs, "{action}");
        assert_eq!((bench.ask("GAP 167, 3"), bench.ask("GAP 167, 0")), (this, other), "{action}");
        bench.ask("SAP 167, 3, 3");
        assert_eq!(bench.ask("GAP 167, 3"), 3);
    }
}

#[test]
fn stall_deviation_and_limit_switches_interrupt_a_program() {
    // Interrupts of axis 3: 18 stall, 24 deviation, 33 left switch.
    for (number, variable) in [(18, 1), (24, 2), (33, 3)] {
        let mut stage = Stage::new();
        stage.barrier = Some(20_000);
        stage.stall_at = Some(1_500 * MILLISECOND);
        stage.left = Switch::new(3_000, 4_000);
        let mut bench = Bench::new(stage);
        run(
            &mut bench,
            &[
                "132 0, 0, 0",
                "WAIT TICKS, 0, 1000",
                "STOP",
                &format!("CALCV ADD, {variable}, 1"),
                "RETI",
                "133 0, 0, 0",
            ],
        );
        bench.ask(&format!("VECT {number}, 2"));
        bench.ask("SGP 33, 3, 3");
        bench.ask("129 1, 0, 0");
        bench.ask(&format!("EI {number}"));
        bench.ask("EI 255");
        bench.ask(if number == 24 { "SAP 212, 3, 100" } else { "SAP 181, 3, 1000" });
        bench.ask("ROR 3, 20000");
        bench.wait_ms(5_000);
        // One stall, one deviation, two edges.
        let expected = if number == 33 { 2 } else { 1 };
        assert_eq!(bench.ask(&format!("GGP {variable}, 2")), expected, "interrupt {number}");
    }
}

#[test]
fn a_program_waits_for_home_and_limit_switches() {
    for (wait, position) in [("WAIT REFSW, 3, 0", 2_000), ("WAIT LIMSW, 3, 0", 5_000)] {
        let mut stage = Stage::new();
        stage.home = Switch::new(2_000, 2_500);
        stage.right = Switch::new(5_000, 5_500);
        let mut bench = Bench::new(stage);
        run(&mut bench, &["132 0, 0, 0", "ROR 3, 1000", wait, "CCO 1, 3", "STOP", "133 0, 0, 0"]);
        bench.ask("129 1, 0, 0");
        bench.wait_ms(8_000);
        assert_eq!(bench.ask("GCO 1, 3"), position, "{wait}");
    }
}
