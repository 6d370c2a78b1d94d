//! A NOR flash in memory.

use std::ops::Range;

use embedded_storage::nor_flash::{ErrorType, NorFlash, NorFlashErrorKind, ReadNorFlash};
use opentmcl_firmware::storage::FLASH_SIZE;

/// A flash as large as the firmware needs it.
pub(crate) struct Flash(Vec<u8>);

impl Flash {
    pub(crate) fn new() -> Self {
        Self(vec![0xFF; FLASH_SIZE])
    }

    fn range(&self, offset: u32, len: usize) -> Result<Range<usize>, NorFlashErrorKind> {
        let range = offset as usize..offset as usize + len;
        if range.end <= self.0.len() { Ok(range) } else { Err(NorFlashErrorKind::OutOfBounds) }
    }
}

impl ErrorType for Flash {
    type Error = NorFlashErrorKind;
}

impl ReadNorFlash for Flash {
    const READ_SIZE: usize = 1;
    fn read(&mut self, offset: u32, bytes: &mut [u8]) -> Result<(), Self::Error> {
        let range = self.range(offset, bytes.len())?;
        bytes.copy_from_slice(&self.0[range]);
        Ok(())
    }
    fn capacity(&self) -> usize {
        self.0.len()
    }
}

impl NorFlash for Flash {
    const WRITE_SIZE: usize = 4;
    const ERASE_SIZE: usize = 4096;
    fn write(&mut self, offset: u32, bytes: &[u8]) -> Result<(), Self::Error> {
        let range = self.range(offset, bytes.len())?;
        for (cell, byte) in self.0[range].iter_mut().zip(bytes) {
            *cell &= byte;
        }
        Ok(())
    }
    fn erase(&mut self, from: u32, to: u32) -> Result<(), Self::Error> {
        let range = self.range(from, (to - from) as usize)?;
        self.0[range].fill(0xFF);
        Ok(())
    }
}
