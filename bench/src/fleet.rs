//! Many modules in one process, in real time.

use std::fs;
use std::thread;
use std::time::{Duration, Instant};

use opentmcl_virtual::VirtualModule;
use opentmcl_wire::{Command, Opcode};

use crate::{Measured, program};

const MODULES: usize = 10_000;
const THREADS: usize = 2;
const PERIOD: Duration = Duration::from_millis(10);
const PERIODS: u32 = 300;

/// Per cent of two cores that 10 000 modules need to keep up with real time, each of which runs the
/// six-axis program, is brought up to date every 10 ms and asked for a position.
pub(crate) fn fleet() -> Measured {
    let fleets: Vec<Vec<VirtualModule>> = (0..THREADS)
        .map(|_| (0..MODULES / THREADS).map(|_| program::six_axis_module()).collect())
        .collect();
    let cpu_before = cpu_seconds();
    let start = Instant::now();
    let workers: Vec<_> =
        fleets.into_iter().map(|fleet| thread::spawn(move || poll(fleet, start))).collect();
    let late: u32 = workers.into_iter().map(|worker| worker.join().expect("polls")).sum();
    let served = (PERIOD * PERIODS).as_secs_f64();
    let share = (cpu_seconds() - cpu_before) / served / THREADS as f64;
    let periods = PERIODS * THREADS as u32;
    Measured { value: share * 100.0, note: format!("{late} of {periods} periods overran") }
}

/// Polls until the end; the number of periods whose work was not done before the next began.
fn poll(mut fleet: Vec<VirtualModule>, start: Instant) -> u32 {
    let step = opentmcl_wire::Duration::from_millis(PERIOD.as_millis() as u64);
    let mut late = 0;
    for period in 0..PERIODS {
        for (number, module) in fleet.iter_mut().enumerate() {
            module.advance(step);
            let axis = (number % 6) as u8;
            let reply = module.execute(Command::new(Opcode::Gap.number(), 1, axis, 0));
            assert!(reply.status.is_ok());
        }
        let next = start + PERIOD * (period + 1);
        match next.checked_duration_since(Instant::now()) {
            Some(left) => thread::sleep(left),
            None => late += 1,
        }
    }
    assert!(
        fleet.iter_mut().all(|module| {
            module.execute(Command::new(Opcode::Gap.number(), 1, 0, 0)).value > 0
        }),
        "all have moved"
    );
    late
}

/// Processor time of this process so far.
pub(crate) fn cpu_seconds() -> f64 {
    /// The kernel counts in 1/100 s for all programs, whatever its own clock.
    const TICKS_PER_SECOND: f64 = 100.0;
    let stat = fs::read_to_string("/proc/self/stat").expect("/proc is mounted");
    let after_name = stat.rsplit(')').next().unwrap_or_default();
    let fields: Vec<&str> = after_name.split_whitespace().collect();
    // Fields 14 and 15 of proc_pid_stat(5), counted from the state, which is field 3.
    let ticks: f64 = fields[11..13].iter().map(|ticks| ticks.parse::<f64>().unwrap_or(0.0)).sum();
    ticks / TICKS_PER_SECOND
}
