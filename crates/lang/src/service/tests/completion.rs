//! What is proposed where.

use super::fixture::Fixture;
use crate::service::{Completion, CompletionKind};
use crate::span::Span;

fn complete(text: &str) -> Vec<Completion> {
    let fixture = Fixture::new(text);
    fixture.service().completion(fixture.file, fixture.offset)
}

fn labels(text: &str, kind: CompletionKind) -> Vec<String> {
    let items = complete(text).into_iter();
    items.filter(|item| item.kind == kind).map(|item| item.label).collect()
}

#[track_caller]
fn proposed(text: &str, label: &str) -> Completion {
    let items = complete(text);
    let names: Vec<_> = items.iter().map(|item| item.label.clone()).collect();
    let found = items.into_iter().find(|item| item.label == label);
    found.unwrap_or_else(|| panic!("{label} is not among {names:?}"))
}

/// The text after a proposal was taken.
#[track_caller]
fn taken(text: &str, label: &str) -> String {
    let fixture = Fixture::new(text);
    let items = fixture.service().completion(fixture.file, fixture.offset);
    let item = items.into_iter().find(|item| item.label == label).expect(label);
    let mut text = fixture.assembly.file(fixture.file).tree.text().to_owned();
    let (start, end) = (item.replace.start as usize, item.replace.end as usize);
    assert!(start <= fixture.offset as usize && fixture.offset as usize <= end);
    text.replace_range(start..end, &item.insert);
    text
}

#[track_caller]
fn nothing(text: &str) {
    assert_eq!(complete(text), [], "{text}");
}

#[test]
fn a_statement_begins_with_a_command_that_the_module_has() {
    for text in ["$0", "MV$0", "Loop: $0", "A: B: M$0", "  $0 // note", "STOP\n$0", "STOP\r\n  $0"]
    {
        let mvp = proposed(text, "MVP");
        assert_eq!(mvp.kind, CompletionKind::Mnemonic);
        assert_eq!(mvp.detail.as_deref(), Some("MVP <ABS|REL|COORD>, <motor>, <position>"));
        // The firmware manual of the TMCM-6214 has neither STAP nor SAC, and UF0 is for customers'
        // own firmware.
        let items = labels(text, CompletionKind::Mnemonic);
        assert!(
            items.iter().all(|item| !["STAP", "SAC", "UF0"].contains(&item.as_str())),
            "{text}"
        );
    }
    assert_eq!(taken("A: mv$0 ABS", "MVP"), "A: MVP ABS");
    assert_eq!(taken("#inc$0", "#include"), "#include");
}

#[test]
fn without_a_module_every_command_is_proposed_and_no_parameter() {
    let fixture = Fixture::without_module("$0");
    let items = fixture.service().completion(fixture.file, fixture.offset);
    assert!(items.iter().any(|item| item.label == "SAC"));
    let fixture = Fixture::without_module("SAP $0");
    let items = fixture.service().completion(fixture.file, fixture.offset);
    assert!(items.iter().all(|item| item.kind != CompletionKind::Parameter));
}

#[test]
fn keywords_are_proposed_where_they_belong() {
    assert_eq!(labels("MVP $0", CompletionKind::Keyword), ["ABS", "REL", "COORD"]);
    assert_eq!(labels("MVP A$0, 0, 1", CompletionKind::Keyword), ["ABS", "REL", "COORD"]);
    assert_eq!(labels("RFS $0", CompletionKind::Keyword), ["START", "STOP", "STATUS"]);
    assert_eq!(labels("MVP ABS, $0", CompletionKind::Keyword), [""; 0]);
    assert_eq!(labels("X = 1\nMVP $0", CompletionKind::Constant), [""; 0]);
    let ticks = proposed("WAIT $0", "TICKS");
    assert_eq!(ticks.detail.as_deref(), Some("condition 0"));
    assert!(ticks.documentation.is_some());
    assert_eq!(taken("JC n$0, Loop", "NZ"), "JC NZ, Loop");
}

#[test]
fn a_comma_behind_the_mnemonic_counts_for_nothing() {
    assert_eq!(labels("MVP, $0", CompletionKind::Keyword), ["ABS", "REL", "COORD"]);
    assert_eq!(labels("MVP, ABS, $0", CompletionKind::Keyword), [""; 0]);
}

