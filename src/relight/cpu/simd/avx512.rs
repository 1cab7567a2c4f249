//! AVX-512: vectors of sixteen lanes, two lines; four pixels at once.

use std::arch::x86_64::*;

use super::{LANES, MAX_PIXELS, Simd, SimdKernel};
use crate::transport::{CHANNELS, TEXEL_COMPONENTS, TexelCodes};

/// Proves that the CPU has AVX-512 F, DQ and VL, which include AVX2.
#[derive(Clone, Copy, Debug)]
pub struct Avx512(());

/// Sixteen lanes, one line in each half, made by [`Avx512`] only.
#[derive(Clone, Copy)]
pub struct Avx512Vector(__m512);

impl_operators!(Avx512Vector: Add add _mm512_add_ps, Sub sub _mm512_sub_ps, Mul mul _mm512_mul_ps);

impl Avx512 {
    /// The token, if the CPU has all three parts of AVX-512.
    pub fn detect() -> Option<Self> {
        let is_available = is_x86_feature_detected!("avx512f")
            && is_x86_feature_detected!("avx512dq")
            && is_x86_feature_detected!("avx512vl");
        is_available.then_some(Self(()))
    }

    /// Runs a kernel compiled for AVX-512.
    #[inline(always)]
    pub fn run(self, kernel: impl SimdKernel) {
        #[target_feature(enable = "avx2,avx512f,avx512dq,avx512vl")]
        fn run_enabled(simd: Avx512, kernel: impl SimdKernel) {
            kernel.run(simd);
        }
        // SAFETY: the token proves that the CPU has these features.
        unsafe { run_enabled(self, kernel) }
    }
}

// All intrinsics below need AVX-512 F, DQ and VL at most, which the token in `self` proves.
impl Simd for Avx512 {
    const LINES: usize = 2;
    type SimdVector = Avx512Vector;
    type LaneArray = [f32; 2 * LANES];
    const PIXELS: usize = 4;
    type TexelVector = Avx512Vector;

    #[inline(always)]
    fn splat(self, value: f32) -> Avx512Vector {
        // SAFETY: the token proves AVX-512.
        Avx512Vector(unsafe { _mm512_set1_ps(value) })
    }

    #[inline(always)]
    fn unspill(self, values: &[f32; 2 * LANES]) -> Avx512Vector {
        // SAFETY: the token proves AVX-512, and there are sixteen values.
        Avx512Vector(unsafe { _mm512_loadu_ps(values.as_ptr()) })
    }

    #[inline(always)]
    fn spill(self, vector: Avx512Vector, to: &mut [f32; 2 * LANES]) {
        // SAFETY: the token proves AVX-512, and there is room for sixteen values.
        unsafe { _mm512_storeu_ps(to.as_mut_ptr(), vector.0) }
    }

    #[inline(always)]
    fn splat_lines(self, value: impl Fn(usize) -> f32) -> Avx512Vector {
        // SAFETY: the token proves AVX-512.
        Avx512Vector(unsafe {
            let first = _mm512_set1_ps(value(0));
            _mm512_insertf32x8::<1>(first, _mm256_set1_ps(value(1)))
        })
    }

    #[inline(always)]
    fn load<'a>(self, line: impl Fn(usize) -> &'a [f32; LANES]) -> Avx512Vector {
        // SAFETY: the token proves AVX-512, and there are eight values in each line.
        Avx512Vector(unsafe {
            let first = _mm512_castps256_ps512(_mm256_loadu_ps(line(0).as_ptr()));
            _mm512_insertf32x8::<1>(first, _mm256_loadu_ps(line(1).as_ptr()))
        })
    }

    #[inline(always)]
    fn store(self, vector: Avx512Vector, line: usize, to: &mut [f32; LANES]) {
        // SAFETY: the token proves AVX-512, and there is room for eight values.
        unsafe {
            let half = match line {
                0 => _mm512_castps512_ps256(vector.0),
                _ => _mm512_extractf32x8_ps::<1>(vector.0),
            };
            _mm256_storeu_ps(to.as_mut_ptr(), half);
        }
    }

    #[inline(always)]
    fn zero_texels(self) -> Avx512Vector {
        self.splat(0.0)
    }

    #[inline(always)]
    unsafe fn load_texels(
        self,
        [a, b, c, d]: [*const [f32; TEXEL_COMPONENTS]; MAX_PIXELS],
    ) -> Avx512Vector {
        // SAFETY: the token proves AVX-512; the caller vouches for four pointers.
        Avx512Vector(unsafe {
            let quads = _mm512_castps128_ps512(_mm_loadu_ps(a.cast()));
            let quads = _mm512_insertf32x4::<1>(quads, _mm_loadu_ps(b.cast()));
            let quads = _mm512_insertf32x4::<2>(quads, _mm_loadu_ps(c.cast()));
            _mm512_insertf32x4::<3>(quads, _mm_loadu_ps(d.cast()))
        })
    }

    #[inline(always)]
    unsafe fn load_codes(self, codes: *const TexelCodes) -> Avx512Vector {
        // SAFETY: the token proves AVX-512; the caller vouches for four texels.
        Avx512Vector(unsafe {
            _mm512_cvtepi32_ps(_mm512_cvtepi16_epi32(_mm256_loadu_si256(codes.cast())))
        })
    }

    #[inline(always)]
    unsafe fn store_sums(
        self,
        [red, green, blue]: [Avx512Vector; CHANNELS],
        [r, g, b]: [f32; CHANNELS],
        to: *mut [f32; CHANNELS],
    ) {
        // SAFETY: the token proves AVX-512; the caller vouches for room for twelve values.
        unsafe {
            let sums = sum_lanes!([red, green, blue]: _mm512_add_ps, _mm512_unpacklo_ps, _mm512_unpackhi_ps, _mm512_shuffle_ps);
            let gain = _mm512_broadcast_f32x4(_mm_set_ps(b, b, g, r));
            let pixels = _mm512_mul_ps(sums, gain);
            // Drops every fourth lane.
            let lanes = _mm512_setr_epi32(0, 1, 2, 4, 5, 6, 8, 9, 10, 12, 13, 14, 0, 0, 0, 0);
            let packed = _mm512_permutexvar_ps(lanes, pixels);
            _mm512_mask_storeu_ps(to.cast(), 0x0fff, packed);
        }
    }
}
