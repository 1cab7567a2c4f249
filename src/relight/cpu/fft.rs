//! Forward discrete Fourier transforms `X(k) = Σ_i x(i) e^{-2πi·ik/n}` of `n` values, one transform in each lane
//! of a vector.
//!
//! Stockham's algorithm: passes of radix four, and a last one of radix two where `n` is not a power of four. It
//! needs no bit reversal, and lanes never mix. The inverse transform is the forward one with real and imaginary
//! parts swapped before and after ([`Complex::swapped`]), times `1/n`.

use std::f64::consts::TAU;
use std::ops::{Add, Mul, Sub};

use super::simd::{LANES, MAX_LINES, Simd, SimdVector};
use crate::relight::platform_math;

/// A line of complex values in memory: one of each of [`LANES`] transforms.
#[derive(Clone, Copy, Debug, Default, PartialEq, bytemuck::Pod, bytemuck::Zeroable)]
#[repr(C)]
#[cfg_attr(not(target_arch = "wasm32"), repr(align(64)))] // its size, and a cache line's
#[cfg_attr(target_arch = "wasm32", repr(align(32)))]
pub struct ComplexLanes {
    pub re: [f32; LANES],
    pub im: [f32; LANES],
}

/// A vector of complex values.
#[derive(Clone, Copy, Debug)]
pub struct Complex<V> {
    pub re: V,
    pub im: V,
}

impl<V: SimdVector> Complex<V> {
    #[inline(always)]
    pub fn load<'a, S: Simd<SimdVector = V>>(
        simd: S,
        line: impl Fn(usize) -> &'a ComplexLanes,
    ) -> Self {
        Self {
            re: simd.load(
                #[inline(always)]
                |i| &line(i).re,
            ),
            im: simd.load(
                #[inline(always)]
                |i| &line(i).im,
            ),
        }
    }

    #[inline(always)]
    pub fn store<S: Simd<SimdVector = V>>(self, simd: S, line: usize, to: &mut ComplexLanes) {
        simd.store(self.re, line, &mut to.re);
        simd.store(self.im, line, &mut to.im);
    }

    #[inline(always)]
    pub fn unspill<S: Simd<SimdVector = V>>(simd: S, [re, im]: &[S::LaneArray; 2]) -> Self {
        Self {
            re: simd.unspill(re),
            im: simd.unspill(im),
        }
    }

    #[inline(always)]
    pub fn spill<S: Simd<SimdVector = V>>(self, simd: S, [re, im]: &mut [S::LaneArray; 2]) {
        simd.spill(self.re, re);
        simd.spill(self.im, im);
    }

    /// The same complex value in each lane.
    #[inline(always)]
    pub fn splat<S: Simd<SimdVector = V>>(simd: S, [re, im]: [f32; 2]) -> Self {
        Self {
            re: simd.splat(re),
            im: simd.splat(im),
        }
    }

    /// Real and imaginary parts swapped.
    #[inline(always)]
    pub fn swapped(self) -> Self {
        Self {
            re: self.im,
            im: self.re,
        }
    }
}

macro_rules! impl_partwise {
    ($($operator:ident $method:ident $symbol:tt),*) => {$(
        impl<V: SimdVector> $operator for Complex<V> {
            type Output = Self;

            #[inline(always)]
            fn $method(self, other: Self) -> Self {
                Self {
                    re: self.re $symbol other.re,
                    im: self.im $symbol other.im,
                }
            }
        }
    )*};
}

impl_partwise!(Add add +, Sub sub -);

impl<V: SimdVector> Mul for Complex<V> {
    type Output = Self;

    #[inline(always)]
    fn mul(self, Self { re, im }: Self) -> Self {
        Self {
            re: self.re * re - self.im * im,
            im: self.re * im + self.im * re,
        }
    }
}

/// Transforms of `side` values, a power of two of at least 16.
#[derive(Clone, Debug)]
pub struct Fft {
    pub side: usize,
    /// Powers 1, 2 and 3 of `e^{-2πip/n}` for each `p` below `n/4`, pass by pass; `n` is the side in the first
    /// pass and a quarter of the last `n` in each further one.
    twiddles: Vec<[[f32; 2]; 3]>,
}

/// Memory for spilled complex vectors of any instruction set.
#[derive(Debug)]
pub struct ComplexBuffer(Vec<ComplexLanes>);

impl ComplexBuffer {
    /// Room for `count` complex vectors.
    pub fn new(count: usize) -> Self {
        Self(vec![ComplexLanes::default(); count * MAX_LINES])
    }

    /// The memory as spilled vectors of one instruction set: at least as many as asked for.
    #[inline(always)]
    pub fn vectors<S: Simd>(&mut self) -> &mut [[S::LaneArray; 2]] {
        const { assert!(S::LINES <= MAX_LINES) };
        bytemuck::cast_slice_mut(&mut self.0)
    }
}

