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

/// Decompresses a tile's codes. The error is zstd's word for what is wrong.
pub(super) fn decode(
    bytes: &[u8],
    rect: TileRect,
    area: usize,
    step: [f32; CHANNELS],
) -> Result<DirectTile, String> {
    let pixels = rect.extent.area();
    let mut codes: Vec<TexelCode> = vec![[0; 4]; pixels * area];
    if !bytes.is_empty() {
        let need = plane_bytes(rect, area);
        let planes = zstd::bulk::decompress(bytes, need).map_err(|e| e.to_string())?;
        if planes.len() != need {
            return Err(format!("it has {} bytes, not {need}", planes.len()));
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
