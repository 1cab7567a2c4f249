//! One tile to bytes and back.

use super::FormatError;
use crate::transport::{CHANNELS, DirectTile, TexelCode, TileRect};

/// zstd level for writing. 19 is the highest whose window stays within a tile's own size; decoding
/// speed does not depend on it.
const LEVEL: i32 = 19;

/// Bytes of a tile's planes before compression.
pub(super) fn plane_bytes(rect: TileRect, area: usize) -> usize {
    rect.extent.area() * area * CHANNELS * 2
}

/// Compresses a tile's codes. A tile that is all dark takes no bytes.
pub(super) fn encode(tile: &DirectTile, area: usize) -> Result<Vec<u8>, FormatError> {
    if tile.codes.iter().all(|code| *code == [0; 4]) {
        return Ok(Vec::new());
    }
    let pixels = tile.rect.extent.area();
    let half = pixels * area * CHANNELS;
    let mut planes = vec![0u8; 2 * half];
    let (low, high) = planes.split_at_mut(half);
    for (i, code) in tile.codes.iter().enumerate() {
        let (p, s) = (i / area, i % area);
        for c in 0..CHANNELS {
            let at = (c * area + s) * pixels + p;
            [low[at], high[at]] = code[c].to_le_bytes();
        }
    }
    zstd::bulk::compress(&planes, LEVEL).map_err(FormatError::Compress)
}

/// Why a tile's bytes give no tile.
#[derive(Debug)]
pub(super) enum TileError {
    /// zstd's word for it, or the wrong length.
    Damaged(String),
    /// The system has no memory for this many bytes more.
    Memory(usize),
}

/// Decompresses a tile's codes.
pub(super) fn decode(
    bytes: &[u8],
    rect: TileRect,
    area: usize,
    step: [f32; CHANNELS],
) -> Result<DirectTile, TileError> {
    let pixels = rect.extent.area();
    let mut codes: Vec<TexelCode> = Vec::new();
    // A browser may refuse what the limits allow; that is an error, not the end of the page.
    codes
        .try_reserve_exact(pixels * area)
        .map_err(|_| TileError::Memory(pixels * area * size_of::<TexelCode>()))?;
    codes.resize(pixels * area, [0; 4]);
    if !bytes.is_empty() {
        let need = plane_bytes(rect, area);
        let planes =
            zstd::bulk::decompress(bytes, need).map_err(|e| TileError::Damaged(e.to_string()))?;
        if planes.len() != need {
            let reason = format!("it has {} bytes, not {need}", planes.len());
            return Err(TileError::Damaged(reason));
        }
        let (low, high) = planes.split_at(need / 2);
        for c in 0..CHANNELS {
            for s in 0..area {
                let at = (c * area + s) * pixels;
                let plane = low[at..at + pixels].iter().zip(&high[at..at + pixels]);
                for (p, (&low, &high)) in plane.enumerate() {
                    codes[p * area + s][c] = u16::from_le_bytes([low, high]);
                }
            }
        }
    }
    Ok(DirectTile { rect, step, codes })
}
