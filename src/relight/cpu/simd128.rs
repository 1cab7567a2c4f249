//! The kernel on WebAssembly's 128-bit vectors: one texel an instruction.

use std::arch::wasm32::{
    f32x4_add, f32x4_convert_i32x4, f32x4_mul, f32x4_splat, i32x4_load_extend_i16x4, v128,
    v128_load, v128_store,
};

use crate::transport::TexelCode;

/// As [`scalar::accumulate`](super::scalar::accumulate), equal to the bit.
pub fn accumulate(codes: &[TexelCode], seen: &[[f32; 4]], side: usize, stride: usize) -> [f32; 4] {
    let mut sum = f32x4_splat(0.0);
    for (row, codes) in codes.chunks_exact(side).enumerate() {
        let lights = &seen[row * stride..row * stride + side];
        for (code, light) in codes.iter().zip(lights) {
            // SAFETY: `code` is 8 readable bytes and `light` 16; wasm loads need no alignment.
            let (code, light): (v128, v128) = unsafe {
                (
                    i32x4_load_extend_i16x4(code.as_ptr()),
                    v128_load(light.as_ptr().cast()),
                )
            };
            sum = f32x4_add(sum, f32x4_mul(f32x4_convert_i32x4(code), light));
        }
    }
    let mut out = [0.0f32; 4];
    // SAFETY: `out` is 16 writable bytes.
    unsafe { v128_store(out.as_mut_ptr().cast(), sum) };
    out
}
