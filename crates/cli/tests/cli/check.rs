//! `tmcl check`, and the forms in which findings are printed.

use serde_json::{Value, json};

use crate::common::tmcl;
use crate::lab::Lab;

/// A tab and a character that is two columns wide in front of the mistake in line 3, and a second
/// mistake that has a further place.
const BAD: &str = "Loop: ROR 0, 1\n\n\tJA lop // 漢\nloop: STOP\n";

fn bad() -> Lab {
    Lab::with(&[("bad.tmc", BAD)])
}

/// Runs what finds something: exit status 1, and nothing on standard error.
#[track_caller]
fn findings(lab: &Lab, args: &[&str]) -> String {
    let (status, out, errors) = lab.run(args);
    assert_eq!((status, &*errors), (1, ""), "{out}");
    out
}

#[test]
fn people_see_the_lines_with_a_mark_and_what_would_be_right() {
    let expected = "\
error[unknown-label]: there is no label lop
 --> bad.tmc:3:5
  |
3 |     JA lop // 漢
  |        ^^^
  |
  = help: did you mean Loop?

error[duplicate-label]: a second label loop
 --> bad.tmc:4:1
  |
4 | loop: STOP
  | ^^^^
  |
 ::: bad.tmc:1:1
  |
1 | Loop: ROR 0, 1
  | ---- the first one is here
  |
  = help: case does not matter in labels; give one of them another name

2 errors in 1 file
";
    assert_eq!(findings(&bad(), &["check", "bad.tmc"]), expected);
}

#[test]
fn wide_characters_take_two_columns_and_count_as_one() {
    let lab = Lab::with(&[("wide.tmc", "#include 漢字 // 漢字\n")]);
    let out = findings(&lab, &["check", "wide.tmc"]);
    assert!(out.contains(" --> wide.tmc:1:10\n"), "{out}");
    assert!(out.contains("1 | #include 漢字 // 漢字\n  |          ^^^^\n"), "{out}");
    let out = findings(&lab, &["check", "wide.tmc", "--json"]);
    let object: Value = serde_json::from_str(&out).unwrap();
    assert_eq!(object["end"], json!({"line": 1, "column": 12}));
}

#[test]
fn a_long_line_is_shortened_around_the_mistake() {
    let text = format!("MVP ABS, 0, {}nope // {}\n", "1 + ".repeat(100), "x".repeat(400));
    let lab = Lab::with(&[("long.tmc", &text)]);
    let out = findings(&lab, &["check", "long.tmc"]);
    let line = out.lines().find(|line| line.starts_with("1 | ")).unwrap();
    assert!(line.contains("nope"), "{line}");
    assert!(line.len() < 120, "{line}");

    let text = format!("MVP ABS, 0, {}nope\n", "1 + ".repeat(100_000));
    lab.write("long.tmc", text);
    let out = findings(&lab, &["check", "long.tmc"]);
    assert!(out.contains("--> long.tmc:1:400013\n"), "{out}");
    assert!(!out.contains("1 | "), "a line that nobody has written is not shown: {out}");
}

#[test]
fn a_windows_text_is_shown_as_its_author_saw_it() {
    let lab = Lab::with(&[]);
    lab.write("windows.tmc", b"JA l\xF6p // 5 \x80\n");
    let out = findings(&lab, &["check", "windows.tmc"]);
    assert!(out.contains("1 | JA löp // 5 €\n"), "{out}");
}

#[test]
fn a_source_cannot_command_the_terminal() {
    let lab = Lab::with(&[("evil.tmc", "JA nope // \u{1B}[31m \u{9B}31m\n")]);
    let out = findings(&lab, &["check", "evil.tmc"]);
    assert!(!out.contains(['\u{1B}', '\u{9B}']), "{out:?}");
}

#[test]
fn colour_is_used_only_where_it_is_wanted() {
    let lab = bad();
    let plain = lab.output(&["check", "bad.tmc"], b"").stdout;
    assert!(!plain.contains(&0x1B));
    let path = lab.path("bad.tmc");
    let args = ["check", path.to_str().unwrap()];
    let forced = tmcl(&args).env("CLICOLOR_FORCE", "1").output().unwrap().stdout;
    assert!(forced.contains(&0x1B), "otherwise this test would prove nothing");
}

