//! What a watcher is told of a program, and how far a watch sees axes go.

use std::ops::ControlFlow;

use opentmcl_virtual::{ErrorFlags, Event, Executed, Mode, Recorder, VirtualModule, Watch};
use opentmcl_wire::{Command, Duration, Instant, Status, mnemonic};

/// Clocks of a millisecond, and of a command: 10 000 of them a second.
const MILLISECOND: u64 = 16_000;
const COMMAND: u64 = 1600;

fn at(ticks: u64) -> Instant {
    Instant::from_ticks(ticks)
}

fn execute(module: &mut VirtualModule, text: &str) {
    let reply = module.execute(mnemonic::parse(text).unwrap());
    assert!(reply.status.is_ok(), "{text}: {}", reply.status);
}

/// A module that has been told to run a program at time 0.
fn running(program: &[&str]) -> VirtualModule {
    let mut module = VirtualModule::new(opentmcl_catalog::find("tmcm-6214").unwrap());
    execute(&mut module, "132 0, 0, 0");
    for text in program {
        execute(&mut module, text);
    }
    execute(&mut module, "133 0, 0, 0");
    execute(&mut module, "129 1, 0, 0");
    module
}

/// All commands that a program executes within a time.
fn trace(program: &[&str], time: Duration) -> Vec<Executed> {
    let mut module = running(program);
    let mut trace = Vec::new();
    let flow = module.advance_watched(module.now() + time, |executed| {
        trace.push(*executed);
        ControlFlow::Continue(())
    });
    assert!(flow.is_continue());
    trace
}

const SECOND: Duration = Duration::from_secs(1);

#[test]
fn each_command_comes_with_its_time_and_the_registers_after_it() {
    let trace = trace(&["CALC LOAD, 5", "CALCX LOAD", "CALC SUB, 5", "COMP 7", "STOP"], SECOND);
    let seen: Vec<_> = trace
        .iter()
        .map(|e| (e.at.as_ticks(), e.address, e.accumulator, e.x, e.flags.is_zero(), e.next))
        .collect();
    assert_eq!(
        seen,
        [
            (0, 0, 5, 0, false, 1),
            (COMMAND, 1, 5, 5, false, 2),
            (2 * COMMAND, 2, 0, 5, true, 3),
            // 0 is not 7.
            (3 * COMMAND, 3, 0, 5, false, 4),
            (4 * COMMAND, 4, 0, 5, false, 5),
        ]
    );
    assert!(trace[3].flags.comparison().is_lt());
    let modes: Vec<Mode> = trace.iter().map(|executed| executed.mode).collect();
    assert_eq!(modes, [Mode::Run, Mode::Run, Mode::Run, Mode::Run, Mode::Stop]);
    assert!(trace.iter().all(|executed| executed.status == Status::OK));
}

#[test]
fn a_branch_says_whether_it_was_taken_even_to_the_next_command() {
    let program =
        ["JC ZE, 1", "JC NZ, 2", "CALC ADD, 1", "CALL NZ, 6", "DJNZ 3, 5", "STOP", "RSUB"];
    let seen: Vec<_> = trace(&program, SECOND)
        .iter()
        .map(|executed| (executed.address, executed.branch, executed.depth))
        .collect();
    assert_eq!(
        seen,
        [
            (0, Some(true), 0),
            (1, Some(false), 0),
            (2, None, 0),
            (3, Some(true), 1),
            (6, None, 0),
            // 0 - 1 is not 0.
            (4, Some(true), 0),
            (5, None, 0),
        ]
    );
}

