//! Any text as a scenario, and any lines to its modules: no panic, places of mistakes lie within the text,
//! what is written of an action reads the same, and every answer is one line of JSON.
//!
//! Input: a scenario, then, behind a line `---`, lines of the protocol.
#![no_main]

use libfuzzer_sys::fuzz_target;
use opentmcl_virtual::{Action, Lab, Scenario, Subscription};
use opentmcl_wire::Duration;

/// Time that passes between two lines.
const STEP: Duration = Duration::from_millis(5);
/// How many lines are looked at.
const LINES: usize = 32;

fuzz_target!(|text: &str| {
    let (text, lines) = text.split_once("\n---\n").unwrap_or((text, text));
    let scenario = match Scenario::parse("fuzz.toml", text) {
        Ok(scenario) => scenario,
        Err(mistakes) => {
            assert!(!mistakes.0.is_empty());
            for mistake in &mistakes.0 {
                assert!(mistake.line >= 1 && mistake.line <= text.split('\n').count());
                assert!(mistake.column >= 1 && mistake.column <= text.chars().count() + 1);
                assert!(!mistake.message.contains('\n'), "{mistake}");
            }
            Scenario::of_model(opentmcl_catalog::find("tmcm-6214").unwrap())
        }
    };
    let mut lab = Lab::new(scenario);
    let mut snapshot = lab.snapshot(Subscription::Rate(1000));
    for line in lines.lines().take(LINES) {
        if let Ok(action) = line.parse::<Action>() {
            let printed = action.to_string();
            assert_eq!(printed.parse(), Ok(action), "{line:?} prints as {printed:?}");
        }
        let answer = lab.line(line).json;
        assert!(answer.starts_with('{') && !answer.contains('\n'), "{answer}");
        let now = lab.now() + STEP;
        lab.advance_to(now);
        if let Some(changes) = lab.changes_since(&mut snapshot) {
            assert!(changes.starts_with('{') && !changes.contains('\n'), "{changes}");
        }
    }
});
