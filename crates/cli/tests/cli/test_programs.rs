//! `tmcl test`: what passes and fails, and how that is told.

use serde_json::{Value, json};

use crate::common::serve;
use crate::lab::{Lab, Ran};

/// Half a second, a variable that is 1 for one command only, and a move.
const PROGRAM: &str = "\
Flag = 7
Goal = 6400
        WAIT TICKS, 0, 50
        SGP Flag, 2, 1
        SGP Flag, 2, 2
        GIO 3, 0
        JC ZE, End
        SIO 1, 2, 1
        MVP ABS, 0, Goal
End:    STOP
";

/// The folder with the program, and a test with these lines behind the first two.
fn lab(lines: &str) -> Lab {
    let test = format!("module tmcm-6214\nprogram wait.tmc\n{lines}");
    Lab::with(&[("wait.tmc", PROGRAM), ("wait.test.txt", &test)])
}

/// Runs the test, which must fail, and gives what it prints.
#[track_caller]
fn failing(lines: &str) -> String {
    let (status, out, errors) = lab(lines).run(&["test"]);
    assert_eq!(status, 1, "{out}{errors}");
    out
}

#[test]
fn each_case_begins_with_a_new_module_and_the_program() {
    let lab = lab("\
test \"high\"
input 3 high
run
wait until position 0 reached, program stopped, output 1 high, at most 5 s
expect position 0 = Goal, speed 0 = 0, variable Flag = 2, program at 8
set variable Flag = 9
expect variable Flag = 9
test \"low\"
expect variable Flag = 0, output 1 low, position 0 = 0, program stopped
run
expect program running, program at 0
wait until program stopped
expect output 1 low, accumulator = 0, x = 0, input 3 low, analog 0 = 0
");
    let out = lab.succeed(&["test"]);
    let lines: Vec<&str> = out.lines().collect();
    assert!(lines[0].starts_with("ok      wait.test.txt: high ("), "{out}");
    assert!(lines[1].starts_with("ok      wait.test.txt: low ("), "{out}");
    assert_eq!(lines[2..], ["2 tests: 2 passed, 0 failed"]);
}

#[test]
fn each_kind_of_expectation_fails_with_what_it_got() {
    for (line, expected, got) in [
        ("expect position 0 = 7", "7", "0"),
        ("expect position 0 = Goal", "Goal (6400)", "0"),
        ("expect speed 0 != 0", "!= 0", "0"),
        ("expect position 5 > Goal", "> Goal (6400)", "0"),
        ("expect variable Flag = 1..3", "1..3", "0"),
        ("expect output 1 high", "high", "low"),
        ("expect input 3 high", "high", "low"),
        ("expect analog 0 = 1", "1", "0"),
        ("expect program running", "running", "stopped"),
        ("expect program at End", "at End (address 7)", "at address 0"),
        ("expect accumulator = 5", "5", "0"),
        ("expect x = 2", "2", "0"),
    ] {
        let out = failing(&format!("{line}\n"));
        let told = format!(
            "  wait.test.txt:3: {line}\n    expected {expected}\n    got      {got}\n    after    \
             0.000 s, program stopped at wait.tmc:3: WAIT TICKS, 0, 50\n"
        );
        assert!(out.contains(&told), "{out}\n{told}");
    }
}

#[test]
fn a_reply_that_is_not_as_expected_fails_and_the_rest_is_told_as_well() {
    let out = failing("> GAP 4, 0\n< 100 7\nexpect position 0 = 1\n");
    assert!(out.contains("wait.test.txt:4: GAP 4, 0\n    expected status 100, value 7"), "{out}");
    assert!(out.contains("wait.test.txt:5: expect position 0 = 1\n"), "{out}");
}

#[test]
fn a_wait_is_over_at_the_very_command_and_lasts_no_longer_than_its_limit() {
    // A tick is 10 ms: the flag is 1 from the end of the WAIT for one command, 0.1 ms.
    let lines = "run\nwait until variable Flag = 1, at most 1 s\nexpect variable Flag = 1\n\
                 wait 100 us\nexpect variable Flag = 2\nexpect position 1 = 1\n";
    let out = failing(lines);
    assert_eq!(out.matches("expected ").count(), 1, "{out}");
    assert!(out.contains("after    0.500 s, program running at wait.tmc:6: GIO 3, 0"), "{out}");

    let out = failing("run\nwait until program stopped, at most 400 ms\n");
    let told = "  wait.test.txt:4: wait until program stopped, at most 400 ms
    expected program stopped within 400 ms
    got      running
    after    0.400 s, program running at wait.tmc:3: WAIT TICKS, 0, 50
";
    assert!(out.contains(told), "{out}");
}

#[test]
fn a_program_that_has_ended_stands_at_its_stop() {
    let out = failing("run\nwait 1 s\nexpect variable 0 = 1\n");
    assert!(
        out.contains("after    1.000 s, program stopped at wait.tmc:10: End:    STOP"),
        "{out}"
    );
}

#[test]
fn a_program_that_runs_behind_a_stop_is_not_at_it() {
    let lab = lab("run\nwait 1 ms\nexpect x = 1\n");
    lab.write("wait.tmc", "JA Over\nSTOP\nOver: WAIT TICKS, 0, 50\n");
    let (_, out, _) = lab.run(&["test"]);
    assert!(out.contains("program running at wait.tmc:3: Over: WAIT TICKS, 0, 50"), "{out}");
}

#[test]
fn a_program_in_the_test_itself_is_pointed_to_there() {
    let test = "module tmcm-6214\nprogram 5\n  WAIT TICKS, 0, 50\nend\nrun\nexpect x = 1\n";
    let (_, out, _) = Lab::with(&[("a.test.txt", test)]).run(&["test"]);
    assert!(out.contains("program running at a.test.txt:3: WAIT TICKS, 0, 50"), "{out}");
}

#[test]
fn a_case_that_goes_on_for_too_long_is_ended() {
    let lab = lab("run\nwait 5000 s\n");
    let (status, out, _) = lab.run(&["test"]);
    assert_eq!(status, 1);
    assert!(out.contains("expected an end within 3600 s, the limit"), "{out}");
    assert!(out.contains("after    3600.000 s"), "{out}");
    lab.succeed(&["test", "--limit", "2h"]);
    let (_, out, _) = lab.run(&["test", "--limit", "1min"]);
    assert!(out.contains("after    60.000 s"), "{out}");
}

#[test]
fn folders_are_searched_for_files_with_the_ending() {
    let test = "module tmcm-6214\nexpect x = 0\n";
    let lab = Lab::with(&[
        ("b/two.test.txt", test),
        ("a.test.txt", test),
        ("b/notes.txt", "no test"),
        (".hidden/three.test.txt", "no test"),
        ("plain.txt", test),
    ]);
    let out = lab.succeed(&["test"]);
    let names: Vec<&str> = out.lines().filter_map(|line| line.split_whitespace().nth(1)).collect();
    assert_eq!(names, ["a.test.txt", "b/two.test.txt", "tests:"]);
    let out = lab.succeed(&["test", "b", "plain.txt"]);
    assert!(out.contains("b/two.test.txt") && out.contains("plain.txt"), "{out}");
    assert_eq!(lab.fail(1, &["test", "no"]), "error: cannot read no: there is no such file\n");
    lab.write("empty/notes.txt", "no test");
    let told = lab.fail(2, &["test", "empty"]);
    assert!(told.starts_with("error: there are no tests in empty\nhelp: "), "{told}");
}

#[test]
fn a_filter_picks_cases_by_their_names() {
    let lab = lab("test \"goes left\"\ntest \"Goes right\"\ntest \"stays\"\nexpect x = 1\n");
    let out = lab.succeed(&["test", "--filter", "GOES"]);
    assert!(out.contains("2 tests: 2 passed"), "{out}");
    let told = lab.fail(2, &["test", "--filter", "flies"]);
    assert!(told.starts_with("error: no test has \"flies\" in its name\nhelp: "), "{told}");
}

#[test]
fn all_mistakes_of_a_file_are_told_and_the_other_files_are_run() {
    let lab = lab("run at Ende\nexpect position 6 = 0\nexpect variable Goal = 1\n");
    lab.write("ok.test.txt", "module tmcm-6214\nexpect x = 0\n");
    let (status, out, errors) = lab.run(&["test"]);
    assert_eq!((status, &*errors), (1, "error: 1 file could not be run\n"));
    assert!(out.contains("ok      ok.test.txt"), "{out}");
    let told = "failed  wait.test.txt: it could not be run
  wait.test.txt:3: the program has no label Ende; did you mean End?
  wait.test.txt:4: there is no axis 6; TMCM-6214 has axes 0 to 5
  wait.test.txt:5: Goal is 6400, which is not a number from 0 to 255
";
    assert!(out.contains(told), "{out}");
}

#[test]
fn a_program_with_errors_is_told_as_elsewhere_and_its_tests_fail() {
    let lab = lab("test \"a\"\nrun at nowhere\n");
    lab.write("wait.tmc", "JA Nowhere\n");
    let (status, out, errors) = lab.run(&["test"]);
    assert_eq!(status, 1);
    assert!(errors.starts_with("error[unknown-label]: there is no label Nowhere"), "{errors}");
    assert!(errors.contains("wait.tmc:1:4"), "{errors}");
    assert!(out.contains("  wait.test.txt:2: wait.tmc: 1 error"), "{out}");
}

#[test]
fn programs_are_found_beside_the_test_and_includes_where_the_option_says() {
    let lab = Lab::with(&[
        ("tests/inner/a.test.txt", "module tmcm-6214\nprogram ../../src/a b.tmc\nexpect x = 0\n"),
        ("src/a b.tmc", "#include shared.inc\n"),
        ("lib/shared.inc", "MST 0\n"),
    ]);
    let (status, _, errors) = lab.run(&["test"]);
    assert_eq!(status, 1);
    assert!(errors.contains("include-not-found"), "{errors}");
    lab.succeed(&["test", "tests", "-I", "lib"]);
}

#[test]
fn json_has_an_object_for_each_case_and_for_each_file_that_cannot_be_run() {
    let lab = lab("test \"a\"\nrun\nwait 250 ms\nexpect x = 1\ntest \"b\"\n");
    lab.write("broken.test.txt", "module tmcm-6214\njump\n");
    let (status, out, _): Ran = lab.run(&["test", "--json"]);
    assert_eq!(status, 1);
    let objects: Vec<Value> = out.lines().map(|line| serde_json::from_str(line).unwrap()).collect();
    let [broken, a, b] = &objects[..] else { panic!("{out}") };
    assert_eq!(broken["file"], "broken.test.txt");
    assert_eq!(broken["passed"], false);
    assert_eq!(broken["mistakes"][0]["line"], 2);
    assert_eq!((&b["test"], &b["passed"]), (&json!("b"), &json!(true)));
    assert_eq!((&a["test"], &a["passed"], &a["line"]), (&json!("a"), &json!(false), &json!(3)));
    assert_eq!(
        a["failures"],
        json!([{
            "line": 6, "command": "expect x = 1", "expected": "1", "got": "0", "seconds": 0.25,
            "program": {"running": true, "address": 0, "file": "wait.tmc", "line": 3},
        }])
    );
}

#[test]
fn junit_has_a_suite_for_each_file_and_escapes_what_xml_reserves() {
    let lab = lab("test \"a < b & 'c' > \u{1}d\"\nrun\nwait 1500 ms\nexpect x >= 1, x > 1\n\
                   test \"fine\"\n");
    lab.write("broken.test.txt", "module tmcm-6214\njump & run\n");
    let (status, ..) = lab.run(&["test", "--junit", "out.xml"]);
    assert_eq!(status, 1);
    let text = lab.text("out.xml");
    let xml = roxmltree::Document::parse(&text).unwrap();
    let root = xml.root_element();
    let count = |node: roxmltree::Node<'_, '_>| {
        ["tests", "failures", "errors"].map(|name| node.attribute(name).unwrap().to_owned())
    };
    assert_eq!(
        (root.tag_name().name(), count(root)),
        ("testsuites", ["3", "1", "1"].map(Into::into))
    );
    let suites: Vec<_> = root.children().filter(roxmltree::Node::is_element).collect();
    let [broken, wait] = suites[..] else { panic!("{text}") };
    assert_eq!(broken.attribute("name"), Some("broken.test.txt"));
    assert_eq!(count(broken), ["1", "0", "1"]);
    let error = broken.descendants().find(|node| node.has_tag_name("error")).unwrap();
    assert!(error.text().unwrap().starts_with("broken.test.txt:2: \"jump & run\" is no step"));

    assert_eq!(count(wait), ["2", "1", "0"]);
    let cases: Vec<_> = wait.children().filter(|node| node.has_tag_name("testcase")).collect();
    let [bad, fine] = cases[..] else { panic!("{text}") };
    assert_eq!(bad.attribute("name"), Some("a < b & 'c' > \u{FFFD}d"));
    assert_eq!(bad.attribute("classname"), Some("wait.test.txt"));
    assert_eq!(fine.attribute("name"), Some("fine"));
    assert!(fine.descendants().all(|node| !node.has_tag_name("failure")));
    let failure = bad.descendants().find(|node| node.has_tag_name("failure")).unwrap();
    let message = "line 6: expect x >= 1: expected >= 1, got 0";
    assert_eq!(failure.attribute("message"), Some(message));
    let body = failure.text().unwrap();
    assert_eq!(body.lines().count(), 8, "both failures with four lines each: {body}");
    assert!(body.contains("wait.test.txt:6: expect x > 1\n  expected > 1\n  got      0\n"));
    let virtual_seconds = bad.descendants().find(|node| node.has_tag_name("property")).unwrap();
    assert_eq!(virtual_seconds.attribute("name"), Some("virtual-seconds"));
    let seconds: f64 = virtual_seconds.attribute("value").unwrap().parse().unwrap();
    assert_eq!(seconds, 1.5);
    for node in [root, broken, wait, bad, fine] {
        let wall: f64 = node.attribute("time").unwrap().parse().unwrap();
        assert!((0.0..20.0).contains(&wall), "{wall}");
    }
}

#[test]
fn a_file_that_cannot_be_written_is_a_failure() {
    let told = lab("").run(&["test", "--junit", "no/out.xml"]);
    assert_eq!(
        (told.0, &*told.2),
        (1, "error: cannot write no/out.xml: there is no such folder\n")
    );
}

#[test]
fn the_same_file_runs_through_conform_and_on_a_module_behind_a_port() {
    let lab = lab("test \"a\"\nrun\nwait until program stopped, at most 5 s\n\
                   expect variable Flag = 2\ntest \"b\"\ninput 3 high\nexpect x = 1\n\
                   test \"c\"\nexpect x = 9\n");
    let (status, out, _) = lab.run(&["conform", "wait.test.txt"]);
    assert_eq!(status, 1);
    assert_eq!(out.matches("wait.test.txt:9: expect x = 1").count(), 1, "{out}");
    assert_eq!(out.matches("wait.test.txt:11: expect x = 9").count(), 1, "{out}");

    let served = serve(&[]);
    let uri = format!("tcp:{}", served.tcp());
    let (status, out, errors) = lab.run(&["conform", "wait.test.txt", "-c", &uri]);
    assert_eq!((status, &*errors), (1, "error: 1 of 1 transcript failed\n"));
    assert!(out.contains("skipped from line 8: an input can be set only on a virtual"), "{out}");
    assert_eq!(out.matches("\n  wait.test.txt:").count(), 1, "{out}");
    assert!(
        out.contains("wait.test.txt:11: expect x = 9\n    expected 9\n    got      0"),
        "{out}"
    );
}

#[test]
fn results_take_the_place_of_no_test_and_no_program() {
    let lab = lab("run\n");
    for option in ["--junit", "--lcov"] {
        for name in ["wait.test.txt", "wait.tmc"] {
            let before = lab.bytes(name);
            let (status, _, errors) = lab.run(&["test", option, name]);
            let expected = format!("error: {name} is read, and would be overwritten\n");
            assert!(status == 2 && errors.starts_with(&expected), "{errors}");
            assert_eq!(lab.bytes(name), before, "{option}");
        }
    }
}

#[test]
fn who_names_a_program_in_place_of_a_test_is_told_what_a_test_is() {
    let lab = lab("run\n");
    for name in ["wait.tmc", "wait.bin"] {
        let (status, _, errors) = lab.run(&["test", name]);
        assert_eq!(status, 2);
        assert_eq!(
            errors,
            format!(
                "error: {name} is a program, not a test of one\n\
                 help: a test is a file *.test.txt with the line: program FILE\n"
            )
        );
    }
}
