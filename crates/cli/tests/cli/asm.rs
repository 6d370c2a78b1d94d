//! `tmcl asm`, and how programs and what they include are found and read.

use std::fs;
use std::os::unix::fs::{MetadataExt, PermissionsExt, symlink};

use crate::common::tmcl;
use crate::lab::Lab;

const SPIN: &str = "Speed = 2 * 25600\nLoop: ROR 0, Speed\n  JA Loop\n";

/// By hand from the layout of the vendor's file: number, type, motor, value with the highest byte first,
/// and the sum of these. ROR is 1, JA 22, STOP 28; 51200 is $C800, and $01 + $C8 = $C9.
const SPIN_BIN: &[u8] = &[
    0x01, 0, 0, 0, 0, 0xC8, 0, 0xC9, //
    0x16, 0, 0, 0, 0, 0, 0, 0x16, //
    0x1C, 0, 0, 0, 0, 0, 0, 0x1C,
];

#[test]
fn a_source_becomes_a_binary_beside_it() {
    let lab = Lab::with(&[("axis/spin.tmc", SPIN)]);
    assert_eq!(lab.succeed(&["asm", "axis/spin.tmc"]), "axis/spin.bin: 3 commands\n");
    assert_eq!(lab.bytes("axis/spin.bin"), SPIN_BIN);
}

#[test]
fn a_binary_goes_where_it_is_told_to_and_without_stop_if_told_so() {
    let lab = Lab::with(&[("spin.tmc", SPIN)]);
    let text = lab.succeed(&["asm", "spin.tmc", "-o", "other.dat", "--no-stop"]);
    assert_eq!(text, "other.dat: 2 commands\n");
    assert_eq!(lab.bytes("other.dat"), SPIN_BIN[..16]);
    assert_eq!(lab.names(), ["other.dat", "spin.tmc"]);
}

#[test]
fn a_program_can_come_by_one_pipe_and_leave_by_another() {
    let lab = Lab::with(&[]);
    let output = lab.output(&["asm", "-", "-o", "-"], SPIN.as_bytes());
    assert_eq!(String::from_utf8(output.stderr).unwrap(), "");
    assert_eq!(output.stdout, SPIN_BIN);
    let errors = lab.fail(2, &["asm", "-"]);
    assert!(errors.contains("-o FILE"), "{errors}");
}

#[test]
fn symbols_and_listing_are_written_beside_the_binary() {
    let lab = Lab::with(&[("spin.tmc", SPIN)]);
    lab.succeed(&["asm", "spin.tmc", "--symbols", "spin.sym", "--listing=spin.lst"]);
    assert_eq!(lab.text("spin.sym"), "Loop = 0\n");
    let listing = lab.text("spin.lst");
    assert!(listing.contains("01 00 00 00 00 C8 00 C9") && listing.contains("Loop: ROR 0, Speed"));
    assert_eq!(lab.bytes("spin.bin"), SPIN_BIN);
    assert_eq!(lab.succeed(&["asm", "--listing", "spin.tmc"]), listing);
}

#[test]
fn one_thing_at_most_goes_to_standard_output() {
    let lab = Lab::with(&[("spin.tmc", SPIN)]);
    for more in [&["-o", "-", "--listing"][..], &["--symbols", "-", "--json"]] {
        let errors = lab.fail(2, &[&["asm", "spin.tmc"], more].concat());
        assert!(errors.starts_with("error: only one thing can go to standard output"), "{errors}");
    }
    assert_eq!(lab.names(), ["spin.tmc"]);
}

#[test]
fn errors_leave_the_older_binary_and_nothing_else() {
    let lab = Lab::with(&[("spin.tmc", "Loop: JA lop\nROR 0\n"), ("spin.bin", "older")]);
    let errors = lab.fail(1, &["asm", "spin.tmc", "--symbols", "spin.sym", "--listing"]);
    assert!(errors.contains("error[unknown-label]: there is no label lop"), "{errors}");
    assert!(errors.contains("= help: did you mean Loop?"), "{errors}");
    assert!(errors.ends_with("error: spin.tmc: 2 errors\n"), "{errors}");
    assert_eq!(lab.text("spin.bin"), "older");
    assert_eq!(lab.names(), ["spin.bin", "spin.tmc"]);
}

#[test]
fn a_warning_is_told_and_does_not_keep_from_assembling() {
    let lab = Lab::with(&[("spin.tmc", "Loop: SAP 4, 0, Loop\n")]);
    let (status, out, errors) = lab.run(&["asm", "spin.tmc"]);
    assert_eq!((status, &*out), (0, "spin.bin: 2 commands\n"));
    assert!(errors.starts_with("warning[label-as-number]: "), "{errors}");
}

#[test]
fn json_tells_findings_and_what_was_written() {
    let lab = Lab::with(&[("spin.tmc", SPIN), ("bad.tmc", "JA nowhere\n")]);
    let text = lab.succeed(&["asm", "spin.tmc", "--json"]);
    assert_eq!(text, "{\"output\":\"spin.bin\",\"commands\":3}\n");

    let (status, out, errors) = lab.run(&["asm", "bad.tmc", "--json"]);
    assert_eq!((status, &*errors), (1, "error: bad.tmc: 1 error\n"));
    let object: serde_json::Value = serde_json::from_str(&out).unwrap();
    assert_eq!(object["code"], "unknown-label");
    assert!(!lab.path("bad.bin").exists());
}