#[test]
fn json_has_one_object_per_line_with_places_from_one() {
    let out = findings(&bad(), &["check", "bad.tmc", "--json"]);
    let objects: Vec<Value> = out.lines().map(|line| serde_json::from_str(line).unwrap()).collect();
    let label = json!({
        "file": "bad.tmc", "line": 3, "column": 5, "end": {"line": 3, "column": 8},
        "severity": "error", "code": "unknown-label",
        "message": "there is no label lop", "help": "did you mean Loop?",
        "fix": {"line": 3, "column": 5, "end": {"line": 3, "column": 8}, "replacement": "Loop"},
    });
    assert_eq!(objects[0], label);
    assert_eq!(
        objects[1]["related"],
        json!({
            "file": "bad.tmc", "line": 1, "column": 1, "end": {"line": 1, "column": 5},
            "message": "the first one is here",
        })
    );
    assert_eq!(objects.len(), 2);
    assert_eq!(findings(&bad(), &["check", "bad.tmc", "--format", "json"]), out);
}

#[test]
fn github_gets_a_command_per_finding() {
    let lab = Lab::with(&[("a, b: 100%.tmc", "JA lop\nLoop: STOP\n")]);
    let out = findings(&lab, &["check", "a, b: 100%.tmc", "--format", "github"]);
    // The properties' own separators and % are escaped, and so is the line end in the message.
    assert_eq!(
        out,
        "::error file=a%2C b%3A 100%25.tmc,line=1,col=4,endLine=1,endColumn=7,\
         title=unknown-label::there is no label lop%0Adid you mean Loop?\n"
    );
}

/// What the specification (SARIF 2.1.0, sections 3.13 to 3.57) requires of the parts that are there.
fn assert_valid_sarif(document: &Value) {
    assert_eq!(document["version"], "2.1.0");
    assert!(document["$schema"].as_str().unwrap().ends_with("sarif-schema-2.1.0.json"));
    for run in document["runs"].as_array().unwrap() {
        let driver = &run["tool"]["driver"];
        assert_eq!(driver["name"], "tmcl");
        let rules = driver["rules"].as_array().unwrap();
        for rule in rules {
            assert!(rule["id"].is_string() && rule["fullDescription"]["text"].is_string());
            let level = rule["defaultConfiguration"]["level"].as_str().unwrap();
            assert!(["none", "note", "warning", "error"].contains(&level), "{rule}");
        }
        let units = ["utf16CodeUnits", "unicodeCodePoints"];
        assert!(units.contains(&run["columnKind"].as_str().unwrap()));
        for result in run["results"].as_array().unwrap() {
            assert!(!result["message"]["text"].as_str().unwrap().is_empty());
            let rule = &rules[result["ruleIndex"].as_u64().unwrap() as usize];
            assert_eq!(rule["id"], result["ruleId"], "the index leads to the rule");
            let none = Vec::new();
            let related = result["relatedLocations"].as_array().unwrap_or(&none);
            let locations = result["locations"].as_array().unwrap();
            assert_eq!(locations.len(), 1);
            for location in locations.iter().chain(related) {
                let place = &location["physicalLocation"];
                assert_region(&place["region"]);
                assert!(place["artifactLocation"]["uri"].is_string());
            }
            for fix in result["fixes"].as_array().unwrap_or(&none) {
                for change in fix["artifactChanges"].as_array().unwrap() {
                    assert!(change["artifactLocation"]["uri"].is_string());
                    let replacements = change["replacements"].as_array().unwrap();
                    assert!(!replacements.is_empty());
                    replacements.iter().for_each(|one| assert_region(&one["deletedRegion"]));
                }
            }
        }
    }
}

fn assert_region(region: &Value) {
    let number = |name: &str| region[name].as_u64().unwrap();
    let start = (number("startLine"), number("startColumn"));
    assert!(start >= (1, 1) && start <= (number("endLine"), number("endColumn")), "{region}");
}

#[test]
fn sarif_is_a_document_as_the_standard_wants_it() {
    let out = findings(&bad(), &["check", "bad.tmc", "--format", "sarif"]);
    let document: Value = serde_json::from_str(&out).unwrap();
    assert_valid_sarif(&document);
    let results = document["runs"][0]["results"].as_array().unwrap();
    assert_eq!(results.len(), 2);
    let region = json!({"startLine": 3, "startColumn": 5, "endLine": 3, "endColumn": 8});
    let result = &results[0];
    assert_eq!(result["ruleId"], "unknown-label");
    assert_eq!(result["level"], "error");
    assert_eq!(result["message"]["text"], "there is no label lop; did you mean Loop?");
    let place = &result["locations"][0]["physicalLocation"];
    assert_eq!(place["artifactLocation"]["uri"], "bad.tmc");
    assert_eq!(place["region"], region);
    let change = &result["fixes"][0]["artifactChanges"][0]["replacements"][0];
    assert_eq!(*change, json!({"deletedRegion": region, "insertedContent": {"text": "Loop"}}));
    let related = &results[1]["relatedLocations"][0];
    assert_eq!(related["message"]["text"], "the first one is here");
    assert_eq!(related["physicalLocation"]["region"]["startLine"], 1);
}

