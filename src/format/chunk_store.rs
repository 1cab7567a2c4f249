//! Where the chunks of a file are between encoding and writing: in memory, or in a temporary file.

use std::borrow::Cow;
#[cfg(not(target_arch = "wasm32"))]
use std::io::{Read, Seek, Write};
#[cfg(not(target_arch = "wasm32"))]
use std::ops::Range;

use super::chunk::ChunkId;
use super::error::FormatError;
#[cfg(not(target_arch = "wasm32"))]
use super::spool::Spool;

/// Keeps the chunks of a file by number, in file order.
pub trait ChunkStore {
    /// Keeps chunk number `number`, which is not empty.
    ///
    /// # Errors
    /// [`FormatError::Spool`].
    fn put(&mut self, number: usize, bytes: Vec<u8>) -> Result<(), FormatError>;

    /// Keeps the chunks of `tile`, `[scan]`, in a file with so many `tiles`. Those that are empty are left out.
    ///
    /// # Errors
    /// Those of [`put`](Self::put).
    fn put_tile(
        &mut self,
        tile: usize,
        tiles: usize,
        chunks: impl Iterator<Item = Vec<u8>>,
    ) -> Result<(), FormatError>
    where
        Self: Sized,
    {
        for (scan, bytes) in chunks.enumerate() {
            let tile = Some(tile);
            if !bytes.is_empty() {
                self.put(ChunkId { scan, tile }.number(tiles), bytes)?;
            }
        }
        Ok(())
    }

    /// Chunk number `number`; empty if none was kept.
    ///
    /// # Errors
    /// [`FormatError::Spool`], and [`FormatError::Source`] of a store that others wrote.
    fn get(&self, number: usize) -> Result<Cow<'_, [u8]>, FormatError>;
}

/// In memory.
impl ChunkStore for Vec<Vec<u8>> {
    fn put(&mut self, number: usize, bytes: Vec<u8>) -> Result<(), FormatError> {
        if self.len() <= number {
            self.resize_with(number + 1, Vec::new);
        }
        self[number] = bytes;
        Ok(())
    }

    fn get(&self, number: usize) -> Result<Cow<'_, [u8]>, FormatError> {
        let chunk = self.as_slice().get(number);
        Ok(Cow::Borrowed(chunk.map_or(&[], Vec::as_slice)))
    }
}

/// In a temporary file.
#[cfg(not(target_arch = "wasm32"))]
#[derive(Debug)]
pub struct SpooledChunks<F> {
    spool: Spool<F>,
    places: Vec<Range<u64>>,
}

#[cfg(not(target_arch = "wasm32"))]
impl<F> SpooledChunks<F> {
    /// Chunks in `spool`.
    pub fn new(spool: Spool<F>) -> Self {
        Self {
            spool,
            places: Vec::new(),
        }
    }
}

#[cfg(not(target_arch = "wasm32"))]
impl<F: Read + Write + Seek> ChunkStore for SpooledChunks<F> {
    fn put(&mut self, number: usize, bytes: Vec<u8>) -> Result<(), FormatError> {
        if self.places.len() <= number {
            self.places.resize(number + 1, 0..0);
        }
        self.places[number] = self.spool.append(|out| out.write_all(&bytes))?;
        Ok(())
    }

    fn get(&self, number: usize) -> Result<Cow<'_, [u8]>, FormatError> {
        let place = self.places.get(number).cloned().unwrap_or_default();
        let bytes = self.spool.read(place).map_err(FormatError::Spool)?;
        Ok(Cow::Owned(bytes))
    }
}
