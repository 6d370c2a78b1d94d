//! The manual's own programs.

use std::fs;
use std::path::Path;

use opentmcl_lang::include::BuiltInOnly;
use opentmcl_lang::{Options, assemble, check};

use crate::tmcm_6214;

/// Fragments in which something is missing that the checks miss rightly.
const FRAGMENTS: &[(&str, &str)] = &[
    // Its last line, the handler, has been added behind commands that do not end.
    ("tmcm-6214-3.5.6.4-interrupt-names.tmc", "falls-into-handler"),
    // Shows VECT only; there is no EI.
    ("tmcm-6214-3.6.32-interrupt-vector.tmc", "interrupt-not-enabled"),
];

#[test]
fn the_programs_of_the_manuals_are_without_blame() {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/manual");
    let mut found = Vec::new();
    let mut count = 0;
    for folder in [folder.join("programs"), folder.join("binaries")] {
        for entry in fs::read_dir(folder).unwrap() {
            let path = entry.unwrap().path();
            let name = path.file_name().unwrap().to_str().unwrap().to_owned();
            if !name.ends_with(".tmc") {
                continue;
            }
            count += 1;
            let text = fs::read_to_string(&path).unwrap();
            let assembly = assemble(&name, text, &mut BuiltInOnly, Options::default());
            // The other manuals are those of other modules.
            let module = name.starts_with("tmcm-6214").then(tmcm_6214);
            let findings = check::findings(&assembly, module);
            found.extend(findings.iter().map(|finding| (name.clone(), finding.code.name())));
        }
    }
    found.sort();
    let found: Vec<_> = found.iter().map(|(name, code)| (name.as_str(), *code)).collect();
    assert_eq!(found, FRAGMENTS);
    assert_eq!(count, 28);
}
