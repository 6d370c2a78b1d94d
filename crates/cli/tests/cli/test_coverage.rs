//! `tmcl test --coverage` and `--lcov`.

use std::collections::BTreeMap;

use crate::lab::Lab;

/// Counted by hand for one run: line 1 once, 2 and 3 three times, of which line 3 jumps twice; the
/// accumulator is then 1, so that line 5 does not jump; line 7 never.
const MAIN: &str = "        SGP 10, 2, 3
Again:  CSUB Work
        DJNZ 10, Again
        COMP 5
        JC GT, Never
        STOP
Never:  STOP
#include work.inc
";

/// Three calls: lines 1 to 3 three times, line 4 never, as 1 is not zero.
const WORK: &str = "Work:   CALC LOAD, 1
        CALL ZE, Deep
        RSUB
Deep:   RSUB
";

fn lab() -> Lab {
    let case = "run\nwait until program stopped\n";
    let test = format!("module tmcm-6214\nprogram main.tmc\ntest \"a\"\n{case}test \"b\"\n{case}");
    Lab::with(&[("main.tmc", MAIN), ("work.inc", WORK), ("main.test.txt", &test)])
}

#[test]
fn lines_and_branches_are_counted_as_by_hand() {
    let out = lab().succeed(&["test", "--coverage", "--filter", "a"]);
    let (_, coverage) = out.split_once("\n\n").unwrap();
    let expected = "\
main.tmc
 executed        jumped
        1                   1          SGP 10, 2, 3
        3                   2  Again:  CSUB Work
        3        2 of 3     3          DJNZ 10, Again
        1                   4          COMP 5
        1        0 of 1     5          JC GT, Never
        1                   6          STOP
    never                   7  Never:  STOP

work.inc
 executed        jumped
        3                   1  Work:   CALC LOAD, 1
        3        0 of 3     2          CALL ZE, Deep
        3                   3          RSUB
    never                   4  Deep:   RSUB

          lines               branches
main.tmc  6 of 7, 85 %        3 of 4, 75 %
work.inc  3 of 4, 75 %        1 of 2, 50 %
total     9 of 11, 81 %       4 of 6, 66 %
";
    assert_eq!(coverage, expected);
}

#[test]
fn counts_of_all_cases_and_files_add_up() {
    let lab = lab();
    // The same program by another way, in a third case.
    let test = "module tmcm-6214\nprogram ../main.tmc\nrun\nwait until program stopped\n";
    lab.write("more/c.test.txt", test);
    let out = lab.succeed(&["test", "--coverage"]);
    assert!(out.contains("\n        9        6 of 9     3          DJNZ 10, Again\n"), "{out}");
    assert!(out.contains("\n        9                   3          RSUB\n"), "{out}");
    assert!(out.ends_with("total     9 of 11, 81 %       4 of 6, 66 %\n"), "{out}");
}

#[test]
fn a_file_that_is_included_twice_sums_up_and_one_that_never_ran_has_zeros() {
    let once = "#include add.inc\n#include add.inc\nSTOP\n";
    let test = "module tmcm-6214\nprogram once.tmc\ntest \"a\"\nrun\nwait 1 ms\n\
                expect accumulator = 2\ntest \"b\"\nprogram other.tmc\n";
    let lab = Lab::with(&[
        ("once.tmc", once),
        ("add.inc", "CALC ADD, 1\n"),
        ("other.tmc", "MST 0\nCALC ADD, 5\n"),
        ("a.test.txt", test),
    ]);
    let out = lab.succeed(&["test", "--coverage"]);
    assert!(
        out.contains("add.inc\n executed        jumped\n        2                   1  CALC"),
        "{out}"
    );
    assert!(out.contains("once.tmc   1 of 1, 100 %"), "{out}");
    assert!(out.contains("other.tmc  0 of 2, 0 %"), "{out}");
    assert!(out.contains("add.inc    1 of 1, 100 %       none"), "{out}");
}

#[test]
fn commands_that_took_the_place_of_the_program_are_not_counted_for_it() {
    // The program in the test lies over the first two lines, even if it does the same; a command by
    // a request over the third.
    let test = "module tmcm-6214\nprogram three.tmc\nprogram\nMST 0\nMST 2\nend\n\
                > 132 0, 0, 2\n< 100\n> MST 3\n< 101\n> 133 0, 0, 0\n< 100\nrun\nwait 1 ms\n";
    let lab = Lab::with(&[("three.tmc", "MST 0\nMST 0\nMST 0\nSTOP\n"), ("a.test.txt", test)]);
    let out = lab.succeed(&["test", "--coverage"]);
    assert!(out.contains("three.tmc  1 of 4, 25 %"), "{out}");
}

#[test]
fn what_happens_after_the_last_line_of_a_test_is_not_counted() {
    // A command takes 0.1 ms: at the end of the test, the fifth one is yet to come.
    let test = "module tmcm-6214\nprogram a.tmc\nrun\nwait 350 us\n";
    let lab = Lab::with(&[("a.tmc", "MST 0\nMST 1\nMST 2\nMST 3\nMST 4\n"), ("a.test.txt", test)]);
    let out = lab.succeed(&["test", "--coverage"]);
    assert!(out.contains("a.tmc  4 of 5, 80 %"), "{out}");
}

