//! Light transport functions τ_n as real numbers, from a solver or a simulation.

use super::geometry::{CHANNELS, TileRect};

/// The light transport functions of the pixels of a tile, before quantisation.
#[derive(Clone, Debug)]
pub struct TransportFunctions {
    /// The pixels of the tile.
    pub rect: TileRect,
    /// τ as `[pixel, slot, channel]`, pixels and slots row by row, in units of the measurement for a light element at
    /// full emission.
    pub tau: Vec<[f32; CHANNELS]>,
}

impl TransportFunctions {
    /// Zeros for `rect` and windows of `area` slots.
    pub fn zeros(rect: TileRect, area: usize) -> Self {
        Self {
            rect,
            tau: vec![[0.0; CHANNELS]; rect.extent.area() * area],
        }
    }
}
