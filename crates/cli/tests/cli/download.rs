//! `tmcl download` and `tmcl upload`.

use std::fs;
use std::io::{Read, Write};
use std::net::{SocketAddr, TcpListener, TcpStream};
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

use rustix::process::Signal;
use tempfile::TempDir;

use crate::common::{PATIENCE, failure_of, run, serve, stdout_of};

const SOURCE: &str = "\
// To and fro, three times.
        SGP 10, 2, 3
again:  MVP ABS, 0, 6400
        WAIT POS, 0, 0
        MVP ABS, 0, 0
        WAIT POS, 0, 0
        DJNZ 10, again
        STOP
";

/// As the disassembler lays it out: commands from column 10, a label where a jump leads to.
const UPLOADED: &str = "          SGP 10, 2, 3

Lbl1:     MVP ABS, 0, 6400
          WAIT POS, 0, 0
          MVP ABS, 0, 0
          WAIT POS, 0, 0
          DJNZ 10, Lbl1
          STOP
";

/// The same by hand: opcode, type, motor or bank, value with the highest byte first, and the sum.
const BINARY: [[u8; 8]; 7] = [
    [9, 10, 2, 0, 0, 0, 3, 24],
    [4, 0, 0, 0, 0, 0x19, 0x00, 0x1D],
    [27, 1, 0, 0, 0, 0, 0, 28],
    [4, 0, 0, 0, 0, 0, 0, 4],
    [27, 1, 0, 0, 0, 0, 0, 28],
    [49, 10, 0, 0, 0, 0, 1, 60],
    [28, 0, 0, 0, 0, 0, 0, 28],
];

/// A folder with a file in it.
pub(crate) fn file(name: &str, contents: impl AsRef<[u8]>) -> (TempDir, PathBuf) {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join(name);
    fs::write(&path, contents).unwrap();
    (folder, path)
}

fn text(path: &Path) -> &str {
    path.to_str().unwrap()
}

/// The value that a command reads.
fn value(uri: &str, command: &str) -> String {
    let text = stdout_of(&["exec", "-c", uri, command]);
    text.lines().last().unwrap().strip_prefix("< 100 ").unwrap().to_owned()
}

#[test]
fn a_program_gets_onto_the_module_and_back_over_both_lines() {
    let (folder, source) = file("stage.tmc", SOURCE);
    let served = serve(&[]);
    let tcp = format!("tcp:{}", served.tcp());
    for uri in [served.pty(), &tcp] {
        let done = stdout_of(&["download", text(&source), "-c", uri, "--verify"]);
        assert!(done.starts_with("7 commands downloaded and verified in 0."), "{done}");
        assert_eq!(stdout_of(&["upload", "-c", uri]), UPLOADED);
        let named = stdout_of(&["upload", "-c", uri, "--names"]);
        assert!(named.starts_with("// module: tmcm-6214\n#include tmcm-6214.inc\n"), "{named}");

        let binary = folder.path().join("stage.bin");
        let done = stdout_of(&["upload", "-c", uri, "-o", text(&binary)]);
        assert_eq!(done, format!("{}: 7 commands\n", text(&binary)));
        assert_eq!(fs::read(&binary).unwrap(), BINARY.as_flattened());

        stdout_of(&["exec", "-c", uri, "132 0, 0, 0", "STOP", "0 0, 0, 0", "133 0, 0, 0"]);
        assert_eq!(stdout_of(&["upload", "-c", uri]), "          STOP\n");
        stdout_of(&["download", text(&binary), "-c", uri]);
        let again = folder.path().join("again.tmc");
        stdout_of(&["upload", "-c", uri, "-o", text(&again)]);
        assert_eq!(fs::read_to_string(&again).unwrap(), UPLOADED);
        stdout_of(&["download", text(&again), "-c", uri, "--verify"]);
        stdout_of(&["upload", "-c", uri, "-o", text(&binary)]);
        assert_eq!(fs::read(&binary).unwrap(), BINARY.as_flattened(), "by way of its source");
    }
}