#[test]
fn a_program_without_findings_succeeds_in_all_forms() {
    let lab = Lab::with(&[("good.tmc", "Loop: ROR 0, 1000\n  WAIT TICKS, 0, 1\n  JA Loop\n")]);
    assert_eq!(lab.succeed(&["check", "good.tmc"]), "no findings in 1 file\n");
    assert_eq!(lab.succeed(&["check", "good.tmc", "--json"]), "");
    assert_eq!(lab.succeed(&["check", "good.tmc", "--format", "github"]), "");
    let document = lab.succeed(&["check", "good.tmc", "--format", "sarif"]);
    let document: Value = serde_json::from_str(&document).unwrap();
    assert_valid_sarif(&document);
    assert_eq!(document["runs"][0]["results"], json!([]));
}

#[test]
fn warnings_fail_only_where_they_are_denied() {
    let lab = Lab::with(&[("doubtful.tmc", "Loop: SAP 4, 0, Loop\n WAIT TICKS, 0, 1\n JA Loop\n")]);
    let out = lab.succeed(&["check", "doubtful.tmc"]);
    assert!(out.starts_with("warning[label-as-number]"), "{out}");
    assert!(out.ends_with("1 warning in 1 file\n"), "{out}");
    assert_eq!(findings(&lab, &["check", "doubtful.tmc", "--deny", "warnings"]), out);
    lab.fail(2, &["check", "doubtful.tmc", "--deny", "everything"]);
}

/// The TMCM-6214 has axes 0 to 5.
const SEVENTH_AXIS: &str = "MST 6\n";

#[test]
fn a_program_is_checked_against_the_module_that_it_names_or_that_is_named() {
    let named = format!("// module: tmcm-6214\n{SEVENTH_AXIS}");
    let lab = Lab::with(&[("any.tmc", SEVENTH_AXIS), ("named.tmc", &named)]);
    assert_eq!(lab.succeed(&["check", "any.tmc"]), "no findings in 1 file\n");
    for args in [&["check", "named.tmc"][..], &["check", "any.tmc", "-m", "TMCM-6214"]] {
        let out = findings(&lab, args);
        assert!(out.starts_with("error[no-such-axis]: "), "{out}");
    }
    lab.write("wrong.tmc", "// module: tmcm-9999\nMST 6\n");
    let out = findings(&lab, &["check", "wrong.tmc", "--deny", "warnings"]);
    assert!(out.starts_with("warning[unknown-name-in-comment]"), "{out}");
    let out = findings(&lab, &["check", "wrong.tmc", "--module", "tmcm-6214"]);
    assert!(out.contains("error[no-such-axis]"), "the option counts: {out}");
}

#[test]
fn what_the_module_would_refuse_is_not_assembled_unless_it_is_allowed() {
    let lab = Lab::with(&[("main.tmc", SEVENTH_AXIS)]);
    let errors = lab.fail(1, &["asm", "main.tmc", "--module", "tmcm-6214"]);
    let end =
        "error: main.tmc: 1 error\nhelp: `// tmcl-allow: no-such-axis` in the line lets it pass\n";
    assert!(errors.ends_with(end), "{errors}");
    // What keeps it from being assembled cannot be allowed.
    lab.write("main.tmc", format!("{SEVENTH_AXIS}JA nowhere\n"));
    let errors = lab.fail(1, &["asm", "main.tmc", "--module", "tmcm-6214"]);
    assert!(errors.ends_with("error: main.tmc: 2 errors\n"), "{errors}");
    lab.write("main.tmc", "MST 6 // tmcl-allow: no-such-axis\n");
    lab.succeed(&["asm", "main.tmc", "--module", "tmcm-6214"]);
    assert_eq!(lab.succeed(&["check", "main.tmc", "-m", "tmcm-6214"]), "no findings in 1 file\n");
}

#[test]
fn hints_are_told_by_a_check_alone_and_are_never_denied() {
    let lab = Lab::with(&[("wait.tmc", "WAIT REFSW, 0, 0\nSTOP\n")]);
    let out = lab.succeed(&["check", "wait.tmc", "--deny", "warnings"]);
    assert!(out.starts_with("hint[wait-without-time-out]: "), "{out}");
    assert!(out.ends_with("1 hint in 1 file\n"), "{out}");
    let github = lab.succeed(&["check", "wait.tmc", "--format", "github"]);
    assert!(github.starts_with("::notice file=wait.tmc,line=1,"), "{github}");
    let sarif = lab.succeed(&["check", "wait.tmc", "--format", "sarif"]);
    let sarif: Value = serde_json::from_str(&sarif).unwrap();
    assert_valid_sarif(&sarif);
    assert_eq!(sarif["runs"][0]["results"][0]["level"], "note");
    assert_eq!(lab.succeed(&["asm", "wait.tmc"]), "wait.bin: 2 commands\n");
}

