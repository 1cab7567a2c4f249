//! The basis response of a origin block: `C_k(o) = Σ_s v_k(s) p(o + s)` for each window origin `o` of the block, each
//! basis function `v_k` and each channel of the light `p`.
//!
//! A factored pixel is `Σ_k c_nk C_k(o_n)`: everything that depends on the light is in `C`, and pixels with the same
//! window origin share it. `C` is computed by Fourier transforms: `F⁻¹(V̄_k · F)`, with `V_k` the basis function's
//! spectrum, which is computed once, and `F` the light's ([`LightFft`]). That takes some 60 operations a value,
//! where the sum over a window of side 15 takes 450.

use super::block_size::{even_block_side, fft_side};
use super::fft::{Complex, ComplexLanes, Fft, FftScratch};
use super::light_fft::LightFft;
use super::simd::{LANES, ScalarFallback, Simd};
use crate::transport::{Basis, TEXEL_COMPONENTS, Window};

/// Basis functions in one transform: one in the real part and one in the imaginary part of each lane.
const GROUP: usize = 2 * LANES;

/// Correlates origin blocks with the functions of a basis.
#[derive(Debug)]
pub struct Correlator {
    fft: Fft,
    /// Window origins along a block's side.
    pub block_side: usize,
    /// Light elements along the side of a block's footprint, `block_side + w - 1`.
    footprint: usize,
    /// Texels of four components that an origin and channel have.
    pub quads: usize,
    /// Spectra of the mirrored basis functions: `[group, u, v]`.
    spectra: Vec<ComplexLanes>,
}

#[derive(Debug)]
pub struct CorrelationScratch {
    fft: FftScratch,
    light: LightFft,
    /// The product of the spectra, transformed back along `v`: `[u, v]`, `v` within the block.
    columns: Vec<ComplexLanes>,
    /// `C`: `[origin, channel, quad]`.
    response: Vec<CacheLine>,
}

/// Texels, aligned to a cache line.
#[derive(Clone, Copy, Debug, Default, bytemuck::Pod, bytemuck::Zeroable)]
#[repr(C, align(64))]
struct CacheLine([f32; 16]);

impl Correlator {
    /// For window origins that span `columns × rows`.
    pub fn new(basis: &Basis, window: Window, columns: usize, rows: usize) -> Self {
        let window = window.side() as usize;
        let n = fft_side(basis.rank(), window, columns, rows);
        let block_side = even_block_side(n + 1 - window, [columns, rows]);
        let mut correlator = Self {
            fft: Fft::new(n),
            block_side,
            footprint: block_side + window - 1,
            quads: basis.rank().div_ceil(TEXEL_COMPONENTS),
            spectra: Vec::new(),
        };
        for functions in basis.kernels.chunks(GROUP) {
            correlator.add_spectrum(functions, window);
        }
        correlator
    }

    fn add_spectrum(&mut self, functions: &[Vec<f32>], window: usize) {
        let n = self.fft.side;
        // 1/n² of the inverse transform; ½, as the light's spectrum comes doubled.
        let scale = 0.5 / (n * n) as f32;
        let mut mirrored = vec![ComplexLanes::default(); n * n];
        for (k, function) in functions.iter().enumerate() {
            for (s, value) in function.iter().enumerate() {
                // A product of spectra is a convolution; mirroring makes it a correlation.
                let (u, v) = ((n - s % window) % n, (n - s / window) % n);
                let ComplexLanes { re, im } = &mut mirrored[v * n + u];
                let part = if k < LANES { re } else { im };
                part[k % LANES] = value * scale;
            }
        }
        let mut scratch = self.fft.scratch();
        for row in mirrored.chunks_exact_mut(n) {
            let values = row.to_vec();
            self.fft.transform(
                ScalarFallback,
                &mut scratch,
                |u| Complex::load(ScalarFallback, |_| &values[u]),
                |u, value| value.store(ScalarFallback, 0, &mut row[u]),
            );
        }
        for u in 0..n {
            let start = self.spectra.len();
            self.spectra.resize(start + n, ComplexLanes::default());
            self.fft.transform(
                ScalarFallback,
                &mut scratch,
                |v| Complex::load(ScalarFallback, |_| &mirrored[v * n + u]),
                |v, value| value.store(ScalarFallback, 0, &mut self.spectra[start + v]),
            );
        }
    }

