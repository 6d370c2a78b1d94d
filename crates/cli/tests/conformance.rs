//! All transcripts run on virtual modules, and together they cover the catalogue.

use std::process::Command;

#[test]
fn all_transcripts_pass_on_virtual_modules_and_cover_the_catalogue() {
    let output = Command::new(env!("CARGO_BIN_EXE_tmcl"))
        .args(["conform", "--coverage"])
        .current_dir(concat!(env!("CARGO_MANIFEST_DIR"), "/../.."))
        .output()
        .unwrap();
    let printed = String::from_utf8_lossy(&output.stdout);
    println!("{printed}");
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    assert!(printed.contains("TMCM-6214 "), "the coverage table is missing");
    let summary = printed.lines().find(|line| line.contains(" transcripts, ")).unwrap();
    assert!(!summary.starts_with("0 "), "{summary}");
}

#[test]
fn a_failed_expectation_is_told_with_file_and_line() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("wrong.txt");
    std::fs::write(&path, "module tmcm-6214\n> GAP 4, 0\n< 100 7\n> GAP 1, 0\n< 100 0\n").unwrap();
    let output =
        Command::new(env!("CARGO_BIN_EXE_tmcl")).arg("conform").arg(&path).output().unwrap();
    let printed = String::from_utf8_lossy(&output.stdout);
    assert_eq!(output.status.code(), Some(1));
    assert!(
        printed.contains("wrong.txt:3: GAP 4, 0\n    expected status 100, value 7"),
        "{printed}"
    );
    assert!(printed.contains("1 of 2 expectations"), "{printed}");
}

#[test]
fn without_a_folder_of_transcripts_the_user_is_told_what_to_do() {
    let folder = tempfile::tempdir().unwrap();
    let output = Command::new(env!("CARGO_BIN_EXE_tmcl"))
        .arg("conform")
        .current_dir(folder.path())
        .output()
        .unwrap();
    let told = String::from_utf8_lossy(&output.stderr);
    assert_eq!(output.status.code(), Some(2));
    assert!(told.contains("no folder conformance here") && told.contains("name transcripts"));
}
