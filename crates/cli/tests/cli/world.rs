//! Scenarios with several modules, and `tmcl world`.

use std::fs;
use std::io::{BufRead, BufReader, Read};
use std::os::unix::fs::PermissionsExt;
use std::os::unix::net::UnixListener;
use std::process::Stdio;

use crate::common::{Served, failure_of, serve, serve_what, stdout_of, tmcl};
use crate::lab::Lab;
use opentmcl_link::{Client, Connection};
use opentmcl_wire::{Command, Status};
use rustix::process::{Pid, Signal, kill_process};
use serde_json::Value;

const SCENARIO: &str = r#"
[[module]]
name = "xy"
model = "tmcm-6214"
eeprom = "xy.eeprom"
[[module.axis]]
axis = 0
motor = "nema17"
transmission = { screw = "5 mm" }
stage = { from = "0 mm", to = "100 mm", start = "10 mm" }
left = { at = "2 mm" }
home = { at = "50 mm", width = "2 mm" }

[[module]]
name = "z"
model = "tmcm-6214"
[[module.port]]
name = "bus"
tcp = "127.0.0.1"
[[module.port]]
pty = "z-port"
"#;

fn lab() -> (Lab, Served) {
    let lab = Lab::with(&[("lab.toml", SCENARIO)]);
    let served = serve_what(lab.path("lab.toml").to_str().unwrap(), &[]);
    (lab, served)
}

/// GIO of a digital input.
#[track_caller]
fn input(client: &mut Client, number: u8) -> i32 {
    let reply = client.request(1, Command::new(15, number, 0, 0)).unwrap();
    assert_eq!(reply.status, Status::OK);
    reply.value
}

/// Axis parameter 11: the left limit switch of an axis.
#[track_caller]
fn left_switch(client: &mut Client, axis: u8) -> i32 {
    let reply = client.request(1, Command::new(6, 11, axis, 0)).unwrap();
    assert_eq!(reply.status, Status::OK);
    reply.value
}

fn json(text: &str) -> Value {
    serde_json::from_str(text).unwrap_or_else(|error| panic!("{error}: {text}"))
}

#[test]
fn the_modules_of_a_scenario_are_served_side_by_side() {
    let (lab, served) = lab();
    let (mut xy, mut z) = (served.client_of(0), served.client_of(1));
    // A user variable of one module is not that of the other.
    for (client, value) in [(&mut xy, 4711), (&mut z, 815)] {
        let reply = client.request(1, Command::new(9, 0, 2, value)).unwrap();
        assert_eq!(reply.status, Status::OK);
    }
    for (client, value) in [(&mut xy, 4711), (&mut z, 815)] {
        let reply = client.request(1, Command::new(10, 0, 2, 0)).unwrap();
        assert_eq!(reply.value, value);
    }
    let modules = served.endpoints["modules"].as_array().unwrap();
    assert_eq!(served.endpoints["scenario"], lab.path("lab.toml").to_str().unwrap());
    assert_eq!((&modules[0]["name"], &modules[1]["name"]), (&"xy".into(), &"z".into()));
    let ports: Vec<&Value> = modules[1]["ports"].as_array().unwrap().iter().collect();
    assert_eq!((&ports[0]["name"], &ports[1]["name"]), (&"bus".into(), &"pty".into()));
    // What a scenario names is in its folder.
    assert_eq!(ports[1]["pty"], lab.path("z-port").to_str().unwrap());
    assert_eq!(fs::metadata(lab.path("xy.eeprom")).unwrap().len(), 32_768);
    let mut port =
        Client::open(&opentmcl_link::PortUri::Serial { path: lab.path("z-port"), baud: 9600 })
            .unwrap();
    assert_eq!(port.request(1, Command::new(10, 0, 2, 0)).unwrap().value, 815);
}

