//! `tmcl lsp`: the language server, which editors start and talk to over standard input and output.
//!
//! One thread reads messages, another one answers them in the order in which they come. A change of
//! a text marks what depends on it; programs are assembled when the next question comes, or when no
//! message waits any more and it is time to tell what is wrong.

mod answers;
mod capabilities;
mod convert;
mod documents;
mod edits;
mod publish;
mod server;
mod settings;
mod transport;
mod uri;
mod workspace;

use std::path::PathBuf;
use std::process::ExitCode;
use std::sync::mpsc::TryRecvError;

use crate::failure::{self, Failure};
use crate::lookup;

use server::{Server, State};
use settings::Settings;

/// Serve editors: mistakes, completion, help and jumps in TMCL programs
///
/// Editors start it and talk to it over standard input and output, by the language server protocol.
#[derive(clap::Args)]
#[command(after_help = EXAMPLES)]
pub(crate) struct Args {
    /// Module of programs that do not name theirs; an editor's setting has precedence
    #[arg(short, long, value_name = "NAME")]
    module: Option<String>,
    /// Folder to search for included files; may be given more than once
    #[arg(short = 'I', long = "include", value_name = "DIR")]
    include: Vec<PathBuf>,
    /// The only way to talk to it, accepted because many editors ask for it
    #[arg(long = "stdio", hide = true)]
    _stdio: bool,
}

const EXAMPLES: &str = "\
Examples, as an editor is told to start it:
  tmcl lsp
  tmcl lsp --module tmcm-6214 -I /home/me/lab/include";

pub(crate) fn run(args: Args) -> ExitCode {
    match serve(args) {
        Ok(true) => ExitCode::SUCCESS,
        // The protocol wants to see that nobody said goodbye.
        Ok(false) => ExitCode::FAILURE,
        Err(failure) => failure::exit_code(Err(failure)),
    }
}

/// Serves until the editor has gone; true if it had announced that.
fn serve(args: Args) -> Result<bool, Failure> {
    let module = args.module.as_deref().map(lookup::module).transpose()?;
    // An editor needs whole paths.
    let absolute = |folder: PathBuf| std::path::absolute(&folder).unwrap_or(folder);
    let settings = Settings { module, include: args.include.into_iter().map(absolute).collect() };
    let incoming = transport::incoming();
    let mut server = Server::new(settings, std::io::stdout().lock());
    loop {
        let message = match incoming.try_recv() {
            Ok(message) => message,
            Err(TryRecvError::Disconnected) => break,
            Err(TryRecvError::Empty) => {
                server.publish()?;
                match incoming.recv() {
                    Ok(message) => message,
                    Err(_) => break,
                }
            }
        };
        server.handle(message)?;
        if server.state() == State::Ended {
            break;
        }
    }
    Ok(server.was_shut_down())
}
