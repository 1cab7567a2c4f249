//! The spectrum `F(u, v)` of one channel of the light under a block: the 2D discrete Fourier transform, of side
//! `n`, of the block's footprint, zero beyond it.
//!
//! The light is real, which halves the work twice. Two columns share a complex transform along `v`: of
//! `f = a + ib`, `a` has the spectrum `(f(v) + f̄(-v)) / 2` and `b` has `(f(v) - f̄(-v)) / 2i`. And only `v` up to
//! `n/2` is transformed along `u`: the rest is `F(-u, -v) = F̄(u, v)`. All values here are twice the spectrum's;
//! the basis's spectra make up for it.

use super::fft::{Complex, ComplexBuffer, ComplexLanes, Fft, FftScratch};
use super::simd::{LANES, Simd};

/// The spectrum of one channel, and the memory to compute it in.
#[derive(Debug)]
pub struct LightFft {
    /// Side of the transforms, `n`.
    side: usize,
    /// One channel of the light, `[v, u]`; zero beyond the footprint.
    channel: Vec<[f32; LANES]>,
    /// Some columns, transformed along `v`: `[v]`.
    columns: ComplexBuffer,
    /// All columns, transformed along `v`: `[block of v, u]`, `v` up to `n/2`.
    half: Vec<ComplexLanes>,
    /// `2F`: `[u, part, v]`.
    values: Vec<f32>,
}

impl LightFft {
    pub fn new(side: usize) -> Self {
        Self {
            side,
            channel: vec![[0.0; LANES]; side * side / LANES],
            columns: ComplexBuffer::new(side),
            half: vec![ComplexLanes::default(); half_blocks(side) * side],
            values: vec![0.0; 2 * side * side],
        }
    }

    /// Computes the spectrum of a channel of the light. `row(v)` has its elements for each `v` below `footprint`.
    #[inline(always)]
    pub fn compute<'a, S: Simd>(
        &mut self,
        simd: S,
        fft: &Fft,
        scratch: &mut FftScratch,
        row: impl Fn(usize) -> &'a [[f32; 4]],
        footprint: usize,
        channel: usize,
    ) {
        let rows = self.channel.as_flattened_mut().chunks_exact_mut(self.side);
        for (v, out) in rows.take(footprint).enumerate() {
            let elements = &row(v)[..footprint];
            for (out, element) in out.iter_mut().zip(elements) {
                *out = element[channel];
            }
        }
        self.transform_along_v(simd, fft, scratch, footprint);
        self.transform_along_u(simd, fft, scratch);
        self.mirror_conjugates();
    }

    /// `2F` in columns from `u` on, each real parts by `v`, then imaginary parts.
    #[inline(always)]
    pub fn columns_from(&self, u: usize) -> &[f32] {
        &self.values[2 * u * self.side..]
    }

    #[inline(always)]
    fn transform_along_v<S: Simd>(
        &mut self,
        simd: S,
        fft: &Fft,
        scratch: &mut FftScratch,
        footprint: usize,
    ) {
        let n = self.side;
        let blocks_a_row = n / LANES;
        let columns = self.columns.vectors::<S>();
        let channel = &self.channel;
        // Columns beyond the footprint stay zero.
        for first in (0..footprint.div_ceil(LANES)).step_by(2 * S::LINES) {
            fft.transform(
                simd,
                scratch,
                #[inline(always)]
                |v: usize| {
                    let blocks = &channel[v * blocks_a_row + first..][..2 * S::LINES];
                    Complex {
                        re: simd.load(
                            #[inline(always)]
                            |line| &blocks[2 * line],
                        ),
                        im: simd.load(
                            #[inline(always)]
                            |line| &blocks[2 * line + 1],
                        ),
                    }
                },
                #[inline(always)]
                |v: usize, value: Complex<S::SimdVector>| value.spill(simd, &mut columns[v]),
            );
            for v in 0..=n / 2 {
                let f = Complex::unspill(simd, &columns[v]);
                let opposite = Complex::unspill(simd, &columns[(n - v) % n]);
                let both = [
                    Complex {
                        re: f.re + opposite.re,
                        im: f.im - opposite.im,
                    },
                    Complex {
                        re: f.im + opposite.im,
                        im: opposite.re - f.re,
                    },
                ];
                for line in 0..S::LINES {
                    for (part, value) in both.into_iter().enumerate() {
                        let mut stored = ComplexLanes::default();
                        value.store(simd, line, &mut stored);
                        let u = (first + 2 * line + part) * LANES;
                        let to = &mut self.half[v / LANES * n + u..][..LANES];
                        for lane in 0..LANES {
                            to[lane].re[v % LANES] = stored.re[lane];
                            to[lane].im[v % LANES] = stored.im[lane];
                        }
                    }
                }
            }
        }
    }

    #[inline(always)]
    fn transform_along_u<S: Simd>(&mut self, simd: S, fft: &Fft, scratch: &mut FftScratch) {
        let n = self.side;
        let (half, values) = (&self.half, &mut self.values);
        let last = half_blocks(n) - 1;
        for first in (0..=last).step_by(S::LINES) {
            fft.transform(
                simd,
                scratch,
                #[inline(always)]
                |u: usize| {
                    Complex::load(
                        simd,
                        #[inline(always)]
                        |line| &half[(first + line).min(last) * n + u],
                    )
                },
                #[inline(always)]
                |u: usize, value: Complex<S::SimdVector>| {
                    for line in 0..S::LINES {
                        let v = (first + line).min(last) * LANES;
                        let (re, im) = values[2 * u * n..][..2 * n].split_at_mut(n);
                        if let (Some(re), Some(im)) =
                            (re[v..].first_chunk_mut(), im[v..].first_chunk_mut())
                        {
                            simd.store(value.re, line, re);
                            simd.store(value.im, line, im);
                        }
                    }
                },
            );
        }
    }

    /// Fills `v` beyond `n/2`: `F(u, v) = F̄(-u, -v)`.
    #[inline(always)]
    fn mirror_conjugates(&mut self) {
        let n = self.side;
        for u in 0..=n / 2 {
            let (to_here, after) = self.values.split_at_mut(2 * (u + 1) * n);
            let here = to_here[2 * u * n..].chunks_exact_mut(n);
            let opposite = (n - u) % n;
            if opposite > u {
                let there = &mut after[2 * (opposite - u - 1) * n..][..2 * n];
                for ((here, there), sign) in here.zip(there.chunks_exact_mut(n)).zip([1.0, -1.0]) {
                    let (here, beyond_here) = here.split_at_mut(n / 2 + 1);
                    let (there, beyond_there) = there.split_at_mut(n / 2 + 1);
                    mirror(here, sign, beyond_there);
                    mirror(there, sign, beyond_here);
                }
            } else {
                for (here, sign) in here.zip([1.0, -1.0]) {
                    let (here, beyond) = here.split_at_mut(n / 2 + 1);
                    mirror(here, sign, beyond);
                }
            }
        }
    }
}

/// Writes the second half of a column from the first half of the opposite column, in reverse.
#[inline(always)]
fn mirror(opposite: &[f32], sign: f32, beyond: &mut [f32]) {
    let middle = opposite.len() - 1;
    for (value, opposite) in beyond.iter_mut().zip(opposite[1..middle].iter().rev()) {
        *value = sign * opposite;
    }
}

/// Lines that `0..=n/2` takes.
fn half_blocks(n: usize) -> usize {
    (n / 2 + 1).div_ceil(LANES)
}
