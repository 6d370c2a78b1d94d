//! From commands back to a program.

use opentmcl_lang::{Disassembly, disassemble};
use opentmcl_wire::Command;
use opentmcl_wire::opcode::FORMS;
use proptest::prelude::*;

use super::{assembled, commands, programs_of_the_manuals};

const PLAIN: Disassembly<'_> = Disassembly { module: None, title: None };

fn with_names() -> Disassembly<'static> {
    let module = opentmcl_catalog::find("tmcm-6214").unwrap();
    Disassembly { module: Some(module), title: Some("from a module") }
}

#[track_caller]
fn shows(text: &str, options: &Disassembly<'_>, expected: &str) {
    assert_eq!(disassemble(&commands(text), options), expected.trim_start_matches('\n'));
}

#[track_caller]
fn shows_line(command: Command, expected: &str) {
    assert_eq!(disassemble(&[command], &PLAIN), format!("          {expected}\n"));
}

#[test]
fn the_layout_is_that_of_the_vendors_tools() {
    let text = "
        SGP 7, 2, -43000
    Home: RFS START, 0
        WAIT RFS, 0, 0
    Loop: CSUB Move
        JC EQ, Home
        JA Loop
    Move: MVP COORD, $47, 1
        RSUB
        GIO 0, 1
        RSUB
    Last: STOP
        JA Last";
    let title = Disassembly { title: Some("TMCL disassembly at 01-02-2020 10:20:30"), ..PLAIN };
    shows(
        text,
        &title,
        "
//TMCL disassembly at 01-02-2020 10:20:30
          SGP 7, 2, -43000

Lbl1:     RFS START, 0
          WAIT RFS, 0, 0

Lbl3:     CSUB Lbl6
          JC EQ, Lbl1
          JA Lbl3

Lbl6:     MVP COORD, 71, 1
          RSUB

          GIO 0, 1
          RSUB

Lbl10:    STOP
          JA Lbl10
",
    );
}

#[test]
fn a_target_in_the_first_line_has_no_blank_line_above_unless_there_is_a_title() {
    shows("A: JA A", &PLAIN, "Lbl0:     JA Lbl0\n");
    let title = Disassembly { title: Some(" two\nlines "), ..PLAIN };
    shows("A: JA A", &title, "// two\n//lines\n\nLbl0:     JA Lbl0\n");
}

#[test]
fn a_target_behind_the_last_command_has_a_line_of_its_own() {
    shows("JC ZE, 2\nVECT 1, 3", &PLAIN, "          JC ZE, Lbl2\n          VECT 1, 3\n\nLbl2:\n");
    shows("RSUB\nDJNZ 5, 2", &PLAIN, "          RSUB\n\n          DJNZ 5, Lbl2\n\nLbl2:\n");
}

#[test]
fn a_blank_line_behind_the_last_command_is_left_out() {
    shows("RSUB", &PLAIN, "          RSUB\n");
    assert_eq!(disassemble(&[], &PLAIN), "");
}

#[test]
fn a_long_label_keeps_its_distance() {
    let mut program = vec![Command::new(28, 0, 0, 0); 100_001];
    program[0] = Command::new(22, 0, 0, 100_000);
    let text = disassemble(&program, &PLAIN);
    assert!(text.ends_with("STOP\n\nLbl100000: STOP\n"));
    assert_eq!(commands(&text), program);
}

#[test]
fn an_address_outside_of_the_program_stays_a_number() {
    shows_line(Command::new(22, 0, 0, -1), "JA -1");
    shows_line(Command::new(22, 0, 0, 2), "JA 2");
    shows_line(Command::new(80, 6, 0, i32::MIN), "CALL LT, -2147483648");
}

#[test]
fn what_a_mnemonic_cannot_show_is_written_by_numbers() {
    // Unknown commands; the end mark; a motor, a type and a value that the command does not have.
    shows_line(Command::new(200, 1, 2, 3), "200 1, 2, 3");
    shows_line(Command::new(0, 0, 0, 0), "0 0, 0, 0");
    shows_line(Command::new(22, 0, 1, 0), "22 0, 1, 0");
    shows_line(Command::new(2, 1, 0, 3), "2 1, 0, 3");
    shows_line(Command::new(24, 0, 0, -1), "24 0, 0, -1");
}

#[test]
fn what_has_no_word_is_a_number_in_the_mnemonic() {
    shows_line(Command::new(4, 3, 0, 100), "MVP 3, 0, 100");
    shows_line(Command::new(19, 8, 0, 7), "CALC NOT, 7");
    shows_line(Command::new(21, 13, 0, 99), "JC 13, 99");
}

