//! `tmcl disasm`.

use crate::lab::Lab;

/// ROR 0, 51200 and JA 0, by hand: the last byte is the sum of the others.
const SPIN: &[u8] = &[0x01, 0, 0, 0, 0, 0xC8, 0, 0xC9, 0x16, 0, 0, 0, 0, 0, 0, 0x16];

fn lab() -> Lab {
    let lab = Lab::with(&[]);
    lab.write("spin.bin", SPIN);
    lab
}

#[test]
fn a_binary_becomes_a_source_with_its_name_and_labels() {
    let source = lab().succeed(&["disasm", "spin.bin"]);
    let lines: Vec<&str> = source.lines().filter(|line| !line.is_empty()).collect();
    assert_eq!(lines, ["// spin.bin", "Lbl0:     ROR 0, 51200", "          JA Lbl0"]);
}

#[test]
fn the_source_assembles_to_the_same_bytes() {
    let lab = lab();
    assert_eq!(lab.succeed(&["disasm", "spin.bin", "-o", "spin.tmc"]), "");
    lab.succeed(&["asm", "spin.tmc", "-o", "again.bin", "--no-stop"]);
    assert_eq!(lab.bytes("again.bin"), SPIN);
}

#[test]
fn a_module_gives_names_to_its_parameters() {
    let lab = Lab::with(&[]);
    // SAP 4, 0, 1000: axis parameter 4 is the maximum speed; 5 + 4 + 3 + $E8 = $F4.
    lab.write("speed.bin", [5, 4, 0, 0, 0, 0x03, 0xE8, 0xF4]);
    let plain = lab.succeed(&["disasm", "speed.bin"]);
    let named = lab.succeed(&["disasm", "speed.bin", "--module", "TMCM-6214"]);
    assert!(plain.contains("SAP 4, 0, 1000\n"), "{plain}");
    assert!(named.contains("SAP APMaxPositioningSpeed, 0, 1000 "), "{named}");
    assert!(named.contains("#include tmcm-6214.inc\n"), "{named}");
}

#[test]
fn a_binary_comes_from_standard_input_too() {
    let lab = lab();
    let (status, out, errors) = lab.run_with(&["disasm", "-"], SPIN);
    assert_eq!((status, &*errors), (0, ""));
    assert!(out.contains("JA Lbl0"), "{out}");
}

#[test]
fn a_bad_record_is_told_with_its_number_and_what_is_wrong() {
    let lab = lab();
    let mut bytes = SPIN.to_vec();
    bytes[15] = 0x17;
    lab.write("spin.bin", &bytes);
    let errors = lab.fail(1, &["disasm", "spin.bin", "-o", "spin.tmc"]);
    assert!(errors.starts_with("error: spin.bin: record 1 (from byte 8): "), "{errors}");
    assert!(errors.contains("$17") && errors.contains("$16"), "{errors}");
    assert!(errors.contains("\nhelp: a binary has eight bytes per command"), "{errors}");

    lab.write("spin.bin", &SPIN[..13]);
    let errors = lab.fail(1, &["disasm", "spin.bin", "-o", "spin.tmc"]);
    assert!(errors.contains("record 1 (from byte 8): the file ends after 5"), "{errors}");
    assert_eq!(lab.names(), ["spin.bin"]);
}

#[test]
fn a_source_is_no_binary() {
    let lab = Lab::with(&[("spin.tmc", "ROR 0, 51200\nSTOP\n")]);
    let errors = lab.fail(1, &["disasm", "spin.tmc"]);
    assert!(errors.starts_with("error: spin.tmc: record 0"), "{errors}");
    assert!(errors.contains("other records are wrong as well"), "{errors}");
}

#[test]
fn the_binary_itself_is_not_overwritten() {
    let lab = lab();
    let errors = lab.fail(2, &["disasm", "spin.bin", "-o", "./spin.bin"]);
    assert!(errors.starts_with("error: ./spin.bin is read, and would be overwritten"), "{errors}");
    assert_eq!(lab.bytes("spin.bin"), SPIN);
}

#[test]
fn an_unknown_module_and_a_missing_file_are_refused() {
    let lab = lab();
    let errors = lab.fail(2, &["disasm", "spin.bin", "--module", "tmcm6214"]);
    assert!(errors.contains("did you mean tmcm-6214?"), "{errors}");
    let errors = lab.fail(1, &["disasm", "gone.bin"]);
    assert_eq!(errors, "error: cannot read gone.bin: there is no such file\n");
}
