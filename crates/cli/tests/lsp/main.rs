//! `tmcl lsp` as an editor sees it: real messages over real pipes.
#![expect(clippy::unwrap_used, reason = "the panic of a test is its report")]

mod client;
mod columns;
mod features;
mod findings;
mod protocol;
mod settings;
