//! The symbol file: what address each label stands for.

use std::fmt::Write;

use crate::assembly::Assembly;

/// All labels, one in a line, `name = address`, in the order in which they come, which is that of their
/// addresses.
///
/// A host needs these addresses to run a program from a label (command 129). The vendor's format for
/// them is not published. This one is TOML and INI as it stands, so that most hosts read it with what
/// they have, and TMCL too: another program may include it and have the addresses as constants.
pub fn symbols(assembly: &Assembly) -> String {
    let mut text = String::new();
    for label in assembly.labels() {
        // Writing to a string cannot fail.
        let _ = writeln!(text, "{} = {}", label.name, label.address);
    }
    text
}
