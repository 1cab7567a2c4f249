//! What one pixel's measurements and a Gaussian prior say together, in closed form.

use super::equations::Equations;
use super::nonnegative::{NonNegative, Pull};
use crate::linalg::{self, dot};

/// A covariance ready for use.
#[derive(Clone, Debug)]
pub(super) struct Gaussian {
    /// Inverse covariance, `[r, r]`.
    precision: Vec<f64>,
    /// Logarithm of the covariance's determinant.
    log_det: f64,
}

/// Smallest variance along any direction, as a share of the mean one: keeps the inverse finite.
const LEAST_SHARE: f64 = 1e-9;

impl Gaussian {
    /// From a covariance `[r, r]`; a little is added to its diagonal until it can be inverted.
    pub fn new(covariance: &[f64], rank: usize) -> Self {
        let trace: f64 = (0..rank).map(|k| covariance[k * rank + k].abs()).sum();
        let mut ridge = (trace / rank as f64 * LEAST_SHARE).max(f64::MIN_POSITIVE);
        loop {
            let mut u = covariance.to_vec();
            (0..rank).for_each(|k| u[k * rank + k] += ridge);
            if let Some(log_det) = linalg::cholesky(&mut u, rank) {
                let mut precision = vec![0.0; rank * rank];
                linalg::cholesky_inverse(&u, rank, &mut vec![0.0; rank * rank], &mut precision);
                linalg::mirror_upper(&mut precision, rank);
                return Self { precision, log_det };
            }
            if !ridge.is_finite() {
                // A covariance that is no number says nothing.
                return Self {
                    precision: vec![0.0; rank * rank],
                    log_det: f64::INFINITY,
                };
            }
            ridge = (ridge * 10.0).max(1e-300);
        }
    }
}

/// Room to work in, kept from one member to the next.
#[derive(Debug)]
pub(super) struct Workspace {
    factor: Vec<f64>,
    scratch: Vec<f64>,
    /// Posterior covariance, `[r, r]`, upper triangle; only after [`Workspace::covariance`].
    pub inverse: Vec<f64>,
    image: Vec<f64>,
    step: Vec<f64>,
    pull: Pull,
    /// Posterior mean, `[r]`.
    pub z: Vec<f64>,
}

impl Workspace {
    pub fn new(rank: usize) -> Self {
        let square = vec![0.0; rank * rank];
        let line = vec![0.0; rank];
        Self {
            factor: square.clone(),
            scratch: square.clone(),
            inverse: square,
            image: line.clone(),
            step: line.clone(),
            pull: Pull::new(rank),
            z: line,
        }
    }

    /// The posterior of `z ~ N(mean, prior)` given the equations of `member`, whose noise has
    /// `noise` times its estimated variance. Leaves its mean in `z`; returns the logarithm of the
    /// evidence, up to a constant that does not depend on the prior.
    ///
    /// With `a = f²/σ²`: precision `C⁻¹ + a BᵀB`, mean `m + (C⁻¹ + a BᵀB)⁻¹ (f/σ²) Bᵀ(y − f B m)`.
    #[inline(always)]
    pub fn infer(
        &mut self,
        equations: &Equations,
        member: usize,
        noise: f64,
        prior: &Gaussian,
        mean: &[f64],
    ) -> f64 {
        let rank = equations.rank;
        let of = &equations.members[member];
        let (gram, right) = (equations.gram(member), equations.right(member));
        let variance = of.variance * noise;
        let (a, b) = (of.scale * of.scale / variance, of.scale / variance);
        for ((x, p), g) in self.factor.iter_mut().zip(&prior.precision).zip(gram) {
            *x = p + a * g;
        }
        linalg::multiply_vector(gram, mean, &mut self.image);
        for k in 0..rank {
            self.step[k] = b * (right[k] - of.scale * self.image[k]);
        }
        let quadratic = a * dot(mean, &self.image) - 2.0 * b * dot(mean, right);
        self.z.copy_from_slice(&self.step);
        // The prior's precision is positive definite and a Gram matrix takes nothing from it.
        let Some(log_det) = linalg::cholesky(&mut self.factor, rank) else {
            self.z.copy_from_slice(mean);
            return f64::NEG_INFINITY;
        };
        linalg::cholesky_solve(&self.factor, &mut self.z);
        let explained = dot(&self.step, &self.z);
        for (z, m) in self.z.iter_mut().zip(mean) {
            *z += m;
        }
        -0.5 * (quadratic - explained + log_det + prior.log_det)
    }

    /// Moves `z`, near the mean of the posterior just inferred, to where light is hardly negative.
    #[inline(always)]
    pub fn pull(&mut self, nonnegative: &NonNegative, z: &mut [f64]) {
        nonnegative.pull(&self.factor, z, &mut self.pull);
    }

    /// The covariance of the posterior just inferred, into `inverse`.
    #[inline(always)]
    pub fn covariance(&mut self) {
        let rank = self.z.len();
        linalg::cholesky_inverse(&self.factor, rank, &mut self.scratch, &mut self.inverse);
    }

    /// Expected squared residual `E‖y − f B z‖²` under the posterior just inferred, of which
    /// `inverse` is the covariance.
    #[inline(always)]
    pub fn residual(&mut self, equations: &Equations, member: usize) -> f64 {
        let rank = equations.rank;
        let of = &equations.members[member];
        let gram = equations.gram(member);
        linalg::multiply_vector(gram, &self.z, &mut self.image);
        let mut spread = 0.0;
        for i in 0..rank {
            let (h, p) = (
                &gram[i * rank + i..(i + 1) * rank],
                &self.inverse[i * rank + i..(i + 1) * rank],
            );
            spread += 2.0 * dot(h, p) - h[0] * p[0];
        }
        let f = of.scale;
        of.power - 2.0 * f * dot(&self.z, equations.right(member))
            + f * f * (dot(&self.z, &self.image) + spread)
    }
}
