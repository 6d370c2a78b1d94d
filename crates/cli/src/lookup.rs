//! Finding a module or a connection by the name that a user wrote, and naming a version.

use opentmcl_catalog::{MODULES, Module};
use opentmcl_link::{Uri, UriError};

use crate::failure::Failure;

/// From how similar a name on it is worth proposing, on a scale of 0 to 1.
const SIMILAR: f64 = 0.7;

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
    let name = name.to_lowercase();
    // Many know a module by its number alone.
    let similarity = |full: &str| {
        let number = full.rsplit('-').next().unwrap_or(full);
        strsim::jaro_winkler(&name, full).max(strsim::jaro_winkler(&name, number))
    };
    MODULES
        .iter()
        .map(|module| (similarity(module.name), module.name))
        .filter(|&(similarity, _)| similarity >= SIMILAR)
        .max_by(|(left, _), (right, _)| left.total_cmp(right))
        .map(|(_, name)| name)
}

/// The name that was probably meant, in any case.
pub(crate) fn nearest_of<'a>(name: &str, names: impl Iterator<Item = &'a str>) -> Option<&'a str> {
    let name = name.to_lowercase();
    names
        .map(|other| (strsim::jaro_winkler(&name, &other.to_lowercase()), other))
        .filter(|&(similarity, _)| similarity >= SIMILAR)
        .max_by(|(left, _), (right, _)| left.total_cmp(right))
        .map(|(_, name)| name)
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
