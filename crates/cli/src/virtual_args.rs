//! How a virtual module is to be, as several subcommands are told.

use opentmcl_virtual::Options;

/// Options of every subcommand that switches a virtual module on.
#[derive(clap::Args)]
pub(crate) struct VirtualArgs {
    /// Commands that a program on the module executes per second, 1..1000000
    #[arg(
        long,
        value_name = "N",
        default_value_t = Options::default().program_rate,
        value_parser = clap::value_parser!(u32).range(1..=1_000_000)
    )]
    program_rate: u32,
}

impl VirtualArgs {
    pub(crate) fn options(&self) -> Options {
        Options { program_rate: self.program_rate }
    }
}
