//! Light transport functions as a solver or a simulation yields them: real numbers, pixel by pixel.

use super::{CHANNELS, TileRect};

/// The light transport functions of one tile's pixels, before any quantisation.
#[derive(Clone, Debug)]
pub struct TransportFunctions {
    /// The pixels covered.
    pub rect: TileRect,
    /// τ as `[pixel, element, channel]`: pixels row by row, window rows (v) then columns (u), RGB;
    /// in units of the measurement for an element at full brightness.
    pub tau: Vec<[f32; CHANNELS]>,
}

impl TransportFunctions {
    /// All-dark functions for `rect` and a window of `area` elements.
    pub fn zeros(rect: TileRect, area: usize) -> Self {
        Self {
            rect,
            tau: vec![[0.0; CHANNELS]; rect.extent.area() * area],
        }
    }
}
