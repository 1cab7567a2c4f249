//! SIMD: one kernel, compiled for each instruction set, with the same bits as result.
//!
//! A [`SimdKernel`] is generic over a *token* ([`Simd`]): a zero-sized value that exists only where the CPU has
//! the instruction set, as `detect` is the only way to make one. Only tokens make vectors, so a vector is the
//! same proof, and no safe code can reach an instruction that the CPU lacks. No operation fuses a
//! multiplication with an addition, which is why all instruction sets agree.

use std::ops::{Add, Mul, Sub};

use bytemuck::Pod;

use crate::transport::{CHANNELS, TEXEL_COMPONENTS, TexelCodes};

/// Lane-wise `+`, `-` and `*` of a vector by intrinsics.
#[cfg(any(
    target_arch = "x86_64",
    all(target_arch = "wasm32", target_feature = "simd128")
))]
macro_rules! impl_operators {
    ($vector:ident: $($operator:ident $method:ident $intrinsic:ident),*) => {$(
        impl std::ops::$operator for $vector {
            type Output = Self;

            #[inline(always)]
            fn $method(self, other: Self) -> Self {
                #[allow(unused_unsafe)] // WebAssembly's intrinsics are safe
                // SAFETY: a vector exists only where the CPU has its instruction set.
                Self(unsafe { $intrinsic(self.0, other.0) })
            }
        }
    )*};
}

/// Per pixel, each channel's four lanes summed as `(0 + 2) + (1 + 3)`: red, green, blue, blue.
#[cfg(target_arch = "x86_64")]
macro_rules! sum_lanes {
    ([$red:ident, $green:ident, $blue:ident]: $add:ident, $low:ident, $high:ident, $shuffle:ident) => {{
        let red_green = $add($low($red.0, $green.0), $high($red.0, $green.0));
        let blue_blue = $add($low($blue.0, $blue.0), $high($blue.0, $blue.0));
        $add(
            $shuffle::<0b0100_0100>(red_green, blue_blue),
            $shuffle::<0b1110_1110>(red_green, blue_blue),
        )
    }};
}

#[cfg(target_arch = "x86_64")]
mod avx2;
#[cfg(target_arch = "x86_64")]
mod avx512;
mod scalar;
#[cfg(all(target_arch = "wasm32", target_feature = "simd128"))]
mod simd128;

#[cfg(target_arch = "x86_64")]
use {avx2::Avx2, avx512::Avx512};

pub use scalar::ScalarFallback;
#[cfg(all(target_arch = "wasm32", target_feature = "simd128"))]
use simd128::Simd128;

/// Lanes in a line, the unit of memory that all instruction sets share.
pub const LANES: usize = if cfg!(target_arch = "wasm32") { 4 } else { 8 };

/// Upper bound of [`Simd::LINES`].
pub const MAX_LINES: usize = if cfg!(target_arch = "x86_64") { 2 } else { 1 };

/// Upper bound of [`Simd::PIXELS`].
pub const MAX_PIXELS: usize = if cfg!(target_arch = "x86_64") { 4 } else { 1 };

/// Lane-wise arithmetic.
pub trait SimdVector: Copy + Add<Output = Self> + Sub<Output = Self> + Mul<Output = Self> {}

impl<V: Copy + Add<Output = V> + Sub<Output = V> + Mul<Output = V>> SimdVector for V {}

/// A token: proves that the CPU has an instruction set, and gives access to its operations.
///
/// The methods for single lines are written once, here; an instruction set with wider vectors overrides them.
pub trait Simd: Copy {
    /// Lines in a vector.
    const LINES: usize;
    /// `LINES` lines.
    type SimdVector: SimdVector;
    /// A vector spilled to memory.
    type LaneArray: Pod;
    /// Pixels that are combined at once, at most [`MAX_PIXELS`].
    const PIXELS: usize;
    /// A vector of `PIXELS` texels, one for each pixel.
    type TexelVector: SimdVector;

    fn splat(self, value: f32) -> Self::SimdVector;

    fn unspill(self, values: &Self::LaneArray) -> Self::SimdVector;

    fn spill(self, vector: Self::SimdVector, to: &mut Self::LaneArray);

    /// One value for each line.
    #[inline(always)]
    fn splat_lines(self, value: impl Fn(usize) -> f32) -> Self::SimdVector {
        const { assert!(Self::LINES == 1) };
        self.splat(value(0))
    }

