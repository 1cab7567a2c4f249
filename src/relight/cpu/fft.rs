//! Discrete Fourier transforms of squares, several at once: one in each lane of a vector.
//!
//! Stockham's algorithm in passes of radix four, and one of radix two where the side asks for it.
//! Only the forward transform is there: the inverse is the same with real and imaginary parts
//! exchanged, before and after.

use std::f64::consts::TAU;

/// Transforms done at once.
pub const LANES: usize = if cfg!(target_arch = "wasm32") { 4 } else { 8 };

/// One number of each transform.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[repr(C, align(16))]
pub struct Lanes(pub [f32; LANES]);

/// One complex number of each transform.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Complex {
    /// Real parts.
    pub re: Lanes,
    /// Imaginary parts.
    pub im: Lanes,
}

impl Lanes {
    #[inline(always)]
    fn zip(self, other: Self, f: impl Fn(f32, f32) -> f32) -> Self {
        let mut out = [0.0; LANES];
        for (i, out) in out.iter_mut().enumerate() {
            *out = f(self.0[i], other.0[i]);
        }
        Self(out)
    }

    #[inline(always)]
    fn plus(self, other: Self) -> Self {
        self.zip(other, |a, b| a + b)
    }

    #[inline(always)]
    fn minus(self, other: Self) -> Self {
        self.zip(other, |a, b| a - b)
    }

    /// Each lane times the same number.
    #[inline(always)]
    pub fn times(self, factor: f32) -> Self {
        Self(self.0.map(|a| a * factor))
    }
}

impl Complex {
    #[inline(always)]
    fn plus(self, other: Self) -> Self {
        Self {
            re: self.re.plus(other.re),
            im: self.im.plus(other.im),
        }
    }

    #[inline(always)]
    fn minus(self, other: Self) -> Self {
        Self {
            re: self.re.minus(other.re),
            im: self.im.minus(other.im),
        }
    }

    /// Times the imaginary unit.
    #[inline(always)]
    fn times_i(self) -> Self {
        Self {
            re: Lanes([0.0; LANES]).minus(self.im),
            im: self.re,
        }
    }

    /// Each lane times the same complex number.
    #[inline(always)]
    pub fn times(self, [re, im]: [f32; 2]) -> Self {
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

/// Transforms of `side` numbers, a power of two of at least 4.
#[derive(Clone, Debug)]
pub struct Fft {
    side: usize,
    /// `e^{-2πip/n}`, its square and cube, for each `p` below `n/4` of each pass of radix four; `n`
    /// is the side, then a quarter of it, and so on.
    twiddles: Vec<[[f32; 2]; 3]>,
}

/// Numbers on their way through the passes.
#[derive(Debug)]
pub struct Line {
    /// What is transformed, and then the transform.
    pub values: Vec<Complex>,
    spare: Vec<Complex>,
}

impl Line {
    /// Zeros.
    pub fn new(side: usize) -> Self {
        Self {
            values: vec![Complex::default(); side],
            spare: vec![Complex::default(); side],
        }
    }
}

impl Fft {
    /// Prepares transforms of `side` numbers, which is to be a power of two of at least 4.
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

    /// Transforms a line in its place.
    #[inline(always)]
    pub fn transform(&self, line: &mut Line) {
        let Line { values, spare } = line;
        let (mut n, mut stride) = (self.side, 1);
        let mut twiddles = &self.twiddles[..];
        while n >= 4 {
            let (now, later) = twiddles.split_at(n / 4);
            radix4(values, spare, now, stride);
            std::mem::swap(values, spare);
            twiddles = later;
            n /= 4;
            stride *= 4;
        }
        if n == 2 {
            let (low, high) = values.split_at(stride);
            let (sums, differences) = spare.split_at_mut(stride);
            for q in 0..stride {
                sums[q] = low[q].plus(high[q]);
                differences[q] = low[q].minus(high[q]);
            }
            std::mem::swap(values, spare);
        }
    }
}

/// One pass: from four parts of `from` to `to`, `stride` transforms interleaved.
#[inline(always)]
fn radix4(from: &[Complex], to: &mut [Complex], twiddles: &[[[f32; 2]; 3]], stride: usize) {
    let quarter = from.len() / 4;
    let (a, rest) = from.split_at(quarter);
    let (b, rest) = rest.split_at(quarter);
    let (c, d) = rest.split_at(quarter);
    let parts = a.chunks_exact(stride).zip(b.chunks_exact(stride));
    let parts = parts.zip(c.chunks_exact(stride).zip(d.chunks_exact(stride)));
    for (p, (((a, b), (c, d)), to)) in parts.zip(to.chunks_exact_mut(4 * stride)).enumerate() {
        let (first, rest) = to.split_at_mut(stride);
        let (second, rest) = rest.split_at_mut(stride);
        let (third, fourth) = rest.split_at_mut(stride);
        let d = &d[..a.len()];
        for q in 0..a.len() {
            let (sum, difference) = (a[q].plus(c[q]), a[q].minus(c[q]));
            let (other, turned) = (b[q].plus(d[q]), b[q].minus(d[q]).times_i());
            first[q] = sum.plus(other);
            let (x, y, z) = (
                difference.minus(turned),
                sum.minus(other),
                difference.plus(turned),
            );
            // Without a turn, as all are in the last pass.
            if p == 0 {
                (second[q], third[q], fourth[q]) = (x, y, z);
            } else {
                let [one, two, three] = twiddles[p];
                second[q] = x.times(one);
                third[q] = y.times(two);
                fourth[q] = z.times(three);
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn number(i: usize, lane: usize) -> f32 {
        ((i * 7919 + lane * 104_729) % 1009) as f32 / 504.0 - 1.0
    }

    #[test]
    fn transforms_are_what_they_are_defined_to_be() {
        for side in [4, 8, 16, 32, 64, 128, 256] {
            let fft = Fft::new(side);
            let mut line = Line::new(side);
            for (i, value) in line.values.iter_mut().enumerate() {
                value.re = Lanes(std::array::from_fn(|lane| number(i, lane)));
                value.im = Lanes(std::array::from_fn(|lane| number(i + 500, lane)));
            }
            let given = line.values.clone();
            fft.transform(&mut line);
            for k in 0..side {
                for lane in 0..LANES {
                    let (mut re, mut im) = (0.0f64, 0.0);
                    for (i, value) in given.iter().enumerate() {
                        let angle = -TAU * (i * k % side) as f64 / side as f64;
                        let value = [value.re.0[lane], value.im.0[lane]].map(f64::from);
                        re += value[0] * angle.cos() - value[1] * angle.sin();
                        im += value[0] * angle.sin() + value[1] * angle.cos();
                    }
                    let got = line.values[k];
                    let off =
                        (f64::from(got.re.0[lane]) - re).hypot(f64::from(got.im.0[lane]) - im);
                    assert!(
                        off < 1e-5 * (side as f64).sqrt(),
                        "{side}, {k}, {lane}: {off}"
                    );
                }
            }
        }
    }
}
