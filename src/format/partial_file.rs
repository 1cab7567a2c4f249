//! The state of a [`LtmReader`](super::LtmReader) that has the index: which chunks have come, and the tiles so far.
//!
//! Tiles decode their chunks in the order of scans. A chunk that comes early waits for those before it. A chunk
//! that does not decode makes its tile dark, or its basis functions zero, and its scan is never complete.

use std::ops::Range;

use super::chunk::ChunkId;
use super::codec::direct_functions;
use super::error::FormatError;
use super::index::FileIndex;
use super::memory_budget::MemoryBudget;
use super::metadata::MetadataText;
use super::scan::ProgressiveScan;
use super::tile_decoder::{TileDecoder, decode_basis_chunk};
use crate::transport::{Basis, Decibels, FunctionCodes, Tile, Transport};

/// Maximum number of ranges that [`PartialFile::wants`] returns.
const MAX_RANGES: usize = 1024;

/// Which chunks of a file to fetch: all by default.
#[derive(Clone, Debug, Default)]
pub struct ChunkSelection {
    /// Columns and rows of visible camera pixels; all if `None`.
    pub viewport: Option<(Range<u32>, Range<u32>)>,
    /// SNR that is sufficient.
    pub snr: Option<Decibels>,
}

/// The chunks and tiles of a file.
#[derive(Debug)]
pub(super) struct PartialFile {
    index: FileIndex,
    /// Number of components that are read, if not all.
    max_components: Option<usize>,
    /// Functions whose chunk has not come are zero.
    basis: Basis,
    /// The centre-out order of slots.
    order: Vec<u16>,
    tiles: Vec<TileState>,
    /// In file order.
    chunks: Vec<ChunkState>,
    /// `[scan]`: number of chunks that have not come, or did not decode.
    missing: Vec<usize>,
    /// The last chunk that did not decode.
    undecodable: Option<ChunkId>,
    /// Bytes of the chunks that have come, each counted once.
    received_bytes: u64,
}

/// The bytes of a chunk so far.
#[derive(Debug)]
enum ChunkState {
    /// Its first bytes, or none.
    Partial(Vec<u8>),
    /// All bytes, which wait for earlier scans of the tile.
    Waiting(Vec<u8>),
    /// It is decoded, or empty, or does not decode.
    Decoded,
}

/// A tile so far.
#[derive(Debug)]
enum TileState {
    Partial(TileDecoder),
    Complete(Tile),
    /// A chunk did not decode.
    Undecodable,
}

impl PartialFile {
    pub fn new(
        index: FileIndex,
        max_components: Option<usize>,
        budget: &MemoryBudget,
    ) -> Result<Self, FormatError> {
        let (tiles, scans) = (index.tiles(), index.scans.len());
        let mut state = Self {
            basis: Basis {
                kernels: index.try_zeroed_basis(budget)?,
            },
            order: direct_functions::centre_out_order(index.header.geometry.window, budget)?,
            tiles: budget.try_with_capacity(tiles)?,
            chunks: budget.try_with_capacity(scans * (tiles + 1))?,
            missing: budget.try_zeroed(scans)?,
            undecodable: None,
            received_bytes: 0,
            max_components,
            index,
        };
        let partial = |tile| TileState::Partial(TileDecoder::new(tile, max_components));
        state.tiles.extend((0..tiles).map(partial));
        let empty = || ChunkState::Decoded;
        state.chunks.resize_with(scans * (tiles + 1), empty);
        for chunk in state.index.chunks() {
            state.chunks[state.index.chunk_number(chunk)] = ChunkState::Partial(Vec::new());
            state.missing[chunk.scan] += 1;
        }
        // Dark tiles are complete from the beginning.
        for tile in 0..tiles {
            state.advance_tile(tile, budget)?;
        }
        Ok(state)
    }

    /// Number of components of complete tiles.
    fn rank(&self) -> usize {
        let rank = self.basis.rank();
        self.max_components.map_or(rank, |most| most.min(rank))
    }

    pub fn index(&self) -> &FileIndex {
        &self.index
    }

    /// Number of scans that are complete for every tile.
    pub fn complete_scans(&self) -> usize {
        let incomplete = self.missing.iter().position(|missing| *missing > 0);
        incomplete.unwrap_or(self.missing.len())
    }

