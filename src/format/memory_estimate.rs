//! How much memory reading a file takes, from its header and from its index.
//!
//! A reader refuses a file before it takes memory for it. The estimate counts what the reader reserves
//! when chunks come in file order; out of order, chunks that wait are reserved in addition.

use super::chunk::{ChunkEntry, ChunkId};
use super::codec::basis_chunk;
use super::directory;
use super::header::Header;
use super::index::FileIndex;
use super::partial_functions;
use super::scan::ProgressiveScan;
use crate::transport::{CHANNELS, TexelCodes, Tile};

/// Bytes that the state of a chunk and of a tile take.
const STATE_BYTES: u64 = 32;
const TILE_STATE_BYTES: u64 = 256;

/// Bytes of a cell of the picture or the light.
pub(super) const RELIT_CELL_BYTES: u64 = size_of::<[f32; 4]>() as u64;
/// Light elements: the most that the border of a light adds to each row or column. Up to `MAX_FREE_SIDE` elements along a side
/// the border takes little memory, however narrow the light plane is.
const MAX_BORDER: u64 = 512;
const MAX_FREE_SIDE: u32 = 1 << 15;

/// How much of a file is read at a time.
#[derive(Clone, Copy, Debug)]
pub(super) enum Part {
    WholeFile,
    /// The index and a tile, which are not relit.
    Tile,
}

/// Bytes that relighting takes: a picture, a light and the previous light, four floats an element.
pub(super) fn relight_bytes(header: &Header, part: Part) -> u64 {
    if let Part::Tile = part {
        return 0;
    }
    let geometry = &header.geometry;
    let elements = geometry.camera.area() as u64 + 2 * geometry.light.area() as u64;
    let longest = geometry.light.width.max(geometry.light.height);
    let border = u64::from(longest.saturating_sub(MAX_FREE_SIDE)) * MAX_BORDER;
    (elements + border) * RELIT_CELL_BYTES
}

/// Bytes that the index takes while it is decoded, with what the reader keeps for it and for relighting.
pub(super) fn index_bytes(header: &Header, part: Part) -> u64 {
    let (tiles, scans) = (
        header.geometry.tile_grid().area() as u64,
        u64::from(header.scans),
    );
    let area = header.geometry.window.area();
    let entry = (size_of::<ChunkEntry>() + size_of::<u64>()) as u64 + STATE_BYTES;
    let basis = 4 * basis_chunk::content_bytes(header.rank.into(), area) as u64;
    let displacement = header.geometry.correspondence.displacement.as_ref();
    let control_points = displacement.map_or(0, |grid| grid.codes().len());
    relight_bytes(header, part)
        + header.index_bytes()
        + (control_points * size_of::<[i16; 2]>()) as u64
        + directory::content_bytes(header)
        + scans * ((tiles + 1) * entry + size_of::<ProgressiveScan>() as u64)
        + tiles * TILE_STATE_BYTES
        + basis
}

/// Bytes that the coefficients of all tiles take, over a basis of `rank` functions.
pub(super) fn coefficient_bytes(header: &Header, rank: usize) -> u64 {
    let tiles = header.geometry.tiles();
    let texels = tiles.map(|rect| Tile::texels(rect, rank) as u64);
    texels.sum::<u64>() * size_of::<TexelCodes>() as u64
}

/// Bytes that reading a file takes.
pub(super) fn file_bytes(index: &FileIndex, part: Part) -> u64 {
    let Header { geometry, rank, .. } = &index.header;
    let value = (CHANNELS * size_of::<f32>()) as u64;
    let rank = usize::from(*rank);
    let is_factored = |tile: usize| {
        let mut scans = index.scans.iter().enumerate();
        scans.any(|(i, scan)| !scan.coding.is_direct() && index.entry(i, tile).bytes > 0)
    };
    // At most 2^36 pixels of 63² elements of 12 bytes: no overflow.
    let (mut kept, mut working) = (0, 0);
    for (i, rect) in geometry.tiles().enumerate() {
        let pixels = rect.extent.area() as u64;
        // A tile is kept as decoded values until it is complete, and then as codes.
        let codes = (Tile::texels(rect, rank) * size_of::<TexelCodes>()) as u64;
        let coefficients = pixels * rank as u64 * value;
        let factored = u64::from(is_factored(i));
        let [partial, functions] = partial_functions::max_bytes(index, i);
        let tile = factored * codes.max(coefficients) + partial.max(functions);
        kept = match part {
            Part::WholeFile => kept + tile,
            Part::Tile => tile.max(kept),
        };
        // Coefficients in red, green and blue with a reflection of each pixel, and codes of both.
        let reflections = pixels * 4 * size_of::<f32>() as u64;
        working = working.max(factored * (coefficients + codes + reflections) + functions);
    }
    let chunk = |id: ChunkId| {
        let content = id
            .tile
            .map_or(0, |tile| index.entry(id.scan, tile).content_bytes);
        let range = index.range(id);
        range.end - range.start + u64::from(content)
    };
    let largest_chunk = index.chunks().map(chunk).max().unwrap_or(0);
    index_bytes(&index.header, part) + kept + working + largest_chunk
}