#[test]
fn auto_start_and_run_start_the_program() {
    let (folder, source) = file("endless.tmc", "here: JA here\n");
    let eeprom = folder.path().join("eeprom");
    let served = serve(&["--eeprom", text(&eeprom)]);
    let download = ["download", text(&source), "-c", served.pty()];
    stdout_of(&download);
    assert_eq!(value(served.pty(), "GGP 128, 0"), "0");
    let done = stdout_of(&[&download[..], &["--run", "--autostart", "on"]].concat());
    assert!(done.ends_with(" s; auto start is on; started\n"), "{done}");
    assert_eq!(value(served.pty(), "GGP 128, 0"), "1");
    assert_eq!(served.end_with(Signal::TERM), Some(0));

    let served = serve(&["--eeprom", text(&eeprom)]);
    assert_eq!(value(served.pty(), "GGP 128, 0"), "1", "after switching on");
    let done = stdout_of(&["download", text(&source), "-c", served.pty(), "--autostart", "off"]);
    assert!(done.ends_with(" s; auto start is off\n"), "{done}");
    assert_eq!(value(served.pty(), "GGP 128, 0"), "0", "a download stops what runs");
    assert_eq!(served.end_with(Signal::TERM), Some(0));

    let served = serve(&["--eeprom", text(&eeprom)]);
    assert_eq!(value(served.pty(), "GGP 128, 0"), "0");
}

#[test]
fn run_begins_with_a_reset() {
    let (_folder, source) = file("count.tmc", "CALC ADD, 1\nSTOP\nSecond: CALC ADD, 10\nSTOP\n");
    let served = serve(&[]);
    for _ in 0..2 {
        stdout_of(&["download", text(&source), "-c", served.pty(), "--run"]);
    }
    assert_eq!(value(served.pty(), "135 2, 0, 0"), "1", "1 + 10 without it");
}

#[test]
fn json_says_what_was_done() {
    let (_folder, source) = file("stage.tmc", SOURCE);
    let download = ["download", text(&source), "-c", "virtual:tmcm-6214", "--json"];
    let json = |more: &[&str]| -> serde_json::Value {
        serde_json::from_str(&stdout_of(&[&download[..], more].concat())).unwrap()
    };
    let mut done = json(&[]);
    assert!(done["seconds"].take().as_f64().is_some_and(|seconds| seconds < 20.0));
    let mut expected = serde_json::json!({
        "module": 6214, "firmware": "1.16", "commands": 7, "seconds": null,
        "verified": false, "auto_start": null, "started": false,
    });
    assert_eq!(done, expected);
    done = json(&["--verify", "--autostart", "on", "--run"]);
    done["seconds"].take();
    for (field, value) in [("verified", true), ("auto_start", true), ("started", true)] {
        expected[field] = value.into();
    }
    assert_eq!(done, expected);
}

#[test]
fn a_program_longer_than_the_memory_is_refused_before_anything_is_sent() {
    let (_folder, binary) = file("long.bin", [28, 0, 0, 0, 0, 0, 0, 28].repeat(2049));
    let (_folder, source) = file("stage.tmc", SOURCE);
    let served = serve(&[]);
    stdout_of(&["download", text(&source), "-c", served.pty()]);
    let (status, errors) = failure_of(&["download", text(&binary), "-c", served.pty()]);
    assert_eq!(status, 1);
    assert!(errors.contains("2049") && errors.contains("2048"), "{errors}");
    assert_eq!(stdout_of(&["upload", "-c", served.pty()]), UPLOADED);
}