    pub fn scratch(&self) -> CorrelationScratch {
        let n = self.fft.side;
        CorrelationScratch {
            fft: self.fft.scratch(),
            light: LightFft::new(n),
            columns: vec![ComplexLanes::default(); n * self.block_side],
            response: Vec::new(),
        }
    }

    /// `C` of a block, `[origin, channel, quad]`, for these channels of the light and the first `quads` quads of
    /// components. `row(v)` has the footprint's elements of row `v`.
    #[inline(always)]
    pub fn correlate<'a, 's, S: Simd>(
        &self,
        simd: S,
        row: impl Fn(usize) -> &'a [[f32; 4]],
        channels: &[usize],
        quads: usize,
        scratch: &'s mut CorrelationScratch,
    ) -> &'s [[f32; TEXEL_COMPONENTS]] {
        let n = self.fft.side;
        let texels = self.block_side * self.block_side * channels.len() * quads;
        let lines =
            (texels * size_of::<[f32; TEXEL_COMPONENTS]>()).div_ceil(size_of::<CacheLine>());
        if scratch.response.len() < lines {
            scratch.response.resize(lines, CacheLine::default());
        }
        for (i, channel) in channels.iter().enumerate() {
            let CorrelationScratch { fft, light, .. } = scratch;
            light.compute(simd, &self.fft, fft, &row, self.footprint, *channel);
            let groups = self.spectra.chunks_exact(n * n);
            for (group, spectra) in groups
                .take(quads.div_ceil(GROUP / TEXEL_COMPONENTS))
                .enumerate()
            {
                self.invert_along_v(simd, spectra, scratch);
                self.invert_along_u(simd, group, quads, (i, channels.len()), scratch);
            }
        }
        &bytemuck::cast_slice(&scratch.response)[..texels]
    }

    /// Multiplies the spectra and transforms the product back along `v`.
    #[inline(always)]
    fn invert_along_v<S: Simd>(
        &self,
        simd: S,
        spectra: &[ComplexLanes],
        scratch: &mut CorrelationScratch,
    ) {
        let n = self.fft.side;
        for first in (0..n).step_by(S::LINES) {
            let functions = &spectra[first * n..][..S::LINES * n];
            let light = &scratch.light.columns_from(first)[..2 * S::LINES * n];
            let columns =
                &mut scratch.columns[first * self.block_side..][..S::LINES * self.block_side];
            self.fft.transform(
                simd,
                &mut scratch.fft,
                #[inline(always)]
                |v: usize| {
                    let functions = Complex::load(
                        simd,
                        #[inline(always)]
                        |line| &functions[line * n + v],
                    );
                    let light = Complex {
                        re: simd.splat_lines(
                            #[inline(always)]
                            |line| light[2 * line * n + v],
                        ),
                        im: simd.splat_lines(
                            #[inline(always)]
                            |line| light[2 * line * n + n + v],
                        ),
                    };
                    (functions * light).swapped()
                },
                #[inline(always)]
                |v: usize, value: Complex<S::SimdVector>| {
                    if v < self.block_side {
                        for line in 0..S::LINES {
                            value.store(simd, line, &mut columns[line * self.block_side + v]);
                        }
                    }
                },
            );
        }
    }

    /// Transforms back along `u`, and writes the group's texels of one of `channels` channels.
    #[inline(always)]
    fn invert_along_u<S: Simd>(
        &self,
        simd: S,
        group: usize,
        quads: usize,
        (channel, channels): (usize, usize),
        scratch: &mut CorrelationScratch,
    ) {
        let first_quad = group * GROUP / TEXEL_COMPONENTS;
        let texels_an_origin = channels * quads;
        let offset = channel * quads + first_quad;
        let quads = (quads - first_quad).min(GROUP / TEXEL_COMPONENTS);
        let response: &mut [[f32; TEXEL_COMPONENTS]] =
            bytemuck::cast_slice_mut(&mut scratch.response);
        let columns = &scratch.columns;
        let last = self.block_side - 1;
        for first in (0..self.block_side).step_by(S::LINES) {
            self.fft.transform(
                simd,
                &mut scratch.fft,
                #[inline(always)]
                |u: usize| {
                    Complex::load(
                        simd,
                        #[inline(always)]
                        |line| &columns[u * self.block_side + (first + line).min(last)],
                    )
                },
                #[inline(always)]
                |u: usize, value: Complex<S::SimdVector>| {
                    if u >= self.block_side {
                        return;
                    }
                    let value = value.swapped();
                    for line in 0..S::LINES {
                        let origin = (first + line).min(last) * self.block_side + u;
                        let out = &mut response[origin * texels_an_origin + offset..][..quads];
                        if let ([re, im], []) = out.as_flattened_mut().as_chunks_mut() {
                            simd.store(value.re, line, re);
                            simd.store(value.im, line, im);
                            continue;
                        }
                        let mut stored = ComplexLanes::default();
                        value.store(simd, line, &mut stored);
                        let re = stored.re.as_chunks().0;
                        let im = stored.im.as_chunks().0;
                        for (out, texel) in out.iter_mut().zip(re.iter().chain(im)) {
                            *out = *texel;
                        }
                    }
                },
            );
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::relight::cpu::simd::{SimdKernel, SimdLevel};
    use crate::transport::CHANNELS;

    /// Correlates all channels of a block.
    struct FftCorrelateKernel<'a> {
        correlator: &'a Correlator,
        quads: usize,
        light: &'a [[f32; 4]],
        response: &'a mut Vec<[f32; TEXEL_COMPONENTS]>,
    }

    impl SimdKernel for FftCorrelateKernel<'_> {
        #[inline(always)]
        fn run<S: Simd>(self, simd: S) {
            let row = |v: usize| &self.light[v * self.correlator.footprint..];
            let mut scratch = self.correlator.scratch();
            let response =
                self.correlator
                    .correlate(simd, row, &[0, 1, 2], self.quads, &mut scratch);
            *self.response = response.to_vec();
        }
    }

    #[test]
    fn correlations_match_the_sums() {
        let test_value = |i: usize| ((i * 7919) % 1009) as f32 / 504.0 - 1.0;
        for (side, rank, span) in [
            (15, 16, 200),
            (1, 1, 20),
            (3, 5, 40),
            (17, 21, 18),
            (63, 9, 70),
            (7, 40, 60),
        ] {
            let area = side * side;
            let basis = Basis {
                kernels: (0..rank)
                    .map(|k| {
                        (0..area)
                            .map(|s| test_value(k * area + s) / side as f32)
                            .collect()
                    })
                    .collect(),
            };
            let window = Window::new(side as u32).unwrap();
            let correlator = Correlator::new(&basis, window, span, span);
            let (block_side, quads) = (correlator.block_side, correlator.quads);
            let n = correlator.footprint;
            // One row is dark.
            let element = |i: usize| match i / n {
                5 => [0.0; 4],
                _ => std::array::from_fn(|c| test_value(4 * i + c).abs()),
            };
            let light: Vec<[f32; 4]> = (0..n * n).map(element).collect();
            let correlate = |level: SimdLevel, quads: usize| {
                let mut response = Vec::new();
                level.run(FftCorrelateKernel {
                    correlator: &correlator,
                    quads,
                    light: &light,
                    response: &mut response,
                });
                response
            };
            let out = correlate(SimdLevel::ScalarFallback(ScalarFallback), quads);
            // The first quads do not depend on the others.
            let fewer = quads.div_ceil(2);
            let first: Vec<_> = out
                .chunks(quads)
                .flat_map(|all| all[..fewer].to_vec())
                .collect();
            for level in SimdLevel::available() {
                assert!(out == correlate(level, quads), "{level:?}");
                assert!(first == correlate(level, fewer), "{level:?}");
            }
            for o in [
                0,
                1,
                block_side - 1,
                block_side * block_side / 2,
                block_side * block_side - 1,
            ] {
                for c in 0..CHANNELS {
                    for k in 0..rank {
                        let want: f64 = (0..area)
                            .map(|s| {
                                let at =
                                    (o / block_side + s / side) * n + o % block_side + s % side;
                                f64::from(basis.kernels[k][s]) * f64::from(light[at][c])
                            })
                            .sum();
                        let got = out[(o * CHANNELS + c) * quads + k / TEXEL_COMPONENTS]
                            [k % TEXEL_COMPONENTS];
                        let error = (f64::from(got) - want).abs();
                        assert!(error < 1e-5, "window {side}, origin {o}, {c}, {k}: {error}");
                    }
                }
            }
        }
    }
}
