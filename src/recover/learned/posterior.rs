//! The posterior of one observation under a Gaussian prior, in closed form.
//!
//! For `y = f B z + noise` with noise variance σ² and the prior z ~ N(m, C):
//!
//! ```text
//! K = C⁻¹ + (f²/σ²) BᵀB                         posterior precision, [r, r]
//! ẑ = m + K⁻¹ (f/σ²) Bᵀ(y − f B m)              posterior mean, [r]
//! ln p(y) = −½ ((f²/σ²)‖Bm‖² − (2f/σ²) mᵀBᵀy − dᵀKd + ln|K| + ln|C|) + constant,   d = ẑ − m
//! ```

use serde::{Deserialize, Serialize};

use super::equations::ObservationEquations;
use crate::job_executor::Sums;
use crate::linalg::{self, add_scaled, dot, set_scaled_sum};

/// Smallest variance along any direction, as a share of the mean variance: keeps the inverse finite.
const MIN_VARIANCE_SHARE: f64 = 1e-9;

/// One in so many observations whose posterior covariance is computed in an E step, where thousands are averaged. It
/// takes twice the time of the rest, and does not depend on y but through brightness and noise.
const COVARIANCE_SAMPLING: usize = 8;

/// The inverse of a prior's covariance.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub(super) struct PriorPrecision {
    /// C⁻¹, `[r, r]`.
    pub matrix: Vec<f64>,
    /// ln|C|.
    covariance_log_det: f64,
}

impl PriorPrecision {
    /// Inverts a covariance, `[r, r]`, made positive definite by a ridge.
    pub fn new(covariance: &[f64], rank: usize) -> Self {
        let trace: f64 = (0..rank).map(|k| covariance[k * rank + k].abs()).sum();
        let ridge = trace / rank as f64 * MIN_VARIANCE_SHARE;
        // A covariance without a factor leaves a prior without information.
        let mut precision = Self {
            matrix: vec![0.0; rank * rank],
            covariance_log_det: f64::INFINITY,
        };
        if let Some((u, log_det)) = linalg::cholesky_with_ridge(covariance, rank, ridge) {
            let (matrix, mut scratch) = (&mut precision.matrix, vec![0.0; rank * rank]);
            linalg::cholesky_inverse(&u, rank, &mut scratch, matrix);
            linalg::mirror_upper(matrix, rank);
            precision.covariance_log_det = log_det;
        }
        precision
    }
}

/// Computes posteriors of rank r, one after the other, in buffers that it keeps.
#[derive(Debug)]
pub(super) struct PosteriorSolver {
    /// Cholesky factor of K, `[r, r]`.
    pub factor: Vec<f64>,
    scratch: Vec<f64>,
    /// K⁻¹, `[r, r]`, upper triangle; valid after [`compute_covariance`](Self::compute_covariance).
    pub covariance: Vec<f64>,
    /// `BᵀB m` or `BᵀB ẑ`, `[r]`.
    product: Vec<f64>,
    gradient: Vec<f64>,
    /// ẑ, `[r]`.
    pub mean: Vec<f64>,
}

impl PosteriorSolver {
    pub fn new(rank: usize) -> Self {
        let (matrix, vector) = (vec![0.0; rank * rank], vec![0.0; rank]);
        Self {
            factor: matrix.clone(),
            scratch: matrix.clone(),
            covariance: matrix,
            product: vector.clone(),
            gradient: vector.clone(),
            mean: vector,
        }
    }

    /// The posterior of observation `index` under the prior N(`prior_mean`, C). The noise has `noise` times the
    /// estimated variance. Leaves ẑ in `mean`; returns ln p(y) up to a constant that does not depend on the prior.
    #[inline(always)]
    pub fn infer(
        &mut self,
        equations: &ObservationEquations,
        index: usize,
        noise: f64,
        prior: &PriorPrecision,
        prior_mean: &[f64],
    ) -> f64 {
        let rank = equations.rank;
        let observation = &equations.observations[index];
        let (gram, right) = (equations.gram(index), equations.right_hand_side(index));
        let (f, variance) = (observation.brightness, observation.variance * noise);
        let (a, b) = (f * f / variance, f / variance);
        set_scaled_sum(&mut self.factor, &prior.matrix, a, gram);
        linalg::multiply_vector(gram, prior_mean, &mut self.product);
        for k in 0..rank {
            self.gradient[k] = b * (right[k] - f * self.product[k]);
        }
        let quadratic = a * dot(prior_mean, &self.product) - 2.0 * b * dot(prior_mean, right);
        self.mean.copy_from_slice(&self.gradient);
        // Fails on NaN only: C⁻¹ is positive definite and BᵀB semidefinite.
        let Some(log_det) = linalg::cholesky(&mut self.factor, rank) else {
            self.mean.copy_from_slice(prior_mean);
            return f64::NEG_INFINITY;
        };
        linalg::cholesky_solve(&self.factor, &mut self.mean);
        let explained = dot(&self.gradient, &self.mean);
        for (z, m) in self.mean.iter_mut().zip(prior_mean) {
            *z += m;
        }
        -0.5 * (quadratic - explained + log_det + prior.covariance_log_det)
    }

