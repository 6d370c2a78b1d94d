//! The canonical layout.

use opentmcl_lang::token::TokenKind;
use opentmcl_lang::tree::{TokenId, Tree};
use opentmcl_lang::{MAX_TEXT, format};
use proptest::prelude::*;

use super::{assembled, programs_of_the_manuals};

#[track_caller]
fn formats(text: &str, expected: &str) {
    let found = format(&Tree::parse(text));
    assert_eq!(found, expected, "of {text:?}");
    assert_eq!(format(&Tree::parse(&*found)), expected, "formatted again");
}

#[test]
fn a_program_gets_the_layout_of_the_vendors_examples() {
    formats(
        "\
//Toggles an output
  #INCLUDE   TMCLParam.tmc
Period=50//in ticks
Output =  3
   sgp 0,3 , 1000      //period of the timer
 vect 0,timer
\tei  255

loop:
SIO Output,2,1
wait Ticks ,0,PERIOD //and on
  SIO Output,2,0
JA Loop

 //here is the handler
 Timer : gio 0,2 //read it
\tjc nz,Off
reti
",
        "\
//Toggles an output
#include TMCLParam.tmc
Period = 50                 //in ticks
Output = 3
    SGP 0, 3, 1000          //period of the timer
    VECT 0, timer
    EI 255

loop:
    SIO Output, 2, 1
    WAIT TICKS, 0, PERIOD   //and on
    SIO Output, 2, 0
    JA Loop

//here is the handler
Timer: GIO 0, 2             //read it
    JC NZ, Off
    RETI
",
    );
}

#[test]
fn labels_stay_with_their_command() {
    formats(
        "A:ja B\nLong_one :   JA A\n  B : C:mst 0\nD:",
        "A:  JA B\nLong_one: JA A\nB: C: MST 0\nD:\n",
    );
    formats("L: x=1\nM: #include a.inc\n", "L:  x = 1\nM:  #include a.inc\n");
}

#[test]
fn operators_have_room() {
    formats(
        "a=-( 1+b)*2 ^ -3/SQRT (c- -4)-1\nSAP 4,0,+speed-1\nCOMP -5\n200 -0,1+1,$ff\ncomp(5)\n",
        "a = -(1 + b) * 2^-3 / SQRT(c - -4) - 1\n    SAP 4, 0, +speed - 1\n    COMP -5\n    \
         200 -0, 1 + 1, $ff\n    COMP (5)\n",
    );
}

#[test]
fn words_of_the_language_are_upper_case_and_names_are_left_alone() {
    // POS is the word of WAIT, and a constant everywhere else; ticks is a word of no operand of SAP.
    formats(
        "wait pos,pos,ticks\nsap pos,0,sin(rad(pos))\njc ze,ze\nmvp 1+abs,0,0\nGoHome abs\n",
        "    WAIT POS, pos, ticks\n    SAP pos, 0, SIN(RAD(pos))\n    JC ZE, ze\n    \
         MVP 1 + abs, 0, 0\n    GoHome abs\n",
    );
}

#[test]
fn comments_move_together_when_code_is_in_the_way() {
    formats(
        "SAP APMaxPositioningSpeed, 0, Speed//a
MST 0 //b
MST 1
MST 2 ;c
//d
MST 3 //e
",
        "    SAP APMaxPositioningSpeed, 0, Speed  //a
    MST 0                                //b
    MST 1
    MST 2                                ;c
//d
    MST 3                   //e
"
        .replace("//d", "    //d")
        .as_str(),
    );
}

#[test]
fn code_that_is_very_wide_moves_only_its_own_comment() {
    // The first has 48 characters with its indent, the second 49.
    let fits = "    SAP APMaxPositioningSpeed, Motor0, 2*Speed_67";
    let wide = "    SAP APMaxPositioningSpeed, Motor0, 2*Speed_678";
    let fits = fits.replace('*', " * ");
    let wide = wide.replace('*', " * ");
    let (fits, wide) = (&fits[..48], &wide[..49]);
    formats(
        &format!("{fits}//a\nMST 0//b\n"),
        &format!("{fits}  //a\n    MST 0{}//b\n", " ".repeat(41)),
    );
    formats(
        &format!("{wide}//a\nMST 0//b\n"),
        &format!("{wide}  //a\n    MST 0{}//b\n", " ".repeat(19)),
    );
}

