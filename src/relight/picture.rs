//! Pictures of the camera grid, before and after the output transform.

use crate::transport::Extent;

/// The picture in linear light, in units of the measurement: R, G, B and an unused fourth value.
#[derive(Clone, Debug, PartialEq)]
pub struct LinearPicture {
    /// Camera grid.
    pub extent: Extent,
    /// Row by row.
    pub pixels: Vec<[f32; 4]>,
}

/// An opaque 8-bit picture, ready for a canvas or a PNG file.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Rgba8Picture {
    /// Camera grid.
    pub extent: Extent,
    /// Row by row.
    pub pixels: Vec<[u8; 4]>,
}

impl LinearPicture {
    /// A black picture.
    pub fn black(extent: Extent) -> Self {
        Self {
            extent,
            pixels: vec![[0.0; 4]; extent.area()],
        }
    }
}

impl Rgba8Picture {
    /// A black picture.
    pub fn black(extent: Extent) -> Self {
        Self {
            extent,
            pixels: vec![[0, 0, 0, 255]; extent.area()],
        }
    }
}
