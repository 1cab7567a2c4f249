//! Pictures, before and after the display transform.

use super::tone;
use crate::transport::{Extent, TileRect};

/// Linear light at each camera pixel, in units of the measurement: R, G, B and an unused fourth.
#[derive(Clone, Debug, PartialEq)]
pub struct LinearPicture {
    /// Camera grid.
    pub extent: Extent,
    /// Row by row.
    pub pixels: Vec<[f32; 4]>,
}

/// An opaque 8-bit sRGB picture, ready for a canvas or a PNG file.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Rgba8Picture {
    /// Camera grid.
    pub extent: Extent,
    /// Row by row.
    pub pixels: Vec<[u8; 4]>,
}

impl LinearPicture {
    /// An all-dark picture.
    pub fn black(extent: Extent) -> Self {
        Self {
            extent,
            pixels: vec![[0.0; 4]; extent.area()],
        }
    }

    /// Copies one tile's pixels, given row by row, to their place.
    pub fn put(&mut self, rect: TileRect, tile: &[[f32; 4]]) {
        let stride = self.extent.width as usize;
        for (row, pixels) in tile.chunks_exact(rect.extent.width as usize).enumerate() {
            let at = (rect.y as usize + row) * stride + rect.x as usize;
            self.pixels[at..at + pixels.len()].copy_from_slice(pixels);
        }
    }

    /// Scales by `exposure` and encodes as 8-bit sRGB.
    pub fn tone_map(&self, exposure: f32) -> Rgba8Picture {
        let pixels = self.pixels.iter().map(|&[r, g, b, _]| {
            let code = |y: f32| tone::srgb8(f64::from(y) * f64::from(exposure));
            [code(r), code(g), code(b), 255]
        });
        Rgba8Picture {
            extent: self.extent,
            pixels: pixels.collect(),
        }
    }
}
