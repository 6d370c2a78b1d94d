//! `tmcl tune`, and the pictures of the page about it.

use std::fs;
use std::path::Path;

use opentmcl_link::Connection;
use opentmcl_wire::mnemonic;
use rustix::process::Signal;

use crate::common::{PATIENCE, failure_of, run, serve_what, stdout_of, tmcl};

const DOCS: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/../../docs");

/// The report of a run that must go well.
#[track_caller]
fn report(words: &[&str]) -> serde_json::Value {
    let text = stdout_of(&[&["tune"], words, &["--json"]].concat());
    serde_json::from_str(&text).unwrap()
}

fn number(report: &serde_json::Value, key: &str) -> f64 {
    report[key].as_f64().unwrap_or_else(|| panic!("{key} in {report}"))
}

#[test]
fn a_velocity_comes_to_its_target_on_both_modules() {
    for (module, commutation) in [
        ("virtual:tmcm-1613", &[][..]),
        ("virtual:tmcm-1636", &["--set", "commutation_mode=2", "--set", "hall_polarity=1"]),
        // The encoder is aligned first, which takes a second.
        ("virtual:tmcm-1636", &["--set", "15=3", "--set", "101=1"]),
    ] {
        for step in ["1000", "-1000"] {
            let words = [&["velocity", "-c", module, "--step", step][..], commutation].concat();
            let got = report(&words);
            let expected: f64 = step.parse().unwrap();
            assert_eq!(got["outcome"], "followed", "{got}");
            assert!((number(&got, "final") - expected).abs() < 20.0, "{got}");
            // The current of 2 A or 4 A, 0.036 Nm/A and 48e-6 kg m² make 1500 or 3000 rad/s²: from 10 % to 90 %,
            // 84 rad/s, takes 28 ms at least.
            assert!((0.025..0.5).contains(&number(&got, "rise_s")), "{got}");
            assert_eq!((number(&got, "samples"), number(&got, "rate_hz")), (1001.0, 1000.0));
        }
    }
}

#[test]
fn a_torque_without_integral_part_has_an_error_that_more_gain_makes_smaller() {
    let error = |p: &str| {
        let words = [
            "torque",
            "-c",
            "virtual:tmcm-1613",
            "--step",
            "1000",
            "--i",
            "0",
            "--duration",
            "10ms",
        ];
        number(&report(&[&words[..], &["--p", p]].concat()), "error")
    };
    let (low, middle, high) = (error("100"), error("300"), error("1000"));
    assert!(low > middle && middle > high && high > 0.0, "{low} {middle} {high}");
}

#[test]
fn a_position_comes_to_its_target_with_and_without_the_ramp() {
    for (module, settings, step) in [
        ("virtual:tmcm-1613", &["--set", "velocity_i=50"][..], 48),
        (
            "virtual:tmcm-1636",
            &["--set", "commutation_mode=3", "--set", "encoder_direction=1"],
            65_536,
        ),
    ] {
        for ramp in [&[][..], &["--ramp"]] {
            let distance = step.to_string();
            let words = ["position", "-c", module, "--step", &distance, "--p", "300"];
            let got = report(&[&words[..], settings, &["--duration", "2s"], ramp].concat());
            assert!((number(&got, "reached_percent") - 100.0).abs() < 6.0, "{got}");
            assert_eq!(got["ramp"], !ramp.is_empty());
        }
    }
}

#[test]
fn the_report_for_people_has_all_numbers() {
    let text = stdout_of(&["tune", "velocity", "-c", "virtual:tmcm-1613", "--step", "1000"]);
    let subjects: Vec<_> = text.lines().filter_map(|line| line.split("  ").next()).collect();
    for subject in ["module", "step", "samples", "rise", "overshoot", "settled", "final", "error"] {
        assert!(subjects.contains(&subject), "{subject}: {text}");
    }
    assert!(text.contains("1001 in 1.000 s, 1000 per second of virtual time"), "{text}");
}

#[test]
fn the_samples_are_recorded_in_each_form() {
    let folder = tempfile::tempdir().unwrap();
    for name in ["answer.csv", "answer.parquet", "answer.mcap"] {
        let file = folder.path().join(name);
        let words = ["tune", "velocity", "-c", "virtual:tmcm-1613", "--step", "500", "--record"];
        stdout_of(&[&words[..], &[file.to_str().unwrap()]].concat());
        assert!(fs::metadata(&file).unwrap().len() > 4000, "{name}");
    }
    let text = fs::read_to_string(folder.path().join("answer.csv")).unwrap();
    let lines: Vec<_> = text.lines().collect();
    assert_eq!(lines[..2], ["time_s,target0_rpm,velocity0_rpm,torque0_mA", "0.000000,500,0,0"]);
    assert_eq!(lines.len(), 1002);
    assert!(lines[1001].starts_with("1.000000,500,"), "{}", lines[1001]);
}