#[test]
fn an_output_is_never_a_source_of_the_program_or_another_output() {
    let lab = Lab::with(&[("main.tmc", "#include part.inc\nROR 0, 1\n"), ("part.inc", "A = 1\n")]);
    symlink(lab.path("part.inc"), lab.path("link.inc")).unwrap();
    for output in ["main.tmc", "./main.tmc", "part.inc", "link.inc"] {
        let errors = lab.fail(2, &["asm", "main.tmc", "-o", output]);
        assert!(
            errors.starts_with(&format!("error: {output} is a file of the program")),
            "{errors}"
        );
    }
    let errors = lab.fail(2, &["asm", "main.tmc", "--symbols", "main.bin"]);
    assert!(errors.starts_with("error: main.bin is named for two outputs"), "{errors}");
    assert_eq!(lab.text("main.tmc"), "#include part.inc\nROR 0, 1\n");
    assert_eq!(lab.text("part.inc"), "A = 1\n");
}

#[test]
fn a_binary_is_no_source() {
    let lab = Lab::with(&[("spin.BIN", "")]);
    let errors = lab.fail(2, &["asm", "spin.BIN"]);
    assert!(errors.contains("`tmcl disasm`"), "{errors}");
}

#[test]
fn what_cannot_be_read_is_named_with_the_reason() {
    let lab = Lab::with(&[("folder/spin.tmc", SPIN)]);
    let missing = lab.fail(1, &["asm", "spin.tmc"]);
    assert_eq!(missing, "error: cannot read spin.tmc: there is no such file\n");
    let folder = lab.fail(1, &["asm", "folder"]);
    assert_eq!(folder, "error: cannot read folder: it is a folder\n");
}

#[test]
fn what_cannot_be_written_is_named_with_the_reason() {
    let lab = Lab::with(&[("spin.tmc", SPIN), ("locked.bin", "older"), ("folder/x", "")]);
    fs::set_permissions(lab.path("locked.bin"), fs::Permissions::from_mode(0o444)).unwrap();
    for (output, reason) in [
        ("nowhere/spin.bin", "there is no such folder"),
        ("locked.bin", "permission denied"),
        ("folder", "it is a folder"),
    ] {
        let errors = lab.fail(1, &["asm", "spin.tmc", "-o", output]);
        assert_eq!(errors, format!("error: cannot write {output}: {reason}\n"));
    }
    assert_eq!(lab.text("locked.bin"), "older");
    // A folder in which nobody, not even the system's administrator, may make a file.
    let errors = lab.fail(1, &["asm", "spin.tmc", "-o", "/proc/spin.bin"]);
    assert!(errors.starts_with("error: cannot write /proc/spin.bin: "), "{errors}");
}

#[test]
fn no_output_takes_its_place_when_another_one_cannot() {
    let lab = Lab::with(&[("spin.tmc", SPIN)]);
    lab.fail(1, &["asm", "spin.tmc", "--symbols", "nowhere/spin.sym"]);
    assert_eq!(lab.names(), ["spin.tmc"]);
}

#[test]
fn a_new_file_has_the_usual_permissions_and_an_older_one_keeps_its_own() {
    let lab = Lab::with(&[("spin.tmc", SPIN), ("older.bin", "")]);
    let mode = |name: &str| fs::metadata(lab.path(name)).unwrap().permissions().mode() & 0o777;
    fs::set_permissions(lab.path("older.bin"), fs::Permissions::from_mode(0o640)).unwrap();
    lab.succeed(&["asm", "spin.tmc"]);
    lab.succeed(&["asm", "spin.tmc", "-o", "older.bin"]);
    assert_eq!(mode("spin.bin"), mode("spin.tmc"), "the test itself has made the source");
    assert_eq!(mode("older.bin"), 0o640);
}

#[test]
fn a_link_stays_a_link_and_a_device_a_device() {
    let lab = Lab::with(&[("spin.tmc", SPIN), ("target.bin", "")]);
    symlink(lab.path("target.bin"), lab.path("spin.bin")).unwrap();
    lab.succeed(&["asm", "spin.tmc"]);
    assert!(lab.path("spin.bin").is_symlink());
    assert_eq!(lab.bytes("target.bin"), SPIN_BIN);
    assert_eq!(lab.succeed(&["asm", "spin.tmc", "-o", "/dev/null"]), "/dev/null: 3 commands\n");
}

