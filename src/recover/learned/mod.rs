//! Recovery with a prior that the measurements themselves teach.
//!
//! 80 patterns are far fewer than the elements of a window, so that a pixel's own measurements leave
//! most of its light transport function open. But the functions of one object are alike, and each
//! pixel sees another random projection of its own: together they tell what such functions look
//! like. Scaled by the pixel's brightness `f`, a function is a combination `V z` of a few kernels,
//! and `z` is Gaussian, its mean and covariance learned from the compressive measurements by
//! expectation–maximisation ([`prior`]); then again given the pixel's neighbours ([`context`]). The
//! posterior mean is a closed form, and its coefficients `f z` over the kernels are a factored tile
//! as they are.
//!
//! How many kernels, whether neighbours help, and where the paper's least squares does better, are
//! decided on patterns held out.

mod context;
mod equations;
mod kernels;
mod nonnegative;
mod posterior;
mod prior;
mod start;
#[cfg(test)]
mod tests;

use context::{Context, Field, Patch, REACH};
use equations::Equations;
use kernels::Kernels;
use nonnegative::NonNegative;
use prior::{Prior, Threshold};

use super::holdout::HoldoutSplit;
use super::pixelwise::{PixelwiseRecovery, held_out_residuals};
use super::pooled;
use super::sampling::{pixels_by_window, spread_squares};
use super::{CommonMode, RecoverError};
use crate::capture::Measurements;
use crate::executor::Executor;
use crate::transport::{
    Basis, CHANNELS, Extent, FactoredTile, Geometry, RecoveredTile, TileRect, TransportFunctions,
    Window,
};

/// Ranks to choose from; each fills vector registers together with the mean function.
const RANKS: [usize; 3] = [23, 31, 47];
/// Share of the error on patterns held out by which more kernels may be worse than fewer. Most of
/// that error is noise, which tells little of kernels that 80 patterns hardly see; but what fewer
/// kernels cannot show is lost, and the prior keeps what is not seen of more from doing harm.
const NO_WORSE: f64 = 0.02;
/// Rounds of expectation–maximisation with all the kernels that learning starts with.
const ROUNDS: usize = 20;
/// Patches that neighbours' part is learned from, and their side in pixels.
const PATCHES: (usize, u32) = (64, 16);
/// Bytes that the patches' Gram matrices may take: where windows are many, or saturated samples leave
/// pixels matrices of their own, there are fewer patches.
const PATCH_BYTES: usize = 144 << 20;
/// Fewest patches all the same.
const FEWEST_PATCHES: usize = 8;
/// Rounds of expectation–maximisation on the patches, with the kernels chosen.
const LATE_ROUNDS: usize = 2;
/// Share of the brightness that 5 % of the pixels exceed, below which nothing is learned of a pixel.
const DIM: f64 = 0.1;
/// Share of the error on patterns held out that blending with least squares must save in a tile to be
/// worth a direct one, which takes ten times the room of a factored one.
const LEAST_GAIN: f64 = 0.005;
/// The same over the patches, to be worth trying tile by tile, which takes twice the time.
const LEAST_GAIN_IN_ALL: f64 = 0.02;
/// Side of the part of a tile by which its blend is chosen.
const JUDGED: u32 = 16;
/// Side of the part of each patch by which it is chosen whether to try.
const GLANCED: u32 = 4;

/// What has been learned.
#[derive(Debug)]
pub(super) struct Learned {
    geometry: Geometry,
    kernels: Kernels,
    nonnegative: NonNegative,
    basis: Basis,
    prior: Prior,
    context: Option<Context>,
    threshold: Threshold,
    split: HoldoutSplit,
    /// Least squares, where it is worth trying tile by tile.
    direct: Option<PixelwiseRecovery>,
}

impl Learned {
    /// About the most memory that learning takes beside the measurements: the patches, what is said
    /// of them and the sums of the neighbours' regressions, or before that the samples' equations.
    pub fn preparation_bytes(window: Window) -> usize {
        // Where each pixel and channel is saturated in other photographs.
        let rank = start::KERNELS.min(window.area());
        let samples = pooled::MAX_SAMPLES * rank * rank * size_of::<f64>();
        samples.max(2 * PATCH_BYTES)
    }

