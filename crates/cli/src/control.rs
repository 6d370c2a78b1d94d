//! `tmcl run`, `stop`, `step`, `reset` and `status`: the program on a module.

use std::io::Write;
use std::path::PathBuf;

use opentmcl_lang::suggest::nearest;
use opentmcl_link::program::{Registers, State};
use opentmcl_wire::Command;
use opentmcl_wire::limits::PROGRAM_LEN;
use serde::Serialize;

use crate::connect::ConnectArgs;
use crate::failure::Failure;
use crate::print;
use crate::program::{self, Place, Program, Refusals, SourceArgs};

/// Start the program on a module
///
/// It goes on where it stands; `tmcl reset` sets it back to its beginning. Then prints its state, as
/// `tmcl status` does.
#[derive(clap::Args)]
#[command(after_help = RUN_EXAMPLES)]
pub(crate) struct RunArgs {
    /// Start here: an address, or a label of --file
    #[arg(long, value_name = "LABEL|ADDRESS")]
    at: Option<String>,
    #[command(flatten)]
    common: CommonArgs,
}

const RUN_EXAMPLES: &str = "\
Examples:
  tmcl run -c /dev/ttyACM0
  tmcl run -c /dev/ttyACM0 --at 10
  tmcl run -c /dev/ttyACM0 --at homing --file stage.tmc";

/// Stop the program on a module
///
/// It stays where it is, and `tmcl run` continues it. Axes that move go on moving: MST stops them.
/// Then prints its state, as `tmcl status` does.
#[derive(clap::Args)]
#[command(after_help = STOP_EXAMPLES)]
pub(crate) struct StopArgs {
    #[command(flatten)]
    common: CommonArgs,
}

const STOP_EXAMPLES: &str = "\
Examples:
  tmcl stop -c /dev/ttyACM0
  tmcl stop -c /dev/ttyACM0 --file stage.tmc";

/// Execute one command of the program on a module
///
/// A program that runs is stopped behind its next command. Then prints its state, as `tmcl status`
/// does.
#[derive(clap::Args)]
#[command(after_help = STEP_EXAMPLES)]
pub(crate) struct StepArgs {
    #[command(flatten)]
    common: CommonArgs,
}

const STEP_EXAMPLES: &str = "\
Examples:
  tmcl step -c /dev/ttyACM0
  tmcl step -c /dev/ttyACM0 --file stage.tmc";

/// Stop the program on a module and set it back to its beginning
///
/// Accumulator, X, flags and the subroutine stack are cleared, variables are not. Then prints its
/// state, as `tmcl status` does.
#[derive(clap::Args)]
#[command(after_help = RESET_EXAMPLES)]
pub(crate) struct ResetArgs {
    #[command(flatten)]
    common: CommonArgs,
}

const RESET_EXAMPLES: &str = "\
Examples:
  tmcl reset -c /dev/ttyACM0
  tmcl reset -c tcp:127.0.0.1:4016 --json";

/// Show the state of the program on a module
///
/// Mode, address of the command that comes next, accumulator and X. Of a running program each is of
/// its own moment. Nothing is changed.
#[derive(clap::Args)]
#[command(after_help = STATUS_EXAMPLES)]
pub(crate) struct StatusArgs {
    #[command(flatten)]
    common: CommonArgs,
}

const STATUS_EXAMPLES: &str = "\
Examples:
  tmcl status -c /dev/ttyACM0
  tmcl status -c /dev/ttyACM0 --file stage.tmc
  tmcl status -c tcp:127.0.0.1:4016 --json";

/// What all of them are told.
#[derive(clap::Args)]
struct CommonArgs {
    #[command(flatten)]
    connect: ConnectArgs,
    /// The program that is on the module, to show lines of it
    #[arg(short, long, value_name = "FILE")]
    file: Option<PathBuf>,
    #[command(flatten)]
    source: SourceArgs,
    /// Print the state as one JSON object
    #[arg(long)]
    json: bool,
}

/// What is done before the state is shown.
#[derive(Clone, Copy)]
enum Action<'a> {
    Run { at: Option<&'a str> },
    Stop,
    Step,
    Reset,
    Nothing,
}

/// Starts the program.
pub(crate) fn run(args: &RunArgs) -> Result<(), Failure> {
    act(&args.common, Action::Run { at: args.at.as_deref() })
}

/// Stops the program.
pub(crate) fn stop(args: &StopArgs) -> Result<(), Failure> {
    act(&args.common, Action::Stop)
}

/// Executes one command of the program.
pub(crate) fn step(args: &StepArgs) -> Result<(), Failure> {
    act(&args.common, Action::Step)
}

