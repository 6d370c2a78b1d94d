//! A folder with files in which the program runs.

use std::ffi::OsStr;
use std::fs;
use std::io::Write;
use std::os::unix::process::ExitStatusExt;
use std::path::PathBuf;
use std::process::{Output, Stdio};
use std::sync::mpsc::{self, RecvTimeoutError};
use std::thread;

use rustix::process::{Pid, Signal, kill_process};
use tempfile::TempDir;

use crate::common::{PATIENCE, tmcl};

pub(crate) struct Lab(TempDir);

/// What a run has left: its exit status, standard output and standard error.
pub(crate) type Ran = (i32, String, String);

impl Lab {
    /// With these files; the folders that their names need are made.
    pub(crate) fn with(files: &[(&str, &str)]) -> Self {
        let lab = Self(tempfile::tempdir().unwrap());
        for (name, text) in files {
            lab.write(name, text);
        }
        lab
    }

    pub(crate) fn path(&self, name: &str) -> PathBuf {
        self.0.path().join(name)
    }

    pub(crate) fn write(&self, name: &str, bytes: impl AsRef<[u8]>) {
        let path = self.path(name);
        fs::create_dir_all(path.parent().unwrap()).unwrap();
        fs::write(path, bytes).unwrap();
    }

    pub(crate) fn bytes(&self, name: &str) -> Vec<u8> {
        fs::read(self.path(name)).unwrap_or_else(|error| panic!("{name}: {error}"))
    }

    pub(crate) fn text(&self, name: &str) -> String {
        String::from_utf8(self.bytes(name)).unwrap()
    }

    /// The names of all files at the top, in order.
    pub(crate) fn names(&self) -> Vec<String> {
        let entries = fs::read_dir(self.0.path()).unwrap();
        let name = |entry: fs::DirEntry| entry.file_name().into_string().unwrap();
        let mut names: Vec<_> = entries.map(|entry| name(entry.unwrap())).collect();
        names.sort();
        names
    }

    /// Runs the program in the folder.
    pub(crate) fn output(&self, args: &[impl AsRef<OsStr>], input: &[u8]) -> Output {
        let mut command = tmcl(&[]);
        command.args(args).current_dir(self.0.path());
        command.stdin(Stdio::piped()).stdout(Stdio::piped()).stderr(Stdio::piped());
        let mut child = command.spawn().unwrap();
        let id = Pid::from_child(&child);
        let (ended, has_ended) = mpsc::channel::<()>();
        let watchdog = thread::spawn(move || {
            if has_ended.recv_timeout(PATIENCE) == Err(RecvTimeoutError::Timeout) {
                kill_process(id, Signal::KILL).unwrap();
            }
        });
        // It may end before it has read everything, or anything.
        let _ = child.stdin.take().unwrap().write_all(input);
        let output = child.wait_with_output().unwrap();
        drop(ended);
        watchdog.join().unwrap();
        assert_eq!(output.status.signal(), None, "it does not end");
        output
    }

    pub(crate) fn run_with(&self, args: &[&str], input: &[u8]) -> Ran {
        let Output { status, stdout, stderr } = self.output(args, input);
        let text = |bytes| String::from_utf8(bytes).unwrap();
        (status.code().unwrap(), text(stdout), text(stderr))
    }

    pub(crate) fn run(&self, args: &[&str]) -> Ran {
        self.run_with(args, b"")
    }

    /// Runs what must succeed and say nothing on standard error; returns standard output.
    #[track_caller]
    pub(crate) fn succeed(&self, args: &[&str]) -> String {
        let (status, out, errors) = self.run(args);
        assert_eq!((status, &*errors), (0, ""), "{args:?}: {out}");
        out
    }

    /// Runs what must fail with this exit status and print nothing; returns standard error.
    #[track_caller]
    pub(crate) fn fail(&self, status: i32, args: &[&str]) -> String {
        let (actual, out, errors) = self.run(args);
        assert_eq!((actual, &*out), (status, ""), "{args:?}: {errors}");
        errors
    }
}
