//! Scenarios from files, and modules as `virtual:…` names them.

use std::path::Path;

use opentmcl_conform::ScenarioFile;
use opentmcl_virtual::{ModuleSetup, Scenario};

use crate::failure::Failure;
use crate::{lookup, sources};

/// The first module of a scenario that a transcript names.
///
/// # Errors
/// All that is wrong with it.
pub(crate) fn first(file: &ScenarioFile) -> Result<ModuleSetup, String> {
    let scenario = Scenario::parse(&file.name, &file.text).map_err(|error| error.to_string())?;
    scenario.modules.into_iter().next().ok_or_else(|| format!("{} has no module", file.name))
}

/// Reads a scenario.
///
/// # Errors
/// When the file cannot be read, and all that is wrong with it.
pub(crate) fn load(path: &Path) -> Result<Scenario, Failure> {
    let bytes = sources::read(path)?;
    let name = path.display().to_string();
    let text = std::str::from_utf8(&bytes).map_err(|error| {
        let line = bytes[..error.valid_up_to()].iter().filter(|byte| **byte == b'\n').count() + 1;
        Failure::new(format!("{name}:{line}: this is no UTF-8")).help("store the scenario as UTF-8")
    })?;
    Scenario::parse(&name, text).map_err(|mistakes| {
        // Behind "error: " and below it.
        Failure::new(mistakes.to_string().replace('\n', "\n       "))
    })
}

/// A module of a scenario, as an option names it: `lab.toml`, or `lab.toml#name` for one of several.
///
/// # Errors
/// When there is none, or something is wrong with the scenario.
pub(crate) fn of_argument(text: &str) -> Result<ModuleSetup, Failure> {
    let (file, wanted) = split(text);
    of_file(file, wanted)
}

/// The file that an option names.
pub(crate) fn file(text: &str) -> &Path {
    split(text).0
}

fn split(text: &str) -> (&Path, Option<&str>) {
    match text.rsplit_once('#') {
        // A path may have this character as well.
        Some((file, wanted)) if file.ends_with(".toml") => (Path::new(file), Some(wanted)),
        _ => (Path::new(text), None),
    }
}

/// The module that a connection `virtual:NAME` means: one of the catalogue, or of a scenario,
/// `virtual:lab.toml` (its first one) or `virtual:lab.toml#name`.
///
/// # Errors
/// When there is none, or something is wrong with the scenario.
pub(crate) fn module(name: &str) -> Result<ModuleSetup, Failure> {
    let file = name.rsplit_once('#').map_or(name, |(file, _)| file);
    if file.ends_with(".toml") {
        return of_argument(name);
    }
    Ok(ModuleSetup::new(lookup::module(name)?))
}

/// The module of a scenario with this name, or its first one.
///
/// # Errors
/// When there is none, or something is wrong with the scenario.
fn of_file(path: &Path, wanted: Option<&str>) -> Result<ModuleSetup, Failure> {
    let scenario = load(path)?;
    let found = match wanted {
        Some(wanted) => scenario.module(wanted),
        None => scenario.modules.first(),
    };
    found.cloned().ok_or_else(|| {
        let names: Vec<&str> = scenario.modules.iter().map(|module| module.name.as_str()).collect();
        let (file, wanted) = (path.display(), wanted.unwrap_or_default());
        Failure::usage(format!("{file} has no module {wanted:?}"))
            .help(format!("its modules are {}", names.join(", ")))
    })
}
