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
    if tile.is_dark() {
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
    if bytes.is_empty() {
        return Ok(DirectTile {
            step,
            ..DirectTile::dark(rect)
        });
    }
    let pixels = rect.extent.area();
    let need = plane_bytes(rect, area);
    let mut planes = zeros(need)?;
    let length = zstd::bulk::decompress_to_buffer(bytes, &mut planes)
        .map_err(|e| TileError::Damaged(e.to_string()))?;
    if length != need {
        let reason = format!("it has {length} bytes, not {need}");
        return Err(TileError::Damaged(reason));
    }
    let mut codes: Vec<TexelCode> = zeros(pixels * area)?;
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
    Ok(DirectTile { rect, step, codes })
}

/// A vector of `length` zeros. A browser may refuse what the limits allow: that is an error, not
/// the end of the page.
fn zeros<T: bytemuck::Zeroable + Clone>(length: usize) -> Result<Vec<T>, TileError> {
    let mut values = Vec::new();
    values
        .try_reserve_exact(length)
        .map_err(|_| TileError::Memory(length * size_of::<T>()))?;
    values.resize(length, T::zeroed());
    Ok(values)
}
