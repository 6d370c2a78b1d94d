//! The workflow that the book offers: it is YAML, and its commands do what they should.

use saphyr::{LoadableYamlNode, Yaml};

use crate::lab::Lab;

const WORKFLOW: &str = include_str!("../../../../docs/examples/tmcl-ci.yml");

const TEST: &str = "module tmcm-6214\nprogram spin.tmc\nrun\nwait until speed 0 = 500\n";

/// The steps of the only job.
fn steps<'a>(workflow: &'a Yaml<'a>) -> &'a [Yaml<'a>] {
    workflow["jobs"]["programs"]["steps"].as_vec().unwrap()
}

fn run_of<'a>(step: &'a Yaml<'a>) -> Option<&'a str> {
    step.as_mapping_get("run")?.as_str()
}

/// What the workflow runs of `tmcl`, each with its operands.
fn commands(workflow: &Yaml<'_>) -> Vec<Vec<String>> {
    let runs = steps(workflow).iter().filter_map(run_of);
    let words = runs.map(|run| run.split_whitespace().map(str::to_owned).collect::<Vec<_>>());
    words.filter(|words| words[0] == "tmcl").map(|words| words[1..].to_vec()).collect()
}

fn run_all(lab: &Lab, workflow: &Yaml<'_>) -> Vec<i32> {
    let run = |words: &Vec<String>| lab.output(words, b"").status.code().unwrap();
    commands(workflow).iter().map(run).collect()
}

#[test]
fn the_workflow_checks_formats_and_tests_and_keeps_what_it_writes() {
    let documents = Yaml::load_from_str(WORKFLOW).unwrap();
    let [workflow] = &documents[..] else { panic!("one document") };
    for trigger in ["push", "pull_request"] {
        assert!(workflow["on"].as_mapping_get(trigger).is_some(), "{trigger}");
    }
    let lab = Lab::with(&[("spin.tmc", "    ROR 0, 500\n"), ("spin.test.txt", TEST)]);
    assert_eq!(run_all(&lab, workflow), [0, 0, 0]);
    let kept = steps(workflow).last().unwrap();
    assert_eq!(kept["if"].as_str(), Some("always()"));
    let names = kept["with"]["path"].as_str().unwrap();
    for name in names.lines() {
        assert!(!lab.text(name).is_empty(), "{name}");
    }

    for (name, text, statuses) in [
        ("spin.tmc", "    ROR 0, Speed\n", [1, 0, 1]),
        ("spin.tmc", "ror 0,500\n", [0, 1, 0]),
        ("spin.test.txt", "module tmcm-6214\nexpect x = 1\n", [0, 0, 1]),
    ] {
        let lab = Lab::with(&[("spin.tmc", "    ROR 0, 500\n"), ("spin.test.txt", TEST)]);
        lab.write(name, text);
        assert_eq!(run_all(&lab, workflow), statuses, "{text}");
    }
}
