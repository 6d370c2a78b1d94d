//! The language itself: what a program may look like, and what it means.

use opentmcl_lang::include::BuiltInOnly;
use opentmcl_lang::tree::Tree;
use opentmcl_lang::{Assembly, Options, assemble};

#[track_caller]
fn assembly(text: &str) -> Assembly {
    let assembly = assemble("main.tmc", text, &mut BuiltInOnly, Options { append_stop: false });
    assert!(assembly.diagnostics.is_empty(), "{text}: {:#?}", assembly.diagnostics);
    assembly
}

/// The commands of a valid program as direct mode writes them.
#[track_caller]
fn commands(text: &str) -> Vec<String> {
    assembly(text).commands().map(|command| command.to_string()).collect()
}

/// The value of an expression, rounded as an operand is.
#[track_caller]
fn value(expression: &str) -> i32 {
    assembly(&format!("COMP {expression}")).instructions[0].command.value
}

#[test]
fn case_does_not_matter_anywhere() {
    let text =
        "down = 5\n  wait Ticks, 0, Down\nstopALL: mst 0\n  csub StopAll\n comp Sqrt(DOWN*5)";
    assert_eq!(commands(text), ["WAIT TICKS, 0, 5", "MST 0", "CSUB 1", "COMP 5"]);
}

#[test]
fn blanks_and_line_ends_do_not_matter() {
    assert_eq!(
        commands("\t ROL 0 ,\t1000\r\n\r\nSAP 108,0,300000\rCALCX  LOAD\n\x1A"),
        ["ROL 0, 1000", "SAP 108, 0, 300000", "CALCX LOAD",]
    );
}

#[test]
fn a_comment_may_touch_what_it_follows() {
    let text = "A = 50//ticks\nWAIT TICKS, 0, A; all\nCALC MUL, -1//turn\nB:// here\nJA B//back";
    assert_eq!(commands(text), ["WAIT TICKS, 0, 50", "CALC MUL, -1", "JA 2"]);
}

#[test]
fn several_labels_may_name_one_address() {
    let assembly = assembly("First: Second:\nThird: MST 0\nEnd:");
    let labels: Vec<_> = assembly.labels().map(|label| (label.name, label.address)).collect();
    assert_eq!(labels, [("First", 0), ("Second", 0), ("Third", 0), ("End", 1)]);
}

#[test]
fn labels_may_be_used_before_they_are_defined_and_so_may_constants() {
    assert_eq!(
        commands("JC EQ, Out\nCOMP Limit\nOut: STOP\nLimit = 2 * Half\nHalf = 4"),
        ["JC EQ, 2", "COMP 8", "STOP",]
    );
}

#[test]
fn keywords_are_not_reserved() {
    // Real programs call a label Start, which is a keyword of RFS.
    assert_eq!(
        commands("Start: RFS START, 0\nJA Start\nPOS = 7\nWAIT POS, 0, POS"),
        ["RFS START, 0", "JA 0", "WAIT POS, 0, 7",]
    );
}

#[test]
fn a_number_may_stand_for_a_keyword_and_for_a_label() {
    assert_eq!(
        commands("Relative = 1\nMVP 0, 0, 5\nMVP Relative, 0, 5\nJC 4, 1\nJA 0"),
        ["MVP ABS, 0, 5", "MVP REL, 0, 5", "JC GT, 1", "JA 0",]
    );
}

#[test]
fn a_label_and_a_constant_may_have_the_same_name() {
    assert_eq!(
        commands("Home = 1000\nHome: MVP ABS, 0, Home\nJA Home"),
        ["MVP ABS, 0, 1000", "JA 0"]
    );
}

#[test]
fn a_command_may_be_written_by_its_number() {
    assert_eq!(commands("200 1, $FF, -3\n1 0, 2, 100"), ["200 1, 255, -3", "ROR 2, 100"]);
    assert_eq!(commands("255 0, 0, 0\n$C8 1, 2, 3"), ["255 0, 0, 0", "200 1, 2, 3"]);
}

#[test]
fn an_operand_that_means_nothing_may_be_left_out_or_written() {
    // The manual writes CALC NOT with a value that is not looked at, and GCO with one that is not there.
    assert_eq!(commands("calc not\nCALC NOT, 0"), ["CALC NOT, 0", "CALC NOT, 0"]);
    assert_eq!(commands("GCO 0, 255, 0\nGCO 0, 255"), ["GCO 0, 255", "GCO 0, 255"]);
}

