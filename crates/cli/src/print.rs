//! What the output of several subcommands has in common.

use std::io::{self, Write};

use anstyle::{AnsiColor, Style};
use serde::Serialize;

/// Marks what has passed.
pub(crate) const OK: Style = AnsiColor::Green.on_default();
/// Marks what has failed.
pub(crate) const FAILED: Style = AnsiColor::Red.on_default().bold();
/// Marks what was not done.
pub(crate) const SKIPPED: Style = AnsiColor::Yellow.on_default();

/// A number and what is counted: `1 file`, `2 files`.
pub(crate) fn counted<N: TryInto<u64>>(count: N, noun: &str) -> String {
    let count = count.try_into().unwrap_or(u64::MAX);
    format!("{count} {noun}{}", if count == 1 { "" } else { "s" })
}

/// Prints a value as JSON in a line of its own.
///
/// # Errors
///
/// What writing fails with.
pub(crate) fn json_line(out: &mut impl Write, value: &impl Serialize) -> io::Result<()> {
    serde_json::to_writer(&mut *out, value)?;
    writeln!(out)
}
