//! Turns `modules/*.toml` into the tables of the catalogue: reads them ([`data`]), checks them
//! ([`checks`]) and writes `modules.rs` ([`generate`]), which `src/lib.rs` includes.

mod checks;
mod data;
mod generate;

use std::fmt::Display;
use std::path::{Path, PathBuf};
use std::process::ExitCode;
use std::{env, fs};

use data::Source;

fn main() -> ExitCode {
    let folder =
        Path::new(&env::var("CARGO_MANIFEST_DIR").expect("set by Cargo")).join("../../modules");
    println!("cargo:rerun-if-changed={}", folder.display());
    println!("cargo:rerun-if-changed=build");
    match build(&folder) {
        Ok(()) => ExitCode::SUCCESS,
        Err(faults) => {
            for fault in faults {
                println!("cargo::error={fault}");
            }
            ExitCode::FAILURE
        }
    }
}

fn build(folder: &Path) -> Result<(), Vec<String>> {
    let sources = read(folder).map_err(|fault| vec![fault])?;
    let mut faults = Vec::new();
    let mut modules = Vec::new();
    for source in sources {
        match data::parse(&source) {
            Ok(module) => {
                faults.extend(checks::check(&source.file, &module));
                modules.push(module);
            }
            Err(fault) => faults.push(fault),
        }
    }
    if !faults.is_empty() {
        return Err(faults);
    }
    let out = env::var_os("OUT_DIR").ok_or_else(|| vec!["OUT_DIR is not set".to_owned()])?;
    let path = PathBuf::from(out).join("modules.rs");
    let failed = |error: &dyn Display| vec![format!("cannot write {}: {error}", path.display())];
    let text = generate::generate(&modules).map_err(|error| failed(&error))?;
    fs::write(&path, text).map_err(|error| failed(&error))
}

/// All `.toml` files of the folder, by name, so that the result does not depend on the disk.
fn read(folder: &Path) -> Result<Vec<Source>, String> {
    let failed = |path: &Path, error| format!("cannot read {}: {error}", path.display());
    let mut paths = Vec::new();
    for entry in fs::read_dir(folder).map_err(|error| failed(folder, error))? {
        let path = entry.map_err(|error| failed(folder, error))?.path();
        if path.extension().is_some_and(|extension| extension == "toml") {
            paths.push(path);
        }
    }
    paths.sort();
    let mut sources = Vec::new();
    for path in paths {
        let text = fs::read_to_string(&path).map_err(|error| failed(&path, error))?;
        let name = path.file_name().unwrap_or_default().to_string_lossy();
        sources.push(Source { file: format!("modules/{name}"), text });
    }
    Ok(sources)
}
