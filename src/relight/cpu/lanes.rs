//! Numbers that are worked on at once: a register of them where there is one, as the compiler does not
//! find it by itself.

use crate::transport::{QUAD, TexelCode};

/// How many.
pub const LANES: usize = if cfg!(target_arch = "wasm32") { 4 } else { 8 };

/// As many numbers. None of what can be done with them is fused, so that all kinds give the same bits.
pub trait Vector: Copy {
    /// Pixels that are worked on at once.
    type Pixels: Pixels;

    /// The same number in each lane.
    fn splat(number: f32) -> Self;
    /// Numbers from memory.
    fn load(numbers: &[f32; LANES]) -> Self;
    /// Numbers to memory.
    fn store(self, to: &mut [f32; LANES]);
    /// The sum, lane by lane.
    fn plus(self, other: Self) -> Self;
    /// The difference, lane by lane.
    fn minus(self, other: Self) -> Self;
    /// The product, lane by lane.
    fn times(self, other: Self) -> Self;
}

/// Sums of four products for each of some pixels. They are added up alike in all kinds.
pub trait Pixels: Copy {
    /// One or two.
    const COUNT: usize;

    /// Nothing summed up.
    fn zero() -> Self;

    /// And each pixel's codes times what it sees.
    ///
    /// # Safety
    /// `codes` points at texels of so many pixels, `seen` at what each of them sees, or where there is
    /// one, at that twice.
    unsafe fn plus_products(self, codes: *const TexelCode, seen: [*const [f32; QUAD]; 2]) -> Self;

    /// The four of each added up.
    fn sums(self) -> [f32; 2];
}

/// What can be done by any kind of vector.
pub trait Work {
    /// Does it. To be compiled for the vector's registers it must be `#[inline(always)]`, and so must
    /// all that it calls, closures too.
    fn run<V: Vector>(self);
}

/// Does work by the widest vectors that the machine has.
#[inline(always)]
pub fn widest(work: impl Work) {
    #[cfg(target_arch = "x86_64")]
    {
        #[target_feature(enable = "avx2")]
        fn avx2(work: impl Work) {
            work.run::<avx::Avx>();
        }
        if std::arch::is_x86_feature_detected!("avx2") {
            // SAFETY: the machine has AVX2, as was just asked.
            return unsafe { avx2(work) };
        }
    }
    #[cfg(all(target_arch = "wasm32", target_feature = "simd128"))]
    work.run::<simd128::Simd128>();
    #[cfg(not(all(target_arch = "wasm32", target_feature = "simd128")))]
    work.run::<Plain>();
}

/// Numbers one by one, or as the compiler has it.
#[derive(Clone, Copy, Debug)]
pub struct Plain([f32; LANES]);

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

/// One pixel.
#[derive(Clone, Copy, Debug)]
pub struct Single([f32; QUAD]);

impl Pixels for Single {
    const COUNT: usize = 1;

    #[inline(always)]
    fn zero() -> Self {
        Self([0.0; QUAD])
    }

    #[inline(always)]
    unsafe fn plus_products(
        mut self,
        codes: *const TexelCode,
        [seen, _]: [*const [f32; QUAD]; 2],
    ) -> Self {
        // SAFETY: both point at a pixel's.
        let (codes, seen) = unsafe { (*codes, *seen) };
        for lane in 0..QUAD {
            self.0[lane] += f32::from(codes[lane]) * seen[lane];
        }
        self
    }

    #[inline(always)]
    fn sums(self) -> [f32; 2] {
        let [a, b, c, d] = self.0;
        [(a + c) + (b + d); 2]
    }
}

impl Vector for Plain {
    type Pixels = Single;

    #[inline(always)]
    fn splat(number: f32) -> Self {
        Self([number; LANES])
    }

    #[inline(always)]
    fn load(numbers: &[f32; LANES]) -> Self {
        Self(*numbers)
    }

