//! What is known of the terminal.

use std::os::fd::AsFd;

/// Width where the output is no terminal, in characters.
const WIDTH: u16 = 100;

/// How many characters fit into a line of this output.
pub(crate) fn width(output: impl AsFd) -> u16 {
    let columns = rustix::termios::tcgetwinsize(output).map(|size| size.ws_col);
    columns.ok().filter(|&columns| columns > 0).unwrap_or(WIDTH)
}
