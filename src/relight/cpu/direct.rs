//! Elements that a tile has besides its coefficients, or in their place.

use crate::transport::{CHANNELS, DirectTile, TexelCode};

/// Σ over its window of `τ · light` of pixel `p` of a tile; `seen` is the light from the window's
/// first element on, `stride` elements from row to row.
#[inline(always)]
pub fn sum(
    tile: &DirectTile,
    p: usize,
    seen: &[[f32; 4]],
    side: usize,
    stride: usize,
) -> [f32; CHANNELS] {
    let codes = &tile.codes[p * side * side..(p + 1) * side * side];
    let sum = accumulate(codes, seen, side, stride);
    std::array::from_fn(|c| sum[c] * tile.step[c])
}

/// Σ of `code · light`, per channel, in row order.
#[inline(always)]
fn accumulate(codes: &[TexelCode], seen: &[[f32; 4]], side: usize, stride: usize) -> [f32; 4] {
    let mut sum = [0.0f32; 4];
    for (row, codes) in codes.chunks_exact(side).enumerate() {
        let lights = &seen[row * stride..row * stride + side];
        for (code, light) in codes.iter().zip(lights) {
            for c in 0..4 {
                sum[c] += f32::from(code[c]) * light[c];
            }
        }
    }
    sum
}
