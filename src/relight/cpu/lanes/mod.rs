//! Numbers that are worked on at once: a register of them where there is one, as the compiler does not
//! find it by itself.

#[cfg(target_arch = "x86_64")]
mod avx2;
#[cfg(target_arch = "x86_64")]
mod avx512;
mod plain;
#[cfg(all(target_arch = "wasm32", target_feature = "simd128"))]
mod simd128;

use bytemuck::Pod;

use crate::transport::{CHANNELS, QUAD, TexelCode};
pub use plain::{Plain, Single};

/// Numbers in a line.
pub const LANES: usize = if cfg!(target_arch = "wasm32") { 4 } else { 8 };

/// The most lines that any vector has.
pub const MOST_LINES: usize = if cfg!(target_arch = "x86_64") { 2 } else { 1 };

/// The most pixels that are worked on at once.
pub const MOST_PIXELS: usize = if cfg!(target_arch = "x86_64") { 4 } else { 1 };

/// One or two lines of numbers. None of what can be done with them is fused, so that all kinds give the
/// same bits.
pub trait Vector: Copy {
    /// How many lines.
    const LINES: usize;

    /// As the numbers are kept for a while.
    type Kept: Pod;

    /// Pixels that are worked on at once.
    type Pixels: Pixels;

    /// The same number in each lane.
    fn splat(number: f32) -> Self;
    /// In each line a number of its own.
    fn splat_lines(number: impl Fn(usize) -> f32) -> Self;
    /// Lines from memory.
    fn load<'a>(line: impl Fn(usize) -> &'a [f32; LANES]) -> Self;
    /// A line to memory.
    fn store(self, line: usize, to: &mut [f32; LANES]);
    /// What was kept.
    fn kept(numbers: &Self::Kept) -> Self;
    /// To be kept.
    fn keep(self, to: &mut Self::Kept);
    /// The sum, lane by lane.
    fn plus(self, other: Self) -> Self;
    /// The difference, lane by lane.
    fn minus(self, other: Self) -> Self;
    /// The product, lane by lane.
    fn times(self, other: Self) -> Self;
}

/// Four numbers for each of some pixels. They are added up alike in all kinds.
pub trait Pixels: Copy {
    /// At most [`MOST_PIXELS`].
    const COUNT: usize;

    /// Nothing summed up.
    fn zero() -> Self;

    /// What pixels see.
    ///
    /// # Safety
    /// The first so many point at what a pixel sees each.
    unsafe fn load(seen: [*const [f32; QUAD]; MOST_PIXELS]) -> Self;

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

/// Kinds of vectors.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Kind {
    /// Two lines.
    #[cfg(target_arch = "x86_64")]
    Avx512,
    #[cfg(target_arch = "x86_64")]
    Avx2,
    /// WebAssembly's.
    #[cfg(all(target_arch = "wasm32", target_feature = "simd128"))]
    Simd128,
    /// Numbers one by one.
    Plain,
}

impl Kind {
    /// From the widest on.
    const ALL: &[Self] = &[
        #[cfg(target_arch = "x86_64")]
        Self::Avx512,
        #[cfg(target_arch = "x86_64")]
        Self::Avx2,
        #[cfg(all(target_arch = "wasm32", target_feature = "simd128"))]
        Self::Simd128,
        Self::Plain,
    ];

    /// Those that the machine has, from the widest on.
    pub fn all() -> impl Iterator<Item = Self> {
        Self::ALL.iter().copied().filter(|kind| kind.is_there())
    }

    #[inline(always)]
    fn is_there(self) -> bool {
        match self {
            #[cfg(target_arch = "x86_64")]
            Self::Avx512 => {
                std::arch::is_x86_feature_detected!("avx512f")
                    && std::arch::is_x86_feature_detected!("avx512dq")
                    && std::arch::is_x86_feature_detected!("avx512vl")
            }
            #[cfg(target_arch = "x86_64")]
            Self::Avx2 => std::arch::is_x86_feature_detected!("avx2"),
            #[cfg(all(target_arch = "wasm32", target_feature = "simd128"))]
            Self::Simd128 => true,
            Self::Plain => true,
        }
    }

    /// Does work by vectors of this kind, or one by one where the machine does not have them.
    #[inline(always)]
    pub fn run(self, work: impl Work) {
        match self {
            #[cfg(target_arch = "x86_64")]
            Self::Avx512 if self.is_there() => {
                #[target_feature(enable = "avx2,avx512f,avx512dq,avx512vl")]
                fn avx512(work: impl Work) {
                    work.run::<avx512::Avx512>();
                }
                // SAFETY: the machine has what was just asked for, and what is in all that have that.
                unsafe { avx512(work) }
            }
            #[cfg(target_arch = "x86_64")]
            Self::Avx2 if self.is_there() => {
                #[target_feature(enable = "avx2")]
                fn avx2(work: impl Work) {
                    work.run::<avx2::Avx2>();
                }
                // SAFETY: the machine has AVX2, as was just asked.
                unsafe { avx2(work) }
            }
            #[cfg(all(target_arch = "wasm32", target_feature = "simd128"))]
            Self::Simd128 => work.run::<simd128::Simd128>(),
            _ => work.run::<Plain>(),
        }
    }
}

/// Does work by the widest vectors that the machine has.
#[inline(always)]
pub fn widest(work: impl Work) {
    if let Some(kind) = Kind::all().next() {
        kind.run(work);
    }
}
