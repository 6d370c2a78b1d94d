//! Transcripts: requests and expected replies as a person types them, run against any module.
//!
//! They are the executable specification. The same file runs against a virtual module in virtual
//! time and against a real one on a desk, so whoever owns a module can say where we differ.
//!
//! - [`mod@parse`]: text to [`Transcript`], with every mistake of a file at once.
//! - [`mod@run`]: a [`Transcript`] against a [`Target`], with every failed expectation of a file.
//! - [`mod@coverage`]: which rows of the catalogue the transcripts touch, and which they should.
//!
//! The lines of a transcript:
//!
//! ```text
//! module tmcm-6214                 first line besides comments
//! # comment                        names the source: a chapter of the manual
//! > SAP 5, 0, 51200                a command in mnemonics, or by number: > 129 1, 0, 5
//! < 100                            the reply's status; the value is not looked at
//! < 100 51200                      status and value, also in hexadecimal: $C800
//! < 100 51000..51400               status and range of the value, both ends included
//! < silence                        no reply may come
//! <+ 128 5                         one more reply that nobody asked for now, and that has come
//! > module 7: GAP 1, 0             the same, to another module address than 1
//! >> 01 06 01 00 00 00 00 00 08    bytes as they are
//! << 02 01 64 06 00 00 00 00 6D    reply bytes as they are; .. is any byte
//! <<+ 02 01 80 8A 00 00 00 05 12   bytes of one more reply
//! wait 1500 ms                     also s and us
//! port rs485                       from here on this line: usb, rs485 or rs232; at the start it is
//!                                  whatever line there is, on a virtual module usb
//! power cycle                      off and on, the EEPROM keeps its contents
//! input 3 high                     level of a digital input: high or low
//! analog 0 1234                    reading of an analog input
//! program 10                       loads a program at this address (0 if left out) up to
//!   JA 10                          the line `end`, one command per line
//! end
//! fresh                            from here on a new module; every file begins with one.
//!                                  A real module is restarted: its EEPROM is not new
//! ```
//!
//! A real module cannot do what `power cycle`, `input` and `analog` ask for; there the rest of the
//! file is skipped.

pub mod coverage;
pub mod parse;
pub mod run;

pub use coverage::{Coverage, Table};
pub use parse::{
    Exchange, ExpectedReply, Line, Mistake, Program, SourceCommand, Step, StepKind, Transcript,
};
pub use run::{Failure, Outcome, Skipped, Target, TargetError, run};