#[test]
fn addresses_may_be_computed() {
    let text = "MST 0\nLoop: JA Loop+1\nJA 1 + Loop\nJA (Loop)\nJA -(-Loop)\nJA 2*Loop";
    assert_eq!(commands(text)[1..], ["JA 2", "JA 2", "JA 1", "JA 1", "JA 2"]);
}

#[test]
fn an_operand_without_a_meaning_may_be_written() {
    // The manual writes GCO 0, 255, 0 (3.6.23), and lists a value for CALC NOT (3.6.14).
    assert_eq!(
        commands("GCO 0, 255, 0\nCALC NOT\nCALC NOT, 0"),
        ["GCO 0, 255", "CALC NOT, 0", "CALC NOT, 0",]
    );
    assert_eq!(assembly("GCO 0, 255, 7").instructions[0].command.value, 7);
}

#[test]
fn operators_have_the_ranks_of_basic() {
    for (expression, expected) in [
        ("7+9*8", 79),
        ("(7+9)*8", 128),
        ("20-5-3", 12),
        ("64/4/2", 8),
        ("2^3^2", 64),
        ("-2^2", -4),
        ("2^-1*8", 4),
        ("2*-3", -6),
        ("--5", 5),
        ("+5 - -5", 10),
        ("- 5", -5),
        ("3*1000", 3000),
        ("2^+3", 8),
        // The sign of an exponent is the exponent's alone: (2^-1)^2 * 8.
        ("2^-1^2*8", 2),
        ("-7-2*-3", -1),
    ] {
        assert_eq!(value(expression), expected, "{expression}");
    }
}

#[test]
fn values_are_rounded_only_where_they_are_used() {
    for (expression, expected) in [
        ("2.4", 2),
        ("2.5", 3),
        ("-2.5", -3),
        ("1/3*3", 1),
        ("INT(2.9)", 2),
        ("1000*SIN(RAD(90))", 1000),
        ("ROUND(DEG(3.14159265358979))", 180),
        ("LOG(1000)*10+LN(EXP(2))", 32),
    ] {
        assert_eq!(value(expression), expected, "{expression}");
    }
    // A half that is kept until it is used: 2.5 + 2.5, not 3 + 3.
    assert_eq!(commands("Half = 5/2\nCOMP Half + Half"), ["COMP 5"]);
}

#[test]
fn numbers_have_all_notations_and_all_32_bits() {
    for (expression, expected) in [
        ("$FF", 255),
        ("0xff", 255),
        ("%1010101", 85),
        ("-2147483648", i32::MIN),
        ("2147483647", i32::MAX),
        ("$FFFFFFFF", -1),
        ("$80000000", i32::MIN),
    ] {
        assert_eq!(value(expression), expected, "{expression}");
    }
}

#[test]
fn a_row_of_operators_may_be_long() {
    let text = vec!["1"; 100_000].join("+");
    assert_eq!(value(&text), 100_000);
}

#[test]
fn constants_may_depend_on_each_other_over_many_lines() {
    let mut text = String::from("C0 = 1\n");
    for at in 1..10_000 {
        text += &format!("C{at} = C{} + 1\n", at - 1);
    }
    assert_eq!(commands(&(text + "COMP C9999")), ["COMP 10000"]);
}

#[test]
fn constants_may_depend_on_later_ones_over_many_lines() {
    let mut text = String::new();
    for at in 0..300 {
        text += &format!("C{at} = C{} + 1\n", at + 1);
    }
    assert_eq!(commands(&(text + "C300 = 0\nCOMP C0")), ["COMP 300"]);
}

#[test]
fn parentheses_and_signs_may_be_a_hundred_deep() {
    let nested = |depth| format!("{}7{}", "(".repeat(depth), ")".repeat(depth));
    assert_eq!(value(&nested(100)), 7);
    assert_eq!(value(&format!("{}7", "-".repeat(100))), 7);
    // As often as anybody likes.
    assert_eq!(commands(&"COMP (1)\n".repeat(200)).len(), 200);
}

#[test]
fn stop_is_appended_unless_it_is_there() {
    let with_stop = |text: &str| {
        let assembly = assemble("main.tmc", text, &mut BuiltInOnly, Options::default());
        assembly.commands().map(|command| command.to_string()).collect::<Vec<_>>()
    };
    assert_eq!(with_stop("MST 0"), ["MST 0", "STOP"]);
    assert_eq!(with_stop("MST 0\nSTOP // end"), ["MST 0", "STOP"]);
    assert_eq!(with_stop(""), ["STOP"]);
    // STOP by its number, whatever stands in the fields that it does not look at.
    assert_eq!(with_stop("28 0, 0, 5").len(), 1);
}

