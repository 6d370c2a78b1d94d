//! Everything that the manuals print, assembled to the bytes that they print; see `manual/README.md`.

use std::fs;
use std::path::{Path, PathBuf};

use opentmcl_lang::include::{BuiltInOnly, Found, Sources};
use opentmcl_lang::{Assembly, Code, Options, assemble};
use opentmcl_wire::Command;
use opentmcl_wire::serial;

fn folder(name: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/manual").join(name)
}

/// Files of a folder beside the program, without the built-in ones.
struct Folder(PathBuf);

impl Sources for Folder {
    fn find(&mut self, name: &str, _from: &str) -> Found {
        match fs::read_to_string(self.0.join(name)) {
            Ok(text) => Found::File { name: name.into(), text },
            Err(_) => Found::Nothing,
        }
    }
}

fn hex(text: &str) -> Vec<u8> {
    text.split_whitespace().map(|byte| u8::from_str_radix(byte, 16).unwrap()).collect()
}

#[track_caller]
fn must_be_valid(name: &str, assembly: &Assembly) {
    assert!(assembly.diagnostics.is_empty(), "{name}: {:#?}", assembly.diagnostics);
}

/// The records of a program, as `.hex` files have them.
fn records(assembly: &Assembly) -> Vec<Vec<u8>> {
    let record = |command: Command| {
        let mut bytes = command.to_bytes().to_vec();
        bytes.push(bytes.iter().fold(0, |sum: u8, byte| sum.wrapping_add(*byte)));
        bytes
    };
    assembly.commands().map(record).collect()
}

#[test]
fn every_printed_command_has_the_printed_bytes() {
    let text = fs::read_to_string(folder("commands.txt")).unwrap();
    let mut count = 0;
    for line in text.lines() {
        let fields: Vec<_> = line.split('|').map(str::trim).collect();
        let [place, source, bytes, _note] = fields[..] else { panic!("{line}") };
        let options = Options { append_stop: false };
        let assembly = assemble(place, source, &mut BuiltInOnly, options);
        must_be_valid(place, &assembly);
        let commands: Vec<_> = assembly.commands().collect();
        let [command] = commands[..] else { panic!("{line}: {commands:?}") };
        assert_eq!(serial::encode_request(1, command).to_vec(), hex(bytes), "{line}");
        count += 1;
    }
    assert_eq!(count, 81);
}

#[track_caller]
fn assembles_to_its_hex(source: &Path, sources: &mut dyn Sources, options: Options) {
    let name = source.display().to_string();
    let text = fs::read_to_string(source).unwrap();
    let assembly = assemble(&name, text, sources, options);
    must_be_valid(&name, &assembly);
    let expected = fs::read_to_string(source.with_extension("hex")).unwrap();
    let expected: Vec<_> = expected.lines().map(hex).filter(|record| !record.is_empty()).collect();
    assert_eq!(records(&assembly), expected, "{name}");
}

#[test]
fn every_printed_program_has_the_bytes_that_follow_from_the_tables() {
    let mut sources: Vec<_> = fs::read_dir(folder("programs"))
        .unwrap()
        .map(|entry| entry.unwrap().path())
        .filter(|path| path.extension().is_some_and(|extension| extension == "tmc"))
        .collect();
    sources.sort();
    assert_eq!(sources.len(), 26);
    for source in &sources {
        assembles_to_its_hex(source, &mut BuiltInOnly, Options::default());
        assembles_to_its_hex(source, &mut Folder(folder("programs/include")), Options::default());
    }
}

#[test]
fn binaries_from_the_field_come_out_byte_for_byte() {
    let without_stop = Options { append_stop: false };
    let pytrinamic = folder("binaries/pytrinamic-test.tmc");
    assembles_to_its_hex(&pytrinamic, &mut BuiltInOnly, without_stop);
    let go_tmcl = folder("binaries/go-tmcl-hello-world.tmc");
    assembles_to_its_hex(&go_tmcl, &mut BuiltInOnly, Options::default());
}

#[test]
fn the_one_invalid_program_of_the_manual_is_refused_where_it_is_wrong() {
    for entry in fs::read_dir(folder("programs/invalid")).unwrap() {
        let text = fs::read_to_string(entry.unwrap().path()).unwrap();
        let assembly = assemble("invalid", text.as_str(), &mut BuiltInOnly, Options::default());
        let [diagnostic] = &assembly.diagnostics[..] else { panic!("{:?}", assembly.diagnostics) };
        assert_eq!(diagnostic.code, Code::UnknownKeyword);
        assert_eq!(assembly.text(diagnostic.location), "REL");
        assert_eq!(diagnostic.message, "REL is a keyword; a motor is expected here");
    }
}
