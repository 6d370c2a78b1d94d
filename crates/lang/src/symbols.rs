//! The symbol file: what address each label stands for.

use std::fmt::Write;

use crate::assembly::Assembly;

/// All labels, one in a line, `name = address`, by address; labels of the same address in the order in
/// which they come.
///
/// A host needs these addresses to run a program from a label (command 129). The vendor's format for
/// them is not published. This one is TOML and INI as it stands, so that most hosts read it with what
/// they have, and TMCL too: another program may include it and have the addresses as constants.
pub fn symbols(assembly: &Assembly) -> String {
    let mut labels: Vec<_> = assembly.labels().map(|label| (label.address, label.name)).collect();
    labels.sort_by_key(|&(address, _)| address);
    let mut text = String::new();
    for (address, name) in labels {
        // Writing to a string cannot fail.
        let _ = writeln!(text, "{name} = {address}");
    }
    text
}
