//! Findings as a SARIF 2.1.0 document, the OASIS standard that code scanning services read.

use std::io::{self, Write};

use opentmcl_lang::{Code, Severity};
use serde_json::{Value, json};

use super::place::{Finding, Region};
use crate::uri;

const SCHEMA: &str =
    "https://docs.oasis-open.org/sarif/sarif/v2.1.0/errata01/os/schemas/sarif-schema-2.1.0.json";

/// Writes the document.
pub(super) fn write(out: &mut impl Write, findings: &[Finding<'_>]) -> io::Result<()> {
    let rules: Vec<Value> = Code::ALL.iter().copied().map(rule).collect();
    let results: Vec<Value> = findings.iter().map(result).collect();
    let document = json!({
        "$schema": SCHEMA,
        "version": "2.1.0",
        "runs": [{
            "tool": {"driver": {
                "name": "tmcl",
                "version": env!("CARGO_PKG_VERSION"),
                "informationUri": env!("CARGO_PKG_REPOSITORY"),
                "rules": rules,
            }},
            "columnKind": "unicodeCodePoints",
            "results": results,
        }],
    });
    serde_json::to_writer_pretty(&mut *out, &document)?;
    writeln!(out)
}

/// What GitHub's code scanning needs of a rule is more than the standard asks for.
fn rule(code: Code) -> Value {
    json!({
        "id": code.name(),
        "shortDescription": {"text": code.name().replace('-', " ")},
        "fullDescription": {"text": code.explanation()},
        "help": {"text": code.explanation()},
        "defaultConfiguration": {"level": level(code.severity())},
    })
}

fn level(severity: Severity) -> &'static str {
    match severity {
        Severity::Error => "error",
        Severity::Warning => "warning",
        Severity::Hint => "note",
    }
}

fn result(finding: &Finding<'_>) -> Value {
    let diagnostic = finding.diagnostic;
    let text = match &diagnostic.help {
        Some(help) => format!("{}; {help}", diagnostic.message),
        None => diagnostic.message.clone(),
    };
    let mut result = json!({
        "ruleId": diagnostic.code.name(),
        "ruleIndex": Code::ALL.iter().position(|&code| code == diagnostic.code),
        "level": level(diagnostic.severity()),
        "message": {"text": text},
        "locations": [physical(&finding.region())],
    });
    if let Some((region, message)) = finding.related() {
        let mut location = physical(&region);
        location["message"] = json!({"text": message});
        result["relatedLocations"] = json!([location]);
    }
    if let Some((region, replacement)) = finding.fix() {
        result["fixes"] = json!([{
            "artifactChanges": [{
                "artifactLocation": artifact(region.file),
                "replacements": [{
                    "deletedRegion": extent(&region),
                    "insertedContent": {"text": replacement},
                }],
            }],
        }]);
    }
    result
}

fn physical(region: &Region<'_>) -> Value {
    json!({"physicalLocation": {
        "artifactLocation": artifact(region.file),
        "region": extent(region),
    }})
}

/// Lines and columns from 1, the end being the column behind the last character.
fn extent(region: &Region<'_>) -> Value {
    json!({
        "startLine": region.start.line,
        "startColumn": region.start.column,
        "endLine": region.end.line,
        "endColumn": region.end.column,
    })
}

fn artifact(file: &str) -> Value {
    json!({"uri": uri::reference(file)})
}
