//! Discrete Fourier transforms of squares, several at once: one in each lane of a vector.
//!
//! Stockham's algorithm in passes of radix four, and one of radix two where the side asks for it.
//! Only the forward transform is there: the inverse is the same with real and imaginary parts
//! exchanged, before and after.

use std::f64::consts::TAU;

use super::lanes::{LANES, Vector};

/// One complex number of each transform, as it lies in memory.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
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

impl Packed {
    /// Loads it.
    #[inline(always)]
    pub fn load<V: Vector>(&self) -> Complex<V> {
        Complex {
            re: V::load(&self.re),
            im: V::load(&self.im),
        }
    }
}

impl<V: Vector> Complex<V> {
    /// Stores it.
    #[inline(always)]
    pub fn store(self, to: &mut Packed) {
        self.re.store(&mut to.re);
        self.im.store(&mut to.im);
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

    /// Each lane times the same complex number.
    #[inline(always)]
    pub fn times(self, [re, im]: [f32; 2]) -> Self {
        let (re, im) = (V::splat(re), V::splat(im));
        Self {
            re: self.re.times(re).minus(self.im.times(im)),
            im: self.re.times(im).plus(self.im.times(re)),
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

/// Numbers between the passes.
#[derive(Debug)]
pub struct Between {
    now: Vec<Packed>,
    next: Vec<Packed>,
}

impl Between {
    /// For transforms of `side` numbers.
    pub fn new(side: usize) -> Self {
        Self {
            now: vec![Packed::default(); side],
            next: vec![Packed::default(); side],
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
                    [angle.cos() as f32, angle.sin() as f32]
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
        let Between { now, next } = between;
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
            pass::<V>(now, next, here, stride);
            std::mem::swap(now, next);
            twiddles = later;
            n /= 4;
            stride *= 4;
        }
        // The last takes no turns.
        if n == 4 {
            let [a, b, c, d] = parts(&now[..self.side]);
            for q in 0..stride {
                let out = butterfly::<V>([a[q].load(), b[q].load(), c[q].load(), d[q].load()]);
                for (part, value) in out.into_iter().enumerate() {
                    put(q + part * stride, value);
                }
            }
        } else {
            let (low, high) = now[..self.side].split_at(stride);
            for (q, (low, high)) in low.iter().zip(high).enumerate() {
                let (low, high) = (low.load::<V>(), high.load());
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

/// Stores four numbers, turned.
#[inline(always)]
fn turned<V: Vector>(
    [a, b, c, d]: [Complex<V>; 4],
    [one, two, three]: &[[f32; 2]; 3],
    [w, x, y, z]: [&mut Packed; 4],
) {
    a.store(w);
    b.times(*one).store(x);
    c.times(*two).store(y);
    d.times(*three).store(z);
}

/// Four equal parts.
#[inline(always)]
fn parts(values: &[Packed]) -> [&[Packed]; 4] {
    let (low, high) = values.split_at(values.len() / 2);
    let ((a, b), (c, d)) = (low.split_at(low.len() / 2), high.split_at(high.len() / 2));
    [a, b, c, d]
}

/// A pass between the first and the last, `stride` transforms interleaved.
#[inline(always)]
fn pass<V: Vector>(from: &[Packed], to: &mut [Packed], twiddles: &[[[f32; 2]; 3]], stride: usize) {
    let [a, b, c, d] = parts(from).map(|part| part.chunks_exact(stride));
    let each = a.zip(b).zip(c.zip(d)).zip(to.chunks_exact_mut(4 * stride));
    for ((((a, b), (c, d)), to), twiddles) in each.zip(twiddles) {
        let (low, high) = to.split_at_mut(2 * stride);
        let ((w, x), (y, z)) = (low.split_at_mut(stride), high.split_at_mut(stride));
        let (b, c, d) = (&b[..a.len()], &c[..a.len()], &d[..a.len()]);
        let (w, x) = (&mut w[..a.len()], &mut x[..a.len()]);
        let (y, z) = (&mut y[..a.len()], &mut z[..a.len()]);
        for q in 0..a.len() {
            let out = butterfly::<V>([a[q].load(), b[q].load(), c[q].load(), d[q].load()]);
            turned(out, twiddles, [&mut w[q], &mut x[q], &mut y[q], &mut z[q]]);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::relight::cpu::lanes::{Plain, Work, widest};

    /// A transform's result, by whatever vectors there are.
    struct Transform<'a> {
        fft: &'a Fft,
        given: &'a [Packed],
        spectrum: &'a mut [Option<Packed>],
    }

    impl Work for Transform<'_> {
        fn run<V: Vector>(self) {
            let put = |k: usize, value: Complex<V>| {
                let mut packed = Packed::default();
                value.store(&mut packed);
                assert!(self.spectrum[k].replace(packed).is_none());
            };
            let between = &mut Between::new(self.given.len());
            self.fft.transform(between, |i| self.given[i].load(), put);
        }
    }

    fn number(i: usize, lane: usize) -> f32 {
        ((i * 7919 + lane * 104_729) % 1009) as f32 / 504.0 - 1.0
    }

    #[test]
    fn transforms_are_what_they_are_defined_to_be() {
        for side in [16, 32, 64, 128, 256] {
            let fft = Fft::new(side);
            let given: Vec<Packed> = (0..side)
                .map(|i| Packed {
                    re: std::array::from_fn(|lane| number(i, lane)),
                    im: std::array::from_fn(|lane| number(i + 500, lane)),
                })
                .collect();
            let [mut spectrum, mut plain] = [vec![None; side], vec![None; side]];
            let transform = |spectrum| Transform {
                fft: &fft,
                given: &given,
                spectrum,
            };
            widest(transform(&mut spectrum));
            transform(&mut plain).run::<Plain>();
            assert_eq!(spectrum, plain);
            for k in 0..side {
                for lane in 0..LANES {
                    let (mut re, mut im) = (0.0f64, 0.0);
                    for (i, value) in given.iter().enumerate() {
                        let angle = -TAU * (i * k % side) as f64 / side as f64;
                        let value = [value.re[lane], value.im[lane]].map(f64::from);
                        re += value[0] * angle.cos() - value[1] * angle.sin();
                        im += value[0] * angle.sin() + value[1] * angle.cos();
                    }
                    let got = spectrum[k].unwrap();
                    let off = (f64::from(got.re[lane]) - re).hypot(f64::from(got.im[lane]) - im);
                    assert!(
                        off < 1e-5 * (side as f64).sqrt(),
                        "{side}, {k}, {lane}: {off}"
                    );
                }
            }
        }
    }
}
