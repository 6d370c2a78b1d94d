//! Power fails at every single operation of the flash, in every command that stores something: what
//! is found afterwards is the value before or the value after, and the module starts and stores again.

use std::cell::Cell;

use opentmcl_virtual::{MemoryFlash, Options, VirtualModule};
use opentmcl_wire::{Command, Status, mnemonic};

fn command(text: &str) -> Command {
    mnemonic::parse(text).unwrap_or_else(|error| panic!("{text}: {error}"))
}

thread_local! {
    /// The module of the present test, each of which has a thread of its own.
    static MODEL: Cell<&'static str> = const { Cell::new("tmcm-6214") };
}

fn start(flash: MemoryFlash) -> VirtualModule {
    let model = opentmcl_catalog::find(MODEL.get()).unwrap();
    VirtualModule::with_flash(model, flash, Options::default())
}

fn run(module: &mut VirtualModule, commands: &[&str]) {
    for text in commands {
        let reply = module.execute(command(text));
        assert!(reply.status.is_ok(), "{text}: {}", reply.status);
    }
}

/// What the probes read after a restart from this flash.
fn state(flash: &MemoryFlash, probes: &[&str]) -> Vec<i32> {
    let mut flash = flash.clone();
    flash.restore_power();
    let mut module = start(flash);
    probes.iter().map(|probe| module.execute(command(probe)).value).collect()
}

/// Runs `storing` on a module in the state of `flash`, with the power failing after every possible
/// number of flash operations, and checks what `probes` read after each. Gives the flash after the
/// undisturbed run, and the number of operations.
fn cut_everywhere(flash: &MemoryFlash, storing: &[&str], probes: &[&str]) -> (MemoryFlash, u64) {
    let before = state(flash, probes);
    let undisturbed = {
        let mut module = start(flash.clone());
        run(&mut module, storing);
        module.into_flash()
    };
    let after = state(&undisturbed, probes);
    let operations = undisturbed.operations() - flash.operations();
    for cut in 0..operations {
        let mut module = start(flash.clone());
        module.board_mut().flash_mut().cut_power_after(cut);
        for text in storing {
            module.execute(command(text));
        }
        let mut left = module.into_flash();
        left.restore_power();
        let found = state(&left, probes);
        for (at, probe) in probes.iter().enumerate() {
            assert!(
                found[at] == before[at] || found[at] == after[at],
                "{probe} reads {} after a cut at operation {cut} of {storing:?}; before {}, after {}",
                found[at],
                before[at],
                after[at],
            );
        }
        // The memory works on: the same commands now store the new values.
        let mut module = start(left);
        run(&mut module, storing);
        assert_eq!(state(&module.into_flash(), probes), after, "again after cut {cut}");
    }
    (undisturbed, operations)
}

fn prepared(commands: &[&str]) -> MemoryFlash {
    let mut module = start(MemoryFlash::new());
    run(&mut module, commands);
    module.into_flash()
}

#[test]
fn a_global_parameter() {
    let flash = prepared(&["SGP 66, 0, 7"]);
    let (_, operations) = cut_everywhere(&flash, &["SGP 66, 0, 9"], &["GGP 66, 0", "GGP 76, 0"]);
    assert!(operations >= 2, "a value is more than one word: {operations}");
}

#[test]
fn a_global_parameter_on_a_memory_never_written() {
    cut_everywhere(&MemoryFlash::new(), &["SGP 87, 0, 9"], &["GGP 87, 0"]);
}

#[test]
fn a_user_variable() {
    let flash = prepared(&["SGP 42, 2, 1000000", "STGP 42, 2", "SGP 43, 2, -1", "STGP 43, 2"]);
    let storing = ["SGP 42, 2, -7654321", "STGP 42, 2"];
    cut_everywhere(&flash, &storing, &["GGP 42, 2", "GGP 43, 2"]);
}

#[test]
fn axis_parameters_on_request() {
    MODEL.set("tmcm-6110");
    let flash = prepared(&["SAP 4, 0, 500", "STAP 4, 0", "SAP 153, 5, 9", "STAP 153, 5"]);
    let storing = ["SAP 4, 0, 600", "STAP 4, 0", "SAP 5, 5, 77", "STAP 5, 5"];
    cut_everywhere(&flash, &storing, &["GAP 4, 0", "GAP 5, 5", "GAP 153, 5", "GAP 4, 1"]);
}

#[test]
fn settings_of_interrupts_the_lock_and_the_magic() {
    MODEL.set("tmcm-6110");
    let flash = prepared(&["SGP 27, 3, 1", "STGP 27, 3", "SGP 75, 0, 9"]);
    let probes = ["GGP 27, 3", "GGP 0, 3", "GGP 73, 0", "GGP 75, 0"];
    let storing = ["SGP 27, 3, 3", "STGP 27, 3", "SGP 0, 3, 1000", "STGP 0, 3"];
    cut_everywhere(&flash, &storing, &probes);
    cut_everywhere(&flash, &["SGP 73, 0, 1234"], &probes);
    // Without its magic the memory is forgotten by the next start, which may lose power, too.
    let (lost, _) = cut_everywhere(&flash, &["SGP 64, 0, 1"], &["GGP 64, 0"]);
    let probes = ["GGP 64, 0", "GGP 75, 0", "GGP 27, 3"];
    assert_eq!(state(&lost, &probes), [228, 0, 0]);
    let operations = start(lost.clone()).into_flash().operations() - lost.operations();
    assert!(operations > 1, "{operations}");
    for cut in 0..operations {
        let mut flash = lost.clone();
        flash.cut_power_after(cut);
        let left = start(flash).into_flash();
        assert_eq!(state(&left, &probes), [228, 0, 0], "a reset cut at {cut}");
    }
}

