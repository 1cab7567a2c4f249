//! WebAssembly's simd128: vectors of four lanes, one line; one pixel at once.

use std::arch::wasm32::*;

use super::{LANES, MAX_PIXELS, Simd};
use crate::transport::{CHANNELS, TEXEL_COMPONENTS, TexelCodes};

/// Proves that the module was compiled with simd128: a browser without it does not load the module.
#[derive(Clone, Copy, Debug)]
pub struct Simd128(());

/// Four lanes, made by [`Simd128`] only.
#[derive(Clone, Copy)]
pub struct Simd128Vector(v128);

impl_operators!(Simd128Vector: Add add f32x4_add, Sub sub f32x4_sub, Mul mul f32x4_mul);

impl Simd128 {
    /// The token: this file is compiled with simd128 only.
    pub fn detect() -> Self {
        Self(())
    }
}

impl Simd for Simd128 {
    const LINES: usize = 1;
    type SimdVector = Simd128Vector;
    type LaneArray = [f32; LANES];
    const PIXELS: usize = 1;
    type TexelVector = Simd128Vector;

    #[inline(always)]
    fn splat(self, value: f32) -> Simd128Vector {
        Simd128Vector(f32x4_splat(value))
    }

    #[inline(always)]
    fn unspill(self, values: &[f32; LANES]) -> Simd128Vector {
        // SAFETY: there are four values, and they need no alignment.
        Simd128Vector(unsafe { v128_load(values.as_ptr().cast()) })
    }

    #[inline(always)]
    fn spill(self, vector: Simd128Vector, to: &mut [f32; LANES]) {
        // SAFETY: there is room for four values, and they need no alignment.
        unsafe { v128_store(to.as_mut_ptr().cast(), vector.0) }
    }

    #[inline(always)]
    fn zero_texels(self) -> Simd128Vector {
        self.splat(0.0)
    }

    #[inline(always)]
    unsafe fn load_texels(
        self,
        [from]: [*const [f32; TEXEL_COMPONENTS]; MAX_PIXELS],
    ) -> Simd128Vector {
        // SAFETY: the caller vouches for one pointer.
        Simd128Vector(unsafe { v128_load(from.cast()) })
    }

    #[inline(always)]
    unsafe fn load_codes(self, codes: *const TexelCodes) -> Simd128Vector {
        // SAFETY: the caller vouches for one texel.
        let codes = unsafe { i32x4_load_extend_i16x4(codes.cast()) };
        Simd128Vector(f32x4_convert_i32x4(codes))
    }

    #[inline(always)]
    unsafe fn store_sums(
        self,
        [red, green, blue]: [Simd128Vector; CHANNELS],
        [r, g, b]: [f32; CHANNELS],
        to: *mut [f32; CHANNELS],
    ) {
        // Red and green interleaved: lanes 0 + 2, then 1 + 3.
        let red_green = f32x4_add(
            i32x4_shuffle::<0, 4, 1, 5>(red.0, green.0),
            i32x4_shuffle::<2, 6, 3, 7>(red.0, green.0),
        );
        let blue_blue = f32x4_add(blue.0, i32x4_shuffle::<2, 3, 2, 3>(blue.0, blue.0));
        let sums = f32x4_add(
            i32x4_shuffle::<0, 1, 4, 4>(red_green, blue_blue),
            i32x4_shuffle::<2, 3, 5, 5>(red_green, blue_blue),
        );
        let pixel = f32x4_mul(sums, f32x4(r, g, b, b));
        // SAFETY: the caller vouches for room for three values.
        unsafe {
            v128_store64_lane::<0>(pixel, to.cast());
            v128_store32_lane::<2>(pixel, to.cast::<u32>().add(2));
        }
    }
}
