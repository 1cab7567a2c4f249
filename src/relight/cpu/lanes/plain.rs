//! Numbers one by one, or as the compiler has it.

use super::{LANES, MOST_PIXELS, Pixels, Vector};
use crate::transport::{CHANNELS, QUAD, TexelCode};

/// One line.
#[derive(Clone, Copy, Debug)]
pub struct Plain([f32; LANES]);

/// One pixel.
#[derive(Clone, Copy, Debug)]
pub struct Single([f32; QUAD]);

impl Plain {
    #[inline(always)]
    fn zip(self, other: Self, each: impl Fn(f32, f32) -> f32) -> Self {
        let mut out = [0.0; LANES];
        for (i, out) in out.iter_mut().enumerate() {
            *out = each(self.0[i], other.0[i]);
        }
        Self(out)
    }
}

impl Vector for Plain {
    const LINES: usize = 1;
    type Kept = [f32; LANES];
    type Pixels = Single;

    #[inline(always)]
    fn splat(number: f32) -> Self {
        Self([number; LANES])
    }

    #[inline(always)]
    fn splat_lines(number: impl Fn(usize) -> f32) -> Self {
        Self::splat(number(0))
    }

    #[inline(always)]
    fn load<'a>(line: impl Fn(usize) -> &'a [f32; LANES]) -> Self {
        Self(*line(0))
    }

    #[inline(always)]
    fn store(self, _: usize, to: &mut [f32; LANES]) {
        *to = self.0;
    }

    #[inline(always)]
    fn kept(numbers: &Self::Kept) -> Self {
        Self(*numbers)
    }

    #[inline(always)]
    fn keep(self, to: &mut Self::Kept) {
        *to = self.0;
    }

    #[inline(always)]
    fn plus(self, other: Self) -> Self {
        self.zip(other, |a, b| a + b)
    }

    #[inline(always)]
    fn minus(self, other: Self) -> Self {
        self.zip(other, |a, b| a - b)
    }

    #[inline(always)]
    fn times(self, other: Self) -> Self {
        self.zip(other, |a, b| a * b)
    }
}

impl Pixels for Single {
    const COUNT: usize = 1;

    #[inline(always)]
    fn zero() -> Self {
        Self([0.0; QUAD])
    }

    #[inline(always)]
    unsafe fn load(seen: [*const [f32; QUAD]; MOST_PIXELS]) -> Self {
        // SAFETY: points at what the pixel sees.
        Self(unsafe { *seen[0] })
    }

    #[inline(always)]
    unsafe fn plus_products(mut self, codes: *const TexelCode, seen: Self) -> Self {
        // SAFETY: points at a pixel's.
        let codes = unsafe { *codes };
        for lane in 0..QUAD {
            self.0[lane] += f32::from(codes[lane]) * seen.0[lane];
        }
        self
    }

    #[inline(always)]
    unsafe fn store_sums(
        channels: [Self; CHANNELS],
        gain: [f32; CHANNELS],
        to: *mut [f32; CHANNELS],
    ) {
        let mut sums = [0.0; CHANNELS];
        for c in 0..CHANNELS {
            let [first, second, third, fourth] = channels[c].0;
            sums[c] = ((first + third) + (second + fourth)) * gain[c];
        }
        // SAFETY: there is room for a pixel.
        unsafe { *to = sums };
    }
}
