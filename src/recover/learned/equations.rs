//! A picture's measurements as equations over a few kernels.

use std::collections::BTreeSet;
use std::ops::Range;

use super::kernels::Kernels;
use crate::capture::Measurements;
use crate::linalg::{dot, vectorise};
use crate::recover::MIN_PATTERNS;
use crate::recover::pooled::MEAN_WEIGHT;
use crate::recover::sampling::pixels_by_window;
use crate::transport::{CHANNELS, CameraPx, Geometry, TileRect};

/// Sub-element position classes along one axis. At two camera pixels an element, neighbours lie in
/// different halves of it, and so differ in what they see of their window.
const HALVES: usize = 2;
/// Sub-element position classes of a pixel.
pub(super) const PHASES: usize = HALVES * HALVES;

/// Where in its light element a pixel's centre lies: 0 to [`PHASES`] - 1.
pub(super) fn phase(geometry: &Geometry, pixel: CameraPx) -> usize {
    let at = geometry.correspondence.at(pixel);
    let half = |x: f64| (((x - x.floor()) * HALVES as f64) as usize).min(HALVES - 1);
    half(at.v) * HALVES + half(at.u)
}

/// One channel of one pixel: `y = f·B z + noise` over its window's kernels.
#[derive(Clone, Copy, Debug)]
pub(super) struct Member {
    /// Which of the region's Gram matrices is its own.
    pub gram: usize,
    /// Brightness `f`, in units of the measurement: what the kernels' mean would send under full
    /// light.
    pub scale: f64,
    /// Variance of one measurement.
    pub variance: f64,
    /// Sum of the weighted rows' squares, `‖y‖²`.
    pub power: f64,
    /// Number of measurements; 0 if nothing usable is known.
    pub rows: usize,
    /// Sub-element position class.
    pub phase: usize,
    /// Whether all of its window lies on the display.
    pub whole: bool,
}

impl Member {
    /// Brightness against the noise of one measurement.
    pub fn contrast(&self) -> f64 {
        self.scale / self.variance.sqrt()
    }
}

/// All equations of the pixels of a region.
#[derive(Debug)]
pub(super) struct Equations {
    /// The pixels covered.
    pub rect: TileRect,
    /// Number of kernels, `r`.
    pub rank: usize,
    /// `BᵀB`, each `[r, r]`, for each window and set of usable patterns.
    grams: Vec<Vec<f64>>,
    /// `[pixel, channel]`.
    pub members: Vec<Member>,
    /// `Bᵀy`, `[pixel, channel, r]`.
    rights: Vec<f64>,
}

impl Equations {
    /// The equations of `rect` from the patterns numbered `rows`.
    pub fn new(
        measurements: &Measurements,
        geometry: &Geometry,
        kernels: &Kernels,
        rows: &[usize],
        rect: TileRect,
    ) -> Self {
        let rank = kernels.rank();
        let pixels = rect.extent.area();
        let unknown = Member {
            gram: 0,
            scale: 0.0,
            variance: 1.0,
            power: 0.0,
            rows: 0,
            phase: 0,
            whole: false,
        };
        let mut equations = Self {
            rect,
            rank,
            grams: Vec::new(),
            members: vec![unknown; pixels * CHANNELS],
            rights: vec![0.0; pixels * CHANNELS * rank],
        };
        let weights = measurements.weights();
        for (origin, pixels) in pixels_by_window(geometry, rect) {
            for (plane, channels) in measurements.planes() {
                let projected = kernels.project(measurements, geometry, origin, plane);
                vectorise(
                    #[inline(always)]
                    || {
                        let fill = Fill {
                            measurements,
                            geometry,
                            projected: &projected,
                            rows,
                            weights: &weights,
                        };
                        fill.window(&mut equations, &pixels, channels);
                    },
                );
            }
        }
        equations
    }