/// Values of the axis parameters of a served module.
fn values(client: &mut impl Connection, numbers: &[u8]) -> Vec<i32> {
    let read = |number: &u8| {
        let command = mnemonic::parse(&format!("GAP {number}, 0")).unwrap();
        client.request(1, command).unwrap().value
    };
    numbers.iter().map(read).collect()
}

#[test]
fn a_served_module_is_measured_over_both_lines_and_left_as_it_was() {
    let served = serve_what("tmcm-1613", &[]);
    let tcp = format!("tcp:{}", served.tcp());
    // Ramp, gains of the speed, largest current.
    let numbers = [146, 234, 235, 6];
    let before = values(&mut served.tcp_client(), &numbers);
    for uri in [served.pty(), &tcp] {
        let words = [
            "velocity", "-c", uri, "--step", "1000", "--p", "700", "--i", "400", "--set", "6=2500",
        ];
        let got = report(&words);
        assert_eq!(got["outcome"], "followed", "{got}");
        assert_eq!(got["virtual_time"], false);
        assert!(number(&got, "rate_hz") > 20.0, "{got}");
        assert_eq!(values(&mut served.tcp_client(), &numbers), before);
        let [target] = values(&mut served.tcp_client(), &[2])[..] else { panic!() };
        assert_eq!(target, 0, "the motor was stopped");
    }
    report(&["velocity", "-c", &tcp, "--step", "500", "--p", "700", "--keep"]);
    let after = values(&mut served.tcp_client(), &numbers);
    assert_eq!(after, [before[0], 700, before[2], before[3]], "the ramp is restored all the same");
}

#[test]
fn ctrl_c_stops_the_motor_and_restores_the_parameters() {
    let served = serve_what("tmcm-1613", &["--tcp"]);
    let tcp = format!("tcp:{}", served.tcp());
    let mut client = served.tcp_client();
    let child = tmcl(&["tune", "velocity", "-c", &tcp, "--step", "1000", "--duration", "60s"])
        .stderr(std::process::Stdio::piped())
        .spawn()
        .unwrap();
    let start = std::time::Instant::now();
    while values(&mut client, &[2, 146]) != [1000, 0] {
        assert!(start.elapsed() < PATIENCE, "it does not begin");
    }
    let id = rustix::process::Pid::from_child(&child);
    rustix::process::kill_process(id, Signal::INT).unwrap();
    let output = child.wait_with_output().unwrap();
    assert_eq!(output.status.code(), Some(1));
    assert_eq!(String::from_utf8(output.stderr).unwrap(), "error: interrupted\n");
    assert_eq!(values(&mut client, &[2, 146]), [0, 1]);
}

#[test]
fn a_module_without_a_servo_is_refused_with_those_that_have_one() {
    let got = failure_of(&["tune", "torque", "-c", "virtual:tmcm-6214", "--step", "1000"]);
    let expected = "error: a TMCM-6214 has no regulators: it drives no servo motor\n\
                    help: modules that have them: tmcm-1613, tmcm-1636\n";
    assert_eq!(got, (2, expected.to_owned()));
}

#[test]
fn a_motor_without_commutation_is_told_with_the_next_step() {
    let (status, errors) =
        failure_of(&["tune", "velocity", "-c", "virtual:tmcm-1636", "--step", "1000"]);
    assert_eq!(status, 1);
    assert!(errors.contains("parameter 15 (commutation_mode) is 0, disabled"), "{errors}");
    assert!(errors.contains("--set commutation_mode=N; N is 2 (hall lines)"), "{errors}");
    let open_loop = ["velocity", "-c", "virtual:tmcm-1636", "--step", "100", "--set", "15=1"];
    let (_, errors) = failure_of(&[&["tune"], &open_loop[..]].concat());
    assert!(errors.contains("nothing is regulated"), "{errors}");
}

#[test]
fn an_overvoltage_during_the_run_is_told() {
    let words = ["position", "-c", "virtual:tmcm-1613", "--step", "480", "--p", "300"];
    let text = stdout_of(&[&["tune"], &words[..]].concat());
    assert!(text.contains("overvoltage after"), "{text}");
}

