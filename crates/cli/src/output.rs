//! Files that a subcommand writes: all of a file or nothing of it.

use std::ffi::OsString;
use std::fs::{self, File};
use std::io::{self, Seek, Write};
use std::os::unix::fs::PermissionsExt;
use std::path::{Path, PathBuf};

use tempfile::NamedTempFile;

use crate::failure::Failure;
use crate::sources::{is_dash, reason};

/// Writes files, `-` being standard output. No file takes its place before all of them are ready.
///
/// A file is written under another name in the same folder and then renamed, so that a full disk or a
/// loss of power leaves the older file as it was.
pub(crate) fn write_all<'a>(
    files: impl IntoIterator<Item = (&'a Path, Vec<u8>)>,
) -> Result<(), Failure> {
    let prepared = files.into_iter().map(|(file, bytes)| Prepared::new(file, bytes));
    let prepared = prepared.collect::<Result<Vec<_>, _>>()?;
    prepared.into_iter().try_for_each(Prepared::finish)
}

/// A file that is ready to take its place.
struct Prepared<'a> {
    file: &'a Path,
    content: Content,
}

enum Content {
    /// Written, and what it will replace.
    Beside(NamedTempFile, PathBuf),
    /// For what cannot be replaced: a device or a pipe.
    Bytes(Vec<u8>),
}

impl<'a> Prepared<'a> {
    fn new(file: &'a Path, bytes: Vec<u8>) -> Result<Self, Failure> {
        if is_dash(file) {
            return Ok(Self { file, content: Content::Bytes(bytes) });
        }
        let content = prepare(file, bytes).map_err(|error| cannot_write(file, &error))?;
        Ok(Self { file, content })
    }

    fn finish(self) -> Result<(), Failure> {
        let result = match self.content {
            Content::Bytes(bytes) if is_dash(self.file) => {
                return Ok(io::stdout().lock().write_all(&bytes)?);
            }
            Content::Bytes(bytes) => {
                let device = fs::OpenOptions::new().write(true).truncate(true).open(self.file);
                device.and_then(|mut device| device.write_all(&bytes))
            }
            Content::Beside(written, target) => {
                written.persist(target).map(drop).map_err(|error| error.error)
            }
        };
        result.map_err(|error| cannot_write(self.file, &error))
    }
}

fn prepare(file: &Path, bytes: Vec<u8>) -> io::Result<Content> {
    let Some(mut beside) = Beside::new(file)? else { return Ok(Content::Bytes(bytes)) };
    beside.written.write_all(&bytes)?;
    beside.written.as_file().sync_all()?;
    Ok(Content::Beside(beside.written, beside.target))
}

/// A file under another name in the folder of the one that it will replace.
struct Beside {
    written: NamedTempFile,
    target: PathBuf,
}

impl Beside {
    /// A new file; none for what cannot be replaced.
    fn new(file: &Path) -> io::Result<Option<Self>> {
        // It may lead to a file, by way of which somebody reads what comes out of us.
        if file.starts_with("/dev") {
            return Ok(None);
        }
        // Through a link: what it leads to is replaced, not the link.
        let target = file.canonicalize().unwrap_or_else(|_| file.to_owned());
        let older = match fs::metadata(&target) {
            Ok(older) if older.is_dir() => return Err(io::Error::other("it is a folder")),
            Ok(older) if !older.is_file() => return Ok(None),
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
        let mut ending = OsString::new();
        if let Some(extension) = target.extension() {
            ending.push(".");
            ending.push(extension);
        }
        // What the system gives to a new file; otherwise only the owner could read it.
        let usual = fs::Permissions::from_mode(0o666);
        let written = tempfile::Builder::new()
            .prefix(".tmcl-")
            .suffix(&ending)
            .permissions(usual)
            .tempfile_in(folder)?;
        if let Some(permissions) = older {
            written.as_file().set_permissions(permissions)?;
        }
        Ok(Some(Self { written, target }))
    }
}

/// A file that grows for a long time and takes its place when it is whole. Until then it is in the same folder
/// under another name, which ends like its own; it goes away if it never becomes whole.
pub(crate) struct Growing {
    file: PathBuf,
    content: Grown,
}

enum Grown {
    Beside(Beside),
    /// For what cannot be replaced: a device or a pipe gets it all at the end.
    Apart(File),
}

impl Growing {
    /// An empty file, and what writes to it. It can be written to from any place on.
    pub(crate) fn create(file: &Path) -> Result<(Self, File), Failure> {
        let create = || {
            let content = match Beside::new(file)? {
                Some(beside) => Grown::Beside(beside),
                None => Grown::Apart(tempfile::tempfile()?),
            };
            let writer = match &content {
                Grown::Beside(beside) => beside.written.as_file().try_clone()?,
                Grown::Apart(apart) => apart.try_clone()?,
            };
            Ok((Self { file: file.to_owned(), content }, writer))
        };
        create().map_err(|error| cannot_write(file, &error))
    }

    /// It is whole: everything has been written.
    pub(crate) fn finish(self) -> Result<(), Failure> {
        let file = &self.file;
        let place = || match self.content {
            Grown::Beside(Beside { written, target }) => {
                written.as_file().sync_all()?;
                written.persist(target).map(drop).map_err(|error| error.error)
            }
            Grown::Apart(mut apart) => {
                apart.rewind()?;
                let mut device = fs::OpenOptions::new().write(true).open(file)?;
                io::copy(&mut apart, &mut device).map(drop)
            }
        };
        place().map_err(|error| cannot_write(file, &error))
    }
}

/// Why a file was not written.
pub(crate) fn cannot_write(file: &Path, error: &io::Error) -> Failure {
    let reason = match error.kind() {
        io::ErrorKind::NotFound => "there is no such folder".into(),
        _ => reason(error),
    };
    Failure::new(format!("cannot write {}: {reason}", file.display()))
}

/// Fails if an output is one of the files that are read, or another output.
pub(crate) fn keep_apart<'a>(
    outputs: &[&Path],
    inputs: impl IntoIterator<Item = &'a Path>,
) -> Result<(), Failure> {
    let inputs: Vec<&Path> = inputs.into_iter().collect();
    for (at, output) in outputs.iter().enumerate().filter(|(_, output)| !is_dash(output)) {
        let shown = output.display();
        if inputs.iter().any(|input| is_same(output, input)) {
            let message = format!("{shown} is read, and would be overwritten");
            return Err(Failure::usage(message).help("write to a file of another name"));
        }
        if outputs[..at].iter().any(|earlier| is_same(output, earlier)) {
            let message = format!("{shown} is named for two outputs");
            return Err(Failure::usage(message).help("give each output a name of its own"));
        }
    }
    Ok(())
}

/// Whether two names lead to the same file.
fn is_same(left: &Path, right: &Path) -> bool {
    real(left) == real(right)
}

/// The one name that the system has for a file, also for one that is not there yet.
fn real(file: &Path) -> PathBuf {
    let beside = || {
        let folder = file.parent().filter(|folder| !folder.as_os_str().is_empty());
        let folder = folder.unwrap_or(Path::new(".")).canonicalize().ok()?;
        Some(folder.join(file.file_name()?))
    };
    file.canonicalize().ok().or_else(beside).unwrap_or_else(|| file.to_owned())
}
