//! Parquet: columns in groups of rows. At most one group is in memory.

use std::fs::File;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use opentmcl_virtual::Sample;
use parquet::basic::{Compression, Encoding, Repetition, Type as Physical};
use parquet::data_type::{BoolType, DoubleType, Int64Type};
use parquet::errors::{ParquetError, Result as ParquetResult};
use parquet::file::metadata::KeyValue;
use parquet::file::properties::WriterProperties;
use parquet::file::writer::SerializedFileWriter;
use parquet::schema::types::{ColumnPath, Type};

use super::Writer;
use super::columns::{Columns, Kind, Value};
use crate::failure::Failure;
use crate::output::{Growing, cannot_write};

/// Values in a group of rows, over all columns: at most 8 MB.
const GROUP: usize = 1 << 20;

pub(super) struct Parquet {
    path: PathBuf,
    columns: Columns,
    writer: SerializedFileWriter<File>,
    growing: Growing,
    values: Vec<Values>,
    rows: usize,
    rows_of_group: usize,
}

/// Values of one column that are not written yet.
enum Values {
    Whole(Vec<i64>),
    Real(Vec<f64>),
    Level(Vec<bool>),
}

impl Parquet {
    pub(super) fn create(path: &Path, columns: Columns) -> Result<Self, Failure> {
        let rows_of_group = (GROUP / columns.columns.len().max(1)).max(1);
        let (growing, file) = Growing::create(path)?;
        let values = columns.columns.iter().map(|column| Values::new(column.kind)).collect();
        let writer = schema(&columns)
            .and_then(|schema| {
                SerializedFileWriter::new(file, schema, Arc::new(properties(&columns)))
            })
            .map_err(|error| failure(path, error))?;
        let path = path.to_owned();
        Ok(Self { path, columns, writer, growing, values, rows: 0, rows_of_group })
    }

    fn write_group(&mut self) -> ParquetResult<()> {
        let mut group = self.writer.next_row_group()?;
        for values in &mut self.values {
            let Some(mut column) = group.next_column()? else { break };
            match values {
                Values::Whole(values) => {
                    column.typed::<Int64Type>().write_batch(values, None, None)?;
                    values.clear();
                }
                Values::Real(values) => {
                    column.typed::<DoubleType>().write_batch(values, None, None)?;
                    values.clear();
                }
                Values::Level(values) => {
                    column.typed::<BoolType>().write_batch(values, None, None)?;
                    values.clear();
                }
            }
            column.close()?;
        }
        group.close()?;
        self.rows = 0;
        Ok(())
    }
}

impl Writer for Parquet {
    fn add(&mut self, sample: &Sample) -> Result<(), Failure> {
        for (column, values) in self.columns.columns.iter().zip(&mut self.values) {
            values.push(column.value(sample));
        }
        self.rows += 1;
        if self.rows < self.rows_of_group {
            return Ok(());
        }
        self.write_group().map_err(|error| failure(&self.path, error))
    }

    fn finish(mut self: Box<Self>) -> Result<(), Failure> {
        let mut close = || {
            if self.rows > 0 {
                self.write_group()?;
            }
            self.writer.finish()
        };
        close().map_err(|error| failure(&self.path, error))?;
        self.growing.finish()
    }
}

impl Values {
    fn new(kind: Kind) -> Self {
        match kind {
            Kind::Whole => Self::Whole(Vec::new()),
            Kind::Real => Self::Real(Vec::new()),
            Kind::Level => Self::Level(Vec::new()),
        }
    }

    /// Adds a value of the column's kind.
    fn push(&mut self, value: Value) {
        match (self, value) {
            (Self::Whole(values), Value::Whole(value)) => values.push(value),
            (Self::Real(values), Value::Real(value)) => values.push(value),
            (Self::Level(values), Value::Level(value)) => values.push(value),
            (_, value) => unreachable!("a column has values of one kind, and this is {value:?}"),
        }
    }
}

fn schema(columns: &Columns) -> ParquetResult<Arc<Type>> {
    let field = |name: String, kind| {
        let physical = match kind {
            Kind::Whole => Physical::INT64,
            Kind::Real => Physical::DOUBLE,
            Kind::Level => Physical::BOOLEAN,
        };
        let field = Type::primitive_type_builder(&name, physical);
        field.with_repetition(Repetition::REQUIRED).build().map(Arc::new)
    };
    let fields = columns.columns.iter().map(|column| field(column.name(), column.kind));
    let fields = fields.collect::<ParquetResult<Vec<_>>>()?;
    Type::group_type_builder("recording").with_fields(fields).build().map(Arc::new)
}

fn properties(columns: &Columns) -> WriterProperties {
    let pair = |key: &str, value: String| KeyValue::new(key.to_owned(), value);
    let mut pairs: Vec<KeyValue> =
        columns.description().into_iter().map(|(key, value)| pair(key, value)).collect();
    let with_units = columns.columns.iter().filter(|column| !column.unit.is_empty());
    let units =
        with_units.map(|column| pair(&format!("unit.{}", column.name()), column.unit.into()));
    pairs.extend(units);
    let mut builder = WriterProperties::builder()
        .set_created_by(format!("tmcl {}", env!("CARGO_PKG_VERSION")))
        .set_key_value_metadata(Some(pairs))
        .set_compression(Compression::SNAPPY)
        .set_dictionary_enabled(false);
    // From one sample to the next, whole numbers change by little.
    for column in columns.columns.iter().filter(|column| column.kind == Kind::Whole) {
        let path = ColumnPath::from(column.name());
        builder = builder.set_column_encoding(path, Encoding::DELTA_BINARY_PACKED);
    }
    builder.build()
}

fn failure(path: &Path, error: ParquetError) -> Failure {
    match error {
        ParquetError::External(error) => match error.downcast::<std::io::Error>() {
            Ok(error) => cannot_write(path, &error),
            Err(error) => Failure::new(format!("cannot write {}: {error}", path.display())),
        },
        error => Failure::new(format!("cannot write {}: {error}", path.display())),
    }
}
