//! Finding a module or a connection by the name that a user wrote, and naming a version.

use opentmcl_catalog::{MODULES, Module};
use opentmcl_lang::suggest;
use opentmcl_link::{Uri, UriError};

use crate::failure::Failure;

/// The module with this name in any case; the failure proposes the nearest one.
pub(crate) fn module(name: &str) -> Result<&'static Module, Failure> {
    opentmcl_catalog::find(name).ok_or_else(|| {
        let failure = Failure::usage(format!("there is no module {name:?}"));
        match nearest(name) {
            Some(near) => failure.help(format!("did you mean {near}? `tmcl modules` lists all")),
            None => failure.help("`tmcl modules` lists the modules that there are"),
        }
    })
}

/// The module that calls itself so (command 136), if the catalogue has it.
pub(crate) fn by_number(number: u16) -> Option<&'static Module> {
    MODULES.iter().copied().find(|module| module.number == number)
}

fn nearest(name: &str) -> Option<&'static str> {
    // Many know a module by its number alone.
    let number = |full: &'static str| full.rsplit('-').next().unwrap_or(full);
    let names = || MODULES.iter().map(|module| module.name);
    let near = suggest::nearest(name, names().chain(names().map(number)))?;
    names().find(|&full| full == near || number(full) == near)
}

/// Reads the name of a connection; the error says what would be right.
pub(crate) fn uri(text: &str) -> Result<Uri, String> {
    text.parse().map_err(|error: UriError| format!("{error}; {}", error.help()))
}

/// A firmware version as people write it.
pub(super) fn version((major, minor): (u8, u8)) -> String {
    format!("{major}.{minor:02}")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_was_probably_meant_is_proposed() {
        for name in ["tmcm6214", "TMCM-6241", "tcmc-6214", "6214"] {
            assert_eq!(nearest(name), Some("tmcm-6214"), "{name}");
        }
        assert_eq!(nearest("arduino"), None);
    }
}
