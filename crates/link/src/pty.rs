//! A pseudo terminal: a serial port without hardware, which any serial client can open.

use std::os::fd::{AsFd, BorrowedFd, OwnedFd};
use std::os::unix::ffi::OsStrExt;
use std::path::{Path, PathBuf};
use std::{ffi::OsStr, fs, io};

use rustix::fs::{Mode, OFlags};
use rustix::pty::OpenptFlags;
use rustix::termios::OptionalActions;

/// Why there is no pseudo terminal.
#[derive(Debug, thiserror::Error)]
pub enum PtyError {
    /// The operating system gave none.
    #[error("cannot open a pseudo terminal: {0}")]
    Open(#[source] io::Error),
    /// The link would have replaced something.
    #[error("{} exists already and is left alone", .0.display())]
    LinkExists(PathBuf),
    /// The link cannot be created.
    #[error("cannot create the link {}: {source}", path.display())]
    Link {
        /// Where it should be.
        path: PathBuf,
        /// Why not.
        source: io::Error,
    },
}

impl PtyError {
    /// What the user can do about it.
    pub fn help(&self) -> String {
        match self {
            Self::Open(_) => {
                "is /dev/ptmx there and /dev/pts mounted? Without them, serve over TCP only".into()
            }
            Self::LinkExists(path) => format!(
                "choose another path, or remove {} if nothing uses it any more",
                path.display()
            ),
            Self::Link { .. } => "choose a path in a directory that you may write to".into(),
        }
    }
}

/// The module's side of a pseudo terminal in raw mode, and optionally a symbolic link to the
/// clients' side that disappears with it.
///
/// The clients' side is kept open here too: otherwise the first client that closes it would hang
/// up the line for all that come after.
#[derive(Debug)]
pub struct Pty {
    master: OwnedFd,
    _slave: OwnedFd,
    slave_path: PathBuf,
    link: Option<PathBuf>,
}

impl Pty {
    /// Opens a pseudo terminal; with `link`, makes it known under that path as well.
    ///
    /// # Errors
    /// When the system has none to give, and when `link` cannot be created, above all because
    /// something is there: an existing file is never replaced, not even an old link.
    pub fn open(link: Option<&Path>) -> Result<Self, PtyError> {
        let (master, slave, slave_path) = open_pair().map_err(PtyError::Open)?;
        let mut pty = Self { master, _slave: slave, slave_path, link: None };
        if let Some(link) = link {
            pty.link_from(link)?;
        }
        Ok(pty)
    }

    fn link_from(&mut self, path: &Path) -> Result<(), PtyError> {
        let failed = |source: io::Error| match source.kind() {
            io::ErrorKind::AlreadyExists => PtyError::LinkExists(path.to_owned()),
            _ => PtyError::Link { path: path.to_owned(), source },
        };
        // Absolute, so that it is found again at the end whatever the working directory then is.
        let absolute = std::path::absolute(path).map_err(failed)?;
        std::os::unix::fs::symlink(&self.slave_path, &absolute).map_err(failed)?;
        self.link = Some(absolute);
        Ok(())
    }

    /// The path that clients open: the link if there is one, otherwise [`Pty::device`].
    pub fn path(&self) -> &Path {
        self.link.as_deref().unwrap_or(&self.slave_path)
    }

    /// The device itself, such as `/dev/pts/3`.
    pub fn device(&self) -> &Path {
        &self.slave_path
    }
}

impl AsFd for Pty {
    /// The module's side; reads and writes do not block.
    fn as_fd(&self) -> BorrowedFd<'_> {
        self.master.as_fd()
    }
}

impl Drop for Pty {
    fn drop(&mut self) {
        let Some(link) = &self.link else { return };
        // Whoever replaced the link meanwhile keeps theirs.
        if fs::read_link(link).is_ok_and(|target| target == self.slave_path) {
            // There is nobody left to tell.
            let _ = fs::remove_file(link);
        }
    }
}