/// Values between two passes.
pub type FftScratch = [ComplexBuffer; 2];

impl Fft {
    /// Plans transforms of `side` values, a power of two of at least 16.
    pub fn new(side: usize) -> Self {
        let mut twiddles = Vec::new();
        let mut n = side;
        while n >= 4 {
            for p in 0..n / 4 {
                let power = |k: usize| {
                    let angle = -TAU * (k * p) as f64 / n as f64;
                    [
                        platform_math::cos(angle) as f32,
                        platform_math::sin(angle) as f32,
                    ]
                };
                twiddles.push([power(1), power(2), power(3)]);
            }
            n /= 4;
        }
        Self { side, twiddles }
    }

    /// Memory for transforms.
    pub fn scratch(&self) -> FftScratch {
        [(); 2].map(|()| ComplexBuffer::new(self.side))
    }

    /// Transforms `load(0)` to `load(side - 1)`. Calls `store` once with each `k` and `X(k)`, in any order.
    #[inline(always)]
    pub fn transform<S: Simd>(
        &self,
        simd: S,
        [current, next]: &mut FftScratch,
        load: impl Fn(usize) -> Complex<S::SimdVector>,
        mut store: impl FnMut(usize, Complex<S::SimdVector>),
    ) {
        let (mut current, mut next) = (current.vectors::<S>(), next.vectors::<S>());
        let quarter = self.side / 4;
        let (first, mut twiddles) = self.twiddles.split_at(quarter);
        let (out, _) = current[..self.side].as_chunks_mut::<4>();
        for (p, (out, twiddles)) in out.iter_mut().zip(first).enumerate() {
            let values = [
                load(p),
                load(p + quarter),
                load(p + 2 * quarter),
                load(p + 3 * quarter),
            ];
            let [w, x, y, z] = out;
            spill_twiddled(simd, butterfly(values), twiddles, [w, x, y, z]);
        }
        let (mut n, mut stride) = (quarter, 4);
        while n > 4 {
            let (pass_twiddles, rest) = twiddles.split_at(n / 4);
            let (from, to) = (&current[..self.side], &mut next[..self.side]);
            radix_four_pass(simd, from, to, pass_twiddles, stride);
            std::mem::swap(&mut current, &mut next);
            twiddles = rest;
            n /= 4;
            stride *= 4;
        }
        // All twiddles of the last pass are 1.
        if n == 4 {
            let [a, b, c, d] = quarters(&current[..self.side]);
            for q in 0..stride {
                let [a, b, c, d] = butterfly(unspill_four(simd, [&a[q], &b[q], &c[q], &d[q]]));
                store(q, a);
                store(q + stride, b);
                store(q + 2 * stride, c);
                store(q + 3 * stride, d);
            }
        } else {
            let (low, high) = current[..self.side].split_at(stride);
            for (q, (low, high)) in low.iter().zip(high).enumerate() {
                let (low, high) = (Complex::unspill(simd, low), Complex::unspill(simd, high));
                store(q, low + high);
                store(q + stride, low - high);
            }
        }
    }
}

/// The transform of four values.
#[inline(always)]
fn butterfly<V: SimdVector>([a, b, c, d]: [Complex<V>; 4]) -> [Complex<V>; 4] {
    let (even_sum, even_difference) = (a + c, a - c);
    let (odd_sum, odd_difference) = (b + d, b - d);
    [
        even_sum + odd_sum,
        // even_difference - i · odd_difference
        Complex {
            re: even_difference.re + odd_difference.im,
            im: even_difference.im - odd_difference.re,
        },
        even_sum - odd_sum,
        // even_difference + i · odd_difference
        Complex {
            re: even_difference.re - odd_difference.im,
            im: even_difference.im + odd_difference.re,
        },
    ]
}

#[inline(always)]
fn unspill_four<S: Simd>(
    simd: S,
    [a, b, c, d]: [&[S::LaneArray; 2]; 4],
) -> [Complex<S::SimdVector>; 4] {
    [
        Complex::unspill(simd, a),
        Complex::unspill(simd, b),
        Complex::unspill(simd, c),
        Complex::unspill(simd, d),
    ]
}

/// Spills four values, times 1 and the three twiddles.
#[inline(always)]
fn spill_twiddled<S: Simd>(
    simd: S,
    [a, b, c, d]: [Complex<S::SimdVector>; 4],
    [one, two, three]: &[[f32; 2]; 3],
    [w, x, y, z]: [&mut [S::LaneArray; 2]; 4],
) {
    a.spill(simd, w);
    (b * Complex::splat(simd, *one)).spill(simd, x);
    (c * Complex::splat(simd, *two)).spill(simd, y);
    (d * Complex::splat(simd, *three)).spill(simd, z);
}