    /// About the most memory that recovering a tile takes beside its functions, in bytes: Gram
    /// matrices, where each pixel and channel is saturated in other photographs.
    pub fn tile_bytes(window: Window) -> usize {
        let pixels = (Geometry::DEFAULT_TILE_SIDE as usize + 2 * REACH as usize).pow(2);
        let rank = Self::max_rank(window);
        pixels * CHANNELS * rank * rank * size_of::<f64>()
    }

    /// The most kernels there may be.
    pub fn max_rank(window: Window) -> usize {
        RANKS.into_iter().max().unwrap_or(0).min(window.area())
    }

    /// Learns from all of `measurements`, whose patterns are `split`; starts from their
    /// [mean function](pooled::mean_function).
    pub fn new(
        measurements: &Measurements,
        geometry: Geometry,
        split: HoldoutSplit,
        mean_function: &[f64],
        executor: &impl Executor,
    ) -> Result<Self, RecoverError> {
        let area = geometry.window.area();
        let squares = pooled::sample_squares(measurements);
        let mean = start::blur(mean_function, geometry.window.side() as usize);
        let (functions, mut prior) =
            start::first_prior(&mean, geometry.window.side() as usize, executor);
        let kernels = Kernels::new(&functions, &mean);
        let equations = |kernels: &Kernels, rows: &[usize], rects: &[TileRect]| {
            executor.map(rects.len(), |i| {
                Equations::new(measurements, &geometry, kernels, rows, rects[i])
            })
        };
        let samples = equations(&kernels, &split.training, &squares);
        let threshold = threshold(&samples);
        for _ in 0..ROUNDS {
            executor.check_cancelled()?;
            prior.improve(&samples, &threshold, executor);
        }
        drop(samples);

        // How many kernels.
        let mut chosen: Option<(f64, Learned)> = None;
        // A small window has room for fewer.
        let mut ranks = RANKS.map(|rank| rank.min(prior.rank)).to_vec();
        ranks.dedup();
        for rank in ranks {
            executor.check_cancelled()?;
            let (functions, prior) = start::cut(&functions, &prior, rank, area);
            let kernels = Kernels::new(&functions, &mean);
            let learned = Self {
                geometry,
                basis: kernels.basis(),
                nonnegative: NonNegative::new(&kernels),
                kernels,
                prior,
                context: None,
                threshold,
                split: split.clone(),
                direct: None,
            };
            let error = learned.held_out_error(measurements, &squares, executor);
            let least = chosen.as_ref().map_or(error, |(least, _)| least.min(error));
            if error <= (1.0 + NO_WORSE) * least {
                chosen = Some((least, learned));
            }
        }
        let (_, mut learned) = chosen.ok_or(RecoverError::NoSignal)?;

        // What neighbours tell, and whether it helps.
        executor.check_cancelled()?;
        let inner = learned.patches(measurements, &split.all, executor);
        learned.learn_context(measurements, &split.training, &inner, executor);
        if !split.held_out.is_empty() {
            let with = learned.held_out_error(measurements, &inner, executor);
            let context = learned.context.take();
            let without = learned.held_out_error(measurements, &inner, executor);
            let helps = context.is_some() && with < without;
            if helps {
                learned.context = context;
            }
            executor.check_cancelled()?;
            learned.direct = learned.rival(measurements, &inner, executor)?;
            // All is chosen: every pattern may teach.
            executor.check_cancelled()?;
            learned.learn_context(measurements, &split.all, &inner, executor);
            if !helps {
                learned.context = None;
            }
        }
        Ok(learned)
    }

    /// Number of kernels, `r`.
    pub fn rank(&self) -> usize {
        self.kernels.rank()
    }

    /// The kernels, orthonormal.
    pub fn basis(&self) -> &Basis {
        &self.basis
    }

    /// Weight of the patterns' common mode in the least squares that tiles are blended with, if any.
    pub fn common_mode(&self) -> Option<CommonMode> {
        self.direct.as_ref().map(PixelwiseRecovery::common_mode)
    }

