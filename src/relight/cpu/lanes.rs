//! Numbers that are worked on at once: a register of them where there is one, as the compiler does not
//! find it by itself.

use crate::transport::{CHANNELS, QUAD, TexelCode};

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

/// Four numbers for each of some pixels. They are added up alike in all kinds.
pub trait Pixels: Copy {
    /// One or two.
    const COUNT: usize;

    /// Nothing summed up.
    fn zero() -> Self;

    /// What pixels see.
    ///
    /// # Safety
    /// Points at what each of the pixels sees, or where there is one, at that twice.
    unsafe fn load(seen: [*const [f32; QUAD]; 2]) -> Self;

    /// And each pixel's codes times what it sees.
    ///
    /// # Safety
    /// `codes` points at texels of so many pixels.
    unsafe fn plus_products(self, codes: *const TexelCode, seen: Self) -> Self;

    /// Adds up the four of each channel, times that channel's gain.
    ///
    /// # Safety
    /// There is room for so many pixels.
    unsafe fn store_sums(
        channels: [Self; CHANNELS],
        gain: [f32; CHANNELS],
        to: *mut [f32; CHANNELS],
    );
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
    unsafe fn load([seen, _]: [*const [f32; QUAD]; 2]) -> Self {
        // SAFETY: points at what the pixel sees.
        Self(unsafe { *seen })
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
            let [a, b, d, e] = channels[c].0;
            sums[c] = ((a + d) + (b + e)) * gain[c];
        }
        // SAFETY: there is room for a pixel.
        unsafe { *to = sums };
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
        __m256, _mm_castps_pd, _mm_loadu_ps, _mm_loadu_si128, _mm_movehl_ps, _mm_set_ps,
        _mm_store_ss, _mm_storel_pd, _mm_storeu_ps, _mm256_add_ps, _mm256_castps256_ps128,
        _mm256_cvtepi16_epi32, _mm256_cvtepi32_ps, _mm256_extractf128_ps, _mm256_loadu_ps,
        _mm256_mul_ps, _mm256_set_m128, _mm256_set1_ps, _mm256_setzero_ps, _mm256_shuffle_ps,
        _mm256_storeu_ps, _mm256_sub_ps, _mm256_unpackhi_ps, _mm256_unpacklo_ps,
    };

    use super::{LANES, Pixels, Vector};
    use crate::transport::{CHANNELS, QUAD, TexelCode};

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
        unsafe fn load([first, second]: [*const [f32; QUAD]; 2]) -> Self {
            // SAFETY: the machine has AVX; there is what two pixels see.
            Self(unsafe {
                _mm256_set_m128(_mm_loadu_ps(second.cast()), _mm_loadu_ps(first.cast()))
            })
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
                // In each half, of red and green by turns: the first and third, the second and fourth.
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
                let to: *mut f32 = to.cast();
                // The fourth number is written over by the second pixel, which itself is put in two.
                let (first, second) = (
                    _mm256_castps256_ps128(pixels),
                    _mm256_extractf128_ps::<1>(pixels),
                );
                _mm_storeu_ps(to, first);
                _mm_storel_pd(to.add(CHANNELS).cast(), _mm_castps_pd(second));
                _mm_store_ss(to.add(CHANNELS + 2), _mm_movehl_ps(second, second));
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
        f32x4, f32x4_add, f32x4_convert_i32x4, f32x4_mul, f32x4_splat, f32x4_sub,
        i32x4_load_extend_i16x4, i32x4_shuffle, v128, v128_load, v128_store, v128_store32_lane,
        v128_store64_lane,
    };

    use super::{LANES, Pixels, Vector};
    use crate::transport::{CHANNELS, QUAD, TexelCode};

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
        unsafe fn load([seen, _]: [*const [f32; QUAD]; 2]) -> Self {
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
