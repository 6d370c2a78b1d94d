//! Recordings: samples of a module in a file, whose form its ending says.
//!
//! - here: a recording, whatever its form.
//! - `columns`: what is recorded, and its names.
//! - `servo`: what of that only servo axes have.
//! - `csv`, `parquet`, `mcap`: one form each.

mod columns;
mod csv;
mod mcap;
mod parquet;
mod servo;
#[cfg(test)]
mod tests;

use std::path::Path;

use opentmcl_virtual::Sample;

use crate::failure::Failure;
pub(crate) use columns::Columns;

/// The form of a recording.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Format {
    /// Lines of text.
    Csv,
    /// Columns for programs that evaluate.
    Parquet,
    /// Messages for viewers of robots' data.
    Mcap,
}

impl Format {
    /// The form that the ending of a file's name says; without an ending it is CSV.
    pub(crate) fn of(path: &Path) -> Result<Self, Failure> {
        let Some(ending) = path.extension() else { return Ok(Self::Csv) };
        match ending.to_ascii_lowercase().to_str() {
            Some("csv") => Ok(Self::Csv),
            Some("parquet") => Ok(Self::Parquet),
            Some("mcap") => Ok(Self::Mcap),
            _ => {
                let (shown, ending) = (path.display(), ending.display());
                Err(Failure::usage(format!(
                    "{shown}: there are no recordings of the form .{ending}"
                ))
                .help("name a file that ends with .csv, .parquet or .mcap"))
            }
        }
    }
}

/// A recording that is being written.
///
/// Lines of a CSV file can be read while they are written. A file of another form takes its place when it is
/// [finished](Recording::finish), and there is none if it never is.
pub(crate) struct Recording {
    writer: Box<dyn Writer>,
}

/// What writes a recording of one form.
trait Writer {
    fn add(&mut self, sample: &Sample) -> Result<(), Failure>;
    fn finish(self: Box<Self>) -> Result<(), Failure>;
}

impl Recording {
    /// Begins a recording in the form that the file's ending says.
    pub(crate) fn create(path: &Path, columns: Columns) -> Result<Self, Failure> {
        let writer: Box<dyn Writer> = match Format::of(path)? {
            Format::Csv => Box::new(csv::Csv::create(path, columns)?),
            Format::Parquet => Box::new(parquet::Parquet::create(path, columns)?),
            Format::Mcap => Box::new(mcap::Mcap::create(path, columns)?),
        };
        Ok(Self { writer })
    }

    /// Adds a sample; later ones follow earlier ones.
    pub(crate) fn add(&mut self, sample: &Sample) -> Result<(), Failure> {
        self.writer.add(sample)
    }

    /// Writes what is still to be written.
    pub(crate) fn finish(self) -> Result<(), Failure> {
        self.writer.finish()
    }
}
