//! How much memory a file may ask for.

use super::FormatError;
use crate::transport::{Geometry, TexelCode};

/// Bounds on what a reader allocates on a file's word.
#[derive(Clone, Copy, Debug)]
pub struct Limits {
    /// Bytes of decoded tiles, were none of them dark.
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
    /// Refuses a geometry whose tiles would decode to more than allowed.
    pub(super) fn check(&self, geometry: &Geometry) -> Result<(), FormatError> {
        // At most 2^15 · 2^15 · 63² · 8 < 2^45: no overflow for a validated geometry.
        let need = geometry.camera.area() as u64
            * geometry.window.area() as u64
            * size_of::<TexelCode>() as u64;
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
