//! What is said of a program that is wrong: where, what, and what would be right.

use opentmcl_lang::include::BuiltInOnly;
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
    says("COMP 1 +", &[" | missing-operand | a value is missing here | -"]);
    says("MST", &[" | missing-operand | MST takes 1 operand; 0 are written | write MST <motor>"]);
    says(
        "CALL",
        &[" | missing-operand | CALL takes 2 operands; 0 are written | write CALL <condition>, \
         <address>"],
    );
    says(
        "200 1",
        &[" | missing-operand | 200 takes 3 operands; 1 is written | write <number> <type>, \
         <motor>, <value>"],
    );
}

#[test]
fn a_missing_operand_is_looked_for_right_behind_what_is_there() {
    for (text, place) in [("SGP 8, 5 // x", 8), ("GIO 10, 0,  // x", 10), ("COMP 1 +  ;", 8)] {
        let span = assembly(text).diagnostics[0].location.span;
        assert_eq!((span.start, span.end), (place, place), "{text}");
    }
}

#[test]
fn a_line_with_a_mistake_becomes_an_empty_command() {
    for text in ["SAP 256, 1, 1", "MST 1, 2", "ROR 0, Nowhere", "FOO 1", "SGP 1, 2", "ROR (1 2), 1"]
    {
        let assembly = assembly(&format!("{text}\nEnd: STOP"));
        assert_eq!(assembly.instructions[0].command, opentmcl_wire::Command::default(), "{text}");
        assert_eq!(assembly.label("End").unwrap().address, 1, "{text}");
    }
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
    for (accumulator, value) in [
        ("AAPX 1, 2", "SAPX <parameter>, <value>"),
        ("AGP 1, 2, 3", "SGP <parameter>, <bank>, <value>"),
        ("ACO 1, 2, 3", "SCO <coordinate>, <motor>, <position>"),
        ("AIV 1", "SIV <value>"),
        ("MVPA ABS, 0, 1", "MVP <ABS|REL|COORD>, <motor>, <position>"),
        ("RORA 0, 1", "ROR <motor>, <velocity>"),
        ("ROLA 0, 1", "ROL <motor>, <velocity>"),
    ] {
        let assembly = assembly(accumulator);
        let [extra] = &assembly.diagnostics[..] else { panic!("{accumulator}") };
        let expected = format!("; with a value of your own, {value}");
        assert!(extra.help.as_ref().unwrap().ends_with(&expected), "{:?}", extra.help);
    }
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
            "51200 | missing-comma | a comma is missing between two operands | operands stand apart from \
         each other by commas",
        ],
    );
}

#[test]
fn a_comma_may_be_missing_in_front_of_any_operand() {
    for (text, second) in
        [("ROR 0 Speed", "Speed"), ("ROR 0 (5)", "("), ("ROR 0 $F", "$F"), ("ROR -0 5", "5")]
    {
        let text = format!("Speed = 5\n{text}");
        let assembly = assembly(&text);
        let [finding] = &assembly.diagnostics[..] else {
            panic!("{text}: {:?}", findings(&assembly))
        };
        assert_eq!(
            (finding.code.name(), assembly.text(finding.location)),
            ("missing-comma", second)
        );
    }
}

#[test]
fn many_findings_of_a_long_line_are_short() {
    let assembly = assembly(&("A".repeat(10_000) + &" 1".repeat(500)));
    let commas = assembly.diagnostics.iter().filter(|one| one.code.name() == "missing-comma");
    let lengths: Vec<_> = commas.map(|one| one.message.len()).collect();
    assert_eq!(lengths.len(), 499);
    assert!(lengths.iter().all(|&length| length < 200), "{lengths:?}");
}

