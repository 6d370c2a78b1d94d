//! Transcripts: requests and expected replies as a person types them, run against any module.
//!
//! They are the executable specification. The same file runs against a virtual module in virtual
//! time and against a real one on a desk, so whoever owns a module can say where we differ.
//!
//! - [`mod@parse`]: text to [`Transcript`], with every mistake of a file at once.
//! - [`programs`]: where programs and scenarios in files of their own come from.
//! - [`mod@run`]: a [`Transcript`] against a [`Target`], with every failed expectation of a file.
//! - [`mod@coverage`]: which rows of the catalogue the transcripts touch, and which they should.
//!
//! The lines of a transcript:
//!
//! ```text
//! module tmcm-6214                 first line besides comments
//! # comment                        names the source: a chapter of the manual; also behind a line
//! test "rejects go left"           begins a case: a new module, on which the lines before the
//!                                  first case are done again
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
//! program sort.tmc                 assembles a file and loads it at address 0; from here on its
//!                                  constants and labels can stand for numbers, except behind >
//! program 10                       loads a program at this address (0 if left out) up to
//!   JA 10                          the line `end`, one command per line
//! end
//! run                              starts the program where it was loaded; run at Label
//! stop                             stops it
//! set variable 42 = 7              a user variable
//! input 3 high                     level of a digital input: high or low
//! analog 0 1234                    reading of an analog input
//! scenario lab.toml                machines behind the axes, from a file beside the transcript; before
//!                                  everything else, and each new module of the file has them
//! world block axis 1               somebody does something to the module from outside
//! expect stage 0 = 12.4..12.6 mm   where the stage itself is, whatever the module counts: mm, deg, usteps
//! wait 1500 ms                     also s and us
//! expect position 0 = 5000         a condition, or several with commas between them
//! wait until position 0 reached, at most 10 s
//!                                  time passes until the conditions hold; 10 s if left out
//! port rs485                       from here on this line: usb, rs485 or rs232; at the start it is
//!                                  whatever line there is, on a virtual module usb
//! power cycle                      off and on, the EEPROM keeps its contents
//! fresh                            from here on a new module; every file begins with one.
//!                                  A real module is restarted: its EEPROM is not new
//! ```
//!
//! Conditions, each with the command that is sent:
//!
//! ```text
//! position 0 = 4900..5100          GAP 1; also !=, <, <=, > and >=, here and below
//! position 0 reached               GAP 8
//! speed 0 = 0                      GAP 3
//! variable 42 = 3                  GGP 42, 2
//! output 1 high                    GIO 1, 2
//! input 3 low                      GIO 3, 0
//! analog 0 = 100..200              GIO 0, 1
//! program stopped                  GGP 128, 0; program running
//! program at Label                 GGP 130, 0
//! accumulator = 5                  command 135, type 2
//! x = 2                            command 135, type 3
//! ```
//!
//! All of them ask by commands, and so run on a real module, too. A real module cannot do what
//! `power cycle`, `input`, `analog`, `scenario`, `world` and `expect stage` ask for; there the rest of
//! the case is skipped.

pub mod coverage;
pub mod parse;
pub mod programs;
pub mod run;
pub mod target;
pub mod transcript;

pub use coverage::{Coverage, Table};
pub use parse::{Mistake, parse, parse_each};
pub use programs::{Assembled, NoPrograms, Programs, ScenarioFile};
pub use run::{Failure, Outcome, Skipped, run, run_case};
pub use target::{Moment, ProgramMoment, Target, TargetError};
pub use transcript::{
    Body, Case, Condition, Exchange, ExpectedReply, Line, Meaning, Program, SourceCommand, Stage,
    Step, StepKind, Transcript,
};