    /// Reads each line from memory.
    #[inline(always)]
    fn load<'a>(self, line: impl Fn(usize) -> &'a [f32; LANES]) -> Self::SimdVector {
        const { assert!(Self::LINES == 1) };
        self.unspill(bytemuck::cast_ref(line(0)))
    }

    /// Writes line number `line` to memory.
    #[inline(always)]
    fn store(self, vector: Self::SimdVector, _line: usize, to: &mut [f32; LANES]) {
        const { assert!(Self::LINES == 1) };
        self.spill(vector, bytemuck::cast_mut(to));
    }

    fn zero_texels(self) -> Self::TexelVector;

    /// Reads one texel for each pixel.
    ///
    /// # Safety
    /// The first `PIXELS` pointers are valid to read.
    unsafe fn load_texels(
        self,
        from: [*const [f32; TEXEL_COMPONENTS]; MAX_PIXELS],
    ) -> Self::TexelVector;

    /// Reads the codes of each pixel's texel.
    ///
    /// # Safety
    /// `codes` is valid to read for `PIXELS` texels.
    unsafe fn load_codes(self, codes: *const TexelCodes) -> Self::TexelVector;

    /// Writes each pixel's channels: the sum of the channel's four lanes, times its gain.
    ///
    /// # Safety
    /// `to` is valid to write for `PIXELS` pixels.
    unsafe fn store_sums(
        self,
        channels: [Self::TexelVector; CHANNELS],
        gain: [f32; CHANNELS],
        to: *mut [f32; CHANNELS],
    );
}

/// Work for any instruction set.
pub trait SimdKernel {
    /// Does the work. It and everything it calls, closures too, must be `#[inline(always)]`: only then does the
    /// compiler use the instruction set for it.
    fn run<S: Simd>(self, simd: S);
}

/// An instruction set that the CPU has.
#[derive(Clone, Copy, Debug)]
pub enum SimdLevel {
    /// AVX-512 F, DQ and VL: vectors of two lines.
    #[cfg(target_arch = "x86_64")]
    Avx512(Avx512),
    /// AVX2.
    #[cfg(target_arch = "x86_64")]
    Avx2(Avx2),
    /// WebAssembly's 128-bit vectors, if the module was compiled with them.
    #[cfg(all(target_arch = "wasm32", target_feature = "simd128"))]
    Simd128(Simd128),
    /// The target's baseline, as far as the compiler vectorises.
    #[cfg_attr(
        all(target_arch = "wasm32", target_feature = "simd128", not(test)),
        expect(dead_code)
    )]
    ScalarFallback(ScalarFallback),
}

impl SimdLevel {
    /// The widest that the CPU has. Inlined, so that a module with simd128 gets no scalar kernels.
    #[inline(always)]
    pub fn widest() -> Self {
        #[cfg(target_arch = "x86_64")]
        if let Some(simd) = Avx512::detect() {
            return Self::Avx512(simd);
        } else if let Some(simd) = Avx2::detect() {
            return Self::Avx2(simd);
        }
        #[cfg(all(target_arch = "wasm32", target_feature = "simd128"))]
        return Self::Simd128(Simd128::detect());
        #[cfg(not(all(target_arch = "wasm32", target_feature = "simd128")))]
        Self::ScalarFallback(ScalarFallback)
    }

    /// Runs a kernel by this instruction set.
    #[inline(always)]
    pub fn run(self, kernel: impl SimdKernel) {
        match self {
            #[cfg(target_arch = "x86_64")]
            Self::Avx512(simd) => simd.run(kernel),
            #[cfg(target_arch = "x86_64")]
            Self::Avx2(simd) => simd.run(kernel),
            #[cfg(all(target_arch = "wasm32", target_feature = "simd128"))]
            Self::Simd128(simd) => kernel.run(simd),
            Self::ScalarFallback(simd) => kernel.run(simd),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    impl SimdLevel {
        /// All that the CPU has.
        pub fn available() -> impl Iterator<Item = Self> {
            let levels = [
                #[cfg(target_arch = "x86_64")]
                Avx512::detect().map(Self::Avx512),
                #[cfg(target_arch = "x86_64")]
                Avx2::detect().map(Self::Avx2),
                #[cfg(all(target_arch = "wasm32", target_feature = "simd128"))]
                Some(Self::Simd128(Simd128::detect())),
                Some(Self::ScalarFallback(ScalarFallback)),
            ];
            levels.into_iter().flatten()
        }
    }
}
