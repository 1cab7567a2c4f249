//! The kernel in plain Rust.

use crate::transport::TexelCode;

/// Σ over a `side x side` window of `code · light`, per channel; multiply, then add, in row order.
pub fn accumulate(codes: &[TexelCode], seen: &[[f32; 4]], side: usize, stride: usize) -> [f32; 4] {
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
