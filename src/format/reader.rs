//! Reading without I/O: bytes in, light transport out.

use std::ops::Range;

use super::constants::{FIRST_BYTES, HEADER_BYTES};
use super::error::{FormatError, damaged};
use super::header::{self, Header};
use super::index::FileIndex;
use super::memory_budget::{Limits, MemoryBudget};
use super::memory_estimate::{self, Part};
use super::metadata::MetadataText;
use super::partial_file::{ChunkSelection, PartialFile};
use crate::transport::Transport;

/// An incremental reader. [`wants`](Self::wants) lists the byte ranges to fetch, and [`feed`](Self::feed) takes bytes
/// in pieces of any size and checks and decodes each chunk when it is complete.
///
/// ```text
///           144 bytes            index_bytes           all chunks of scan 0          all chunks
///  HEADER ------------> INDEX --------------> CHUNKS ----------------------> COARSE ------------> COMPLETE
///  wants the first      wants the rest        wants chunks, scan             wants the later      wants
///  16 KiB               of the index          by scan; index()               scans; preview()     nothing; finish()
///
///  finish_early() gives the light transport of any state from CHUNKS on. After an error of feed the
///  reader keeps the chunks that it has decoded. A chunk with a wrong checksum can be fed again. If a
///  chunk does not decode, its tile is dark, later previews end before its scan, and finish() fails.
/// ```
///
/// All memory comes from one budget, [`Limits`]: a reader that exceeds it returns
/// [`FormatError::Limit`], and one whose system refuses memory [`FormatError::Memory`].
///
/// ```
/// use relightable_photo::format::{ChunkSelection, Limits, LtmReader};
/// # fn open(file: &[u8]) -> Result<(), relightable_photo::format::FormatError> {
/// let mut reader = LtmReader::new(Limits::default());
/// loop {
///     let wanted = reader.wants(&ChunkSelection::default());
///     let Some(range) = wanted.first() else { break };
///     let (start, end) = (range.start as usize, file.len().min(range.end as usize));
///     if start >= end {
///         break; // the file is cut short, which `finish` reports
///     }
///     reader.feed(range.start, &file[start..end])?;
/// }
/// let (transport, metadata) = reader.finish()?;
/// # Ok(()) }
/// # assert!(matches!(open(b"\xABLTM 10"), Err(relightable_photo::format::FormatError::Truncated { .. })));
/// ```
#[derive(Debug)]
pub struct LtmReader {
    budget: MemoryBudget,
    /// The first bytes of the index, until it is complete.
    gathered: Vec<u8>,
    header: Option<Header>,
    state: Option<PartialFile>,
    /// Bytes of the index received.
    received_index_bytes: u64,
    /// Bytes that the coefficients may take.
    max_tile_bytes: Option<u64>,
    /// How much of the file the limits must cover.
    part: Part,
}

/// How much of a file has been read.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct ReadProgress {
    /// Bytes received, each counted once.
    pub bytes: u64,
    /// Bytes of the file, once the header is known.
    pub file_bytes: Option<u64>,
    /// Scans that are complete for every tile.
    pub scans: usize,
    /// Tiles that are complete.
    pub tiles: usize,
}

impl LtmReader {
    /// A reader that has no bytes yet.
    pub fn new(limits: Limits) -> Self {
        Self {
            budget: MemoryBudget::new(limits),
            gathered: Vec::new(),
            header: None,
            state: None,
            received_index_bytes: 0,
            max_tile_bytes: None,
            part: Part::WholeFile,
        }
    }

    /// A reader for the index alone, which also opens files that are larger than the limits if no tile is: for
    /// [`decode_tile`](super::decode_tile).
    pub fn of_index(limits: Limits) -> Self {
        Self {
            part: Part::Tile,
            ..Self::new(limits)
        }
    }

    /// Reads the first components only, in fours, as far as their coefficients take at most `bytes` in memory, at least four;
    /// all of a lossless file. Call it before the first [`feed`](Self::feed).
    pub fn limit_tiles(&mut self, bytes: u64) {
        self.max_tile_bytes = Some(bytes);
    }

    /// Byte ranges to fetch, the most important first: the index, and then each scan as far as `selection`
    /// goes, without the bytes received. The first range may reach beyond the end of a small file. Returns
    /// at most 1,024 ranges; empty when nothing is missing.
    pub fn wants(&self, selection: &ChunkSelection) -> Vec<Range<u64>> {
        let Some(state) = &self.state else {
            let have = self.gathered.len() as u64;
            let end = self.index_bytes().unwrap_or(FIRST_BYTES);
            return std::iter::once(have..end).collect();
        };
        state.wants(selection)
    }

    /// How much has been read.
    pub fn progress(&self) -> ReadProgress {
        let state = self.state.as_ref();
        ReadProgress {
            bytes: self.received_bytes(),
            file_bytes: self.header.as_ref().map(|header| header.file_bytes),
            scans: state.map_or(0, PartialFile::complete_scans),
            tiles: state.map_or(0, PartialFile::complete_tiles),
        }
    }

