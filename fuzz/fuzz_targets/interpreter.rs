//! Any program on a virtual module, with any commands from the host while it runs, for a bounded
//! time: no panic, no endless loop, and the module answers afterwards.
//!
//! Input: module, start address, length of the program; the program, 7 bytes a command; then what
//! the host does, 8 bytes a step: milliseconds to let pass, and a command.
#![no_main]

use libfuzzer_sys::fuzz_target;
use opentmcl_catalog::MODULES;
use opentmcl_virtual::{Options, VirtualModule, flash::MemoryFlash};
use opentmcl_wire::{Command, Duration, Status, control};

/// Most steps of the host.
const STEPS: usize = 32;
/// Slow enough that a step is at most a few hundred commands of the program.
const COMMANDS_PER_SECOND: u32 = 2000;

const FIRST_CONTROL_COMMAND: u8 = 128;

fn request(number: u8, kind: u8, value: u8) -> Command {
    Command::new(number, kind, 0, i32::from(value))
}

fuzz_target!(|input: &[u8]| {
    let Some((&[model, start, length], rest)) = input.split_first_chunk::<3>() else {
        return;
    };
    let Some((program, steps)) = rest.split_at_checked(usize::from(length) * Command::LEN) else {
        return;
    };
    let model = MODULES[usize::from(model) % MODULES.len()];
    let options = Options { program_rate: COMMANDS_PER_SECOND };
    let mut module = VirtualModule::with_flash(model, MemoryFlash::new(), options);

    module.execute(request(control::START_DOWNLOAD, 0, 0));
    for &command in program.as_chunks().0 {
        let command = Command::from_bytes(command);
        // Control commands are executed in download mode too, not stored.
        if command.number < FIRST_CONTROL_COMMAND {
            assert_eq!(module.execute(command).status, Status::LOADED);
        }
    }
    module.execute(request(control::END_DOWNLOAD, 0, 0));
    module.execute(request(control::RESET_PROGRAM, 0, 0));
    module.execute(request(control::RUN_PROGRAM, 1, start));

    for &[milliseconds, ref command @ ..] in steps.as_chunks::<8>().0.iter().take(STEPS) {
        module.advance(Duration::from_millis(u64::from(milliseconds)));
        module.execute(Command::from_bytes(*command));
        while module.transmit().is_some() {}
    }
    assert_eq!(
        module.execute(request(control::APPLICATION_STATUS, 0, 0)).number,
        control::APPLICATION_STATUS
    );
});
