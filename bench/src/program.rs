//! Modules with a program, and how fast programs run.

use std::time::Duration as Wall;

use opentmcl_catalog::{Module, find};
use opentmcl_virtual::{Options, Scenario, VirtualModule, flash::MemoryFlash};
use opentmcl_wire::{Command, Duration, Opcode, control, mnemonic};

use crate::{Measured, seconds_per_call};

/// Global parameter 128: whether the program runs.
const APPLICATION_STATUS: u8 = 128;

/// Back and forth on six axes at once, each way to its end before the next; 512000 microsteps are
/// ten turns of a motor and take 11.75 s with the factory's ramp.
const SIX_AXES: [&str; 25] = [
    "MVP ABS, 0, 512000",
    "MVP ABS, 1, 512000",
    "MVP ABS, 2, 512000",
    "MVP ABS, 3, 512000",
    "MVP ABS, 4, 512000",
    "MVP ABS, 5, 512000",
    "WAIT POS, 0, 0",
    "WAIT POS, 1, 0",
    "WAIT POS, 2, 0",
    "WAIT POS, 3, 0",
    "WAIT POS, 4, 0",
    "WAIT POS, 5, 0",
    "MVP ABS, 0, 0",
    "MVP ABS, 1, 0",
    "MVP ABS, 2, 0",
    "MVP ABS, 3, 0",
    "MVP ABS, 4, 0",
    "MVP ABS, 5, 0",
    "WAIT POS, 0, 0",
    "WAIT POS, 1, 0",
    "WAIT POS, 2, 0",
    "WAIT POS, 3, 0",
    "WAIT POS, 4, 0",
    "WAIT POS, 5, 0",
    "JA 0",
];

fn model() -> &'static Module {
    find("tmcm-6214").expect("the catalogue has the module")
}

pub(crate) fn execute(module: &mut VirtualModule, line: &str) -> i32 {
    let command = mnemonic::parse(line).expect("a command");
    let reply = module.execute(command);
    assert!(reply.status.is_ok(), "{line}: {}", reply.status);
    reply.value
}

fn send(module: &mut VirtualModule, number: u8) {
    let reply = module.execute(Command::new(number, 0, 0, 0));
    assert!(reply.status.is_ok(), "command {number}: {}", reply.status);
}

fn download(module: &mut VirtualModule, lines: &[&str]) {
    send(module, control::START_DOWNLOAD);
    for line in lines {
        execute(module, line);
    }
    send(module, control::END_DOWNLOAD);
}

fn restart(module: &mut VirtualModule) {
    send(module, control::RESET_PROGRAM);
    send(module, control::RUN_PROGRAM);
}

/// Fills program memory and stores often enough that every page of the EEPROM is written and cleaned
/// up; `look` is called after each command.
pub(crate) fn fill_eeprom(module: &mut VirtualModule, mut look: impl FnMut()) {
    download(module, &["SGP 0, 2, 1"; 2048]);
    look();
    for value in 0..4000 {
        execute(module, &format!("SGP 0, 2, {value}"));
        execute(module, "STGP 0, 2");
        look();
    }
}

/// A module that runs the six-axis program.
pub(crate) fn six_axis_module() -> VirtualModule {
    let mut module = VirtualModule::new(model());
    download(&mut module, &SIX_AXES);
    restart(&mut module);
    module
}

/// A module whose six axes turn.
pub(crate) fn moving_module() -> VirtualModule {
    let mut module = VirtualModule::new(model());
    for axis in 0..6 {
        execute(&mut module, &format!("ROR {axis}, {}", 10_000 + 7_000 * axis));
    }
    advance_seconds(&mut module, 2);
    module
}

pub(crate) fn advance_seconds(module: &mut VirtualModule, seconds: u32) {
    module.advance(Duration::from_ticks(16_000_000 * u64::from(seconds)));
}

/// Iterations per second of a loop of CALC ADD and DJNZ.
pub(crate) fn interpreter() -> Measured {
    const ITERATIONS: u32 = 1_000_000;
    /// So many commands per second of virtual time that the clock seldom interrupts the loop.
    const PROGRAM_RATE: u32 = 1_000_000;
    let options = Options { program_rate: PROGRAM_RATE };
    let mut module = VirtualModule::with_flash(model(), MemoryFlash::new(), options);
    download(&mut module, &["CALC ADD, 3", "DJNZ 0, 0", "STOP"]);
    let seconds = seconds_per_call(Wall::from_millis(300), || {
        execute(&mut module, &format!("SGP 0, 2, {ITERATIONS}"));
        restart(&mut module);
        advance_seconds(&mut module, 2 * ITERATIONS / PROGRAM_RATE + 1);
        let running = Command::new(Opcode::Ggp.number(), APPLICATION_STATUS, 0, 0);
        assert_eq!(module.execute(running).value, 0, "the loop has ended");
        assert_eq!(execute(&mut module, "GGP 0, 2"), 0, "the loop has counted down");
    });
    Measured::new(f64::from(ITERATIONS) / seconds)
}

/// How many times faster than real time an hour of the six-axis program runs.
pub(crate) fn six_axis_hour() -> Measured {
    hour(&mut six_axis_module())
}

/// The same with machines behind all axes, limit switches that stop them, encoders that are watched, and
/// stops on stall.
pub(crate) fn loaded_hour() -> Measured {
    let scenario = Scenario::parse("loaded.toml", include_str!("loaded.toml"));
    let scenario = scenario.unwrap_or_else(|mistakes| panic!("{mistakes}"));
    let setup = &scenario.modules[0];
    let mut module = VirtualModule::with_setup(setup, MemoryFlash::new(), Options::default());
    for axis in 0..6 {
        execute(&mut module, &format!("SAP 12, {axis}, 0"));
        execute(&mut module, &format!("SAP 13, {axis}, 0"));
        execute(&mut module, &format!("SAP 182, {axis}, 5000"));
        execute(&mut module, &format!("SAP 181, {axis}, 20000"));
    }
    for (axis, counts) in [(3, 4000), (4, 4000), (5, 2000)] {
        execute(&mut module, &format!("SAP 210, {axis}, {counts}"));
        execute(&mut module, &format!("SAP 212, {axis}, 2000"));
    }
    download(&mut module, &SIX_AXES);
    restart(&mut module);
    let measured = hour(&mut module);
    for axis in 0..6 {
        let lost = module.view(axis).map(|view| view.lost_steps);
        assert_eq!((lost, module.stop_flags(axis)), (Some(0), 0), "axis {axis} has followed");
    }
    measured
}

fn hour(module: &mut VirtualModule) -> Measured {
    const HOUR: u32 = 3600;
    let seconds = seconds_per_call(Wall::from_millis(300), || advance_seconds(module, HOUR));
    let moves = f64::from(HOUR) / 11.75 * 6.0;
    Measured {
        value: f64::from(HOUR) / seconds,
        note: format!("{:.2} ms per hour, {:.2} us per move", seconds * 1e3, seconds * 1e6 / moves),
    }
}