    /// Bytes of the index, once the header is known.
    pub fn index_bytes(&self) -> Option<u64> {
        self.header.as_ref().map(Header::index_bytes)
    }

    /// The file index, once it is complete.
    pub fn index(&self) -> Option<&FileIndex> {
        self.state.as_ref().map(PartialFile::index)
    }

    /// Takes bytes of the file from `offset` on. Bytes of the index, and those of each chunk, must come in
    /// order; bytes received before are ignored.
    ///
    /// # Errors
    /// [`FormatError::Gap`] if bytes are missing before `offset`, and the [`FormatError`] of a section that
    /// is damaged or needs more memory than the limits allow.
    pub fn feed(&mut self, offset: u64, bytes: &[u8]) -> Result<(), FormatError> {
        let (mut offset, mut bytes) = (offset, bytes);
        while self.state.is_none() {
            let have = self.gathered.len() as u64;
            if offset > have {
                return Err(FormatError::Gap {
                    got: offset,
                    expected: have,
                });
            }
            let known = usize::try_from(have - offset).unwrap_or(usize::MAX);
            bytes = bytes.get(known..).unwrap_or_default();
            offset = have;
            if bytes.is_empty() {
                return Ok(());
            }
            let target = self.index_bytes().unwrap_or(HEADER_BYTES as u64);
            let target = usize::try_from(target).unwrap_or(usize::MAX);
            let missing = target - self.gathered.len();
            let (now, later) = bytes.split_at(bytes.len().min(missing));
            self.budget.try_extend(&mut self.gathered, now, target)?;
            self.received_index_bytes += now.len() as u64;
            offset += now.len() as u64;
            bytes = later;
            self.advance()?;
        }
        match &mut self.state {
            Some(state) => state.feed(offset, bytes, &self.budget),
            None => Ok(()),
        }
    }

    fn received_bytes(&self) -> u64 {
        let chunks = self.state.as_ref().map_or(0, PartialFile::received_bytes);
        self.received_index_bytes + chunks
    }

    /// Decodes the header and the index when their bytes are complete.
    fn advance(&mut self) -> Result<(), FormatError> {
        let Some(header) = &self.header else {
            header::check_magic(&self.gathered)?;
            let Some(bytes) = self.gathered.first_chunk::<HEADER_BYTES>() else {
                return Ok(());
            };
            let header = Header::decode(bytes)?;
            self.budget
                .check(memory_estimate::index_bytes(&header, self.part))?;
            self.budget
                .reserve(memory_estimate::relight_bytes(&header, self.part))?;
            self.header = Some(header);
            return self.advance();
        };
        if self.gathered.len() as u64 == header.index_bytes() {
            let mut index = FileIndex::decode(header.clone(), &self.gathered, &self.budget)?;
            let limit = self.max_tile_bytes;
            let max_components = limit.and_then(|bytes| index.limit_components(bytes));
            let bytes = memory_estimate::file_bytes(&index, self.part);
            self.budget.check(bytes)?;
            self.header = Some(index.header.clone());
            self.state = Some(PartialFile::new(index, max_components, &self.budget)?);
            self.budget.release_vec(std::mem::take(&mut self.gathered));
        }
        Ok(())
    }

    /// The error of a file that ends after the bytes received.
    pub fn truncated(&self) -> FormatError {
        let need = self.header.as_ref().map(|header| header.file_bytes);
        FormatError::Truncated {
            got: self.received_bytes(),
            need: need.unwrap_or(HEADER_BYTES as u64),
        }
    }

    /// The whole light transport.
    ///
    /// # Errors
    /// [`FormatError::Truncated`] if bytes are missing, [`FormatError::DamagedSection`] if a chunk did not decode,
    /// and the errors of the budget.
    pub fn finish(self) -> Result<(Transport, MetadataText), FormatError> {
        let truncated = self.truncated();
        let Some(state) = self.state else {
            return Err(truncated);
        };
        match state.undecodable() {
            Some(chunk) => Err(damaged("its values are missing").in_chunk(chunk)),
            None if state.is_complete() => state.finish(&self.budget),
            None => Err(truncated),
        }
    }

    /// A coarser transport by the components whose scans are complete for every tile. `None` before the
    /// first scan is complete, after the last one (call [`finish`](Self::finish) then), and if the memory
    /// budget does not cover a preview beside the file.
    ///
    /// # Errors
    /// [`FormatError::Memory`] if the system refuses memory.
    pub fn preview(&self) -> Result<Option<Transport>, FormatError> {
        match &self.state {
            Some(state) => state.preview(&self.budget),
            None => Ok(None),
        }
    }

    /// The light transport of all chunks received so far, once the index is complete.
    ///
    /// # Errors
    /// [`FormatError::Truncated`] before, and the errors of the budget.
    pub fn finish_early(self) -> Result<(Transport, MetadataText), FormatError> {
        match self.state {
            Some(state) => state.finish(&self.budget),
            None => Err(self.truncated()),
        }
    }
}