#[test]
fn the_vendors_names_are_built_in() {
    assert_eq!(
        commands("#include tmclparam.TMC\nSAP APMaxPositioningSpeed, Motor1, 500"),
        ["SAP 4, 1, 500",]
    );
    assert_eq!(
        commands("#include <Interrupts.inc>\nEI TI_TIMER0\nEI TI_GLOBAL"),
        ["EI 0", "EI 255"]
    );
}

#[test]
fn a_tree_loses_no_byte_of_its_text() {
    for text in
        ["", "A\r", "A:B: MVP ABS,0,(1//x\r\n\r#include  q ;\n=,:ü€ 0x\t\0", "\n\n;", "SAP 4"]
    {
        let tree = Tree::parse(text);
        assert_eq!(tree.text(), text);
        let mut next = 0;
        for line in tree.lines() {
            assert_eq!(line.tokens.start, next, "{text:?}");
            next = line.tokens.end;
        }
        // All tokens but the end belong to a line, and they touch each other.
        assert_eq!(next as usize, tree.tokens().len() - 1);
        assert_eq!(tree.tokens()[0].start, 0);
        assert_eq!(tree.tokens().last().unwrap().start as usize, text.len());
    }
}

#[test]
fn every_module_has_an_include_file_of_its_names() {
    for model in opentmcl_catalog::MODULES {
        let file = format!("{}.inc", model.name);
        let assembly = assembly(&format!("#include {file}"));
        let values: Vec<_> = assembly.constants().filter_map(|constant| constant.value).collect();
        for row in model.axis_parameters {
            assert!(values.contains(&f64::from(row.number)), "{file}: {}", row.id);
        }
        assert!(opentmcl_lang::builtin::names().any(|name| name == file));
    }
    assert_eq!(commands("#INCLUDE tmcm-6214.inc\nEI TI_TIMER0"), ["EI 0"]);
    let text = "#include TMCM-6214.inc\n#include TMCLParam.tmc\n#include Interrupts.inc\n\
                SAP APMaxPositioningSpeed, Motor2, 5\nGIO IOSupplyVoltage, 1\nSGP GPAutoStart, 0, 1\n\
                EI TI_POSITION_REACHED5";
    assert_eq!(commands(text), ["SAP 4, 2, 5", "GIO 8, 1", "SGP 77, 0, 1", "EI 8"]);
}

#[test]
fn the_include_file_of_a_module_says_what_its_names_are() {
    let (name, text) = opentmcl_lang::builtin::file("TMCM-6214.INC").unwrap();
    assert_eq!(name, "tmcm-6214.inc");
    let headings: Vec<_> = text.lines().filter(|line| line.starts_with("//")).collect();
    // The manual of firmware V1.16: global parameters in banks 0 and 3 have names, those in bank 2
    // are user variables; inputs are in banks 0 and 1, outputs in bank 2.
    let expected = [
        "// Names for the TMCM-6214, firmware V1.16.",
        "// Axis parameters",
        "// Global parameters in bank 0",
        "// Global parameters in bank 3",
        "// Inputs and outputs in bank 0",
        "// Inputs and outputs in bank 1",
        "// Inputs and outputs in bank 2",
        "// Interrupts",
    ];
    assert_eq!(headings, expected);
    for heading in &expected[1..] {
        assert!(text.contains(&format!("\n\n{heading}\n")), "{heading}");
    }
    let line = |name: &str| {
        let begins = |line: &&str| line.split_once(" = ").is_some_and(|(known, _)| known == name);
        text.lines().find(begins).unwrap_or_default()
    };
    for (name, number, unit) in [
        ("APTargetPosition", "0", "[microsteps]"),
        ("APMaxPositioningSpeed", "4", "[pps]"),
        ("APMaxAcceleration", "5", "[pps²]"),
        ("GPAutoStart", "77", ""),
        ("TI_TIMER0", "0", ""),
    ] {
        let line = line(name);
        assert!(line.starts_with(&format!("{name} = {number} ")), "{name}: {line}");
        assert_eq!(
            line.split_once(" [").map_or("", |(_, unit)| unit),
            unit.trim_start_matches('[')
        );
    }
    // A supply voltage is no bare number.
    assert!(line("IOSupplyVoltage").ends_with(']'), "{}", line("IOSupplyVoltage"));
    let mut names: Vec<_> = text.lines().filter_map(|line| line.split_once(" = ")).collect();
    let count = names.len();
    names.dedup();
    assert_eq!(names.len(), count);
}
