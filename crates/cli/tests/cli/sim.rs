//! `tmcl sim`.

use std::fs;
use std::path::PathBuf;

use serde_json::Value;
use tempfile::TempDir;

use crate::common::{failure_of, stdout_of, tmcl};

/// A program in a folder of its own.
struct Source {
    folder: TempDir,
}

impl Source {
    fn new(text: &str) -> Self {
        let source = Self { folder: tempfile::tempdir().unwrap() };
        fs::write(source.file("test.tmc"), text).unwrap();
        source
    }

    fn file(&self, name: &str) -> PathBuf {
        self.folder.path().join(name)
    }

    fn sim(&self, more: &[&str]) -> String {
        let file = self.file("test.tmc");
        let args = ["sim", file.to_str().unwrap(), "--module", "tmcm-6214"];
        stdout_of(&[&args, more].concat())
    }

    fn summary(&self, more: &[&str]) -> Value {
        serde_json::from_str(&self.sim(&[&["--json"], more].concat())).unwrap()
    }

    fn failure(&self, more: &[&str]) -> (i32, String) {
        let file = self.file("test.tmc");
        let args = ["sim", file.to_str().unwrap(), "--module", "tmcm-6214"];
        failure_of(&[&args, more].concat())
    }

    /// Runs with a recording, and gives its lines as fields.
    fn record(&self, more: &[&str]) -> Vec<Vec<String>> {
        let csv = self.file("test.csv");
        self.sim(&[&["--record", csv.to_str().unwrap()], more].concat());
        let text = fs::read_to_string(csv).unwrap();
        text.lines().map(|line| line.split(',').map(str::to_owned).collect()).collect()
    }
}

/// Half a second: 10 000 commands a second, and ticks of 10 ms.
const BLINK: &str = "\
SIO 1, 2, 1
SAP 5, 9, 1000 // tmcl-allow: no-such-axis
WAIT TICKS, 0, 50
SIO 1, 2, 0
STOP
";

#[test]
fn a_summary_tells_the_end_the_refused_commands_and_the_outputs() {
    assert_eq!(
        Source::new(BLINK).sim(&[]),
        "program    test.tmc, 5 commands, on a TMCM-6214\n\
         end        STOP at line 5, after 0.500 s\n\
         executed   5 commands\n\
         refused    line 2: SAP 5, 9, 1000: status 4 (invalid value), at 0.000 s\n\
         axes       none moved\n\
         output 1   high at 0.000 s, low at 0.500 s\n"
    );
}

#[test]
fn json_has_the_same_for_programs() {
    let source = Source::new(BLINK);
    let file = source.file("test.tmc");
    assert_eq!(
        source.summary(&[]),
        serde_json::json!({
            "program": "test.tmc",
            "module": "TMCM-6214",
            "length": 5,
            "duration_s": 0.5004,
            "end": {
                "reason": "stop", "time_s": 0.5004, "address": 4, "file": file, "line": 5,
                "command": "STOP"
            },
            "executed": 5,
            "refused": [{
                "address": 1, "file": file, "line": 2, "command": "SAP 5, 9, 1000", "status": 4,
                "meaning": "invalid value", "count": 1, "first_s": 0.0001
            }],
            "axes": [],
            "outputs": [{
                "output": 1, "count": 2,
                "switched": [{"time_s": 0.0, "level": 1}, {"time_s": 0.5003, "level": 0}],
                "last": {"time_s": 0.5003, "level": 0}
            }]
        })
    );
}

#[test]
fn a_binary_runs_and_is_shown_by_its_addresses() {
    // Each command with its value, most significant byte first, and the sum of these bytes.
    let program: [[u8; 8]; 4] = [
        [14, 1, 2, 0, 0, 0, 1, 18],
        [5, 5, 9, 0, 0, 3, 0xE8, 254],
        [27, 0, 0, 0, 0, 0, 50, 77],
        [28, 0, 0, 0, 0, 0, 0, 28],
    ];
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("test.bin");
    fs::write(&file, program.concat()).unwrap();
    let text = stdout_of(&["sim", file.to_str().unwrap(), "-m", "tmcm-6214"]);
    assert!(text.contains("end        STOP at address 3, after 0.500 s\n"), "{text}");
    assert!(text.contains("refused    address 1: SAP 5, 9, 1000: status 4"), "{text}");
}

