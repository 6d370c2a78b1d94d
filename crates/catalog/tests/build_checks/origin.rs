//! What drives a module, and where its rows come from.

use super::data::{self, Source};
use super::{FILE, GOOD, expect, faults, generate};

#[test]
fn axis_parameters_act_in_the_rooms_of_what_drives_the_module() {
    let told = |behaviour: &str, rooms: &str| {
        format!(
            "[[axis_parameter]] 4 (max_speed): behaviour {behaviour:?} must name one of the rooms of \
             this table: {rooms}"
        )
    };
    let old = "behaviour = \"axis.max_speed\"";
    for behaviour in ["tmc429.max_speed", "tmc26x.max_speed"] {
        expect(old, &format!("behaviour = {behaviour:?}"), &told(behaviour, "tmc5160, axis"));
    }
    let other = GOOD.replace("\"tmc5160\"", "\"tmc429\"");
    for behaviour in ["tmc429.max_speed", "tmc26x.max_speed", "axis.max_speed"] {
        let text = other.replace(old, &format!("behaviour = {behaviour:?}"));
        assert_eq!(faults(&text), [""; 0], "{behaviour}");
    }
    assert_eq!(
        faults(&other.replace(old, "behaviour = \"tmc5160.max_speed\"")),
        [format!("{FILE}: {}", told("tmc5160.max_speed", "tmc429, tmc26x, axis"))]
    );
    for (motion, other) in [("foc", "block"), ("block", "foc")] {
        let servo = GOOD.replace("\"tmc5160\"", &format!("{motion:?}"));
        for room in ["servo", motion] {
            let text = servo.replace(old, &format!("behaviour = \"{room}.max_speed\""));
            assert_eq!(faults(&text), [""; 0], "{room}");
        }
        for room in [other, "axis", "tmc5160"] {
            let behaviour = format!("{room}.max_speed");
            let rooms = format!("servo, {motion}");
            assert_eq!(
                faults(&servo.replace(old, &format!("behaviour = {behaviour:?}"))),
                [format!("{FILE}: {}", told(&behaviour, &rooms))]
            );
        }
    }
}

#[test]
fn a_module_says_what_drives_it() {
    let told = faults(&GOOD.replace("\"tmc5160\"", "\"tmc4361\""));
    assert_eq!(told.len(), 1);
    let end = "unknown variant `tmc4361`, expected one of `tmc5160`, `tmc429`, `foc`, `block`";
    assert!(told[0].ends_with(end), "{told:?}");
    let told = faults(&GOOD.replace("motion = \"tmc5160\"\n", ""));
    assert_eq!(told, [format!("{FILE}: line 2: missing field `motion`")]);
}

/// The first row of each table in the good file, by a line that only it has.
const ROWS: [(&str, &str); 5] = [
    ("internal_max = 2000\n", "[[axis_parameter]] 4 (max_speed)"),
    ("access = \"RWA\"\n", "[[global_parameter]] 0/66 (address)"),
    ("id = \"timer_0\"\n", "[[interrupt]] 0 (timer_0)"),
    ("id = \"in0\"\n", "[[port]] 0/0 (in0)"),
    ("mnemonic = \"ROR\"\n", "[[command]] 1 (ROR)"),
];

#[test]
fn a_row_that_is_not_exact_says_where_it_comes_from() {
    for (line, row) in ROWS {
        for certainty in ["sister", "observed", "inferred", "recalled"] {
            let text = format!("{line}certainty = {certainty:?}\n");
            expect(
                line,
                &text,
                &format!(
                    "{row}: source is missing; a row that is not exact must say where it comes from, \
                     such as \"manual of the TMCM-351\""
                ),
            );
            let good = GOOD.replace(line, &format!("{text}source = \"a manual\"\n"));
            assert_eq!(faults(&good), [""; 0], "{row}");
        }
        expect(
            line,
            &format!("{line}source = \"\"\n"),
            &format!("{row}: source \"\" must be a text without blanks at its ends"),
        );
        let good = GOOD.replace(line, &format!("{line}certainty = \"exact\"\n"));
        assert_eq!(faults(&good), [""; 0], "{row}");
        let told = faults(&GOOD.replace(line, &format!("{line}certainty = \"sure\"\n")));
        assert_eq!(told.len(), 1, "{row}");
        let end = "unknown variant `sure`, expected one of `exact`, `sister`, `observed`, `inferred`, \
                   `recalled`";
        assert!(told[0].ends_with(end), "{told:?}");
    }
}

#[test]
fn the_generated_rows_say_since_when_they_exist_and_how_sure_they_are() {
    for (line, row) in ROWS {
        let origin = "certainty = \"recalled\"\nsource = \"a manual\"\n";
        let since = if row.contains("ROR") { "" } else { "since = [1, 46]\n" };
        let text = GOOD.replace("since = [1, 1]", "since = [1, 46]");
        let text = text.replace(line, &format!("{line}{origin}{since}"));
        let source = Source { file: FILE.to_owned(), text };
        let code = generate::generate(&[data::parse(&source).unwrap()]).unwrap();
        let told = "certainty: Certainty::Recalled, source: Some(\"a manual\"), ";
        let line = code.lines().find(|line| line.contains(told)).unwrap();
        assert!(line.contains(&format!("since: Some((1, 46)), {told}")), "{row}");
        let table = row.trim_start_matches('[').split(']').next().unwrap().replace('_', "");
        assert!(line.trim_start().to_lowercase().starts_with(&table), "{row}: {line}");
        let others = code.matches("certainty: Certainty::Exact, source: None, ").count();
        assert_eq!(others, 10, "{row}: the other rows are exact");
    }
}
