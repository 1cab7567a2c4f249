//! Tiles as they are kept in memory, on disk and on the GPU: quantised light transport functions.

use super::{Geometry, TileRect, TransportFunctions};

/// Camera channels: red, green, blue.
pub const CHANNELS: usize = 3;

/// Quantised τ of one pixel and element: R, G, B and an unused fourth code, so that a tile is a
/// ready `rgba16sint` texture and one SIMD load. Signed: light transport has no negative elements,
/// but a truncated sum of basis functions has, and to clip them would brighten the picture.
pub type TexelCode = [i16; 4];

/// Largest code written. 12 bits put the quantisation noise of an unsparse pixel (S = 225, all
/// elements off by step/√12) some 60 dB below it, under what any photograph can tell; 16 would
/// store noise.
const TOP_CODE: f32 = 4095.0;

/// A tile that keeps every element of every pixel's window: `τ = code · step`.
#[derive(Clone, Debug, PartialEq)]
pub struct DirectTile {
    /// The pixels covered.
    pub rect: TileRect,
    /// Value of one code, per channel.
    pub step: [f32; CHANNELS],
    /// `[pixel, element]`, pixels row by row, window rows (v) then columns (u); empty for a tile
    /// that is all dark.
    pub codes: Vec<TexelCode>,
}

impl DirectTile {
    /// Rounds functions to codes, with a step per channel set by the tile's largest element.
    /// Non-finite values, which no light transport function has, become zero.
    pub fn quantise(functions: &TransportFunctions) -> Self {
        Self::quantise_into(functions, Vec::new())
    }

    /// [`quantise`](Self::quantise) into memory the caller has: a vector that is empty.
    pub(crate) fn quantise_into(functions: &TransportFunctions, mut codes: Vec<TexelCode>) -> Self {
        let mut peak = [0.0f32; CHANNELS];
        for t in &functions.tau {
            for c in 0..CHANNELS {
                if t[c].is_finite() {
                    peak[c] = peak[c].max(t[c].abs());
                }
            }
        }
        // A step below this would not be a normal number; so dim a channel is dark.
        let step = peak.map(|p| p / TOP_CODE);
        if step.iter().all(|s| *s < f32::MIN_POSITIVE) {
            return Self::dark(functions.rect);
        }
        let step = step.map(|s| if s < f32::MIN_POSITIVE { 1.0 } else { s });
        let code = |t: f32, step: f32| match t.is_finite() {
            true => (t / step + 0.5f32.copysign(t)) as i16, // rounds; `as` saturates
            false => 0,
        };
        let codes_of = |t: &[f32; CHANNELS]| {
            [
                code(t[0], step[0]),
                code(t[1], step[1]),
                code(t[2], step[2]),
                0,
            ]
        };
        codes.extend(functions.tau.iter().map(codes_of));
        Self {
            rect: functions.rect,
            step,
            codes,
        }
    }

    /// A tile from which no light comes, whatever the light.
    pub fn dark(rect: TileRect) -> Self {
        Self {
            rect,
            step: [1.0; CHANNELS],
            codes: Vec::new(),
        }
    }

    /// Whether the tile is all dark and so holds no codes.
    pub fn is_dark(&self) -> bool {
        self.codes.is_empty()
    }

    /// τ of element `s` of pixel `p` (both in tile order), given the window's area.
    pub fn tau(&self, area: usize, p: usize, s: usize) -> [f32; CHANNELS] {
        let code = self.codes.get(p * area + s).unwrap_or(&[0; 4]);
        std::array::from_fn(|c| f32::from(code[c]) * self.step[c])
    }
}

/// A whole transport in memory: its geometry and every tile, in row-major order.
#[derive(Clone, Debug, PartialEq)]
pub struct Transport {
    /// Grids, band and tiling.
    pub geometry: Geometry,
    /// One tile for each of [`Geometry::tiles`].
    pub tiles: Vec<DirectTile>,
}
