//! What is said of a program that is wrong: where, what, and what would be right.

use opentmcl_lang::include::{BuiltInOnly, Found, Sources};
use opentmcl_lang::{Assembly, Options, assemble};

fn assembly(text: &str) -> Assembly {
    assemble("main.tmc", text, &mut BuiltInOnly, Options::default())
}

/// Each finding as `text that it is about | code | message | help`.
fn findings(assembly: &Assembly) -> Vec<String> {
    let one = |diagnostic: &opentmcl_lang::Diagnostic| {
        let help = diagnostic.help.as_deref().unwrap_or("-");
        let text = assembly.text(diagnostic.location);
        format!("{text} | {} | {} | {help}", diagnostic.code.name(), diagnostic.message)
    };
    assembly.diagnostics.iter().map(one).collect()
}

#[track_caller]
fn says(text: &str, expected: &[&str]) {
    assert_eq!(findings(&assembly(text)), expected, "{text}");
}

/// The text after all proposed replacements.
fn mended(text: &str) -> String {
    let assembly = assembly(text);
    let mut mended = text.to_owned();
    for diagnostic in assembly.diagnostics.iter().rev() {
        if let Some(fix) = &diagnostic.fix {
            let range = fix.span.start as usize..fix.span.end as usize;
            mended.replace_range(range, &fix.replacement);
        }
    }
    mended
}

#[test]
fn a_mnemonic_that_does_not_exist_names_the_one_that_was_meant() {
    says("RET", &["RET | unknown-command | there is no command RET | did you mean RSUB?"]);
    says("GPP 5, 2", &["GPP | unknown-command | there is no command GPP | did you mean GGP?"]);
    says(
        "Main",
        &["Main | unknown-command | there is no command Main | a label ends with a colon, and a \
         constant is defined by a line Name = value"],
    );
    assert_eq!(mended("Sub: RET"), "Sub: RSUB");
}

#[test]
fn a_missing_operand_is_told_with_the_form_of_the_command() {
    says(
        "ROR 0",
        &[
            " | missing-operand | ROR takes 2 operands; 1 is written | write ROR <motor>, <velocity>",
        ],
    );
    // Which one is missing nobody knows, so that 65536 is not blamed for being no bank.
    says(
        "SGP 8, 65536 // x",
        &[
            " | missing-operand | SGP takes 3 operands; 2 are written | write SGP <parameter>, <bank>, \
         <value>",
        ],
    );
    says(
        "CALC SUB",
        &[" | missing-operand | CALC takes 2 operands; 1 is written | write CALC <operation>, \
         <value>; CALCX calculates with the X register and takes no value"],
    );
    says("SAP 4,, 5", &[" | missing-operand | an operand is missing here | -"]);
    says("GIO 10, 0,", &[" | missing-operand | an operand is missing here | -"]);
}

#[test]
fn a_call_without_condition_is_a_subroutine_call() {
    says(
        "CALL Sub\nSub: RSUB",
        &[" | missing-operand | CALL takes 2 operands; 1 is written | CSUB Sub calls without a \
         condition"],
    );
    assert_eq!(mended("call Sub\nSub: RSUB"), "CSUB Sub\nSub: RSUB");
}

#[test]
fn an_operand_too_many_names_the_command_that_takes_it() {
    says(
        "AAP 108, 0, 300000",
        &["300000 | extra-operand | AAP takes 2 operands; 3 are written | write AAP <parameter>, \
         <motor>; with a value of your own, SAP <parameter>, <motor>, <value>"],
    );
    says("RSUB 1", &["1 | extra-operand | RSUB takes no operand; 1 is written | write RSUB"]);
}

#[test]
fn commas_stand_between_operands_and_nowhere_else() {
    says(
        "SGP, 0, 2, 100",
        &[
            ", | comma-after-mnemonic | a comma behind SGP | the first operand follows behind a blank",
        ],
    );
    assert_eq!(mended("SGP, 0, 2, 100"), "SGP 0, 2, 100");
    says(
        "ROR 0 51200",
        &[
            "51200 | missing-comma | a comma is missing between two operands of ROR | operands stand \
         apart from each other by commas",
        ],
    );
}

