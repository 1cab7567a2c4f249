//! A penalty on negative light, applied to a posterior mean.
//!
//! A Gaussian posterior does not know that light is non-negative: an unusual function comes out with negative lobes and
//! too much light elsewhere. Clipping the lobes would make the pixel too bright. Instead this module minimises
//!
//! ```text
//! ½(z − ẑ)ᵀK(z − ẑ) + ½w Σ_s (v_sᵀz)²     over the elements s with v_sᵀẑ < 0
//! ```
//!
//! with the posterior precision K, `[r, r]`, which moves the other coefficients such that z still explains the
//! measurements, and v_s, `[r]`, the basis at element s. A few steps of conjugate gradients, preconditioned by K,
//! suffice. A penalty instead of a constraint, because a combination of few basis functions cannot be zero over most of
//! a window.

use serde::{Deserialize, Serialize};

use crate::linalg::{self, add_scaled, dot};

/// Negative light that costs as much as one standard deviation of the posterior, as a share of the mean function's
/// peak: w = (share · peak)⁻².
const TOLERATED_NEGATIVE_SHARE: f64 = 0.003;
/// Steps of conjugate gradients; more change next to nothing.
const MAX_STEPS: usize = 5;
/// Squared preconditioned gradient, relative to the first one, at which the steps end.
const MIN_RELATIVE_GRADIENT: f64 = 1e-6;

/// The penalty's weight, and the basis by light element.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub(super) struct NonNegativityPenalty {
    rank: usize,
    /// V, `[element, r]`.
    elements: Vec<f64>,
    /// w.
    weight: f64,
}

impl NonNegativityPenalty {
    /// `functions` are the basis, `[r, element]`; `mean` is the mean function, `[element]`.
    pub fn new(functions: &[f64], mean: &[f64]) -> Self {
        let peak = mean.iter().copied().fold(0.0, f64::max);
        Self {
            rank: functions.len() / mean.len(),
            elements: linalg::transpose(functions, mean.len()),
            weight: (TOLERATED_NEGATIVE_SHARE * peak).powi(-2),
        }
    }

    /// v_s.
    fn element(&self, s: usize) -> &[f64] {
        &self.elements[s * self.rank..(s + 1) * self.rank]
    }

    /// Moves `z`, the mean of a posterior whose precision has the Cholesky factor `factor`, towards the minimum.
    #[cfg_attr(target_arch = "x86_64", inline(always))]
    pub fn apply(&self, factor: &[f64], z: &mut [f64]) {
        let mut negative = Vec::new();
        // The negative gradient, and K⁻¹ times it.
        let mut residual = vec![0.0; self.rank];
        for (s, v) in self.elements.chunks_exact(self.rank).enumerate() {
            let light = dot(v, z);
            if light < 0.0 {
                negative.push(s);
                add_scaled(&mut residual, -self.weight * light, v);
            }
        }
        let mut preconditioned = residual.clone();
        linalg::cholesky_solve(factor, &mut preconditioned);
        // The direction, K times it (updated by recurrence), and the Hessian times it.
        let mut direction = preconditioned.clone();
        let mut k_direction = residual.clone();
        let mut h_direction = residual.clone();
        let mut gradient = dot(&residual, &preconditioned);
        let enough = MIN_RELATIVE_GRADIENT * gradient;
        for _ in 0..MAX_STEPS {
            if gradient.is_nan() || gradient <= enough {
                break;
            }
            h_direction.copy_from_slice(&k_direction);
            for &s in &negative {
                let v = self.element(s);
                add_scaled(&mut h_direction, self.weight * dot(v, &direction), v);
            }
            let step = gradient / dot(&direction, &h_direction);
            add_scaled(z, step, &direction);
            add_scaled(&mut residual, -step, &h_direction);
            preconditioned.copy_from_slice(&residual);
            linalg::cholesky_solve(factor, &mut preconditioned);
            let next = dot(&residual, &preconditioned);
            let ratio = next / gradient;
            gradient = next;
            for k in 0..self.rank {
                direction[k] = preconditioned[k] + ratio * direction[k];
                k_direction[k] = residual[k] + ratio * k_direction[k];
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn pseudo_random(i: usize) -> f64 {
        (i * 7919 % 1009) as f64 / 504.0 - 1.0
    }

    /// Compares with the solution of the penalty's normal equations.
    #[test]
    fn conjugate_gradients_find_the_minimum() {
        let (rank, area) = (4, 9);
        let functions: Vec<f64> = (0..rank * area).map(pseudo_random).collect();
        let mean = vec![0.5; area];
        let penalty = NonNegativityPenalty {
            weight: 3.0,
            ..NonNegativityPenalty::new(&functions, &mean)
        };
        let mut precision = vec![0.0; rank * rank];
        for i in 0..rank {
            for j in 0..rank {
                let entry = if i == j { 2.0 } else { 0.3 / (i + j) as f64 };
                precision[i * rank + j] = entry;
            }
        }
        let mut factor = precision.clone();
        linalg::cholesky(&mut factor, rank).unwrap();
        let start: Vec<f64> = (50..50 + rank).map(pseudo_random).collect();
        let mut z = start.clone();
        penalty.apply(&factor, &mut z);

        let mut system = precision;
        let mut right = vec![0.0; rank];
        let mut negative = 0;
        for s in 0..area {
            let v = penalty.element(s);
            let light = dot(v, &start);
            if light < 0.0 {
                negative += 1;
                for i in 0..rank {
                    right[i] -= 3.0 * light * v[i];
                    for j in 0..rank {
                        system[i * rank + j] += 3.0 * v[i] * v[j];
                    }
                }
            }
        }
        assert!(negative > 1 && negative < area, "{negative}");
        linalg::cholesky(&mut system, rank).unwrap();
        linalg::cholesky_solve(&system, &mut right);
        for k in 0..rank {
            assert!((z[k] - start[k] - right[k]).abs() < 1e-6, "{z:?}");
        }
    }

    #[test]
    fn non_negative_functions_do_not_change() {
        let functions: Vec<f64> = (0..18).map(|i| 0.1 + pseudo_random(i).abs()).collect();
        let penalty = NonNegativityPenalty::new(&functions, &[0.5; 9]);
        let mut z = vec![0.7, 0.2];
        penalty.apply(&[1.0, 0.0, 0.0, 1.0], &mut z);
        assert_eq!(z, [0.7, 0.2]);
    }
}
