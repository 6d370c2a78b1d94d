//! The reference search on a simple stage: where the origin comes to lie, in every mode and from every
//! start, worked out from the places of the switches (firmware manual 6.1).

mod stage;

use stage::{Bench, Stage, Switch};

/// A stage 100000 microsteps long: home in the middle, limit switches near the ends that open again
/// behind, as vanes do.
const LEFT: (i64, i64) = (-40_000, -38_000);
const HOME: (i64, i64) = (-500, 1_500);
const RIGHT: (i64, i64) = (38_000, 40_000);

fn stage_at(place: i64) -> Stage {
    let mut stage = Stage::new();
    stage.left = Switch::new(LEFT.0, LEFT.1);
    stage.home = Switch::new(HOME.0, HOME.1);
    stage.right = Switch::new(RIGHT.0, RIGHT.1);
    stage.origin = place;
    stage
}

fn with_mode(stage: Stage, mode: i32) -> Bench {
    let mut bench = Bench::new(stage);
    bench.ask(&format!("SAP 193, 3, {mode}"));
    bench.ask("SAP 194, 3, 20000");
    bench.ask("SAP 195, 3, 2000");
    bench
}

/// Searches until the end and returns where the origin lies now.
fn searched(bench: &mut Bench) -> i64 {
    bench.ask("RFS START, 3");
    for _ in 0..600 {
        bench.wait_ms(100);
        if bench.ask("RFS STATUS, 3") == 0 {
            assert_eq!(bench.ask("GAP 0, 3"), 0, "target");
            assert_eq!(bench.ask("GAP 1, 3"), 0, "position");
            assert_eq!(bench.ask("GAP 209, 3"), 0, "encoder");
            assert_eq!(bench.ask("GAP 8, 3"), 1, "position reached");
            return bench.stage().place();
        }
    }
    panic!("no end: state {}", bench.ask("RFS STATUS, 3"));
}

/// An edge is seen in the clock in which the counter changes; from the two sides these are different
/// microsteps, and half ones are rounded.
#[track_caller]
fn assert_close(place: i64, expected: i64, what: &str) {
    assert!((place - expected).abs() <= 1, "{what}: {place}, expected {expected}");
}

#[test]
fn the_origin_does_not_depend_on_where_the_search_starts() {
    let middle = |(from, to): (i64, i64)| (from + to) / 2;
    // One side: the edge at which the axis enters, which is the inner one for a limit switch.
    let references = [
        (1, LEFT.1),
        (2, LEFT.1),
        (3, middle(LEFT)),
        (4, middle(LEFT)),
        (5, middle(HOME)),
        (6, middle(HOME)),
        (65, RIGHT.0),
        (66, RIGHT.0),
        (67, middle(RIGHT)),
        (68, middle(RIGHT)),
    ];
    for (mode, expected) in references {
        let on_left = middle(LEFT);
        for start in [on_left, -20_000, middle(HOME), 20_000, middle(RIGHT)] {
            // A search for one limit switch cannot find it from behind; on the other one it can start.
            let place = searched(&mut with_mode(stage_at(start), mode));
            assert_close(place, expected, &format!("mode {mode} from {start}"));
        }
    }
}

#[test]
fn modes_7_and_8_ignore_the_limit_switches() {
    for (mode, starts) in [(7, [500, 20_000, 39_000]), (8, [500, -20_000, -39_000])] {
        for start in starts {
            let place = searched(&mut with_mode(stage_at(start), mode));
            assert_close(place, 500, &format!("mode {mode} from {start}"));
        }
    }
    // The home switch lies behind: it goes on past the limit switch.
    let mut bench = with_mode(stage_at(-20_000), 7);
    bench.ask("RFS START, 3");
    bench.wait_ms(5_000);
    assert_eq!(bench.ask("RFS STATUS, 3"), 1);
    assert!(bench.stage().place() < LEFT.0);
}