    /// The most camera pixels around a tile whose measurements may go into it.
    pub const MAX_HALO: u32 = REACH as u32;

    /// Camera pixels around a tile whose measurements go into it.
    pub fn halo(&self) -> u32 {
        if self.context.is_some() {
            Self::MAX_HALO
        } else {
            0
        }
    }

    /// Recovers one tile.
    pub fn tile(&self, measurements: &Measurements, rect: TileRect) -> RecoveredTile {
        let tile = self.factored(measurements, &self.split.all, rect);
        let Some(direct) = &self.direct else {
            return RecoveredTile::Factored(tile);
        };
        // The prior has been taught by the patterns held out as well, but has few numbers to fit to
        // them; what a pixel's own measurements say comes from the others alone.
        let share = self
            .compare(measurements, direct, part(rect, JUDGED))
            .best_share(LEAST_GAIN);
        if share == 0.0 {
            return RecoveredTile::Factored(tile);
        }
        let mut functions = tile.expand(&self.geometry, &self.basis);
        let theirs = direct.tile(measurements, rect);
        blend(&mut functions, &theirs, share);
        RecoveredTile::Direct(functions)
    }

    /// What [`tile`](Self::tile) would be without the patterns held out, all of `rect` blended alike.
    pub fn training_tile(&self, measurements: &Measurements, rect: TileRect) -> RecoveredTile {
        let ours = self.factored(measurements, &self.split.training, rect);
        let Some(direct) = &self.direct else {
            return RecoveredTile::Factored(ours);
        };
        let mut functions = ours.expand(&self.geometry, &self.basis);
        let theirs = direct.tile_from(measurements, &self.split.training, rect);
        let share = self
            .comparison(measurements, &functions, &theirs)
            .best_share(LEAST_GAIN);
        if share == 0.0 {
            return RecoveredTile::Factored(ours);
        }
        blend(&mut functions, &theirs, share);
        RecoveredTile::Direct(functions)
    }

    /// The prior's answer for one tile from the patterns `rows`.
    fn factored(
        &self,
        measurements: &Measurements,
        rows: &[usize],
        rect: TileRect,
    ) -> FactoredTile {
        FactoredTile {
            rect,
            coefficients: self.solve(measurements, rows, rect),
        }
    }

    /// The patches, as many as there is memory for, without the pixels around them.
    fn patches(
        &self,
        measurements: &Measurements,
        rows: &[usize],
        executor: &impl Executor,
    ) -> Vec<TileRect> {
        let patches = spread_squares(measurements, PATCHES.1, PATCHES.0);
        let grams = executor.map(patches.len(), |i| {
            let rect = grown(measurements, patches[i], REACH as u32);
            Equations::count_grams(measurements, &self.geometry, rows, rect)
        });
        let grams: usize = grams.iter().sum();
        let bytes = grams * self.rank() * self.rank() * size_of::<f64>();
        match bytes <= PATCH_BYTES {
            true => patches,
            false => {
                let fit = PATCH_BYTES / (bytes / patches.len()).max(1);
                spread_squares(measurements, PATCHES.1, fit.max(FEWEST_PATCHES))
            }
        }
    }

    /// Learns the late rounds of the prior, and the neighbours' part, from the patterns `rows`.
    fn learn_context(
        &mut self,
        measurements: &Measurements,
        rows: &[usize],
        inner: &[TileRect],
        executor: &impl Executor,
    ) {
        let equations = executor.map(inner.len(), |i| {
            let rect = grown(measurements, inner[i], REACH as u32);
            Equations::new(measurements, &self.geometry, &self.kernels, rows, rect)
        });
        for _ in 0..LATE_ROUNDS {
            self.prior.improve(&equations, &self.threshold, executor);
        }
        let fields = executor.map(equations.len(), |i| {
            Field::new(&equations[i], &self.prior, &self.threshold)
        });
        let parts = equations.into_iter().zip(fields).zip(inner);
        let patches: Vec<Patch> = parts
            .map(|((equations, field), &inner)| Patch {
                equations,
                field,
                inner,
            })
            .collect();
        self.context = Context::learn(&patches, &self.prior, &self.threshold, executor);
    }

