//! Help, errors and exit statuses.

use crate::common::{failure_of, run, stdout_of, tmcl};

#[test]
fn every_subcommand_has_help_with_an_example_of_itself() {
    let main = stdout_of(&["--help"]);
    let names: Vec<&str> = main
        .lines()
        .skip_while(|line| *line != "Commands:")
        .skip(1)
        .take_while(|line| !line.is_empty())
        .filter_map(|line| line.split_whitespace().next())
        .filter(|name| *name != "help")
        .collect();
    assert!(names.len() >= 3, "{names:?}");
    for name in names {
        let help = stdout_of(&[name, "--help"]);
        let examples = help.split_once("\nExamples").map(|(_, examples)| examples);
        assert!(examples.is_some_and(|text| text.contains(&format!("tmcl {name}"))), "{help}");
    }
}

#[test]
fn no_subcommand_is_wrong_usage_and_shows_the_help() {
    let (status, errors) = failure_of(&[]);
    assert_eq!(status, 2);
    assert!(errors.contains("Usage: tmcl"), "{errors}");
}

#[test]
fn an_unknown_module_is_answered_with_the_nearest_name() {
    for args in [
        &["modules", "tmcm6214"][..],
        &["serve", "tmcm6214"],
        &["exec", "-c", "virtual:tmcm6214", "GAP 1, 0"],
        &["download", "-c", "virtual:tmcm-6214", "-m", "tmcm6214", "stage.tmc"],
        &["lsp", "-m", "tmcm6214"],
    ] {
        let expected = "error: there is no module \"tmcm6214\"\n\
                        help: did you mean tmcm-6214? `tmcl modules` lists all\n";
        assert_eq!(failure_of(args), (2, expected.into()));
    }
}

#[test]
fn what_is_no_connection_or_no_command_is_wrong_usage() {
    let (status, errors) = failure_of(&["exec", "-c", "usb:0", "GAP 1, 0"]);
    assert_eq!(status, 2);
    assert!(errors.contains("tcp:127.0.0.1:4016"), "{errors}");

    let (status, errors) = failure_of(&["exec", "-c", "virtual:tmcm-6214", "GAP 1, 0", "GO 1"]);
    assert_eq!(status, 2);
    assert!(errors.contains("unknown command \"GO\""), "{errors}");
}

#[test]
fn a_connection_that_cannot_be_opened_fails_with_the_next_step() {
    let (status, errors) = failure_of(&["exec", "-c", "/dev/no-such-port", "GAP 1, 0"]);
    assert_eq!(status, 1);
    assert!(errors.starts_with("error: there is no port /dev/no-such-port\nhelp: "), "{errors}");
}

#[test]
fn colour_is_used_only_where_it_is_wanted() {
    let args = ["modules", "tmcm6214"];
    let plain = run(&args).stderr;
    assert!(!plain.contains(&0x1B));
    let forced = tmcl(&args).env("CLICOLOR_FORCE", "1").output().unwrap().stderr;
    assert!(forced.contains(&0x1B), "otherwise this test would prove nothing");
    assert_eq!(tmcl(&args).env("NO_COLOR", "1").output().unwrap().stderr, plain);
}

#[test]
fn a_reader_that_has_seen_enough_is_no_error() {
    let mut child = tmcl(&["modules", "tmcm-6214"])
        .stdout(std::process::Stdio::piped())
        .stderr(std::process::Stdio::piped())
        .spawn()
        .unwrap();
    drop(child.stdout.take());
    let output = child.wait_with_output().unwrap();
    assert!(output.status.success());
    assert_eq!(String::from_utf8(output.stderr).unwrap(), "");
}
