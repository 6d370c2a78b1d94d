//! `tmcl world`: look at the world around served modules, and act upon it.

mod show;

use std::io::{self, BufRead, IsTerminal, Write};
use std::path::PathBuf;
use std::sync::Arc;
use std::sync::atomic::AtomicBool;
use std::time::Duration;

use opentmcl_link::{ControlClient, ControlClientError};
use serde_json::Value;
use signal_hook::consts::{SIGINT, SIGTERM};

use crate::failure::Failure;

/// Act upon the machines behind served modules, and see what happens there
///
/// Talks to the socket whose path `tmcl serve` prints. Each argument is one line; the first one that is
/// refused ends it. Without arguments, lines come from standard input.
#[derive(clap::Args)]
#[command(after_help = EXAMPLES)]
pub(crate) struct Args {
    /// An action, or state, faults, watch, scenario, help, schema; with several modules NAME: before it
    #[arg(value_name = "LINE")]
    lines: Vec<String>,
    /// The socket: PATH or world:PATH, as `tmcl serve` prints it
    #[arg(short, long, value_name = "PATH", value_parser = parse_path)]
    connect: PathBuf,
    /// Print what the server answers, one JSON object in a line
    #[arg(long)]
    json: bool,
}

const EXAMPLES: &str = "\
Examples:
  tmcl world -c /tmp/lab state
  tmcl world -c /tmp/lab 'load axis 2 0.3 Nm' 'block axis 1'
  tmcl world -c /tmp/lab 'xy: press home axis 0'
  tmcl world -c /tmp/lab 'faults tcp drop=0.01,seed=7' faults
  tmcl world -c /tmp/lab watch
  tmcl world -c /tmp/lab --json 'watch 20'";

/// How long an answer may take.
const PATIENCE: Duration = Duration::from_secs(10);

fn parse_path(text: &str) -> Result<PathBuf, String> {
    match text.strip_prefix("world:").unwrap_or(text) {
        "" => Err("write the path that `tmcl serve` prints behind \"world\"".into()),
        path => Ok(PathBuf::from(path)),
    }
}

/// Sends the lines and prints what comes back.
pub(crate) fn run(args: &Args) -> Result<(), Failure> {
    if let Some((last, before)) = args.lines.split_last()
        && let Some(line) = before.iter().find(|line| is_watch(line))
    {
        return Err(Failure::usage(format!(
            "{line:?} goes on until Ctrl-C, so {last:?} is never sent"
        ))
        .help("put it last, or watch in another terminal"));
    }
    let mut world = World { client: ControlClient::open(&args.connect)?, json: args.json };
    if !args.lines.is_empty() {
        return args.lines.iter().try_for_each(|line| world.exchange(line));
    }
    let input = io::stdin();
    let is_terminal = input.is_terminal();
    let mut line = String::new();
    loop {
        if is_terminal {
            anstream::eprint!("world> ");
        }
        line.clear();
        let count = input
            .lock()
            .read_line(&mut line)
            .map_err(|error| Failure::new(format!("cannot read standard input: {error}")))?;
        if count == 0 {
            return Ok(());
        }
        if line.trim().is_empty() {
            continue;
        }
        match world.exchange(line.trim()) {
            Err(failure) if is_terminal && failure.is_refusal() => {
                anstream::eprintln!("{}", failure.message());
            }
            result => result?,
        }
    }
}

fn is_watch(line: &str) -> bool {
    line.split_whitespace().next() == Some("watch")
}

/// A server's world.
struct World {
    client: ControlClient,
    json: bool,
}

impl World {
    /// Sends a line and prints the answer; after `watch`, all that follows.
    fn exchange(&mut self, line: &str) -> Result<(), Failure> {
        if line.contains(['\n', '\r']) {
            return Err(Failure::usage(format!("{line:?} is more than one line")));
        }
        self.client.send(line)?;
        let answer = self.answer()?;
        let (text, answer) = &answer;
        if answer["ok"] != true {
            if self.json {
                self.print(text)?;
            }
            let message = answer["error"].as_str().unwrap_or("refused without a reason");
            return Err(Failure::refused(format!("{line}: {message}")));
        }
        if self.json {
            self.print(text)?;
        } else {
            let mut out = anstream::stdout().lock();
            show::answer(&mut out, answer)?;
            out.flush()?;
        }
        if is_watch(line) { self.watch() } else { Ok(()) }
    }

    /// The next line that is an answer.
    fn answer(&mut self) -> Result<(String, Value), Failure> {
        loop {
            let (text, answer) = self.receive(Some(PATIENCE))?;
            if answer.get("ok").is_some() {
                return Ok((text, answer));
            }
        }
    }

    fn receive(&mut self, timeout: Option<Duration>) -> Result<(String, Value), Failure> {
        let text = self.client.receive(timeout)?;
        match serde_json::from_str::<Value>(&text) {
            Ok(value) if value.is_object() => Ok((text, value)),
            _ => Err(Failure::new(format!("the answer is not an object of JSON: {text:?}"))
                .help(ControlClientError::NotText.help())),
        }
    }

    /// Prints changes until Ctrl-C.
    fn watch(&mut self) -> Result<(), Failure> {
        for signal in [SIGINT, SIGTERM] {
            // Every line is complete when it has been printed, so the process may end at any time.
            let always = Arc::new(AtomicBool::new(true));
            signal_hook::flag::register_conditional_shutdown(signal, 0, always)
                .map_err(|error| Failure::new(format!("cannot listen to signals: {error}")))?;
        }
        loop {
            let (text, change) = self.receive(None)?;
            if self.json {
                self.print(&text)?;
            } else {
                let mut out = anstream::stdout().lock();
                show::change(&mut out, &change)?;
                out.flush()?;
            }
        }
    }

    fn print(&self, text: &str) -> Result<(), Failure> {
        let mut out = anstream::stdout().lock();
        writeln!(out, "{text}")?;
        out.flush()?;
        Ok(())
    }
}