    /// Coefficients `f z` of `rect` from the patterns `rows`, `[pixel, component]`.
    fn solve(
        &self,
        measurements: &Measurements,
        rows: &[usize],
        rect: TileRect,
    ) -> Vec<[f32; CHANNELS]> {
        let region = grown(measurements, rect, self.halo());
        let equations = Equations::new(measurements, &self.geometry, &self.kernels, rows, region);
        let field = Field::new(&equations, &self.prior, &self.threshold);
        let patch = Patch {
            equations,
            field,
            inner: rect,
        };
        let rank = self.rank();
        let z = match &self.context {
            Some(context) => context.refine(&patch, self.prior.noise, &self.nonnegative),
            None => patch.field.refine(&patch, &self.prior, &self.nonnegative),
        };
        let mut coefficients = vec![[0.0f32; CHANNELS]; rect.extent.area() * rank];
        for (p, pixel) in rect.pixels().enumerate() {
            let there = (pixel.y - region.y) * region.extent.width + pixel.x - region.x;
            for c in 0..CHANNELS {
                let member = there as usize * CHANNELS + c;
                let scale = patch.equations.members[member].scale;
                let z = &z[(p * CHANNELS + c) * rank..(p * CHANNELS + c + 1) * rank];
                for (k, z) in z.iter().enumerate() {
                    coefficients[p * rank + k][c] = (scale * z) as f32;
                }
            }
        }
        coefficients
    }

    /// Squared error, over `rects`, of predicting the patterns held out.
    fn held_out_error(
        &self,
        measurements: &Measurements,
        rects: &[TileRect],
        executor: &impl Executor,
    ) -> f64 {
        let errors = executor.map(rects.len(), |i| {
            let misses = self.misses(measurements, rects[i]);
            let seen = misses.iter().filter(|miss| miss.is_finite());
            seen.map(|miss| miss * miss).sum::<f64>()
        });
        errors.iter().sum()
    }

    /// What is missed, `[pixel, held, channel]`, in predicting the patterns held out from the others;
    /// NaN where saturated.
    fn misses(&self, measurements: &Measurements, rect: TileRect) -> Vec<f64> {
        let coefficients = self.solve(measurements, &self.split.training, rect);
        let (rank, held) = (self.rank(), self.split.held_out.len());
        let mut misses = vec![f64::NAN; rect.extent.area() * held * CHANNELS];
        for (origin, pixels) in pixels_by_window(&self.geometry, rect) {
            for (plane, channels) in measurements.planes() {
                let projected = self
                    .kernels
                    .project(measurements, &self.geometry, origin, plane);
                for &(p, pixel) in &pixels {
                    let coefficients = &coefficients[p * rank..(p + 1) * rank];
                    for (i, &l) in self.split.held_out.iter().enumerate() {
                        for c in channels.clone() {
                            let row = projected.row(l).iter().zip(coefficients);
                            let y: f64 = row.map(|(b, z)| f64::from(b * z[c])).sum();
                            misses[(p * held + i) * CHANNELS + c] =
                                measurements.sample(l, pixel, c) - y;
                        }
                    }
                }
            }
        }
        misses
    }

    /// The learned prior and least squares on the patterns held out, on one tile.
    fn compare(
        &self,
        measurements: &Measurements,
        direct: &PixelwiseRecovery,
        rect: TileRect,
    ) -> Comparison {
        let ours = self.factored(measurements, &self.split.training, rect);
        let ours = ours.expand(&self.geometry, &self.basis);
        let theirs = direct.tile_from(measurements, &self.split.training, rect);
        self.comparison(measurements, &ours, &theirs)
    }

    /// What two methods' functions, from the patterns not held out, miss of those that are.
    fn comparison(
        &self,
        measurements: &Measurements,
        ours: &TransportFunctions,
        theirs: &TransportFunctions,
    ) -> Comparison {
        let [ours, theirs] = [ours, theirs].map(|functions| {
            held_out_residuals(
                &self.geometry,
                measurements,
                &self.split.held_out,
                functions,
            )
        });
        let mut comparison = Comparison::default();
        for (a, b) in ours.into_iter().zip(theirs) {
            if a.is_finite() && b.is_finite() {
                comparison.ours += a * a;
                comparison.both += a * b;
                comparison.theirs += b * b;
            }
        }
        comparison
    }

