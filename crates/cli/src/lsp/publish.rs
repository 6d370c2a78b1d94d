//! Telling the editor what is wrong in which file.

use std::collections::BTreeMap;
use std::io::Write;

use lsp_types::notification::PublishDiagnostics;
use lsp_types::{
    self as protocol, DiagnosticRelatedInformation, DiagnosticSeverity, DiagnosticTag,
    NumberOrString, PublishDiagnosticsParams, Uri,
};
use opentmcl_lang::span::ColumnUnit;
use opentmcl_lang::{Code, Diagnostic, Severity};

use super::convert::Files;
use super::server::Server;
use super::workspace::Workspace;
use crate::failure::Failure;

/// What the editor has been told, by file; nothing of files in which nothing is wrong.
pub(super) type Published = BTreeMap<String, Told>;

/// What the editor has been told of one file.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Told {
    uri: Uri,
    version: Option<i32>,
    findings: Vec<protocol::Diagnostic>,
}

impl<W: Write> Server<W> {
    /// Tells of every file in which something has changed for better or worse.
    pub(super) fn publish(&mut self) -> Result<(), Failure> {
        let now = everything(&mut self.workspace, self.unit);
        let before = std::mem::replace(&mut self.published, now.clone());
        for (name, told) in &before {
            if !now.contains_key(name) {
                self.tell(Told { version: None, findings: Vec::new(), ..told.clone() });
            }
        }
        for (name, told) in now {
            if before.get(&name) != Some(&told) {
                self.tell(told);
            }
        }
        self.flush()
    }

    fn tell(&mut self, told: Told) {
        let Told { uri, version, findings: diagnostics } = told;
        self.notify::<PublishDiagnostics>(PublishDiagnosticsParams { uri, diagnostics, version });
    }
}

/// What is wrong in all files.
fn everything(workspace: &mut Workspace, unit: ColumnUnit) -> Published {
    workspace.assemble();
    let mut files: Published = BTreeMap::new();
    // Of open files it is worth knowing that nothing is wrong in this version.
    for (name, document) in workspace.documents() {
        let (uri, version) = (document.uri.clone(), Some(document.version));
        files.insert(name.to_owned(), Told { uri, version, findings: Vec::new() });
    }
    for program in workspace.programs() {
        let places = Files::new(program, workspace, unit);
        for finding in &program.findings {
            let file = program.assembly.file(finding.location.file);
            let Some(uri) = workspace.uri(file) else { continue };
            let Some(finding) = diagnostic(&places, finding) else { continue };
            let new = || Told { uri, version: None, findings: Vec::new() };
            let told = files.entry(file.name.clone()).or_insert_with(new);
            // Two programs, or one that includes it twice, find the same in a file.
            if !told.findings.contains(&finding) {
                told.findings.push(finding);
            }
        }
    }
    files
}

/// A finding as the protocol wants it; none in a file that the editor cannot open.
pub(super) fn diagnostic(files: &Files<'_>, finding: &Diagnostic) -> Option<protocol::Diagnostic> {
    let range = files.location(finding.location)?.range;
    let related = finding.related.as_ref().and_then(|(place, message)| {
        let location = files.location(*place)?;
        Some(vec![DiagnosticRelatedInformation { location, message: message.clone() }])
    });
    let message = match &finding.help {
        Some(help) => format!("{}\nhelp: {help}", finding.message),
        None => finding.message.clone(),
    };
    Some(protocol::Diagnostic {
        range,
        severity: Some(severity(finding.severity())),
        code: Some(NumberOrString::String(finding.code.name().into())),
        source: Some("tmcl".into()),
        message,
        related_information: related,
        // Editors show it paler.
        tags: (finding.code == Code::UnreachableCode).then(|| vec![DiagnosticTag::UNNECESSARY]),
        ..Default::default()
    })
}

const fn severity(severity: Severity) -> DiagnosticSeverity {
    match severity {
        Severity::Error => DiagnosticSeverity::ERROR,
        Severity::Warning => DiagnosticSeverity::WARNING,
        Severity::Hint => DiagnosticSeverity::HINT,
    }
}