#[test]
fn a_command_refused_again_and_again_is_one_line_with_its_count() {
    let source = Source::new(
        "SGP 3, 2, 7\nAgain: MVP ABS, 6, 0 // tmcl-allow: no-such-axis\nDJNZ 3, Again\n",
    );
    let text = source.sim(&[]);
    let refused =
        "refused    line 2: MVP ABS, 6, 0: status 4 (invalid value), 7 times, first at 0.000 s\n";
    assert!(text.contains(refused), "{text}");
}

#[test]
fn an_output_that_switches_often_is_cut_short() {
    let source = Source::new("SGP 3, 2, 9\nA: SIO 0, 2, 1\nSIO 0, 2, 0\nDJNZ 3, A\n");
    let text = source.sim(&[]);
    let line = text.lines().find(|line| line.starts_with("output 0")).unwrap();
    // 18 times: 9 rounds of 0.3 ms from 0.1 ms on.
    assert!(line.starts_with(
        "output 0   high at 0.000 s, low at 0.000 s, high at 0.000 s, low at 0.001 s, … low"
    ));
    assert!(line.ends_with("at 0.003 s: 18 times"), "{line}");
}

#[test]
fn motion_goes_on_behind_stop_until_the_axes_stand() {
    let summary = Source::new("MVP ABS, 2, -6400\nSTOP\n").summary(&[]);
    assert_eq!(summary["end"]["time_s"], 0.0001);
    let axis = &summary["axes"][0];
    assert_eq!(
        (&axis["axis"], &axis["from"], &axis["to"]),
        (&2.into(), &0.into(), &(-6400).into())
    );
    assert_eq!(axis["end_speed_pps"], 0);
    // Below V1 = 25600 pps the factory's acceleration is 25553 pps²: 2 · √(6400 / 25553) s.
    let duration = summary["duration_s"].as_f64().unwrap();
    assert!((duration - 1.001).abs() < 0.002, "{duration}");
    let text = Source::new("MVP ABS, 2, -6400\nSTOP\n").sim(&[]);
    assert!(text.contains("\n           motion went on and came to rest after "), "{text}");
}

#[test]
fn an_axis_that_turns_on_is_not_waited_for() {
    let source = Source::new("ROR 4, 1000\nWAIT TICKS, 0, 10\nSTOP\n");
    let text = source.sim(&["--until", "1h"]);
    assert!(text.contains("\n           axis 4 still turns at 1000 pps\n"), "{text}");
    assert_eq!(source.summary(&["--until", "1h"])["duration_s"], 0.1002);
}

#[test]
fn motion_behind_stop_ends_with_the_time_at_the_latest() {
    let source = Source::new("MVP ABS, 0, 512000\nSTOP\n");
    let summary = source.summary(&["--until", "500ms"]);
    assert_eq!((&summary["end"]["reason"], &summary["duration_s"]), (&"stop".into(), &0.5.into()));
    assert_ne!(summary["axes"][0]["end_speed_pps"], 0);
}

#[test]
fn a_program_that_hangs_is_shown_where_and_why() {
    // A virtual stage has no limit switches.
    let source = Source::new("Loop:\n  WAIT LIMSW, 3, 0\n  JA Loop\n");
    assert_eq!(
        source.sim(&["--until", "2min"]),
        "program    test.tmc, 3 commands, on a TMCM-6214\n\
         end        none, time up after 120.000 s: at line 2, WAIT LIMSW, 3, 0\n           \
         waiting since 0.000 s until a limit switch of axis 3 is closed\n           \
         nothing is to come that would end this\n\
         executed   0 commands\n\
         axes       none moved\n"
    );
}

