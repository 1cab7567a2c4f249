//! Direct pixels: `y_n = Σ_s τ_n(s) p(o_n + s)` over the window, in each channel.

use crate::transport::{CHANNELS, TileCodes};

/// The sum for pixel number `p` of a tile. `light` begins with the window's first element; rows are `stride` apart.
#[inline(always)]
pub fn windowed_sum(
    tile: &TileCodes,
    p: usize,
    light: &[[f32; 4]],
    window: usize,
    stride: usize,
) -> [f32; CHANNELS] {
    let codes = &tile.codes[p * window * window..(p + 1) * window * window];
    let mut sum = [0.0f32; 4];
    for (row, codes) in codes.chunks_exact(window).enumerate() {
        let elements = &light[row * stride..row * stride + window];
        for (code, element) in codes.iter().zip(elements) {
            for c in 0..4 {
                sum[c] += f32::from(code[c]) * element[c];
            }
        }
    }
    std::array::from_fn(|c| sum[c] * tile.step[c])
}
