//! `tmcl serve` with clients over TCP and the pseudo terminal.

use std::fs;
use std::io::{Read, Write};
use std::net::TcpStream;
use std::time::Duration;

use crate::common::{PATIENCE, failure_of, serve, tmcl};
use opentmcl_link::{Client, Connection};
use opentmcl_wire::serial::encode_request;
use opentmcl_wire::{Command, Status};
use rustix::process::Signal;

/// A pause after which a receiver expects a new frame, with much to spare: on a busy machine the
/// server may wake up late and see less of it.
const SILENCE: Duration = Duration::from_millis(100);

const GET_VERSION: Command = Command::new(136, 1, 0, 0);

#[track_caller]
fn assert_answers(client: &mut Client) {
    let reply = client.request(1, GET_VERSION).unwrap();
    assert_eq!((reply.status, reply.number), (Status::OK, 136));
    assert_eq!(reply.value >> 16, 6214);
}

#[test]
fn without_a_choice_both_lines_are_served_on_this_machine_only() {
    let served = serve(&[]);
    assert_eq!(served.endpoints["module"], "tmcm-6214");
    assert!(served.tcp().ip().is_loopback());
    assert_answers(&mut served.tcp_client());
    assert_answers(&mut served.pty_client());
}

#[test]
fn a_chosen_line_is_the_only_one() {
    assert!(serve(&["--tcp"]).endpoints["pty"].is_null());
    assert!(serve(&["--pty"]).endpoints["tcp"].is_null());
    let both = serve(&["--pty", "--tcp", "127.0.0.1:0"]);
    assert_answers(&mut both.tcp_client());
    assert_answers(&mut both.pty_client());
}

#[test]
fn people_get_the_endpoints_and_how_to_connect() {
    let mut child =
        tmcl(&["serve", "tmcm-6214"]).stdout(std::process::Stdio::piped()).spawn().unwrap();
    let mut text = String::new();
    let mut stdout = child.stdout.take().unwrap();
    let mut byte = [0];
    while !text.contains("pytrinamic.connections") && stdout.read(&mut byte).unwrap() == 1 {
        text.push(char::from(byte[0]));
    }
    child.kill().unwrap();
    child.wait().unwrap();
    assert!(text.starts_with("Virtual TMCM-6214, firmware 1.16."), "{text}");
    assert!(text.contains("--interface serial_tmcl --port /dev/pts/"), "{text}");
    assert!(text.contains("--interface socket_serial_tmcl --port 127.0.0.1:"), "{text}");
}

#[test]
fn signals_end_it_cleanly_and_take_the_link_along() {
    let folder = tempfile::tempdir().unwrap();
    let link = folder.path().join("module");
    let path = link.to_str().unwrap();
    for signal in [Signal::TERM, Signal::INT] {
        let served = serve(&["--pty", path]);
        assert_eq!(served.pty(), path);
        let mut client = served.pty_client();
        assert_answers(&mut client);
        assert_eq!(served.end_with(signal), Some(0));
        assert!(fs::symlink_metadata(&link).is_err(), "the link is still there");
    }
}

#[test]
fn an_existing_file_is_never_replaced() {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("thesis.txt");
    fs::write(&file, "ten years of work").unwrap();
    let (status, errors) = failure_of(&["serve", "tmcm-6214", "--pty", file.to_str().unwrap()]);
    assert_eq!(status, 1);
    assert!(errors.contains("exists already"), "{errors}");
    assert!(errors.contains("\nhelp: choose another path"), "{errors}");
    assert_eq!(fs::read_to_string(&file).unwrap(), "ten years of work");
}

#[test]
fn a_port_in_use_is_named_with_the_next_step() {
    let served = serve(&["--tcp"]);
    let address = served.tcp().to_string();
    let (status, errors) = failure_of(&["serve", "tmcm-6214", "--tcp", &address]);
    assert_eq!(status, 1);
    assert!(errors.contains(&address), "{errors}");
    assert!(errors.contains("\nhelp: another program listens there"), "{errors}");
}

#[test]
fn clients_come_and_go_and_vanish() {
    let served = serve(&[]);
    let mut staying = served.tcp_client();
    for _ in 0..10 {
        assert_answers(&mut served.tcp_client());
        assert_answers(&mut served.pty_client());
        // Gone in the middle of a frame, with a reply unread.
        let mut vanishing = TcpStream::connect(served.tcp()).unwrap();
        vanishing.write_all(&encode_request(1, GET_VERSION)).unwrap();
        vanishing.write_all(&[1, 136, 1]).unwrap();
        drop(vanishing);
        let mut vanishing = fs::File::options().write(true).open(served.pty()).unwrap();
        vanishing.write_all(&[1, 136, 1]).unwrap();
        drop(vanishing);
        assert_answers(&mut staying);
        // The next client's frame begins anew only after a silence, as on a real line.
        std::thread::sleep(SILENCE);
    }
}