#[test]
fn a_keyword_in_the_wrong_place_is_no_constant() {
    says(
        "MVP ABS, REL, 51200",
        &["REL | unknown-keyword | REL is a keyword; a motor is expected here | write MVP \
         <ABS|REL|COORD>, <motor>, <position>"],
    );
    says(
        "MVP ASB, 0, 1",
        &["ASB | unknown-keyword | ASB is not a kind of move | did you mean ABS?"],
    );
    says(
        "RFS BEGIN, 0",
        &["BEGIN | unknown-keyword | BEGIN is not an action | write one of START, STOP, STATUS"],
    );
}

#[test]
fn names_that_do_not_exist_are_told_with_the_nearest_one() {
    says(
        "JA MainLop\nMainLoop: STOP",
        &["MainLop | unknown-label | there is no label MainLop | did you mean MainLoop?"],
    );
    says(
        "CSUB Gripper",
        &[
            "Gripper | unknown-label | there is no label Gripper | a line that begins with Gripper: \
         defines it",
        ],
    );
    says(
        "Speed = 5\nROR 0, Sped",
        &["Sped | unknown-constant | there is no constant Sped | did you mean Speed?"],
    );
    says(
        "SAP APMaxCurrent, 0, 5",
        &["APMaxCurrent | unknown-constant | there is no constant APMaxCurrent | #include \
         TMCLParam.tmc defines it"],
    );
    says(
        "ROR 0, SQR(2)",
        &["SQR | unknown-function | there is no function \"SQR\" | did you mean SQRT?"],
    );
}

#[test]
fn a_second_label_points_to_the_first() {
    let assembly = assembly("Home: MST 0\nHOME: MST 1");
    assert_eq!(
        findings(&assembly),
        [
            "HOME | duplicate-label | a second label HOME | case does not matter in labels; give one of \
         them another name",
        ]
    );
    let (place, _) = assembly.diagnostics[0].related.as_ref().unwrap();
    assert_eq!((place.span.start, assembly.text(*place)), (0, "Home"));
}

#[test]
fn a_constant_has_one_value() {
    says("A = 5\na = 2+3\nROR 0, A", &[]);
    says(
        "A = 5\nA = 6",
        &[
            "A | redefined-constant | A is defined as 6 here and as 5 before | a constant has one value \
         in the whole program; use two names",
        ],
    );
    says(
        "A = B\nB = C + 1\nC = A",
        &["A | circular-constant | the value of A depends on itself | -"],
    );
    says(
        "A = 1 2",
        &["2 | unexpected-text | a constant has one value; an operator is missing here | -"],
    );
}

#[test]
fn values_must_exist_and_fit() {
    says(
        "SAP 256, 0, 1",
        &["256 | value-too-large | the parameter is 256; it must be in 0..255 | -"],
    );
    says("ROR -1, 0", &["-1 | value-too-large | the motor is -1; it must be in 0..255 | -"]);
    says(
        "COMP 4294967296",
        &["4294967296 | value-too-large | the value is 4294967296; it must be in \
         -2147483648..4294967295 | -"],
    );
    says(
        "COMP 5/(3-3)",
        &[
            "5/(3-3) | undefined-value | 5/(3-3) has no value | it divides by zero, leaves the range of \
         a function, or is too large",
        ],
    );
    says(
        "COMP 12abc",
        &[
            "12abc | bad-number | \"12abc\" is not a number | numbers are decimal (51200), hexadecimal \
         ($C800 or 0xC800, up to 32 bits) or binary (%1010)",
        ],
    );
}

#[test]
fn parentheses_are_closed() {
    says("COMP (1 + 2", &[" | unclosed-parenthesis | a parenthesis is not closed | write ) here"]);
    assert_eq!(mended("MVP ABS, SIN(1, 2"), "MVP ABS, SIN(1), 2");
    let deep = format!("COMP {}1{}", "(".repeat(5000), ")".repeat(5000));
    let codes: Vec<_> =
        assembly(&deep).diagnostics.iter().map(|diagnostic| diagnostic.code.name()).collect();
    assert!(codes.contains(&"nested-too-deeply"), "{codes:?}");
}

