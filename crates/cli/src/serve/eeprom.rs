//! Where a served module keeps its EEPROM.

use embedded_storage::nor_flash::{
    ErrorType, NorFlash, NorFlashError, NorFlashErrorKind, ReadNorFlash,
};
use opentmcl_link::FileFlash;
use opentmcl_virtual::flash::{FLASH_SIZE, MemoryFlash, PAGE_SIZE, WORD_SIZE};

/// A flash in memory or in a file: the modules of one lab may differ in that.
pub(super) enum Eeprom {
    /// Forgotten at the end.
    Memory(MemoryFlash),
    /// Kept.
    File(FileFlash<FLASH_SIZE, PAGE_SIZE, WORD_SIZE>),
}

impl ErrorType for Eeprom {
    type Error = NorFlashErrorKind;
}

impl ReadNorFlash for Eeprom {
    const READ_SIZE: usize = MemoryFlash::READ_SIZE;

    fn read(&mut self, offset: u32, bytes: &mut [u8]) -> Result<(), Self::Error> {
        match self {
            Self::Memory(flash) => flash.read(offset, bytes).map_err(|error| error.kind()),
            Self::File(flash) => flash.read(offset, bytes).map_err(|error| error.kind()),
        }
    }

    fn capacity(&self) -> usize {
        FLASH_SIZE
    }
}

impl NorFlash for Eeprom {
    const WRITE_SIZE: usize = WORD_SIZE;
    const ERASE_SIZE: usize = PAGE_SIZE;

    fn erase(&mut self, from: u32, to: u32) -> Result<(), Self::Error> {
        match self {
            Self::Memory(flash) => flash.erase(from, to).map_err(|error| error.kind()),
            Self::File(flash) => flash.erase(from, to).map_err(|error| error.kind()),
        }
    }

    fn write(&mut self, offset: u32, bytes: &[u8]) -> Result<(), Self::Error> {
        match self {
            Self::Memory(flash) => flash.write(offset, bytes).map_err(|error| error.kind()),
            Self::File(flash) => flash.write(offset, bytes).map_err(|error| error.kind()),
        }
    }
}
