//! Coverage in the format of lcov's tracefiles, which genhtml, editors and services read.

use std::fmt::Write;

use super::coverage::{Coverage, FileCoverage};

/// The tracefile.
pub(super) fn text(coverage: &Coverage) -> String {
    let mut text = String::new();
    for file in &coverage.files {
        record(&mut text, file);
    }
    text
}

fn record(text: &mut String, file: &FileCoverage) {
    // Writing to a string does not fail.
    let _ = writeln!(text, "TN:\nSF:{}", file.name);
    for (line, (name, _)) in &file.routines {
        let _ = writeln!(text, "FN:{line},{name}");
    }
    for (name, entered) in file.routines.values() {
        let _ = writeln!(text, "FNDA:{entered},{name}");
    }
    let entered = file.routines.values().filter(|(_, entered)| *entered > 0).count();
    let _ = writeln!(text, "FNF:{}\nFNH:{entered}", file.routines.len());
    for (line, count) in &file.lines {
        let Some(branch) = count.branch else { continue };
        for (number, taken) in [branch.jumped, branch.passed].into_iter().enumerate() {
            // A dash says that the question was never asked.
            let taken = if count.executed == 0 { "-".to_owned() } else { taken.to_string() };
            let _ = writeln!(text, "BRDA:{line},0,{number},{taken}");
        }
    }
    let (branches, lines) = (file.branch_share(), file.line_share());
    let _ = writeln!(text, "BRF:{}\nBRH:{}", branches.found, branches.hit);
    for (line, count) in &file.lines {
        let _ = writeln!(text, "DA:{line},{}", count.executed);
    }
    let _ = writeln!(text, "LF:{}\nLH:{}\nend_of_record", lines.found, lines.hit);
}