#[test]
fn a_search_may_start_while_the_axis_runs_the_other_way() {
    let mut bench = with_mode(stage_at(-20_000), 7);
    bench.ask("ROR 3, 20000");
    while bench.stage().place() < -1_000 {
        bench.wait_ms(1);
    }
    // It needs 3913 microsteps to brake and so runs past the switch, which ends at 1500.
    assert_close(searched(&mut bench), 500, "mode 7");
}

#[test]
fn an_inverted_home_switch_is_open_where_it_was_closed() {
    for mode in 133..=136 {
        // Read inverted, the axis stands on the switch wherever home is not: it leaves it slowly.
        let start = if mode % 2 == 0 { -20_000 } else { 20_000 };
        let mut bench = with_mode(stage_at(start), mode);
        bench.ask("RFS START, 3");
        assert_eq!(bench.ask("RFS STATUS, 3"), 3, "mode {mode}");
        bench.wait_ms(1_000);
        let expected = if mode % 2 == 0 { 2_000 } else { -2_000 };
        assert_eq!(bench.ask("GAP 3, 3"), expected, "mode {mode}");
    }
}

#[test]
fn the_reference_is_the_middle_of_the_two_switching_points() {
    let mut stage = stage_at(0);
    stage.left.hysteresis = 60;
    // Left at -38000 + 60, entered at -38000.
    assert_close(searched(&mut with_mode(stage, 1)), -37_970, "one side");
    let mut stage = stage_at(0);
    stage.left.hysteresis = 60;
    // Left at -40060 on one side and -37940 on the other: hysteresis cancels.
    assert_close(searched(&mut with_mode(stage, 4)), -39_000, "both sides");
}

#[test]
fn bouncing_contacts_do_not_disturb() {
    for (mode, expected) in [(1, LEFT.1), (4, -39_000), (5, 500)] {
        let mut stage = stage_at(20_000);
        for switch in [&mut stage.left, &mut stage.home] {
            switch.bounce = 16_000 * 5;
        }
        // Each edge may be taken up to 5 ms late, 10 microsteps at 2000 pps.
        let place = searched(&mut with_mode(stage, mode));
        assert!((place - expected).abs() <= 10, "mode {mode}: {place}");
    }
}

#[test]
fn a_narrow_switch_that_the_axis_runs_past_is_found_again() {
    for (mode, expected) in [(1, -37_900), (4, -37_950), (7, -37_950)] {
        let mut stage = stage_at(0);
        stage.left = Switch::new(-38_000, -37_900);
        stage.home = stage.left;
        let mut bench = with_mode(stage, mode);
        // From 20000 pps with 51107 pps^2 the axis needs 3913 microsteps to brake; the switch has 101.
        assert_close(searched(&mut bench), expected, &format!("mode {mode}"));
    }
}

#[test]
fn parameters_196_and_197_tell_what_was_found() {
    for (mode, distance) in [(2, 76_000), (3, 77_000), (66, 76_000)] {
        let mut bench = with_mode(stage_at(0), mode);
        let place = searched(&mut bench);
        // Two edges, each rounded to a microstep.
        assert!((bench.ask("GAP 196, 3") - distance).abs() <= 2, "mode {mode}");
        // The counter was 0 at the start, at place 0.
        assert_eq!(i64::from(bench.ask("GAP 197, 3")), place);
    }
    let mut bench = with_mode(stage_at(1_000), 1);
    searched(&mut bench);
    assert_eq!(bench.ask("GAP 196, 3"), 0);
    assert!((bench.ask("GAP 197, 3") - (-39_000)).abs() <= 1);
}

#[test]
fn the_null_channel_becomes_the_origin_exactly() {
    for (mode, start) in [(9, -20_000), (10, 20_000)] {
        let mut stage = stage_at(start);
        stage.index = 123;
        let mut bench = with_mode(stage, mode);
        // Bits 8 and 4: clear at every event; the search must neither use nor lose them.
        bench.ask("SAP 201, 3, 276");
        assert_eq!(searched(&mut bench), 123, "mode {mode}");
        assert_eq!(bench.ask("GAP 201, 3"), 276);
    }
}

