//! `tmcl fmt`.

use std::fs;
use std::os::unix::fs::{MetadataExt, PermissionsExt};

use crate::lab::Lab;

const UGLY: &str = "loop:  ror 0,1000   // turn\n   ja loop\n";

#[test]
fn files_are_formatted_in_place_and_those_that_have_changed_are_named() {
    let lab = Lab::with(&[("a.tmc", UGLY), ("b.tmc", UGLY)]);
    assert_eq!(lab.succeed(&["fmt", "a.tmc", "b.tmc"]), "a.tmc\nb.tmc\n");
    let text = lab.text("a.tmc");
    let lines: Vec<&str> = text.lines().map(str::trim).collect();
    assert!(lines[0].starts_with("loop: ROR 0, 1000 ") && lines[0].ends_with("// turn"), "{text}");
    assert_eq!(lines[1..], ["JA loop"]);
    assert_eq!(lab.text("b.tmc"), text);

    let inode = || fs::metadata(lab.path("a.tmc")).unwrap().ino();
    let before = inode();
    assert_eq!(lab.succeed(&["fmt", "a.tmc", "b.tmc"]), "");
    assert_eq!(inode(), before, "a file that is as it should be is not written");
}

#[test]
fn a_check_names_files_and_changes_nothing() {
    let lab = Lab::with(&[("a.tmc", UGLY), ("b.tmc", UGLY), ("good.tmc", "")]);
    let (status, out, errors) = lab.run(&["fmt", "--check", "a.tmc", "good.tmc", "b.tmc"]);
    assert_eq!((status, &*out), (1, "a.tmc\nb.tmc\n"));
    assert_eq!(errors, "error: 2 files are not formatted\nhelp: `tmcl fmt` formats them\n");
    assert_eq!(lab.text("a.tmc"), UGLY);
    assert_eq!(lab.succeed(&["fmt", "--check", "good.tmc"]), "");
}

#[test]
fn standard_input_is_formatted_to_standard_output() {
    let lab = Lab::with(&[("a.tmc", UGLY)]);
    let (status, out, errors) = lab.run_with(&["fmt", "-"], UGLY.as_bytes());
    assert_eq!((status, &*errors), (0, ""));
    lab.succeed(&["fmt", "a.tmc"]);
    assert_eq!(out, lab.text("a.tmc"));
    let (status, out, _) = lab.run_with(&["fmt", "--check", "-"], UGLY.as_bytes());
    assert_eq!((status, &*out), (1, "<stdin>\n"));
}

#[test]
fn a_file_keeps_its_encoding_line_ends_and_permissions() {
    let lab = Lab::with(&[]);
    // µ is B5 in CP-1252 and C2 B5 in UTF-8, where EF BB BF is the mark at the beginning.
    lab.write("windows.tmc", b"ror 0,1 // \xB5s\r\n");
    lab.write("mark.tmc", b"\xEF\xBB\xBFror 0,1 // \xC2\xB5s\n");
    fs::set_permissions(lab.path("mark.tmc"), fs::Permissions::from_mode(0o600)).unwrap();
    lab.succeed(&["fmt", "windows.tmc", "mark.tmc"]);
    let windows = lab.bytes("windows.tmc");
    assert!(windows.ends_with(b"// \xB5s\r\n"), "{windows:?}");
    let mark = lab.bytes("mark.tmc");
    assert!(mark.starts_with(b"\xEF\xBB\xBF") && mark.ends_with(b"// \xC2\xB5s\n"), "{mark:?}");
    assert_eq!(fs::metadata(lab.path("mark.tmc")).unwrap().permissions().mode() & 0o777, 0o600);
}

#[test]
fn a_file_with_errors_is_left_alone_and_the_others_are_formatted() {
    let bad = "loop:  ror 0,(1\n";
    let lab = Lab::with(&[("bad.tmc", bad), ("good.tmc", UGLY)]);
    let (status, out, errors) = lab.run(&["fmt", "bad.tmc", "good.tmc"]);
    assert_eq!((status, &*out), (1, "good.tmc\n"));
    assert!(errors.starts_with("error[unclosed-parenthesis]"), "{errors}");
    assert!(errors.contains("--> bad.tmc:1:"), "{errors}");
    assert!(errors.ends_with("error: 1 file with errors cannot be formatted\n"), "{errors}");
    assert_eq!(lab.text("bad.tmc"), bad);

    let (status, out, _) = lab.run_with(&["fmt", "-"], bad.as_bytes());
    assert_eq!((status, &*out), (1, ""));
}

#[test]
fn what_only_other_files_can_tell_does_not_matter() {
    let lab = Lab::with(&[("part.tmc", "#include gone.inc\nror 0,speed\nja elsewhere\n")]);
    assert_eq!(lab.succeed(&["fmt", "part.tmc"]), "part.tmc\n");
}

#[test]
fn a_folder_means_the_sources_in_it_and_below() {
    let lab = Lab::with(&[
        ("z.tmc", UGLY),
        ("deep/er/B.TMC", UGLY),
        ("deep/a.inc", UGLY),
        (".git/c.tmc", UGLY),
    ]);
    assert_eq!(lab.succeed(&["fmt", "."]), "deep/er/B.TMC\nz.tmc\n");
    assert_eq!(lab.text("deep/a.inc"), UGLY);
    assert_eq!(lab.text(".git/c.tmc"), UGLY);
    lab.write("empty/x.txt", "");
    let errors = lab.fail(2, &["fmt", "empty"]);
    assert!(errors.starts_with("error: there are no .tmc files in empty\n"), "{errors}");
}

#[test]
fn binaries_random_bytes_and_missing_files_are_refused() {
    let lab = Lab::with(&[("a.bin", "")]);
    let errors = lab.fail(2, &["fmt", "a.bin"]);
    assert!(errors.starts_with("error: a.bin is a binary"), "{errors}");
    let errors = lab.fail(1, &["fmt", "gone.tmc"]);
    assert_eq!(errors, "error: cannot read gone.tmc: there is no such file\n");
    let noise: Vec<u8> = (0..=255).rev().collect();
    lab.write("noise.tmc", &noise);
    lab.fail(1, &["fmt", "noise.tmc"]);
    assert_eq!(lab.bytes("noise.tmc"), noise);
    lab.fail(2, &["fmt"]);
}