#[test]
fn a_wait_that_will_end_is_not_called_hopeless() {
    let source = Source::new("WAIT TICKS, 0, 1000\n");
    let summary = source.summary(&["--until", "1s"]);
    assert_eq!(summary["end"]["reason"], "time_up");
    assert_eq!(summary["end"]["waiting"]["may_end"], true);
}

#[test]
fn a_program_without_stop_runs_into_empty_memory() {
    let source = Source::new("CALC ADD, 1 // tmcl-allow: runs-off-the-end\n");
    assert_eq!(source.summary(&["--no-stop"])["end"]["reason"], "no_stop");
    assert_eq!(source.summary(&[])["end"]["reason"], "stop");
    let text = source.sim(&["--no-stop"]);
    assert!(
        text.contains("end        none with STOP: the program ran past its end at address 1,"),
        "{text}"
    );
}

#[test]
fn a_program_has_the_rate_that_was_asked_for() {
    // Four commands of 1 ms before STOP, and half a second of waiting.
    let summary = Source::new(BLINK).summary(&["--program-rate", "1000"]);
    assert_eq!(summary["end"]["time_s"], 0.504);
}

#[test]
fn a_jump_out_of_the_program_is_named() {
    let source = Source::new("CALC ADD, 1\nJA 5000 // tmcl-allow: jump-outside-program\n");
    let summary = source.summary(&[]);
    assert_eq!(
        (&summary["end"]["reason"], &summary["end"]["line"]),
        (&"jump_outside".into(), &2.into())
    );
}

#[test]
fn a_trace_has_a_line_for_each_command_as_it_is_written() {
    let source = Source::new(
        "Count = 2 // rounds\n\
         \n\
         CALC LOAD, Count\n\
         Again: CALC SUB, 1   // one less\n\
         COMP 1\n\
         JC EQ, Again\n\
         RSUB\n\
         WAIT TICKS, 0, 1\n\
         // tmcl-allow-file: return-without-call\n",
    );
    let text = source.sim(&["--trace"]);
    let (trace, summary) = text.split_once("\n\n").unwrap();
    assert_eq!(
        trace,
        "     time s  addr  line  label  command                     A            X  flags  what\n\
         \u{20}  0.000000     0  3            CALC LOAD, Count            2            0  -=\n\
         \u{20}  0.000100     1  4     Again  CALC SUB, 1                 1            0  -=\n\
         \u{20}  0.000200     2  5            COMP 1                      1            0  Z=\n\
         \u{20}  0.000300     3  6            JC EQ, Again                1            0  Z=     taken\n\
         \u{20}  0.000400     1  4     Again  CALC SUB, 1                 0            0  Z=\n\
         \u{20}  0.000500     2  5            COMP 1                      0            0  -<\n\
         \u{20}  0.000600     3  6            JC EQ, Again                0            0  -<     not taken\n\
         \u{20}  0.000700     4  7            RSUB                        0            0  -<     \
         refused: status 6 (command not available)\n\
         \u{20}  0.010800     5  8            WAIT TICKS, 0, 1            0            0  -<     waited 0.010 s\n\
         \u{20}  0.010900     6               STOP                        0            0  -<"
    );
    assert!(summary.starts_with("program    test.tmc, 7 commands"), "{summary}");
}

#[test]
fn a_trace_marks_the_commands_of_interrupt_handlers() {
    // Timer 0 every 20 ms: once within 30 ms.
    let source = Source::new(
        "VECT 0, Tick\nSGP 0, 3, 20\nEI 0\nEI 255\nWAIT TICKS, 0, 3\nSTOP\nTick: CALCX LOAD\nRETI\n",
    );
    let text = source.sim(&["--trace"]);
    let in_handler: Vec<&str> = text.lines().filter(|line| line.ends_with("interrupt")).collect();
    assert_eq!(in_handler.len(), 2, "{text}");
    assert!(in_handler[0].starts_with("   0.020200     6  7     Tick"), "{text}");
}