#[test]
fn a_motor_that_does_not_follow_fails_behind_its_report() {
    // Without gains nothing flows.
    let output = run(&[
        "tune",
        "velocity",
        "-c",
        "virtual:tmcm-1613",
        "--step",
        "1000",
        "--p",
        "0",
        "--i",
        "0",
    ]);
    assert_eq!(output.status.code(), Some(1));
    let (text, errors) = (output.stdout, String::from_utf8(output.stderr).unwrap());
    assert!(String::from_utf8(text).unwrap().contains("final      0 rpm, 0 % of the step"));
    assert!(errors.starts_with("error: the velocity did not follow\nhelp: "), "{errors}");
}

#[test]
fn a_motor_that_runs_away_is_told_and_loses_its_torque() {
    // The usual motor has its hall lines inverted, and the module takes them as they are: each correction drives it
    // further.
    let words = ["velocity", "-c", "virtual:tmcm-1636", "--step", "1000", "--set", "15=2"];
    let output = run(&[&["tune"], &words[..]].concat());
    assert_eq!(output.status.code(), Some(1));
    let text = String::from_utf8(output.stdout).unwrap();
    assert!(text.contains("note       MST did not stop the motor"), "{text}");
    let errors = String::from_utf8(output.stderr).unwrap();
    assert!(errors.starts_with("error: the velocity went the other way\nhelp: "), "{errors}");
    assert!(errors.contains("polarity of the sensor"), "{errors}");
}

#[test]
fn what_cannot_be_done_is_wrong_usage() {
    for (words, expected) in [
        (&["position", "--step", "10", "--i", "1"][..], "no integral part"),
        (&["torque", "--step", "10", "--ramp"], "the torque has no ramp"),
        (&["velocity", "--step", "0"], "there is no step"),
        (&["velocity", "--step", "4001"], "beyond parameter 4 (max_velocity), which is 4000"),
        (&["torque", "--step", "-2001"], "beyond parameter 6 (max_current), which is 2000"),
        (&["velocity", "--step", "10", "--set", "velocty_p=1"], "did you mean velocity_p?"),
        (&["velocity", "--step", "10", "--set", "actual_velocity=1"], "cannot be set"),
        (&["velocity", "--step", "10", "--set", "ramp_enable=1"], "--ramp"),
        (&["velocity", "--step", "10", "--p", "65536"], "write 0 to 65535"),
        (&["velocity", "--step", "10", "--plot", "-"], "standard output"),
        (&["velocity", "--step", "10", "--record", "a.xls"], ".parquet"),
        (&["velocity", "--step", "10", "--plot", "a.csv", "--record", "a.csv"], "two outputs"),
        (&["velocity", "--step", "10", "--duration", "2min"], "a minute at most"),
        (&["flux", "--step", "10"], "torque, velocity, position"),
        (&["velocity"], "--step"),
    ] {
        let words = [&["tune"], words, &["-c", "virtual:tmcm-1613"]].concat();
        let (status, errors) = failure_of(&words);
        assert_eq!(status, 2, "{words:?}: {errors}");
        assert!(errors.contains(expected), "{words:?}: {errors}");
    }
}

/// The commands of the page that draw, as words.
fn drawing_commands(page: &str) -> Vec<Vec<String>> {
    let page = page.replace("\\\n", " ");
    let commands = page.lines().filter_map(|line| line.strip_prefix("$ tmcl "));
    let drawing = commands.filter(|command| command.contains("--plot"));
    drawing.map(|command| command.split_whitespace().map(str::to_owned).collect()).collect()
}

#[test]
fn the_pictures_of_the_page_are_those_of_its_runs() {
    let page = fs::read_to_string(Path::new(DOCS).join("tuning.md")).unwrap();
    let commands = drawing_commands(&page);
    assert!(commands.len() >= 5);
    let folder = tempfile::tempdir().unwrap();
    for command in commands {
        let words: Vec<&str> = command.iter().map(String::as_str).collect();
        let name = words[words.iter().position(|word| *word == "--plot").unwrap() + 1];
        assert!(page.contains(&format!("](images/{name})")), "{name} is shown");
        assert!(tmcl(&words).current_dir(folder.path()).output().unwrap().status.success());
        let drawn = fs::read_to_string(folder.path().join(name)).unwrap();
        let kept = Path::new(DOCS).join("images").join(name);
        if std::env::var_os("OPENTMCL_BLESS").is_some_and(|value| value == "1") {
            fs::write(&kept, &drawn).unwrap();
        }
        assert!(
            fs::read_to_string(&kept).unwrap_or_default() == drawn,
            "docs/images/{name} shows another run; if that is meant, run this test with OPENTMCL_BLESS=1 and look \
             at the picture"
        );
    }
}
