//! The pixel prior: the distribution of one observation's coefficients, without its neighbours.
//!
//! z ~ N(m_p, C), with a mean for each sub-element position p and one covariance, `[r, r]`.
//! Expectation–maximisation (EM) learns both from compressive measurements:
//!
//! - E step: posterior mean ẑ and covariance P of every bright observation ([`posterior`](super::posterior));
//! - M step: m_p = mean of ẑ, C = mean of (ẑ − m_p)(ẑ − m_p)ᵀ + P. Without P, C shrinks with each iteration.
//!
//! EM takes many iterations where patterns determine a direction poorly. A step of k repeats the change of C k times,
//! which goes as far there as k iterations:
//!
//! ```text
//! C ← (C' C⁻¹)ᵏ⁻¹ C',   m ← m + k (m' − m),   C', m' from the M step
//! ```
//!
//! and keeps C positive definite (after the adaptive overrelaxation of Salakhutdinov and Roweis, 2003). Directions that
//! patterns determine well overshoot, so that steps of 1 come between.
//!
//! The noise factor, E‖y − f B z‖² over its expected value, absorbs what the basis cannot represent.

use std::slice::from_mut;

use serde::{Deserialize, Serialize};

use super::equations::{MinReliableBrightness, ObservationEquations, PHASES};
use super::posterior::{PosteriorSolver, PriorPrecision, SecondMoment};
use super::training_equations::TrainingEquations;
use crate::job_executor::{Cancelled, Executor, Sums, add};
use crate::linalg::{self, add_scaled, vectorise};

/// Weight of the pooled mean in the mean of a sub-element position, in observations.
const POOLED_MEAN_WEIGHT: f64 = 20.0;
const MIN_NOISE_FACTOR: f64 = 0.1;

#[derive(Clone, Debug, Serialize, Deserialize)]
pub(super) struct Prior {
    pub rank: usize,
    /// m, `[PHASES][r]`.
    pub means: Vec<Vec<f64>>,
    /// C, `[r, r]`.
    pub covariance: Vec<f64>,
    /// C⁻¹.
    pub precision: PriorPrecision,
    /// Ratio of the residuals' variance to the estimated noise variance.
    pub noise_factor: f64,
}

/// Sufficient statistics of one E step.
#[derive(Debug)]
struct EStepStatistics {
    /// Observations by sub-element position.
    counts: [f64; PHASES],
    /// Σ ẑ by sub-element position.
    sums: Vec<Vec<f64>>,
    /// Σ ẑẑᵀ + P.
    second_moment: SecondMoment,
    /// Σ ‖y − f B ẑ‖² / σ².
    squared_residual: f64,
    /// Σ E‖f B (z − ẑ)‖² / σ² over the sample of the second moment.
    predicted_variance: f64,
    measurements: f64,
}

impl Prior {
    /// A prior with one mean, `[r]`, for all sub-element positions and a covariance, `[r, r]`.
    pub fn new(mean: &[f64], covariance: Vec<f64>) -> Self {
        let rank = mean.len();
        Self {
            rank,
            means: vec![mean.to_vec(); PHASES],
            precision: PriorPrecision::new(&covariance, rank),
            covariance,
            noise_factor: 1.0,
        }
    }

    /// Infers observation `index` under this prior; see [`PosteriorSolver::infer`].
    #[inline(always)]
    pub fn infer(
        &self,
        equations: &ObservationEquations,
        index: usize,
        solver: &mut PosteriorSolver,
    ) -> f64 {
        let mean = &self.means[equations.observations[index].phase];
        solver.infer(equations, index, self.noise_factor, &self.precision, mean)
    }

    /// One iteration of EM over the bright observations of `training`, with a step of `step` times the M step.
    ///
    /// # Errors
    /// [`Cancelled`]; the prior then stays as it is.
    pub async fn em_iteration(
        &mut self,
        training: &TrainingEquations,
        min_brightness: &MinReliableBrightness,
        step: usize,
        executor: &impl Executor,
    ) -> Result<(), Cancelled> {
        let add_part = |part: usize, total: &mut EStepStatistics| {
            let regions = training.regions.part(part);
            let sums = executor.map(regions.len(), |i| {
                vectorise(
                    #[inline(always)]
                    || self.expectation(&regions[i], min_brightness, training.only_full_windows),
                )
            });
            sums.into_iter().for_each(|mut sums| add(total, &mut sums));
        };
        let total = executor.all_reduce(|| EStepStatistics::new(self.rank), add_part);
        let total = total.await?;
        self.maximisation(total, step);
        Ok(())
    }

    #[inline(always)]
    fn expectation(
        &self,
        region: &ObservationEquations,
        min_brightness: &MinReliableBrightness,
        only_full: bool,
    ) -> EStepStatistics {
        let mut sums = EStepStatistics::new(self.rank);
        let (mut solver, mut mean) = (PosteriorSolver::new(self.rank), vec![0.0; self.rank]);
        for (index, observation) in region.observations.iter().enumerate() {
            if !region.is_reliable(index, min_brightness)
                || only_full && !observation.has_full_window
            {
                continue;
            }
            self.infer(region, index, &mut solver);
            sums.counts[observation.phase] += 1.0;
            add_scaled(&mut sums.sums[observation.phase], 1.0, &solver.mean);
            sums.squared_residual += solver.squared_residual(region, index) / observation.variance;
            mean.copy_from_slice(&solver.mean);
            if sums.second_moment.add(&mut solver, 1.0, &mean) {
                sums.predicted_variance +=
                    solver.predicted_variance(region, index) / observation.variance;
            }
            sums.measurements += observation.count as f64;
        }
        sums
    }