#[test]
fn half_a_frame_then_silence_then_a_good_frame_is_answered() {
    let served = serve(&[]);
    for mut client in [served.tcp_client(), served.pty_client()] {
        client.send(&encode_request(1, GET_VERSION)[..5]).unwrap();
        std::thread::sleep(SILENCE);
        assert_answers(&mut client);
    }
}

#[test]
fn a_damaged_frame_is_answered_with_status_1() {
    let served = serve(&[]);
    for mut client in [served.tcp_client(), served.pty_client()] {
        let mut damaged = encode_request(1, GET_VERSION);
        damaged[8] ^= 1;
        let reply = client.exchange(damaged).unwrap();
        assert_eq!(reply, [2, 1, 1, 0, 0, 0, 0, 0, 4]);
        assert_answers(&mut client);
    }
}

#[test]
fn the_eeprom_file_outlives_the_module_and_belongs_to_one_at_a_time() {
    // Parameter 0 of bank 2, a user variable, is stored with STGP.
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("eeprom");
    let file = file.to_str().unwrap();
    let served = serve(&["--eeprom", file]);
    let mut client = served.tcp_client();
    for command in [Command::new(9, 0, 2, 4711), Command::new(11, 0, 2, 0)] {
        assert_eq!(client.request(1, command).unwrap().status, Status::OK);
    }

    let (status, errors) = failure_of(&["serve", "tmcm-6214", "--eeprom", file]);
    assert_eq!(status, 1);
    assert!(errors.contains("is in use by another module"), "{errors}");

    // Not even the chance to say goodbye.
    served.end_with(Signal::KILL);
    let served = serve(&["--eeprom", file]);
    let value = served.tcp_client().request(1, Command::new(10, 0, 2, 0)).unwrap().value;
    assert_eq!(value, 4711);
}

#[test]
fn a_file_that_is_no_eeprom_is_left_alone() {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("photo.jpg");
    fs::write(&file, [7; 100]).unwrap();
    let (status, errors) = failure_of(&["serve", "tmcm-6214", "--eeprom", file.to_str().unwrap()]);
    assert_eq!(status, 1);
    assert!(errors.contains("it has 100 bytes, not 32768"), "{errors}");
    assert_eq!(fs::read(&file).unwrap(), [7; 100]);
}

#[test]
fn a_speed_outside_of_the_range_is_wrong_usage() {
    for speed in ["0", "1001", "fast", "-1", "nan"] {
        let (status, _) = failure_of(&["serve", "tmcm-6214", &format!("--speed={speed}")]);
        assert_eq!(status, 2, "{speed}");
    }
}

/// How often the process has been put to sleep so far: each wake-up ends with one more.
#[cfg(target_os = "linux")]
fn sleeps(id: u32) -> u64 {
    let status = fs::read_to_string(format!("/proc/{id}/status")).unwrap();
    let line = status.lines().find_map(|line| line.strip_prefix("voluntary_ctxt_switches:"));
    line.unwrap().trim().parse().unwrap()
}

#[test]
#[cfg(target_os = "linux")]
fn a_module_at_rest_does_not_wake_up() {
    let served = serve(&[]);
    let mut client = served.pty_client();
    assert_answers(&mut client);
    std::thread::sleep(Duration::from_millis(100));
    let before = sleeps(served.id());
    std::thread::sleep(Duration::from_secs(1));
    assert_eq!(sleeps(served.id()), before);
    assert_answers(&mut client);
    // The reply is here before the server has gone to sleep again.
    let start = std::time::Instant::now();
    while sleeps(served.id()) == before {
        assert!(start.elapsed() < PATIENCE, "otherwise nothing is counted");
        std::thread::sleep(Duration::from_millis(1));
    }
}

#[test]
#[cfg(target_os = "linux")]
fn a_moving_axis_is_left_alone_between_two_events() {
    let served = serve(&[]);
    let mut client = served.pty_client();
    // A speed that is reached within the time, then a long cruise.
    let reply = client.request(1, Command::new(1, 0, 0, 51200)).unwrap();
    assert_eq!(reply.status, Status::OK);
    let start = std::time::Instant::now();
    loop {
        let speed = client.request(1, Command::new(6, 3, 0, 0)).unwrap().value;
        if speed == 51200 {
            break;
        }
        assert!(start.elapsed() < PATIENCE, "{speed} pps");
        std::thread::sleep(Duration::from_millis(20));
    }
    std::thread::sleep(Duration::from_millis(100));
    let before = sleeps(served.id());
    std::thread::sleep(Duration::from_secs(1));
    assert_eq!(sleeps(served.id()), before);
}