#[test]
fn a_comment_that_continues_the_one_above_stays_below_it() {
    formats(
        "\tSAP 4,0,1\t\t//the speed,
\t\t\t\t//in pps
    //and then
    MST 0 //now
          //and not later
",
        "    SAP 4, 0, 1             //the speed,
                            //in pps
    //and then
    MST 0                   //now
                            //and not later
",
    );
}

#[test]
fn a_comment_that_only_seems_to_continue_another_stays_where_it_belongs() {
    // It stands where commands begin.
    formats("A:  //x\n    //y\n  MST 0\n", "A:                          //x\n    //y\n    MST 0\n");
    // Another one is between them.
    formats("MST 0   //a\n//b\n        //c\n", "    MST 0                   //a\n//b\n    //c\n");
    formats(
        "MST 0   //a\nMST 1\n        //c\n",
        "    MST 0                   //a\n    MST 1\n    //c\n",
    );
    // The one above is left alone.
    formats(
        "MST 0   //a\nmst 0 0 //b\n        //c\n",
        "    MST 0                   //a\nmst 0 0 //b\n    //c\n",
    );
}

#[test]
fn a_comment_above_a_mistake_keeps_its_margin() {
    formats("A:\n//x\nsap 4 0, 1\nMST 0\n", "A:\n//x\nsap 4 0, 1\n    MST 0\n");
}

#[test]
fn a_letter_is_one_column_wide_in_any_language() {
    formats("Ä:mst 0//x\n", "Ä:  MST 0                   //x\n");
}

#[test]
fn a_comment_goes_with_the_code_below_it() {
    formats("a=1\n//start\nMST 0\n", "a = 1\n    //start\n    MST 0\n");
    formats("a=1\n\n//start\n//here\nMST 0\n", "a = 1\n\n    //start\n    //here\n    MST 0\n");
    formats("  //start\n  //here\n  Go: MST 0\n", "//start\n//here\nGo: MST 0\n");
    formats("\t//start\n        MST 0\n", "    //start\n    MST 0\n");
    // Elsewhere it keeps its margin.
    formats("a=1\n\n//title\n\nMST 0\n", "a = 1\n\n//title\n\n    MST 0\n");
    formats("A:\n//SAP 4, 0, 1\n  MST 0\n", "A:\n//SAP 4, 0, 1\n    MST 0\n");
    formats("  MST 0\n      //aside\n  MST 1\n", "    MST 0\n    //aside\n    MST 1\n");
}

#[test]
fn the_title_of_a_file_stays_at_the_margin() {
    formats(
        "\n//Blinks\n;fast\nMST 0\n//x\nMST 1\n",
        "//Blinks\n;fast\n    MST 0\n    //x\n    MST 1\n",
    );
    formats("  //Blinks\n  MST 0\n", "    //Blinks\n    MST 0\n");
}

#[test]
fn the_text_of_a_comment_stays() {
    formats(
        "//  \ta ,b:  C  \n\nMST 0;x\t\n",
        "//  \ta ,b:  C\n\n    MST 0                   ;x\n",
    );
    formats("// müde\u{A0}\n", "// müde\n");
}

#[test]
fn two_blank_lines_are_enough() {
    formats(
        "\n \nMST 0\n\n\n\t\n\nMST 1\n\nMST 2\n\n\n",
        "    MST 0\n\n\n    MST 1\n\n    MST 2\n",
    );
    formats("\n\n", "");
    formats("", "");
}