#[test]
fn coordinates_one_by_one_and_all_at_once() {
    let flash = prepared(&["SCO 1, 0, 11", "SCO 1, 5, 15", "SCO 20, 3, -20", "SCO 0, 255, 0"]);
    let storing = ["SCO 1, 0, 111", "SCO 1, 5, 115", "SCO 20, 3, -120", "SCO 0, 255, 0"];
    let probes = ["GCO 1, 0", "GCO 1, 5", "GCO 20, 3", "GCO 2, 2"];
    cut_everywhere(&flash, &storing, &probes);
    cut_everywhere(&flash, &["SCO 20, 3, 77", "SCO 20, 255, 0"], &probes);
    let always = prepared(&["SGP 84, 0, 1", "SCO 3, 2, 32"]);
    cut_everywhere(&always, &["SCO 3, 2, -32"], &["GCO 3, 2", "GGP 84, 0"]);
    cut_everywhere(&always, &["CCO 3, 2"], &["GCO 3, 2"]);
    cut_everywhere(&always, &["CALC LOAD, 5", "ACO 3, 2"], &["GCO 3, 2"]);
}

#[test]
fn a_program() {
    let download = |value: i32| -> Vec<String> {
        let mut commands = vec!["132 0, 0, 0".into()];
        commands.extend((0..70).map(|at| format!("SGP {at}, 2, {value}")));
        commands.push("133 0, 0, 0".into());
        commands
    };
    let (old, new) = (download(1), download(2));
    let old: Vec<&str> = old.iter().map(String::as_str).collect();
    let new: Vec<&str> = new.iter().map(String::as_str).collect();
    // Command 134 answers with the bytes of the command; its value stands where a reply has it.
    let probes = ["134 0, 0, 0", "134 0, 0, 31", "134 0, 0, 32", "134 0, 0, 69", "134 0, 0, 70"];
    cut_everywhere(&prepared(&old), &new, &probes);
}

#[test]
fn lifting_the_code_protection_never_shows_the_program() {
    let program = ["132 0, 0, 0", "JA 5", "133 0, 0, 0", "SGP 81, 0, 1"];
    let flash = prepared(&program);
    let (_, operations) = cut_everywhere(&flash, &["SGP 81, 0, 0"], &["GGP 81, 0"]);
    for cut in 0..=operations {
        let mut module = start(flash.clone());
        module.board_mut().flash_mut().cut_power_after(cut);
        module.execute(command("SGP 81, 0, 0"));
        // 134 shows the first command only if it is there and not protected.
        assert_eq!(state(&module.into_flash(), &["134 0, 0, 0"]), [0], "cut {cut}");
    }
}

#[test]
fn a_factory_reset() {
    // Older values of the same parameters lie on other pages and must not come back.
    let mut module = start(prepared(&["SGP 5, 2, 5", "STGP 5, 2"]));
    for value in 0..1200 {
        run(&mut module, &[&format!("SGP 66, 0, {}", 2 + value % 250)]);
    }
    let flash = module.into_flash();
    let (_, operations) = cut_everywhere(&flash, &["137 0, 0, 1234"], &["GGP 66, 0", "GGP 5, 2"]);
    assert!(operations > 8, "the journal and all pages: {operations}");
}

#[test]
fn every_store_while_the_memory_fills_and_is_cleaned_up() {
    // Enough stores to close every page of the flash and move its contents on more than once.
    let mut flash = prepared(&["SGP 66, 0, 7", "SGP 0, 2, -1", "STGP 0, 2"]);
    let mut longest = 0;
    for value in 0..2500 {
        let set = format!("SGP 1, 2, {value}");
        let storing = [set.as_str(), "STGP 1, 2"];
        // A short store is looked at now and then, one that cleans up always and everywhere.
        let mut module = start(flash.clone());
        run(&mut module, &storing);
        let next = module.into_flash();
        let operations = next.operations() - flash.operations();
        if operations > 8 || value % 100 == 0 {
            cut_everywhere(&flash, &storing, &["GGP 1, 2", "GGP 0, 2", "GGP 66, 0"]);
        }
        longest = longest.max(operations);
        flash = next;
    }
    assert!(longest > 8, "no page has been cleaned up: {longest}");
}

#[test]
fn a_module_without_power_for_its_memory_says_so() {
    let mut module = start(MemoryFlash::new());
    module.board_mut().flash_mut().cut_power_after(0);
    let reply = module.execute(command("SGP 66, 0, 7"));
    assert_eq!(reply.status, Status::EEPROM_LOCKED);
    assert_eq!(module.execute(command("GGP 66, 0")).value, 1, "what is not stored is not set");
}