/// Resets the program.
pub(crate) fn reset(args: &ResetArgs) -> Result<(), Failure> {
    act(&args.common, Action::Reset)
}

/// Shows the state of the program.
pub(crate) fn status(args: &StatusArgs) -> Result<(), Failure> {
    act(&args.common, Action::Nothing)
}

fn act(args: &CommonArgs, action: Action<'_>) -> Result<(), Failure> {
    let program = args.file.as_deref();
    let program =
        program.map(|file| program::load(file, &args.source, None, Refusals::Tell)).transpose()?;
    let at = match action {
        Action::Run { at: Some(at) } => Some(address(at, program.as_ref())?),
        _ => None,
    };
    let mut connection = args.connect.open()?;
    let mut programmer = args.connect.programmer(connection.as_mut())?;
    match action {
        Action::Run { .. } => programmer.run(at)?,
        Action::Stop => programmer.stop()?,
        Action::Step => programmer.step()?,
        Action::Reset => programmer.reset()?,
        Action::Nothing => {}
    }
    let state = programmer.state()?;
    let command = programmer.command_at(state.address)?;
    let view = View { state, command, registers: programmer.registers()?, program };
    let mut out = anstream::stdout().lock();
    if args.json {
        print::json_line(&mut out, &view.json())?;
    } else {
        view.print(&mut out)?;
    }
    Ok(())
}

/// The address that a user means.
fn address(text: &str, program: Option<&Program>) -> Result<u16, Failure> {
    if let Ok(number) = text.parse::<i64>() {
        let address = u16::try_from(number).ok();
        return address.filter(|address| usize::from(*address) < PROGRAM_LEN).ok_or_else(|| {
            Failure::usage(format!("address {number} is outside of the memory"))
                .help(format!("it holds addresses 0 to {}", PROGRAM_LEN - 1))
        });
    }
    let Some(program) = program else {
        return Err(Failure::usage(format!("{text:?} is not an address"))
            .help("name the program that has this label with --file"));
    };
    program.label(text).ok_or_else(|| {
        let failure = Failure::usage(format!("the program has no label {text:?}"));
        let names: Vec<_> = program.labels().map(|(name, _)| name).collect();
        match nearest(text, names.iter().copied()) {
            Some(near) => failure.help(format!("did you mean {near}?")),
            None if names.is_empty() => failure.help("it has no labels; write an address"),
            None => failure.help(format!("it has {}", names.join(", "))),
        }
    })
}

/// What is shown of a program.
struct View {
    state: State,
    /// The command that comes next, unless the module has none there or does not tell it.
    command: Option<Command>,
    registers: Registers,
    program: Option<Program>,
}

#[derive(Serialize)]
struct Json<'a> {
    mode: String,
    waiting: bool,
    address: u16,
    command: Option<String>,
    file: Option<&'a str>,
    line: Option<u32>,
    accumulator: Option<i32>,
    x: Option<i32>,
}

impl View {
    /// Where the command comes from, unless the module has another one there than the program.
    fn place(&self) -> Option<Place<'_>> {
        if self.is_other_program() {
            None
        } else {
            self.program.as_ref()?.place(self.state.address)
        }
    }

    fn is_other_program(&self) -> bool {
        let Some(program) = &self.program else { return false };
        let expected = program.commands.get(usize::from(self.state.address)).copied();
        self.command.is_some() && expected != self.command
    }

    fn json(&self) -> Json<'_> {
        let place = self.place();
        Json {
            mode: self.state.mode.to_string(),
            waiting: self.state.waiting,
            address: self.state.address,
            command: self.command.map(|command| command.to_string()),
            file: place.as_ref().map(|place| place.file),
            line: place.as_ref().map(|place| place.line),
            accumulator: self.registers.accumulator,
            x: self.registers.x,
        }
    }

    fn print(&self, out: &mut impl Write) -> std::io::Result<()> {
        let State { mode, waiting, address } = self.state;
        let waiting = if waiting { ", in a WAIT" } else { "" };
        writeln!(out, "{mode} at address {address}{waiting}")?;
        match self.command {
            Some(command) => writeln!(out, "  command      {command}")?,
            None => writeln!(out, "  command      none: end of the program")?,
        }
        if self.is_other_program() {
            writeln!(out, "  source       not this file: it has another command here")?;
        } else if let Some(Place { file, line, text }) = self.place() {
            writeln!(out, "  source       {file}:{line}: {text}")?;
        }
        let register = |value: Option<i32>| {
            value.map_or("not available".to_owned(), |value| value.to_string())
        };
        writeln!(out, "  accumulator  {}", register(self.registers.accumulator))?;
        writeln!(out, "  X            {}", register(self.registers.x))
    }
}
