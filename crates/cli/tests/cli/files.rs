//! Files that are read and written, the same for all subcommands.

use std::os::unix::fs::symlink;

use crate::lab::Lab;

#[test]
fn nothing_that_is_read_is_overwritten() {
    let (program, part) = ("#include a.inc\nSTOP\n", "A = 1\n");
    let test = "module tmcm-6214\nprogram a.tmc\nwait 1 ms\n";
    let files = [("a.tmc", program), ("a.inc", part), ("a.test.txt", test)];
    let lab = Lab::with(&files);
    let sim = ["sim", "a.tmc", "-m", "tmcm-6214"];
    for wrong in [
        [&sim[..], &["--record", "a.tmc"]].concat(),
        [&sim[..], &["--plot", "./a.tmc"]].concat(),
        [&sim[..], &["--plot", "a.inc"]].concat(),
        vec!["test", "a.test.txt", "--lcov", "a.inc"],
        vec!["test", "a.test.txt", "--junit", "a.test.txt"],
    ] {
        // Which programs tests read is known only when they have been run.
        let (status, _, errors) = lab.run(&wrong);
        assert_eq!(status, 2, "{wrong:?}: {errors}");
        assert!(errors.contains(" is read, and would be overwritten\n"), "{errors}");
        for (file, text) in files {
            assert_eq!(lab.text(file), text, "{wrong:?}");
        }
    }
    for wrong in [
        [&sim[..], &["--record", "out", "--plot", "out"]].concat(),
        vec!["test", "a.test.txt", "--lcov", "out", "--junit", "./out"],
    ] {
        let (status, _, errors) = lab.run(&wrong);
        assert_eq!(status, 2, "{wrong:?}: {errors}");
        assert!(errors.contains("out is named for two outputs"), "{errors}");
    }
}

#[test]
fn a_link_to_a_folder_above_is_not_followed() {
    let lab = Lab::with(&[("all/a.txt", "module tmcm-6214\n> GAP 1, 0\n< 100 0\n")]);
    symlink(lab.path("all"), lab.path("all/again")).unwrap();
    let out = lab.succeed(&["conform", "all"]);
    assert!(out.starts_with("ok      all/a.txt: 1 expectation\n1 transcript, 0 failed"), "{out}");
}
