//! Any text as one command: no panic, and what is read prints as text that reads the same.
#![no_main]

use libfuzzer_sys::fuzz_target;
use opentmcl_wire::mnemonic::parse;

fuzz_target!(|text: &str| {
    match parse(text) {
        Ok(command) => {
            let printed = command.to_string();
            assert_eq!(parse(&printed), Ok(command), "{text:?} prints as {printed:?}");
        }
        Err(error) => assert!(!error.to_string().is_empty()),
    }
});
