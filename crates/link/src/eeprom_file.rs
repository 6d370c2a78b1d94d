//! The EEPROM of a module as a file: the same NOR flash that a microcontroller would have.

use std::fs::{File, OpenOptions, TryLockError};
use std::io::{self, Write};
use std::os::unix::fs::FileExt;
use std::path::{Path, PathBuf};

use embedded_storage::nor_flash::{
    ErrorType, NorFlash, NorFlashError, NorFlashErrorKind, ReadNorFlash, check_erase, check_read,
    check_write,
};

const ERASED: u8 = 0xFF;

/// Why a file does not serve as EEPROM.
#[derive(Debug, thiserror::Error)]
pub enum EepromFileError {
    /// It cannot be opened or created, or not be read.
    #[error("cannot open the EEPROM file {}: {source}", path.display())]
    Open {
        /// The file.
        path: PathBuf,
        /// Why not.
        source: io::Error,
    },
    /// Another process holds it.
    #[error("the EEPROM file {} is in use by another module", .0.display())]
    Locked(PathBuf),
    /// It holds something else.
    #[error("{} is not an EEPROM file: it has {found} bytes, not {expected}", path.display())]
    Size {
        /// The file.
        path: PathBuf,
        /// Its size in bytes.
        found: u64,
        /// The size of an EEPROM file in bytes.
        expected: usize,
    },
}

impl EepromFileError {
    /// What the user can do about it.
    pub fn help(&self) -> String {
        match self {
            Self::Open { .. } => "name a file in a directory that you may write to".into(),
            Self::Locked(_) => {
                "stop the other `tmcl serve`, or give this module a file of its own".into()
            }
            Self::Size { .. } => {
                "name another file; one that does not exist is created with factory settings".into()
            }
        }
    }
}

/// Why an operation on the flash failed.
#[derive(Debug, thiserror::Error)]
pub enum FlashError {
    /// Offset or length is not a multiple of the word or page, or outside of the memory.
    #[error("{0}")]
    Arguments(NorFlashErrorKind),
    /// The file did not take it, for example because the disk is full.
    #[error("cannot write the EEPROM file: {0}")]
    Write(#[from] io::Error),
}

impl NorFlashError for FlashError {
    fn kind(&self) -> NorFlashErrorKind {
        match self {
            Self::Arguments(kind) => *kind,
            Self::Write(_) => NorFlashErrorKind::Other,
        }
    }
}

/// A NOR flash of `SIZE` bytes in a file, with pages of `PAGE` and words of `WORD` bytes.
///
/// Like the chip it only clears bits when it writes and sets them page by page when it erases. The
/// file holds the plain contents and nothing else. It is locked for as long as this value lives.
///
/// Every operation has reached the operating system when it returns, in order, so nothing is lost
/// if the process ends in whatever way. It is on the disk when the value is dropped; if the host
/// itself loses power before, the latest operations may be missing.
#[derive(Debug)]
pub struct FileFlash<const SIZE: usize, const PAGE: usize, const WORD: usize> {
    file: File,
    /// What the file holds: reading needs no system call.
    contents: Vec<u8>,
}

impl<const SIZE: usize, const PAGE: usize, const WORD: usize> FileFlash<SIZE, PAGE, WORD> {
    /// Opens and locks the file; creates it erased if it is missing or empty.
    ///
    /// # Errors
    /// When it cannot be opened, another process holds it, or it has another size.
    pub fn open(path: &Path) -> Result<Self, EepromFileError> {
        let failed = |source| EepromFileError::Open { path: path.to_owned(), source };
        let mut file = OpenOptions::new()
            .read(true)
            .write(true)
            .create(true)
            .truncate(false)
            .open(path)
            .map_err(failed)?;
        file.try_lock().map_err(|error| match error {
            TryLockError::WouldBlock => EepromFileError::Locked(path.to_owned()),
            TryLockError::Error(source) => failed(source),
        })?;
        let metadata = file.metadata().map_err(failed)?;
        let mut contents = vec![ERASED; SIZE];
        match metadata.len() {
            0 if metadata.is_file() => file.write_all(&contents).map_err(failed)?,
            len if usize::try_from(len) == Ok(SIZE) => {
                file.read_exact_at(&mut contents, 0).map_err(failed)?;
            }
            found => {
                return Err(EepromFileError::Size { path: path.to_owned(), found, expected: SIZE });
            }
        }
        Ok(Self { file, contents })
    }

