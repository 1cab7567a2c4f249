//! The light seen through every function of the basis from every place: `C_k(o) = Σ_s v_k(s) p(o+s)`
//! for window origins `o`. A factored pixel is `Σ_k c_nk C_k(o_n)`: all that depends on the light is
//! in `C`, and pixels that look at the same place share it.
//!
//! Through the Fourier transform, square by square: some 60 operations a value where a window of 15
//! takes 450.

use super::fft::{Complex, Fft, LANES, Lanes, Line};
use crate::transport::{Basis, CHANNELS, QUAD, Window};

/// Sides of transforms to choose from; the largest holds a window of 63 and as much again.
const SIDES: [usize; 4] = [32, 64, 128, 256];
/// Functions in one transform: one in each real part, one in each imaginary part.
const TOGETHER: usize = 2 * LANES;

/// Correlates squares of a light with the functions of a basis.
#[derive(Debug)]
pub struct Correlator {
    fft: Fft,
    /// Origins along a square's side.
    reach: usize,
    quads: usize,
    /// Of the functions, mirrored; `[group, u, v]`.
    spectra: Vec<Complex>,
}

/// Memory that correlating takes for a while.
#[derive(Debug)]
pub struct Workspace {
    line: Line,
    /// `[v, u]`.
    rows: Vec<Complex>,
    /// Of the light, `[u, v, channel]`.
    spectrum: Vec<[[f32; 2]; CHANNELS]>,
    /// `[u, v]`, of `v` as many as a square has.
    columns: Vec<Complex>,
}

impl Correlator {
    /// For window origins that span `across` times `down`.
    pub fn new(basis: &Basis, window: Window, across: usize, down: usize) -> Self {
        let side = window.side() as usize;
        let cost = |n: &&usize| match (**n + 1).checked_sub(side) {
            None | Some(0) => usize::MAX,
            Some(reach) => {
                let squares = across.div_ceil(reach) * down.div_ceil(reach);
                squares * **n * **n * (**n).ilog2() as usize
            }
        };
        let n = *SIDES.iter().min_by_key(cost).unwrap_or(&SIDES[3]);
        let mut correlator = Self {
            fft: Fft::new(n),
            reach: n + 1 - side,
            quads: basis.rank().div_ceil(QUAD),
            spectra: Vec::new(),
        };
        for functions in basis.kernels.chunks(TOGETHER) {
            correlator.add_spectrum(functions, side);
        }
        correlator
    }

    fn add_spectrum(&mut self, functions: &[Vec<f32>], side: usize) {
        let n = self.fft.side();
        let scale = 1.0 / (n * n) as f32;
        let mut square = vec![Complex::default(); n * n];
        for (k, function) in functions.iter().enumerate() {
            for (s, value) in function.iter().enumerate() {
                // Mirrored: what a transform multiplies is a convolution.
                let (u, v) = ((n - s % side) % n, (n - s / side) % n);
                let Complex { re, im } = &mut square[v * n + u];
                let part = if k < LANES { re } else { im };
                part.0[k % LANES] = value * scale;
            }
        }
        let mut line = Line::new(n);
        for row in square.chunks_exact_mut(n) {
            line.values.copy_from_slice(row);
            self.fft.transform(&mut line);
            row.copy_from_slice(&line.values);
        }
        for u in 0..n {
            for v in 0..n {
                line.values[v] = square[v * n + u];
            }
            self.fft.transform(&mut line);
            self.spectra.extend_from_slice(&line.values);
        }
    }

    /// Origins along the side of a square that is correlated at once.
    pub fn reach(&self) -> usize {
        self.reach
    }

    /// Texels of four components, of one origin and channel.
    pub fn quads(&self) -> usize {
        self.quads
    }

    /// What [`correlate`](Self::correlate) needs.
    pub fn workspace(&self) -> Workspace {
        let n = self.fft.side();
        Workspace {
            line: Line::new(n),
            rows: vec![Complex::default(); n * n],
            spectrum: vec![Default::default(); n * n],
            columns: vec![Complex::default(); n * self.reach],
        }
    }

    /// Whether a workspace is one of this correlator's.
    pub fn fits(&self, work: &Workspace) -> bool {
        let n = self.fft.side();
        work.rows.len() == n * n && work.columns.len() == n * self.reach
    }

