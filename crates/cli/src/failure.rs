//! How a subcommand fails: what was wrong and what to do next, on standard error.

use std::io;
use std::process::ExitCode;

use anstyle::{AnsiColor, Style};
use opentmcl_link::program::TransferError;
use opentmcl_link::{
    ConnectionError, ControlClientError, ControlError, EepromFileError, PtyError, TcpError,
};

/// Why a subcommand did not do what it was asked to.
#[derive(Debug)]
pub(crate) struct Failure {
    message: String,
    help: Option<String>,
    kind: Kind,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Kind {
    Failed,
    WrongUsage,
    /// Somebody else does not want to do it.
    Refused,
    /// The output says it all.
    Told,
    /// Whoever read the output has seen enough.
    NobodyListens,
}

const ERROR: Style = AnsiColor::Red.on_default().bold();
const HELP: Style = AnsiColor::Cyan.on_default().bold();

impl Failure {
    /// Something failed: exit status 1.
    pub(crate) fn new(message: impl ToString) -> Self {
        Self { message: message.to_string(), help: None, kind: Kind::Failed }
    }

    /// Something that cannot be done was asked for: exit status 2.
    pub(crate) fn usage(message: impl ToString) -> Self {
        Self { kind: Kind::WrongUsage, ..Self::new(message) }
    }

    /// Whoever was asked does not do it, and may be asked for something else: exit status 1.
    pub(crate) fn refused(message: impl ToString) -> Self {
        Self { kind: Kind::Refused, ..Self::new(message) }
    }

    /// Whether asking for something else makes sense.
    pub(crate) fn is_refusal(&self) -> bool {
        self.kind == Kind::Refused
    }

    /// What was wrong.
    pub(crate) fn message(&self) -> &str {
        &self.message
    }

    /// Something failed, and the output says what: exit status 1 without a further word.
    pub(crate) fn told() -> Self {
        Self { kind: Kind::Told, ..Self::new("") }
    }

    /// What the user can do about it.
    #[must_use]
    pub(crate) fn help(self, help: impl ToString) -> Self {
        Self { help: Some(help.to_string()), ..self }
    }
}

impl From<io::Error> for Failure {
    /// A failed write to standard output, the only I/O that a subcommand does itself.
    fn from(error: io::Error) -> Self {
        match error.kind() {
            io::ErrorKind::BrokenPipe => Self { kind: Kind::NobodyListens, ..Self::new(error) },
            _ => Self::new(format!("cannot write the output: {error}")),
        }
    }
}

macro_rules! failures_with_help {
    ($($error:ty),*) => {$(
        impl From<$error> for Failure {
            fn from(error: $error) -> Self {
                Self::new(&error).help(error.help())
            }
        }
    )*};
}
failures_with_help!(
    ConnectionError,
    ControlClientError,
    ControlError,
    EepromFileError,
    PtyError,
    TcpError,
    TransferError
);

/// Reports a failure and says how the program ends.
pub(crate) fn exit_code(result: Result<(), Failure>) -> ExitCode {
    let Err(failure) = result else { return ExitCode::SUCCESS };
    match failure.kind {
        Kind::NobodyListens => return ExitCode::SUCCESS,
        Kind::Told => return ExitCode::FAILURE,
        Kind::Failed | Kind::WrongUsage | Kind::Refused => {}
    }
    anstream::eprintln!("{ERROR}error{ERROR:#}: {}", failure.message);
    if let Some(help) = failure.help {
        anstream::eprintln!("{HELP}help{HELP:#}: {help}");
    }
    ExitCode::from(if failure.kind == Kind::WrongUsage { 2 } else { 1 })
}
