//! `tmcl run`, `stop`, `step`, `reset` and `status`.

use std::net::TcpListener;
use std::time::{Duration, Instant};

use crate::common::{PATIENCE, failure_of, run, serve, stdout_of};
use crate::download::file;

/// Counts in the accumulator, then stands; `wait` waits for longer than any test.
const SOURCE: &str = "\
count: CALC ADD, 5
       CALCX LOAD
       STOP
wait:  WAIT TICKS, 0, 100000
       STOP
";

#[test]
fn a_program_is_stepped_run_stopped_and_reset() {
    let (_folder, source) = file("count.tmc", SOURCE);
    let served = serve(&[]);
    let source = source.to_str().unwrap();
    stdout_of(&["download", source, "-c", served.pty()]);
    let after = |command: &str| stdout_of(&[command, "-c", served.pty()]);

    let state =
        "stopped at address 0\n  command      CALC ADD, 5\n  accumulator  0\n  X            0\n";
    assert_eq!(after("status"), state);
    assert_eq!(
        after("step"),
        "single step at address 1\n  command      CALCX LOAD\n  accumulator  5\n  X            0\n"
    );
    let before_the_stop =
        "single step at address 2\n  command      STOP\n  accumulator  5\n  X            5\n";
    assert_eq!(after("step"), before_the_stop);
    assert_eq!(after("status"), before_the_stop, "looking changes nothing");
    // The program stops by itself, then waits.
    after("run");
    let waiting = after("run");
    assert!(waiting.starts_with("running at address 3"), "{waiting}");
    std::thread::sleep(Duration::from_millis(50));
    assert!(after("status").starts_with("running at address 3, in a WAIT\n"));
    assert!(after("stop").starts_with("stopped at address 3\n"));
    assert_eq!(after("reset"), state.replace("stopped", "reset"));
}

#[test]
fn run_starts_at_an_address_or_a_label() {
    let (_folder, source) = file("count.tmc", SOURCE);
    let source = source.to_str().unwrap();
    let served = serve(&[]);
    stdout_of(&["download", source, "-c", served.pty()]);
    let run_at = |at: &str| stdout_of(&["run", "-c", served.pty(), "-f", source, "--at", at]);
    for at in ["wait", "WAIT", "3"] {
        stdout_of(&["reset", "-c", served.pty()]);
        assert!(run_at(at).starts_with("running at address 3"), "{at}");
    }
    run_at("count");
    std::thread::sleep(Duration::from_millis(50));
    let state = stdout_of(&["status", "-c", served.pty()]);
    assert!(state.starts_with("stopped at address 3\n"), "{state}");
    assert!(state.contains("accumulator  5\n"), "{state}");
}

#[test]
fn a_label_that_is_not_there_is_wrong_usage_and_nothing_is_opened() {
    let (_folder, source) = file("count.tmc", SOURCE);
    let source = source.to_str().unwrap();
    let nowhere = ["run", "-c", "/dev/no-such-port", "--at"];
    assert_eq!(
        failure_of(&[&nowhere[..], &["wate", "--file", source]].concat()),
        (2, "error: the program has no label \"wate\"\nhelp: did you mean wait?\n".into())
    );
    assert_eq!(
        failure_of(&[&nowhere[..], &["xyz", "--file", source]].concat()),
        (2, "error: the program has no label \"xyz\"\nhelp: it has count, wait\n".into())
    );
    for address in ["2048", "70000", "-1"] {
        let at = format!("--at={address}");
        assert_eq!(
            failure_of(&["run", "-c", "/dev/no-such-port", &at]),
            (
                2,
                format!(
                    "error: address {address} is outside of the memory\n\
                     help: it holds addresses 0 to 2047\n"
                )
            )
        );
    }
    let (status, errors) = failure_of(&[&nowhere[..], &["wait"]].concat());
    assert_eq!(status, 2);
    assert!(errors.contains("--file"), "{errors}");
}

#[test]
fn the_line_of_the_source_is_shown_if_it_is_the_program_on_the_module() {
    let (_folder, source) = file("count.tmc", SOURCE);
    let source = source.to_str().unwrap();
    let served = serve(&[]);
    stdout_of(&["download", source, "-c", served.pty()]);
    stdout_of(&["step", "-c", served.pty()]);
    let status = ["status", "-c", served.pty(), "--file", source];
    let state = stdout_of(&status);
    assert!(state.contains(&format!("\n  source       {source}:2: CALCX LOAD\n")), "{state}");
    let json: serde_json::Value =
        serde_json::from_str(&stdout_of(&[&status[..], &["--json"]].concat())).unwrap();
    assert_eq!(
        json,
        serde_json::json!({
            "mode": "single step", "waiting": false, "address": 1, "command": "CALCX LOAD",
            "file": source, "line": 2, "accumulator": 5, "x": 0,
        })
    );

    let (_folder, other) = file("other.tmc", "STOP\nSTOP\n");
    let state = stdout_of(&["status", "-c", served.pty(), "--file", other.to_str().unwrap()]);
    assert!(state.contains("\n  source       not this file: it has another command here\n"));
}

#[test]
fn the_end_of_the_program_is_named() {
    let state = stdout_of(&["status", "-c", "virtual:tmcm-6214"]);
    assert!(state.contains("\n  command      none: end of the program\n"), "{state}");
}

#[test]
fn looking_at_the_state_does_not_disturb_a_download() {
    let served = serve(&[]);
    stdout_of(&["exec", "-c", served.pty(), "132 0, 0, 0", "CALC ADD, 1"]);
    stdout_of(&["status", "-c", served.pty()]);
    let text = stdout_of(&["exec", "-c", served.pty(), "STOP", "133 0, 0, 0"]);
    assert!(text.starts_with("> STOP\n< 101 0\n"), "{text}");
    assert_eq!(
        stdout_of(&["upload", "-c", served.pty()]),
        "          CALC ADD, 1\n          STOP\n"
    );
}

#[test]
fn a_module_that_does_not_answer_is_given_up_in_bounded_time() {
    let listener = TcpListener::bind("127.0.0.1:0").unwrap();
    let uri = format!("tcp:{}", listener.local_addr().unwrap());
    let start = Instant::now();
    let output = run(&["step", "-c", &uri]);
    assert!(start.elapsed() < PATIENCE, "{:?}", start.elapsed());
    assert_eq!(output.status.code(), Some(1));
    assert!(String::from_utf8(output.stderr).unwrap().contains("failed in 3 attempts"));
}