#[test]
fn a_command_that_would_be_executed_at_once_is_no_part_of_a_program() {
    // 137 with value 1234 = $4D2 forgets all settings.
    let (_folder, binary) = file("reset.bin", [137, 0, 0, 0, 0, 4, 0xD2, 0x5F]);
    let served = serve(&[]);
    stdout_of(&["exec", "-c", served.pty(), "SGP 77, 0, 1"]);
    let (status, errors) = failure_of(&["download", text(&binary), "-c", served.pty()]);
    assert_eq!(status, 1);
    assert!(errors.contains("137"), "{errors}");
    assert_eq!(value(served.pty(), "GGP 77, 0"), "1");
}

#[test]
fn a_protected_program_is_left_alone_and_the_error_says_what_to_do() {
    let (_folder, source) = file("stage.tmc", SOURCE);
    let served = serve(&[]);
    stdout_of(&["download", text(&source), "-c", served.pty()]);
    let (_folder, other) = file("other.tmc", "STOP\n");
    let download = ["download", text(&other), "-c", served.pty()];

    stdout_of(&["exec", "-c", served.pty(), "SGP 81, 0, 2"]);
    assert_eq!(
        failure_of(&download),
        (
            1,
            "error: the program on the module is protected against overwriting (global parameter \
             81)\nhelp: `tmcl exec -c URI 'SGP 81, 0, 0'` lifts the protection\n"
                .into()
        )
    );
    assert_eq!(stdout_of(&["upload", "-c", served.pty()]), UPLOADED);

    stdout_of(&["exec", "-c", served.pty(), "SGP 81, 0, 3"]);
    let (_, errors) = failure_of(&download);
    assert!(errors.ends_with("lifts the protection and erases the program\n"), "{errors}");

    stdout_of(&["exec", "-c", served.pty(), "SGP 81, 0, 1"]);
    let (status, errors) = failure_of(&["upload", "-c", served.pty()]);
    assert_eq!(status, 1);
    assert!(errors.starts_with("error: the program on the module is protected against reading"));
    let (_, errors) = failure_of(&[&download[..], &["--verify"]].concat());
    assert!(errors.starts_with("error: the program cannot be verified: it is protected"));
    stdout_of(&download);
}

#[test]
fn a_module_without_a_program_has_nothing_to_upload() {
    let (status, errors) = failure_of(&["upload", "-c", "virtual:tmcm-6214"]);
    assert_eq!(status, 1);
    assert!(errors.starts_with("error: there is no program on the module"), "{errors}");
    assert!(errors.contains("\nhelp: `tmcl download FILE"), "{errors}");
}

#[test]
fn a_file_that_is_not_there_or_cannot_be_written_is_named() {
    let (status, errors) = failure_of(&["download", "no-such.tmc", "-c", "virtual:tmcm-6214"]);
    assert_eq!(status, 1);
    assert!(errors.contains("no-such.tmc"), "{errors}");

    let served = serve(&[]);
    stdout_of(&["exec", "-c", served.pty(), "132 0, 0, 0", "STOP", "133 0, 0, 0"]);
    let (status, errors) = failure_of(&["upload", "-c", served.pty(), "-o", "/no-such/a.tmc"]);
    assert_eq!(status, 1);
    assert!(errors.starts_with("error: cannot write /no-such/a.tmc: "), "{errors}");
}

#[test]
fn wrong_usage_is_told_before_anything_is_opened() {
    let (_folder, source) = file("stage.tmc", SOURCE);
    let (status, errors) = failure_of(&["download", text(&source)]);
    assert_eq!(status, 2);
    assert!(errors.contains("--connect <URI>"), "{errors}");
    let nowhere = ["download", text(&source), "-c", "/dev/no-such-port"];
    let (status, errors) = failure_of(&[&nowhere[..], &["--module", "tmcm6214"]].concat());
    assert_eq!(status, 2);
    assert!(errors.contains("did you mean tmcm-6214?"), "{errors}");
    let (status, _) = failure_of(&[&nowhere[..], &["--autostart", "maybe"]].concat());
    assert_eq!(status, 2);
}

