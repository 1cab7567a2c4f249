//! The light seen through every function of the basis from every place: `C_k(o) = Σ_s v_k(s) p(o+s)`
//! for window origins `o`. A factored pixel is `Σ_k c_nk C_k(o_n)`: all that depends on the light is
//! in `C`, and pixels that look at the same place share it.
//!
//! Through the Fourier transform, square by square: some 60 operations a value where a window of 15
//! takes 450.

use super::fft::{Between, Complex, Fft, Packed};
use super::lanes::{LANES, Plain, Vector};
use super::squares::even_reach;
use crate::transport::{Basis, CHANNELS, QUAD, Window};

/// Sides of transforms to choose from; the largest holds a window of 63 and as much again.
const SIDES: [usize; 4] = [32, 64, 128, 256];
/// Bytes for spectra of the basis and what is seen of a square, which ought to be in a cache.
const MOST_MEMORY: u64 = 16 << 20;
/// Functions in one transform: one in each real part, one in each imaginary part.
const TOGETHER: usize = 2 * LANES;

/// Correlates squares of a light with the functions of a basis.
#[derive(Debug)]
pub struct Correlator {
    fft: Fft,
    /// Origins along a square's side.
    reach: usize,
    /// Elements along the side of what a square sees; not more than the transforms'.
    sees: usize,
    quads: usize,
    /// Of the functions, mirrored; `[group, u, v]`.
    spectra: Vec<Packed>,
}

/// Memory that correlating takes for a while.
#[derive(Debug)]
pub struct Workspace {
    between: Between,
    /// Of some rows of the light, two a lane; `[u]`.
    rows: Vec<Packed>,
    /// Of one channel of the light along `u` alone: `[block of u, v]`, of the first half of `u`.
    half: Vec<Packed>,
    /// Of the light, `[u, v, channel]`.
    spectrum: Vec<[[f32; 2]; CHANNELS]>,
    /// `[u, v]`, of `v` as many as a square has.
    columns: Vec<Packed>,
    /// `C`; `[origin, channel, quad]`.
    seen: Vec<Line>,
}

/// Texels, where a cache's line begins.
#[derive(Clone, Copy, Debug, Default, bytemuck::Pod, bytemuck::Zeroable)]
#[repr(C, align(64))]
struct Line([f32; 16]);

impl Correlator {
    /// For window origins that span `across` times `down`.
    pub fn new(basis: &Basis, window: Window, across: usize, down: usize) -> Self {
        let side = window.side() as usize;
        let n = side_for(basis.rank(), side, across, down);
        let reach = even_reach(n + 1 - side, [across, down]);
        let mut correlator = Self {
            fft: Fft::new(n),
            reach,
            sees: reach + side - 1,
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
        // The light's spectrum is twice what it is.
        let scale = 0.5 / (n * n) as f32;
        let mut square = vec![Packed::default(); n * n];
        for (k, function) in functions.iter().enumerate() {
            for (s, value) in function.iter().enumerate() {
                // Mirrored: what a transform multiplies is a convolution.
                let (u, v) = ((n - s % side) % n, (n - s / side) % n);
                let Packed { re, im } = &mut square[v * n + u];
                let part = if k < LANES { re } else { im };
                part[k % LANES] = value * scale;
            }
        }
        let mut between = Between::new(n);
        for row in square.chunks_exact_mut(n) {
            let given = row.to_vec();

            self.fft.transform(
                &mut between,
                #[inline(always)]
                |u| given[u].load(),
                #[inline(always)]
                |u: usize, value: Complex<Plain>| value.store(&mut row[u]),
            );
        }
        for u in 0..n {
            let start = self.spectra.len();
            self.spectra.resize(start + n, Packed::default());

            self.fft.transform(
                &mut between,
                #[inline(always)]
                |v| square[v * n + u].load(),
                #[inline(always)]
                |v: usize, value: Complex<Plain>| value.store(&mut self.spectra[start + v]),
            );
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
            between: Between::new(n),
            rows: vec![Packed::default(); n],
            half: vec![Packed::default(); blocks(n) * n],
            spectrum: vec![Default::default(); n * n],
            columns: vec![Packed::default(); n * self.reach],
            seen: Vec::new(),
        }
    }

    /// `C` of a square, as `[origin, channel, quad]`, of the first `quads` of components and these
    /// `channels` of what `row` yields of the light: elements of the row of that number, as many as a
    /// square sees.
    #[inline(always)]
    pub fn correlate<'a, 'w, V: Vector>(
        &self,
        row: impl Fn(usize) -> &'a [[f32; 4]],
        channels: &[usize],
        quads: usize,
        work: &'w mut Workspace,
    ) -> &'w [[f32; QUAD]] {
        let n = self.fft.side();
        let texels = self.reach * self.reach * channels.len() * quads;
        let lines = (texels * size_of::<[f32; QUAD]>()).div_ceil(size_of::<Line>());
        work.seen.resize(lines, Line::default());
        for channel in channels {
            self.along_u::<V>(&row, *channel, work);
            self.along_v::<V>(*channel, work);
        }
        let groups = self.spectra.chunks_exact(n * n);
        for (group, spectra) in groups.take(quads.div_ceil(TOGETHER / QUAD)).enumerate() {
            for (i, channel) in channels.iter().enumerate() {
                self.invert::<V>(spectra, *channel, work);
                self.collect::<V>(group, quads, (i, channels.len()), work);
            }
        }
        &bytemuck::cast_slice(&work.seen)[..texels]
    }

