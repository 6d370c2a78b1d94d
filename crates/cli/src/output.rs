//! Files that a subcommand writes: all of a file or nothing of it.

use std::fs;
use std::io::{self, Write};
use std::os::unix::fs::PermissionsExt;
use std::path::{Path, PathBuf};

use tempfile::NamedTempFile;

use crate::failure::Failure;
use crate::sources::reason;

/// A file that is ready, and takes its place when it is told to.
///
/// It is written under another name in the same folder and then renamed, so that a full disk or a loss
/// of power leaves the older file as it was.
pub(crate) struct Output {
    file: PathBuf,
    written: Written,
}

enum Written {
    Beside(NamedTempFile),
    /// What cannot be replaced, a device or a pipe, is written to.
    Kept(Vec<u8>),
}

impl Output {
    /// Writes everything but the name.
    pub(crate) fn prepare(file: &Path, bytes: Vec<u8>) -> Result<Self, Failure> {
        // Through a link: what it leads to is replaced, not the link.
        let target = file.canonicalize().unwrap_or_else(|_| file.to_owned());
        let written = write_beside(&target, bytes).map_err(|error| cannot_write(file, &error))?;
        Ok(Self { file: target, written })
    }

    /// Puts it where it belongs.
    pub(crate) fn finish(self) -> Result<(), Failure> {
        let result = match self.written {
            Written::Beside(written) => {
                written.persist(&self.file).map(drop).map_err(|error| error.error)
            }
            Written::Kept(bytes) => {
                fs::OpenOptions::new().write(true).open(&self.file).and_then(|mut file| {
                    file.write_all(&bytes)
                })
            }
        };
        result.map_err(|error| cannot_write(&self.file, &error))
    }
}

fn write_beside(target: &Path, bytes: Vec<u8>) -> io::Result<Written> {
    let older = match fs::metadata(target) {
        Ok(older) if older.is_dir() => return Err(io::Error::other("it is a folder")),
        Ok(older) if !older.is_file() => return Ok(Written::Kept(bytes)),
        Ok(older) => Some(older.permissions()),
        Err(_) => None,
    };
    if older.as_ref().is_some_and(fs::Permissions::readonly) {
        return Err(io::ErrorKind::PermissionDenied.into());
    }
    let folder = match target.parent() {
        Some(folder) if !folder.as_os_str().is_empty() => folder,
        _ => Path::new("."),
    };
    // What the system gives to a new file; otherwise only the owner could read it.
    let usual = fs::Permissions::from_mode(0o666);
    let mut file =
        tempfile::Builder::new().prefix(".tmcl-").permissions(usual).tempfile_in(folder)?;
    file.write_all(&bytes)?;
    if let Some(permissions) = older {
        file.as_file().set_permissions(permissions)?;
    }
    file.as_file().sync_all()?;
    Ok(Written::Beside(file))
}

fn cannot_write(file: &Path, error: &io::Error) -> Failure {
    let reason = match error.kind() {
        io::ErrorKind::NotFound => "there is no such folder".into(),
        _ => reason(error),
    };
    Failure::new(format!("cannot write {}: {reason}", file.display()))
}

/// Whether two names lead to the same file.
pub(crate) fn is_same(left: &Path, right: &Path) -> bool {
    match (left.canonicalize(), right.canonicalize()) {
        (Ok(left), Ok(right)) => left == right,
        // One that is not there yet.
        _ => left == right,
    }
}
