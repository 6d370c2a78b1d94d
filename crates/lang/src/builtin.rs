//! The include files that come with the tools: the vendor's two, and one for each module.

pub(crate) mod module;

use std::borrow::Cow;

use opentmcl_catalog::MODULES;

/// The vendor's names of axes, axis parameters and their values.
const PARAMETERS: &str = include_str!("builtin/TMCLParam.tmc");

/// Names of interrupts.
const INTERRUPTS: &str = include_str!("builtin/Interrupts.inc");

const FILES: &[(&str, &str)] = &[("TMCLParam.tmc", PARAMETERS), ("Interrupts.inc", INTERRUPTS)];

/// The names of all built-in files.
pub fn names() -> impl Iterator<Item = String> {
    let fixed = FILES.iter().map(|&(name, _)| name.to_owned());
    fixed.chain(MODULES.iter().map(|model| module::file_name(model)))
}

/// The built-in file with this name, in any case: its own name and its text.
pub fn file(name: &str) -> Option<(String, Cow<'static, str>)> {
    if let Some(&(known, text)) = FILES.iter().find(|(known, _)| known.eq_ignore_ascii_case(name)) {
        return Some((known.to_owned(), Cow::Borrowed(text)));
    }
    let of_model = MODULES.iter().find(|model| module::file_name(model).eq_ignore_ascii_case(name));
    of_model.map(|model| (module::file_name(model), Cow::Owned(module::text(model))))
}

/// The built-in file of the vendor that defines a constant.
pub(crate) fn file_with_constant(name: &str) -> Option<&'static str> {
    let defines = |text: &str| {
        let names = text.lines().filter_map(|line| line.split_once('='));
        names.into_iter().any(|(constant, _)| constant.trim().eq_ignore_ascii_case(name))
    };
    FILES.iter().find(|(_, text)| defines(text)).map(|&(file, _)| file)
}
