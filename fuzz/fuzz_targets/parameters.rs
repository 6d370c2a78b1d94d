//! Any parameter, port and motion commands with any values: no panic, and a refused write leaves the
//! value as it was.
//!
//! Input: the module, then 8 bytes a step: milliseconds to let pass, and a command, whose number
//! counts in `ACTIONS`.
#![no_main]

use libfuzzer_sys::fuzz_target;
use opentmcl_catalog::MODULES;
use opentmcl_virtual::VirtualModule;
use opentmcl_wire::{Command, Duration, Opcode};

/// Most steps in one run.
const STEPS: usize = 128;

enum Action {
    /// Changes a value that the second command reads.
    Write(Opcode, Opcode),
    Other(Opcode),
    PowerCycle,
}

use Action::{Other, PowerCycle, Write};

const ACTIONS: [Action; 14] = [
    Write(Opcode::Sap, Opcode::Gap),
    Write(Opcode::Sgp, Opcode::Ggp),
    Write(Opcode::Sio, Opcode::Gio),
    Write(Opcode::Sco, Opcode::Gco),
    Other(Opcode::Gio),
    Other(Opcode::Stgp),
    Other(Opcode::Rsgp),
    Other(Opcode::Cco),
    Other(Opcode::Ror),
    Other(Opcode::Rol),
    Other(Opcode::Mvp),
    Other(Opcode::Mst),
    Other(Opcode::Rfs),
    PowerCycle,
];

fuzz_target!(|input: &[u8]| {
    let Some((&model, steps)) = input.split_first() else {
        return;
    };
    let mut module = VirtualModule::new(MODULES[usize::from(model) % MODULES.len()]);
    for &[milliseconds, ref command @ ..] in steps.as_chunks::<8>().0.iter().take(STEPS) {
        module.advance(Duration::from_millis(u64::from(milliseconds)));
        while module.transmit().is_some() {}

        let command = Command::from_bytes(*command);
        let with = |opcode: Opcode| Command { number: opcode.number(), ..command };
        match ACTIONS[usize::from(command.number) % ACTIONS.len()] {
            Other(opcode) => {
                module.execute(with(opcode));
            }
            PowerCycle => module.power_cycle(),
            Write(writer, reader) => {
                let write = with(writer);
                let read = Command { value: 0, ..with(reader) };
                // Some values change by being read: random numbers, flags.
                let steady = module.execute(read) == module.execute(read);
                let before = module.execute(read);
                let reply = module.execute(write);
                let after = module.execute(read);
                assert_eq!(reply.number, write.number, "{write:?}");
                if steady && !reply.status.is_ok() {
                    assert_eq!(before, after, "{write:?} was refused with {reply:?}");
                }
            }
        }
    }
});