#[test]
fn a_keyword_in_the_wrong_place_is_no_constant() {
    says(
        "MVP ABS, REL, 51200",
        &["REL | unknown-keyword | REL is a keyword; a motor is expected here | write MVP \
         <ABS|REL|COORD>, <motor>, <position>"],
    );
    says(
        "mvp abs, rel, 51200",
        &["rel | unknown-keyword | rel is a keyword; a motor is expected here | write MVP \
         <ABS|REL|COORD>, <motor>, <position>"],
    );
    // Of another command.
    says(
        "ROR 0, TICKS",
        &["TICKS | unknown-keyword | TICKS is a keyword; a velocity is expected here | write ROR \
         <motor>, <velocity>"],
    );
    // Where an address is expected, any name may be a label.
    says(
        "JA START",
        &[
            "START | unknown-label | there is no label START | a line that begins with START: defines it",
        ],
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
    // Its value is not known, and not what stands in the parentheses.
    says(
        "ROR SQR(300), 0",
        &["SQR | unknown-function | there is no function \"SQR\" | did you mean SQRT?"],
    );
    says(
        "SAP apmaxcurrent, 0, 5",
        &["apmaxcurrent | unknown-constant | there is no constant apmaxcurrent | #include \
         TMCLParam.tmc defines it"],
    );
    // On both sides of an operator.
    assert_eq!(assembly("COMP Here + There").diagnostics.len(), 2);
    assert_eq!(mended("Speed = 5\nROR 0, Sped"), "Speed = 5\nROR 0, Speed");
    assert_eq!(mended("#include TMCLParm.tmc"), "#include TMCLParam.tmc");
}

#[test]
fn a_label_as_a_number_is_taken_and_told() {
    for text in ["MST 0\nL: COMP L", "MST 0\nL: COMP ABS(L)", "MST 0\nREL: ROR 1, REL"] {
        let assembly = assembly(text);
        let name = &text[6..text.find(':').unwrap()];
        let message = format!(
            "{name} | label-as-number | {name} is a label; its address 1 is taken as the number | -"
        );
        assert_eq!(findings(&assembly), [message], "{text}");
        assert!(assembly.is_valid());
        assert_eq!(assembly.instructions[1].command.value, 1);
    }
    // An angle is no address.
    let assembly = assembly("MST 0\nL: JA ABS(L)");
    assert_eq!(assembly.diagnostics[0].code.name(), "label-as-number");
}

#[test]
fn of_many_unknown_names_the_first_fifty_get_a_proposal() {
    let assembly = assembly(&("Speed = 5\n".to_owned() + &"ROR 0, Sped\n".repeat(60)));
    let helped = assembly.diagnostics.iter().take_while(|finding| finding.help.is_some()).count();
    assert_eq!((assembly.diagnostics.len(), helped), (60, 50));
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
    // Not what it is rounded to later.
    says(
        "A = 2.4\nA = 2.3",
        &[
            "A | redefined-constant | A is defined as 2.3 here and as 2.4 before | a constant has one \
         value in the whole program; use two names",
        ],
    );
    let circle = assembly("A = B\nB = C + 1\nC = A");
    let finding = &circle.diagnostics[0];
    let (definition, _) = finding.related.as_ref().unwrap();
    assert_eq!((finding.location.span.start, definition.span.start), (20, 0));
    let second = assembly("A = 5\nA = 6");
    let (first, _) = second.diagnostics[0].related.as_ref().unwrap();
    assert_eq!((second.diagnostics[0].location.span.start, first.span.start), (6, 0));
    says(
        "A = 1 (2)",
        &["( | unexpected-text | a constant has one value; an operator is missing here | -"],
    );
    says("A = 1 ) 2", &[") | unexpected-text | \")\" is not expected here | -"]);
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
        "COMP -5/0",
        &[
            "-5/0 | undefined-value | -5/0 has no value | it divides by zero, leaves the range of a \
         function, or is too large",
        ],
    );
    says("ROR 255.4, 0.4", &[]);
    says("ROR 256, 0", &["256 | value-too-large | the motor is 256; it must be in 0..255 | -"]);
    for number in ["1.5", "256", "12ab"] {
        says(
            &format!("{number} 0, 0, 0"),
            &[&format!(
                "{number} | unknown-command | {number} is not the number of a command | a command is \
                 a mnemonic or a number in 0..255"
            )],
        );
    }
    // Both, since none is missing.
    let both = assembly("ROR 12abc, 2*Nowhere");
    let codes: Vec<_> = both.diagnostics.iter().map(|finding| finding.code.name()).collect();
    assert_eq!(codes, ["bad-number", "unknown-constant"]);
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
    says("COMP (1 2)", &["2 | unexpected-text | \"2\" is not expected here | -"]);
    // Up to the comma: the second operand is looked at, and the first one is not taken for 300.
    says(
        "ROR (300 2), 2*X",
        &[
            "2 | unexpected-text | \"2\" is not expected here | -",
            "X | unknown-constant | there is no constant X | a line X = value defines it",
        ],
    );
    says(
        "ROR (SQR(1), 5",
        &[
            "SQR | unknown-function | there is no function \"SQR\" | did you mean SQRT?",
            " | unclosed-parenthesis | a parenthesis is not closed | write ) here",
        ],
    );
    says("SAP (1 2), 5", &["2 | unexpected-text | \"2\" is not expected here | -"]);
}