#[test]
fn a_folder_means_the_sources_in_it_and_below() {
    let lab = Lab::with(&[
        ("b.tmc", "JA b\n"),
        ("deep/a.TMC", "JA a\n"),
        (".hidden/c.tmc", "JA c\n"),
        ("d.inc", "JA d\n"),
    ]);
    let out = findings(&lab, &["check", ".", "--json"]);
    let files: Vec<Value> = out
        .lines()
        .map(|line| serde_json::from_str::<Value>(line).unwrap()["file"].clone())
        .collect();
    assert_eq!(files, ["b.tmc", "deep/a.TMC"]);
}

#[test]
fn a_named_file_that_another_one_includes_is_checked_as_a_part_of_it() {
    let lab = Lab::with(&[
        ("main.tmc", "#include part.tmc\nSpeed = 1000\nSTOP\n"),
        // By itself it has an unknown constant.
        ("part.tmc", "ROR 0, Speed\n"),
    ]);
    assert_eq!(lab.succeed(&["check", "part.tmc", "main.tmc"]), "no findings in 2 files\n");
    findings(&lab, &["check", "part.tmc"]);
}

#[test]
fn a_finding_in_a_file_that_two_programs_include_is_told_once() {
    let lab = Lab::with(&[
        ("one.tmc", "#include part.inc\n"),
        ("two.tmc", "#include part.inc\n"),
        ("part.inc", "JA nowhere\n"),
    ]);
    let out = findings(&lab, &["check", "one.tmc", "two.tmc"]);
    assert!(out.ends_with("1 error in 2 files\n"), "{out}");
}

#[test]
fn files_that_include_each_other_are_told_from_the_first() {
    let lab = Lab::with(&[("a.tmc", "#include b.tmc\n"), ("b.tmc", "#include a.tmc\n")]);
    let out = findings(&lab, &["check", "a.tmc", "b.tmc"]);
    assert!(out.contains("error[circular-include]: a.tmc includes itself\n --> b.tmc:1:10\n"));
    assert!(out.ends_with("1 error in 2 files\n"), "{out}");
}

#[test]
fn a_program_from_standard_input_is_checked_too() {
    let lab = Lab::with(&[]);
    let (status, out, errors) = lab.run_with(&["check", "-", "--json"], b"JA lop\n");
    assert_eq!((status, &*errors), (1, ""));
    let object: Value = serde_json::from_str(&out).unwrap();
    assert_eq!(object["file"], "<stdin>");
}

#[test]
fn any_bytes_are_answered_with_findings() {
    let lab = Lab::with(&[("empty.tmc", "")]);
    assert_eq!(lab.succeed(&["check", "empty.tmc"]), "no findings in 1 file\n");
    // xorshift32, Marsaglia's constants.
    let mut state = 1_u32;
    let noise: Vec<u8> = std::iter::repeat_with(|| {
        state ^= state << 13;
        state ^= state >> 17;
        state ^= state << 5;
        state as u8
    })
    .take(100_000)
    .collect();
    lab.write("noise.tmc", noise);
    for format in ["human", "json", "github", "sarif"] {
        let out = findings(&lab, &["check", "noise.tmc", "--format", format]);
        if format == "sarif" {
            assert_valid_sarif(&serde_json::from_str(&out).unwrap());
        }
    }
}

#[test]
fn a_code_is_explained() {
    let lab = Lab::with(&[]);
    let out = lab.succeed(&["check", "--explain", "unknown-label"]);
    assert_eq!(out, "unknown-label (error)\nNo label has this name.\n");
    let errors = lab.fail(2, &["check", "--explain", "unknown-lable"]);
    assert!(errors.contains("a similar value exists: 'unknown-label'"), "{errors}");
    assert!(errors.contains("missing-comma, "), "all codes are listed: {errors}");
}

#[test]
fn wrong_usage_and_missing_files_are_told() {
    let lab = Lab::with(&[("a.bin", ""), ("a.tmc", "")]);
    lab.fail(2, &["check"]);
    lab.fail(2, &["check", "a.tmc", "--json", "--format", "sarif"]);
    let errors = lab.fail(2, &["check", "a.bin"]);
    assert!(errors.starts_with("error: a.bin is a binary"), "{errors}");
    let errors = lab.fail(2, &["check", "a.tmc", "--module", "tmcm6214"]);
    assert!(errors.contains("did you mean tmcm-6214?"), "{errors}");
    let errors = lab.fail(1, &["check", "a.tmc", "gone.tmc"]);
    assert_eq!(errors, "error: cannot read gone.tmc: there is no such file\n");
}
