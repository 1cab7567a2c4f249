//! The Gaussian prior of one observation given its neighbours.
//!
//! Neighbouring pixels see the same pane of glass or the same dough: their posterior means predict this
//! pixel's coefficients z.
//!
//! ```text
//! z | neighbours ~ N(m, C),   m_k = w_k0 + Σ_j w_kj z_jk
//! ```
//!
//! with weights w for each class of observations (sub-element position and channel; [`neighbour_regression`]) and one covariance
//! C, `[r, r]`, of the prediction error. The prediction fails at an edge of the object. Therefore the prior is a
//! mixture: with probability π this one, else the pixel prior. By Bayes' rule an observation's measurements y give it
//! the responsibility q:
//!
//! ```text
//! ln q/(1 − q) = ln π/(1 − π) + ln p(y | neighbours) − ln p(y | pixel prior)
//! ```
//!
//! Expectation–maximisation learns C, π and w: C = Σ q ((ẑ − m)(ẑ − m)ᵀ + P) / Σ q with the posterior mean ẑ and
//! covariance P, π the mean of q, and w the regression of ẑ on the neighbours.
//!
//! [`neighbour_regression`]: super::neighbour_regression

use std::slice::from_mut;

use serde::{Deserialize, Serialize};

use super::equations::PHASES;
use super::neighbour_regression::{RegressionSums, solve_regressions};
use super::posterior::{PosteriorSolver, PriorPrecision, SecondMoment};
use super::posterior_means::{PREDICTORS, PixelObservationPosition, PosteriorMeans};
use super::prior::Prior;
use crate::job_executor::{Cancelled, Executor, Sums};
use crate::linalg::{self, add_products, add_scaled, vectorise};
use crate::recover::partition::Partition;
use crate::transport::CHANNELS;

/// EM iterations from the first estimate, and from a prior that was learned from most of the same measurements.
const EM_ITERATIONS: usize = 3;
const EM_ITERATIONS_WARM: usize = 2;
/// Share of the pixel posterior's variance in the first estimate of C, and the observations, one in so many, whose
/// posterior variance is computed for it.
const POSTERIOR_VARIANCE_SHARE: f64 = 0.5;
const VARIANCE_SAMPLING: usize = 64;
/// Range of π.
const MIXING_SHARE_RANGE: [f64; 2] = [0.01, 0.99];
/// Observations for each weight of a regression, at least, for anything to be learned.
const MIN_OBSERVATIONS_PER_WEIGHT: usize = 4;

/// Classes of observations with regressions of their own.
const CLASSES: usize = PHASES * CHANNELS;

fn class(region: &PosteriorMeans<'_>, location: PixelObservationPosition) -> usize {
    region.equations.observations[location.index].phase * CHANNELS + location.channel
}

#[derive(Clone, Debug, Serialize, Deserialize)]
pub(super) struct NeighbourPrior {
    rank: usize,
    /// w, `[phase, channel][predictor, r]`, first the constant.
    weights: Vec<Vec<f64>>,
    /// C⁻¹.
    precision: PriorPrecision,
    /// π.
    mixing_share: f64,
}

/// Sufficient statistics of one E step.
#[derive(Debug)]
struct NeighbourStatistics {
    /// Σ z_jk ẑ_k by class, `[predictor, r]`.
    right_hand_sides: Vec<Vec<f64>>,
    /// Σ q ((ẑ − m)(ẑ − m)ᵀ + P).
    second_moment: SecondMoment,
    /// Σ q.
    responsibility: f64,
    count: f64,
}

