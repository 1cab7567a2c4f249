//! The directory: a record for each scan and an entry for each tile chunk, and the rules for both.
//!
//! Decompressed it is `scan record [scan]`, then three tables of `u32 [scan, tile]`: bytes, content
//! bytes, checksums. Equal fields stand together, as that compresses better.

use super::chunk::{ChunkEntry, ChunkId};
use super::codec::zstd_frame::compressed_bound;
use super::codec::{basis_chunk, direct_functions, half_float_codec, tokens, transform};
use super::constants::{CHUNK_ENTRY_BYTES, MAX_CONTENT_BYTES, SCAN_RECORD_BYTES};
use super::error::FormatError;
use super::header::Header;
use super::memory_budget::MemoryBudget;
use super::scan::{ProgressiveScan, ScanCoding};
use crate::transport::{CHANNELS, Extent};

/// Bytes of the directory before compression. At most 1024 · (24 + 12 · 2^24): no overflow.
pub(super) fn content_bytes(header: &Header) -> u64 {
    let tiles = header.geometry.tile_grid().area() as u64;
    u64::from(header.scans) * (SCAN_RECORD_BYTES as u64 + CHUNK_ENTRY_BYTES as u64 * tiles)
}

/// The directory before compression; `entries` are `[scan, tile]`.
pub(super) fn encode(scans: &[ProgressiveScan], entries: &[ChunkEntry]) -> Vec<u8> {
    let mut bytes: Vec<u8> = scans.iter().flat_map(ProgressiveScan::encode).collect();
    let fields: [fn(&ChunkEntry) -> u32; 3] = [|e| e.bytes, |e| e.content_bytes, |e| e.crc];
    for field in fields {
        bytes.extend(entries.iter().flat_map(|entry| field(entry).to_le_bytes()));
    }
    bytes
}

/// Reads a decompressed directory of [`content_bytes`].
pub(super) fn decode(
    header: &Header,
    bytes: &[u8],
    budget: &MemoryBudget,
) -> Result<(Vec<ProgressiveScan>, Vec<ChunkEntry>), FormatError> {
    let scans = decode_scans(header, bytes, budget)?;
    let geometry = &header.geometry;
    let tiles = geometry.tile_grid().area();
    let count = scans.len() * tiles;
    let tables = bytes[scans.len() * SCAN_RECORD_BYTES..].as_chunks().0;
    let field = |i: usize| u32::from_le_bytes(tables[i]);
    let mut entries = budget.try_with_capacity(count)?;
    for (scan, record) in scans.iter().enumerate() {
        for tile in 0..tiles {
            let i = scan * tiles + tile;
            let entry = ChunkEntry {
                bytes: field(i),
                content_bytes: field(count + i),
                crc: field(2 * count + i),
            };
            if !is_valid_entry(record, geometry.tile(tile).extent, entry) {
                let tile = Some(tile);
                return Err(FormatError::InvalidChunkEntry(ChunkId { scan, tile }));
            }
            entries.push(entry);
        }
    }
    Ok((scans, entries))
}

fn decode_scans(
    header: &Header,
    bytes: &[u8],
    budget: &MemoryBudget,
) -> Result<Vec<ProgressiveScan>, FormatError> {
    let mut scans = budget.try_with_capacity(header.scans as usize)?;
    let mut known = 0;
    let records = bytes.as_chunks().0.iter().take(header.scans as usize);
    for (scan, record) in records.enumerate() {
        let record =
            ProgressiveScan::decode(record).filter(|record| is_valid_scan(header, record, known));
        let record = record.ok_or(FormatError::InvalidScan(scan))?;
        known += record.new_basis_functions(known);
        scans.push(record);
    }
    let has = |coding| {
        scans
            .iter()
            .any(|scan: &ProgressiveScan| scan.coding == coding)
    };
    let is_mixed = has(ScanCoding::Transform) && has(ScanCoding::Halves)
        || has(ScanCoding::Direct) && has(ScanCoding::DirectHalves);
    match is_mixed || known != usize::from(header.rank) {
        true => Err(FormatError::InconsistentScans(header.rank)),
        false => Ok(scans),
    }
}

/// Whether the file can have the scan, where earlier scans have brought `known` basis functions.
fn is_valid_scan(header: &Header, scan: &ProgressiveScan, known: usize) -> bool {
    let area = header.geometry.window.area();
    let is_in_range = match scan.coding.is_direct() {
        true => scan.end() <= area,
        false => usize::from(scan.first) <= known && scan.end() <= usize::from(header.rank),
    };
    let basis_bytes = u64::from(scan.basis_bytes);
    is_in_range
        && match scan.new_basis_functions(known) {
            0 => basis_bytes == 0,
            functions => {
                let content = basis_chunk::content_bytes(functions, area) as u64;
                (1..=compressed_bound(content)).contains(&basis_bytes)
            }
        }
}

/// Whether a tile of this extent can have the chunk.
fn is_valid_entry(scan: &ProgressiveScan, extent: Extent, entry: ChunkEntry) -> bool {
    let (bytes, content) = (u64::from(entry.bytes), u64::from(entry.content_bytes));
    if bytes == 0 {
        return content == 0;
    }
    let values = extent.area() * CHANNELS * usize::from(scan.count);
    let (min_content, max_content, max_bytes) = match scan.coding {
        ScanCoding::Transform => {
            let max_tokens = transform::max_tokens(extent, scan.count);
            (1, max_tokens, transform::max_bytes(content))
        }
        ScanCoding::Direct => {
            let max_tokens = direct_functions::max_tokens(extent, scan.count);
            (1, max_tokens, tokens::max_bytes(content))
        }
        ScanCoding::Halves | ScanCoding::DirectHalves => {
            let exact = half_float_codec::content_bytes(values) as u64;
            (exact, exact, compressed_bound(content))
        }
    };
    (min_content..=max_content.min(MAX_CONTENT_BYTES)).contains(&content) && bytes <= max_bytes
}
