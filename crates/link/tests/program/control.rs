//! Run, stop, step, reset, state: executed once, whatever the line does.

use std::time::Duration;

use opentmcl_link::program::{Mode, Programmer, Registers, State, TransferError};
use opentmcl_wire::{Command, mnemonic};

use crate::line::{FAULTS, Fault, FaultyLine};

/// Each command counts in the accumulator; every second one stops.
const COUNTING: [&str; 6] = ["CALC ADD, 1", "STOP", "CALC ADD, 1", "STOP", "CALC ADD, 1", "STOP"];

fn commands(program: &[&str]) -> Vec<Command> {
    program.iter().map(|text| mnemonic::parse(text).unwrap()).collect()
}

/// Exchanges of every operation below, with those of opening and of the state before: more places
/// than there are do no harm.
const PLACES: usize = 6;

/// Does something to a module that stands with this program after these commands, once for each
/// fault at each place; then looks at it.
fn with_every_fault(
    program: &[&str],
    prepare: &[&str],
    act: impl Fn(&mut Programmer<'_>) -> Result<(), TransferError>,
    look: impl Fn(&mut FaultyLine),
) {
    for place in 0..PLACES {
        // Of a byte before the reply, one in 256 makes a frame with a correct checksum.
        let strays = (0..=u8::MAX).map(Fault::StrayBeforeReply);
        for fault in FAULTS.into_iter().chain(strays) {
            let mut line = FaultyLine::with_plan(&[(place, fault)]);
            line.store(&commands(program));
            line.execute(&["131 0, 0, 0"]);
            for command in prepare {
                line.execute(&[command]);
                line.module.advance(opentmcl_wire::Duration::from_millis(5));
            }
            let result = Programmer::open(&mut line, 1, 2048).and_then(|mut host| act(&mut host));
            assert!(result.is_ok(), "{fault:?} at {place}: {result:?}");
            line.module.advance(opentmcl_wire::Duration::from_millis(5));
            look(&mut line);
        }
    }
}

fn accumulator(line: &mut FaultyLine) -> i32 {
    line.execute(&["135 2, 0, 0"])
}

fn address(line: &mut FaultyLine) -> i32 {
    line.execute(&["GGP 130, 0"])
}

#[test]
fn a_step_is_executed_once() {
    // After a reset, after another step, and after the program has stopped.
    for (prepare, before) in [(&[][..], 0), (&["130 0, 0, 0"], 1), (&["129 0, 0, 0"], 1)] {
        let program = ["CALC ADD, 1"; 1].into_iter().chain(["STOP"]).collect::<Vec<_>>();
        let program = [program, vec!["CALC ADD, 1"; 4]].concat();
        let steps = |line: &mut FaultyLine| (accumulator(line), address(line));
        with_every_fault(
            &program,
            prepare,
            |host| host.step(),
            |line| match before {
                0 => assert_eq!(steps(line), (1, 1)),
                // The step after the first was the STOP; after the STOP it is the second CALC.
                _ if prepare == ["130 0, 0, 0"] => assert_eq!(steps(line), (1, 2)),
                _ => assert_eq!(steps(line), (2, 3)),
            },
        );
    }
}

#[test]
fn a_step_stops_a_running_program() {
    with_every_fault(
        // In the second of a doubt it comes to another address than before.
        &[&["CALC ADD, 1"; 10][..], &["JA 0"]].concat(),
        &["129 0, 0, 0"],
        |host| host.step(),
        |line| assert_eq!(line.execute(&["GGP 128, 0"]), 2),
    );
}

#[test]
fn a_step_that_may_have_been_executed_in_place_is_not_repeated() {
    let mut line = FaultyLine::with_plan(&[(2, Fault::ReplyLost)]);
    line.store(&commands(&["JA 0"]));
    line.execute(&["130 0, 0, 0"]);
    let error = Programmer::open(&mut line, 1, 2048).unwrap().step().unwrap_err();
    assert_eq!(
        error.to_string(),
        "it is not known whether the step was executed: no reply within 1000 ms; the program \
         stands at address 0, mode single step, as before"
    );
    assert!(error.help().contains("tmcl status"), "{}", error.help());
}

#[test]
fn a_first_step_in_place_shows_by_the_mode() {
    let mode = |line: &mut FaultyLine| line.execute(&["GGP 128, 0"]);
    with_every_fault(
        &["JA 0"],
        &[],
        |host| host.step(),
        |line| assert_eq!((mode(line), address(line)), (2, 0)),
    );
}

#[test]
fn a_step_whose_request_arrived_damaged_is_repeated_even_in_place() {
    let mut line = FaultyLine::with_plan(&[(2, Fault::RequestGarbled(2, 1))]);
    line.store(&commands(&["JA 0"]));
    line.execute(&["130 0, 0, 0"]);
    let mut host = Programmer::open(&mut line, 1, 2048).unwrap();
    host.step().unwrap();
    assert_eq!(host.state().unwrap(), State { mode: Mode::Stepping, waiting: false, address: 0 });
}

#[test]
fn a_doubt_about_the_step_is_not_forgotten_when_the_marker_arrives_damaged() {
    let plan = [(2, Fault::ReplyLost), (3, Fault::RequestGarbled(2, 1))];
    let mut line = FaultyLine::with_plan(&plan);
    line.store(&commands(&["CALC ADD, 1", "CALC ADD, 1", "CALC ADD, 1"]));
    line.execute(&["130 0, 0, 0"]);
    Programmer::open(&mut line, 1, 2048).unwrap().step().unwrap();
    assert_eq!(accumulator(&mut line), 2);
}

#[test]
fn run_starts_the_program_once_where_it_stands() {
    for (prepare, runs) in [(&[][..], 1), (&["129 0, 0, 0"], 2)] {
        with_every_fault(
            &COUNTING,
            prepare,
            |host| host.run(None),
            |line| assert_eq!((accumulator(line), address(line)), (runs, 2 * runs)),
        );
    }
}

#[test]
fn run_at_an_address_starts_there_and_leaves_a_running_program() {
    let program = ["JA 0", "CALC ADD, 1", "STOP"];
    with_every_fault(
        &program,
        &["129 0, 0, 0"],
        |host| host.run(Some(1)),
        |line| assert_eq!((accumulator(line), address(line)), (1, 3)),
    );
}

#[test]
fn run_outside_the_memory_is_refused() {
    let mut line = FaultyLine::new();
    let error = Programmer::open(&mut line, 1, 2048).unwrap().run(Some(2048)).unwrap_err();
    assert_eq!(
        error.to_string(),
        "starting the program at address 2048 (command 129): the module answers with status 4 \
         (invalid value)"
    );
}

#[test]
fn stop_and_reset_leave_the_module_standing() {
    let endless = ["CALC ADD, 1", "CALC ADD, 1", "JA 1"];
    with_every_fault(
        &endless,
        &["129 0, 0, 0"],
        |host| host.stop(),
        |line| assert_eq!(line.execute(&["GGP 128, 0"]), 0),
    );
    with_every_fault(
        &endless,
        &["129 0, 0, 0"],
        |host| host.reset(),
        |line| assert_eq!((line.execute(&["GGP 128, 0"]), accumulator(line)), (3, 0)),
    );
}

#[test]
fn state_and_registers_are_told_over_any_fault() {
    for place in 0..5 {
        for fault in FAULTS {
            let mut line = FaultyLine::with_plan(&[(place, fault)]);
            // CALCX LOAD copies the accumulator to X; then 10 s of waiting.
            line.store(&commands(&[
                "CALC LOAD, -7",
                "CALCX LOAD",
                "CALC ADD, 3",
                "WAIT TICKS, 0, 1000",
            ]));
            line.execute(&["129 0, 0, 0"]);
            line.module.advance(opentmcl_wire::Duration::from_millis(5));
            let mut host = Programmer::open(&mut line, 1, 2048).unwrap();
            let expected = State { mode: Mode::Running, waiting: true, address: 3 };
            assert_eq!(host.state().unwrap(), expected, "{fault:?} at {place}");
            let registers = Registers { accumulator: Some(-4), x: Some(-7) };
            assert_eq!(host.registers().unwrap(), registers, "{fault:?} at {place}");
        }
        let late = |millis| Fault::ReplyLate(Duration::from_millis(millis));
        let mut line = FaultyLine::with_plan(&[(place, late(1_500)), (place + 1, late(600))]);
        line.execute(&["CALC LOAD, 1", "CALCX LOAD", "CALC LOAD, 2"]);
        let mut host = Programmer::open(&mut line, 1, 2048).unwrap();
        host.state().unwrap();
        let registers = Registers { accumulator: Some(2), x: Some(1) };
        assert_eq!(host.registers().unwrap(), registers, "replies one step out from {place} on");
    }
}
