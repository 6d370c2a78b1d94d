//! A NOR flash in memory.
//!
//! Pages hold nothing until something is written to them, so that thousands of modules fit into
//! one process. A flash can lose power: [`MemoryFlash::cut_power_after`] says at which operation.

use embedded_storage::nor_flash::{
    ErrorType, NorFlash, NorFlashError, NorFlashErrorKind, ReadNorFlash, check_erase, check_read,
    check_write,
};

/// Bytes of the flash.
pub const FLASH_SIZE: usize = opentmcl_firmware::storage::FLASH_SIZE;

/// Bytes that are erased together.
pub const PAGE_SIZE: usize = 4096;

/// Bytes that are written together.
pub const WORD_SIZE: usize = 4;

const ERASED: u8 = 0xFF;

type Page = [u8; PAGE_SIZE];

/// NOR flash in memory: reads bytes, writes words by clearing bits, erases pages.
#[derive(Clone, Debug, Default)]
pub struct MemoryFlash {
    pages: [Option<Box<Page>>; FLASH_SIZE / PAGE_SIZE],
    /// Words and pages that can still be written or erased before power fails.
    remaining: Option<u64>,
    operations: u64,
}

/// Why the flash did not do what it was asked.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum FlashError {
    /// An address outside the flash or not at the start of a word or page.
    Address(NorFlashErrorKind),
    /// Power has failed.
    PowerLost,
}

impl NorFlashError for FlashError {
    fn kind(&self) -> NorFlashErrorKind {
        match self {
            Self::Address(kind) => *kind,
            Self::PowerLost => NorFlashErrorKind::Other,
        }
    }
}

impl MemoryFlash {
    /// An erased flash.
    pub fn new() -> Self {
        Self::default()
    }

    /// Lets power fail after this many further operations; an operation is the writing of one word or
    /// the erasing of one page. From then on everything fails until [`MemoryFlash::restore_power`].
    pub fn cut_power_after(&mut self, operations: u64) {
        self.remaining = Some(operations);
    }

    /// Power is back; the contents are as they were left.
    pub fn restore_power(&mut self) {
        self.remaining = None;
    }

    /// Operations done so far.
    pub fn operations(&self) -> u64 {
        self.operations
    }

    fn spend(&mut self) -> Result<(), FlashError> {
        match &mut self.remaining {
            Some(0) => return Err(FlashError::PowerLost),
            Some(remaining) => *remaining -= 1,
            None => {}
        }
        self.operations += 1;
        Ok(())
    }

    fn page(&mut self, address: usize) -> &mut Page {
        self.pages[address / PAGE_SIZE].get_or_insert_with(|| Box::new([ERASED; PAGE_SIZE]))
    }
}

impl ErrorType for MemoryFlash {
    type Error = FlashError;
}

impl ReadNorFlash for MemoryFlash {
    const READ_SIZE: usize = 1;

    fn read(&mut self, offset: u32, bytes: &mut [u8]) -> Result<(), FlashError> {
        check_read(self, offset, bytes.len()).map_err(FlashError::Address)?;
        if self.remaining == Some(0) {
            return Err(FlashError::PowerLost);
        }
        let mut address = offset as usize;
        let mut rest = bytes;
        while !rest.is_empty() {
            let within = address % PAGE_SIZE;
            let len = rest.len().min(PAGE_SIZE - within);
            let (now, later) = rest.split_at_mut(len);
            match &self.pages[address / PAGE_SIZE] {
                Some(page) => now.copy_from_slice(&page[within..within + len]),
                None => now.fill(ERASED),
            }
            address += len;
            rest = later;
        }
        Ok(())
    }

    fn capacity(&self) -> usize {
        FLASH_SIZE
    }
}

impl NorFlash for MemoryFlash {
    const WRITE_SIZE: usize = WORD_SIZE;
    const ERASE_SIZE: usize = PAGE_SIZE;

    fn write(&mut self, offset: u32, bytes: &[u8]) -> Result<(), FlashError> {
        check_write(self, offset, bytes.len()).map_err(FlashError::Address)?;
        for (word, bytes) in bytes.chunks(WORD_SIZE).enumerate() {
            self.spend()?;
            let address = offset as usize + word * WORD_SIZE;
            let within = address % PAGE_SIZE;
            let cells = &mut self.page(address)[within..within + WORD_SIZE];
            for (cell, byte) in cells.iter_mut().zip(bytes) {
                *cell &= byte;
            }
        }
        Ok(())
    }

    fn erase(&mut self, from: u32, to: u32) -> Result<(), FlashError> {
        check_erase(self, from, to).map_err(FlashError::Address)?;
        for page in from as usize / PAGE_SIZE..to as usize / PAGE_SIZE {
            self.spend()?;
            self.pages[page] = None;
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn bytes(flash: &mut MemoryFlash, offset: u32) -> [u8; 8] {
        let mut bytes = [0; 8];
        flash.read(offset, &mut bytes).unwrap();
        bytes
    }

    #[test]
    fn an_erased_flash_reads_as_ones_and_writing_clears_bits() {
        let mut flash = MemoryFlash::new();
        assert_eq!(bytes(&mut flash, 4092), [0xFF; 8]);
        flash.write(4092, &[0xF0, 1, 2, 3, 4, 5, 6, 7]).unwrap();
        flash.write(4092, &[0x0F, 0xFF, 0xFF, 0xFF]).unwrap();
        assert_eq!(bytes(&mut flash, 4092), [0, 1, 2, 3, 4, 5, 6, 7]);
        flash.erase(0, 4096).unwrap();
        assert_eq!(bytes(&mut flash, 4092), [0xFF, 0xFF, 0xFF, 0xFF, 4, 5, 6, 7]);
    }

    #[test]
    fn power_fails_between_two_words() {
        let mut flash = MemoryFlash::new();
        flash.cut_power_after(1);
        assert_eq!(flash.write(0, &[0; 8]), Err(FlashError::PowerLost));
        assert_eq!(flash.read(0, &mut [0]), Err(FlashError::PowerLost));
        flash.restore_power();
        assert_eq!(bytes(&mut flash, 0), [0, 0, 0, 0, 0xFF, 0xFF, 0xFF, 0xFF]);
    }

    #[test]
    fn addresses_are_checked() {
        let mut flash = MemoryFlash::new();
        let beyond = FLASH_SIZE as u32;
        let out = FlashError::Address(NorFlashErrorKind::OutOfBounds);
        assert_eq!(flash.read(beyond, &mut [0]), Err(out));
        assert_eq!(
            flash.write(2, &[0; 4]),
            Err(FlashError::Address(NorFlashErrorKind::NotAligned))
        );
    }
}