fn open_pair() -> io::Result<(OwnedFd, OwnedFd, PathBuf)> {
    let master = rustix::pty::openpt(OpenptFlags::RDWR | OpenptFlags::NOCTTY)?;
    rustix::io::fcntl_setfd(&master, rustix::io::FdFlags::CLOEXEC)?;
    rustix::pty::grantpt(&master)?;
    rustix::pty::unlockpt(&master)?;
    let name = rustix::pty::ptsname(&master, Vec::new())?;
    let flags = OFlags::RDWR | OFlags::NOCTTY | OFlags::CLOEXEC;
    let slave = rustix::fs::open(&*name, flags, Mode::empty())?;
    let mut settings = rustix::termios::tcgetattr(&slave)?;
    settings.make_raw();
    rustix::termios::tcsetattr(&slave, OptionalActions::Now, &settings)?;
    rustix::io::ioctl_fionbio(&master, true)?;
    Ok((master, slave, PathBuf::from(OsStr::from_bytes(name.as_bytes()))))
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::io::{Read, Write};

    fn client(pty: &Pty) -> fs::File {
        fs::File::options().read(true).write(true).open(pty.path()).unwrap()
    }

    #[test]
    fn bytes_pass_unchanged_in_both_directions() {
        let pty = Pty::open(None).unwrap();
        let all: Vec<u8> = (0..=255).collect();

        client(&pty).write_all(&all).unwrap();
        let mut received = [0; 300];
        assert_eq!(rustix::io::read(&pty, &mut received), Ok(256));
        assert_eq!(received[..256], all);

        rustix::io::write(&pty, &all).unwrap();
        let mut received = [0; 256];
        client(&pty).read_exact(&mut received).unwrap();
        assert_eq!(received[..], all);
    }

    #[test]
    fn reading_with_nothing_there_does_not_block_even_after_the_client_has_gone() {
        let pty = Pty::open(None).unwrap();
        drop(client(&pty));
        assert_eq!(rustix::io::read(&pty, &mut [0; 9]), Err(rustix::io::Errno::AGAIN));
    }

    #[test]
    fn the_link_leads_to_the_device_and_goes_with_it() {
        let folder = tempfile::tempdir().unwrap();
        let link = folder.path().join("module");
        let pty = Pty::open(Some(&link)).unwrap();
        assert_eq!(pty.path(), link);
        assert_eq!(fs::read_link(&link).unwrap(), pty.device());
        drop(pty);
        assert!(fs::symlink_metadata(&link).is_err());
    }

    #[test]
    fn nothing_that_exists_is_replaced() {
        let folder = tempfile::tempdir().unwrap();
        let file = folder.path().join("file");
        fs::write(&file, "precious").unwrap();
        let dangling = folder.path().join("dangling");
        std::os::unix::fs::symlink("/nowhere", &dangling).unwrap();

        for path in [&file, &dangling] {
            let error = Pty::open(Some(path)).unwrap_err();
            assert!(matches!(&error, PtyError::LinkExists(at) if at == path), "{error}");
            assert!(error.help().contains("remove"), "{}", error.help());
        }
        assert_eq!(fs::read_to_string(&file).unwrap(), "precious");
        assert_eq!(fs::read_link(&dangling).unwrap(), Path::new("/nowhere"));
    }

    #[test]
    fn what_replaced_the_link_meanwhile_stays() {
        let folder = tempfile::tempdir().unwrap();
        let link = folder.path().join("module");

        let pty = Pty::open(Some(&link)).unwrap();
        fs::remove_file(&link).unwrap();
        fs::write(&link, "someone else's").unwrap();
        drop(pty);
        assert_eq!(fs::read_to_string(&link).unwrap(), "someone else's");
        fs::remove_file(&link).unwrap();

        let pty = Pty::open(Some(&link)).unwrap();
        fs::remove_file(&link).unwrap();
        let other = Pty::open(Some(&link)).unwrap();
        drop(pty);
        assert_eq!(fs::read_link(&link).unwrap(), other.device());
    }

    #[test]
    fn a_missing_directory_is_named() {
        let error = Pty::open(Some(Path::new("/no/such/place"))).unwrap_err();
        assert!(error.to_string().starts_with("cannot create the link /no/such/place: "));
    }
}
