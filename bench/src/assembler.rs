//! From text to bytes.

use std::fmt::Write as _;
use std::hint::black_box;
use std::time::Duration;

use opentmcl_lang::include::BuiltInOnly;
use opentmcl_lang::{Options, assemble};

use crate::{Measured, seconds_per_call};

/// Lines of the large program: long enough that its names no longer fit the nearest cache.
const LINES: usize = 100_000;

/// Commands of the program that an editor assembles again at each key: a full memory.
const COMMANDS: usize = 2048;

/// A piece of a program with the mixture of real ones: constants, labels, parameters by name, branches,
/// calculations, a comment on every third line. 21 lines, 15 commands.
fn piece(text: &mut String, number: usize) {
    let _ = write!(
        text,
        "Speed{number} = {number} * 10 + 100\n\
         Count{number} = 42 // a user variable\n\
         // approach and wait\n\
         Loop{number}:\n\
         \tSAP APMaxPositioningSpeed, Motor0, Speed{number}\n\
         \tSAP 5, 0, 50000 // pps2\n\
         \tMVP ABS, Motor0, -512000\n\
         \tWAIT POS, 0, 0\n\
         \tGGP Count{number}, 2\n\
         \tCALC ADD, 1\n\
         \tAGP Count{number}, 2 // one more\n\
         \tCOMP 100\n\
         \tJC GE, Done{number}\n\
         \tGIO 3, 0\n\
         \tJC ZE, Loop{number} // until the switch closes\n\
         \tCALC MUL, -1\n\
         \tAAP 4, 0\n\
         \tCALCX LOAD\n\
         \tJA Loop{number}\n\
         Done{number}: // both ways lead here\n\
         \tCSUB Loop{number}\n"
    );
}

fn program(wanted: impl Fn(usize, usize) -> bool) -> String {
    let mut text = String::from("#include TMCLParam.tmc\n");
    let mut pieces = 0;
    while wanted(1 + pieces * 21, pieces * 15) {
        piece(&mut text, pieces);
        pieces += 1;
    }
    text
}

fn seconds(text: &str) -> f64 {
    seconds_per_call(Duration::from_millis(200), || {
        let assembly = assemble("bench.tmc", black_box(text), &mut BuiltInOnly, Options::default());
        let bytes: Vec<u8> = assembly.commands().flat_map(|command| command.to_bytes()).collect();
        assert!(assembly.is_valid());
        black_box(bytes);
    })
}

/// Lines per second of a large program.
pub(crate) fn lines() -> Measured {
    let text = program(|lines, _| lines < LINES);
    let lines = text.lines().count();
    let note = format!("{lines} lines, {} bytes", text.len());
    Measured { value: lines as f64 / seconds(&text), note }
}

/// Milliseconds for a program that fills a module's memory.
pub(crate) fn full_memory() -> Measured {
    let text = program(|_, commands| commands < COMMANDS);
    let note = format!("{} lines", text.lines().count());
    Measured { value: seconds(&text) * 1e3, note }
}