    pub fn complete_tiles(&self) -> usize {
        let is_complete = |tile: &&TileState| matches!(tile, TileState::Complete(_));
        self.tiles.iter().filter(is_complete).count()
    }

    /// The last chunk that did not decode.
    pub fn undecodable(&self) -> Option<ChunkId> {
        self.undecodable
    }

    /// Bytes of chunks received, each counted once.
    pub fn received_bytes(&self) -> u64 {
        self.received_bytes
    }

    pub fn is_complete(&self) -> bool {
        self.complete_scans() == self.missing.len()
    }

    /// Byte ranges to fetch, in file order: of visible tiles, and of scans up to the first with a sufficient SNR.
    pub fn wants(&self, selection: &ChunkSelection) -> Vec<Range<u64>> {
        let scans = &self.index.scans;
        let is_sufficient =
            |scan: &ProgressiveScan| selection.snr.is_some_and(|snr| scan.snr.0 >= snr.0);
        let scans = scans
            .iter()
            .position(is_sufficient)
            .map_or(scans.len(), |last| last + 1);
        let geometry = &self.index.header.geometry;
        let is_visible = |chunk: &ChunkId| match (&selection.viewport, chunk.tile) {
            (Some((x, y)), Some(tile)) => {
                let (rect, side) = (geometry.tile(tile), geometry.tile_side);
                rect.x < x.end
                    && rect.x + side > x.start
                    && rect.y < y.end
                    && rect.y + side > y.start
            }
            _ => true,
        };
        let mut ranges: Vec<Range<u64>> = Vec::new();
        let chunks = self.index.chunks().take_while(|chunk| chunk.scan < scans);
        for chunk in chunks.filter(is_visible) {
            let ChunkState::Partial(bytes) = &self.chunks[self.index.chunk_number(chunk)] else {
                continue;
            };
            let mut range = self.index.range(chunk);
            range.start += bytes.len() as u64;
            let is_full = ranges.len() == MAX_RANGES;
            match ranges.last_mut() {
                Some(last) if last.end == range.start => last.end = range.end,
                _ if is_full => break,
                _ => ranges.push(range),
            }
        }
        ranges
    }

    /// Takes bytes from `offset` on.
    pub fn feed(
        &mut self,
        mut offset: u64,
        mut bytes: &[u8],
        budget: &MemoryBudget,
    ) -> Result<(), FormatError> {
        let end = self.index.header.file_bytes;
        // A server may send the index again.
        let index_bytes = self.index.header.index_bytes();
        if offset < index_bytes {
            let known = usize::try_from(index_bytes - offset).unwrap_or(usize::MAX);
            bytes = bytes.get(known..).unwrap_or_default();
            offset = index_bytes;
        }
        let last = end.min(offset + bytes.len() as u64);
        if offset < last {
            let scans = [offset, last - 1].map(|at| self.index.chunk_at(at).scan);
            match scans[0] == scans[1] {
                true => self.feed_scan(offset, &bytes[..(last - offset) as usize], budget)?,
                false => self.feed_scans(scans[0]..scans[1] + 1, offset..last, bytes, budget)?,
            }
        }
        // The other levels, or components.
        let may_continue = self.index.has_levels() || self.max_components.is_some();
        match offset + bytes.len() as u64 <= end.max(offset) || may_continue {
            true => Ok(()),
            false => Err(FormatError::TrailingBytes(end)),
        }
    }

    /// Takes bytes of one scan.
    fn feed_scan(
        &mut self,
        mut offset: u64,
        mut bytes: &[u8],
        budget: &MemoryBudget,
    ) -> Result<(), FormatError> {
        while !bytes.is_empty() {
            let chunk = self.index.chunk_at(offset);
            let range = self.index.range(chunk);
            let here = bytes.len().min((range.end - offset) as usize); // a chunk is below 4 GiB
            let (now, later) = bytes.split_at(here);
            self.feed_chunk(chunk, range, offset, now, budget)?;
            offset += here as u64;
            bytes = later;
        }
        Ok(())
    }

