//! AVX2: vectors of eight lanes, one line; two pixels at once.

use std::arch::x86_64::*;

use super::{LANES, MAX_PIXELS, Simd, SimdKernel};
use crate::transport::{CHANNELS, TEXEL_COMPONENTS, TexelCodes};

/// Proves that the CPU has AVX2.
#[derive(Clone, Copy, Debug)]
pub struct Avx2(());

/// Eight lanes, made by [`Avx2`] only.
#[derive(Clone, Copy)]
pub struct Avx2Vector(__m256);

impl_operators!(Avx2Vector: Add add _mm256_add_ps, Sub sub _mm256_sub_ps, Mul mul _mm256_mul_ps);

impl Avx2 {
    /// The token, if the CPU has AVX2.
    pub fn detect() -> Option<Self> {
        is_x86_feature_detected!("avx2").then_some(Self(()))
    }

    /// Runs a kernel compiled for AVX2.
    #[inline(always)]
    pub fn run(self, kernel: impl SimdKernel) {
        #[target_feature(enable = "avx2")]
        fn run_enabled(simd: Avx2, kernel: impl SimdKernel) {
            kernel.run(simd);
        }
        // SAFETY: the token proves that the CPU has AVX2.
        unsafe { run_enabled(self, kernel) }
    }
}

// All intrinsics below need AVX2 at most, which the token in `self` proves.
impl Simd for Avx2 {
    const LINES: usize = 1;
    type SimdVector = Avx2Vector;
    type LaneArray = [f32; LANES];
    const PIXELS: usize = 2;
    type TexelVector = Avx2Vector;

    #[inline(always)]
    fn splat(self, value: f32) -> Avx2Vector {
        // SAFETY: the token proves AVX2.
        Avx2Vector(unsafe { _mm256_set1_ps(value) })
    }

    #[inline(always)]
    fn unspill(self, values: &[f32; LANES]) -> Avx2Vector {
        // SAFETY: the token proves AVX2, and there are eight values.
        Avx2Vector(unsafe { _mm256_loadu_ps(values.as_ptr()) })
    }

    #[inline(always)]
    fn spill(self, vector: Avx2Vector, to: &mut [f32; LANES]) {
        // SAFETY: the token proves AVX2, and there is room for eight values.
        unsafe { _mm256_storeu_ps(to.as_mut_ptr(), vector.0) }
    }

    #[inline(always)]
    fn zero_texels(self) -> Avx2Vector {
        self.splat(0.0)
    }

    #[inline(always)]
    unsafe fn load_texels(self, from: [*const [f32; TEXEL_COMPONENTS]; MAX_PIXELS]) -> Avx2Vector {
        // SAFETY: the token proves AVX2; the caller vouches for two pointers.
        Avx2Vector(unsafe {
            _mm256_set_m128(_mm_loadu_ps(from[1].cast()), _mm_loadu_ps(from[0].cast()))
        })
    }

    #[inline(always)]
    unsafe fn load_codes(self, codes: *const TexelCodes) -> Avx2Vector {
        // SAFETY: the token proves AVX2; the caller vouches for two texels.
        Avx2Vector(unsafe {
            _mm256_cvtepi32_ps(_mm256_cvtepi16_epi32(_mm_loadu_si128(codes.cast())))
        })
    }

    #[inline(always)]
    unsafe fn store_sums(
        self,
        [red, green, blue]: [Avx2Vector; CHANNELS],
        [r, g, b]: [f32; CHANNELS],
        to: *mut [f32; CHANNELS],
    ) {
        // SAFETY: the token proves AVX2; the caller vouches for room for six values.
        unsafe {
            let sums = sum_lanes!([red, green, blue]: _mm256_add_ps, _mm256_unpacklo_ps, _mm256_unpackhi_ps, _mm256_shuffle_ps);
            let gain = _mm_set_ps(b, b, g, r);
            let pixels = _mm256_mul_ps(sums, _mm256_set_m128(gain, gain));
            let first = _mm256_castps256_ps128(pixels);
            let second = _mm256_extractf128_ps::<1>(pixels);
            // The second pixel overwrites the first one's fourth lane, and must not write a fourth lane itself.
            let to: *mut f32 = to.cast();
            _mm_storeu_ps(to, first);
            _mm_storel_epi64(to.add(CHANNELS).cast(), _mm_castps_si128(second));
            _mm_store_ss(to.add(CHANNELS + 2), _mm_movehl_ps(second, second));
        }
    }
}
