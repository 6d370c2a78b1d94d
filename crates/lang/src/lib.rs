//! TMCL as a language: text in, values out.
//!
//! Nothing here reads a file, prints or fails: every text has a tree, every tree an assembly, and
//! what is wrong is a list of values ([`Diagnostic`]). Whoever has files, a terminal or an editor
//! brings them along.
//!
//! - [`encoding`], [`span`]: bytes to text; places in a text.
//! - [`token`], [`tree`]: text to a lossless [`tree::Tree`].
//! - [`assemble()`]: trees and included files to an [`Assembly`].
//! - [`check`]: what is doubtful in an assembly, and what a module would refuse.
//! - [`mod@include`], [`builtin`]: where included files come from.
//! - [`binary`], [`listing()`], [`symbols()`]: what is made of an assembly; [`disassemble()`]: the way
//!   back.
//! - [`format()`]: the one canonical layout of a text.
//! - [`service`]: what an editor asks; [`suggest`]: what was probably meant.
//!
//! ```
//! use opentmcl_lang::{Options, assemble, include::BuiltInOnly};
//!
//! let text = "Speed = 2 * 25600\nLoop: ROR 0, Speed\n  JA loop // for ever";
//! let assembly = assemble("spin.tmc", text, &mut BuiltInOnly, Options::default());
//! assert!(assembly.is_valid());
//! let commands: Vec<String> = assembly.commands().map(|command| command.to_string()).collect();
//! assert_eq!(commands, ["ROR 0, 51200", "JA 0", "STOP"]);
//! ```
#![forbid(unsafe_code)]

mod assemble;
mod assembly;
pub mod binary;
pub mod builtin;
pub mod check;
mod constants;
pub mod diagnostic;
mod disassemble;
mod encode;
pub mod encoding;
pub mod expression;
mod format;
pub mod include;
mod listing;
pub mod mnemonic;
mod names;
mod number;
mod parse;
pub mod service;
pub mod span;
pub mod suggest;
mod symbols;
pub mod token;
pub mod tree;

pub use assemble::{Options, assemble};
pub use assembly::{Assembly, ConstantValue, File, Instruction, Label, Place};
pub use diagnostic::{Code, Diagnostic, FileId, Fix, Location, Severity};
pub use disassemble::{Disassembly, disassemble};
pub use format::format;
pub use listing::listing;
pub use parse::MAX_TEXT;
pub use symbols::symbols;
