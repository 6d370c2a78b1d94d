//! Any bytes as a binary: read or refused record by record, and any records disassemble to a program
//! that assembles to them.
#![no_main]

use libfuzzer_sys::fuzz_target;
use opentmcl_lang::include::BuiltInOnly;
use opentmcl_lang::{Disassembly, Options, assemble, binary, disassemble};
use opentmcl_wire::Command;

fuzz_target!(|bytes: &[u8]| {
    match binary::decode(bytes) {
        Ok(commands) => assert_eq!(binary::encode(commands.into_iter()), bytes),
        Err(bad) => {
            assert!(!bad.is_empty());
            assert!(bad.iter().all(|record| !record.to_string().is_empty()));
        }
    }
    // Records without their checksums, so that every input is a program.
    let commands: Vec<Command> = bytes
        .chunks_exact(Command::LEN)
        .filter_map(|record| record.try_into().ok())
        .map(Command::from_bytes)
        .collect();
    for module in [None, opentmcl_catalog::find("tmcm-6214")] {
        let text = disassemble(&commands, &Disassembly { module, title: None });
        let options = Options { append_stop: false };
        let assembly = assemble("fuzz.tmc", text.as_str(), &mut BuiltInOnly, options);
        assert!(assembly.diagnostics.is_empty(), "{:?}\n{text}", assembly.diagnostics);
        assert!(assembly.commands().eq(commands.iter().copied()), "{text}");
    }
});