impl NeighbourPrior {
    /// Learns from the bright observations in the interiors of `regions`, starting from `start` if there is one; `None`
    /// if they are too few.
    ///
    /// # Errors
    /// [`Cancelled`].
    pub async fn learn(
        regions: &Partition<PosteriorMeans<'_>>,
        prior: &Prior,
        start: Option<Self>,
        executor: &impl Executor,
    ) -> Result<Option<Self>, Cancelled> {
        let rank = prior.rank;
        let add_part = |part: usize, sums: &mut Vec<RegressionSums>| {
            for region in regions.part(part) {
                vectorise(
                    #[inline(always)]
                    || {
                        for location in region.bright_locations() {
                            let target = region.mean(location.index);
                            sums[class(region, location)].add(region, location, target);
                        }
                    },
                );
            }
        };
        let sums = executor.all_reduce(|| vec![RegressionSums::new(rank); CLASSES], add_part);
        let sums = sums.await?;
        let count: f64 = sums.iter().map(RegressionSums::count).sum();
        if count < (MIN_OBSERVATIONS_PER_WEIGHT * PREDICTORS * CLASSES) as f64 {
            return Ok(None);
        }
        let factors = executor.map(CLASSES, |i| sums[i].cholesky_factors());
        let solve = |right_hand_sides: &[Vec<f64>]| {
            let solve = |i: usize| solve_regressions(&factors[i], &right_hand_sides[i], rank);
            executor.map(CLASSES, solve)
        };
        let (mut learned, iterations) = match start {
            Some(start) => (start, EM_ITERATIONS_WARM),
            None => {
                let sides: Vec<_> = sums.iter().map(|s| s.right_hand_side.clone()).collect();
                let mut first = Self {
                    rank,
                    weights: solve(&sides),
                    precision: prior.precision.clone(),
                    mixing_share: 0.5,
                };
                first.precision = first.initial_precision(regions, prior, executor).await?;
                (first, EM_ITERATIONS)
            }
        };
        for _ in 0..iterations {
            let expectation = learned.expectation(regions, prior.noise_factor, executor);
            let statistics = expectation.await?;
            let [low, high] = MIXING_SHARE_RANGE;
            let share = statistics.responsibility / statistics.count.max(1.0);
            learned.mixing_share = share.clamp(low, high);
            let mut covariance = statistics.second_moment.sum();
            let responsibility = statistics.responsibility.max(1.0);
            covariance.iter_mut().for_each(|c| *c /= responsibility);
            linalg::mirror_upper(&mut covariance, rank);
            learned.precision = PriorPrecision::new(&covariance, rank);
            learned.weights = solve(&statistics.right_hand_sides);
        }
        Ok(Some(learned))
    }

    /// The first estimate of C⁻¹: from the prediction errors of the posterior means, and part of the variance that these
    /// means have themselves.
    async fn initial_precision(
        &self,
        regions: &Partition<PosteriorMeans<'_>>,
        prior: &Prior,
        executor: &impl Executor,
    ) -> Result<PriorPrecision, Cancelled> {
        let rank = self.rank;
        let add_part = |part: usize, sums: &mut PredictionErrors| {
            let mut solver = PosteriorSolver::new(rank);
            for region in regions.part(part) {
                vectorise(
                    #[inline(always)]
                    || self.add_prediction_errors(region, prior, &mut solver, sums),
                );
            }
        };
        let sums = executor.all_reduce(|| PredictionErrors::new(rank), add_part);
        let sums = sums.await?;
        let mut covariance = sums.outer;
        covariance
            .iter_mut()
            .for_each(|c| *c /= sums.count.max(1.0));
        for k in 0..rank {
            let mean_variance = sums.variance[k] / sums.sampled.max(1.0);
            covariance[k * rank + k] += POSTERIOR_VARIANCE_SHARE * mean_variance;
        }
        linalg::mirror_upper(&mut covariance, rank);
        Ok(PriorPrecision::new(&covariance, rank))
    }

    #[inline(always)]
    fn add_prediction_errors(
        &self,
        region: &PosteriorMeans<'_>,
        prior: &Prior,
        solver: &mut PosteriorSolver,
        sums: &mut PredictionErrors,
    ) {
        let rank = self.rank;
        for (i, location) in region.interior_locations().enumerate() {
            let index = location.index;
            if !region.is_reliable[index] {
                continue;
            }
            let mean = self.predict(region, location);
            let errors = region.mean(index).iter().zip(mean);
            let error: Vec<f64> = errors.map(|(z, m)| z - m).collect();
            for (row, k) in sums.outer.chunks_exact_mut(rank).zip(0..) {
                add_scaled(&mut row[k..], error[k], &error[k..]);
            }
            sums.count += 1.0;
            if i % VARIANCE_SAMPLING == 0 {
                prior.infer(region.equations, index, solver);
                solver.compute_covariance();
                (0..rank).for_each(|k| sums.variance[k] += solver.covariance[k * rank + k]);
                sums.sampled += 1.0;
            }
        }
    }

