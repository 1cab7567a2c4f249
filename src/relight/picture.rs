//! Pictures of the camera grid, before and after the output transform.

use crate::transport::Extent;

/// A picture of the camera grid.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Picture<P> {
    /// Camera grid.
    pub extent: Extent,
    /// Row by row.
    pub pixels: Vec<P>,
}

/// The picture in linear light, in units of the measurement: R, G, B and an unused fourth value.
pub type LinearPicture = Picture<[f32; 4]>;

/// An opaque 8-bit picture, ready for a canvas or a PNG file.
pub type Rgba8Picture = Picture<[u8; 4]>;

impl<P: Clone> Picture<P> {
    /// A picture of one colour.
    pub fn filled(extent: Extent, pixel: P) -> Self {
        let pixels = vec![pixel; extent.area()];
        Self { extent, pixels }
    }
}
