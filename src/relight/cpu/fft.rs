//! Discrete Fourier transforms of squares, several at once: one in each lane of a vector's lines.
//!
//! Stockham's algorithm in passes of radix four, and one of radix two where the side asks for it.
//! Only the forward transform is there: the inverse is the same with real and imaginary parts
//! exchanged, before and after.

use std::f64::consts::TAU;

use super::lanes::{LANES, MOST_LINES, Vector};
use crate::relight::math;

/// One complex number of each transform of a line, as it lies in memory.
#[derive(Clone, Copy, Debug, Default, PartialEq, bytemuck::Pod, bytemuck::Zeroable)]
#[repr(C)]
#[cfg_attr(not(target_arch = "wasm32"), repr(align(64)))] // a cache's line, which is as many
#[cfg_attr(target_arch = "wasm32", repr(align(32)))]
pub struct Packed {
    /// Real parts.
    pub re: [f32; LANES],
    /// Imaginary parts.
    pub im: [f32; LANES],
}

/// One complex number of each transform, as it is worked on.
#[derive(Clone, Copy, Debug)]
pub struct Complex<V> {
    /// Real parts.
    pub re: V,
    /// Imaginary parts.
    pub im: V,
}

impl<V: Vector> Complex<V> {
    /// Loads lines.
    #[inline(always)]
    pub fn load<'a>(line: impl Fn(usize) -> &'a Packed) -> Self {
        Self {
            re: V::load(
                #[inline(always)]
                |i| &line(i).re,
            ),
            im: V::load(
                #[inline(always)]
                |i| &line(i).im,
            ),
        }
    }

    /// Stores a line.
    #[inline(always)]
    pub fn store(self, line: usize, to: &mut Packed) {
        self.re.store(line, &mut to.re);
        self.im.store(line, &mut to.im);
    }

    /// What was kept.
    #[inline(always)]
    pub fn kept([re, im]: &[V::Kept; 2]) -> Self {
        Self {
            re: V::kept(re),
            im: V::kept(im),
        }
    }

    /// To be kept.
    #[inline(always)]
    pub fn keep(self, [re, im]: &mut [V::Kept; 2]) {
        self.re.keep(re);
        self.im.keep(im);
    }

    /// The sum.
    #[inline(always)]
    pub fn plus(self, other: Self) -> Self {
        Self {
            re: self.re.plus(other.re),
            im: self.im.plus(other.im),
        }
    }

    /// The difference.
    #[inline(always)]
    pub fn minus(self, other: Self) -> Self {
        Self {
            re: self.re.minus(other.re),
            im: self.im.minus(other.im),
        }
    }

    /// The product.
    #[inline(always)]
    pub fn times(self, Self { re, im }: Self) -> Self {
        Self {
            re: self.re.times(re).minus(self.im.times(im)),
            im: self.re.times(im).plus(self.im.times(re)),
        }
    }

    /// The same complex number in each lane.
    #[inline(always)]
    pub fn splat([re, im]: [f32; 2]) -> Self {
        Self {
            re: V::splat(re),
            im: V::splat(im),
        }
    }

    /// Real and imaginary parts exchanged.
    #[inline(always)]
    pub fn exchanged(self) -> Self {
        Self {
            re: self.im,
            im: self.re,
        }
    }
}

/// Transforms of `side` numbers, a power of two of at least 16.
#[derive(Clone, Debug)]
pub struct Fft {
    side: usize,
    /// `e^{-2πip/n}`, its square and cube, for each `p` below `n/4` of each pass of radix four; `n`
    /// is the side, then a quarter of it, and so on.
    twiddles: Vec<[[f32; 2]; 3]>,
}

/// Numbers that are kept, of vectors of any kind.
#[derive(Debug)]
pub struct Kept(Vec<Packed>);

impl Kept {
    /// For so many complex numbers.
    pub fn new(count: usize) -> Self {
        Self(vec![Packed::default(); count * MOST_LINES])
    }

    /// As vectors of one kind have them; not fewer than were asked for.
    #[inline(always)]
    pub fn of<V: Vector>(&mut self) -> &mut [[V::Kept; 2]] {
        const { assert!(V::LINES <= MOST_LINES) };
        bytemuck::cast_slice_mut(&mut self.0)
    }
}

/// Numbers between the passes.
#[derive(Debug)]
pub struct Between {
    now: Kept,
    next: Kept,
}

