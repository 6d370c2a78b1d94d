//! What can be done about findings.

use super::fixture::Fixture;
use crate::diagnostic::{Code, Diagnostic, Location};
use crate::service::Action;
use crate::span::Span;

/// The actions at the cursor, each with the text after it was taken.
fn actions(text: &str, more: Option<(Code, Span)>) -> Vec<(Action, String)> {
    let fixture = Fixture::new(text);
    let mut findings = fixture.assembly.diagnostics.clone();
    findings.extend(more.map(|(code, span)| {
        Diagnostic::new(code, Location { file: fixture.file, span }, "as a test wants it")
    }));
    let span = Span::new(fixture.offset, fixture.offset);
    let place = Location { file: fixture.file, span };
    let actions = fixture.service().actions(place, &findings);
    let after = |action: &Action| {
        let mut text = fixture.assembly.file(fixture.file).tree.text().to_owned();
        let span = action.edit.location.span;
        text.replace_range(span.start as usize..span.end as usize, &action.edit.text);
        text
    };
    actions.into_iter().map(|action| (action.clone(), after(&action))).collect()
}

#[test]
fn a_slip_is_mended() {
    let [(action, after)] = &actions("Loop: STOP\nJA Lop$0\nJA Lop", None)[..] else { panic!() };
    assert_eq!(action.title, "Replace Lop by Loop");
    assert!(action.is_fix);
    assert_eq!(after, "Loop: STOP\nJA Loop\nJA Lop");
    let [(action, after)] = &actions("MVP$0, ABS, 0, 1", None)[..] else { panic!() };
    assert_eq!((action.title.as_str(), after.as_str()), ("Remove ,", "MVP ABS, 0, 1"));
    assert_eq!(actions("Loop: STOP\nJA $0Loop\nJA Lop", None), []);
}

#[test]
fn a_warning_is_silenced_on_its_line() {
    let label = Some((Code::LabelAsNumber, Span::new(0, 3)));
    for (text, expected) in [
        ("$0MST 0\nSTOP", "MST 0 // tmcl-allow: label-as-number\nSTOP"),
        ("$0MST 0\r\nSTOP", "MST 0 // tmcl-allow: label-as-number\r\nSTOP"),
        ("$0MST 0", "MST 0 // tmcl-allow: label-as-number"),
        ("$0MST 0 // why\n", "// tmcl-allow: label-as-number\nMST 0 // why\n"),
        (
            "$0  MST 0 // see tmcl-allow: x\r\n",
            "  // tmcl-allow: label-as-number\r\n  MST 0 // see tmcl-allow: x\r\n",
        ),
        ("$0MST 0 // tmcl-allow: other-one\n", "MST 0 // tmcl-allow: other-one, label-as-number\n"),
    ] {
        let [(action, after)] = &actions(text, label)[..] else { panic!() };
        assert_eq!(action.title, "Allow label-as-number on this line");
        assert!(!action.is_fix);
        assert_eq!(after, expected);
    }
}

#[test]
fn an_error_cannot_be_silenced() {
    assert_eq!(actions("$0MST 0", Some((Code::UnknownLabel, Span::new(0, 3)))), []);
}
