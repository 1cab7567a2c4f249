//! How much memory a file may ask for.

use super::codec::{MOST_PLAIN, basis};
use super::{ChunkEntry, FormatError, Header};
use crate::transport::{CHANNELS, TexelCode};

/// Bounds on what a reader allocates on a file's word.
#[derive(Clone, Copy, Debug)]
pub struct Limits {
    /// Bytes of the directory, of tiles as they are decoded, were none of them dark, and of what
    /// decoding one takes for a while.
    pub decoded_bytes: u64,
}

impl Default for Limits {
    /// 2 GiB: a 512² picture with a window of 15 decodes to a quarter of it, and it is as much as a
    /// 32-bit browser module can hold.
    fn default() -> Self {
        Self {
            decoded_bytes: 2 << 30,
        }
    }
}

impl Limits {
    /// Refuses a file that would take more than allowed.
    pub(super) fn check(&self, header: &Header) -> Result<(), FormatError> {
        let geometry = &header.geometry;
        let value = (CHANNELS * size_of::<f32>()) as u64;
        let (area, rank) = (geometry.window.area() as u64, u64::from(header.rank));
        // At most 2^15 · 2^15 · 63² · 12 < 2^46: no overflow for a validated geometry.
        let pixels = geometry.camera.area() as u64;
        // A tile is kept as numbers until it is whole, and then as codes. Which of the file's tiles
        // have functions by element the directory will tell; all might.
        let codes = area * size_of::<TexelCode>() as u64;
        let tiles = pixels * codes.max(rank * value);
        // The first tile is as large as any.
        let tile = geometry.tile(0).extent.area() as u64;
        let working = tile * (rank + 2 * area) * value + 2 * MOST_PLAIN;
        let functions = 2 * basis::plain_bytes(header.rank.into(), geometry.window.area()) as u64;
        let entries = u64::from(header.scans) * (geometry.tile_grid().area() as u64 + 1);
        let kept = (size_of::<ChunkEntry>() + size_of::<u64>() + 1) as u64;
        let directory = 2 * header.directory_plain_bytes() + entries * kept;
        // All that comes before the first scan is gathered before it is read.
        let need = tiles + working + functions + directory + header.head_bytes();
        if need <= self.decoded_bytes {
            Ok(())
        } else {
            Err(FormatError::Limit {
                need,
                limit: self.decoded_bytes,
            })
        }
    }
}
