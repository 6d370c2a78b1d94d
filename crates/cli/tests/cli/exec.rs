//! `tmcl exec`.

use crate::common::{failure_of, run, serve, stdout_of};

const VIRTUAL: &str = "virtual:tmcm-6214";

#[test]
fn commands_are_executed_in_order_on_one_module() {
    let text = stdout_of(&["exec", "-c", VIRTUAL, "SAP 4, 0, 77777", "GAP 4, 0", "GAP 4, 1"]);
    let lines: Vec<&str> = text.lines().collect();
    assert_eq!(lines[..4], ["> SAP 4, 0, 77777", "< 100 77777", "> GAP 4, 0", "< 100 77777"]);
    assert_eq!(lines[4], "> GAP 4, 1");
    assert_ne!(lines[5], "< 100 77777", "another axis");
}

#[test]
fn a_refused_command_ends_it_with_the_status_in_words() {
    // Axis 9 does not exist: status 4.
    let output = run(&["exec", "-c", VIRTUAL, "GAP 4, 9", "GAP 4, 0"]);
    assert_eq!(output.status.code(), Some(1));
    assert_eq!(String::from_utf8(output.stdout).unwrap(), "> GAP 4, 9\n< 4 0\n");
    assert_eq!(
        String::from_utf8(output.stderr).unwrap(),
        "error: GAP 4, 9: the module answers with status 4 (invalid value)\n"
    );
}

#[test]
fn the_bytes_are_shown_on_request() {
    // Firmware manual 3.1: ROR 0, 51200 to module 1.
    let text = stdout_of(&["exec", "-c", VIRTUAL, "--raw", "ROR 0, 51200"]);
    assert_eq!(
        text,
        "# ROR 0, 51200\n>> 01 01 00 00 00 00 C8 00 CA\n<< 02 01 64 01 00 00 C8 00 30\n# 100 51200\n"
    );
}

#[test]
fn json_has_one_object_per_command() {
    let text = stdout_of(&["exec", "-c", VIRTUAL, "--json", "SAP 4, 0, 77777", "GAP 4, 0"]);
    let objects: Vec<serde_json::Value> =
        text.lines().map(|line| serde_json::from_str(line).unwrap()).collect();
    let expected = |command| {
        let meaning = "successfully executed";
        serde_json::json!(
            {"command": command, "status": 100, "meaning": meaning, "value": 77777}
        )
    };
    assert_eq!(objects, [expected("SAP 4, 0, 77777"), expected("GAP 4, 0")]);
}

#[test]
fn the_version_as_text_is_shown_as_text() {
    assert_eq!(stdout_of(&["exec", "-c", VIRTUAL, "136 0, 0, 0"]), "> 136 0, 0, 0\n# 6214V116\n");
    let json = stdout_of(&["exec", "-c", VIRTUAL, "--json", "136 0, 0, 0"]);
    let json: serde_json::Value = serde_json::from_str(&json).unwrap();
    assert_eq!(json["version"], "6214V116");
}

#[test]
fn a_command_of_the_program_is_shown_as_a_command() {
    let download = ["exec", "-c", VIRTUAL, "132 0, 0, 7", "ROL 2, 500", "133 0, 0, 0"];
    let text = stdout_of(&[&download[..], &["134 0, 0, 7"]].concat());
    assert!(text.ends_with("> 134 0, 0, 7\n# ROL 2, 500\n"), "{text}");
    let json = stdout_of(&["exec", "-c", VIRTUAL, "--json", "134 0, 0, 0"]);
    let json: serde_json::Value = serde_json::from_str(&json).unwrap();
    assert_eq!(json["stored"], "0 0, 0, 0");
    let beyond = run(&["exec", "-c", VIRTUAL, "134 0, 0, 2048"]);
    assert_eq!(beyond.status.code(), Some(1));
}

#[test]
fn a_served_module_is_reached_over_both_lines() {
    let served = serve(&[]);
    let tcp = format!("tcp:{}", served.tcp());
    for uri in [served.pty(), &tcp] {
        let text = stdout_of(&["exec", "-c", uri, "SAP 4, 0, 12345", "GAP 4, 0"]);
        assert!(text.ends_with("> GAP 4, 0\n< 100 12345\n"), "{uri}: {text}");
    }
}

#[test]
fn a_wrong_address_is_silence_on_the_bus_and_does_not_matter_on_usb() {
    let served = serve(&[]);
    let tcp = format!("tcp:{}", served.tcp());
    let (status, errors) = failure_of(&["exec", "-c", &tcp, "--address", "7", "GAP 1, 0"]);
    assert_eq!(status, 1);
    assert!(errors.starts_with("error: no reply within 1000 ms\nhelp: "), "{errors}");
    assert!(errors.contains("--address"), "{errors}");

    let text = stdout_of(&["exec", "-c", served.pty(), "--address", "7", "GAP 1, 0"]);
    assert_eq!(text, "> GAP 1, 0\n< 100 0\n");
}
