//! The file index: header, directory, extensions and metadata, which is everything but the values.

use std::ops::Range;

use super::checksum::check_crc;
use super::chunk::{ChunkEntry, ChunkId};
use super::codec::zstd_frame::{compress_large, decompress};
use super::constants::{HEADER_BYTES, MAX_RANK};
use super::directory;
use super::displacement;
use super::error::{FormatError, SectionName};
use super::extension::{self, Extensions, FormatExtension, TABLE_TAG};
use super::header::{Header, SectionEntry};
#[cfg(any(not(target_arch = "wasm32"), feature = "decoder"))]
use super::levels::ShardPlace;
use super::memory_budget::MemoryBudget;
use super::memory_estimate;
use super::metadata::MetadataText;
use super::scan::{ProgressiveScan, ScanCoding, rank_of};
use crate::transport::{Geometry, TEXEL_COMPONENTS};

/// Everything that precedes the first scan.
#[derive(Clone, Debug)]
pub struct FileIndex {
    /// The fixed header.
    pub header: Header,
    /// The scans, in file order.
    pub scans: Vec<ProgressiveScan>,
    /// Extensions that readers may ignore.
    pub extensions: Vec<FormatExtension>,
    /// Origin of the file.
    pub metadata: MetadataText,
    /// `[scan, tile]`.
    entries: Vec<ChunkEntry>,
    /// Where each chunk begins, and where the last ends: of each scan the basis chunk, then a tile chunk for each tile.
    offsets: Vec<u64>,
}

impl FileIndex {
    /// Reads the [`index_bytes`](Header::index_bytes) of a file whose header is `header`.
    pub(super) fn decode(
        mut header: Header,
        bytes: &[u8],
        budget: &MemoryBudget,
    ) -> Result<Self, FormatError> {
        let mut rest = &bytes[HEADER_BYTES..];
        let mut take = |SectionEntry { bytes, crc }, section: SectionName| {
            let (taken, after) = rest.split_at(bytes as usize);
            rest = after;
            check_crc(taken, crc, section).map(|()| taken)
        };
        let frame = take(header.directory, SectionName::Directory)?;
        let extensions = take(header.extensions, SectionName::Extensions)?;
        let metadata = take(header.metadata, SectionName::Metadata)?;
        let Extensions {
            displacement,
            others,
        } = extension::decode(extensions, budget)?;
        #[cfg(any(not(target_arch = "wasm32"), feature = "decoder"))]
        if let Some(place) = ShardPlace::decode(&others, header.geometry.light)
            .map_err(|error| error.in_section(SectionName::Extensions))?
        {
            header.geometry.correspondence.origin = place.origin;
        }
        let Geometry {
            camera,
            correspondence,
            ..
        } = &mut header.geometry;
        if let Some(data) = displacement {
            let covered = |spacing| correspondence.origin.covered(*camera, spacing);
            let grid = displacement::decode(data, covered, budget)
                .map_err(|error| error.in_section(SectionName::Extensions))?;
            correspondence.displacement = Some(grid.into());
        }
        let content_bytes = usize::try_from(directory::content_bytes(&header));
        let records = decompress(frame, content_bytes.unwrap_or(usize::MAX), budget)
            .map_err(|error| error.in_section(SectionName::Directory))?;
        let (scans, entries) = directory::decode(&header, &records, budget)?;
        budget.release_vec(records);
        let file_bytes = header.file_bytes;
        let index = Self {
            offsets: offsets(&header, &scans, &entries, budget)?,
            header,
            scans,
            entries,
            extensions: others,
            metadata: MetadataText::decode(metadata, budget)?,
        };
        let end = index.offsets[index.offsets.len() - 1];
        match end == file_bytes {
            true => Ok(index),
            false => Err(FormatError::LengthMismatch { end, file_bytes }),
        }
    }

    /// Whether the file is the root of one of several levels, which follow it.
    pub fn has_levels(&self) -> bool {
        self.has_extension(TABLE_TAG)
    }