    /// Takes bytes of several scans tile by tile, so that only one that becomes complete is in memory as decoded values.
    fn feed_scans(
        &mut self,
        scans: Range<usize>,
        fed: Range<u64>,
        bytes: &[u8],
        budget: &MemoryBudget,
    ) -> Result<(), FormatError> {
        let tiles = (0..self.index.tiles()).map(Some);
        for tile in std::iter::once(None).chain(tiles) {
            for scan in scans.clone() {
                let chunk = ChunkId { scan, tile };
                let range = self.index.range(chunk);
                let (start, end) = (range.start.max(fed.start), range.end.min(fed.end));
                if start < end {
                    let [from, to] = [start, end].map(|at| (at - fed.start) as usize);
                    self.feed_chunk(chunk, range, start, &bytes[from..to], budget)?;
                }
            }
        }
        Ok(())
    }

    /// Takes some bytes of one chunk.
    fn feed_chunk(
        &mut self,
        chunk: ChunkId,
        range: Range<u64>,
        offset: u64,
        bytes: &[u8],
        budget: &MemoryBudget,
    ) -> Result<(), FormatError> {
        let number = self.index.chunk_number(chunk);
        let ChunkState::Partial(partial) = &mut self.chunks[number] else {
            return Ok(());
        };
        let length = (range.end - range.start) as usize;
        if bytes.len() == length {
            let partial = std::mem::take(partial);
            self.received_bytes -= partial.len() as u64;
            budget.release_vec(partial);
            return self.take_chunk(chunk, bytes, budget);
        }
        let at = (offset - range.start) as usize;
        if at > partial.len() {
            return Err(FormatError::Gap {
                got: offset,
                expected: range.start + partial.len() as u64,
            });
        }
        let new = bytes.get(partial.len() - at..).unwrap_or_default();
        budget.try_extend(partial, new, length)?;
        self.received_bytes += new.len() as u64;
        if partial.len() < length {
            return Ok(());
        }
        let complete = std::mem::take(partial);
        self.received_bytes -= length as u64;
        let taken = self.take_chunk(chunk, &complete, budget);
        budget.release_vec(complete);
        taken
    }

    /// Takes all bytes of a chunk. Bytes that do not match their checksum count as not received.
    fn take_chunk(
        &mut self,
        chunk: ChunkId,
        bytes: &[u8],
        budget: &MemoryBudget,
    ) -> Result<(), FormatError> {
        self.index.check_crc(chunk, bytes)?;
        let number = self.index.chunk_number(chunk);
        if let Some(TileState::Partial(decoder)) = chunk.tile.map(|tile| &self.tiles[tile])
            && decoder.scans < chunk.scan
        {
            self.chunks[number] = ChunkState::Waiting(budget.try_copy(bytes)?);
            self.received_bytes += bytes.len() as u64;
            return Ok(());
        }
        self.chunks[number] = ChunkState::Decoded;
        self.received_bytes += bytes.len() as u64;
        self.decode_chunk(chunk, bytes, budget)?;
        match chunk.tile {
            Some(tile) => self.advance_tile(tile, budget),
            None => Ok(()),
        }
    }

    /// Decodes the next chunk of its tile, or a basis chunk.
    fn decode_chunk(
        &mut self,
        chunk: ChunkId,
        bytes: &[u8],
        budget: &MemoryBudget,
    ) -> Result<(), FormatError> {
        let decoded = match chunk.tile.map(|tile| &mut self.tiles[tile]) {
            None => {
                let kernels = &mut self.basis.kernels;
                decode_basis_chunk(&self.index, chunk.scan, bytes, kernels, budget)
            }
            Some(TileState::Partial(decoder)) => {
                decoder.add(&self.index, &self.order, bytes, budget)
            }
            Some(TileState::Complete(_) | TileState::Undecodable) => Ok(()),
        };
        match decoded {
            Ok(()) => self.missing[chunk.scan] -= 1,
            Err(_) => self.drop_values(chunk, budget),
        }
        decoded
    }

    /// Drops the values that depend on a chunk that does not decode.
    fn drop_values(&mut self, chunk: ChunkId, budget: &MemoryBudget) {
        self.undecodable = Some(chunk);
        let Some(tile) = chunk.tile else {
            let functions = self.index.new_basis_functions(chunk.scan);
            for kernel in &mut self.basis.kernels[functions] {
                kernel.fill(0.0);
            }
            return;
        };
        if let TileState::Partial(decoder) = &self.tiles[tile] {
            budget.release(decoder.bytes());
        }
        self.tiles[tile] = TileState::Undecodable;
    }