    /// `C` of a square, as `[origin, channel, quad]`, of these `channels` of what `row` yields of the
    /// light: elements of the row of that number, as many as a square sees; none for a dark row.
    #[inline(always)]
    pub fn correlate<'a>(
        &self,
        row: impl Fn(usize) -> Option<&'a [[f32; 4]]>,
        channels: &[usize],
        work: &mut Workspace,
        out: &mut [[f32; QUAD]],
    ) {
        self.transform(row, work);
        let n = self.fft.side();
        for (group, spectra) in self.spectra.chunks_exact(n * n).enumerate() {
            for (i, channel) in channels.iter().enumerate() {
                self.invert(spectra, *channel, work);
                self.collect(group, (i, channels.len()), work, out);
            }
        }
    }

    /// The light's spectrum.
    #[inline(always)]
    fn transform<'a>(&self, row: impl Fn(usize) -> Option<&'a [[f32; 4]]>, work: &mut Workspace) {
        let n = self.fft.side();
        for (v, values) in work.rows.chunks_exact_mut(n).enumerate() {
            let Some(elements) = row(v) else {
                values.fill(Complex::default());
                continue;
            };
            for (value, element) in work.line.values.iter_mut().zip(elements) {
                let mut re = [0.0; LANES];
                re[..CHANNELS].copy_from_slice(&element[..CHANNELS]);
                *value = Complex {
                    re: Lanes(re),
                    im: Lanes::default(),
                };
            }
            self.fft.transform(&mut work.line);
            values.copy_from_slice(&work.line.values);
        }
        for (u, spectrum) in work.spectrum.chunks_exact_mut(n).enumerate() {
            for (value, row) in work.line.values.iter_mut().zip(work.rows.chunks_exact(n)) {
                *value = row[u];
            }
            self.fft.transform(&mut work.line);
            for (spectrum, value) in spectrum.iter_mut().zip(&work.line.values) {
                *spectrum = std::array::from_fn(|c| [value.re.0[c], value.im.0[c]]);
            }
        }
    }

    /// The product of the spectra, transformed back along `v`.
    #[inline(always)]
    fn invert(&self, spectra: &[Complex], channel: usize, work: &mut Workspace) {
        let n = self.fft.side();
        let lines = spectra.chunks_exact(n).zip(work.spectrum.chunks_exact(n));
        for ((functions, light), column) in lines.zip(work.columns.chunks_exact_mut(self.reach)) {
            let both = functions.iter().zip(light);
            for (value, (function, light)) in work.line.values.iter_mut().zip(both) {
                *value = function.times(light[channel]).exchanged();
            }
            self.fft.transform(&mut work.line);
            column.copy_from_slice(&work.line.values[..self.reach]);
        }
    }

    /// The same along `u`, and where it belongs.
    #[inline(always)]
    fn collect(
        &self,
        group: usize,
        (channel, channels): (usize, usize),
        work: &mut Workspace,
        out: &mut [[f32; QUAD]],
    ) {
        let first = group * TOGETHER / QUAD;
        let quads = (self.quads - first).min(TOGETHER / QUAD);
        let each = channels * self.quads;
        let at = channel * self.quads + first;
        for (v, out) in out.chunks_exact_mut(self.reach * each).enumerate() {
            let columns = work.columns.chunks_exact(self.reach);
            for (value, column) in work.line.values.iter_mut().zip(columns) {
                *value = column[v];
            }
            self.fft.transform(&mut work.line);
            for (value, out) in work.line.values.iter().zip(out.chunks_exact_mut(each)) {
                let Complex { re, im } = value.exchanged();
                let texels = re.0.as_chunks().0.iter().chain(im.0.as_chunks().0);
                for (out, texel) in out[at..at + quads].iter_mut().zip(texels) {
                    *out = *texel;
                }
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn correlations_are_the_sums_they_stand_for() {
        let number = |i: usize| ((i * 7919) % 1009) as f32 / 504.0 - 1.0;
        for (side, rank, span) in [
            (15, 16, 200),
            (1, 1, 20),
            (3, 5, 40),
            (17, 21, 18),
            (63, 9, 70),
        ] {
            let area = side * side;
            let basis = Basis {
                kernels: (0..rank)
                    .map(|k| {
                        (0..area)
                            .map(|s| number(k * area + s) / side as f32)
                            .collect()
                    })
                    .collect(),
            };
            let window = Window::new(side as u32).unwrap();
            let correlator = Correlator::new(&basis, window, span, span);
            let (reach, quads) = (correlator.reach(), correlator.quads());
            let n = reach + side - 1;
            let light: Vec<[f32; 4]> = (0..n * n)
                .map(|i| std::array::from_fn(|c| number(4 * i + c).abs()))
                .collect();
            // Rows that are not there are dark.
            let row = |v: usize| (v != 5).then(|| &light[v * n..(v + 1) * n]);
            let mut out = vec![[0.0; QUAD]; reach * reach * CHANNELS * quads];
            let mut work = correlator.workspace();
            correlator.correlate(row, &[0, 1, 2], &mut work, &mut out);
            for o in [0, 1, reach - 1, reach * reach / 2, reach * reach - 1] {
                for c in 0..CHANNELS {
                    for k in 0..rank {
                        let want: f64 = (0..area)
                            .filter(|s| o / reach + s / side != 5)
                            .map(|s| {
                                let at = (o / reach + s / side) * n + o % reach + s % side;
                                f64::from(basis.kernels[k][s]) * f64::from(light[at][c])
                            })
                            .sum();
                        let got = out[(o * CHANNELS + c) * quads + k / QUAD][k % QUAD];
                        let off = (f64::from(got) - want).abs();
                        assert!(off < 1e-5, "window {side}, origin {o}, {c}, {k}: {off}");
                    }
                }
            }
        }
    }
}
