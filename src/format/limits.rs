//! How much memory a file may ask for.

use super::codec::{basis, factored};
use super::{FormatError, Header};
use crate::transport::{CHANNELS, TexelCode};

/// Bounds on what a reader allocates on a file's word.
#[derive(Clone, Copy, Debug)]
pub struct Limits {
    /// Bytes of decoded tiles, were none of them dark, and of what decoding factored ones takes
    /// for a while.
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
    /// Refuses a file whose tiles would decode to more than allowed.
    pub(super) fn check(&self, header: &Header) -> Result<(), FormatError> {
        let geometry = &header.geometry;
        let area = geometry.window.area() as u64;
        // At most 2^15 · 2^15 · 63² · 8 < 2^45: no overflow for a validated geometry.
        let tiles = geometry.camera.area() as u64 * area * size_of::<TexelCode>() as u64;
        let working = match header.rank {
            0 => 0,
            rank => {
                // The first tile is as large as any.
                let (tile, rank) = (geometry.tile(0), u64::from(rank));
                let value = (CHANNELS * size_of::<f32>()) as u64;
                factored::plain_bytes(tile, header.rank) as u64
                    + tile.extent.area() as u64 * (rank + area) * value
                    // Once as kept, once as multiplied out.
                    + 2 * basis::plain_bytes(header.rank, geometry.window.area()) as u64
            }
        };
        let need = tiles + working;
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