#[test]
fn a_binary_has_no_lines_to_count() {
    let lab = Lab::with(&[("a.test.txt", "module tmcm-6214\nprogram stop.bin\nrun\n")]);
    // STOP is number 28; the last byte is the sum.
    lab.write("stop.bin", [28, 0, 0, 0, 0, 0, 0, 28]);
    let out = lab.succeed(&["test", "--coverage"]);
    assert!(out.ends_with("not counted: 1 program without source\n"), "{out}");
}

#[test]
fn counting_changes_nothing() {
    let lab = lab();
    lab.write(
        "wrong.test.txt",
        "module tmcm-6214\nprogram main.tmc\nrun\nwait 550 us\nexpect x = 1\n",
    );
    let (status, plain, _) = lab.run(&["test"]);
    let (counted_status, counted, _) = lab.run(&["test", "--coverage"]);
    assert_eq!((status, counted_status), (1, 1));
    assert!(plain.contains("program running at "), "{plain}");
    assert!(counted.starts_with(&plain), "{counted}");
}

#[test]
fn a_tracefile_has_consistent_records() {
    let lab = lab();
    lab.succeed(&["test", "--filter", "a", "--lcov", "lcov.info"]);
    let records = parsed(&lab.text("lcov.info"));
    let names: Vec<&str> = records.iter().map(|record| record.source.as_str()).collect();
    assert_eq!(names, ["main.tmc", "work.inc"]);
    let [main, work] = &records[..] else { panic!() };
    assert_eq!(main.lines, [(1, 1), (2, 3), (3, 3), (4, 1), (5, 1), (6, 1), (7, 0)].into());
    assert_eq!(main.branches, [(3, 0, Some(2)), (3, 1, Some(1)), (5, 0, Some(0)), (5, 1, Some(1))]);
    assert_eq!(main.functions, BTreeMap::new());
    assert_eq!(work.lines, [(1, 3), (2, 3), (3, 3), (4, 0)].into());
    assert_eq!(work.branches, [(2, 0, Some(0)), (2, 1, Some(3))]);
    let functions = [("Deep".into(), (4, 0)), ("Work".into(), (1, 3))];
    assert_eq!(work.functions, functions.into());
}

#[test]
fn a_branch_that_was_never_asked_is_not_counted_as_not_taken() {
    let lab = Lab::with(&[
        ("a.tmc", "STOP\nLoop: DJNZ 1, Loop\n"),
        ("a.test.txt", "module tmcm-6214\nprogram a.tmc\nrun\nwait 1 ms\n"),
    ]);
    lab.succeed(&["test", "--lcov", "lcov.info"]);
    let records = parsed(&lab.text("lcov.info"));
    assert_eq!(records[0].branches, [(2, 0, None), (2, 1, None)]);
}

/// What a tracefile says of one source file.
#[derive(Default)]
struct Record {
    source: String,
    lines: BTreeMap<u32, u64>,
    /// Line, number of the branch, how often it was taken.
    branches: Vec<(u32, u32, Option<u64>)>,
    /// Line and how often it was entered.
    functions: BTreeMap<String, (u32, u64)>,
}

/// Reads a tracefile as lcov's manual (geninfo) describes it, and checks its sums.
#[track_caller]
fn parsed(text: &str) -> Vec<Record> {
    let mut records = Vec::new();
    let mut record = Record::default();
    let mut sums: BTreeMap<&str, usize> = BTreeMap::new();
    for line in text.lines() {
        let (key, value) = line.split_once(':').unwrap_or((line, ""));
        let fields: Vec<&str> = value.split(',').collect();
        match (key, &fields[..]) {
            ("TN", _) => {}
            ("SF", [name]) => record.source = (*name).to_owned(),
            ("DA", [line, count]) => {
                let twice = record.lines.insert(line.parse().unwrap(), count.parse().unwrap());
                assert_eq!(twice, None, "line {line}");
            }
            ("BRDA", [line, "0", branch, taken]) => {
                let taken = (*taken != "-").then(|| taken.parse().unwrap());
                record.branches.push((line.parse().unwrap(), branch.parse().unwrap(), taken));
            }
            ("FN", [line, name]) => {
                record.functions.insert((*name).to_owned(), (line.parse().unwrap(), 0));
            }
            ("FNDA", [count, name]) => {
                record.functions.get_mut(*name).unwrap().1 = count.parse().unwrap();
            }
            ("FNF" | "FNH" | "BRF" | "BRH" | "LF" | "LH", [sum]) => {
                sums.insert(key, sum.parse().unwrap());
            }
            ("end_of_record", _) => {
                let Record { lines, branches, functions, .. } = &record;
                let taken = branches.iter().filter(|(.., taken)| taken.is_some_and(|n| n > 0));
                let entered = functions.values().filter(|(_, count)| *count > 0);
                assert!(branches.iter().all(|(line, ..)| lines.contains_key(line)));
                assert_eq!(
                    (sums["LF"], sums["BRF"], sums["FNF"]),
                    (lines.len(), branches.len(), functions.len())
                );
                let hit = lines.values().filter(|count| **count > 0).count();
                assert_eq!(
                    (sums["LH"], sums["BRH"], sums["FNH"]),
                    (hit, taken.count(), entered.count())
                );
                records.push(std::mem::take(&mut record));
            }
            _ => panic!("{line}"),
        }
    }
    records
}
