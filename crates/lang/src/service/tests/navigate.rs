//! Definitions and uses.

use super::fixture::Fixture;

fn definition(text: &str) -> Option<String> {
    let fixture = Fixture::new(text);
    let found = fixture.service().definition(fixture.file, fixture.offset)?;
    Some(fixture.place(found))
}

fn references(text: &str) -> Vec<String> {
    let fixture = Fixture::new(text);
    let found = fixture.service().references(fixture.file, fixture.offset).into_iter();
    found
        .map(|reference| {
            let mark = if reference.is_definition { " (defined)" } else { "" };
            format!("{}{mark}", fixture.place(reference.location))
        })
        .collect()
}

const PROGRAM: &str = "\
#include lib.inc
Start: MVP ABS, 0, Far
  CSUB Home
  JA START
//- lib.inc
FAR = 1000 // Far
Half = Far / 2
JA Start
Home: RSUB
";

/// The program with the cursor in front of the first occurrence of a text.
fn with_cursor(at: &str) -> String {
    assert!(PROGRAM.contains(at));
    PROGRAM.replacen(at, &format!("$0{at}"), 1)
}

#[test]
fn definitions_are_found_across_files_in_any_case() {
    assert_eq!(definition(&with_cursor("Far\n")).unwrap(), "lib.inc:1: FAR");
    assert_eq!(definition(&with_cursor("START")).unwrap(), "main.tmc:2: Start");
    assert_eq!(definition(&with_cursor("Home\n")).unwrap(), "lib.inc:4: Home");
    assert_eq!(definition(&with_cursor("Start\nHome")).unwrap(), "main.tmc:2: Start");
    assert_eq!(definition(&with_cursor("lib.inc")).unwrap(), "lib.inc:1: ");
    assert_eq!(definition("#include TMCLPARAM.TMC\nMST Mo$0tor1").unwrap(), {
        let text = crate::builtin::file("TMCLParam.tmc").unwrap().1;
        let line = text.lines().position(|line| line.starts_with("Motor1")).unwrap() + 1;
        format!("TMCLParam.tmc:{line}: Motor1")
    });
}

#[test]
fn what_has_no_definition_has_none() {
    for text in ["JA No$0where", "M$0VP ABS, 0, 1", "MVP A$0BS, 0, 1", "#include no$0thing", "$0"] {
        assert_eq!(definition(text), None, "{text}");
    }
}

#[test]
fn references_are_all_places_and_comments_are_none() {
    let far = ["main.tmc:2: Far", "lib.inc:1: FAR (defined)", "lib.inc:2: Far"];
    assert_eq!(references(&with_cursor("Far\n")), far);
    assert_eq!(references(&with_cursor("FAR")), far);
    let start = ["main.tmc:2: Start (defined)", "main.tmc:4: START", "lib.inc:3: Start"];
    assert_eq!(references(&with_cursor("START")), start);
    assert_eq!(references(&with_cursor("lib.inc")), ["main.tmc:1: lib.inc"]);
}

#[test]
fn a_file_that_is_included_twice_counts_once() {
    let text = "#include a.inc\n#include a.inc\nMST Ax$0is\n//- a.inc\nAxis = 1\n";
    assert_eq!(references(text), ["main.tmc:3: Axis", "a.inc:1: Axis (defined)"]);
    let text = "#include a.inc\n#include $0a.inc\n//- a.inc\nAxis = 1\n";
    assert_eq!(references(text), ["main.tmc:1: a.inc", "main.tmc:2: a.inc"]);
    assert_eq!(definition(text).unwrap(), "a.inc:1: ");
}

#[test]
fn a_label_and_a_constant_of_one_name_are_two_things() {
    let text = "X = 5\nX: MVP ABS, 0, X\nJA $0X";
    assert_eq!(references(text), ["main.tmc:2: X (defined)", "main.tmc:3: X"]);
    let text = "X = 5\nX: MVP ABS, 0, $0X\nJA X";
    assert_eq!(references(text), ["main.tmc:1: X (defined)", "main.tmc:2: X"]);
}

#[test]
fn a_keyword_is_no_use_of_a_constant_of_its_name() {
    let text = "A$0BS = 5\nMVP ABS, 0, ABS\n";
    let found = references(text);
    assert_eq!(found, ["main.tmc:1: ABS (defined)", "main.tmc:2: ABS"]);
    let fixture = Fixture::new("ABS = 5\nMVP ABS, 0, A$0BS\n");
    let found = fixture.service().references(fixture.file, fixture.offset);
    // Columns 12 to 15 of the second line, which begins at 8: the last operand.
    assert_eq!(found[1].location.span, crate::span::Span::new(20, 23));
}

#[test]
fn highlights_stay_within_the_file() {
    let fixture = Fixture::new(&with_cursor("Far\n"));
    let found = fixture.service().highlights(fixture.file, fixture.offset);
    let places: Vec<_> = found.iter().map(|it| fixture.place(it.location)).collect();
    assert_eq!(places, ["main.tmc:2: Far"]);
    assert!(!found[0].is_definition);
}

#[test]
fn a_cursor_behind_a_name_is_at_the_name() {
    assert_eq!(definition("X: JA X$0").unwrap(), "main.tmc:1: X");
    assert_eq!(definition("X = 1\nMVP ABS, X$0, 1").unwrap(), "main.tmc:1: X");
}

#[test]
fn a_long_row_of_operators_is_walked_in_no_time() {
    let row = "X + ".repeat(50_000);
    let fixture = Fixture::new(&format!("X$0 = 1\nY = {row}1"));
    let start = std::time::Instant::now();
    let found = fixture.service().references(fixture.file, fixture.offset);
    assert_eq!(found.len(), 50_001);
    assert!(start.elapsed().as_secs() < 5);
}
