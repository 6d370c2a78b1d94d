//! Which files are tests.

use std::fs;
use std::path::{Path, PathBuf};

use crate::failure::Failure;
use crate::program;
use crate::sources;

/// How the names of tests end that are found in folders.
const ENDING: &str = ".test.txt";

/// The named files, and all tests below the named folders, by name.
pub(super) fn find(named: &[PathBuf]) -> Result<Vec<PathBuf>, Failure> {
    let mut files = Vec::new();
    for path in named {
        if path.is_dir() {
            let before = files.len();
            // So that names have no needless dot in front.
            let folder = if path == Path::new(".") { Path::new("") } else { path };
            collect(folder, &mut files)?;
            if files.len() == before {
                let message = format!("there are no tests in {}", path.display());
                return Err(Failure::usage(message)
                    .help(format!("the names of tests end in {ENDING}; or name a file")));
            }
        } else if sources::is_source(path) || program::is_binary(path) {
            let message = format!("{} is a program, not a test of one", path.display());
            let help = format!("a test is a file *{ENDING} with the line: program FILE");
            return Err(Failure::usage(message).help(help));
        } else {
            files.push(path.clone());
        }
    }
    Ok(files)
}

fn collect(folder: &Path, files: &mut Vec<PathBuf>) -> Result<(), Failure> {
    let shown = if folder == Path::new("") { Path::new(".") } else { folder };
    let entries = fs::read_dir(shown).and_then(Iterator::collect::<Result<Vec<_>, _>>);
    let mut entries = entries.map_err(|error| {
        Failure::new(format!("cannot read {}: {}", shown.display(), sources::reason(&error)))
    })?;
    entries.sort_by_key(fs::DirEntry::file_name);
    for entry in entries {
        let name = entry.file_name();
        let name = name.to_string_lossy();
        // Links to folders are not followed: they can lead in circles.
        let is_folder = entry.file_type().is_ok_and(|kind| kind.is_dir());
        if is_folder && !name.starts_with('.') {
            collect(&folder.join(entry.file_name()), files)?;
        } else if !is_folder && name.ends_with(ENDING) {
            files.push(folder.join(entry.file_name()));
        }
    }
    Ok(())
}