    /// Leaves out the scans after the last that has any of the first components whose coefficients, in fours, take at most
    /// `bytes` in memory; at least four. Returns their number, or `None` if all are read or the file is lossless.
    pub(super) fn limit_components(&mut self, bytes: u64) -> Option<usize> {
        let four = memory_estimate::coefficient_bytes(&self.header, TEXEL_COMPONENTS);
        let fours = usize::try_from(bytes / four.max(1)).unwrap_or(usize::MAX);
        let rank = fours.clamp(1, MAX_RANK.into()) * TEXEL_COMPONENTS;
        let is_lossless = self
            .scans
            .iter()
            .any(|scan| scan.coding == ScanCoding::Halves);
        if is_lossless || rank >= usize::from(self.header.rank) {
            return None;
        }
        let is_needed =
            |scan: &ProgressiveScan| scan.coding.is_direct() || usize::from(scan.first) < rank;
        let scans = self
            .scans
            .iter()
            .rposition(is_needed)
            .map_or(0, |last| last + 1);
        let tiles = self.tiles();
        self.scans.truncate(scans);
        self.entries.truncate(scans * tiles);
        self.offsets.truncate(scans * (tiles + 1) + 1);
        self.header.rank = rank_of(&self.scans) as u16; // not larger than before
        self.header.file_bytes = self.offsets[self.offsets.len() - 1];
        Some(rank)
    }

    pub(super) fn has_extension(&self, tag: [u8; 4]) -> bool {
        self.extensions.iter().any(|extension| extension.tag == tag)
    }

    /// Assembles the index of a file, and its bytes. There is an entry for each scan and tile.
    pub(super) fn encode(
        geometry: Geometry,
        scans: Vec<ProgressiveScan>,
        entries: Vec<ChunkEntry>,
        extensions: Vec<FormatExtension>,
        metadata: MetadataText,
    ) -> Result<(Self, Vec<u8>), FormatError> {
        #[cfg(not(target_arch = "wasm32"))]
        check_tags(&extensions)?;
        let directory = compress_large(&directory::encode(&scans, &entries))?;
        let displacement = geometry.correspondence.displacement.as_ref();
        let displacement = displacement
            .map(|grid| displacement::encode(grid))
            .transpose()?;
        let extension_bytes = extension::encode(displacement.iter().chain(&extensions));
        let json = metadata.text().as_bytes();
        let mut header = Header {
            geometry,
            file_bytes: 0,
            // The check below bounds both.
            rank: u16::try_from(rank_of(&scans)).unwrap_or(u16::MAX),
            scans: scans.len() as u32,
            directory: SectionEntry::new(&directory),
            extensions: SectionEntry::new(&extension_bytes),
            metadata: SectionEntry::new(json),
        };
        let offsets = offsets(&header, &scans, &entries, &MemoryBudget::unlimited())?;
        header.file_bytes = offsets[offsets.len() - 1];
        let fixed = header.encode();
        // Refuses what a reader would refuse.
        Header::decode(&fixed)?;
        let bytes = [&fixed[..], &directory, &extension_bytes, json].concat();
        let index = Self {
            header,
            scans,
            extensions,
            metadata,
            entries,
            offsets,
        };
        Ok((index, bytes))
    }

    /// Number of tiles.
    pub fn tiles(&self) -> usize {
        self.header.geometry.tile_grid().area()
    }

    /// The directory's entry for a tile's chunk of a scan.
    pub fn entry(&self, scan: usize, tile: usize) -> ChunkEntry {
        self.entries[scan * self.tiles() + tile]
    }

    /// Bytes of the file that a chunk takes.
    pub fn range(&self, chunk: ChunkId) -> Range<u64> {
        let at = self.chunk_number(chunk);
        self.offsets[at]..self.offsets[at + 1]
    }

    /// Bytes of the file that a scan takes.
    pub fn scan_range(&self, scan: usize) -> Range<u64> {
        let chunks = self.tiles() + 1;
        self.offsets[scan * chunks]..self.offsets[(scan + 1) * chunks]
    }