#[test]
fn a_recording_has_named_columns_and_a_line_for_each_sample() {
    // 51200 pps² becomes 51107 in the chip's unit (439 · 116.415).
    let source =
        Source::new("SAP 5, 1, 51200\nROR 1, 51200\nWAIT TICKS, 0, 50\nSIO 2, 2, 1\nSTOP\n");
    let lines =
        source.record(&["--until", "500ms", "--record-variable", "7", "--variable", "7=-3"]);
    let column = |name: &str| lines[0].iter().position(|field| field == name).unwrap();
    assert_eq!(lines[0][0], "time_s");
    // 0, 0.01, … 0.50 s.
    assert_eq!(lines.len(), 1 + 51);
    let sample = &lines[1 + 20];
    assert_eq!(sample[0], "0.200000");
    let number = |name: &str| sample[column(name)].parse::<f64>().unwrap();
    // The axis starts 0.1 ms after the program.
    let time = 0.2 - 0.0001;
    assert!((number("speed1_pps") - 51_107.0 * time).abs() <= 1.0, "{sample:?}");
    assert!(
        (number("position1_microsteps") - 51_107.0 * time * time / 2.0).abs() <= 1.0,
        "{sample:?}"
    );
    assert_eq!((number("speed0_pps"), number("variable7"), number("output2")), (0.0, -3.0, 0.0));
    assert_eq!(number("address"), 2.0);
}

#[test]
fn a_recording_has_the_rate_that_was_asked_for() {
    let lines = Source::new(BLINK).record(&["--rate", "3"]);
    let times: Vec<&str> = lines[1..].iter().map(|fields| fields[0].as_str()).collect();
    assert_eq!(times, ["0.000000", "0.333333"]);
    let outputs: Vec<&str> = lines[1..].iter().map(|fields| fields[15].as_str()).collect();
    assert_eq!((lines[0][15].as_str(), &outputs[..]), ("output1", &["1", "1"][..]));
}

#[test]
fn the_ending_of_a_recording_says_its_form() {
    let source = Source::new(BLINK);
    // The formats begin with these bytes.
    for (name, beginning) in [("run.parquet", &b"PAR1"[..]), ("run.mcap", b"\x89MCAP0\r\n")] {
        let file = source.file(name);
        let record = || {
            source.sim(&["--record", file.to_str().unwrap()]);
            fs::read(&file).unwrap()
        };
        let bytes = record();
        // And they end with the same.
        assert!(bytes.starts_with(beginning) && bytes.ends_with(beginning), "{name}");
        assert_eq!(bytes, record(), "two runs are the same");
    }
    let (status, errors) = source.failure(&["--record", "run.xlsx"]);
    assert!(status == 2 && errors.contains(".csv, .parquet or .mcap"), "{errors}");
}

#[test]
fn inputs_readings_and_variables_are_as_the_user_says() {
    let source = Source::new("GIO 3, 0\nGIO 4, 0\nGIO 4, 1\nGGP 42, 2\nSTOP\n");
    let accumulators = |more: &[&str]| -> Vec<String> {
        let text = source.sim(&[&["--trace"], more].concat());
        let lines = text.lines().skip(1).take(4);
        lines.map(|line| line.split_whitespace().rev().nth(2).unwrap().to_owned()).collect()
    };
    let given =
        ["--input", "3=low", "--input", "4=high", "--analog", "4=1234", "--variable", "42=-77"];
    assert_eq!(accumulators(&given), ["0", "1", "1234", "-77"]);
    let others = ["--input", "3=high", "--input", "4=LOW", "--analog", "4=0", "--variable", "42=5"];
    assert_eq!(accumulators(&others), ["1", "0", "0", "5"]);
}

