//! What concerns the EEPROM as a whole: a factory reset that loses power, a memory full of rubbish.

use embedded_storage::nor_flash::{ErrorType, NorFlash, ReadNorFlash};
use opentmcl_virtual::flash::{FLASH_SIZE, FlashError};
use opentmcl_virtual::{MemoryFlash, Options, VirtualModule};
use opentmcl_wire::mnemonic;

fn start(mut flash: MemoryFlash) -> VirtualModule {
    flash.restore_power();
    let model = opentmcl_catalog::find("tmcm-6214").unwrap();
    VirtualModule::with_flash(model, flash, Options::default())
}

fn execute(module: &mut VirtualModule, text: &str) -> i32 {
    module.execute(mnemonic::parse(text).unwrap()).value
}

/// The stored user variable, coordinate and global parameter.
fn state(flash: MemoryFlash) -> [i32; 3] {
    let mut module = start(flash);
    ["GGP 5, 2", "GCO 3, 1", "GGP 76, 0"].map(|probe| execute(&mut module, probe))
}

#[test]
fn a_factory_reset_that_loses_power_is_finished_or_has_not_begun() {
    let mut module = start(MemoryFlash::new());
    for command in ["SGP 5, 2, 55", "STGP 5, 2", "SGP 84, 0, 1"] {
        execute(&mut module, command);
    }
    // What is stored in between moves the three values to different pages.
    for value in 0..400 {
        execute(&mut module, &format!("SGP 66, 0, {}", 2 + value % 250));
    }
    execute(&mut module, "SCO 3, 1, 33");
    for value in 0..400 {
        execute(&mut module, &format!("SGP 66, 0, {}", 2 + value % 250));
    }
    execute(&mut module, "SGP 76, 0, 20");
    let full = module.into_flash();
    assert_eq!(state(full.clone()), [55, 33, 20]);

    let mut outcomes = Vec::new();
    for cut in 0.. {
        let mut module = start(full.clone());
        let before = module.board_mut().flash_mut().operations();
        module.board_mut().flash_mut().cut_power_after(cut);
        execute(&mut module, "137 0, 0, 1234");
        let flash = module.into_flash();
        let is_complete = flash.operations() - before < cut;
        let found = state(flash);
        assert!(found == [55, 33, 20] || found == [0, 0, 2], "{found:?} after a cut at {cut}");
        outcomes.push(found);
        if is_complete {
            break;
        }
    }
    assert_eq!((outcomes.first(), outcomes.last()), (Some(&[55, 33, 20]), Some(&[0, 0, 2])));
}

#[test]
fn a_module_whose_memory_is_full_of_rubbish_starts_with_factory_settings_and_stores_again() {
    for rubbish in [0x00, 0x5A] {
        let mut flash = MemoryFlash::new();
        flash.write(0, &vec![rubbish; FLASH_SIZE - 4096]).unwrap();
        let mut module = start(flash);
        assert_eq!(execute(&mut module, "GGP 76, 0"), 2);
        let reply = module.execute(mnemonic::parse("SGP 76, 0, 20").unwrap());
        assert_eq!(reply.status.0, 100, "{rubbish:#x}");
        module.power_cycle();
        assert_eq!(execute(&mut module, "GGP 76, 0"), 20);
    }
}

/// A flash whose reads fail while it is told so; everything else works.
#[derive(Default)]
struct Unreadable {
    flash: MemoryFlash,
    fails: bool,
}

impl ErrorType for Unreadable {
    type Error = FlashError;
}

impl ReadNorFlash for Unreadable {
    const READ_SIZE: usize = MemoryFlash::READ_SIZE;

    fn read(&mut self, offset: u32, bytes: &mut [u8]) -> Result<(), FlashError> {
        if self.fails { Err(FlashError::PowerLost) } else { self.flash.read(offset, bytes) }
    }

    fn capacity(&self) -> usize {
        self.flash.capacity()
    }
}

impl NorFlash for Unreadable {
    const WRITE_SIZE: usize = MemoryFlash::WRITE_SIZE;
    const ERASE_SIZE: usize = MemoryFlash::ERASE_SIZE;

    fn write(&mut self, offset: u32, bytes: &[u8]) -> Result<(), FlashError> {
        self.flash.write(offset, bytes)
    }

    fn erase(&mut self, from: u32, to: u32) -> Result<(), FlashError> {
        self.flash.erase(from, to)
    }
}

#[test]
fn a_flash_that_does_not_answer_is_not_erased() {
    let mut module = start(MemoryFlash::new());
    execute(&mut module, "SGP 76, 0, 20");
    let flash = Unreadable { flash: module.into_flash(), fails: true };
    let model = opentmcl_catalog::find("tmcm-6214").unwrap();
    let mut module = VirtualModule::with_flash(model, flash, Options::default());
    let host = mnemonic::parse("GGP 76, 0").unwrap();
    assert_eq!(module.execute(host).value, 2, "it starts, with the factory setting");
    module.board_mut().flash_mut().fails = false;
    module.power_cycle();
    assert_eq!(module.execute(host).value, 20, "what was stored is still there");
}
