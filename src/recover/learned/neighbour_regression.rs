//! Least-squares prediction of a component from the same component of neighbours.
//!
//! For each component k separately, `z_k ≈ w_k0 + Σ_j w_kj z_jk` over the neighbours j. Its normal equations are summed
//! over all observations of one class (sub-element position and channel); all components are kept side by side, so that
//! the sums are vector operations of length r.

use super::posterior_means::{PREDICTORS, PixelObservationPosition, PosteriorMeans};
use crate::job_executor::Sums;
use crate::linalg::{self, add_products};

/// Ridge, as a share of the predictors' mean square, that keeps the regressions well posed.
const RIDGE: f64 = 1e-3;

/// Sums of the normal equations of one class.
#[derive(Clone, Debug)]
pub(super) struct RegressionSums {
    rank: usize,
    /// `[pair, r]`, for the pairs (i, j) of predictors with i ≤ j, by i and then j.
    gram: Vec<f64>,
    /// `[predictor, r]`.
    pub right_hand_side: Vec<f64>,
}

impl RegressionSums {
    pub fn new(rank: usize) -> Self {
        Self {
            rank,
            gram: vec![0.0; PREDICTORS * (PREDICTORS + 1) / 2 * rank],
            right_hand_side: vec![0.0; PREDICTORS * rank],
        }
    }

    /// Adds an observation whose coefficients are `target`, `[r]`.
    #[cfg_attr(target_arch = "x86_64", inline(always))]
    pub fn add(
        &mut self,
        means: &PosteriorMeans<'_>,
        location: PixelObservationPosition,
        target: &[f64],
    ) {
        let rank = self.rank;
        let predictors: Vec<(usize, &[f64])> = means.predictors(location).collect();
        for (n, &(i, a)) in predictors.iter().enumerate() {
            add_products(&mut self.right_hand_side[i * rank..][..rank], a, target);
            for &(j, b) in &predictors[n..] {
                add_products(&mut self.gram[pair(i, j) * rank..][..rank], a, b);
            }
        }
    }

    /// Number of observations: the constant's product with itself.
    pub fn count(&self) -> f64 {
        self.gram[0]
    }

    /// Cholesky factors of the components' normal equations, `[r][predictor, predictor]`.
    pub fn cholesky_factors(&self) -> Vec<f64> {
        let mut factors = Vec::with_capacity(self.rank * PREDICTORS * PREDICTORS);
        for k in 0..self.rank {
            let mut a = vec![0.0; PREDICTORS * PREDICTORS];
            for i in 0..PREDICTORS {
                for j in i..PREDICTORS {
                    a[i * PREDICTORS + j] = self.gram[pair(i, j) * self.rank + k];
                }
            }
            let diagonal = |i: usize| i * (PREDICTORS + 1);
            let trace: f64 = (1..PREDICTORS).map(|i| a[diagonal(i)]).sum();
            let ridge = (RIDGE * trace / PREDICTORS as f64).max(f64::MIN_POSITIVE);
            (0..PREDICTORS).for_each(|i| a[diagonal(i)] += ridge);
            if linalg::cholesky(&mut a, PREDICTORS).is_none() {
                // The class has too few observations: its weights become zero.
                a.fill(0.0);
                (0..PREDICTORS).for_each(|i| a[diagonal(i)] = 1e150);
            }
            factors.extend(a);
        }
        factors
    }
}

impl Sums for RegressionSums {
    fn visit(&mut self, visitor: &mut dyn FnMut(&mut [f64])) {
        visitor(&mut self.gram);
        visitor(&mut self.right_hand_side);
    }
}

/// Number of the pair (i, j) of predictors, i ≤ j.
#[inline(always)]
fn pair(i: usize, j: usize) -> usize {
    i * PREDICTORS + j - i * (i + 1) / 2
}

/// Solves the regressions of one class: weights, `[predictor, r]`.
pub(super) fn solve_regressions(factors: &[f64], right_hand_side: &[f64], rank: usize) -> Vec<f64> {
    let mut weights = vec![0.0; PREDICTORS * rank];
    for (k, factor) in factors.chunks_exact(PREDICTORS * PREDICTORS).enumerate() {
        let component = right_hand_side.iter().skip(k).step_by(rank);
        let mut b: Vec<f64> = component.copied().collect();
        linalg::cholesky_solve(factor, &mut b);
        (0..PREDICTORS).for_each(|j| weights[j * rank + k] = b[j]);
    }
    weights
}

#[cfg(test)]
mod tests {
    use super::super::prior::Prior;
    use super::super::tests::synthetic_equations;
    use super::*;
    use crate::transport::{Extent, TileRect};

    #[test]
    fn regression_recovers_the_weights_of_a_linear_relation() {
        let random = |i: usize| (i * i * 7919 % 10_007) as f64 / 5003.0 - 1.0;
        let extent = Extent::new(34, 34);
        let region = TileRect { x: 6, y: 2, extent };
        let interior = TileRect {
            x: 8,
            y: 4,
            extent: Extent::new(30, 30),
        };
        let (rank, values) = (2, extent.area() * 3 * 2);
        let neighbours: Vec<f64> = (0..values).map(random).collect();
        let equations = synthetic_equations(region, &[1.0; 2], &neighbours, 1e-12, || 0.0);
        let prior = Prior::new(&[0.0; 2], vec![1.0, 0.0, 0.0, 1.0]);
        let means = PosteriorMeans::new(&equations, interior, &prior, &[0.0; 3]);
        let weights: Vec<f64> = (0..PREDICTORS * rank).map(|i| random(i + 5)).collect();
        let mut sums = RegressionSums::new(rank);
        for location in means.interior_locations() {
            let mut target = vec![0.0; rank];
            let mut predictors = 0;
            for (j, z) in means.predictors(location) {
                add_products(&mut target, &weights[j * rank..][..rank], z);
                predictors += 1;
            }
            assert_eq!(predictors, PREDICTORS);
            sums.add(&means, location, &target);
        }
        let found = solve_regressions(&sums.cholesky_factors(), &sums.right_hand_side, rank);
        for (found, expected) in found.iter().zip(&weights) {
            assert!(
                (found - expected).abs() < 0.01,
                "{found} instead of {expected}"
            );
        }
    }

    #[test]
    fn regression_without_observations_has_zero_weights() {
        let sums = RegressionSums::new(2);
        let weights = solve_regressions(&sums.cholesky_factors(), &sums.right_hand_side, 2);
        assert_eq!(weights, [0.0; 2 * PREDICTORS]);
    }
}
