//! Files of programs on disk: reading one, and finding those that it includes.

use std::fs::{DirEntry, File};
use std::io::{self, Read};
use std::path::{Path, PathBuf};

use opentmcl_lang::encoding;
use opentmcl_lang::include::{Found, Sources};

use crate::failure::Failure;

/// The name that stands for standard input, or standard output where something is written.
pub(crate) const DASH: &str = "-";

/// What standard input is called where a file's name is shown.
const STDIN_SHOWN: &str = "<stdin>";

/// The largest file that is read, in bytes.
const MAX_LEN: u64 = opentmcl_lang::MAX_TEXT as u64;

/// Whether a file named on the command line stands for standard input or output.
pub(crate) fn is_dash(file: &Path) -> bool {
    file.as_os_str() == DASH
}

/// The name of a file as it is shown.
pub(crate) fn shown(file: &Path) -> String {
    if is_dash(file) { STDIN_SHOWN.into() } else { file.display().to_string() }
}

/// Reads a file, or standard input.
pub(crate) fn read(file: &Path) -> Result<Vec<u8>, Failure> {
    let bytes = if is_dash(file) {
        limited(io::stdin().lock())
    } else {
        // Beforehand, for the same words on all systems.
        if file.is_dir() {
            return Err(Failure::new(format!("cannot read {}: it is a folder", file.display())));
        }
        File::open(file).and_then(limited)
    };
    bytes.map_err(|error| Failure::new(format!("cannot read {}: {}", shown(file), reason(&error))))
}

/// All that comes, unless that is too much.
fn limited(input: impl Read) -> io::Result<Vec<u8>> {
    let mut bytes = Vec::new();
    input.take(MAX_LEN + 1).read_to_end(&mut bytes)?;
    if bytes.len() as u64 > MAX_LEN {
        let message = format!("it is larger than {} MiB", MAX_LEN >> 20);
        return Err(io::Error::new(io::ErrorKind::FileTooLarge, message));
    }
    Ok(bytes)
}

/// Why a file cannot be read or written, in a few words.
pub(crate) fn reason(error: &io::Error) -> String {
    match error.kind() {
        io::ErrorKind::NotFound => "there is no such file".into(),
        io::ErrorKind::PermissionDenied => "permission denied".into(),
        _ => error.to_string(),
    }
}

/// Finds included files beside the including one, then in the folders of `--include`.
///
/// Programs come from Windows: `\` stands between folders, and case does not matter.
pub(crate) struct Disk<'a> {
    folders: &'a [PathBuf],
    /// Each file that was read, as the system knows it and as it was named first: a file that is
    /// included in two ways is one file, or a circle would not be noticed.
    known: Vec<(PathBuf, String)>,
}

impl<'a> Disk<'a> {
    /// For the program with this main file.
    pub(crate) fn new(main: &Path, folders: &'a [PathBuf]) -> Self {
        let mut disk = Self { folders, known: Vec::new() };
        if !is_dash(main) {
            disk.name(main);
        }
        disk
    }

    /// By what name a file is known.
    fn name(&mut self, file: &Path) -> String {
        let shown = file.display().to_string();
        let Ok(real) = file.canonicalize() else { return shown };
        if let Some((_, name)) = self.known.iter().find(|(known, _)| *known == real) {
            return name.clone();
        }
        self.known.push((real, shown.clone()));
        shown
    }
}

impl Sources for Disk<'_> {
    fn find(&mut self, name: &str, from: &str) -> Found {
        let name = PathBuf::from(name.replace('\\', "/"));
        if name.file_name().is_none() {
            return Found::Nothing;
        }
        let beside = Path::new(from).parent().unwrap_or(Path::new(""));
        let folders = [beside].into_iter().chain(self.folders.iter().map(PathBuf::as_path));
        let Some(file) = folders.into_iter().find_map(|folder| locate(folder, &name)) else {
            return Found::Nothing;
        };
        if file.is_dir() {
            return Found::Unreadable("it is a folder".into());
        }
        // Opening anything else, a pipe for example, could wait for ever.
        if !file.is_file() {
            return Found::Unreadable("it is not a file".into());
        }
        match File::open(&file).and_then(limited) {
            Ok(bytes) => Found::File { name: self.name(&file), text: encoding::decode(&bytes).0 },
            Err(error) => Found::Unreadable(reason(&error)),
        }
    }
}