#[test]
fn a_file_behind_a_device_is_written_to_and_not_replaced() {
    let lab = Lab::with(&[("spin.tmc", SPIN), ("log", "older")]);
    let log = fs::File::options().write(true).open(lab.path("log")).unwrap();
    let source = lab.path("spin.tmc");
    let args = ["asm", source.to_str().unwrap(), "--symbols", "/dev/stdout", "-o", "/dev/null"];
    assert!(tmcl(&args).stdout(log.try_clone().unwrap()).status().unwrap().success());
    assert_eq!(log.metadata().unwrap().ino(), fs::metadata(lab.path("log")).unwrap().ino());
    // What is told of the binary goes the same way, to the same place: it begins the file, too.
    assert!(lab.text("log").starts_with("/dev/null: 3 commands\n"), "{}", lab.text("log"));
}

#[test]
fn an_empty_source_is_a_program_that_stops() {
    let lab = Lab::with(&[("empty.tmc", "")]);
    assert_eq!(lab.succeed(&["asm", "empty.tmc"]), "empty.bin: 1 command\n");
    assert_eq!(lab.bytes("empty.bin"), SPIN_BIN[16..]);
    assert_eq!(lab.succeed(&["asm", "empty.tmc", "--no-stop"]), "empty.bin: 0 commands\n");
    assert_eq!(lab.bytes("empty.bin"), b"");
}

/// A program that includes a file of which several define a constant: which one was taken?
fn axis(lab: &Lab, args: &[&str]) -> u8 {
    lab.succeed(&[&["asm"], args, &["-o", "out.bin"]].concat());
    lab.bytes("out.bin")[2]
}

#[test]
fn an_included_file_is_looked_for_beside_the_including_one_then_in_the_folders() {
    let lab = Lab::with(&[
        ("src/main.tmc", "#include axis.inc\nMST Axis\n"),
        ("first/axis.inc", "Axis = 1\n"),
        ("second/axis.inc", "Axis = 2\n"),
    ]);
    assert_eq!(axis(&lab, &["src/main.tmc", "-I", "first", "-I", "second"]), 1);
    assert_eq!(axis(&lab, &["src/main.tmc", "--include", "second", "-I", "first"]), 2);
    lab.write("axis.inc", "Axis = 3\n");
    assert_eq!(axis(&lab, &["src/main.tmc", "-I", "first"]), 1, "not in the working folder");
    lab.write("src/axis.inc", "Axis = 4\n");
    assert_eq!(axis(&lab, &["src/main.tmc", "-I", "first"]), 4);
}

#[test]
fn a_file_that_an_included_one_includes_is_beside_that_one() {
    let lab = Lab::with(&[
        ("main.tmc", "#include lib/all.inc\nMST Axis\n"),
        ("lib/all.inc", "#include axis.inc\n"),
        ("lib/axis.inc", "Axis = 5\n"),
        ("axis.inc", "Axis = 6\n"),
    ]);
    assert_eq!(axis(&lab, &["main.tmc"]), 5);
}

#[test]
fn names_of_files_are_those_of_windows() {
    let lab = Lab::with(&[
        ("main.tmc", "#include LIB\\Axis.INC\nMST Axis\n"),
        ("Lib/AXIS.inc", "Axis = 2\n"),
    ]);
    assert_eq!(axis(&lab, &["main.tmc"]), 2);
    lab.write("LIB/Axis.INC", "Axis = 3\n");
    assert_eq!(axis(&lab, &["main.tmc"]), 3, "the exact name is preferred");
}

#[test]
fn a_program_from_standard_input_includes_from_the_working_folder() {
    let lab = Lab::with(&[("axis.inc", "Axis = 2\n")]);
    let output = lab.output(&["asm", "-", "-o", "-"], b"#include axis.inc\nMST Axis\n");
    assert_eq!(output.stdout[..3], [3, 0, 2]);
}

#[test]
fn a_circle_of_includes_is_told_whatever_the_names() {
    let lab = Lab::with(&[("main.tmc", "#include lib/part.inc\n")]);
    lab.write("lib/part.inc", "#include ../link.tmc\n");
    symlink(lab.path("main.tmc"), lab.path("link.tmc")).unwrap();
    let errors = lab.fail(1, &["asm", "main.tmc"]);
    assert!(errors.contains("error[circular-include]: main.tmc includes itself"), "{errors}");
    assert!(errors.contains("--> lib/part.inc:1:10"), "{errors}");
    assert!(errors.ends_with("error: main.tmc: 1 error\n"), "{errors}");
}

#[test]
fn an_included_file_that_cannot_be_read_is_told_where_it_is_included() {
    let lab = Lab::with(&[
        ("main.tmc", "#include folder\n#include pipe\n#include gone.inc\n"),
        ("folder/x", ""),
    ]);
    rustix::fs::mkfifoat(rustix::fs::CWD, lab.path("pipe"), 0o600.into()).unwrap();
    let errors = lab.fail(1, &["asm", "main.tmc"]);
    for expected in [
        "error[include-not-found]: cannot read folder: it is a folder\n --> main.tmc:1:10\n",
        // A pipe to which nobody writes would be waited for.
        "error[include-not-found]: cannot read pipe: it is not a file\n --> main.tmc:2:10\n",
        "error[include-not-found]: there is no file gone.inc\n --> main.tmc:3:10\n",
    ] {
        assert!(errors.contains(expected), "{errors}");
    }
}
