//! The target's baseline: arrays, which the compiler vectorises as far as it can.

use std::ops::{Add, Mul, Sub};

use super::{LANES, MAX_PIXELS, Simd};
use crate::transport::{CHANNELS, TEXEL_COMPONENTS, TexelCodes};

/// The token of the baseline, which every CPU has.
#[derive(Clone, Copy, Debug)]
pub struct ScalarFallback;

/// A line, or a texel.
#[derive(Clone, Copy, Debug)]
pub struct ScalarVector<const N: usize>([f32; N]);

type ScalarTexel = ScalarVector<TEXEL_COMPONENTS>;

macro_rules! impl_lanewise {
    ($($operator:ident $method:ident $symbol:tt),*) => {$(
        impl<const N: usize> $operator for ScalarVector<N> {
            type Output = Self;

            #[inline(always)]
            fn $method(mut self, other: Self) -> Self {
                for i in 0..N {
                    self.0[i] $symbol other.0[i];
                }
                self
            }
        }
    )*};
}

impl_lanewise!(Add add +=, Sub sub -=, Mul mul *=);

impl Simd for ScalarFallback {
    const LINES: usize = 1;
    type SimdVector = ScalarVector<LANES>;
    type LaneArray = [f32; LANES];
    const PIXELS: usize = 1;
    type TexelVector = ScalarTexel;

    #[inline(always)]
    fn splat(self, value: f32) -> Self::SimdVector {
        ScalarVector([value; LANES])
    }

    #[inline(always)]
    fn unspill(self, values: &[f32; LANES]) -> Self::SimdVector {
        ScalarVector(*values)
    }

    #[inline(always)]
    fn spill(self, vector: Self::SimdVector, to: &mut [f32; LANES]) {
        *to = vector.0;
    }

    #[inline(always)]
    fn zero_texels(self) -> ScalarTexel {
        ScalarVector([0.0; TEXEL_COMPONENTS])
    }

    #[inline(always)]
    unsafe fn load_texels(self, from: [*const [f32; TEXEL_COMPONENTS]; MAX_PIXELS]) -> ScalarTexel {
        // SAFETY: the caller vouches for one pointer.
        ScalarVector(unsafe { *from[0] })
    }

    #[inline(always)]
    unsafe fn load_codes(self, codes: *const TexelCodes) -> ScalarTexel {
        // SAFETY: the caller vouches for one texel.
        let [a, b, c, d] = unsafe { *codes };
        ScalarVector([a.into(), b.into(), c.into(), d.into()])
    }

    #[inline(always)]
    unsafe fn store_sums(
        self,
        channels: [ScalarTexel; CHANNELS],
        gain: [f32; CHANNELS],
        to: *mut [f32; CHANNELS],
    ) {
        let mut sums = [0.0; CHANNELS];
        for c in 0..CHANNELS {
            let [first, second, third, fourth] = channels[c].0;
            sums[c] = ((first + third) + (second + fourth)) * gain[c];
        }
        // SAFETY: the caller vouches for room for one pixel.
        unsafe { *to = sums };
    }
}
