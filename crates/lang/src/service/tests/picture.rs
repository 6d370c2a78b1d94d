//! What a file looks like in an editor: outline, colours, hints.

use super::fixture::Fixture;
use crate::service::{HintKind, SymbolKind, TokenClass};
use crate::span::Span;

fn everything(fixture: &Fixture) -> Span {
    Span::new(0, fixture.assembly.file(fixture.file).tree.text().len() as u32)
}

#[test]
fn the_outline_has_labels_constants_and_includes() {
    let text = "\
#include a.inc
Speed = 51200 / 2
Init: MST 0
  MST 1
Loop:
Again: ROR 0, Speed
  JA Loop
//- a.inc
";
    let fixture = Fixture::new(text);
    let tree = &fixture.assembly.file(fixture.file).tree;
    let symbols = fixture.service().symbols(fixture.file);
    let seen: Vec<_> = symbols
        .iter()
        .map(|it| (it.kind, it.name.as_str(), it.detail.as_deref(), it.extent.of(tree.text())))
        .collect();
    assert_eq!(
        seen,
        [
            (SymbolKind::Include, "a.inc", None, "#include a.inc"),
            (SymbolKind::Constant, "Speed", Some("25600"), "Speed = 51200 / 2"),
            (SymbolKind::Label, "Init", Some("address 0"), "Init: MST 0\n  MST 1"),
            (SymbolKind::Label, "Loop", Some("address 2"), "Loop:"),
            (SymbolKind::Label, "Again", Some("address 2"), "Again: ROR 0, Speed\n  JA Loop"),
        ]
    );
    assert!(symbols.iter().all(|it| it.span.of(tree.text()) == it.name));
}

#[test]
fn every_token_has_the_colour_of_what_it_means() {
    use TokenClass::*;
    let text = "\
#include Interrupts.inc
Far = 2*SQRT(100) // note
L: MVP ABS, 0, Far
  JA L
  200 1, 2, 3
  XYZ abs, Nobody
";
    let fixture = Fixture::new(text);
    let service = fixture.service();
    let seen: Vec<_> = service
        .semantic_tokens(fixture.file)
        .into_iter()
        .map(|it| (it.class, it.span.of(text), it.is_definition))
        .filter(|(class, ..)| *class != Operator)
        .collect();
    let used = |class, text| (class, text, false);
    assert_eq!(
        seen,
        [
            used(Keyword, "#include"),
            used(FileName, "Interrupts.inc"),
            (Constant, "Far", true),
            used(Number, "2"),
            used(Function, "SQRT"),
            used(Number, "100"),
            used(Comment, "// note"),
            (Label, "L", true),
            used(Mnemonic, "MVP"),
            used(Keyword, "ABS"),
            used(Number, "0"),
            used(Constant, "Far"),
            used(Mnemonic, "JA"),
            used(Label, "L"),
            used(Mnemonic, "200"),
            used(Number, "1"),
            used(Number, "2"),
            used(Number, "3"),
        ]
    );
    let all = service.semantic_tokens(fixture.file);
    assert!(all.windows(2).all(|pair| pair[0].span.end <= pair[1].span.start));
    // 1 colon, 1 equals sign, * ( ), and 2 + 2 + 1 commas.
    assert_eq!(all.iter().filter(|it| it.class == Operator).count(), 10);
}

#[test]
fn hints_name_numbers_and_tell_addresses() {
    let text = "\
#include TMCLParam.tmc
MST 0
Loop : SAP 4, 0, 500
  SAP APMaxPositioningSpeed, 0, 4
  GGP 66, 0
  SGP 66, 9, 1
  CALCV ADD, 1 + 1, 5
";
    let fixture = Fixture::new(text);
    let hints = fixture.service().hints(fixture.file, everything(&fixture));
    let mut shown = text.to_owned();
    for hint in hints.iter().rev() {
        let mark = if hint.kind == HintKind::Name { ("<", "> ") } else { ("<", ">") };
        shown.insert_str(hint.offset as usize, &format!("{}{}{}", mark.0, hint.text, mark.1));
    }
    let expected = "\
#include TMCLParam.tmc
MST 0
Loop :<@1> SAP <maximum positioning speed:> 4, 0, 500
  SAP APMaxPositioningSpeed, 0, 4
  GGP <serial address:> 66, 0
  SGP 66, 9, 1
  CALCV ADD, 1 + 1, 5
";
    assert_eq!(shown, expected);
}

#[test]
fn hints_are_computed_for_the_lines_that_are_asked_for() {
    let text = "A: MST 0\nB: MST 1\nC: MST 2\n";
    let fixture = Fixture::new(text);
    let hints = fixture.service().hints(fixture.file, Span::new(9, 12));
    let texts: Vec<_> = hints.iter().map(|hint| hint.text.as_str()).collect();
    assert_eq!(texts, ["@1"]);
}