#[test]
fn lines_end_as_most_of_them_do() {
    formats(
        "MST 0\r\nMST 1\nMST 2\r\nMST 3",
        "    MST 0\r\n    MST 1\r\n    MST 2\r\n    MST 3\r\n",
    );
    formats("MST 0\r\nMST 1\nMST 2\n", "    MST 0\n    MST 1\n    MST 2\n");
    formats("MST 0\rMST 1\r\rMST 2\n", "    MST 0\r    MST 1\r\r    MST 2\r");
    formats("MST 0\r\nMST 1\n", "    MST 0\n    MST 1\n");
    formats("MST 0", "    MST 0\n");
}

#[test]
fn the_end_mark_of_dos_goes() {
    formats("MST 0\r\n\u{1A}", "    MST 0\r\n");
    formats("MST 0 //x\u{1A}", "    MST 0                   //x\n");
    formats("MST 0\n//x \u{1A}\u{1A}", "    MST 0\n//x\n");
}

#[test]
fn a_line_with_a_mistake_stays_as_it_is() {
    formats(
        "mst   0\n  sap 4 0,  1 //comma \n  /* not  a comment */\nA  B: mst 1\n'x\nmst 2,  \nx=\n",
        "    MST 0\n  sap 4 0,  1 //comma \n  /* not  a comment */\nA  B: mst 1\n'x\nmst 2,  \nx=\n",
    );
    // What only the assembler finds out is no reason: the layout is clear.
    formats("Nope  a,b\n#define  X 1\nmst\n", "    Nope a, b\n#define X 1\n    MST\n");
}

#[test]
fn a_text_full_of_mistakes_stays_as_it_is() {
    let text = format!("{}  mst  0 \n\n\n\n", "  mst 0 0\n".repeat(1000));
    formats(&text, &text);
    let almost = "  mst 0 0\n".repeat(999);
    formats(&format!("{almost}mst 1"), &format!("{almost}    MST 1\n"));
}

#[test]
fn of_a_text_that_is_too_long_nothing_is_given() {
    let tree = Tree::parse(" ".repeat(MAX_TEXT + 1));
    assert_eq!(format(&tree), "");
}

/// All tokens that show something, comments without the blanks at their ends.
fn tokens(tree: &Tree) -> Vec<(TokenKind, String)> {
    let ids = (0..tree.tokens().len() as u32).map(TokenId);
    let shown = ids.filter(|&id| {
        !matches!(tree.kind(id), TokenKind::Blank | TokenKind::Newline | TokenKind::End)
    });
    let trim = |text: &str| {
        text.trim_end_matches(|c: char| c.is_whitespace() || "\u{1A}\u{FEFF}".contains(c))
            .to_owned()
    };
    shown.map(|id| (tree.kind(id), trim(tree.token_text(id)))).collect()
}

/// What must hold for any text whatever.
fn check(text: &str) -> Result<(), TestCaseError> {
    let before = assembled(text);
    let tree = &before.files[0].tree;
    let formatted = format(tree);
    let after = assembled(&formatted);
    let again = &after.files[0].tree;
    prop_assert_eq!(&format(again), &formatted, "not stable: {:?}", text);

    let (old, new) = (tokens(tree), tokens(again));
    prop_assert_eq!(old.len(), new.len(), "{:?}\n{:?}", text, formatted);
    for ((old_kind, old), (new_kind, new)) in old.iter().zip(&new) {
        prop_assert_eq!(old_kind, new_kind);
        if *old_kind == TokenKind::Comment {
            prop_assert_eq!(old, new);
        } else {
            prop_assert!(old.eq_ignore_ascii_case(new), "{:?} became {:?}", old, new);
        }
    }
    let commands = |assembly: &opentmcl_lang::Assembly| assembly.commands().collect::<Vec<_>>();
    prop_assert_eq!(commands(&before), commands(&after), "{:?}", formatted);
    let labels = |assembly: &opentmcl_lang::Assembly| -> Vec<_> {
        assembly.labels().map(|label| (label.name.to_owned(), label.address)).collect()
    };
    prop_assert_eq!(labels(&before), labels(&after));
    let messages = |assembly: &opentmcl_lang::Assembly| -> Vec<_> {
        assembly.diagnostics.iter().map(|one| (one.code, one.severity())).collect()
    };
    prop_assert_eq!(messages(&before), messages(&after), "{:?}", formatted);
    prop_assert!(formatted.is_empty() || formatted.ends_with(['\n', '\r']));
    Ok(())
}