/// The file of this name in a folder, in any case; the exact name is preferred.
fn locate(folder: &Path, name: &Path) -> Option<PathBuf> {
    let mut found = folder.to_owned();
    for component in name.components() {
        let exact = found.join(component);
        found = if exact.exists() { exact } else { found.join(in_any_case(&found, component)?) };
    }
    Some(found)
}

/// The entry of a folder that differs from this name in nothing but case; of several always the same.
fn in_any_case(folder: &Path, name: std::path::Component<'_>) -> Option<std::ffi::OsString> {
    let wanted = name.as_os_str().to_str()?.to_lowercase();
    // The empty path is the working folder, which has no entries by that name.
    let folder = if folder.as_os_str().is_empty() { Path::new(".") } else { folder };
    let names = folder.read_dir().ok()?.filter_map(|entry| Some(entry.ok()?.file_name()));
    names.filter(|name| name.to_str().is_some_and(|name| name.to_lowercase() == wanted)).min()
}

/// The extensions of sources. Files that are only included have any.
const EXTENSIONS: [&str; 2] = ["tmc", "tmcl"];

/// Which files of a folder are meant when the folder is named.
#[derive(Clone, Copy)]
pub(crate) struct Wanted {
    /// Whether a file is one of them.
    pub(crate) is_it: fn(&Path) -> bool,
    /// What they are: `there are no … in the folder`.
    pub(crate) what: &'static str,
    /// What to do if there are none.
    pub(crate) help: &'static str,
}

/// Whether a file's name says that it holds a source.
pub(crate) fn is_source(file: &Path) -> bool {
    let extension = file.extension().unwrap_or_default();
    EXTENSIONS.iter().any(|known| extension.eq_ignore_ascii_case(known))
}

/// Sources of programs.
pub(crate) const PROGRAMS: Wanted =
    Wanted { is_it: is_source, what: ".tmc files", help: "name the files themselves" };

/// The files that are meant by files and folders: of a folder all that are wanted in it and in its
/// folders, in order of their names, without hidden ones.
pub(crate) fn expand(named: &[PathBuf], wanted: Wanted) -> Result<Vec<PathBuf>, Failure> {
    let mut files = Vec::new();
    for path in named {
        if is_dash(path) || !path.is_dir() {
            files.push(path.clone());
            continue;
        }
        let before = files.len();
        add_folder(path, wanted, &mut files).map_err(|error| {
            Failure::new(format!("cannot read {}: {}", path.display(), reason(&error)))
        })?;
        if files.len() == before {
            let message = format!("there are no {} in {}", wanted.what, path.display());
            return Err(Failure::usage(message).help(wanted.help));
        }
    }
    Ok(files)
}

fn add_folder(folder: &Path, wanted: Wanted, files: &mut Vec<PathBuf>) -> io::Result<()> {
    let mut entries = folder.read_dir()?.collect::<io::Result<Vec<_>>>()?;
    entries.sort_by_key(DirEntry::file_name);
    for entry in entries {
        if entry.file_name().as_encoded_bytes().starts_with(b".") {
            continue;
        }
        let path = entry.path();
        // People write `spin.tmc`, and so do those who read our output.
        let path = path.strip_prefix(".").unwrap_or(&path).to_owned();
        // The type is that of a link itself: what it leads to could be a folder above.
        if entry.file_type()?.is_dir() {
            add_folder(&path, wanted, files)?;
        } else if (wanted.is_it)(&path) && path.is_file() {
            files.push(path);
        }
    }
    Ok(())
}
