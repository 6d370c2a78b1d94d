//! MCAP: messages in JSON with their schemas, a channel for each axis and one for the module.

use std::collections::BTreeMap;
use std::fs::File;
use std::io::BufWriter;
use std::path::{Path, PathBuf};

use mcap::records::{MessageHeader, Metadata};
use mcap::{McapError, McapResult, WriteOptions};
use opentmcl_virtual::Sample;
use serde_json::{Map, json};

use super::Writer;
use super::columns::{Column, Columns, Kind, Value};
use crate::failure::Failure;
use crate::output::{Growing, cannot_write};

pub(super) struct Mcap {
    path: PathBuf,
    columns: Columns,
    channels: Vec<Channel>,
    writer: mcap::Writer<BufWriter<File>>,
    growing: Growing,
    /// Number of the next sample.
    sequence: u32,
}

struct Channel {
    id: u16,
    axis: Option<u8>,
}

impl Mcap {
    pub(super) fn create(path: &Path, columns: Columns) -> Result<Self, Failure> {
        let (growing, file) = Growing::create(path)?;
        let begin = || {
            let options = WriteOptions::new()
                .compression(None)
                .library(format!("tmcl {}", env!("CARGO_PKG_VERSION")));
            let mut writer = options.create(BufWriter::new(file))?;
            let pairs = columns.description();
            let metadata = pairs.into_iter().map(|(key, value)| (key.to_owned(), value)).collect();
            writer.write_metadata(&Metadata { name: "recording".to_owned(), metadata })?;
            let groups = (0..columns.model.axes).map(Some).chain([None]);
            let channels = groups.map(|axis| Channel::new(&mut writer, &columns, axis));
            let channels = channels.collect::<McapResult<Vec<_>>>()?;
            Ok((writer, channels))
        };
        let (writer, channels) = begin().map_err(|error| failure(path, error))?;
        Ok(Self { path: path.to_owned(), columns, channels, writer, growing, sequence: 0 })
    }

    fn write(&mut self, sample: &Sample) -> McapResult<()> {
        // A clock has 62.5 ns.
        let nanoseconds = u128::from(sample.time.as_ticks()) * 125 / 2;
        let log_time = u64::try_from(nanoseconds).unwrap_or(u64::MAX);
        for channel in &self.channels {
            let of_channel = fields(&self.columns, channel.axis);
            let message: Map<_, _> = of_channel
                .map(|column| {
                    let value = match column.value(sample) {
                        Value::Whole(value) => json!(value),
                        Value::Real(value) => json!(value),
                        Value::Level(value) => json!(value),
                    };
                    (column.field.clone(), value)
                })
                .collect();
            let header = MessageHeader {
                channel_id: channel.id,
                sequence: self.sequence,
                log_time,
                publish_time: log_time,
            };
            let message = serde_json::Value::Object(message).to_string();
            self.writer.write_to_known_channel(&header, message.as_bytes())?;
        }
        self.sequence = self.sequence.wrapping_add(1);
        Ok(())
    }
}

impl Writer for Mcap {
    fn add(&mut self, sample: &Sample) -> Result<(), Failure> {
        self.write(sample).map_err(|error| failure(&self.path, error))
    }

    fn finish(mut self: Box<Self>) -> Result<(), Failure> {
        self.writer.finish().map_err(|error| failure(&self.path, error))?;
        self.growing.finish()
    }
}

impl Channel {
    /// Adds the channel of an axis or of the module to a file, with its schema.
    fn new(
        writer: &mut mcap::Writer<BufWriter<File>>,
        columns: &Columns,
        axis: Option<u8>,
    ) -> McapResult<Self> {
        let properties: Map<_, _> =
            fields(columns, axis).map(|column| (column.field.clone(), property(column))).collect();
        let topic = axis.map_or("/module".to_owned(), |axis| format!("/axis{axis}"));
        let title = topic.trim_start_matches('/');
        let schema = json!({ "title": title, "type": "object", "properties": properties });
        let schema = writer.add_schema(title, "jsonschema", schema.to_string().as_bytes())?;
        Ok(Self { id: writer.add_channel(schema, &topic, "json", &BTreeMap::new())?, axis })
    }
}

/// The columns of a channel. A message has its time beside its fields.
fn fields(columns: &Columns, axis: Option<u8>) -> impl Iterator<Item = &Column> {
    columns.columns.iter().skip(1).filter(move |column| column.axis == axis)
}

fn property(column: &Column) -> serde_json::Value {
    let kind = match column.kind {
        Kind::Whole => "integer",
        Kind::Real => "number",
        Kind::Level => "boolean",
    };
    match column.unit {
        "" => json!({ "type": kind }),
        unit => json!({ "type": kind, "description": format!("in {unit}") }),
    }
}

fn failure(path: &Path, error: McapError) -> Failure {
    match error {
        McapError::Io(error) => cannot_write(path, &error),
        error => Failure::new(format!("cannot write {}: {error}", path.display())),
    }
}