/// Pieces of programs, right and wrong ones.
fn piece() -> impl Strategy<Value = &'static str> {
    prop::sample::select(vec![
        " ",
        " ",
        " ",
        "  ",
        "\t",
        "\n",
        "\n",
        "\n",
        "\n",
        "\r\n",
        "\r",
        "\n\n\n",
        "\u{1A}",
        "\u{A0}",
        "\u{FEFF}",
        "//",
        "// x ",
        ";y",
        "//\t\u{1A}",
        "mst 0",
        "sap 4, 0, 100",
        "MVP abs,0,1 ",
        "a=1",
        "a",
        "B",
        "Loop:",
        "c:",
        "jc",
        "ze",
        "wait",
        "TICKS",
        "calc not",
        "sin(",
        "SQRT ",
        "0",
        "12",
        "1.5",
        ".5",
        "1e",
        "$fF",
        "%101",
        "0x1F",
        ",",
        ",",
        ",",
        ":",
        "=",
        "+",
        "-",
        "*",
        "/",
        "^",
        "(",
        ")",
        "#include ",
        "#",
        "#define x",
        "f.inc",
        "200",
        "ä",
        "€",
        "'",
        "\u{0}",
        "Loop",
    ])
}

/// A line of a program without mistakes.
fn line() -> impl Strategy<Value = String> {
    let blank = || prop::sample::select(vec!["", " ", "\t", "    ", " \t "]);
    let value = prop::sample::select(vec![
        "1",
        "-1",
        "speed",
        "$C8",
        "2*speed",
        "( 1+2 )^-2",
        "-speed +3",
        "Sin( rad(90) )",
        "1.5/.5",
    ]);
    let statement = prop_oneof![
        5 => (prop::sample::select(vec!["sap 4 ,0,", "MVP Rel,0 , ", "comp ", "calc add,"]), value)
            .prop_map(|(head, value)| format!("{head}{value}")),
        3 => prop::sample::select(vec![
            "mst 0", "RSUB", "ja Start", "jc ze,START", "5 4, 0 ,100", "#include TMCLParam.tmc",
            "SAP APMaxPositioningSpeed, Motor0, speed * 2 + 100000 ", "x=3", "x = 6/2", "",
        ])
        .prop_map(str::to_owned),
    ];
    let comment = prop::sample::select(vec!["", "", "//a", "// b  ", ";c", "  //d", "\t\t\t// e"]);
    (blank(), statement, blank(), comment)
        .prop_map(|(indent, statement, gap, comment)| format!("{indent}{statement}{gap}{comment}"))
}

#[test]
fn the_manuals_programs_keep_their_meaning() {
    for (name, text) in programs_of_the_manuals() {
        check(&text).unwrap_or_else(|error| panic!("{}: {error}", name.display()));
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(2000))]

    #[test]
    fn any_pieces_of_programs_keep_their_meaning(pieces in prop::collection::vec(piece(), 0..40)) {
        check(&pieces.concat())?;
    }

    #[test]
    fn any_program_keeps_its_meaning(
        lines in prop::collection::vec(line(), 0..20),
        end in prop::sample::select(vec!["\n", "\r\n"]),
    ) {
        let text = format!("start:speed=5{end}#include TMCLParam.tmc{end}{}", lines.join(end));
        let assembly = assembled(&text);
        let wrong = assembly.diagnostics.iter().filter(|one| one.severity() == opentmcl_lang::Severity::Error);
        prop_assert_eq!(wrong.count(), 0, "{:?}", assembly.diagnostics);
        check(&text)?;
    }

    #[test]
    fn any_text_is_formatted(text in "(?s).{0,60}") {
        check(&text)?;
    }
}
