//! The light seen through every function of the basis from every place: `C_k(o) = Σ_s v_k(s) p(o+s)`
//! for window origins `o`. A factored pixel is `Σ_k c_nk C_k(o_n)`: all that depends on the light is
//! in `C`, and pixels that look at the same place share it.
//!
//! Through the Fourier transform, square by square: some 60 operations a value where a window of 15
//! takes 450.

use super::fft::{Between, Complex, Fft, Kept, Packed};
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
    /// One channel of the light, `[v, u]`; dark beyond what a square sees.
    plane: Vec<[f32; LANES]>,
    /// Of some columns of it; `[v]`.
    columns: Kept,
    /// Of it along `v` alone: `[block of v, u]`, of the first half of `v`.
    half: Vec<Packed>,
    /// Of it: `[u, part, v]`.
    spectrum: Vec<f32>,
    /// `[u, v]`, of `v` as many as a square has.
    lines: Vec<Packed>,
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
                |u| Complex::load(|_| &given[u]),
                #[inline(always)]
                |u: usize, value: Complex<Plain>| value.store(0, &mut row[u]),
            );
        }
        for u in 0..n {
            let start = self.spectra.len();
            self.spectra.resize(start + n, Packed::default());

            self.fft.transform(
                &mut between,
                #[inline(always)]
                |v| Complex::load(|_| &square[v * n + u]),
                #[inline(always)]
                |v: usize, value: Complex<Plain>| value.store(0, &mut self.spectra[start + v]),
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
            plane: vec![[0.0; LANES]; n * n / LANES],
            columns: Kept::new(n),
            half: vec![Packed::default(); blocks(n) * n],
            spectrum: vec![0.0; 2 * n * n],
            lines: vec![Packed::default(); n * self.reach],
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
        if work.seen.len() < lines {
            work.seen.resize(lines, Line::default());
        }
        for (i, channel) in channels.iter().enumerate() {
            self.separate(&row, *channel, &mut work.plane);
            self.along_v::<V>(work);
            self.along_u::<V>(work);
            let groups = self.spectra.chunks_exact(n * n);
            for (group, spectra) in groups.take(quads.div_ceil(TOGETHER / QUAD)).enumerate() {
                self.invert::<V>(spectra, work);
                self.collect::<V>(group, quads, (i, channels.len()), work);
            }
        }
        &bytemuck::cast_slice(&work.seen)[..texels]
    }

    /// Takes one channel of the light. All is dark beyond what the square sees.
    #[inline(always)]
    fn separate<'a>(
        &self,
        row: impl Fn(usize) -> &'a [[f32; 4]],
        channel: usize,
        plane: &mut [[f32; LANES]],
    ) {
        let plane = plane.as_flattened_mut();
        for (v, out) in plane
            .chunks_exact_mut(self.fft.side())
            .take(self.sees)
            .enumerate()
        {
            let elements = &row(v)[..self.sees];
            for (out, element) in out.iter_mut().zip(elements) {
                *out = element[channel];
            }
        }
    }

    /// Transforms that along `v`. Columns are real, so that two share a transform: of `f = a + ib`,
    /// `a` has the spectrum `(f(v) + f̄(-v)) / 2` and `b` has `(f(v) - f̄(-v)) / 2i`. They are left as
    /// twice that, and for `v` up to the middle, which tells the others.
    #[inline(always)]
    fn along_v<V: Vector>(&self, work: &mut Workspace) {
        let n = self.fft.side();
        let blocks_a_row = n / LANES;
        let columns = work.columns.of::<V>();
        let plane = &work.plane;
        // What the square does not see stays dark.
        for first in (0..self.sees.div_ceil(LANES)).step_by(2 * V::LINES) {
            self.fft.transform(
                &mut work.between,
                #[inline(always)]
                |v: usize| {
                    let blocks = &plane[v * blocks_a_row + first..][..2 * V::LINES];
                    Complex {
                        re: V::load(
                            #[inline(always)]
                            |line| &blocks[2 * line],
                        ),
                        im: V::load(
                            #[inline(always)]
                            |line| &blocks[2 * line + 1],
                        ),
                    }
                },
                #[inline(always)]
                |v: usize, value: Complex<V>| value.keep(&mut columns[v]),
            );
            for v in 0..=n / 2 {
                let (f, g) = (
                    Complex::<V>::kept(&columns[v]),
                    Complex::kept(&columns[(n - v) % n]),
                );
                let both = [
                    Complex {
                        re: f.re.plus(g.re),
                        im: f.im.minus(g.im),
                    },
                    Complex {
                        re: f.im.plus(g.im),
                        im: g.re.minus(f.re),
                    },
                ];
                for line in 0..V::LINES {
                    for (part, value) in both.into_iter().enumerate() {
                        let mut packed = Packed::default();
                        value.store(line, &mut packed);
                        let u = (first + 2 * line + part) * LANES;
                        let to = &mut work.half[v / LANES * n + u..][..LANES];
                        for lane in 0..LANES {
                            to[lane].re[v % LANES] = packed.re[lane];
                            to[lane].im[v % LANES] = packed.im[lane];
                        }
                    }
                }
            }
        }
    }

    /// Transforms what that left along `u`. What is beyond the middle is the conjugate of what is as
    /// far before it.
    #[inline(always)]
    fn along_u<V: Vector>(&self, work: &mut Workspace) {
        let n = self.fft.side();
        let (half, spectrum) = (&work.half, &mut work.spectrum);
        let last = blocks(n) - 1;
        for first in (0..=last).step_by(V::LINES) {
            self.fft.transform(
                &mut work.between,
                #[inline(always)]
                |u: usize| {
                    Complex::load(
                        #[inline(always)]
                        |line| &half[(first + line).min(last) * n + u],
                    )
                },
                #[inline(always)]
                |u: usize, value: Complex<V>| {
                    for line in 0..V::LINES {
                        let v = (first + line).min(last) * LANES;
                        let (re, im) = spectrum[2 * u * n..][..2 * n].split_at_mut(n);
                        if let (Some(re), Some(im)) =
                            (re[v..].first_chunk_mut(), im[v..].first_chunk_mut())
                        {
                            value.re.store(line, re);
                            value.im.store(line, im);
                        }
                    }
                },
            );
        }
        for u in 0..=n / 2 {
            let (to_here, after) = spectrum.split_at_mut(2 * (u + 1) * n);
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

    /// The product of the spectra, transformed back along `v`.
    #[inline(always)]
    fn invert<V: Vector>(&self, spectra: &[Packed], work: &mut Workspace) {
        let n = self.fft.side();
        for first in (0..n).step_by(V::LINES) {
            let functions = &spectra[first * n..][..V::LINES * n];
            let light = &work.spectrum[2 * first * n..][..2 * V::LINES * n];
            let lines = &mut work.lines[first * self.reach..][..V::LINES * self.reach];
            self.fft.transform(
                &mut work.between,
                #[inline(always)]
                |v: usize| {
                    let functions = Complex::<V>::load(
                        #[inline(always)]
                        |line| &functions[line * n + v],
                    );
                    let light = Complex {
                        re: V::splat_lines(
                            #[inline(always)]
                            |line| light[2 * line * n + v],
                        ),
                        im: V::splat_lines(
                            #[inline(always)]
                            |line| light[2 * line * n + n + v],
                        ),
                    };
                    functions.times(light).exchanged()
                },
                #[inline(always)]
                |v: usize, value: Complex<V>| {
                    if v < self.reach {
                        for line in 0..V::LINES {
                            value.store(line, &mut lines[line * self.reach + v]);
                        }
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
        let begin = group * TOGETHER / QUAD;
        let each = channels * quads;
        let at = channel * quads + begin;
        let quads = (quads - begin).min(TOGETHER / QUAD);
        let seen: &mut [[f32; QUAD]] = bytemuck::cast_slice_mut(&mut work.seen);
        let lines = &work.lines;
        for first in (0..self.reach).step_by(V::LINES) {
            self.fft.transform(
                &mut work.between,
                #[inline(always)]
                |u: usize| {
                    Complex::load(
                        #[inline(always)]
                        |line| &lines[u * self.reach + (first + line).min(self.reach - 1)],
                    )
                },
                #[inline(always)]
                |u: usize, value: Complex<V>| {
                    if u >= self.reach {
                        return;
                    }
                    let value = value.exchanged();
                    for line in 0..V::LINES {
                        let v = (first + line).min(self.reach - 1);
                        let out = &mut seen[(v * self.reach + u) * each + at..][..quads];
                        if let ([re, im], []) = out.as_flattened_mut().as_chunks_mut() {
                            value.re.store(line, re);
                            value.im.store(line, im);
                            continue;
                        }
                        let mut packed = Packed::default();
                        value.store(line, &mut packed);
                        let re = packed.re.as_chunks().0;
                        let im = packed.im.as_chunks().0;
                        for (out, texel) in out.iter_mut().zip(re.iter().chain(im)) {
                            *out = *texel;
                        }
                    }
                },
            );
        }
    }
}

/// What is beyond the middle of a line of a spectrum, from the first half of its opposite.
#[inline(always)]
fn mirror(opposite: &[f32], sign: f32, beyond: &mut [f32]) {
    let middle = opposite.len() - 1;
    for (value, opposite) in beyond.iter_mut().zip(opposite[1..middle].iter().rev()) {
        *value = sign * opposite;
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
    use crate::relight::cpu::lanes::{Kind, Work};

    /// All channels of a square, through all functions.
    struct Correlate<'a> {
        correlator: &'a Correlator,
        quads: usize,
        light: &'a [[f32; 4]],
        seen: &'a mut Vec<[f32; QUAD]>,
    }

    impl Work for Correlate<'_> {
        #[inline(always)]
        fn run<V: Vector>(self) {
            let row = |v: usize| &self.light[v * self.correlator.sees..];
            let (channels, mut work) = ([0, 1, 2], self.correlator.workspace());
            let seen = self
                .correlator
                .correlate::<V>(row, &channels, self.quads, &mut work);
            *self.seen = seen.to_vec();
        }
    }

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
            (7, 40, 60),
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
            let correlated = |kind: Kind, quads: usize| {
                let mut seen = Vec::new();
                kind.run(Correlate {
                    correlator: &correlator,
                    quads,
                    light: &light,
                    seen: &mut seen,
                });
                seen
            };
            let out = correlated(Kind::Plain, quads);
            // The first of them are the same without the others.
            let fewer = quads.div_ceil(2);
            let first: Vec<_> = out
                .chunks(quads)
                .flat_map(|all| all[..fewer].to_vec())
                .collect();
            for kind in Kind::all() {
                assert!(out == correlated(kind, quads), "{kind:?}");
                assert!(first == correlated(kind, fewer), "{kind:?}");
            }
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