    /// The M step. Without observations the prior stays as it is.
    fn maximisation(&mut self, statistics: EStepStatistics, step: usize) {
        let rank = self.rank;
        let count: f64 = statistics.counts.iter().sum();
        if count < 1.0 {
            return;
        }
        let pooled_mean: Vec<f64> = (0..rank)
            .map(|k| statistics.sums.iter().map(|sum| sum[k]).sum::<f64>() / count)
            .collect();
        let squared_residual = statistics.squared_residual
            + statistics.second_moment.sampling_ratio() * statistics.predicted_variance;
        let mut covariance = statistics.second_moment.sum();
        for (phase, sum) in statistics.sums.iter().enumerate() {
            let n = statistics.counts[phase];
            let mean: Vec<f64> = (0..rank)
                .map(|k| (sum[k] + POOLED_MEAN_WEIGHT * pooled_mean[k]) / (n + POOLED_MEAN_WEIGHT))
                .collect();
            for i in 0..rank {
                for j in i..rank {
                    // Σ (z − m)(z − m)ᵀ = Σ zzᵀ − s mᵀ − m sᵀ + n m mᵀ
                    covariance[i * rank + j] +=
                        n * mean[i] * mean[j] - sum[i] * mean[j] - mean[i] * sum[j];
                }
            }
            for (old, new) in self.means[phase].iter_mut().zip(mean) {
                *old += step as f64 * (new - *old);
            }
        }
        covariance.iter_mut().for_each(|c| *c /= count);
        linalg::mirror_upper(&mut covariance, rank);
        if step > 1 {
            let change = linalg::multiply(&covariance, &self.precision.matrix, rank, rank);
            for _ in 1..step {
                covariance = linalg::multiply(&change, &covariance, rank, rank);
                linalg::mirror_upper(&mut covariance, rank);
            }
        }
        self.precision = PriorPrecision::new(&covariance, rank);
        self.covariance = covariance;
        let factor = squared_residual / statistics.measurements;
        self.noise_factor = factor.max(MIN_NOISE_FACTOR);
    }
}

impl EStepStatistics {
    fn new(rank: usize) -> Self {
        Self {
            counts: [0.0; PHASES],
            sums: vec![vec![0.0; rank]; PHASES],
            second_moment: SecondMoment::new(rank),
            squared_residual: 0.0,
            predicted_variance: 0.0,
            measurements: 0.0,
        }
    }
}

impl Sums for EStepStatistics {
    fn visit(&mut self, visitor: &mut dyn FnMut(&mut [f64])) {
        visitor(&mut self.counts);
        self.sums.iter_mut().for_each(|sum| visitor(sum));
        self.second_moment.visit(visitor);
        visitor(from_mut(&mut self.squared_residual));
        visitor(from_mut(&mut self.predicted_variance));
        visitor(from_mut(&mut self.measurements));
    }
}

#[cfg(test)]
mod tests {
    use super::super::tests::{normal, synthetic_equations};
    use super::super::training::INITIAL_EM_STEPS;
    use super::*;
    use crate::job_executor::SequentialExecutor;
    use crate::transport::{CHANNELS, Extent, TileRect};

    const SIDE: u32 = 32;
    /// Patterns determine the first component well, and the last hardly.
    const GRAM_DIAGONAL: [f64; 3] = [1.0, 0.1, 0.01];
    const DEVIATIONS: [f64; 3] = [1.0, 0.5, 0.3];
    const VARIANCE: f64 = 0.01;

    /// The variances that EM learns with these steps.
    fn learn(steps: &[usize]) -> [f64; 3] {
        let rect = TileRect {
            x: 0,
            y: 0,
            extent: Extent::new(SIDE, SIDE),
        };
        let mut random = normal();
        let count = rect.extent.area() * CHANNELS;
        let z: Vec<f64> = (0..count)
            .flat_map(|_| DEVIATIONS.map(|deviation| deviation * random()))
            .collect();
        let mut equations = synthetic_equations(rect, &GRAM_DIAGONAL, &z, VARIANCE, random);
        for (i, observation) in equations.observations.iter_mut().enumerate() {
            let right = &equations.right_hand_sides[3 * i..3 * (i + 1)];
            let squares = right.iter().zip(GRAM_DIAGONAL).map(|(b, g)| b * b / g);
            observation.energy = squares.sum();
        }
        let training = TrainingEquations::of_region(equations);
        let mut prior = Prior::new(&[0.0; 3], vec![1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0]);
        for &step in steps {
            let iteration =
                prior.em_iteration(&training, &[0.0; CHANNELS], step, &SequentialExecutor);
            pollster::block_on(iteration).unwrap();
        }
        std::array::from_fn(|k| prior.covariance[4 * k])
    }

    #[test]
    fn long_steps_go_farther_to_the_same_limit() {
        let limit = learn(&[1; 300]);
        let distances = |steps: &[usize]| -> [f64; 3] {
            let variances = learn(steps);
            std::array::from_fn(|k| (variances[k] / limit[k]).ln().abs())
        };
        let long = distances(&INITIAL_EM_STEPS);
        assert!(long.iter().all(|&distance| distance < 0.15), "{long:?}");
        let [twice, four_times] = [[1, 1], [1, 3]].map(|steps| distances(&steps));
        assert!(four_times[2] < twice[2], "{four_times:?} {twice:?}");
    }
}