    /// m, the prediction of an observation from its neighbours.
    #[inline(always)]
    fn predict(&self, means: &PosteriorMeans<'_>, location: PixelObservationPosition) -> Vec<f64> {
        let rank = self.rank;
        let weights = &self.weights[class(means, location)];
        let mut mean = vec![0.0; rank];
        for (j, z) in means.predictors(location) {
            add_products(&mut mean, &weights[j * rank..][..rank], z);
        }
        mean
    }

    /// Leaves the posterior of an observation in `solver`; returns its responsibility q and its prediction m.
    #[inline(always)]
    pub fn infer(
        &self,
        means: &PosteriorMeans<'_>,
        noise: f64,
        location: PixelObservationPosition,
        solver: &mut PosteriorSolver,
    ) -> (f64, Vec<f64>) {
        let index = location.index;
        let mean = self.predict(means, location);
        let log_evidence = solver.infer(means.equations, index, noise, &self.precision, &mean);
        let prior_log_odds = libm::log(self.mixing_share / (1.0 - self.mixing_share));
        let log_odds = prior_log_odds + log_evidence - means.log_evidence[index];
        (1.0 / (1.0 + libm::exp(-log_odds)), mean)
    }

    async fn expectation(
        &self,
        regions: &Partition<PosteriorMeans<'_>>,
        noise: f64,
        executor: &impl Executor,
    ) -> Result<NeighbourStatistics, Cancelled> {
        let add_part = |part: usize, sums: &mut NeighbourStatistics| {
            for region in regions.part(part) {
                vectorise(
                    #[inline(always)]
                    || self.add_region(region, noise, sums),
                );
            }
        };
        let zeros = || NeighbourStatistics::new(self.rank);
        executor.all_reduce(zeros, add_part).await
    }

    #[inline(always)]
    fn add_region(&self, region: &PosteriorMeans<'_>, noise: f64, sums: &mut NeighbourStatistics) {
        let rank = self.rank;
        let mut solver = PosteriorSolver::new(rank);
        for location in region.bright_locations() {
            let (q, mean) = self.infer(region, noise, location, &mut solver);
            let errors = solver.mean.iter().zip(mean);
            let error: Vec<f64> = errors.map(|(z, m)| z - m).collect();
            sums.second_moment.add(&mut solver, q, &error);
            sums.responsibility += q;
            sums.count += 1.0;
            let sides = &mut sums.right_hand_sides[class(region, location)];
            for (j, z) in region.predictors(location) {
                add_products(&mut sides[j * rank..][..rank], z, &solver.mean);
            }
        }
    }
}

impl NeighbourStatistics {
    fn new(rank: usize) -> Self {
        Self {
            right_hand_sides: vec![vec![0.0; PREDICTORS * rank]; CLASSES],
            second_moment: SecondMoment::new(rank),
            responsibility: 0.0,
            count: 0.0,
        }
    }
}

impl Sums for NeighbourStatistics {
    fn visit(&mut self, visitor: &mut dyn FnMut(&mut [f64])) {
        self.right_hand_sides
            .iter_mut()
            .for_each(|side| visitor(side));
        self.second_moment.visit(visitor);
        visitor(from_mut(&mut self.responsibility));
        visitor(from_mut(&mut self.count));
    }
}

/// Sums over the errors of the neighbours' predictions, and over the pixel posterior's variances.
#[derive(Debug)]
struct PredictionErrors {
    /// Σ (ẑ − m)(ẑ − m)ᵀ, `[r, r]`, upper triangle.
    outer: Vec<f64>,
    count: f64,
    /// Σ of the diagonal of P over a sample, `[r]`.
    variance: Vec<f64>,
    sampled: f64,
}

impl PredictionErrors {
    fn new(rank: usize) -> Self {
        Self {
            outer: vec![0.0; rank * rank],
            count: 0.0,
            variance: vec![0.0; rank],
            sampled: 0.0,
        }
    }
}

impl Sums for PredictionErrors {
    fn visit(&mut self, visitor: &mut dyn FnMut(&mut [f64])) {
        visitor(&mut self.outer);
        visitor(&mut self.variance);
        visitor(from_mut(&mut self.count));
        visitor(from_mut(&mut self.sampled));
    }
}

