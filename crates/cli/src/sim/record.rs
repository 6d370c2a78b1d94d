//! `--record`: samples at a set rate as CSV.

use std::fs::File;
use std::io::{BufWriter, Write};
use std::path::{Path, PathBuf};

use opentmcl_catalog::Module;
use opentmcl_virtual::{Recorder, VirtualModule};
use opentmcl_wire::Instant;

use super::ports;
use super::run::Observer;
use super::time;
use crate::failure::Failure;
use crate::output;

/// Writes a line for each sample.
pub(super) struct Record {
    path: PathBuf,
    file: BufWriter<File>,
    recorder: Recorder,
    /// Bits of the outputs that have a column.
    outputs: Vec<u8>,
}

impl Record {
    /// Creates the file with its header.
    pub(super) fn create(
        path: &Path,
        model: &'static Module,
        start: Instant,
        rate: u32,
        variables: &[u8],
    ) -> Result<Self, Failure> {
        let file = File::create(path).map_err(|error| output::cannot_write(path, &error))?;
        let mut columns = vec!["time_s".to_owned()];
        columns.extend((0..model.axes).map(|axis| format!("position{axis}_microsteps")));
        columns.extend((0..model.axes).map(|axis| format!("speed{axis}_pps")));
        columns.push("address".to_owned());
        let mut outputs = Vec::new();
        for (number, bit) in ports::outputs(model) {
            columns.push(format!("output{number}"));
            outputs.push(bit);
        }
        columns.extend(variables.iter().map(|number| format!("variable{number}")));
        let recorder = Recorder::new(start, rate, variables.to_vec());
        let mut record =
            Self { path: path.to_owned(), file: BufWriter::new(file), recorder, outputs };
        record.write(&columns.join(","))?;
        Ok(record)
    }

    /// Writes what is still buffered.
    pub(super) fn finish(mut self) -> Result<(), Failure> {
        self.file.flush().map_err(|error| output::cannot_write(&self.path, &error))
    }

    fn write(&mut self, line: &str) -> Result<(), Failure> {
        writeln!(self.file, "{line}").map_err(|error| output::cannot_write(&self.path, &error))
    }
}

impl Observer for Record {
    fn due(&self) -> Option<Instant> {
        Some(self.recorder.due())
    }

    fn look(&mut self, module: &mut VirtualModule) -> Result<(), Failure> {
        let sample = self.recorder.take(module);
        let mut line = time::column(sample.time);
        let mut add = |value: i64| {
            line.push(',');
            line.push_str(&value.to_string());
        };
        sample.positions.iter().chain(&sample.speeds).for_each(|&value| add(value.into()));
        add(sample.address.into());
        self.outputs.iter().for_each(|&bit| add((sample.outputs >> bit & 1).into()));
        sample.variables.iter().for_each(|&value| add(value.into()));
        self.write(&line)
    }
}
