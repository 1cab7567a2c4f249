//! Direct tiles: every element of every pixel's window.

use super::{PartError, compress, decompress, zeros};
use crate::format::FormatError;
use crate::transport::{CHANNELS, DirectTile, TexelCode, TileRect};

/// Bytes of a tile's planes before compression.
pub fn plain_bytes(rect: TileRect, area: usize) -> usize {
    rect.extent.area() * area * CHANNELS * 2
}

/// Compresses the codes of a tile that is not all dark.
pub fn encode(tile: &DirectTile, area: usize) -> Result<Vec<u8>, FormatError> {
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
    compress(&planes)
}

/// Decompresses a tile's codes.
pub fn decode(
    bytes: &[u8],
    rect: TileRect,
    area: usize,
    step: [f32; CHANNELS],
) -> Result<DirectTile, PartError> {
    let pixels = rect.extent.area();
    let planes = decompress(bytes, plain_bytes(rect, area))?;
    let mut codes: Vec<TexelCode> = zeros(pixels * area)?;
    let (low, high) = planes.split_at(planes.len() / 2);
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
