//! The target's baseline: arrays, which the compiler vectorises as far as it can.

use std::ops::{Add, Mul, Sub};

use super::{LANES, MAX_PIXELS, Simd};
use crate::transport::{CHANNELS, TEXEL_COMPONENTS, TexelCode};

/// The token of the baseline, which every CPU has.
#[derive(Clone, Copy, Debug)]
pub struct Scalar;

/// One line.
#[derive(Clone, Copy, Debug)]
pub struct ScalarVector([f32; LANES]);

macro_rules! impl_lanewise {
    ($($operator:ident $method:ident $symbol:tt),*) => {$(
        impl $operator for ScalarVector {
            type Output = Self;

            #[inline(always)]
            fn $method(mut self, other: Self) -> Self {
                for i in 0..LANES {
                    self.0[i] $symbol other.0[i];
                }
                self
            }
        }
    )*};
}

impl_lanewise!(Add add +=, Sub sub -=, Mul mul *=);

impl Simd for Scalar {
    const LINES: usize = 1;
    type Vector = ScalarVector;
    type Spilled = [f32; LANES];
    const PIXELS: usize = 1;
    type TexelVector = [f32; TEXEL_COMPONENTS];

    #[inline(always)]
    fn splat(self, value: f32) -> ScalarVector {
        ScalarVector([value; LANES])
    }

    #[inline(always)]
    fn unspill(self, values: &[f32; LANES]) -> ScalarVector {
        ScalarVector(*values)
    }

    #[inline(always)]
    fn spill(self, vector: ScalarVector, to: &mut [f32; LANES]) {
        *to = vector.0;
    }

    #[inline(always)]
    fn zero_texels(self) -> [f32; TEXEL_COMPONENTS] {
        [0.0; TEXEL_COMPONENTS]
    }

    #[inline(always)]
    unsafe fn load_texels(
        self,
        from: [*const [f32; TEXEL_COMPONENTS]; MAX_PIXELS],
    ) -> [f32; TEXEL_COMPONENTS] {
        // SAFETY: the caller vouches for one pointer.
        unsafe { *from[0] }
    }

    #[inline(always)]
    unsafe fn add_products(
        self,
        mut sums: [f32; TEXEL_COMPONENTS],
        codes: *const TexelCode,
        factors: [f32; TEXEL_COMPONENTS],
    ) -> [f32; TEXEL_COMPONENTS] {
        // SAFETY: the caller vouches for one texel.
        let codes = unsafe { *codes };
        for lane in 0..TEXEL_COMPONENTS {
            sums[lane] += f32::from(codes[lane]) * factors[lane];
        }
        sums
    }

    #[inline(always)]
    unsafe fn store_sums(
        self,
        channels: [[f32; TEXEL_COMPONENTS]; CHANNELS],
        gain: [f32; CHANNELS],
        to: *mut [f32; CHANNELS],
    ) {
        let mut sums = [0.0; CHANNELS];
        for c in 0..CHANNELS {
            let [first, second, third, fourth] = channels[c];
            sums[c] = ((first + third) + (second + fourth)) * gain[c];
        }
        // SAFETY: the caller vouches for room for one pixel.
        unsafe { *to = sums };
    }
}