    /// Number of Gram matrices that the equations of `rect` have: one for each window and set of
    /// usable patterns.
    pub fn count_grams(
        measurements: &Measurements,
        geometry: &Geometry,
        rows: &[usize],
        rect: TileRect,
    ) -> usize {
        let windows = pixels_by_window(geometry, rect);
        let sets = |pixels: &[(usize, CameraPx)], channels: Range<usize>| {
            let sets: BTreeSet<Vec<usize>> = pixels
                .iter()
                .flat_map(|&(_, pixel)| channels.clone().map(move |c| (pixel, c)))
                .map(|(pixel, c)| usable(measurements, rows, pixel, c))
                .collect();
            sets.len()
        };
        let counts = windows.values().flat_map(|pixels| {
            let planes = measurements.planes();
            planes.map(move |(_, channels)| sets(pixels, channels))
        });
        counts.sum()
    }

    /// `BᵀB` of a member, `[r, r]`, both triangles.
    pub fn gram(&self, member: usize) -> &[f64] {
        &self.grams[self.members[member].gram]
    }

    /// `Bᵀy` of a member, `[r]`.
    pub fn right(&self, member: usize) -> &[f64] {
        &self.rights[member * self.rank..(member + 1) * self.rank]
    }
}

/// The patterns of a window as its kernels see them, uncentred.
#[derive(Debug)]
pub(super) struct Projected {
    /// `[pattern, stride]`: the kernels' responses, then the mean function's.
    pub responses: Vec<f32>,
    /// Values a pattern has, at least `rank + 1`.
    pub stride: usize,
    /// Number of kernels.
    pub rank: usize,
    /// Whether all of the window lies on the display.
    pub whole: bool,
}

impl Projected {
    /// Responses of the kernels to pattern `l`.
    pub fn row(&self, l: usize) -> &[f32] {
        &self.responses[l * self.stride..l * self.stride + self.rank]
    }

    /// Response of the mean light transport function to pattern `l`.
    pub fn mean(&self, l: usize) -> f64 {
        f64::from(self.responses[l * self.stride + self.rank])
    }
}

/// The patterns of `rows` that say something of a channel of a pixel: those that do not saturate it.
/// Of one saturated nearly always all that is known is that it is at least white, which all say.
#[inline(always)]
fn usable(measurements: &Measurements, rows: &[usize], pixel: CameraPx, c: usize) -> Vec<usize> {
    let finite = |l: &usize| measurements.sample(*l, pixel, c).is_finite();
    let usable: Vec<usize> = rows.iter().copied().filter(finite).collect();
    match usable.len() < MIN_PATTERNS {
        true => rows.to_vec(),
        false => usable,
    }
}

/// What one window's equations are made from.
struct Fill<'a> {
    measurements: &'a Measurements,
    geometry: &'a Geometry,
    projected: &'a Projected,
    rows: &'a [usize],
    /// What each pattern counts for, `[pattern]`.
    weights: &'a [f64],
}

/// Centred kernels' responses for one set of patterns, times what the patterns count for.
struct Centred<'a> {
    rows: Vec<usize>,
    /// `[rows]`, and the sum of their squares.
    weights: Vec<f64>,
    total: f64,
    /// `[r, rows]`: a kernel's responses in one run.
    columns: Vec<f64>,
    /// `[r]`.
    mean: Vec<f64>,
    /// Mean response of the mean function.
    profile: f64,
    gram: usize,
    projected: &'a Projected,
}

impl<'a> Fill<'a> {
    #[inline(always)]
    fn window(
        &self,
        equations: &mut Equations,
        pixels: &[(usize, CameraPx)],
        channels: Range<usize>,
    ) {
        let mut shared: Vec<Centred<'a>> = Vec::new();
        for &(p, pixel) in pixels {
            for c in channels.clone() {
                let rows = usable(self.measurements, self.rows, pixel, c);
                let y = rows.iter().map(|&l| {
                    let y = self.measurements.sample(l, pixel, c);
                    match y.is_finite() {
                        true => y,
                        false => f64::from(self.measurements.full_scale[l]),
                    }
                });
                let y: Vec<f64> = y.collect();
                let known = shared.iter().position(|centred| centred.rows == rows);
                let at = known.unwrap_or_else(|| {
                    shared.push(self.centre(equations, rows));
                    shared.len() - 1
                });
                self.member(equations, &shared[at], p * CHANNELS + c, (pixel, c), &y);
            }
        }
    }