    /// Skips scans that have no chunk for the tile, decodes chunks that waited, and turns the tile into codes
    /// after its last scan.
    fn advance_tile(&mut self, tile: usize, budget: &MemoryBudget) -> Result<(), FormatError> {
        let rank = self.rank();
        while let TileState::Partial(decoder) = &mut self.tiles[tile] {
            let scan = decoder.scans;
            if scan == self.index.scans.len() {
                let quantised = decoder.quantise(&self.index, rank, budget)?;
                budget.release(decoder.bytes());
                self.tiles[tile] = TileState::Complete(quantised);
                break;
            }
            if self.index.entry(scan, tile).bytes == 0 {
                decoder.scans += 1;
                continue;
            }
            let chunk = ChunkId {
                scan,
                tile: Some(tile),
            };
            let state = &mut self.chunks[self.index.chunk_number(chunk)];
            let ChunkState::Waiting(bytes) = state else {
                break;
            };
            let bytes = std::mem::take(bytes);
            *state = ChunkState::Decoded;
            let decoded = self.decode_chunk(chunk, &bytes, budget);
            budget.release_vec(bytes);
            decoded?;
        }
        Ok(())
    }

    /// The transport by the components of complete scans, as [`LtmReader::preview`](super::LtmReader::preview)
    /// says. Its memory is reserved while it is made, and is the caller's afterwards.
    pub fn preview(&self, budget: &MemoryBudget) -> Result<Option<Transport>, FormatError> {
        let scans = self.complete_scans();
        if scans == 0 || scans == self.missing.len() {
            return Ok(None);
        }
        let _scratch = budget.scratch();
        let rank = self.index.new_basis_functions(scans - 1).end;
        match self.transport(rank.min(self.rank()), budget) {
            Ok(transport) => Ok(Some(transport)),
            Err(FormatError::Limit { .. }) => Ok(None),
            Err(error) => Err(error),
        }
    }

    fn transport(&self, rank: usize, budget: &MemoryBudget) -> Result<Transport, FormatError> {
        let mut kernels = budget.try_with_capacity(rank)?;
        for kernel in &self.basis.kernels[..rank] {
            kernels.push(budget.try_copy(kernel)?);
        }
        let mut tiles = budget.try_with_capacity(self.tiles.len())?;
        for (i, tile) in self.tiles.iter().enumerate() {
            tiles.push(match tile {
                TileState::Partial(decoder) => decoder.quantise(&self.index, rank, budget)?,
                TileState::Complete(tile) => self.copy_components(tile, rank, budget)?,
                TileState::Undecodable => Tile::dark(self.index.header.geometry.tile(i)),
            });
        }
        Ok(Transport {
            geometry: self.index.header.geometry.clone(),
            basis: Basis { kernels },
            tiles,
        })
    }

    /// A copy of a tile by the first `rank` components.
    fn copy_components(
        &self,
        tile: &Tile,
        rank: usize,
        budget: &MemoryBudget,
    ) -> Result<Tile, FormatError> {
        let Tile {
            coefficients,
            functions,
        } = tile;
        let texels = Tile::texels(tile.rect(), rank);
        let codes = budget.try_with_capacity(coefficients.codes.len().min(texels))?;
        Ok(Tile {
            coefficients: coefficients.first_components(self.rank(), rank, codes),
            functions: FunctionCodes {
                entries: budget.try_copy(&functions.entries)?,
                ..*functions
            },
        })
    }

    /// The transport of all chunks so far.
    pub fn finish(self, budget: &MemoryBudget) -> Result<(Transport, MetadataText), FormatError> {
        let rank = self.rank();
        let mut tiles = budget.try_with_capacity(self.tiles.len())?;
        for (i, tile) in self.tiles.into_iter().enumerate() {
            tiles.push(match tile {
                TileState::Complete(tile) => tile,
                TileState::Undecodable => Tile::dark(self.index.header.geometry.tile(i)),
                TileState::Partial(decoder) => {
                    let tile = decoder.quantise(&self.index, rank, budget)?;
                    budget.release(decoder.bytes());
                    tile
                }
            });
        }
        let mut basis = self.basis;
        basis.kernels.truncate(rank);
        let transport = Transport {
            geometry: self.index.header.geometry,
            basis,
            tiles,
        };
        Ok((transport, self.index.metadata))
    }
}
