//! What the tests of the program share: running it, and a served module that ends with the test.

use std::io::{BufRead, BufReader, Read};
use std::process::{Child, Command, Output, Stdio};
use std::time::{Duration, Instant};

use opentmcl_link::{Client, PortUri};

/// Longer than anything takes even on a busy machine.
pub(crate) const PATIENCE: Duration = Duration::from_secs(20);

pub(crate) fn tmcl(args: &[&str]) -> Command {
    let mut command = Command::new(env!("CARGO_BIN_EXE_tmcl"));
    command.args(args).env_remove("NO_COLOR").env_remove("CLICOLOR_FORCE");
    command
}

pub(crate) fn run(args: &[&str]) -> Output {
    tmcl(args).stdin(Stdio::null()).output().unwrap()
}

#[track_caller]
pub(crate) fn stdout_of(args: &[&str]) -> String {
    let output = run(args);
    let errors = String::from_utf8(output.stderr).unwrap();
    assert!(output.status.success(), "{args:?}: {errors}");
    assert_eq!(errors, "", "{args:?}");
    String::from_utf8(output.stdout).unwrap()
}

/// Runs what must fail and returns the exit status and what it says on standard error.
#[track_caller]
pub(crate) fn failure_of(args: &[&str]) -> (i32, String) {
    let output = run(args);
    assert!(!output.status.success(), "{args:?}");
    (output.status.code().unwrap(), String::from_utf8(output.stderr).unwrap())
}

/// A served module or scenario, and what it printed first.
pub(crate) struct Served {
    child: Child,
    pub(crate) endpoints: serde_json::Value,
}

/// `tmcl serve tmcm-6214 --json` with more arguments.
pub(crate) fn serve(more: &[&str]) -> Served {
    serve_what("tmcm-6214", more)
}

/// `tmcl serve WHAT --json` with more arguments.
pub(crate) fn serve_what(what: &str, more: &[&str]) -> Served {
    let mut child = tmcl(&["serve", what, "--json"])
        .args(more)
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .unwrap();
    let mut line = String::new();
    BufReader::new(child.stdout.as_mut().unwrap()).read_line(&mut line).unwrap();
    let endpoints = serde_json::from_str(&line).unwrap_or_else(|error| {
        let mut errors = String::new();
        child.stderr.as_mut().unwrap().read_to_string(&mut errors).unwrap();
        panic!("{error}: {line:?} {errors}")
    });
    Served { child, endpoints }
}

impl Served {
    pub(crate) fn id(&self) -> u32 {
        self.child.id()
    }

    pub(crate) fn pty(&self) -> &str {
        self.endpoints["pty"].as_str().unwrap()
    }

    pub(crate) fn tcp(&self) -> std::net::SocketAddr {
        self.endpoints["tcp"].as_str().unwrap().parse().unwrap()
    }

    pub(crate) fn tcp_client(&self) -> Client {
        tcp_client(self.tcp())
    }

    /// A client of one of the modules of a scenario.
    pub(crate) fn client_of(&self, module: usize) -> Client {
        let address = self.endpoints["modules"][module]["tcp"].as_str().unwrap();
        tcp_client(address.parse().unwrap())
    }

    /// Path of the socket to the world.
    pub(crate) fn world(&self) -> &str {
        self.endpoints["world"].as_str().unwrap()
    }

    pub(crate) fn pty_client(&self) -> Client {
        Client::open(&PortUri::Serial { path: self.pty().into(), baud: 9600 }).unwrap()
    }

    /// Sends a signal and returns the exit status.
    pub(crate) fn end_with(mut self, signal: rustix::process::Signal) -> Option<i32> {
        let id = rustix::process::Pid::from_child(&self.child);
        rustix::process::kill_process(id, signal).unwrap();
        let start = Instant::now();
        loop {
            if let Some(status) = self.child.try_wait().unwrap() {
                return status.code();
            }
            assert!(start.elapsed() < PATIENCE, "it does not end");
            std::thread::sleep(Duration::from_millis(5));
        }
    }
}

fn tcp_client(address: std::net::SocketAddr) -> Client {
    Client::open(&PortUri::Tcp { host: address.ip().to_string(), port: address.port() }).unwrap()
}

impl Drop for Served {
    fn drop(&mut self) {
        // It has ended already where the test was about that.
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}