    #[inline(always)]
    fn store(self, to: &mut [f32; LANES]) {
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

#[cfg(target_arch = "x86_64")]
mod avx {
    use std::arch::x86_64::{
        __m256, _mm_add_ps, _mm_add_ss, _mm_cvtss_f32, _mm_loadu_ps, _mm_loadu_si128,
        _mm_movehl_ps, _mm_shuffle_ps, _mm256_add_ps, _mm256_castps256_ps128,
        _mm256_cvtepi16_epi32, _mm256_cvtepi32_ps, _mm256_extractf128_ps, _mm256_loadu_ps,
        _mm256_mul_ps, _mm256_set_m128, _mm256_set1_ps, _mm256_setzero_ps, _mm256_storeu_ps,
        _mm256_sub_ps,
    };

    use super::{LANES, Pixels, Vector};
    use crate::transport::{QUAD, TexelCode};

    /// A register of AVX. Named in [`widest`](super::widest) alone, where the machine is known to
    /// have it.
    #[derive(Clone, Copy)]
    pub struct Avx(__m256);

    /// Two pixels, one in each half.
    #[derive(Clone, Copy)]
    pub struct Pair(__m256);

    impl Pixels for Pair {
        const COUNT: usize = 2;

        #[inline(always)]
        fn zero() -> Self {
            // SAFETY: the machine has AVX.
            Self(unsafe { _mm256_setzero_ps() })
        }

        #[inline(always)]
        unsafe fn plus_products(
            self,
            codes: *const TexelCode,
            [first, second]: [*const [f32; QUAD]; 2],
        ) -> Self {
            // SAFETY: the machine has AVX2; there are codes of two pixels, and what they see.
            Self(unsafe {
                let codes = _mm256_cvtepi16_epi32(_mm_loadu_si128(codes.cast()));
                let seen = _mm256_set_m128(_mm_loadu_ps(second.cast()), _mm_loadu_ps(first.cast()));
                _mm256_add_ps(self.0, _mm256_mul_ps(_mm256_cvtepi32_ps(codes), seen))
            })
        }

        #[inline(always)]
        fn sums(self) -> [f32; 2] {
            // SAFETY: the machine has AVX.
            unsafe {
                let halves = [
                    _mm256_castps256_ps128(self.0),
                    _mm256_extractf128_ps::<1>(self.0),
                ];
                let mut sums = [0.0; 2];
                for (sum, quad) in sums.iter_mut().zip(halves) {
                    let two = _mm_add_ps(quad, _mm_movehl_ps(quad, quad));
                    *sum = _mm_cvtss_f32(_mm_add_ss(two, _mm_shuffle_ps::<1>(two, two)));
                }
                sums
            }
        }
    }

    impl Vector for Avx {
        type Pixels = Pair;

        #[inline(always)]
        fn splat(number: f32) -> Self {
            // SAFETY: the machine has AVX.
            Self(unsafe { _mm256_set1_ps(number) })
        }

        #[inline(always)]
        fn load(numbers: &[f32; LANES]) -> Self {
            // SAFETY: the machine has AVX, and there are eight numbers.
            Self(unsafe { _mm256_loadu_ps(numbers.as_ptr()) })
        }

        #[inline(always)]
        fn store(self, to: &mut [f32; LANES]) {
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
}

#[cfg(all(target_arch = "wasm32", target_feature = "simd128"))]
mod simd128 {
    use std::arch::wasm32::{
        f32x4_add, f32x4_convert_i32x4, f32x4_extract_lane, f32x4_mul, f32x4_splat, f32x4_sub,
        i32x4_load_extend_i16x4, i32x4_shuffle, v128, v128_load, v128_store,
    };

    use super::{LANES, Pixels, Vector};
    use crate::transport::{QUAD, TexelCode};

    /// A vector of WebAssembly's.
    #[derive(Clone, Copy)]
    pub struct Simd128(v128);

    /// One pixel.
    #[derive(Clone, Copy)]
    pub struct One(v128);

    impl Pixels for One {
        const COUNT: usize = 1;

        #[inline(always)]
        fn zero() -> Self {
            Self(f32x4_splat(0.0))
        }

        #[inline(always)]
        unsafe fn plus_products(
            self,
            codes: *const TexelCode,
            [seen, _]: [*const [f32; QUAD]; 2],
        ) -> Self {
            // SAFETY: there are a pixel's four codes, and what it sees.
            let (codes, seen) = unsafe {
                (
                    i32x4_load_extend_i16x4(codes.cast()),
                    v128_load(seen.cast()),
                )
            };
            Self(f32x4_add(
                self.0,
                f32x4_mul(f32x4_convert_i32x4(codes), seen),
            ))
        }

        #[inline(always)]
        fn sums(self) -> [f32; 2] {
            let two = f32x4_add(self.0, i32x4_shuffle::<2, 3, 2, 3>(self.0, self.0));
            let sum = f32x4_extract_lane::<0>(two) + f32x4_extract_lane::<1>(two);
            [sum; 2]
        }
    }

    impl Vector for Simd128 {
        type Pixels = One;

        #[inline(always)]
        fn splat(number: f32) -> Self {
            Self(f32x4_splat(number))
        }

        #[inline(always)]
        fn load(numbers: &[f32; LANES]) -> Self {
            // SAFETY: there are four numbers, and they need no alignment.
            Self(unsafe { v128_load(numbers.as_ptr().cast()) })
        }

        #[inline(always)]
        fn store(self, to: &mut [f32; LANES]) {
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
}