    /// Least squares, if blending with it helps over the whole picture.
    fn rival(
        &self,
        measurements: &Measurements,
        rects: &[TileRect],
        executor: &impl Executor,
    ) -> Result<Option<PixelwiseRecovery>, RecoverError> {
        let direct =
            PixelwiseRecovery::least_squares(measurements, self.geometry, &self.split, executor)?;
        let parts = executor.map(rects.len(), |i| {
            self.compare(measurements, &direct, part(rects[i], GLANCED))
        });
        let mut total = Comparison::default();
        for part in parts {
            total.ours += part.ours;
            total.both += part.both;
            total.theirs += part.theirs;
        }
        Ok((total.best_share(LEAST_GAIN_IN_ALL) > 0.0).then_some(direct))
    }
}

/// Takes functions a `share` of the way to others.
fn blend(functions: &mut TransportFunctions, theirs: &TransportFunctions, share: f32) {
    for (tau, theirs) in functions.tau.iter_mut().zip(&theirs.tau) {
        for c in 0..CHANNELS {
            tau[c] += share * (theirs[c] - tau[c]);
        }
    }
}

/// Inner products of what two methods miss on the patterns held out.
#[derive(Clone, Copy, Debug, Default)]
struct Comparison {
    ours: f64,
    both: f64,
    theirs: f64,
}

impl Comparison {
    /// Share of their functions in the blend with ours that misses least; 0 if that saves a smaller
    /// share of what ours miss than `least`.
    ///
    /// Where the transport is sparse and each function a case of its own, least squares knows what a
    /// Gaussian prior does not, that no light is negative; their errors differ, and a blend of both
    /// is better than either.
    fn best_share(self, least: f64) -> f32 {
        let apart = self.ours - 2.0 * self.both + self.theirs;
        if apart.is_nan() || apart <= 0.0 {
            return 0.0;
        }
        let share = ((self.ours - self.both) / apart).clamp(0.0, 1.0);
        let saved = share * (2.0 * (self.ours - self.both) - share * apart);
        match saved > least * self.ours {
            true => share as f32,
            false => 0.0,
        }
    }
}

/// At most `side²` pixels from the middle of a rectangle.
fn part(rect: TileRect, side: u32) -> TileRect {
    let extent = Extent {
        width: rect.extent.width.min(side),
        height: rect.extent.height.min(side),
    };
    TileRect {
        x: rect.x + (rect.extent.width - extent.width) / 2,
        y: rect.y + (rect.extent.height - extent.height) / 2,
        extent,
    }
}

/// `rect` with `by` more pixels all around, as far as the picture goes and is at hand.
fn grown(measurements: &Measurements, rect: TileRect, by: u32) -> TileRect {
    let camera = measurements.camera;
    let (right, bottom) = (rect.x + rect.extent.width, rect.y + rect.extent.height);
    let at_hand = |y: &u32| measurements.rows.place(*y).is_some();
    let x = rect.x.saturating_sub(by);
    let y = rect.y
        - (1..=by.min(rect.y))
            .take_while(|d| at_hand(&(rect.y - d)))
            .count() as u32;
    let below = (bottom..camera.height.min(bottom + by)).take_while(at_hand);
    TileRect {
        x,
        y,
        extent: Extent {
            width: (right + by).min(camera.width) - x,
            height: bottom + below.count() as u32 - y,
        },
    }
}

/// Brightness below which a pixel is not learned from, by channel.
fn threshold(samples: &[Equations]) -> Threshold {
    std::array::from_fn(|c| {
        let members = samples
            .iter()
            .flat_map(|s| s.members.iter().skip(c).step_by(CHANNELS));
        let mut scales: Vec<f64> = members.map(|m| m.scale).collect();
        scales.sort_by(f64::total_cmp);
        let top = scales.get(scales.len() * 95 / 100);
        DIM * top.copied().unwrap_or(0.0)
    })
}