#[test]
fn axis_parameters_are_found_by_name_and_inserted_as_their_number() {
    let speed = proposed("SAP $0", "max_positioning_speed");
    assert_eq!(speed.detail.as_deref(), Some("axis parameter 4: 0..7999774 pps"));
    assert_eq!(speed.insert, "4");
    assert_eq!(taken("SAP max$0, 0, 500", "max_positioning_speed"), "SAP 4, 0, 500");
    assert_eq!(taken("SAP 1$0, 0, 500", "max_positioning_speed"), "SAP 4, 0, 500");
}

#[test]
fn the_constant_of_an_included_file_is_better_than_a_number() {
    let text = "#include TMCLParam.tmc\nSAP $0";
    let speed = proposed(text, "max_positioning_speed");
    assert_eq!(speed.insert, "APMaxPositioningSpeed");
    // Motor4 is 4 as well.
    assert_eq!(proposed(text, "max_acceleration").insert, "APMaxAcceleration");
    // Of two, the one that is called as the parameter is.
    let two = "#include a.inc\nSAP $0\n//- a.inc\nAPFast = 4\nAP_MAX_POSITIONING_SPEED = 4\n";
    assert_eq!(proposed(two, "max_positioning_speed").insert, "AP_MAX_POSITIONING_SPEED");
    // Constants of the main file may mean anything.
    assert_eq!(proposed("AP_MINE = 4\nSAP $0", "max_positioning_speed").insert, "4");
    // Number 66 is the serial address in bank 0 and a user variable in bank 2.
    let text = "#include tmcm-6214.inc\nSGP $0";
    assert_eq!(proposed(text, "serial_address").insert, "GPSerialAddress, 0");
    assert_eq!(proposed(&format!("{text}, 2"), "user_variable").insert, "0");
    let vector = "#include Interrupts.inc\nVECT $0";
    assert_eq!(proposed(vector, "timer_0").insert, "TI_TIMER0");
}

#[test]
fn only_parameters_that_the_command_may_touch_are_proposed() {
    // Parameter 3, the actual speed, can only be read.
    let is_proposed = |text| complete(text).iter().any(|item| item.label == "actual_speed");
    assert!(is_proposed("GAP $0"));
    assert!(!is_proposed("SAP $0"));
    assert!(!is_proposed("AAP $0"));
    // Of the global parameters only user variables are stored on request.
    assert_eq!(labels("STGP $0, 2", CompletionKind::Parameter), ["user_variable"]);
    assert_eq!(labels("STGP $0, 0", CompletionKind::Parameter), [""; 0]);
    // Encoders are on the axes 3, 4 and 5.
    let encoder = |text| complete(text).iter().any(|item| item.label == "encoder_position");
    assert!(encoder("GAP $0"));
    assert!(encoder("GAP $0, 3"));
    assert!(!encoder("GAP $0, 2"));
}

#[test]
fn the_bank_that_follows_chooses_among_global_parameters_and_ports() {
    // Number 66 of bank 0 is the serial address; bank 2 holds user variables.
    assert_eq!(taken("SGP $0, 0, 3", "serial_address"), "SGP 66, 0, 3");
    assert_eq!(taken("SGP 6$0, 0, 3", "serial_address"), "SGP 66, 0, 3");
    assert_eq!(taken("SGP $0", "serial_address"), "SGP 66, 0");
    assert!(complete("SGP $0, 2, 3").iter().all(|item| item.label != "serial_address"));
    let banks = labels("GGP 66, $0", CompletionKind::Value);
    assert_eq!(banks, ["0", "2", "3"]);
    assert_eq!(labels("GIO 0, $0", CompletionKind::Value), ["0", "1", "2"]);
    let inputs = labels("GIO $0, 1", CompletionKind::Parameter);
    let outputs = labels("SIO $0, 2", CompletionKind::Parameter);
    assert!(!inputs.is_empty() && !outputs.is_empty());
    assert!(inputs.iter().all(|input| !outputs.contains(input)));
}

