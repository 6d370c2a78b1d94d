//! What is said about what.

use super::fixture::Fixture;
use crate::service::Service;

fn hover_of(fixture: &Fixture) -> Option<String> {
    let service: Service<'_> = fixture.service();
    service.hover(fixture.file, fixture.offset).map(|hover| hover.markdown)
}

#[track_caller]
fn hover(text: &str) -> String {
    hover_of(&Fixture::new(text)).expect("nothing is said")
}

#[track_caller]
fn says(text: &str, parts: &[&str]) {
    let hover = hover(text);
    for part in parts {
        assert!(hover.contains(part), "{part:?} is not in {hover}");
    }
}

#[test]
fn a_command_says_how_it_is_written_and_what_it_does() {
    let usage = "MVP <ABS|REL|COORD>, <motor>, <position>";
    says("M$0VP ABS, 0, 1000", &[usage, "Command 4", "Move an axis to a position"]);
    says("$04 0, 0, 1000", &[usage, "Command 4"]);
    says("J$0A 0", &["Command 22", "only in programs"]);
    // The manual: since firmware 1.15.
    says("SAPX$0 4, 1", &["since firmware 1.15"]);
    says("STA$0P 4, 1", &["TMCM-6214 does not have it"]);
    let without = Fixture::without_module("M$0VP ABS, 0, 1000");
    assert!(hover_of(&without).unwrap().contains("to a position"));
}

#[test]
fn a_parameter_says_all_that_the_catalogue_knows() {
    let facts =
        ["Maximum positioning speed", "axis parameter 4", "0..7999774 pps", "51200 pps", "read"];
    says("SAP $04, 0, 500", &facts);
    says("#include TMCLParam.tmc\nSAP APMax$0PositioningSpeed, 0, 500", &facts);
    says("GAP $$04, 1", &facts);
    says("GGP 6$06, 0", &["Serial address", "global parameter 66 of bank 0"]);
    says("Bank = 0\nGGP 6$06, Bank", &["Serial address"]);
    says("CALCV ADD, 4$02, 1", &["of bank 2"]);
    says("EI $00", &["interrupt 0"]);
    says("GAP 20$09, 3", &["Only on the axes 3, 4, 5"]);
    // A speed in the chip's own unit has another range.
    says("SAP $04, 0, 500", &["; 0..8388096 with unit mode 0"]);
    says("SAP $02, 0, 500", &["-8388096..8388096 with unit mode 0"]);
    assert!(!hover("GAP -$04, 1").contains("axis parameter"));
    let without = Fixture::without_module("SAP $04, 0, 500");
    assert!(!hover_of(&without).unwrap().contains("positioning"));
}

#[test]
fn sio_and_gio_look_at_different_ports() {
    // Number 0 of bank 0: SIO sets the pull-up resistors, GIO reads an input.
    let set = hover("SIO $00, 0, 1");
    let get = hover("GIO $00, 0");
    assert!(set.contains("port 0 of bank 0") && get.contains("port 0 of bank 0"));
    assert_ne!(set, get);
}

#[test]
fn a_value_says_what_it_means_for_its_parameter() {
    says("SAP 140, 0, $08", &["Microstep resolution", "256"]);
    says("SAP 4, 0, 5$000", &["Value of **Maximum positioning speed**", "0..7999774 pps"]);
    assert!(!hover("MVP ABS, 0, 5$00").contains("Value of"));
}

#[test]
fn a_keyword_says_what_it_means() {
    says("MVP R$0EL, 0, 1", &["**REL**", "kind of move 1", "distance"]);
    says("JC e$0q, 0", &["**EQ**", "condition 2"]);
}

#[test]
fn a_constant_says_its_value_and_where_it_comes_from() {
    let text = "Turn = 200 * 256 // one turn\nMVP REL, 0, Tu$0rn";
    says(text, &["Turn = 200 * 256", "51200", "one turn"]);
    says("Thi$0rd = 100 / 3", &["33.333333333, used as 33"]);
    says("#include TMCLParam.tmc\nMST Mot$0or3", &["Motor3 = 3", "Defined in TMCLParam.tmc"]);
    says("Ba$0d = 1 / 0", &["It has no value"]);
    assert_eq!(hover_of(&Fixture::new("MVP REL, 0, Nob$0ody")), None);
}

#[test]
fn a_label_says_its_address() {
    says("MST 0\nLoop: // for ever\nMST 1\nJA lo$0op", &["Loop:", "Address 1", "for ever"]);
    says("Lo$0op: STOP", &["Address 0"]);
}

#[test]
fn a_name_is_looked_for_as_the_assembler_does() {
    let both = "X = 500\nX: STOP\n";
    says(&format!("{both}JA $0X"), &["Address 0"]);
    says(&format!("{both}MVP ABS, 0, $0X"), &["X = 500"]);
    // The argument of a function is a number even in an address.
    says(&format!("{both}JA ABS($0X)"), &["X = 500"]);
    says(&format!("{both}JA ABS((1) + $0X)"), &["X = 500"]);
    says(&format!("{both}JA ABS(SQRT(4) + $0X)"), &["X = 500"]);
    says(&format!("{both}JA ABS(1) + $0X"), &["Address 0"]);
    says(&format!("{both}VECT ABS(1, $0X"), &["Address 0"]);
    says(&format!("{both}JA (1) + (2 * $0X)"), &["Address 0"]);
}

#[test]
fn a_number_is_shown_in_the_other_notations() {
    says("MVP ABS, 0, $C$0800", &["51200 = $C800"]);
    says("MVP ABS, 0, %10$010", &["10 = $A = %1010"]);
    says("MVP ABS, 0, $FFFFF$0FFF", &["-1 as a signed value"]);
    says("X = 1.5e$03", &["1500 = $5DC"]);
    says("X = 2.5$0", &["2.5"]);
}

#[test]
fn functions_and_files_are_explained() {
    says("X = SQ$0RT(2)", &["SQRT(x)", "Square root"]);
    says("#include TMCLP$0aram.tmc", &["TMCLParam.tmc", "comes with the tools"]);
    says("#include li$0b.inc\n//- lib.inc\nA = 1\n", &["lib.inc", "with 1 constant"]);
    assert_eq!(hover_of(&Fixture::new("STOP // no$0te")), None);
    assert_eq!(hover_of(&Fixture::new("MVP A$0BX, 0, 1")), None);
}