    /// Changes `len` bytes from `offset` on, first in the file, then here.
    fn change(
        &mut self,
        offset: u32,
        len: usize,
        change: impl FnOnce(&mut [u8]),
    ) -> Result<(), FlashError> {
        let start = offset as usize;
        let mut bytes = self.contents[start..start + len].to_vec();
        change(&mut bytes);
        self.file.write_all_at(&bytes, u64::from(offset))?;
        self.contents[start..start + len].copy_from_slice(&bytes);
        Ok(())
    }
}

impl<const SIZE: usize, const PAGE: usize, const WORD: usize> Drop for FileFlash<SIZE, PAGE, WORD> {
    fn drop(&mut self) {
        // Only a host that loses power could notice that this failed.
        let _ = self.file.sync_data();
    }
}

impl<const SIZE: usize, const PAGE: usize, const WORD: usize> ErrorType
    for FileFlash<SIZE, PAGE, WORD>
{
    type Error = FlashError;
}

impl<const SIZE: usize, const PAGE: usize, const WORD: usize> ReadNorFlash
    for FileFlash<SIZE, PAGE, WORD>
{
    const READ_SIZE: usize = 1;

    fn read(&mut self, offset: u32, bytes: &mut [u8]) -> Result<(), FlashError> {
        check_read(self, offset, bytes.len()).map_err(FlashError::Arguments)?;
        let start = offset as usize;
        bytes.copy_from_slice(&self.contents[start..start + bytes.len()]);
        Ok(())
    }

    fn capacity(&self) -> usize {
        SIZE
    }
}

impl<const SIZE: usize, const PAGE: usize, const WORD: usize> NorFlash
    for FileFlash<SIZE, PAGE, WORD>
{
    const WRITE_SIZE: usize = WORD;
    const ERASE_SIZE: usize = PAGE;

    fn erase(&mut self, from: u32, to: u32) -> Result<(), FlashError> {
        check_erase(self, from, to).map_err(FlashError::Arguments)?;
        self.change(from, (to - from) as usize, |bytes| bytes.fill(ERASED))
    }

    fn write(&mut self, offset: u32, bytes: &[u8]) -> Result<(), FlashError> {
        check_write(self, offset, bytes.len()).map_err(FlashError::Arguments)?;
        self.change(offset, bytes.len(), |old| {
            for (old, new) in old.iter_mut().zip(bytes) {
                *old &= new;
            }
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::fs;

    type Flash = FileFlash<32768, 4096, 4>;

    fn folder() -> tempfile::TempDir {
        tempfile::tempdir().unwrap()
    }

    #[test]
    fn a_missing_file_is_created_erased() {
        let folder = folder();
        let path = folder.path().join("eeprom");
        drop(Flash::open(&path).unwrap());
        assert_eq!(fs::read(&path).unwrap(), [0xFF; 32768]);
    }

    #[test]
    fn what_is_written_is_in_the_file_at_once_and_read_again_after_reopening() {
        let folder = folder();
        let path = folder.path().join("eeprom");
        let mut flash = Flash::open(&path).unwrap();
        flash.write(4096, &[1, 2, 3, 4]).unwrap();
        assert_eq!(fs::read(&path).unwrap()[4096..4101], [1, 2, 3, 4, 0xFF]);
        drop(flash);

        let mut flash = Flash::open(&path).unwrap();
        let mut bytes = [0; 5];
        flash.read(4096, &mut bytes).unwrap();
        assert_eq!(bytes, [1, 2, 3, 4, 0xFF]);
    }

    #[test]
    fn writing_clears_bits_and_only_erasing_sets_them_in_its_page() {
        let folder = folder();
        let mut flash = Flash::open(&folder.path().join("eeprom")).unwrap();
        flash.write(0, &[0b1100; 4]).unwrap();
        flash.write(0, &[0b1010; 4]).unwrap();
        flash.write(4096, &[0; 4]).unwrap();
        let mut byte = [0];
        flash.read(0, &mut byte).unwrap();
        assert_eq!(byte, [0b1000]);

        flash.erase(0, 4096).unwrap();
        flash.read(0, &mut byte).unwrap();
        assert_eq!(byte, [0xFF]);
        flash.read(4096, &mut byte).unwrap();
        assert_eq!(byte, [0]);
    }

    #[test]
    fn a_file_in_use_is_refused_and_free_again_afterwards() {
        let folder = folder();
        let path = folder.path().join("eeprom");
        let first = Flash::open(&path).unwrap();
        let error = Flash::open(&path).unwrap_err();
        assert!(matches!(&error, EepromFileError::Locked(at) if *at == path), "{error}");
        drop(first);
        assert!(Flash::open(&path).is_ok());
    }

    #[test]
    fn a_file_of_another_size_is_refused_and_left_alone() {
        let folder = folder();
        let path = folder.path().join("letter.txt");
        fs::write(&path, "Dear reader").unwrap();
        let error = Flash::open(&path).unwrap_err();
        assert!(error.to_string().ends_with("it has 11 bytes, not 32768"), "{error}");
        assert_eq!(fs::read(&path).unwrap(), b"Dear reader");
    }

    #[test]
    fn a_place_where_no_file_can_be_is_an_error() {
        let error = Flash::open(Path::new("/no/such/eeprom")).unwrap_err();
        assert!(matches!(error, EepromFileError::Open { .. }), "{error}");
        assert!(Flash::open(folder().path()).is_err());
    }

    #[test]
    fn operations_outside_of_the_memory_or_across_words_are_refused() {
        let folder = folder();
        let mut flash = Flash::open(&folder.path().join("eeprom")).unwrap();
        let refusals = [
            flash.write(32768, &[0; 4]),
            flash.write(2, &[0; 4]),
            flash.write(0, &[0; 3]),
            flash.erase(0, 100),
            flash.erase(0, 65536),
            flash.read(32768, &mut [0]),
        ];
        for refusal in refusals {
            assert!(matches!(refusal, Err(FlashError::Arguments(_))), "{refusal:?}");
        }
        let mut all = vec![0; 32768];
        flash.read(0, &mut all).unwrap();
        assert!(all.iter().all(|&byte| byte == 0xFF));
    }
}