#[inline(always)]
fn quarters<T>(values: &[T]) -> [&[T]; 4] {
    let (low, high) = values.split_at(values.len() / 2);
    let ((a, b), (c, d)) = (low.split_at(low.len() / 2), high.split_at(high.len() / 2));
    [a, b, c, d]
}

/// A pass between the first and the last, of `stride` interleaved transforms.
#[inline(always)]
fn radix_four_pass<S: Simd>(
    simd: S,
    from: &[[S::LaneArray; 2]],
    to: &mut [[S::LaneArray; 2]],
    twiddles: &[[[f32; 2]; 3]],
    stride: usize,
) {
    let [a, b, c, d] = quarters(from).map(|part| part.chunks_exact(stride));
    let groups = a.zip(b).zip(c.zip(d)).zip(to.chunks_exact_mut(4 * stride));
    for ((((a, b), (c, d)), to), twiddles) in groups.zip(twiddles) {
        let (low, high) = to.split_at_mut(2 * stride);
        let ((w, x), (y, z)) = (low.split_at_mut(stride), high.split_at_mut(stride));
        let (b, c, d) = (&b[..a.len()], &c[..a.len()], &d[..a.len()]);
        let (w, x) = (&mut w[..a.len()], &mut x[..a.len()]);
        let (y, z) = (&mut y[..a.len()], &mut z[..a.len()]);
        for q in 0..a.len() {
            let out = butterfly(unspill_four(simd, [&a[q], &b[q], &c[q], &d[q]]));
            let to = [&mut w[q], &mut x[q], &mut y[q], &mut z[q]];
            spill_twiddled(simd, out, twiddles, to);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::relight::cpu::simd::{ScalarFallback, SimdKernel, SimdLevel};

    /// Transforms two lines.
    struct FftKernel<'a> {
        fft: &'a Fft,
        values: &'a [[ComplexLanes; 2]],
        spectrum: &'a mut [[Option<ComplexLanes>; 2]],
    }

    impl SimdKernel for FftKernel<'_> {
        #[inline(always)]
        fn run<S: Simd>(self, simd: S) {
            let scratch = &mut self.fft.scratch();
            for first in (0..2).step_by(S::LINES) {
                let store = |k: usize, value: Complex<S::SimdVector>| {
                    for line in 0..S::LINES {
                        let mut stored = ComplexLanes::default();
                        value.store(simd, line, &mut stored);
                        assert!(self.spectrum[k][first + line].replace(stored).is_none());
                    }
                };
                let load = |i: usize| Complex::load(simd, |line| &self.values[i][first + line]);
                self.fft.transform(simd, scratch, load, store);
            }
        }
    }

    fn test_value(i: usize, lane: usize) -> f32 {
        ((i * 7919 + lane * 104_729) % 1009) as f32 / 504.0 - 1.0
    }

    #[test]
    fn transforms_match_the_definition() {
        for side in [16, 32, 64, 128, 256] {
            let fft = Fft::new(side);
            let values: Vec<[ComplexLanes; 2]> = (0..side)
                .map(|i| {
                    [0, 1].map(|line| ComplexLanes {
                        re: std::array::from_fn(|lane| test_value(i + 77 * line, lane)),
                        im: std::array::from_fn(|lane| test_value(i + 500 + 77 * line, lane)),
                    })
                })
                .collect();
            let transform = |level: SimdLevel| {
                let mut spectrum = vec![[None; 2]; side];
                level.run(FftKernel {
                    fft: &fft,
                    values: &values,
                    spectrum: &mut spectrum,
                });
                spectrum
            };
            let spectrum = transform(SimdLevel::ScalarFallback(ScalarFallback));
            for level in SimdLevel::available() {
                assert_eq!(transform(level), spectrum, "{level:?}");
            }
            for line in 0..2 {
                for k in 0..side {
                    for lane in 0..LANES {
                        let (mut re, mut im) = (0.0f64, 0.0);
                        for (i, value) in values.iter().enumerate() {
                            let angle = -TAU * (i * k % side) as f64 / side as f64;
                            let value = [value[line].re[lane], value[line].im[lane]].map(f64::from);
                            re += value[0] * angle.cos() - value[1] * angle.sin();
                            im += value[0] * angle.sin() + value[1] * angle.cos();
                        }
                        let got = spectrum[k][line].unwrap();
                        let error =
                            (f64::from(got.re[lane]) - re).hypot(f64::from(got.im[lane]) - im);
                        assert!(
                            error < 1e-5 * (side as f64).sqrt(),
                            "{side}, {k}, {lane}: {error}"
                        );
                    }
                }
            }
        }
    }
}