#[test]
fn a_wait_is_told_when_it_is_over_with_its_beginning_and_its_time_out() {
    let program = ["ROR 0, 1000", "WAIT LIMSW, 0, 2", "CLE ETO", "WAIT TICKS, 0, 3", "STOP"];
    let trace = trace(&program, SECOND);
    let times: Vec<_> = trace.iter().map(|e| (e.since.as_ticks(), e.at.as_ticks())).collect();
    let first = COMMAND + 20 * MILLISECOND;
    let second = first + 2 * COMMAND;
    assert_eq!(
        times,
        [
            (0, 0),
            (COMMAND, first),
            (first + COMMAND, first + COMMAND),
            (second, second + 30 * MILLISECOND),
            (second + 30 * MILLISECOND + COMMAND, second + 30 * MILLISECOND + COMMAND),
        ]
    );
    let timed_out: Vec<bool> =
        trace.iter().map(|e| e.flags.errors().has(ErrorFlags::TIMEOUT)).collect();
    assert_eq!(timed_out, [false, true, false, false, false]);
}

#[test]
fn a_refused_command_says_why() {
    let status = |text: &str| trace(&[text, "STOP"], SECOND)[0].status;
    // Firmware manual 3.2.1: 2 invalid command, 3 wrong type, 4 invalid value, 6 not available.
    assert_eq!(status("SAP 4, 9, 1000"), Status(4));
    assert_eq!(status("GAP 250, 0"), Status(3));
    assert_eq!(status("99 0, 0, 0"), Status(2));
    assert_eq!(status("WAIT POS, 9, 0"), Status(4));
    assert_eq!(status("27 9, 0, 0"), Status(3));
    assert_eq!(status("JC 99, 0"), Status(3));
    assert_eq!(status("CALC 12, 0"), Status(3));
    assert_eq!(status("RSUB"), Status(6));
    assert_eq!(status("RETI"), Status(6));
    assert_eq!(status("SAP 4, 0, 1000"), Status::OK);
}

#[test]
fn a_ninth_call_within_eight_is_refused() {
    // A subroutine that calls itself: the stack holds eight addresses (firmware manual 3.6.18).
    let trace = trace(&["CSUB 0", "STOP"], SECOND);
    let statuses: Vec<u8> = trace.iter().map(|executed| executed.status.0).collect();
    assert_eq!(statuses, [100, 100, 100, 100, 100, 100, 100, 100, 6, 100]);
    assert_eq!(trace[7].depth, 8);
}

#[test]
fn the_first_command_of_a_handler_is_told_as_one() {
    // Timer 0 every 10 ms from EI 0 on, in the fourth command.
    let program = [
        "VECT 0, 6",
        "SGP 0, 3, 10",
        "EI 255",
        "EI 0",
        "WAIT TICKS, 0, 100",
        "STOP",
        "CALC LOAD, 77", // 6
        "RETI",
    ];
    let trace = trace(&program, Duration::from_ticks(12 * MILLISECOND));
    let seen: Vec<_> = trace.iter().map(|e| (e.address, e.in_interrupt, e.accumulator)).collect();
    assert_eq!(
        seen,
        [
            (0, false, 0),
            (1, false, 0),
            (2, false, 0),
            (3, false, 0),
            (6, true, 77),
            // RETI gives the accumulator back.
            (7, true, 0),
        ]
    );
    assert_eq!(trace[4].at, at(3 * COMMAND + 10 * MILLISECOND));
}

#[test]
fn who_breaks_off_finds_the_module_right_behind_the_command() {
    let mut module = running(&["CALC ADD, 1", "CALC ADD, 1", "SIO 0, 2, 1", "JA 0"]);
    for (commands, address, accumulator) in [(1, 1, 1), (2, 2, 2), (3, 3, 2), (4, 0, 2), (5, 1, 3)]
    {
        let flow = module.advance_watched(at(u64::MAX / 2), |_| ControlFlow::Break(()));
        assert!(flow.is_break());
        assert_eq!(module.now(), at((commands - 1) * COMMAND));
        let state = module.program_state();
        assert_eq!(
            (state.address, state.accumulator, state.mode),
            (address, accumulator, Mode::Run)
        );
        assert_eq!(module.digital_outputs(), u8::from(commands >= 3));
    }
    assert_eq!(module.program_command(2), Some(Command::new(14, 0, 2, 1)));
    assert_eq!(module.program_command(2048), None);
}