impl Between {
    /// For transforms of `side` numbers.
    pub fn new(side: usize) -> Self {
        Self {
            now: Kept::new(side),
            next: Kept::new(side),
        }
    }
}

impl Fft {
    /// Prepares transforms of `side` numbers, which is to be a power of two of at least 16.
    pub fn new(side: usize) -> Self {
        let mut twiddles = Vec::new();
        let mut n = side;
        while n >= 4 {
            for p in 0..n / 4 {
                let power = |k: usize| {
                    let angle = -TAU * (k * p) as f64 / n as f64;
                    [math::cos(angle) as f32, math::sin(angle) as f32]
                };
                twiddles.push([power(1), power(2), power(3)]);
            }
            n /= 4;
        }
        Self { side, twiddles }
    }

    /// Numbers that one transform takes.
    pub fn side(&self) -> usize {
        self.side
    }

    /// Transforms the numbers that `take` has, and `put`s what becomes of them, each once, in any order.
    #[inline(always)]
    pub fn transform<V: Vector>(
        &self,
        between: &mut Between,
        take: impl Fn(usize) -> Complex<V>,
        mut put: impl FnMut(usize, Complex<V>),
    ) {
        let (mut now, mut next) = (between.now.of::<V>(), between.next.of::<V>());
        let quarter = self.side / 4;
        let (first, mut twiddles) = self.twiddles.split_at(quarter);
        let (out, _) = now[..self.side].as_chunks_mut::<4>();
        for (p, (out, twiddles)) in out.iter_mut().zip(first).enumerate() {
            let from = [
                take(p),
                take(p + quarter),
                take(p + 2 * quarter),
                take(p + 3 * quarter),
            ];
            let [w, x, y, z] = out;
            turned(butterfly(from), twiddles, [w, x, y, z]);
        }
        let (mut n, mut stride) = (quarter, 4);
        while n > 4 {
            let (here, later) = twiddles.split_at(n / 4);
            pass::<V>(&now[..self.side], &mut next[..self.side], here, stride);
            std::mem::swap(&mut now, &mut next);
            twiddles = later;
            n /= 4;
            stride *= 4;
        }
        // The last takes no turns.
        if n == 4 {
            let [a, b, c, d] = parts(&now[..self.side]);
            for q in 0..stride {
                let [a, b, c, d] = butterfly(four::<V>([&a[q], &b[q], &c[q], &d[q]]));
                put(q, a);
                put(q + stride, b);
                put(q + 2 * stride, c);
                put(q + 3 * stride, d);
            }
        } else {
            let (low, high) = now[..self.side].split_at(stride);
            for (q, (low, high)) in low.iter().zip(high).enumerate() {
                let (low, high) = (Complex::<V>::kept(low), Complex::kept(high));
                put(q, low.plus(high));
                put(q + stride, low.minus(high));
            }
        }
    }
}

/// Four numbers transformed.
#[inline(always)]
fn butterfly<V: Vector>([a, b, c, d]: [Complex<V>; 4]) -> [Complex<V>; 4] {
    let (sum, difference) = (a.plus(c), a.minus(c));
    let (other, apart) = (b.plus(d), b.minus(d));
    [
        sum.plus(other),
        // Less, and more, the imaginary unit times what is apart.
        Complex {
            re: difference.re.plus(apart.im),
            im: difference.im.minus(apart.re),
        },
        sum.minus(other),
        Complex {
            re: difference.re.minus(apart.im),
            im: difference.im.plus(apart.re),
        },
    ]
}

/// Four numbers that were kept.
#[inline(always)]
fn four<V: Vector>([a, b, c, d]: [&[V::Kept; 2]; 4]) -> [Complex<V>; 4] {
    [
        Complex::kept(a),
        Complex::kept(b),
        Complex::kept(c),
        Complex::kept(d),
    ]
}

/// Keeps four numbers, turned.
#[inline(always)]
fn turned<V: Vector>(
    [a, b, c, d]: [Complex<V>; 4],
    [one, two, three]: &[[f32; 2]; 3],
    [w, x, y, z]: [&mut [V::Kept; 2]; 4],
) {
    a.keep(w);
    b.times(Complex::splat(*one)).keep(x);
    c.times(Complex::splat(*two)).keep(y);
    d.times(Complex::splat(*three)).keep(z);
}

