//! The measurements that need no other process, one JSON line each: `opentmcl-bench [NAME...]`.
//!
//! `bench/run.py` runs this, adds what is measured from outside, and compares with the budgets.

mod assembler;
mod fleet;
mod heap;
mod line;
mod program;
mod servo;

use std::env;
use std::time::{Duration, Instant};

#[global_allocator]
static HEAP: heap::Counted = heap::Counted;

/// One measurement: the value, and what else is worth knowing about how it came about.
struct Measured {
    value: f64,
    note: String,
}

impl Measured {
    fn new(value: f64) -> Self {
        Self { value, note: String::new() }
    }
}

type Measurement = (&'static str, fn() -> Measured);

/// By name; the unit, the reference and the budget of each are in `bench/run.py`.
const MEASUREMENTS: [Measurement; 12] = [
    ("gap-in-process", line::gap_in_process),
    ("own-work-per-request", line::own_work_per_request),
    ("garbage", line::garbage),
    ("interpreter", program::interpreter),
    ("six-axis-hour", program::six_axis_hour),
    ("loaded-hour", program::loaded_hour),
    ("field-oriented", servo::field_oriented),
    ("block-commutation", servo::block),
    ("module-memory", heap::module_memory),
    ("fleet", fleet::fleet),
    ("assembler", assembler::lines),
    ("assembler-full-memory", assembler::full_memory),
];

fn main() {
    let wanted: Vec<String> = env::args().skip(1).collect();
    for (name, measure) in MEASUREMENTS {
        if wanted.is_empty() || wanted.iter().any(|wanted| *wanted == name) {
            let Measured { value, note } = measure();
            println!("{{\"name\": \"{name}\", \"value\": {value}, \"note\": \"{note}\"}}");
        }
    }
}

/// Seconds per call of `work`: the median of some rounds, each at least `round` long.
fn seconds_per_call(round: Duration, mut work: impl FnMut()) -> f64 {
    const ROUNDS: usize = 7;
    let mut seconds: Vec<f64> = (0..ROUNDS)
        .map(|_| {
            let start = Instant::now();
            let mut calls = 0u32;
            while start.elapsed() < round {
                work();
                calls += 1;
            }
            start.elapsed().as_secs_f64() / f64::from(calls)
        })
        .collect();
    seconds.sort_by(f64::total_cmp);
    seconds[ROUNDS / 2]
}
