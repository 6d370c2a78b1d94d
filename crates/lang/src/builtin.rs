//! The include files that come with the tools.

/// The vendor's names of axes, axis parameters and their values.
const PARAMETERS: &str = include_str!("builtin/TMCLParam.tmc");

/// Names of interrupts.
const INTERRUPTS: &str = include_str!("builtin/Interrupts.inc");

const FILES: &[(&str, &str)] = &[("TMCLParam.tmc", PARAMETERS), ("Interrupts.inc", INTERRUPTS)];

/// The names of all built-in files.
pub fn names() -> impl Iterator<Item = &'static str> {
    FILES.iter().map(|&(name, _)| name)
}

/// The built-in file with this name, in any case: its own name and its text.
pub fn file(name: &str) -> Option<(&'static str, &'static str)> {
    FILES.iter().find(|(known, _)| known.eq_ignore_ascii_case(name)).copied()
}

/// The built-in file that defines a constant.
pub(crate) fn file_with_constant(name: &str) -> Option<&'static str> {
    let defines = |text: &str| {
        let names = text.lines().filter_map(|line| line.split_once('='));
        names.into_iter().any(|(constant, _)| constant.trim().eq_ignore_ascii_case(name))
    };
    FILES.iter().find(|(_, text)| defines(text)).map(|&(file, _)| file)
}