#[test]
fn what_the_module_does_not_have_is_wrong_usage() {
    let source = Source::new("STOP\n");
    let (status, errors) = source.failure(&["--input", "9=high"]);
    assert_eq!(
        (status, errors.as_str()),
        (
            2,
            "error: the TMCM-6214 has no digital input 9\n\
             help: its digital inputs are 0, 1, 2, 3, 4, 5, 6, 7\n"
        )
    );
    let (status, errors) = source.failure(&["--analog", "0=4096"]);
    assert_eq!(
        (status, errors.as_str()),
        (2, "error: analog input 0 cannot read 4096; write 0 to 4095\n")
    );
    for (option, value, hint) in [
        ("--until", "10", "500ms"),
        ("--input", "3", "3=high"),
        ("--analog", "0=high", "0=2048"),
        ("--variable", "256=1", "0 to 255"),
        ("--rate", "100", "--record"),
    ] {
        let (status, errors) = source.failure(&[option, value]);
        assert!(status == 2 && errors.contains(hint), "{option}: {errors}");
    }
}

#[test]
fn a_program_with_errors_does_not_run() {
    let source = Source::new("MVP ABS, 0\n");
    let (status, errors) = source.failure(&[]);
    assert_eq!(status, 1);
    assert!(errors.contains("test.tmc:1:"), "{errors}");
    let (status, _) = source.failure(&["--record", "/no/such/folder/file.csv"]);
    assert_eq!(status, 1);
}

#[test]
fn a_file_that_cannot_be_written_is_named() {
    let source = Source::new("STOP\n");
    for option in ["--record", "--plot"] {
        let (status, errors) = source.failure(&[option, "/no/such/folder/file"]);
        assert!(status == 1 && errors.contains("/no/such/folder/file"), "{errors}");
    }
}

#[test]
fn two_runs_are_the_same_to_the_last_byte() {
    let source = Source::new("Go: MVP ABS, 0, 30000\nWAIT POS, 0, 50\nMVP ABS, 0, 0\nJA Go\n");
    let (csv, svg) = (source.file("run.csv"), source.file("run.svg"));
    let all = || {
        let files = ["--record", csv.to_str().unwrap(), "--plot", svg.to_str().unwrap()];
        let text = source.sim(&[&files[..], &["--until", "20s"]].concat());
        (text, fs::read(&csv).unwrap(), fs::read(&svg).unwrap())
    };
    assert_eq!(all(), all());
}

#[test]
fn a_picture_of_an_hour_is_no_larger_than_that_of_a_minute() {
    // Moves, switches outputs and waits some thousand times.
    let source = Source::new(
        "Go: MVP ABS, 0, 3000\nSIO 0, 2, 1\nWAIT POS, 0, 0\nMVP ABS, 0, 0\nSIO 0, 2, 0\nWAIT POS, 0, 0\nJA Go\n",
    );
    let svg = source.file("run.svg");
    source.sim(&["--plot", svg.to_str().unwrap(), "--until", "1h"]);
    let svg = fs::read_to_string(svg).unwrap();
    assert!(svg.contains(">time in min</text>"));
    assert!(svg.len() < 500_000, "{}", svg.len());
}

#[test]
fn who_has_seen_enough_of_a_trace_ends_it() {
    let source = Source::new("Loop: CALC ADD, 1\nJA Loop\n");
    let file = source.file("test.tmc");
    let mut child =
        tmcl(&["sim", file.to_str().unwrap(), "-m", "tmcm-6214", "--trace", "--until", "10h"])
            .stdout(std::process::Stdio::piped())
            .stderr(std::process::Stdio::piped())
            .spawn()
            .unwrap();
    drop(child.stdout.take());
    let output = child.wait_with_output().unwrap();
    assert!(output.status.success());
    assert_eq!(String::from_utf8(output.stderr).unwrap(), "");
}

const BOOK: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/../../docs/simulate.md");
const IMAGES: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/../../docs/images/");

