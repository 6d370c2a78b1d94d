//! Faults of the lines: from the command line, from a scenario, and live.

use std::time::Duration;

use crate::common::{failure_of, serve, serve_what, stdout_of};
use crate::lab::Lab;
use opentmcl_link::{Client, Connection, ConnectionError};
use opentmcl_wire::{Command, Status};
use rustix::process::Signal;

/// How long a lost reply is waited for; others take far less than a millisecond.
const SHORT: Duration = Duration::from_millis(200);

const GET_VERSION: Command = Command::new(136, 1, 0, 0);

#[track_caller]
fn assert_silent(client: &mut Client) {
    client.set_timeout(SHORT);
    let error = client.request(1, GET_VERSION).unwrap_err();
    assert!(matches!(error, ConnectionError::Timeout(_)), "{error}");
}

#[track_caller]
fn assert_answers(client: &mut Client) {
    assert_eq!(client.request(1, GET_VERSION).unwrap().status, Status::OK);
}

#[test]
fn a_module_whose_replies_are_all_lost_is_silent_on_both_lines() {
    let served = serve(&["--faults", "drop=1"]);
    assert_silent(&mut served.tcp_client());
    assert_silent(&mut served.pty_client());
}

#[test]
fn faults_of_one_port_leave_the_other_alone() {
    let served = serve(&["--faults", "tcp:drop=1"]);
    assert_silent(&mut served.tcp_client());
    assert_answers(&mut served.pty_client());
    let served = serve(&["--faults", "pty:drop=1", "--faults", "tcp:requests.corrupt=1"]);
    assert_silent(&mut served.pty_client());
    let reply = served.tcp_client().request(1, GET_VERSION).unwrap();
    assert_eq!(reply.status, Status::WRONG_CHECKSUM);
}

#[test]
fn a_wrong_text_is_wrong_usage_with_what_would_be_right() {
    let (status, errors) = failure_of(&["serve", "tmcm-6214", "--faults", "dorp=0.1"]);
    assert_eq!(status, 2);
    assert!(errors.contains("\"dorp\" is no fault of a line"), "{errors}");
    assert!(errors.contains("drop, corrupt, truncate"), "{errors}");

    let (status, errors) = failure_of(&["serve", "tmcm-6214", "--faults", "usb:drop=0.1"]);
    assert_eq!(status, 2);
    assert!(errors.contains("there is no port \"usb\"\nhelp: the ports are pty, tcp"), "{errors}");
}

const SCENARIO: &str = r#"
[[module]]
name = "good"
model = "tmcm-6214"

[[module]]
name = "bad"
model = "tmcm-6214"
[[module.port]]
tcp = "127.0.0.1"
faults = "drop=1"
"#;

#[test]
fn a_scenario_has_faults_of_its_own_and_they_change_while_it_runs() {
    let lab = Lab::with(&[("lab.toml", SCENARIO)]);
    let served = serve_what(lab.path("lab.toml").to_str().unwrap(), &[]);
    assert_answers(&mut served.client_of(0));
    let mut bad = served.client_of(1);
    assert_silent(&mut bad);

    let counted = stdout_of(&["world", "-c", served.world(), "--json", "faults"]);
    let counted: serde_json::Value = serde_json::from_str(&counted).unwrap();
    let port = &counted["faults"][2];
    assert_eq!((&port["module"], &port["port"]), (&"bad".into(), &"tcp".into()));
    assert_eq!(port["faults"], "drop=1");
    assert_eq!((&port["requests"]["frames"], &port["requests"]["drop"]), (&1.into(), &0.into()));
    assert_eq!((&port["replies"]["frames"], &port["replies"]["drop"]), (&1.into(), &1.into()));

    assert_eq!(stdout_of(&["world", "-c", served.world(), "bad: faults tcp none"]), "ok\n");
    assert_answers(&mut bad);
    assert_eq!(stdout_of(&["world", "-c", served.world(), "good: faults all drop=1"]), "ok\n");
    assert_silent(&mut served.client_of(0));
    assert_answers(&mut bad);
    assert_eq!(served.end_with(Signal::INT), Some(0));
}

#[test]
fn faults_begin_at_the_time_that_a_scenario_says() {
    let text = "[[module]]\nmodel = \"tmcm-6214\"\n\
                [[module.at]]\ntime = \"60 s\"\ndo = \"faults tcp drop=1\"\n";
    let lab = Lab::with(&[("lab.toml", text)]);
    // At the largest speed the minute takes 60 ms.
    let path = lab.path("lab.toml");
    let served = serve_what(path.to_str().unwrap(), &["--speed", "1000"]);
    std::thread::sleep(Duration::from_millis(300));
    assert_silent(&mut served.client_of(0));

    let served = serve_what(path.to_str().unwrap(), &[]);
    assert_answers(&mut served.client_of(0));
}

#[test]
fn wrong_faults_in_a_scenario_are_found_before_it_is_served() {
    for (wrong, place) in [
        (SCENARIO.replace("drop=1", "dorp=1"), "lab.toml:9: faults: \"dorp\" is no fault"),
        (
            "[[module]]\nmodel = \"tmcm-6214\"\n\
             [[module.at]]\ntime = \"1 s\"\ndo = \"faults tcp drop=7\"\n"
                .into(),
            "lab.toml: faults tcp drop=7 of module tmcm-6214: drop: \"7\" is not a rate",
        ),
    ] {
        let lab = Lab::with(&[("lab.toml", &wrong)]);
        let errors = lab.fail(1, &["serve", "lab.toml"]);
        assert!(errors.contains(place), "{errors}");
    }
}

#[test]
fn mistakes_in_live_faults_are_told_and_change_nothing() {
    let lab = Lab::with(&[("lab.toml", SCENARIO)]);
    let served = serve_what(lab.path("lab.toml").to_str().unwrap(), &[]);
    for (line, message) in [
        ("good: faults usb drop=1", "there is no port \"usb\" (ports: pty, tcp, or all)"),
        ("good: faults tcp drop=7", "drop: \"7\" is not a rate"),
    ] {
        let (status, errors) = failure_of(&["world", "-c", served.world(), line]);
        assert_eq!(status, 1);
        assert!(errors.contains(message), "{errors}");
    }
    assert_answers(&mut served.client_of(0));
}
