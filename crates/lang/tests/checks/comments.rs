//! Comments that name a module or silence findings.

use opentmcl_lang::include::{BuiltInOnly, Found, Sources};
use opentmcl_lang::{Options, assemble, check};

use crate::{assembly, says, tells, tmcm_6214};

fn declared(text: &str) -> Option<String> {
    let assembly = assembly(text, true);
    check::declared_module(&assembly).map(|(name, location)| {
        assert_eq!(assembly.text(location), name);
        name.to_owned()
    })
}

#[test]
fn a_comment_names_the_module_of_the_program() {
    for text in [
        "// module: tmcm-6214",
        "STOP ; MODULE:tmcm-6214",
        "// first\n\n   //Module :  tmcm-6214  \nSTOP // module: tmcm-9999",
        "// module: tmcm-6214 with three encoders",
    ] {
        assert_eq!(declared(text).as_deref(), Some("tmcm-6214"), "{text}");
    }
    assert_eq!(declared("//module: TMCM-6214").as_deref(), Some("TMCM-6214"));
    assert_eq!(declared("// module: tmcm-6241").as_deref(), Some("tmcm-6241"));
    for text in ["// the module: tmcm-6214", "// module:", "// module: gripper of the press", ""] {
        assert_eq!(declared(text), None, "{text}");
    }
}

#[test]
fn an_unknown_module_is_told_with_the_nearest_one() {
    says(
        "// module: tmcm-6241\nSTOP",
        &["tmcm-6241 | there is no module tmcm-6241 | did you mean tmcm-6214?"],
    );
    let names: Vec<_> = opentmcl_catalog::MODULES.iter().map(|module| module.name).collect();
    let help = format!("arduino | there is no module arduino | write one of {}", names.join(", "));
    says("// module: arduino\nSTOP", &[&help]);
}

#[test]
fn a_comment_behind_a_statement_silences_its_line() {
    tells(
        "MST 6 // tmcl-allow: no-such-axis
        MST 6 //! no-such-axis
        Here: MST 6 ; TMCL-Allow: unreachable-code, NO-SUCH-AXIS
        // Another code leaves it as it is.
        MST 6 // tmcl-allow: no-such-port //! no-such-axis",
        true,
        Some(tmcm_6214()),
    );
}

#[test]
fn a_comment_on_a_line_of_its_own_silences_the_next_statement() {
    tells(
        "// tmcl-allow: no-such-axis
        // Both comments hold.
        // tmcl-allow: value-out-of-range

        Label:
        SAP 6, 7, 300
        SAP 6, 7, 300 //! no-such-axis, value-out-of-range",
        true,
        Some(tmcm_6214()),
    );
}

#[test]
fn a_reason_may_follow_the_last_code() {
    tells(
        "MST 6 // tmcl-allow: value-out-of-range, no-such-axis the next board has it, really",
        true,
        Some(tmcm_6214()),
    );
}

#[test]
fn a_file_can_be_silenced_as_a_whole_and_only_itself() {
    struct Other;
    impl Sources for Other {
        fn find(&mut self, _: &str, _: &str) -> Found {
            let text = "// tmcl-allow-file: no-such-axis\nMST 6\nMST 7\nGIO 8, 0\n".into();
            Found::File { name: "other.tmc".into(), text }
        }
    }
    let text = "MST 8\n#include other.tmc\nMST 9";
    let assembly = assemble("main.tmc", text, &mut Other, Options::default());
    let findings = check::findings(&assembly, Some(tmcm_6214()));
    let told: Vec<_> = findings
        .iter()
        .map(|finding| (assembly.text(finding.location), finding.code.name()))
        .collect();
    assert_eq!(told, [("8", "no-such-axis"), ("9", "no-such-axis"), ("8", "no-such-port")]);
}

#[test]
fn the_assemblers_warnings_can_be_silenced_and_its_errors_cannot() {
    let text = "Label: CALC LOAD, Label // tmcl-allow: label-as-number
        JA Nowhere // tmcl-allow: unknown-label";
    let assembly = assemble("main.tmc", text, &mut BuiltInOnly, Options::default());
    let findings = check::findings(&assembly, None);
    let told: Vec<_> =
        findings.iter().map(|one| (assembly.text(one.location), one.message.as_str())).collect();
    assert_eq!(
        told,
        [
            ("Nowhere", "there is no label Nowhere"),
            ("unknown-label", "unknown-label cannot be silenced"),
        ]
    );
}

#[test]
fn a_code_that_is_left_out_is_told() {
    says(
        "STOP // tmcl-allow: unreachable-code,",
        &[" | a code is missing here | write the code that a finding shows in square brackets"],
    );
}

#[test]
fn an_unknown_code_is_told_with_the_nearest_one() {
    says(
        "STOP // tmcl-allow: unreachable-cod, xyzzy",
        &[
            "unreachable-cod | there is no finding unreachable-cod | did you mean \
             unreachable-code?",
            "xyzzy | there is no finding xyzzy | write the code that a finding shows in square \
             brackets",
        ],
    );
}