#[test]
fn a_switch_that_is_pressed_is_seen_by_the_module_it_belongs_to() {
    let (_lab, served) = lab();
    let (mut xy, mut z) = (served.client_of(0), served.client_of(1));
    let before = (left_switch(&mut xy, 0), left_switch(&mut z, 0));
    assert_eq!(stdout_of(&["world", "-c", served.world(), "xy: press left axis 0"]), "ok\n");
    assert_eq!(left_switch(&mut xy, 0), 1);
    assert_eq!(left_switch(&mut z, 0), before.1);
    assert_eq!(stdout_of(&["world", "-c", served.world(), "xy: free left axis 0"]), "ok\n");
    assert_eq!(left_switch(&mut xy, 0), before.0);
}

#[test]
fn several_lines_are_done_in_order_until_one_is_refused() {
    let (_lab, served) = lab();
    let world = format!("world:{}", served.world());
    let lines = ["z: input 3 high", "z: inptu 4 high", "z: input 5 high"];
    let output = tmcl(&["world", "-c", &world]).args(lines).output().unwrap();
    assert_eq!(output.status.code(), Some(1));
    assert_eq!(output.stdout, b"ok\n");
    let errors = String::from_utf8(output.stderr).unwrap();
    assert!(errors.starts_with("error: z: inptu 4 high: \"inptu\" is no action"), "{errors}");
    assert!(errors.contains("did you mean \"input\""), "{errors}");
    let mut z = served.client_of(1);
    assert_eq!([3, 4, 5].map(|number| input(&mut z, number)), [1, 0, 0]);
}

#[test]
fn the_state_is_a_table_for_people_and_json_for_programs() {
    let (_lab, served) = lab();
    let text = stdout_of(&["world", "-c", served.world(), "z: input 3 high", "state"]);
    assert!(text.contains("\nxy: tmcm-6214, power on, 24"), "{text}");
    assert!(
        text.contains("\n0     10.000 mm  0        0.00 mm/s   0.0°        0   1.49 A"),
        "{text}"
    );
    assert!(text.contains(
        "\n1     0.000 deg  0        0.00 deg/s  –           –   –                  ideal"
    ));
    let of_z = text.split("\nz: tmcm-6214").nth(1).unwrap();
    assert!(of_z.contains("3=1"), "{text}");
    let rows = of_z.lines().filter(|line| line.starts_with(['0', '1', '2', '3', '4', '5']));
    assert_eq!(rows.count(), 6, "{text}");

    let state = json(&stdout_of(&["world", "-c", served.world(), "--json", "state"]));
    assert_eq!(state["ok"], true);
    assert_eq!(state["state"]["modules"]["z"]["inputs"]["3"], true);
    assert_eq!(state["state"]["modules"]["xy"]["inputs"]["3"], false);
}

#[test]
fn what_is_behind_the_axes_is_a_table_too() {
    let (_lab, served) = lab();
    let text = stdout_of(&["world", "-c", served.world(), "scenario"]);
    assert!(text.starts_with("xy: tmcm-6214, ports pty tcp\n"), "{text}");
    assert!(
        text.contains("\n0     0.00 to 100.00 mm  up to 2.00 mm  49.00 to 51.00 mm  –\n"),
        "{text}"
    );
    assert!(text.contains("\n1     ideal"), "{text}");
}

#[test]
fn lines_may_come_from_standard_input() {
    let (lab, served) = lab();
    let (status, out, errors) =
        lab.run_with(&["world", "-c", served.world()], b"z: input 3 high\n\n z: input 3 low\n");
    assert_eq!((status, &*out, &*errors), (0, "ok\nok\n", ""));
    let (status, out, errors) =
        lab.run_with(&["world", "-c", served.world(), "--json"], b"z: nonsense\nstate\n");
    assert_eq!(status, 1);
    assert_eq!(json(&out)["ok"], false);
    assert!(errors.contains("\"nonsense\" is no action"), "{errors}");
}