    /// Transforms one channel of the light along `u`. Rows are real, so that two share a transform:
    /// of `f = a + ib`, `a` has the spectrum `(f(u) + f̄(-u)) / 2` and `b` has `(f(u) - f̄(-u)) / 2i`.
    /// They are left as twice that, and for `u` up to the middle, which tells the others.
    #[inline(always)]
    fn along_u<'a, V: Vector>(
        &self,
        row: impl Fn(usize) -> &'a [[f32; 4]],
        channel: usize,
        work: &mut Workspace,
    ) {
        let n = self.fft.side();
        for first in (0..n).step_by(2 * LANES) {
            // All is dark beyond what the square sees.
            let rows: [&[[f32; 4]]; 2 * LANES] =
                std::array::from_fn(|l| match first + l < self.sees {
                    true => &row(first + l)[..self.sees],
                    false => &[],
                });
            let is_dark = |row: &[[f32; 4]]| row.iter().all(|element| element[channel] == 0.0);
            if rows.iter().all(|row| is_dark(row)) {
                work.rows.fill(Packed::default());
            } else {
                self.fft.transform(
                    &mut work.between,
                    #[inline(always)]
                    |u: usize| {
                        let element = |l: usize| rows[l].get(u).map_or(0.0, |e| e[channel]);
                        let part = |first: usize| std::array::from_fn(|l| element(first + l));
                        Packed {
                            re: part(0),
                            im: part(LANES),
                        }
                        .load()
                    },
                    #[inline(always)]
                    |u: usize, value: Complex<V>| value.store(&mut work.rows[u]),
                );
            }
            for u in 0..=n / 2 {
                let (f, g) = (&work.rows[u], &work.rows[(n - u) % n]);
                let rows = &mut work.half[u / LANES * n + first..][..2 * LANES];
                let (of_a, of_b) = rows.split_at_mut(LANES);
                for l in 0..LANES {
                    of_a[l].re[u % LANES] = f.re[l] + g.re[l];
                    of_a[l].im[u % LANES] = f.im[l] - g.im[l];
                    of_b[l].re[u % LANES] = f.im[l] + g.im[l];
                    of_b[l].im[u % LANES] = g.re[l] - f.re[l];
                }
            }
        }
    }

    /// Transforms what that left along `v`. What is beyond the middle is the conjugate of what is as
    /// far before it.
    #[inline(always)]
    fn along_v<V: Vector>(&self, channel: usize, work: &mut Workspace) {
        let n = self.fft.side();
        for (block, half) in work.half.chunks_exact(n).enumerate() {
            let first = block * LANES;
            let lanes = LANES.min(n / 2 + 1 - first);

            self.fft.transform(
                &mut work.between,
                #[inline(always)]
                |v| half[v].load(),
                #[inline(always)]
                |v: usize, value: Complex<V>| {
                    let mut packed = Packed::default();
                    value.store(&mut packed);
                    let Packed { re, im } = packed;
                    for lane in 0..lanes {
                        let (u, re, im) = (first + lane, re[lane], im[lane]);
                        work.spectrum[u * n + v][channel] = [re, im];
                        if u > 0 {
                            work.spectrum[(n - u) * n + (n - v) % n][channel] = [re, -im];
                        }
                    }
                },
            );
        }
    }

    /// The product of the spectra, transformed back along `v`.
    #[inline(always)]
    fn invert<V: Vector>(&self, spectra: &[Packed], channel: usize, work: &mut Workspace) {
        let n = self.fft.side();
        let lines = spectra.chunks_exact(n).zip(work.spectrum.chunks_exact(n));
        for ((functions, light), column) in lines.zip(work.columns.chunks_exact_mut(self.reach)) {
            let (functions, light) = (&functions[..n], &light[..n]);

            self.fft.transform(
                &mut work.between,
                #[inline(always)]
                |v: usize| {
                    functions[v]
                        .load::<V>()
                        .times(light[v][channel])
                        .exchanged()
                },
                #[inline(always)]
                |v: usize, value: Complex<V>| {
                    if let Some(place) = column.get_mut(v) {
                        value.store(place);
                    }
                },
            );
        }
    }

    /// The same along `u`, and where it belongs.
    #[inline(always)]
    fn collect<V: Vector>(
        &self,
        group: usize,
        quads: usize,
        (channel, channels): (usize, usize),
        work: &mut Workspace,
    ) {
        let first = group * TOGETHER / QUAD;
        let each = channels * quads;
        let at = channel * quads + first;
        let quads = (quads - first).min(TOGETHER / QUAD);
        let out: &mut [[f32; QUAD]] = bytemuck::cast_slice_mut(&mut work.seen);
        for (v, out) in out
            .chunks_exact_mut(self.reach * each)
            .take(self.reach)
            .enumerate()
        {
            let columns = &work.columns;
            self.fft.transform(
                &mut work.between,
                #[inline(always)]
                |u: usize| columns[u * self.reach + v].load::<V>(),
                #[inline(always)]
                |u: usize, value: Complex<V>| {
                    let Some(out) = out.get_mut(u * each + at..u * each + at + quads) else {
                        return; // Beyond the square's origins.
                    };
                    let value = value.exchanged();
                    if let ([re, im], []) = out.as_flattened_mut().as_chunks_mut() {
                        value.re.store(re);
                        value.im.store(im);
                        return;
                    }
                    let mut packed = Packed::default();
                    value.store(&mut packed);
                    let texels = packed
                        .re
                        .as_chunks()
                        .0
                        .iter()
                        .chain(packed.im.as_chunks().0);
                    for (out, texel) in out.iter_mut().zip(texels) {
                        *out = *texel;
                    }
                },
            );
        }
    }
}

