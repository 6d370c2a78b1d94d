//! The EEPROM: a map from keys to values on NOR flash, kept by `sequential-storage`.
//!
//! Each value is written as a whole and carries a checksum, so that power may fail at any moment:
//! what is found afterwards is the value before or the value after. A factory reset erases several
//! pages; a word in a page of its own, the journal, says that it has begun, and the next start
//! finishes it.
//!
//! The flash must be [`FLASH_SIZE`] bytes large; its pages must divide [`JOURNAL_SIZE`].

use core::future::Future;
use core::pin::pin;
use core::task::{Context, Poll, Waker};

use embedded_storage::nor_flash::{ErrorType, NorFlash, ReadNorFlash};
use embedded_storage_async::nor_flash as asynchronous;
use sequential_storage::cache::{Cache, Uncached};
use sequential_storage::map::{MapConfig, MapStorage};

use crate::program::{CHUNK_LEN, CHUNKS};
use opentmcl_wire::Command;

/// Bytes of flash that the EEPROM takes.
pub const FLASH_SIZE: usize = 32 * 1024;

/// Bytes at the end of the flash for the journal.
pub const JOURNAL_SIZE: usize = 4 * 1024;

const JOURNAL: u32 = (FLASH_SIZE - JOURNAL_SIZE) as u32;

/// Bytes of a program chunk: seven for each command.
const CHUNK_BYTES: usize = CHUNK_LEN * Command::LEN;

/// Longest item with its key, rounded up to any flash word.
const BUFFER: usize = CHUNK_BYTES + 32;

/// Longest flash word that the journal can write.
const MAX_WORD: usize = 32;

/// What an item of the EEPROM is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Key {
    /// Global parameter of bank 0 with this number.
    Global(u8),
    /// User variable with this number.
    Variable(u8),
    /// Coordinate and axis.
    Coordinate(u8, u8),
    /// Chunk of the program.
    Chunk(u8),
    /// Axis parameter with this number, and axis.
    AxisParameter(u8, u8),
    /// Setting of interrupts with this number in bank 3.
    Interrupt(u8),
}

impl Key {
    const fn number(self) -> u16 {
        match self {
            Self::Global(number) => number as u16,
            Self::Variable(number) => 0x100 + number as u16,
            Self::Coordinate(coordinate, axis) => 0x200 + coordinate as u16 * 8 + axis as u16 % 8,
            Self::Interrupt(number) => 0x300 + number as u16,
            Self::AxisParameter(parameter, axis) => 0x800 + parameter as u16 * 8 + axis as u16 % 8,
            Self::Chunk(chunk) => 0x1000 + chunk as u16,
        }
    }

    const fn from_number(number: u16) -> Option<Self> {
        let low = (number & 0xFF) as u8;
        match number {
            0x000..=0x0FF => Some(Self::Global(low)),
            0x100..=0x1FF => Some(Self::Variable(low)),
            0x200..=0x2FF => Some(Self::Coordinate(low / 8, low % 8)),
            0x300..=0x3FF => Some(Self::Interrupt(low)),
            0x800..=0xFFF => Some(Self::AxisParameter((number / 8) as u8, low % 8)),
            0x1000..=0x10FF if (low as usize) < CHUNKS => Some(Self::Chunk(low)),
            _ => None,
        }
    }
}

/// The value of an item.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Item<'a> {
    /// A number.
    Number(i32),
    /// The commands of a chunk, seven bytes each; none for an empty one.
    Commands(&'a [u8]),
}

/// Why the EEPROM did not give or take a value.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum StorageError {
    /// The flash failed. What it holds may be as good as before.
    Flash,
    /// The flash holds no map, one damaged beyond repair, or one with no room left.
    Map,
}

impl<E> From<sequential_storage::Error<E>> for StorageError {
    fn from(error: sequential_storage::Error<E>) -> Self {
        match error {
            sequential_storage::Error::Storage { .. } => Self::Flash,
            _ => Self::Map,
        }
    }
}