#[test]
fn what_is_nested_too_deeply_is_told_once() {
    let nested = |depth| format!("COMP {}1{}", "(".repeat(depth), ")".repeat(depth));
    for text in [nested(101), nested(100_000), format!("COMP {}1", "-+".repeat(50_000))] {
        let assembly = assembly(&text);
        let codes: Vec<_> =
            assembly.diagnostics.iter().map(|finding| finding.code.name()).collect();
        assert_eq!(codes, ["nested-too-deeply"]);
    }
}

#[test]
fn constants_that_depend_on_each_other_too_deeply_are_told() {
    for (open, close) in [("", ""), ("", " + 1"), ("-(", ")")] {
        let mut text = String::new();
        for at in 0..20_000 {
            text += &format!("C{at} = {open}C{}{close}\n", at + 1);
        }
        let assembly = assembly(&(text + "C20000 = 1\n"));
        let first = &assembly.diagnostics[0];
        assert_eq!(first.code.name(), "nested-too-deeply");
        assert_eq!(first.message, "the value depends on others more deeply than can be followed");
        assert_eq!(assembly.constant("C0").unwrap().value, None);
    }
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
    for quote in ["'", "!", "\\", "\"", "{", "["] {
        says(
            &format!("STOP {quote} remark"),
            &[&format!(
                "{quote} | unexpected-text | {quote:?} is not expected here | a comment begins with // \
                 and goes to the end of the line"
            )],
        );
    }
    says(
        "A = ' remark",
        &[
            "' | unexpected-text | \"'\" is not expected here | a comment begins with // and goes to the \
         end of the line",
        ],
    );
    says("STOP ? remark", &["? | unexpected-text | \"?\" is not expected here | -"]);
    says(
        "*** STOP",
        &[
            "* | unexpected-text | \"*\" is not expected here | a comment begins with // and goes to the \
         end of the line; there is no /* */",
        ],
    );
    says(
        "1: STOP",
        &[": | unexpected-text | a colon without a label in front of it | a label begins with a \
         letter or `_`: Loop1:"],
    );
    says("= 5 6", &["= | unexpected-text | an equals sign without a constant in front of it | -"]);
    // Up to the next comma nothing is looked at; what follows is an operand again.
    says("ROR 0 ) ) 5 =, 7", &[") | unexpected-text | \")\" is not expected here | -"]);
    assert_eq!(assembly("ROR 3 ) ) 5 =, 7").instructions[0].command.value, 7);
    says(
        "#Define A 5",
        &[
            "#Define | unknown-directive | there is no directive #Define | a constant is defined by a \
         line: Name = value",
        ],
    );
    says(
        "#if A",
        &["#if | unknown-directive | there is no directive #if | the only directive is #include"],
    );
    says(
        "STOP\x01",
        &["\x01 | unexpected-text | a control character ($01) that has no meaning here | -"],
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