/// Four equal parts.
#[inline(always)]
fn parts<T>(values: &[T]) -> [&[T]; 4] {
    let (low, high) = values.split_at(values.len() / 2);
    let ((a, b), (c, d)) = (low.split_at(low.len() / 2), high.split_at(high.len() / 2));
    [a, b, c, d]
}

/// A pass between the first and the last, `stride` transforms interleaved.
#[inline(always)]
fn pass<V: Vector>(
    from: &[[V::Kept; 2]],
    to: &mut [[V::Kept; 2]],
    twiddles: &[[[f32; 2]; 3]],
    stride: usize,
) {
    let [a, b, c, d] = parts(from).map(|part| part.chunks_exact(stride));
    let each = a.zip(b).zip(c.zip(d)).zip(to.chunks_exact_mut(4 * stride));
    for ((((a, b), (c, d)), to), twiddles) in each.zip(twiddles) {
        let (low, high) = to.split_at_mut(2 * stride);
        let ((w, x), (y, z)) = (low.split_at_mut(stride), high.split_at_mut(stride));
        let (b, c, d) = (&b[..a.len()], &c[..a.len()], &d[..a.len()]);
        let (w, x) = (&mut w[..a.len()], &mut x[..a.len()]);
        let (y, z) = (&mut y[..a.len()], &mut z[..a.len()]);
        for q in 0..a.len() {
            let out = butterfly(four::<V>([&a[q], &b[q], &c[q], &d[q]]));
            turned(out, twiddles, [&mut w[q], &mut x[q], &mut y[q], &mut z[q]]);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::relight::cpu::lanes::{Kind, Work};

    /// Transforms two lines, by whatever vectors there are.
    struct Transform<'a> {
        fft: &'a Fft,
        given: &'a [[Packed; 2]],
        spectrum: &'a mut [[Option<Packed>; 2]],
    }

    impl Work for Transform<'_> {
        #[inline(always)]
        fn run<V: Vector>(self) {
            let between = &mut Between::new(self.given.len());
            for first in (0..2).step_by(V::LINES) {
                let put = |k: usize, value: Complex<V>| {
                    for line in 0..V::LINES {
                        let mut packed = Packed::default();
                        value.store(line, &mut packed);
                        assert!(self.spectrum[k][first + line].replace(packed).is_none());
                    }
                };
                let take = |i: usize| Complex::load(|line| &self.given[i][first + line]);
                self.fft.transform(between, take, put);
            }
        }
    }

    fn number(i: usize, lane: usize) -> f32 {
        ((i * 7919 + lane * 104_729) % 1009) as f32 / 504.0 - 1.0
    }

    #[test]
    fn transforms_are_what_they_are_defined_to_be() {
        for side in [16, 32, 64, 128, 256] {
            let fft = Fft::new(side);
            let given: Vec<[Packed; 2]> = (0..side)
                .map(|i| {
                    [0, 1].map(|line| Packed {
                        re: std::array::from_fn(|lane| number(i + 77 * line, lane)),
                        im: std::array::from_fn(|lane| number(i + 500 + 77 * line, lane)),
                    })
                })
                .collect();
            let transformed = |kind: Kind| {
                let mut spectrum = vec![[None; 2]; side];
                kind.run(Transform {
                    fft: &fft,
                    given: &given,
                    spectrum: &mut spectrum,
                });
                spectrum
            };
            let spectrum = transformed(Kind::Plain);
            for kind in Kind::all() {
                assert_eq!(transformed(kind), spectrum, "{kind:?}");
            }
            for line in 0..2 {
                for k in 0..side {
                    for lane in 0..LANES {
                        let (mut re, mut im) = (0.0f64, 0.0);
                        for (i, value) in given.iter().enumerate() {
                            let angle = -TAU * (i * k % side) as f64 / side as f64;
                            let value = [value[line].re[lane], value[line].im[lane]].map(f64::from);
                            re += value[0] * angle.cos() - value[1] * angle.sin();
                            im += value[0] * angle.sin() + value[1] * angle.cos();
                        }
                        let got = spectrum[k][line].unwrap();
                        let off =
                            (f64::from(got.re[lane]) - re).hypot(f64::from(got.im[lane]) - im);
                        assert!(
                            off < 1e-5 * (side as f64).sqrt(),
                            "{side}, {k}, {lane}: {off}"
                        );
                    }
                }
            }
        }
    }
}
