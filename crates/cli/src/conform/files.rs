//! Finding and reading transcripts.

use std::path::{Path, PathBuf};

use opentmcl_conform::{Transcript, parse_each};

use crate::failure::Failure;
use crate::program_files::ProgramFiles;
use crate::sources::{self, Wanted};

/// Where the transcripts are unless files are named.
const DEFAULT_FOLDER: &str = "conformance";

const TRANSCRIPTS: Wanted = Wanted {
    is_it: |path| path.extension().is_some_and(|extension| extension == "txt"),
    what: "transcripts",
    help: "the names of transcripts end in .txt; or name a file",
};

/// Reads the named files and folders, or all below [`DEFAULT_FOLDER`].
pub(super) fn read(
    named: &[PathBuf],
    programs: &mut ProgramFiles<'_>,
) -> Result<Vec<Transcript>, Failure> {
    let default = [PathBuf::from(DEFAULT_FOLDER)];
    if named.is_empty() && !Path::new(DEFAULT_FOLDER).is_dir() {
        return Err(Failure::usage(format!("there is no folder {DEFAULT_FOLDER} here"))
            .help("name transcripts, or change to the folder of the project"));
    }
    let named = if named.is_empty() { &default } else { named };
    let mut transcripts = Vec::new();
    let mut mistakes = Vec::new();
    for path in sources::expand(named, TRANSCRIPTS)? {
        let text = String::from_utf8_lossy(&sources::read(&path)?).into_owned();
        match parse_each(&path.display().to_string(), &text, programs) {
            Ok(each) => transcripts.extend(each),
            Err(found) => mistakes.extend(found.iter().map(ToString::to_string)),
        }
    }
    if !mistakes.is_empty() {
        return Err(Failure::new(mistakes.join("\n       ")));
    }
    Ok(transcripts)
}
