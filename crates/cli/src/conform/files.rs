//! Finding and reading transcripts.

use std::fs;
use std::path::{Path, PathBuf};

use opentmcl_conform::{Transcript, parse};

use crate::failure::Failure;
use crate::program_files::ProgramFiles;

/// Where the transcripts are unless files are named.
const DEFAULT_FOLDER: &str = "conformance";

/// Reads the named files and folders, or all below [`DEFAULT_FOLDER`].
pub(super) fn read(
    named: &[PathBuf],
    programs: &mut ProgramFiles<'_>,
) -> Result<Vec<Transcript>, Failure> {
    let mut paths = Vec::new();
    if named.is_empty() {
        let folder = Path::new(DEFAULT_FOLDER);
        if !folder.is_dir() {
            return Err(Failure::usage(format!("there is no folder {DEFAULT_FOLDER} here"))
                .help("name transcripts, or change to the folder of the project"));
        }
        collect(folder, &mut paths)?;
    }
    for path in named {
        if path.is_dir() {
            collect(path, &mut paths)?;
        } else {
            paths.push(path.clone());
        }
    }
    let mut transcripts = Vec::new();
    let mut mistakes = Vec::new();
    for path in paths {
        let text = fs::read_to_string(&path).map_err(|error| unreadable(&path, &error))?;
        match parse(&path.display().to_string(), &text, programs) {
            Ok(transcript) => transcripts.push(transcript),
            Err(found) => mistakes.extend(found.iter().map(ToString::to_string)),
        }
    }
    if !mistakes.is_empty() {
        return Err(Failure::new(mistakes.join("\n       ")));
    }
    Ok(transcripts)
}

/// Adds all transcripts below a folder, by name.
fn collect(folder: &Path, paths: &mut Vec<PathBuf>) -> Result<(), Failure> {
    let entries = fs::read_dir(folder).and_then(Iterator::collect::<Result<Vec<_>, _>>);
    let mut entries: Vec<PathBuf> = entries
        .map_err(|error| unreadable(folder, &error))?
        .into_iter()
        .map(|entry| entry.path())
        .collect();
    entries.sort();
    for path in entries {
        if path.is_dir() {
            collect(&path, paths)?;
        } else if path.extension().is_some_and(|extension| extension == "txt") {
            paths.push(path);
        }
    }
    Ok(())
}

fn unreadable(path: &Path, error: &std::io::Error) -> Failure {
    Failure::new(format!("cannot read {}: {error}", path.display()))
        .help("name transcripts as they are in the folder conformance")
}
