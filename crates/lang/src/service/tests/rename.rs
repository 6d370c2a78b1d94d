//! Other names.

use super::fixture::Fixture;
use crate::service::RenameError;

/// All files after a renaming, one behind the other.
fn renamed(text: &str, new: &str) -> Result<String, RenameError> {
    let fixture = Fixture::new(text);
    let mut edits = fixture.service().rename(fixture.file, fixture.offset, new)?;
    edits.sort_by_key(|edit| std::cmp::Reverse(edit.location));
    let mut texts: Vec<String> =
        fixture.assembly.files.iter().map(|file| file.tree.text().to_owned()).collect();
    for edit in edits {
        let span = edit.location.span;
        let file = &mut texts[usize::from(edit.location.file.0)];
        file.replace_range(span.start as usize..span.end as usize, &edit.text);
    }
    Ok(texts.concat())
}

#[track_caller]
fn refused(text: &str, new: &str, part: &str) {
    let message = renamed(text, new).expect_err("it is renamed").to_string();
    assert!(message.contains(part), "{message}");
}

#[test]
fn all_places_in_all_files_get_the_new_name() {
    let text = "#include a.inc\nLoop: ROR 0, Sp$0eed\nJA Loop\n//- a.inc\nSPEED = 5 // Speed\n";
    let expected = "#include a.inc\nLoop: ROR 0, Fast\nJA Loop\nFast = 5 // Speed\n";
    assert_eq!(renamed(text, "Fast").unwrap(), expected);
    assert_eq!(renamed("Lo$0op: JA loop", "Again").unwrap(), "Again: JA Again");
}

#[test]
fn the_case_of_a_name_can_be_changed() {
    assert_eq!(renamed("loop: JA lo$0op", "Loop").unwrap(), "Loop: JA Loop");
}

#[test]
fn a_name_that_cannot_be_written_is_refused() {
    for new in ["", "1st", "two words", "a-b", "a:", " a", "a\n", "//"] {
        refused("L$0: STOP", new, "is not a name");
    }
    assert!(renamed("L$0: STOP", "Zähler_1").is_ok());
}

#[test]
fn a_name_that_is_taken_is_refused() {
    refused("A$0: STOP\nB: STOP", "b", "there is a b already");
    refused("A$0: STOP\nB = 5", "b", "there is a b already");
    refused("A$0 = 1\nB: STOP", "B", "there is a B already");
    refused("A$0 = 1", "abs", "word of the language");
    assert!(renamed("A$0: STOP", "Start").is_ok());
}

#[test]
fn what_is_no_name_of_the_author_is_refused() {
    refused("M$0VP ABS, 0, 1", "X", "only labels and constants");
    refused("MVP A$0BS, 0, 1", "X", "only labels and constants");
    refused("#include Interrupts.i$0nc", "X", "only labels and constants");
    refused("JA No$0where", "X", "not defined");
    refused("#include Interrupts.inc\nEI TI_TIMER$00", "X", "comes with the tools");
}

#[test]
fn what_will_be_renamed_is_shown_beforehand() {
    let fixture = Fixture::new("Loop: JA lo$0op");
    let (span, name) = fixture.service().prepare_rename(fixture.file, fixture.offset).unwrap();
    assert_eq!((span.start, span.end, name), (9, 13, "loop"));
}
