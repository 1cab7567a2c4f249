//! Least-squares prediction of a component from the same component of neighbours.
//!
//! For each component k separately, `z_k ≈ w_k0 + Σ_j w_kj z_jk` over the neighbours j. Its normal
//! equations are summed over all observations of one class (sub-element position and channel); all
//! components are kept side by side, so that the sums are vector operations of length r.

use super::posterior_means::{NeighbourOffset, ObservationLocation, PosteriorMeans};
use crate::linalg;
use crate::linalg::add_scaled;

/// Ridge, as a share of the predictors' mean square, that keeps the regressions well posed.
const RIDGE: f64 = 1e-3;

/// Sums of the normal equations of one class, over J neighbours and a constant.
#[derive(Clone, Debug)]
pub(super) struct RegressionSums {
    rank: usize,
    /// `[1 + J, 1 + J, r]`, where the first index is at most the second.
    gram: Vec<f64>,
    /// `[1 + J, r]`.
    pub right_hand_side: Vec<f64>,
}

impl RegressionSums {
    /// Empty sums over `neighbours` neighbours.
    pub fn new(neighbours: usize, rank: usize) -> Self {
        let width = 1 + neighbours;
        Self {
            rank,
            gram: vec![0.0; width * width * rank],
            right_hand_side: vec![0.0; width * rank],
        }
    }

    /// Adds the observation at `location` and its neighbours at `offsets`.
    #[inline(always)]
    pub fn add(
        &mut self,
        means: &PosteriorMeans<'_>,
        offsets: &[NeighbourOffset],
        location: ObservationLocation,
    ) {
        let (rank, width) = (self.rank, 1 + offsets.len());
        let ones = vec![1.0; rank];
        let mut predictors: Vec<(usize, &[f64])> = vec![(0, &ones)];
        for (j, offset) in offsets.iter().enumerate() {
            if let Some(z) = means.neighbour(location, offset) {
                predictors.push((1 + j, z));
            }
        }
        let target = means.mean(location.index);
        for (n, &(i, a)) in predictors.iter().enumerate() {
            let sums = &mut self.right_hand_side[i * rank..(i + 1) * rank];
            add_products(sums, a, target);
            for &(j, b) in &predictors[n..] {
                let at = (i * width + j) * rank;
                add_products(&mut self.gram[at..at + rank], a, b);
            }
        }
    }

    /// Adds sums over other observations.
    pub fn merge(&mut self, other: &Self) {
        add_scaled(&mut self.gram, 1.0, &other.gram);
        add_scaled(&mut self.right_hand_side, 1.0, &other.right_hand_side);
    }

    /// Cholesky factors of the components' normal equations, `[r][1 + J, 1 + J]`.
    pub fn cholesky_factors(&self) -> Vec<f64> {
        let (rank, width) = (self.rank, self.right_hand_side.len() / self.rank);
        let mut factors = Vec::with_capacity(rank * width * width);
        for k in 0..rank {
            let entry = |i: usize, j: usize| self.gram[(i * width + j) * rank + k];
            let trace: f64 = (1..width).map(|i| entry(i, i)).sum();
            let ridge = (RIDGE * trace / width as f64).max(f64::MIN_POSITIVE);
            let mut a = vec![0.0; width * width];
            for i in 0..width {
                for j in i..width {
                    a[i * width + j] = entry(i, j);
                }
                a[i * width + i] += ridge;
            }
            if linalg::cholesky(&mut a, width).is_none() {
                // The class has too few observations: its weights become zero.
                a.fill(0.0);
                (0..width).for_each(|i| a[i * width + i] = 1e150);
            }
            factors.extend(a);
        }
        factors
    }
}

/// Solves the regressions of one class: weights, `[1 + J, r]`.
pub(super) fn solve_regressions(factors: &[f64], right_hand_side: &[f64], rank: usize) -> Vec<f64> {
    let width = right_hand_side.len() / rank;
    let mut weights = vec![0.0; width * rank];
    let mut b = vec![0.0; width];
    for (k, factor) in factors.chunks_exact(width * width).enumerate() {
        (0..width).for_each(|j| b[j] = right_hand_side[j * rank + k]);
        linalg::cholesky_solve(factor, &mut b);
        (0..width).for_each(|j| weights[j * rank + k] = b[j]);
    }
    weights
}

/// `sums += a ∘ b`, entry by entry.
#[inline(always)]
pub(super) fn add_products(sums: &mut [f64], a: &[f64], b: &[f64]) {
    for ((sum, a), b) in sums.iter_mut().zip(a).zip(b) {
        *sum += a * b;
    }
}

#[cfg(test)]
mod tests {
    use super::super::equations::RegionEquations;
    use super::*;
    use crate::transport::{Extent, TileRect};

    #[test]
    fn regression_recovers_the_weights_of_a_linear_relation() {
        let random = |i: usize| (i * i * 7919 % 10_007) as f64 / 5003.0 - 1.0;
        let extent = Extent {
            width: 34,
            height: 34,
        };
        let region = TileRect { x: 6, y: 2, extent };
        let interior = TileRect {
            x: 8,
            y: 4,
            extent: Extent {
                width: 30,
                height: 30,
            },
        };
        let (rank, values) = (2, extent.area() * 3 * 2);
        let neighbours: Vec<f64> = (0..values).map(random).collect();
        let equations = RegionEquations::synthetic(region, &[1.0; 2], &neighbours, 0.01, || 0.0);
        let mut means = PosteriorMeans {
            equations: &equations,
            interior,
            means: vec![0.0; values],
            bright_means: neighbours,
            log_evidence: Vec::new(),
            is_bright: Vec::new(),
        };
        let offsets = NeighbourOffset::all();
        let weights: Vec<f64> = (0..(1 + offsets.len()) * rank)
            .map(|i| random(i + 5))
            .collect();
        for location in means.interior_locations() {
            for k in 0..rank {
                let terms = offsets.iter().enumerate().map(|(j, offset)| {
                    weights[(1 + j) * rank + k] * means.neighbour(location, offset).unwrap()[k]
                });
                means.means[location.index * rank + k] = weights[k] + terms.sum::<f64>();
            }
        }
        let mut sums = RegressionSums::new(offsets.len(), rank);
        for location in means.interior_locations() {
            sums.add(&means, &offsets, location);
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
        let sums = RegressionSums::new(3, 2);
        let weights = solve_regressions(&sums.cholesky_factors(), &sums.right_hand_side, 2);
        assert_eq!(weights, [0.0; 8]);
    }
}
