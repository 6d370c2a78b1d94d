//! The program `tmcl`: one file per subcommand, each as thin as it can be.

mod asm;
mod conform;
mod diagnostics;
mod exec;
mod failure;
mod local;
mod lookup;
mod modules;
mod program;
mod program_files;
mod serve;
mod sources;
mod test_programs;
mod virtual_target;

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
  tmcl exec -c virtual:tmcm-6214 'GAP 5, 0'     one command, one reply
  tmcl modules tmcm-6214                        everything that the module has";

#[derive(Subcommand)]
enum Command {
    Modules(modules::Args),
    Serve(serve::Args),
    Exec(exec::Args),
    Asm(asm::Args),
    Test(test_programs::Args),
    Conform(conform::Args),
}

fn main() -> ExitCode {
    match Cli::parse().command {
        Command::Modules(args) => failure::exit_code(modules::run(&args)),
        Command::Serve(args) => failure::exit_code(serve::run(&args)),
        Command::Exec(args) => failure::exit_code(exec::run(&args)),
        Command::Asm(args) => failure::exit_code(asm::run(&args)),
        Command::Test(args) => failure::exit_code(test_programs::run(&args)),
        Command::Conform(args) => conform::run(args),
    }
}