#[test]
fn a_search_leaves_the_settings_as_they_are() {
    let mut bench = with_mode(stage_at(0), 1);
    bench.ask("SAP 12, 3, 0");
    bench.ask("SAP 13, 3, 0");
    bench.ask("RFS START, 3");
    assert_eq!(bench.ask("148 52, 3, 0") & 3, 0, "stops are off");
    assert_eq!((bench.ask("GAP 12, 3"), bench.ask("GAP 13, 3")), (0, 0));
    // Written meanwhile: it holds afterwards.
    bench.ask("SAP 12, 3, 1");
    assert_eq!(bench.ask("148 52, 3, 0") & 3, 0, "stops are still off");
    bench.wait_ms(30_000);
    assert_eq!(bench.ask("RFS STATUS, 3"), 0);
    assert_eq!(bench.ask("148 52, 3, 0") & 3, 1, "left stop on, right stop off");
    assert_eq!((bench.ask("GAP 4, 3"), bench.ask("GAP 5, 3")), (51_200, 51_107));
    bench.ask("MVP ABS, 3, 200000");
    bench.wait_ms(3_000);
    assert_eq!(bench.ask("GAP 3, 3"), 51_200);
}

#[test]
fn every_motion_command_ends_a_search_and_restores_the_stops() {
    for command in
        ["RFS STOP, 3", "MST 3", "ROR 3, 100", "ROL 3, 100", "MVP ABS, 3, 5", "SAP 2, 3, 7"]
    {
        let mut bench = with_mode(stage_at(0), 1);
        bench.ask("SAP 13, 3, 0");
        bench.ask("RFS START, 3");
        bench.wait_ms(500);
        bench.ask(command);
        assert_eq!(bench.ask("RFS STATUS, 3"), 0, "{command}");
        assert_eq!(bench.ask("148 52, 3, 0") & 3, 1, "{command}");
    }
}

#[test]
fn speeds_that_are_not_set_are_the_positioning_speed_and_a_quarter_of_it() {
    let mut bench = with_mode(stage_at(0), 7);
    bench.ask("SAP 194, 3, 0");
    bench.ask("SAP 195, 3, 0");
    bench.stage().home = Switch::new(-300_000, -200_000);
    bench.ask("RFS START, 3");
    bench.wait_ms(2_000);
    assert_eq!(bench.ask("GAP 3, 3"), -51_200);
    bench.wait_ms(4_500);
    assert_eq!(bench.ask("RFS STATUS, 3"), 3);
    assert_eq!(bench.ask("GAP 3, 3"), -12_800);
}

#[test]
fn a_wait_for_the_search_ends_with_it() {
    let mut bench = with_mode(stage_at(0), 1);
    for command in
        ["132 0, 0, 0", "RFS START, 3", "WAIT RFS, 3, 0", "SGP 0, 2, 9", "STOP", "133 0, 0, 0"]
    {
        let parsed = opentmcl_wire::mnemonic::parse(command).unwrap();
        let now = opentmcl_wire::Instant::from_ticks(bench.now_ms() * 16_000);
        bench.module.execute_direct(parsed, now);
    }
    bench.ask("129 1, 0, 0");
    bench.wait_ms(1_000);
    assert_eq!(bench.ask("GGP 0, 2"), 0);
    bench.wait_ms(30_000);
    assert_eq!((bench.ask("GGP 0, 2"), bench.ask("RFS STATUS, 3")), (9, 0));
}

#[test]
fn polling_more_often_changes_nothing() {
    let run = |step: u64| {
        let mut bench = with_mode(stage_at(-20_000), 3);
        bench.ask("SAP 181, 3, 5000");
        bench.ask("RFS START, 3");
        let mut seen = Vec::new();
        for time in 1..=20_000 {
            if time % step == 0 {
                bench.wait_ms(step);
            }
            if time % 1000 == 0 {
                seen.push((
                    bench.ask("RFS STATUS, 3"),
                    bench.ask("GAP 1, 3"),
                    bench.ask("GAP 3, 3"),
                ));
            }
        }
        (seen, bench.stage().place())
    };
    assert_eq!(run(1000), run(1));
}
