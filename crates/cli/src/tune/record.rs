//! `--record`: what was read, as a recording.

use std::path::Path;

use opentmcl_virtual::Sample;

use super::regulator::unit;
use super::report::rows;
use super::run::{Plan, Run};
use crate::failure::Failure;
use crate::recording::{Columns, Recording};

/// Writes target and quantities. Quantities that were read in turns keep their last value meanwhile.
pub(super) fn write(path: &Path, plan: &Plan, run: &Run) -> Result<(), Failure> {
    let target = ("target", unit(plan.parameters.actual));
    let quantities = run.channels.iter().map(|channel| (channel.quantity, unit(channel.row)));
    let quantities: Vec<_> = [target].into_iter().chain(quantities).collect();
    let columns = Columns::of_quantities(plan.module, plan.rate, 0, &quantities);
    let mut recording = Recording::create(path, columns)?;
    for (time, values) in rows(&run.channels) {
        recording.add(&Sample {
            time,
            address: 0,
            positions: Vec::new(),
            speeds: Vec::new(),
            outputs: 0,
            variables: [run.to].into_iter().chain(values).collect(),
            machines: Vec::new(),
            servos: Vec::new(),
            inputs: 0,
            analog: Vec::new(),
        })?;
    }
    recording.finish()
}