#[test]
fn text_that_fits_no_rule_is_told_once_a_line() {
    says(
        "/* motor */ MST 0",
        &[
            "/ | unexpected-text | \"/\" is not expected here | a comment begins with // and goes to \
         the end of the line; there is no /* */",
        ],
    );
    says(
        "' remark",
        &[
            "' | unexpected-text | \"'\" is not expected here | a comment begins with // and goes to \
         the end of the line",
        ],
    );
    says(
        "#define A 5",
        &[
            "#define | unknown-directive | there is no directive #define | a constant is defined by a \
         line: Name = value",
        ],
    );
    says(
        "STOP\0",
        &["\0 | unexpected-text | a control character ($00) that has no meaning here | -"],
    );
}

#[test]
fn all_mistakes_of_a_file_are_told_at_once() {
    let text = "RET\nROR 0\nJA nowhere\nSAP 4, 0, 1000000\nMST 0 1 2\n";
    let codes: Vec<_> =
        assembly(text).diagnostics.iter().map(|diagnostic| diagnostic.code.name()).collect();
    assert_eq!(
        codes,
        [
            "unknown-command",
            "missing-operand",
            "unknown-label",
            "missing-comma",
            "extra-operand",
            "missing-comma",
        ]
    );
}

#[test]
fn only_the_first_thousand_findings_are_told() {
    let text = "FOO\n".repeat(5000);
    let assembly = assembly(&text);
    assert_eq!(assembly.diagnostics.len(), 1001);
    let last = assembly.diagnostics.last().unwrap();
    assert_eq!(last.message, "there are more than 1000 findings");
}

/// Two files that include each other, and one that is not there.
struct Circle;

impl Sources for Circle {
    fn find(&mut self, name: &str, _from: &str) -> Found {
        let text = match name {
            "a.tmc" => "A = 1\n#include b.tmc\n",
            "b.tmc" => "B = 2\n#include a.tmc\n",
            "twice.tmc" => "#include <b2.tmc>\n#include \"b2.tmc\"\n",
            "b2.tmc" => "B2 = 2\n",
            "locked.tmc" => return Found::Unreadable("no permission".into()),
            _ => return Found::Nothing,
        };
        Found::File { name: name.into(), text: text.into() }
    }
}

fn including(text: &str) -> Assembly {
    assemble("main.tmc", text, &mut Circle, Options::default())
}

#[test]
fn a_circular_include_is_told_at_the_line_that_closes_the_circle() {
    let assembly = including("#include a.tmc\nROR A, B");
    assert_eq!(
        findings(&assembly),
        [
            "a.tmc | circular-include | a.tmc includes itself | remove this line, or move what both need \
         into a file of its own",
        ]
    );
    assert_eq!(assembly.file(assembly.diagnostics[0].location.file).name, "b.tmc");
    assert_eq!(assembly.instructions[0].command.value, 2);
}

#[test]
fn a_missing_include_is_told_at_its_line() {
    assert_eq!(
        findings(&including("MST 0\n#include gone.tmc // x")),
        ["gone.tmc | include-not-found | there is no file gone.tmc | it is looked for beside the \
         including file, in the include folders, and among the built-in files",]
    );
    assert_eq!(
        findings(&including("#include TCMLParam.tmc")),
        ["TCMLParam.tmc | include-not-found | there is no file TCMLParam.tmc | did you mean \
         TMCLParam.tmc?",]
    );
    assert_eq!(
        findings(&including("#include")),
        [
            "#include | include-not-found | #include without the name of a file | write for example: \
         #include TMCLParam.tmc",
        ]
    );
    assert_eq!(
        findings(&including("#include locked.tmc")),
        ["locked.tmc | include-not-found | cannot read locked.tmc: no permission | -",]
    );
}

#[test]
fn the_same_constants_may_be_included_twice() {
    let assembly = including("#include twice.tmc\nROR B2, 1");
    assert_eq!(findings(&assembly), [] as [&str; 0]);
    assert_eq!(assembly.files.len(), 4);
}

#[test]
fn files_that_include_each_other_twice_come_to_an_end() {
    /// Each file includes the next one twice: 2^1000 files.
    struct Bomb;
    impl Sources for Bomb {
        fn find(&mut self, name: &str, _from: &str) -> Found {
            let next = name.parse::<u32>().unwrap_or(0) + 1;
            let text = format!("#include {next}\n#include {next}\n");
            Found::File { name: name.into(), text }
        }
    }
    let assembly = assemble("main.tmc", "#include 1", &mut Bomb, Options::default());
    assert_eq!(assembly.files.len(), 256);
    assert!(!assembly.is_valid());
}
