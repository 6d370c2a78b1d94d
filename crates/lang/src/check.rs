//! What is wrong or doubtful in a program that can be assembled.
//!
//! - `comments`: what comments tell the tools.
//! - `module` and what it calls: each command against what a module has.
//! - `flow`: where the program goes.

mod comments;
mod findings;
mod flow;
mod module;
mod subject;

use opentmcl_catalog::Module;

use crate::assembly::Assembly;
use crate::diagnostic::{Diagnostic, Location};

use findings::Findings;

/// All findings of a program: the assembler's, those that need no module, and those that need one;
/// without those that comments in the files silence; in the order of files and lines.
///
/// What the assembler could not understand is not looked at again, and where a program goes only if it
/// is complete.
///
/// ```
/// use opentmcl_lang::{Options, assemble, check, include::BuiltInOnly};
///
/// let text = "// module: tmcm-6214\nUF0\nUF1 // tmcl-allow: command-not-available";
/// let assembly = assemble("main.tmc", text, &mut BuiltInOnly, Options::default());
/// let (name, _) = check::declared_module(&assembly).unwrap();
/// let findings = check::findings(&assembly, opentmcl_catalog::find(name));
/// let messages: Vec<_> = findings.iter().map(|finding| finding.message.as_str()).collect();
/// assert_eq!(messages, ["the TMCM-6214 refuses UF0"]);
/// ```
pub fn findings(assembly: &Assembly, module: Option<&'static Module>) -> Vec<Diagnostic> {
    let mut findings = Findings::new(assembly);
    for diagnostic in &assembly.diagnostics {
        findings.repeat(diagnostic);
    }
    comments::check(assembly, &mut findings);
    if let Some(module) = module {
        module::check(module, assembly, &mut findings);
    }
    flow::check(assembly, &mut findings);
    findings.finish()
}

/// The module that a comment of the main file names, as it is written there: `// module: tmcm-6214`.
/// There need not be such a module.
pub fn declared_module(assembly: &Assembly) -> Option<(&str, Location)> {
    comments::declared_module(assembly)
}