#[test]
fn a_value_is_chosen_by_its_meaning() {
    // Parameter 140: 8 stands for 256 microsteps per full step.
    let value = proposed("SAP 140, 0, $0", "8");
    assert!(value.detail.is_some_and(|detail| detail.contains("256")));
    assert_eq!(labels("SAP 4, 0, $0", CompletionKind::Value), [""; 0]);
}

#[test]
fn labels_are_proposed_as_addresses_and_constants_everywhere() {
    let program = "Far = 1000\nStart: MVP ABS, 0, Far\nWAIT POS, 0, 0\nEnd: STOP\n";
    for line in ["JA $0", "JC ZE, $0", "CSUB S$0", "VECT 0, $0"] {
        let text = format!("{program}{line}");
        assert_eq!(labels(&text, CompletionKind::Label), ["Start", "End"], "{line}");
        assert_eq!(labels(&text, CompletionKind::Constant), ["Far"], "{line}");
    }
    let end = proposed(&format!("{program}JA $0"), "End");
    assert_eq!(end.detail.as_deref(), Some("address 2"));
    for line in ["MVP ABS, 0, $0", "MVP ABS, 0, 2*$0", "Near = $0", "Near = F$0 / 2", "200 1, $0"] {
        let text = format!("{program}{line}");
        assert_eq!(labels(&text, CompletionKind::Label), [""; 0], "{line}");
        assert_eq!(labels(&text, CompletionKind::Constant)[0], "Far", "{line}");
        assert_eq!(proposed(&text, "SQRT").insert, "SQRT(", "{line}");
    }
}

#[test]
fn the_middle_of_a_calculation_is_no_place_for_keywords_and_parameters() {
    assert_eq!(labels("SAP 2 * $0", CompletionKind::Parameter), [""; 0]);
    assert_eq!(labels("CALC 1 + $0", CompletionKind::Keyword), [""; 0]);
}

#[test]
fn nothing_is_proposed_where_nothing_can_stand() {
    nothing("STOP $0");
    nothing("MVP ABS $0");
    nothing("MVP ABS, 0, 1 $0");
    nothing("MVP ABS, 0, 1, $0");
    nothing("STOP // MV$0");
    nothing("STOP // the module: t$0");
    nothing("STOP // see tmcl-allow: l$0");
    nothing("Lo$0: STOP");
    nothing("Spe$0 = 5");
    nothing("XYZ $0");
    nothing("#define $0");
    nothing("#include a.inc $0");
}

#[test]
fn files_and_modules_are_proposed_by_their_names() {
    assert_eq!(taken("#include $0", "TMCLParam.tmc"), "#include TMCLParam.tmc");
    assert_eq!(taken("#include \"TM$0\"", "TMCLParam.tmc"), "#include \"TMCLParam.tmc\"");
    assert_eq!(taken("#include \"$0", "Interrupts.inc"), "#include \"Interrupts.inc");
    assert_eq!(taken("// module: t$0", "tmcm-6214"), "// module: tmcm-6214");
    assert_eq!(
        taken("JA 1 // tmcl-allow: a, lab$0", "label-as-number"),
        "JA 1 // tmcl-allow: a, label-as-number"
    );
    // An error cannot be allowed.
    assert!(complete("JA 1 // tmcl-allow: $0").iter().all(|item| item.label != "unknown-label"));
}

#[test]
fn every_answer_about_a_broken_text_lies_within_it() {
    let text = "A:: MVP ,,(ABS 2*, )é€\r#include\n#\n= 5\nX = \n// module:\n200\nSAP 4 0 (((";
    for offset in 0..=text.len() as u32 + 2 {
        let fixture = Fixture::new(text);
        let service = fixture.service();
        let whole = |span: Span| {
            let range = span.start as usize..span.end as usize;
            assert!(text.get(range).is_some(), "{span:?} at {offset}");
        };
        for proposal in service.completion(fixture.file, offset) {
            whole(proposal.replace);
        }
        if let Some(hover) = service.hover(fixture.file, offset) {
            whole(hover.span);
        }
        for reference in service.references(fixture.file, offset) {
            whole(reference.location.span);
        }
        for edit in service.rename(fixture.file, offset, "B").into_iter().flatten() {
            whole(edit.location.span);
        }
    }
}