/// Gives every item in the order in which they were written: the last one of a key counts.
pub(crate) fn load<F: NorFlash>(flash: &mut F, mut item: impl FnMut(Key, Item<'_>)) {
    finish_factory_reset(flash);
    let loaded = with_map(flash, async |map| {
        let mut buffer = [0; BUFFER];
        let mut items = map.fetch_all_items(&mut buffer).await?;
        while let Some((key, bytes)) = items.next::<&[u8]>(&mut buffer).await? {
            match (Key::from_number(key), bytes.try_into()) {
                (Some(key @ Key::Chunk(_)), _) => item(key, Item::Commands(bytes)),
                (Some(key), Ok(bytes)) => item(key, Item::Number(i32::from_le_bytes(bytes))),
                _ => {}
            }
        }
        Ok(())
    });
    if loaded == Err(StorageError::Map) {
        // A module with factory settings still starts. A flash that only failed to answer is left
        // alone: its contents may be there the next time.
        let _ = factory_reset(flash);
    }
}

/// Stores a number.
pub(crate) fn store<F: NorFlash>(flash: &mut F, key: Key, value: i32) -> Result<(), StorageError> {
    store_bytes(flash, key, &value.to_le_bytes())
}

/// Stores the commands of a chunk; an empty slice stands for an empty chunk.
pub(crate) fn store_chunk<F: NorFlash>(
    flash: &mut F,
    chunk: u8,
    commands: &[Command],
) -> Result<(), StorageError> {
    let mut bytes = [0; CHUNK_BYTES];
    for (place, command) in bytes.chunks_exact_mut(Command::LEN).zip(commands) {
        place.copy_from_slice(&command.to_bytes());
    }
    let used = bytes.get(..commands.len() * Command::LEN).unwrap_or_default();
    store_bytes(flash, Key::Chunk(chunk), used)
}

/// The number stored under a key.
pub(crate) fn fetch<F: NorFlash>(flash: &mut F, key: Key) -> Result<Option<i32>, StorageError> {
    with_map(flash, async |map| {
        let mut buffer = [0; BUFFER];
        let bytes = map.fetch_item::<&[u8]>(&mut buffer, &key.number()).await?;
        Ok(bytes.and_then(|bytes| bytes.try_into().ok()).map(i32::from_le_bytes))
    })
}

fn store_bytes<F: NorFlash>(flash: &mut F, key: Key, bytes: &[u8]) -> Result<(), StorageError> {
    with_map(flash, async |map| {
        let mut buffer = [0; BUFFER];
        Ok(map.store_item(&mut buffer, &key.number(), &bytes).await?)
    })
}

/// Forgets everything.
pub(crate) fn factory_reset<F: NorFlash>(flash: &mut F) -> Result<(), StorageError> {
    let word = [0; MAX_WORD];
    let word = word.get(..F::WRITE_SIZE).ok_or(StorageError::Flash)?;
    flash.write(JOURNAL, word).map_err(|_| StorageError::Flash)?;
    flash.erase(0, JOURNAL).map_err(|_| StorageError::Flash)?;
    flash.erase(JOURNAL, FLASH_SIZE as u32).map_err(|_| StorageError::Flash)
}

/// A factory reset that lost power has left a mark, whole or torn; its work is done again.
fn finish_factory_reset<F: NorFlash>(flash: &mut F) {
    let mut word = [0xFF; MAX_WORD];
    let marked = match word.get_mut(..F::WRITE_SIZE.max(F::READ_SIZE)) {
        Some(word) => flash.read(JOURNAL, word).is_ok() && word.iter().any(|&byte| byte != 0xFF),
        None => false,
    };
    if marked && flash.erase(0, JOURNAL).is_ok() {
        // If this fails the mark stays, and the next start tries again.
        let _ = flash.erase(JOURNAL, FLASH_SIZE as u32);
    }
}

type Map<'a, F> = MapStorage<u16, Blocking<'a, F>, Cache<Uncached, Uncached, Uncached, u16>>;

fn with_map<F: NorFlash, T>(
    flash: &mut F,
    work: impl AsyncFnOnce(&mut Map<'_, F>) -> Result<T, StorageError>,
) -> Result<T, StorageError> {
    let config = MapConfig::try_new(0..JOURNAL).map_err(|_| StorageError::Map)?;
    let mut map = MapStorage::new(Blocking(flash), config, Cache::new_uncached());
    finish(work(&mut map)).unwrap_or(Err(StorageError::Flash))
}

/// Runs a future that never waits, since the flash below it blocks.
fn finish<T>(future: impl Future<Output = T>) -> Option<T> {
    match pin!(future).poll(&mut Context::from_waker(Waker::noop())) {
        Poll::Ready(value) => Some(value),
        Poll::Pending => None,
    }
}

/// A blocking flash for the asynchronous interface of `sequential-storage`.
struct Blocking<'a, F>(&'a mut F);

impl<F: ErrorType> ErrorType for Blocking<'_, F> {
    type Error = F::Error;
}

impl<F: ReadNorFlash> asynchronous::ReadNorFlash for Blocking<'_, F> {
    const READ_SIZE: usize = F::READ_SIZE;

    async fn read(&mut self, offset: u32, bytes: &mut [u8]) -> Result<(), Self::Error> {
        self.0.read(offset, bytes)
    }

    fn capacity(&self) -> usize {
        self.0.capacity()
    }
}

impl<F: NorFlash> asynchronous::NorFlash for Blocking<'_, F> {
    const WRITE_SIZE: usize = F::WRITE_SIZE;
    const ERASE_SIZE: usize = F::ERASE_SIZE;

    async fn erase(&mut self, from: u32, to: u32) -> Result<(), Self::Error> {
        self.0.erase(from, to)
    }

    async fn write(&mut self, offset: u32, bytes: &[u8]) -> Result<(), Self::Error> {
        self.0.write(offset, bytes)
    }
}
