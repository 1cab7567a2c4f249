//! Registers of sixteen numbers: two lines.
//!
//! Named where the machine is known to have AVX-512 (its F, DQ and VL) alone, which is what makes all
//! here sound.

use std::arch::x86_64::{
    __m512, _mm_loadu_ps, _mm_set_ps, _mm256_loadu_ps, _mm256_loadu_si256, _mm256_set1_ps,
    _mm256_storeu_ps, _mm512_add_ps, _mm512_broadcast_f32x4, _mm512_castps128_ps512,
    _mm512_castps256_ps512, _mm512_castps512_ps256, _mm512_cvtepi16_epi32, _mm512_cvtepi32_ps,
    _mm512_extractf32x8_ps, _mm512_insertf32x4, _mm512_insertf32x8, _mm512_loadu_ps,
    _mm512_mask_storeu_ps, _mm512_mul_ps, _mm512_permutexvar_ps, _mm512_set1_ps, _mm512_setr_epi32,
    _mm512_setzero_ps, _mm512_shuffle_ps, _mm512_storeu_ps, _mm512_sub_ps, _mm512_unpackhi_ps,
    _mm512_unpacklo_ps,
};

use super::{LANES, MOST_PIXELS, Pixels, Vector};
use crate::transport::{CHANNELS, QUAD, TexelCode};

/// Two lines, one in each half.
#[derive(Clone, Copy)]
pub struct Avx512(__m512);

/// Four pixels, one in each quarter.
#[derive(Clone, Copy)]
pub struct Four(__m512);

impl Vector for Avx512 {
    const LINES: usize = 2;
    type Kept = [f32; 2 * LANES];
    type Pixels = Four;

    #[inline(always)]
    fn splat(number: f32) -> Self {
        // SAFETY: the machine has AVX-512.
        Self(unsafe { _mm512_set1_ps(number) })
    }

    #[inline(always)]
    fn splat_lines(number: impl Fn(usize) -> f32) -> Self {
        // SAFETY: the machine has AVX-512.
        Self(unsafe {
            let first = _mm512_set1_ps(number(0));
            _mm512_insertf32x8::<1>(first, _mm256_set1_ps(number(1)))
        })
    }

    #[inline(always)]
    fn load<'a>(line: impl Fn(usize) -> &'a [f32; LANES]) -> Self {
        // SAFETY: the machine has AVX-512, and there are eight numbers in each line.
        Self(unsafe {
            let first = _mm512_castps256_ps512(_mm256_loadu_ps(line(0).as_ptr()));
            _mm512_insertf32x8::<1>(first, _mm256_loadu_ps(line(1).as_ptr()))
        })
    }

    #[inline(always)]
    fn store(self, line: usize, to: &mut [f32; LANES]) {
        // SAFETY: the machine has AVX-512, and there is room for eight numbers.
        unsafe {
            let half = match line {
                0 => _mm512_castps512_ps256(self.0),
                _ => _mm512_extractf32x8_ps::<1>(self.0),
            };
            _mm256_storeu_ps(to.as_mut_ptr(), half);
        }
    }

    #[inline(always)]
    fn kept(numbers: &Self::Kept) -> Self {
        // SAFETY: the machine has AVX-512, and there are sixteen numbers.
        Self(unsafe { _mm512_loadu_ps(numbers.as_ptr()) })
    }

    #[inline(always)]
    fn keep(self, to: &mut Self::Kept) {
        // SAFETY: the machine has AVX-512, and there is room for sixteen numbers.
        unsafe { _mm512_storeu_ps(to.as_mut_ptr(), self.0) }
    }

    #[inline(always)]
    fn plus(self, other: Self) -> Self {
        // SAFETY: the machine has AVX-512.
        Self(unsafe { _mm512_add_ps(self.0, other.0) })
    }

    #[inline(always)]
    fn minus(self, other: Self) -> Self {
        // SAFETY: the machine has AVX-512.
        Self(unsafe { _mm512_sub_ps(self.0, other.0) })
    }

    #[inline(always)]
    fn times(self, other: Self) -> Self {
        // SAFETY: the machine has AVX-512.
        Self(unsafe { _mm512_mul_ps(self.0, other.0) })
    }
}

impl Pixels for Four {
    const COUNT: usize = 4;

    #[inline(always)]
    fn zero() -> Self {
        // SAFETY: the machine has AVX-512.
        Self(unsafe { _mm512_setzero_ps() })
    }

    #[inline(always)]
    unsafe fn load([first, second, third, fourth]: [*const [f32; QUAD]; MOST_PIXELS]) -> Self {
        // SAFETY: the machine has AVX-512; there is what four pixels see.
        Self(unsafe {
            let seen = _mm512_castps128_ps512(_mm_loadu_ps(first.cast()));
            let seen = _mm512_insertf32x4::<1>(seen, _mm_loadu_ps(second.cast()));
            let seen = _mm512_insertf32x4::<2>(seen, _mm_loadu_ps(third.cast()));
            _mm512_insertf32x4::<3>(seen, _mm_loadu_ps(fourth.cast()))
        })
    }

    #[inline(always)]
    unsafe fn plus_products(self, codes: *const TexelCode, seen: Self) -> Self {
        // SAFETY: the machine has AVX-512; there are codes of four pixels.
        Self(unsafe {
            let codes = _mm512_cvtepi16_epi32(_mm256_loadu_si256(codes.cast()));
            _mm512_add_ps(self.0, _mm512_mul_ps(_mm512_cvtepi32_ps(codes), seen.0))
        })
    }

    #[inline(always)]
    unsafe fn store_sums(
        [red, green, blue]: [Self; CHANNELS],
        [r, g, b]: [f32; CHANNELS],
        to: *mut [f32; CHANNELS],
    ) {
        // SAFETY: the machine has AVX-512, and there is room for twelve numbers.
        unsafe {
            // Of each pixel, of red and green by turns: the first and third, the second and fourth.
            let two = _mm512_add_ps(
                _mm512_unpacklo_ps(red.0, green.0),
                _mm512_unpackhi_ps(red.0, green.0),
            );
            let one = _mm512_add_ps(
                _mm512_unpacklo_ps(blue.0, blue.0),
                _mm512_unpackhi_ps(blue.0, blue.0),
            );
            let sums = _mm512_add_ps(
                _mm512_shuffle_ps::<0b0100_0100>(two, one),
                _mm512_shuffle_ps::<0b1110_1110>(two, one),
            );
            let gain = _mm512_broadcast_f32x4(_mm_set_ps(b, b, g, r));
            let pixels = _mm512_mul_ps(sums, gain);
            // Three of each four numbers, side by side.
            let threes = _mm512_setr_epi32(0, 1, 2, 4, 5, 6, 8, 9, 10, 12, 13, 14, 0, 0, 0, 0);
            let close = _mm512_permutexvar_ps(threes, pixels);
            _mm512_mask_storeu_ps(to.cast(), 0x0fff, close);
        }
    }
}