#[test]
fn a_break_in_the_midst_of_a_run_of_commands_has_the_time_of_its_command() {
    let mut module = running(&["CALC ADD, 1", "JA 0"]);
    let flow = module.advance_watched(at(u64::MAX / 2), |executed| {
        if executed.accumulator == 100 { ControlFlow::Break(()) } else { ControlFlow::Continue(()) }
    });
    // The hundredth addition is the 199th command.
    assert!(flow.is_break());
    assert_eq!(module.now(), at(198 * COMMAND));
    assert_eq!(module.program_state().address, 1);
}

#[test]
fn a_program_that_is_stepped_is_told_step_by_step() {
    let mut module = running(&["CALC ADD, 1", "CALC ADD, 1", "STOP"]);
    execute(&mut module, "131 0, 0, 0");
    assert_eq!(module.program_state().mode, Mode::Reset);
    for address in 0..2 {
        execute(&mut module, "130 0, 0, 0");
        let mut seen = Vec::new();
        let until = module.now() + SECOND;
        let _ = module.advance_watched(until, |executed| {
            seen.push((executed.address, executed.mode));
            ControlFlow::Continue(())
        });
        assert_eq!(seen, [(address, Mode::Step)]);
    }
}

#[test]
fn an_axis_shows_its_extremes_though_nobody_looked_at_them() {
    // Out and back; 512000 microsteps are far enough for the 51200 pps of the factory settings, read
    // back as they are set.
    let mut module = running(&[
        "MVP ABS, 0, 512000",
        "WAIT POS, 0, 0",
        "MVP ABS, 0, -300",
        "WAIT POS, 0, 0",
        "SIO 2, 2, 1",
        "MVP ABS, 0, 0",
        "STOP",
    ]);
    let mut watch = Watch::new(&mut module);
    let mut outputs = Vec::new();
    let mut last = None;
    let _ = watch.advance(&mut module, at(60_000 * MILLISECOND), |event| {
        match event {
            Event::Outputs { at, before, after } => outputs.push((at, before, after)),
            Event::Executed(executed) => last = Some(*executed),
        }
        ControlFlow::Continue(())
    });
    let travel = watch.axes()[0];
    assert_eq!((travel.from, travel.to, travel.lowest, travel.highest), (0, 0, -300, 512_000));
    assert_eq!((travel.speed, travel.top_speed), (0, 51_200));
    assert!(travel.has_moved() && !watch.axes()[1].has_moved());
    let stop = last.unwrap().at;
    assert_eq!(outputs, [(stop - Duration::from_ticks(2 * COMMAND), 0, 0b100)]);
}

#[test]
fn a_position_that_was_only_set_is_no_motion() {
    // MST ends positioning: otherwise the axis would go back to its target.
    let mut module = running(&["MST 2", "SAP 1, 2, 5000", "STOP"]);
    let mut watch = Watch::new(&mut module);
    let _ = watch.advance(&mut module, at(MILLISECOND), |_| ControlFlow::Continue(()));
    assert_eq!(watch.axes()[2].to, 5000);
    assert!(!watch.axes()[2].has_moved());
}

#[test]
fn samples_of_an_uneven_rate_do_not_drift() {
    let mut module = running(&["JA 0"]);
    let mut recorder = Recorder::new(at(0), 3, vec![7]);
    execute(&mut module, "SGP 7, 2, -5");
    let mut times = Vec::new();
    for _ in 0..7 {
        module.advance_to(recorder.due());
        let sample = recorder.take(&mut module);
        assert_eq!(sample.variables, [-5]);
        times.push(sample.time.as_ticks());
    }
    // Thirds of 16 000 000 clocks, each rounded down.
    assert_eq!(times, [0, 5_333_333, 10_666_666, 16_000_000, 21_333_333, 26_666_666, 32_000_000]);
    // Samples 0, 2, 4, 6 would have been taken at half the rate; the next of these is 8.
    recorder.halve_rate();
    assert_eq!(recorder.due(), at(42_666_666));
}