    /// All chunks that are not empty, in file order.
    pub fn chunks(&self) -> impl Iterator<Item = ChunkId> + use<'_> {
        let chunks = (0..self.offsets.len() - 1).map(|at| self.chunk_id(at));
        chunks.filter(|&chunk| !self.range(chunk).is_empty())
    }

    /// Whether a tile's chunk of a scan begins with the tile's colour KLT: its first chunk with component 0 does.
    pub(super) fn has_colour_klt(&self, scan: usize, tile: usize) -> bool {
        let has_first = |scan: usize| {
            let ProgressiveScan { coding, first, .. } = self.scans[scan];
            coding == ScanCoding::Transform && first == 0 && self.entry(scan, tile).bytes > 0
        };
        has_first(scan) && !(0..scan).any(has_first)
    }

    pub(super) fn check_crc(&self, chunk: ChunkId, bytes: &[u8]) -> Result<(), FormatError> {
        let crc = match chunk.tile {
            None => self.scans[chunk.scan].basis_crc,
            Some(tile) => self.entry(chunk.scan, tile).crc,
        };
        check_crc(bytes, crc, SectionName::Chunk(chunk))
    }

    /// The basis functions in the basis chunk of a scan.
    pub(super) fn new_basis_functions(&self, scan: usize) -> Range<usize> {
        rank_of(&self.scans[..scan])..rank_of(&self.scans[..=scan])
    }

    /// All basis functions, zero.
    pub(super) fn try_zeroed_basis(
        &self,
        budget: &MemoryBudget,
    ) -> Result<Vec<Vec<f32>>, FormatError> {
        let (rank, area) = (self.header.rank.into(), self.header.geometry.window.area());
        let mut kernels = budget.try_with_capacity(rank)?;
        for _ in 0..rank {
            kernels.push(budget.try_zeroed(area)?);
        }
        Ok(kernels)
    }

    /// The chunk that holds the byte at `offset`.
    pub(super) fn chunk_at(&self, offset: u64) -> ChunkId {
        let at = self.offsets.partition_point(|&start| start <= offset);
        self.chunk_id(at.saturating_sub(1))
    }

    /// The chunk's number in file order, empty chunks counted.
    pub(super) fn chunk_number(&self, chunk: ChunkId) -> usize {
        chunk.number(self.tiles())
    }

    fn chunk_id(&self, number: usize) -> ChunkId {
        ChunkId::of_number(number, self.tiles())
    }
}

/// Checks that no extension has the tag of one that the geometry has. Pages write no extensions.
#[cfg(not(target_arch = "wasm32"))]
fn check_tags(extensions: &[FormatExtension]) -> Result<(), FormatError> {
    let mut tags = extensions.iter().map(|extension| extension.tag);
    match tags.any(|tag| tag == displacement::TAG) {
        true => Err(FormatError::DamagedSection {
            section: SectionName::Extensions,
            reason: "the tag DISP is that of the geometry's displacement".to_owned(),
        }),
        false => Ok(()),
    }
}

/// Chunk offsets, from the end of the index on. There are at most 2^34 chunks of less than 2^25 bytes: no overflow.
fn offsets(
    header: &Header,
    scans: &[ProgressiveScan],
    entries: &[ChunkEntry],
    budget: &MemoryBudget,
) -> Result<Vec<u64>, FormatError> {
    let mut offsets = budget.try_with_capacity(scans.len() + entries.len() + 1)?;
    let mut next = header.index_bytes();
    offsets.push(next);
    let tiles = header.geometry.tile_grid().area();
    for (scan, entries) in scans.iter().zip(entries.chunks_exact(tiles)) {
        let of_tiles = entries.iter().map(|entry| entry.bytes);
        for bytes in std::iter::once(scan.basis_bytes).chain(of_tiles) {
            next += u64::from(bytes);
            offsets.push(next);
        }
    }
    Ok(offsets)
}