/// Blocks of lanes that the first half of a spectrum takes, its middle included.
fn blocks(n: usize) -> usize {
    (n / 2 + 1).div_ceil(LANES)
}

/// The side of transforms that takes the least work, of those that take no more memory than they
/// may, or of the smallest there can be.
fn side_for(rank: usize, window: usize, across: usize, down: usize) -> usize {
    let reach = |n: usize| (n + 1).saturating_sub(window) as u64;
    let memory = |n: usize| {
        let values = (n * n) as u64 + CHANNELS as u64 * reach(n).pow(2);
        values * rank as u64 * size_of::<f32>() as u64
    };
    let work = |n: usize| {
        let squares = (across as u64).div_ceil(reach(n)) * (down as u64).div_ceil(reach(n));
        squares.saturating_mul((n * n) as u64 * u64::from(n.ilog2()))
    };
    let mut possible = SIDES.into_iter().filter(|n| reach(*n) > 0);
    let smallest = possible.next().unwrap_or(SIDES[SIDES.len() - 1]);
    let larger = possible.filter(|n| memory(*n) <= MOST_MEMORY);
    larger.fold(
        smallest,
        |best, n| if work(n) < work(best) { n } else { best },
    )
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sides_take_little_work_and_memory() {
        assert_eq!(side_for(16, 15, 270, 270), 64);
        assert_eq!(side_for(16, 15, 12, 12), 32);
        // Of 64, squares of two origins each would take 2^32 operations.
        assert_eq!(side_for(9, 63, 838, 836), 256);
        for rank in [1, 1024] {
            for window in (1..=63).step_by(2) {
                let n = side_for(rank, window, 32_768 + window, 32_768 + window);
                assert!(n >= window);
                assert!(rank == 1 || n <= 64, "{window}: {n}");
            }
        }
    }

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
            // One row is dark.
            let element = |i: usize| match i / n {
                5 => [0.0; 4],
                _ => std::array::from_fn(|c| number(4 * i + c).abs()),
            };
            let light: Vec<[f32; 4]> = (0..n * n).map(element).collect();
            let row = |v: usize| &light[v * n..(v + 1) * n];
            let mut work = correlator.workspace();
            let out = correlator.correlate::<Plain>(row, &[0, 1, 2], quads, &mut work);
            for o in [0, 1, reach - 1, reach * reach / 2, reach * reach - 1] {
                for c in 0..CHANNELS {
                    for k in 0..rank {
                        let want: f64 = (0..area)
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