#[test]
fn a_module_that_does_not_answer_is_given_up_in_bounded_time() {
    let listener = TcpListener::bind("127.0.0.1:0").unwrap();
    let uri = format!("tcp:{}", listener.local_addr().unwrap());
    let (_folder, source) = file("stage.tmc", SOURCE);
    for args in [&["download", text(&source), "-c", &uri][..], &["upload", "-c", &uri]] {
        let start = Instant::now();
        let output = run(args);
        // Three attempts of one second each, and what a busy machine adds.
        assert!(start.elapsed() < PATIENCE, "{:?}", start.elapsed());
        assert_eq!(output.status.code(), Some(1));
        let errors = String::from_utf8(output.stderr).unwrap();
        assert!(errors.contains("failed in 3 attempts; at last: no reply within 1000 ms"));
        assert!(errors.contains("\nhelp: check cable, power and termination"), "{errors}");
    }
}

/// What becomes of a frame, by its number from 0.
type Mangle = fn(usize, [u8; 9]) -> Vec<u8>;

/// A line to the module on which requests and replies change.
fn line(module: SocketAddr, requests: Mangle, replies: Mangle) -> String {
    let listener = TcpListener::bind("127.0.0.1:0").unwrap();
    let address = listener.local_addr().unwrap();
    std::thread::spawn(move || {
        let (client, _) = listener.accept().unwrap();
        let module = TcpStream::connect(module).unwrap();
        let back = (module.try_clone().unwrap(), client.try_clone().unwrap());
        std::thread::spawn(move || pass(back.0, back.1, replies));
        pass(client, module, requests);
    });
    format!("tcp:{address}")
}

fn pass(mut from: TcpStream, mut to: TcpStream, mangle: Mangle) {
    let mut frame = [0; 9];
    for number in 0.. {
        // The end of the test is the end of the line.
        if from.read_exact(&mut frame).and_then(|()| to.write_all(&mangle(number, frame))).is_err()
        {
            return;
        }
    }
}

fn unchanged(_: usize, frame: [u8; 9]) -> Vec<u8> {
    frame.to_vec()
}

#[test]
fn a_bad_line_costs_time_and_not_the_program() {
    let (_folder, source) = file("stage.tmc", SOURCE);
    let served = serve(&[]);
    // 0 to 3 are the type of the module, its protection and the start; then come the commands.
    let uri = line(served.tcp(), unchanged, |number, frame| match number {
        1 | 6 => vec![],
        9 => frame[1..].to_vec(),
        _ => frame.to_vec(),
    });
    let start = Instant::now();
    let done = stdout_of(&["download", text(&source), "-c", &uri]);
    assert!(start.elapsed() >= Duration::from_secs(3), "the line was good: {done}");
    assert_eq!(stdout_of(&["upload", "-c", served.pty()]), UPLOADED);
}

#[test]
fn verify_finds_what_no_reply_shows() {
    let (_folder, source) = file("stage.tmc", SOURCE);
    let served = serve(&[]);
    // Type and checksum of MVP ABS, 0, 6400 changed alike: MVP REL.
    let to_relative: Mangle = |_, mut frame| {
        if frame[1..] == [4, 0, 0, 0, 0, 0x19, 0x00, 0x1E] {
            frame[2] += 1;
            frame[8] += 1;
        }
        frame.to_vec()
    };
    let download = |more: &[&str]| {
        let uri = line(served.tcp(), to_relative, unchanged);
        run(&[&["download", text(&source), "-c", &uri], more].concat())
    };
    assert!(download(&[]).status.success());
    let output = download(&["--verify"]);
    assert_eq!(output.status.code(), Some(1));
    assert_eq!(
        String::from_utf8(output.stderr).unwrap(),
        "error: address 1 holds MVP REL, 0, 6400 instead of MVP ABS, 0, 6400\n\
         help: does another program talk to the module? What it sends during a download is stored, \
         too; end it and download again, and if it stays so, check the line\n"
    );
}
