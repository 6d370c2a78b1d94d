//! A line of text for each sample, written as it is taken.

use std::fmt::Write as _;
use std::fs::File;
use std::io::{BufWriter, Write};
use std::path::{Path, PathBuf};

use opentmcl_virtual::Sample;

use super::Writer;
use super::columns::{Columns, Value};
use crate::failure::Failure;
use crate::output::cannot_write;
use crate::time;

pub(super) struct Csv {
    path: PathBuf,
    file: BufWriter<File>,
    columns: Columns,
    line: String,
}

impl Csv {
    /// Creates the file with its header.
    pub(super) fn create(path: &Path, columns: Columns) -> Result<Self, Failure> {
        let file = File::create(path).map_err(|error| cannot_write(path, &error))?;
        let names: Vec<String> = columns.columns.iter().map(|column| column.name()).collect();
        let (path, file) = (path.to_owned(), BufWriter::new(file));
        let mut csv = Self { path, file, columns, line: names.join(",") };
        csv.write_line()?;
        Ok(csv)
    }

    fn write_line(&mut self) -> Result<(), Failure> {
        writeln!(self.file, "{}", self.line).map_err(|error| cannot_write(&self.path, &error))
    }
}

impl Writer for Csv {
    fn add(&mut self, sample: &Sample) -> Result<(), Failure> {
        // With all six decimals of a microsecond.
        self.line = time::column(sample.time);
        for column in self.columns.columns.iter().skip(1) {
            // Writing to a string cannot fail.
            let _ = match column.value(sample) {
                Value::Whole(value) => write!(self.line, ",{value}"),
                Value::Real(value) => write!(self.line, ",{value}"),
                Value::Level(value) => write!(self.line, ",{}", u8::from(value)),
            };
        }
        self.write_line()
    }

    fn finish(mut self: Box<Self>) -> Result<(), Failure> {
        self.file.flush().map_err(|error| cannot_write(&self.path, &error))
    }
}