    #[inline(always)]
    fn centre(&self, equations: &mut Equations, rows: Vec<usize>) -> Centred<'a> {
        let (rank, count) = (self.projected.rank, rows.len());
        let mut columns = vec![0.0; rank * count];
        for (i, &l) in rows.iter().enumerate() {
            for (k, &b) in self.projected.row(l).iter().enumerate() {
                columns[k * count + i] = f64::from(b);
            }
        }
        let weights: Vec<f64> = rows.iter().map(|&l| self.weights[l]).collect();
        let total = weights.iter().map(|w| w * w).sum::<f64>();
        let mut mean = Vec::with_capacity(rank);
        for column in columns.chunks_exact_mut(count.max(1)) {
            let of = |(b, w): (&f64, &f64)| w * w * b;
            let m = column.iter().zip(&weights).map(of).sum::<f64>() / total;
            let column = column.iter_mut().zip(&weights);
            column.for_each(|(b, w)| *b = w * (*b - m));
            mean.push(m);
        }
        let weight = total * MEAN_WEIGHT * MEAN_WEIGHT;
        let mut gram = vec![0.0; rank * rank];
        for i in 0..rank {
            let a = &columns[i * count..(i + 1) * count];
            for j in i..rank {
                let b = &columns[j * count..(j + 1) * count];
                let value = dot(a, b) + weight * mean[i] * mean[j];
                gram[i * rank + j] = value;
                gram[j * rank + i] = value;
            }
        }
        equations.grams.push(gram);
        let profile = rows.iter().zip(&weights);
        let profile: f64 = profile.map(|(&l, w)| w * w * self.projected.mean(l)).sum();
        Centred {
            rows,
            weights,
            total,
            columns,
            mean,
            profile: profile / total,
            gram: equations.grams.len() - 1,
            projected: self.projected,
        }
    }

    #[inline(always)]
    fn member(
        &self,
        equations: &mut Equations,
        centred: &Centred<'_>,
        member: usize,
        (pixel, c): (CameraPx, usize),
        y: &[f64],
    ) {
        let (rank, count) = (centred.projected.rank, centred.rows.len());
        let (weights, total) = (&centred.weights, centred.total);
        let weighted: Vec<f64> = y.iter().zip(weights).map(|(y, w)| w * y).collect();
        let mean = dot(&weighted, weights) / total;
        let weight = total * MEAN_WEIGHT * MEAN_WEIGHT;
        let right = &mut equations.rights[member * rank..(member + 1) * rank];
        // Centred columns are orthogonal to the weights, so y need not be centred.
        for (k, column) in centred.columns.chunks_exact(count).enumerate() {
            right[k] = dot(column, &weighted) + weight * centred.mean[k] * mean;
        }
        let samples = || centred.rows.iter().zip(weights).zip(y);
        let variance = samples().map(|((&l, w), &y)| w * w * self.measurements.variance(l, c, y));
        let deviation = samples().map(|((_, w), y)| (w * (y - mean)).powi(2));
        let deviation = deviation.sum::<f64>();
        let scale = if centred.profile > 0.0 {
            mean / centred.profile
        } else {
            0.0
        };
        equations.members[member] = Member {
            gram: centred.gram,
            scale: scale.max(0.0),
            variance: (variance.sum::<f64>() / count as f64).max(LEAST_VARIANCE),
            power: deviation + weight * mean * mean,
            rows: count,
            phase: phase(self.geometry, pixel),
            whole: centred.projected.whole,
        };
    }
}

/// Variance below which no 16-bit photograph can go: its own rounding.
const LEAST_VARIANCE: f64 = 1.0 / (12.0 * 65536.0 * 65536.0);