#[test]
fn a_module_gives_names_to_parameters_ports_and_interrupts() {
    // The names and units are those of modules/tmcm-6214.toml.
    shows(
        "SAP 4, 0, 51200
        SAP 12, 0, 1
        GAP 12, 0
        SAP 250, 0, 1
        GGP 68, 0
        GGP 5, 2
        GIO 0, 0
        SIO 0, 0, 3
        VECT 0, 0
        MST 0",
        &with_names(),
        "
//from a module
// module: tmcm-6214
#include tmcm-6214.inc

Lbl0:     SAP APMaxPositioningSpeed, 0, 51200       // pps
          SAP APRightLimitDisable, 0, 1             // the switch is ignored
          GAP APRightLimitDisable, 0
          SAP 250, 0, 1
          GGP GPSerialHeartbeat, 0                  // ms
          GGP 5, 2
          GIO IOAin0, 0
          SIO IOPullUps, 0, 3
          VECT TI_TIMER0, Lbl0
          MST 0
",
    );
}

#[test]
fn a_comment_keeps_its_distance_from_a_wide_command() {
    let line = "          SAP APSmartenergyThresholdSpeed, 255, -2147483648";
    let head = "//from a module\n// module: tmcm-6214\n#include tmcm-6214.inc\n\n";
    shows(
        &format!("#include tmcm-6214.inc\n{line}"),
        &with_names(),
        &format!("{head}{line}  // pps\n"),
    );
}

/// Every number with every type and some motors, and with every motor and some types.
#[test]
fn every_record_comes_back() {
    const VALUES: [i32; 8] = [0, 1, -1, 2, 255, i32::MAX, i32::MIN, 51200];
    const SOME: [u8; 6] = [0, 1, 8, 13, 71, 255];
    let fields = (0..=255).flat_map(|any| SOME.map(|some| [(any, some), (some, any)]));
    let fields: Vec<(u8, u8)> = fields.flatten().collect();
    for number in 0..=255 {
        let records = fields.iter().enumerate();
        let program: Vec<_> = records
            .map(|(at, &(kind, motor))| {
                // The values move against the types, so that each type meets all of them.
                Command::new(number, kind, motor, VALUES[(at + at / 12) % VALUES.len()])
            })
            .collect();
        assert_eq!(commands(&disassemble(&program, &PLAIN)), program, "command {number}");
        assert_eq!(commands(&disassemble(&program, &with_names())), program, "command {number}");
    }
}

#[test]
fn the_manuals_programs_come_back() {
    for (name, text) in programs_of_the_manuals() {
        let program: Vec<_> = assembled(&text).commands().collect();
        let back = commands(&disassemble(&program, &with_names()));
        assert_eq!(back, program, "{}", name.display());
    }
}

fn any_command() -> impl Strategy<Value = Command> {
    let form = prop::sample::select(FORMS);
    let value = prop_oneof![0..12_i32, any::<i32>(), Just(-1)];
    // Fields that a command does not have are mostly zero, as in a real program.
    let real = (form, 0..14_u8, 0..4_u8, value.clone(), 0..10_u8).prop_map(
        |(form, kind, motor, value, spoil)| {
            let has = |field| form.operands.iter().any(|operand| operand.field == field);
            use opentmcl_wire::opcode::Field::{Kind, Motor, Value};
            let all = spoil == 0;
            Command::new(
                form.opcode.number(),
                if all || has(Kind) { kind } else { 0 },
                if all || has(Motor) { motor } else { 0 },
                if all || has(Value) { value } else { 0 },
            )
        },
    );
    let wild = (any::<u8>(), any::<u8>(), any::<u8>(), value)
        .prop_map(|(number, kind, motor, value)| Command::new(number, kind, motor, value));
    prop_oneof![4 => real, 1 => wild]
}

proptest! {
    #[test]
    fn any_program_comes_back(
        program in prop::collection::vec(any_command(), 0..12),
        title in prop::option::of("(?s).{0,20}"),
    ) {
        let title = title.as_deref();
        for module in [None, with_names().module] {
            let text = disassemble(&program, &Disassembly { module, title });
            prop_assert_eq!(&commands(&text), &program, "{}", text);
            prop_assert!(!text.contains("\n\n\n"));
            prop_assert!(text.lines().all(|line| line.trim_end() == line), "{}", text);
        }
    }
}
