//! Registers of eight numbers.
//!
//! Named where the machine is known to have AVX2 alone, which is what makes all here sound.

use std::arch::x86_64::{
    __m256, _mm_castps_si128, _mm_loadu_ps, _mm_loadu_si128, _mm_movehl_ps, _mm_set_ps,
    _mm_store_ss, _mm_storel_epi64, _mm_storeu_ps, _mm256_add_ps, _mm256_castps256_ps128,
    _mm256_cvtepi16_epi32, _mm256_cvtepi32_ps, _mm256_extractf128_ps, _mm256_loadu_ps,
    _mm256_mul_ps, _mm256_set_m128, _mm256_set1_ps, _mm256_setzero_ps, _mm256_shuffle_ps,
    _mm256_storeu_ps, _mm256_sub_ps, _mm256_unpackhi_ps, _mm256_unpacklo_ps,
};

use super::{LANES, MOST_PIXELS, Pixels, Vector};
use crate::transport::{CHANNELS, QUAD, TexelCode};

/// One line.
#[derive(Clone, Copy)]
pub struct Avx2(__m256);

/// Two pixels, one in each half.
#[derive(Clone, Copy)]
pub struct Two(__m256);

impl Vector for Avx2 {
    const LINES: usize = 1;
    type Kept = [f32; LANES];
    type Pixels = Two;

    #[inline(always)]
    fn splat(number: f32) -> Self {
        // SAFETY: the machine has AVX.
        Self(unsafe { _mm256_set1_ps(number) })
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
        // SAFETY: the machine has AVX, and there are eight numbers.
        Self(unsafe { _mm256_loadu_ps(numbers.as_ptr()) })
    }

    #[inline(always)]
    fn keep(self, to: &mut Self::Kept) {
        // SAFETY: the machine has AVX, and there is room for eight numbers.
        unsafe { _mm256_storeu_ps(to.as_mut_ptr(), self.0) }
    }

    #[inline(always)]
    fn plus(self, other: Self) -> Self {
        // SAFETY: the machine has AVX.
        Self(unsafe { _mm256_add_ps(self.0, other.0) })
    }

    #[inline(always)]
    fn minus(self, other: Self) -> Self {
        // SAFETY: the machine has AVX.
        Self(unsafe { _mm256_sub_ps(self.0, other.0) })
    }

    #[inline(always)]
    fn times(self, other: Self) -> Self {
        // SAFETY: the machine has AVX.
        Self(unsafe { _mm256_mul_ps(self.0, other.0) })
    }
}

impl Pixels for Two {
    const COUNT: usize = 2;

    #[inline(always)]
    fn zero() -> Self {
        // SAFETY: the machine has AVX.
        Self(unsafe { _mm256_setzero_ps() })
    }

    #[inline(always)]
    unsafe fn load(seen: [*const [f32; QUAD]; MOST_PIXELS]) -> Self {
        // SAFETY: the machine has AVX; there is what two pixels see.
        Self(unsafe { _mm256_set_m128(_mm_loadu_ps(seen[1].cast()), _mm_loadu_ps(seen[0].cast())) })
    }

    #[inline(always)]
    unsafe fn plus_products(self, codes: *const TexelCode, seen: Self) -> Self {
        // SAFETY: the machine has AVX2; there are codes of two pixels.
        Self(unsafe {
            let codes = _mm256_cvtepi16_epi32(_mm_loadu_si128(codes.cast()));
            _mm256_add_ps(self.0, _mm256_mul_ps(_mm256_cvtepi32_ps(codes), seen.0))
        })
    }

    #[inline(always)]
    unsafe fn store_sums(
        [red, green, blue]: [Self; CHANNELS],
        [r, g, b]: [f32; CHANNELS],
        to: *mut [f32; CHANNELS],
    ) {
        // SAFETY: the machine has AVX, and there is room for six numbers.
        unsafe {
            // Of each pixel, of red and green by turns: the first and third, the second and fourth.
            let two = _mm256_add_ps(
                _mm256_unpacklo_ps(red.0, green.0),
                _mm256_unpackhi_ps(red.0, green.0),
            );
            let one = _mm256_add_ps(
                _mm256_unpacklo_ps(blue.0, blue.0),
                _mm256_unpackhi_ps(blue.0, blue.0),
            );
            let sums = _mm256_add_ps(
                _mm256_shuffle_ps::<0b0100_0100>(two, one),
                _mm256_shuffle_ps::<0b1110_1110>(two, one),
            );
            let gain = _mm_set_ps(b, b, g, r);
            let pixels = _mm256_mul_ps(sums, _mm256_set_m128(gain, gain));
            let (first, second) = (
                _mm256_castps256_ps128(pixels),
                _mm256_extractf128_ps::<1>(pixels),
            );
            // The fourth number is written over by the second pixel, which itself is put in two.
            let to: *mut f32 = to.cast();
            _mm_storeu_ps(to, first);
            _mm_storel_epi64(to.add(CHANNELS).cast(), _mm_castps_si128(second));
            _mm_store_ss(to.add(CHANNELS + 2), _mm_movehl_ps(second, second));
        }
    }
}