    #[inline(always)]
    pub fn compute_covariance(&mut self) {
        let rank = self.mean.len();
        linalg::cholesky_inverse(&self.factor, rank, &mut self.scratch, &mut self.covariance);
    }

    /// ‖y − f B ẑ‖² of the posterior just inferred.
    #[inline(always)]
    pub fn squared_residual(&mut self, equations: &ObservationEquations, index: usize) -> f64 {
        let observation = &equations.observations[index];
        linalg::multiply_vector(equations.gram(index), &self.mean, &mut self.product);
        let f = observation.brightness;
        observation.energy - 2.0 * f * dot(&self.mean, equations.right_hand_side(index))
            + f * f * dot(&self.mean, &self.product)
    }

    /// E‖f B (z − ẑ)‖² = f² tr(BᵀB K⁻¹), after [`compute_covariance`](Self::compute_covariance).
    #[inline(always)]
    pub fn predicted_variance(&self, equations: &ObservationEquations, index: usize) -> f64 {
        let (rank, gram) = (equations.rank, equations.gram(index));
        let mut trace = 0.0;
        for i in 0..rank {
            let row = i * rank + i..(i + 1) * rank;
            let (g, p) = (&gram[row.clone()], &self.covariance[row]);
            trace += 2.0 * dot(g, p) - g[0] * p[0];
        }
        equations.observations[index].brightness.powi(2) * trace
    }
}

/// Σ w (xxᵀ + K⁻¹) over observations with weights w, `[r, r]`, upper triangle, with K⁻¹ of a sample of them.
#[derive(Debug)]
pub(super) struct SecondMoment {
    /// Σ w xxᵀ.
    outer: Vec<f64>,
    /// Σ w K⁻¹ over the sample.
    covariance: Vec<f64>,
    /// Σ w over all observations and over the sample.
    weights: [f64; 2],
    /// Observations added one by one.
    count: usize,
}

impl SecondMoment {
    pub fn new(rank: usize) -> Self {
        Self {
            outer: vec![0.0; rank * rank],
            covariance: vec![0.0; rank * rank],
            weights: [0.0; 2],
            count: 0,
        }
    }

    /// Adds the observation that `solver` has inferred. Returns whether it is in the sample, and its covariance
    /// therefore computed.
    #[inline(always)]
    pub fn add(&mut self, solver: &mut PosteriorSolver, weight: f64, x: &[f64]) -> bool {
        let rank = x.len();
        for i in 0..rank {
            let row = &mut self.outer[i * rank + i..(i + 1) * rank];
            add_scaled(row, weight * x[i], &x[i..]);
        }
        self.weights[0] += weight;
        let is_sampled = self.count.is_multiple_of(COVARIANCE_SAMPLING);
        self.count += 1;
        if is_sampled {
            solver.compute_covariance();
            add_scaled(&mut self.covariance, weight, &solver.covariance);
            self.weights[1] += weight;
        }
        is_sampled
    }

    /// All observations over the sample, by their weights.
    pub fn sampling_ratio(&self) -> f64 {
        let [all, sampled] = self.weights;
        if sampled > 0.0 { all / sampled } else { 0.0 }
    }

    /// The sum.
    pub fn sum(mut self) -> Vec<f64> {
        let ratio = self.sampling_ratio();
        add_scaled(&mut self.outer, ratio, &self.covariance);
        self.outer
    }
}

impl Sums for SecondMoment {
    fn visit(&mut self, visitor: &mut dyn FnMut(&mut [f64])) {
        visitor(&mut self.outer);
        visitor(&mut self.covariance);
        visitor(&mut self.weights);
    }
}
