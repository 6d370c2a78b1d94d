//! The program `tmcl`: one file per subcommand, each as thin as it can be.

mod asm;
mod check;
mod conform;
mod connect;
mod control;
mod diagnostics;
mod disasm;
mod download;
mod exec;
mod failure;
mod fmt;
mod local;
mod lookup;
mod lsp;
mod modules;
mod output;
mod plot;
mod print;
mod program;
mod program_files;
mod progress;
mod recording;
mod scenario;
mod serve;
mod sim;
mod sources;
mod terminal;
mod test_programs;
mod time;
mod tune;
mod upload;
mod uri;
mod virtual_args;
mod virtual_target;
mod world;

use std::process::ExitCode;

use clap::{Parser, Subcommand};

/// Virtual motion control modules and tools for TMCL, the language of Trinamic's modules.
///
/// Errors go to standard error; the exit status is 1 when something failed and 2 for wrong usage.
#[derive(Parser)]
#[command(name = "tmcl", version, arg_required_else_help = true, after_help = EXAMPLES)]
struct Cli {
    #[command(subcommand)]
    command: Command,
}

const EXAMPLES: &str = "\
Examples:
  tmcl serve tmcm-6214                          a virtual module for any TMCL client
  tmcl serve lab.toml                           modules with machines behind their axes
  tmcl world -c PATH 'press left axis 0'        what happens to such a machine
  tmcl exec -c virtual:tmcm-6214 'GAP 5, 0'     one command, one reply
  tmcl modules tmcm-6214                        everything that the module has
  tmcl check spin.tmc                           mistakes in a program
  tmcl asm spin.tmc                             a program as the file that modules take
  tmcl sim spin.tmc -m tmcm-6214                what a program does, in virtual time
  tmcl test                                     tests of programs
  tmcl tune velocity -c PORT --step 1000        how a servo answers a step";

#[derive(Subcommand)]
enum Command {
    Modules(modules::Args),
    Serve(serve::Args),
    World(world::Args),
    Exec(exec::Args),
    Asm(asm::Args),
    Disasm(disasm::Args),
    Check(check::Args),
    Fmt(fmt::Args),
    Download(download::Args),
    Upload(upload::Args),
    Run(control::RunArgs),
    Stop(control::StopArgs),
    Step(control::StepArgs),
    Reset(control::ResetArgs),
    Status(control::StatusArgs),
    Sim(sim::Args),
    Test(test_programs::Args),
    Tune(tune::Args),
    Conform(conform::Args),
    Lsp(lsp::Args),
}

fn main() -> ExitCode {
    match Cli::parse().command {
        Command::Modules(args) => failure::exit_code(modules::run(&args)),
        Command::Serve(args) => failure::exit_code(serve::run(&args)),
        Command::World(args) => failure::exit_code(world::run(&args)),
        Command::Exec(args) => failure::exit_code(exec::run(&args)),
        Command::Asm(args) => failure::exit_code(asm::run(&args)),
        Command::Disasm(args) => failure::exit_code(disasm::run(&args)),
        Command::Check(args) => failure::exit_code(check::run(&args)),
        Command::Fmt(args) => failure::exit_code(fmt::run(&args)),
        Command::Download(args) => failure::exit_code(download::run(&args)),
        Command::Upload(args) => failure::exit_code(upload::run(&args)),
        Command::Run(args) => failure::exit_code(control::run(&args)),
        Command::Stop(args) => failure::exit_code(control::stop(&args)),
        Command::Step(args) => failure::exit_code(control::step(&args)),
        Command::Reset(args) => failure::exit_code(control::reset(&args)),
        Command::Status(args) => failure::exit_code(control::status(&args)),
        Command::Sim(args) => failure::exit_code(sim::run(&args)),
        Command::Test(args) => failure::exit_code(test_programs::run(&args)),
        Command::Tune(args) => failure::exit_code(tune::run(&args)),
        Command::Conform(args) => conform::run(args),
        Command::Lsp(args) => lsp::run(args),
    }
}
