//! WebAssembly's vectors of four numbers.

use std::arch::wasm32::{
    f32x4, f32x4_add, f32x4_convert_i32x4, f32x4_mul, f32x4_splat, f32x4_sub,
    i32x4_load_extend_i16x4, i32x4_shuffle, v128, v128_load, v128_store, v128_store32_lane,
    v128_store64_lane,
};

use super::{LANES, MOST_PIXELS, Pixels, Vector};
use crate::transport::{CHANNELS, QUAD, TexelCode};

/// One line.
#[derive(Clone, Copy)]
pub struct Simd128(v128);

/// One pixel.
#[derive(Clone, Copy)]
pub struct One(v128);

impl Vector for Simd128 {
    const LINES: usize = 1;
    type Kept = [f32; LANES];
    type Pixels = One;

    #[inline(always)]
    fn splat(number: f32) -> Self {
        Self(f32x4_splat(number))
    }

    #[inline(always)]
    fn splat_lines(number: impl Fn(usize) -> f32) -> Self {
        Self::splat(number(0))
    }

    #[inline(always)]
    fn load<'a>(line: impl Fn(usize) -> &'a [f32; LANES]) -> Self {
        Self::kept(line(0))
    }

    #[inline(always)]
    fn store(self, _: usize, to: &mut [f32; LANES]) {
        self.keep(to);
    }

    #[inline(always)]
    fn kept(numbers: &Self::Kept) -> Self {
        // SAFETY: there are four numbers, and they need no alignment.
        Self(unsafe { v128_load(numbers.as_ptr().cast()) })
    }

    #[inline(always)]
    fn keep(self, to: &mut Self::Kept) {
        // SAFETY: there is room for four numbers, and they need no alignment.
        unsafe { v128_store(to.as_mut_ptr().cast(), self.0) }
    }

    #[inline(always)]
    fn plus(self, other: Self) -> Self {
        Self(f32x4_add(self.0, other.0))
    }

    #[inline(always)]
    fn minus(self, other: Self) -> Self {
        Self(f32x4_sub(self.0, other.0))
    }

    #[inline(always)]
    fn times(self, other: Self) -> Self {
        Self(f32x4_mul(self.0, other.0))
    }
}

impl Pixels for One {
    const COUNT: usize = 1;

    #[inline(always)]
    fn zero() -> Self {
        Self(f32x4_splat(0.0))
    }

    #[inline(always)]
    unsafe fn load([seen]: [*const [f32; QUAD]; MOST_PIXELS]) -> Self {
        // SAFETY: points at what the pixel sees.
        Self(unsafe { v128_load(seen.cast()) })
    }

    #[inline(always)]
    unsafe fn plus_products(self, codes: *const TexelCode, seen: Self) -> Self {
        // SAFETY: there are a pixel's four codes.
        let codes = unsafe { i32x4_load_extend_i16x4(codes.cast()) };
        Self(f32x4_add(
            self.0,
            f32x4_mul(f32x4_convert_i32x4(codes), seen.0),
        ))
    }

    #[inline(always)]
    unsafe fn store_sums(
        [red, green, blue]: [Self; CHANNELS],
        [r, g, b]: [f32; CHANNELS],
        to: *mut [f32; CHANNELS],
    ) {
        // Of red and green by turns: the first and third, the second and fourth.
        let two = f32x4_add(
            i32x4_shuffle::<0, 4, 1, 5>(red.0, green.0),
            i32x4_shuffle::<2, 6, 3, 7>(red.0, green.0),
        );
        let one = f32x4_add(blue.0, i32x4_shuffle::<2, 3, 2, 3>(blue.0, blue.0));
        let sums = f32x4_add(
            i32x4_shuffle::<0, 1, 4, 4>(two, one),
            i32x4_shuffle::<2, 3, 5, 5>(two, one),
        );
        let pixel = f32x4_mul(sums, f32x4(r, g, b, b));
        // SAFETY: there is room for three numbers.
        unsafe {
            v128_store64_lane::<0>(pixel, to.cast());
            v128_store32_lane::<2>(pixel, to.cast::<u32>().add(2));
        }
    }
}