#[test]
fn changes_are_streamed_until_ctrl_c() {
    let (_lab, served) = lab();
    let mut child = tmcl(&["world", "-c", served.world(), "--json", "watch"])
        .stdout(Stdio::piped())
        .spawn()
        .unwrap();
    let mut lines = BufReader::new(child.stdout.take().unwrap()).lines();
    assert_eq!(json(&lines.next().unwrap().unwrap())["ok"], true);
    stdout_of(&["world", "-c", served.world(), "z: input 3 high"]);
    let change = json(&lines.next().unwrap().unwrap());
    assert_eq!(change["changes"]["modules"]["z"]["inputs"]["3"], true, "{change}");
    // What a TMCL client does is seen as well: SIO 0, 2, 1.
    let reply = served.client_of(1).request(1, Command::new(14, 0, 2, 1)).unwrap();
    assert_eq!(reply.status, Status::OK);
    let change = json(&lines.next().unwrap().unwrap());
    assert_eq!(change["changes"]["modules"]["z"]["outputs"]["0"], true, "{change}");

    kill_process(Pid::from_child(&child), Signal::INT).unwrap();
    assert_eq!(child.wait().unwrap().code(), Some(0));
}

#[test]
fn a_change_is_one_line_for_people() {
    let (_lab, served) = lab();
    let mut child =
        tmcl(&["world", "-c", served.world(), "watch"]).stdout(Stdio::piped()).spawn().unwrap();
    let mut lines = BufReader::new(child.stdout.take().unwrap()).lines();
    assert_eq!(lines.next().unwrap().unwrap(), "ok");
    stdout_of(&["world", "-c", served.world(), "xy: block axis 0"]);
    let line = lines.next().unwrap().unwrap();
    assert!(line.contains(" s  ") && line.contains("xy.0.blocked=yes"), "{line}");
    drop(served);
    assert_eq!(child.wait().unwrap().code(), Some(1), "the server has gone");
}

#[test]
fn the_socket_is_the_users_alone_and_goes_with_the_server() {
    let lab = Lab::with(&[("lab.toml", SCENARIO)]);
    let (file, socket) = (lab.path("lab.toml"), lab.path("world"));
    let path = socket.to_str().unwrap();
    let served = serve_what(file.to_str().unwrap(), &["--world", path]);
    assert_eq!(served.world(), path);
    assert_eq!(fs::metadata(&socket).unwrap().permissions().mode() & 0o777, 0o600);
    assert_eq!(served.end_with(Signal::TERM), Some(0));
    assert!(fs::symlink_metadata(&socket).is_err());
}

#[test]
fn a_path_that_nobody_chose_is_in_the_users_runtime_folder_and_goes_as_well() {
    let lab = Lab::with(&[("lab.toml", SCENARIO), ("runtime/keep", "")]);
    let runtime = lab.path("runtime");
    let mut child = tmcl(&["serve", lab.path("lab.toml").to_str().unwrap(), "--json"])
        .env("XDG_RUNTIME_DIR", &runtime)
        .stdout(Stdio::piped())
        .spawn()
        .unwrap();
    let mut line = String::new();
    BufReader::new(child.stdout.as_mut().unwrap()).read_line(&mut line).unwrap();
    let world = json(&line)["world"].as_str().unwrap().to_owned();
    assert!(world.starts_with(runtime.to_str().unwrap()), "{world}");
    assert_eq!(stdout_of(&["world", "-c", &world, "z: input 3 high"]), "ok\n");
    kill_process(Pid::from_child(&child), Signal::INT).unwrap();
    assert_eq!(child.wait().unwrap().code(), Some(0));
    assert_eq!(fs::read_dir(&runtime).unwrap().count(), 1, "only what was there before");
}

#[test]
fn a_plain_module_has_a_world_only_if_asked() {
    assert!(serve(&[]).endpoints.get("world").is_none());
    let lab = Lab::with(&[]);
    let socket = lab.path("world");
    let served = serve(&["--world", socket.to_str().unwrap()]);
    assert_eq!(served.endpoints["module"], "tmcm-6214");
    assert_eq!(stdout_of(&["world", "-c", served.world(), "input 3 high"]), "ok\n");
    assert_eq!(input(&mut served.pty_client(), 3), 1);
}