/// What a file of the book holds.
fn file_of_the_book<'a>(book: &'a str, name: &str) -> &'a str {
    let (_, block) = book.split_once(&format!("<!-- file: {name} -->\n```")).unwrap();
    let (_, text) = block.split_once('\n').unwrap();
    text.split_once("```\n").unwrap().0
}

/// Runs the command of the book that draws a picture, and compares the two.
#[track_caller]
fn the_book_shows(picture: &str, files: &[&str]) {
    let book = fs::read_to_string(BOOK).unwrap();
    let folder = tempfile::tempdir().unwrap();
    for file in files {
        fs::write(folder.path().join(file), file_of_the_book(&book, file)).unwrap();
    }
    let plot = format!("--plot {picture}");
    let command = book
        .lines()
        .find_map(|line| line.strip_prefix("$ tmcl ").filter(|line| line.contains(&plot)))
        .unwrap();
    let words: Vec<&str> = command.split(' ').collect();
    assert!(tmcl(&words).current_dir(&folder).output().unwrap().status.success());
    let drawn = fs::read_to_string(folder.path().join(picture)).unwrap();
    let shown = format!("{IMAGES}{picture}");
    if std::env::var_os("OPENTMCL_BLESS").is_some_and(|value| value == "1") {
        fs::write(&shown, &drawn).unwrap();
    }
    assert!(
        fs::read_to_string(&shown).unwrap() == drawn,
        "docs/images/{picture} shows another run; if that is meant, run this test with OPENTMCL_BLESS=1 and \
         look at the picture"
    );
}

#[test]
fn the_picture_of_the_book_is_what_the_book_says() {
    the_book_shows("sorter.svg", &["sorter.tmc"]);
}

#[test]
fn the_picture_of_a_servo_axis_is_what_the_book_says() {
    the_book_shows("slide.svg", &["slide.tmc", "slide.toml"]);
}

#[test]
fn the_module_that_the_source_names_is_taken_unless_another_is_chosen() {
    let source = Source::new("// module: tmcm-6214\nSTOP\n");
    let file = source.file("test.tmc");
    let summary = stdout_of(&["sim", file.to_str().unwrap()]);
    assert!(summary.starts_with("program    test.tmc, 1 command, on a TMCM-6214\n"), "{summary}");

    let (status, errors) = failure_of(&["sim", file.to_str().unwrap(), "-m", "tmcm-0"]);
    assert!(status == 2 && errors.contains("there is no module \"tmcm-0\""), "{errors}");
}

#[test]
fn a_program_that_names_no_module_needs_the_option() {
    let source = Source::new("STOP\n");
    let file = source.file("test.tmc");
    let file = file.to_str().unwrap();
    let expected = format!(
        "error: {file} does not say for which module it is\n\
         help: --module NAME does; so does `// module: NAME` in the source\n"
    );
    assert_eq!(failure_of(&["sim", file]), (2, expected));
}

#[test]
fn neither_picture_nor_recording_takes_the_place_of_the_program_or_of_the_other() {
    let source = Source::new("#include part.inc\nSTOP\n");
    fs::write(source.file("part.inc"), "MST 0\n").unwrap();
    for name in ["test.tmc", "part.inc"] {
        let file = source.file(name);
        let before = fs::read(&file).unwrap();
        for option in ["--plot", "--record"] {
            let (status, errors) = source.failure(&[option, file.to_str().unwrap()]);
            assert_eq!(status, 2, "{errors}");
            assert!(errors.contains("is read, and would be overwritten"), "{errors}");
            assert_eq!(fs::read(&file).unwrap(), before, "{option} {name}");
        }
    }
    let both = source.file("both");
    let both = both.to_str().unwrap();
    let (status, errors) = source.failure(&["--plot", both, "--record", both]);
    assert!(status == 2 && errors.contains("is named for two outputs"), "{errors}");
    assert!(source.failure(&["--plot", "-"]).1.contains("standard output has the summary"));
}