#[cfg(test)]
mod tests {
    use super::super::tests::{normal, synthetic_equations};
    use super::*;
    use crate::job_executor::SequentialExecutor;
    use crate::transport::{Extent, TileRect};

    const SIDE: u32 = 40;
    /// The posterior variances of the components without a prior are 0.01 and 0.5; the prior's are 1.
    const GRAM_DIAGONAL: [f64; 2] = [1.0, 0.02];
    const VARIANCE: f64 = 0.01;
    const OUTLIERS: [(u32, u32); 3] = [(10, 10), (28, 13), (15, 30)];

    fn region(side: u32) -> TileRect {
        TileRect {
            x: 0,
            y: 0,
            extent: Extent::new(side, side),
        }
    }

    /// Smooth coefficients, `[pixel, channel, 2]`, but for outliers in the first channel.
    fn coefficients(rect: TileRect) -> Vec<f64> {
        let pixels = rect.pixels().flat_map(|pixel| {
            let (x, y) = (f64::from(pixel.x), f64::from(pixel.y));
            (0..CHANNELS).flat_map(move |c| {
                let phase = 0.4 * c as f64;
                let smooth = [(0.17 * x + phase).sin(), (0.13 * y - 0.1 * x + phase).cos()];
                match c == 0 && OUTLIERS.contains(&(pixel.x, pixel.y)) {
                    true => smooth.map(|z| z - 2.0 * z.signum()),
                    false => smooth,
                }
            })
        });
        pixels.collect()
    }

    fn learn(means: PosteriorMeans<'_>, prior: &Prior) -> Option<NeighbourPrior> {
        let means = Partition::single(means);
        let learned = NeighbourPrior::learn(&means, prior, None, &SequentialExecutor);
        pollster::block_on(learned).unwrap()
    }

    fn unit_prior() -> Prior {
        Prior::new(&[0.0; 2], vec![1.0, 0.0, 0.0, 1.0])
    }

    #[test]
    fn neighbours_determine_what_a_pixel_measures_poorly() {
        let rect = region(SIDE);
        let z = coefficients(rect);
        let equations = synthetic_equations(rect, &GRAM_DIAGONAL, &z, VARIANCE, normal());
        let prior = unit_prior();
        let means = || PosteriorMeans::new(&equations, rect, &prior, &[0.0; 3]);
        let learned = learn(means(), &prior).unwrap();
        let means = [means()];

        let mut solver = PosteriorSolver::new(2);
        let mut errors = [0.0; 2];
        let (mut smooth, mut outliers) = (Vec::new(), Vec::new());
        for (location, pixel) in means[0]
            .interior_locations()
            .zip(rect.pixels().flat_map(|pixel| [pixel; CHANNELS]))
        {
            let factor = prior.noise_factor;
            let (q, _) = learned.infer(&means[0], factor, location, &mut solver);
            match location.channel == 0 && OUTLIERS.contains(&(pixel.x, pixel.y)) {
                true => outliers.push(q),
                false => {
                    smooth.push(q);
                    let truth = z[location.index * 2 + 1];
                    let alone = means[0].mean(location.index)[1];
                    errors[0] += (q * solver.mean[1] + (1.0 - q) * alone - truth).powi(2);
                    errors[1] += (alone - truth).powi(2);
                }
            }
        }
        assert!(errors[0] < 0.5 * errors[1], "squared errors {errors:?}");
        let average = smooth.iter().sum::<f64>() / smooth.len() as f64;
        assert!(average > 0.9, "responsibility {average} of smooth pixels");
        assert!(outliers.iter().all(|&q| q < 0.01), "{outliers:?}");
    }

    #[test]
    fn too_few_observations_give_no_neighbour_prior() {
        let prior = unit_prior();
        // Dark observations do not count.
        for (side, threshold) in [(16, 0.0), (SIDE, 2.0)] {
            let rect = region(side);
            let z = coefficients(rect);
            let equations = synthetic_equations(rect, &GRAM_DIAGONAL, &z, VARIANCE, normal());
            let means = PosteriorMeans::new(&equations, rect, &prior, &[threshold; 3]);
            assert!(learn(means, &prior).is_none());
        }
    }
}