#[test]
fn a_socket_that_cannot_be_had_is_explained() {
    let lab = Lab::with(&[("file", "precious")]);
    let file = lab.path("file");
    let (status, errors) = failure_of(&["serve", "tmcm-6214", "--world", file.to_str().unwrap()]);
    assert_eq!(status, 1);
    assert!(errors.contains("exists already and is left alone\nhelp: "), "{errors}");
    assert_eq!(lab.text("file"), "precious");

    let served = serve(&["--world", lab.path("world").to_str().unwrap()]);
    let (status, errors) = failure_of(&["serve", "tmcm-6214", "--world", served.world()]);
    assert_eq!(status, 1);
    assert!(errors.contains("another program listens on"), "{errors}");
}

#[test]
fn a_server_that_is_not_there_is_explained() {
    let lab = Lab::with(&[("file", "")]);
    drop(UnixListener::bind(lab.path("stale")).unwrap());
    for (name, message, help) in [
        ("nowhere", "there is no socket nowhere", "tmcl serve"),
        ("file", "file is not a socket", "tmcl serve"),
        ("stale", "nothing listens on stale any more", "remove stale"),
    ] {
        let errors = lab.fail(1, &["world", "-c", name, "state"]);
        assert!(errors.starts_with(&format!("error: {message}\nhelp: ")), "{errors}");
        assert!(errors.contains(help), "{errors}");
    }
}

#[test]
fn something_that_is_no_server_of_ours_is_recognized() {
    let lab = Lab::with(&[]);
    let listener = UnixListener::bind(lab.path("other")).unwrap();
    let other = std::thread::spawn(move || {
        let (mut stream, _) = listener.accept().unwrap();
        let mut request = [0; 6];
        stream.read_exact(&mut request).unwrap();
        assert_eq!(request, *b"state\n");
        std::io::Write::write_all(&mut stream, b"+OK ready\n").unwrap();
    });
    let errors = lab.fail(1, &["world", "-c", "other", "state"]);
    assert!(errors.contains("is not an object of JSON: \"+OK ready\""), "{errors}");
    other.join().unwrap();
}

#[test]
fn wrong_usage_is_told_as_such() {
    let lab = Lab::with(&[("lab.toml", SCENARIO)]);
    let errors = lab.fail(2, &["world", "-c", "socket", "watch", "state"]);
    assert!(errors.contains("goes on until Ctrl-C"), "{errors}");
    let errors = lab.fail(2, &["serve", "lab.toml", "--tcp"]);
    assert!(errors.contains("[[module.port]]"), "{errors}");
}

#[test]
fn options_choose_the_ports_of_a_scenario_with_one_module() {
    let text = "[[module]]\nmodel = \"tmcm-6214\"\n[[module.port]]\npty = true\n";
    let lab = Lab::with(&[("lab.toml", text)]);
    let file = lab.path("lab.toml");
    let file = file.to_str().unwrap();
    let module = |more: &[&str]| serve_what(file, more).endpoints["modules"][0].clone();
    assert!(module(&[])["tcp"].is_null());
    let over = module(&["--tcp"]);
    assert!(over["pty"].is_null());
    assert!(over["tcp"].is_string());
}

#[test]
fn people_get_the_endpoints_of_all_modules() {
    let lab = Lab::with(&[("lab.toml", SCENARIO)]);
    let mut child = tmcl(&["serve", lab.path("lab.toml").to_str().unwrap()])
        .stdout(Stdio::piped())
        .spawn()
        .unwrap();
    let mut text = String::new();
    let mut lines = BufReader::new(child.stdout.take().unwrap());
    while !text.contains("pytrinamic.connections") && lines.read_line(&mut text).unwrap() > 0 {}
    child.kill().unwrap();
    child.wait().unwrap();
    assert!(text.contains("2 virtual modules. Ctrl-C ends it."), "{text}");
    assert!(text.contains("\nxy: TMCM-6214, firmware 1.16\n"), "{text}");
    assert!(text.contains("\nz: TMCM-6214, firmware 1.16\n"), "{text}");
    assert!(text.contains("\n    tmcl world -c "), "{text}");
    assert!(text.contains("'xy: press left axis 0'"), "{text}");
}
