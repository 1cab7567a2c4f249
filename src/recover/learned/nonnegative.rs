//! What it says of a posterior that no light is negative.
//!
//! A Gaussian prior does not know it: functions unlike most come out with lobes below zero, balanced
//! by too much light elsewhere, and cutting the lobes off afterwards would leave the pixel too
//! bright. So elements below zero are pulled up before, and the posterior's precision `K` says what
//! else has to move for the measurements to be explained still: the minimum of
//! `½(z − ẑ)ᵀK(z − ẑ) + ½w Σ min(v_sᵀz, 0)²`, `v_s` what the kernels are at element s, is approached
//! for the elements below zero at the posterior mean ẑ by a few steps of conjugate gradients with `K`
//! as preconditioner. The pull is soft, as a combination of few kernels cannot be zero over most of a
//! window.

use super::kernels::Kernels;
use crate::linalg::{self, add_scaled, dot};

/// Light below zero that weighs as much as one standard deviation of the posterior, as a share of
/// the mean function's peak.
const LEEWAY: f64 = 0.003;
/// Steps of conjugate gradients; more change next to nothing.
const STEPS: usize = 5;
/// Share of the first step's descent at which there is nothing left to gain.
const DONE: f64 = 1e-6;

/// The kernels ready for use.
#[derive(Clone, Debug)]
pub(super) struct NonNegative {
    rank: usize,
    /// `[element, r]`.
    elements: Vec<f64>,
    /// `w`.
    weight: f64,
}

/// Room to work in, kept from one member to the next: vectors `[r]`.
#[derive(Debug)]
pub(super) struct Pull {
    below: Vec<usize>,
    left: Vec<f64>,
    solved: Vec<f64>,
    direction: Vec<f64>,
    /// `K direction`, kept up without a product.
    image: Vec<f64>,
    curved: Vec<f64>,
}

impl Pull {
    pub fn new(rank: usize) -> Self {
        let line = || vec![0.0; rank];
        Self {
            below: Vec::new(),
            left: line(),
            solved: line(),
            direction: line(),
            image: line(),
            curved: line(),
        }
    }
}

impl NonNegative {
    pub fn new(kernels: &Kernels) -> Self {
        let (elements, peak) = kernels.by_element();
        Self {
            rank: kernels.rank(),
            elements,
            weight: (LEEWAY * peak).powi(-2),
        }
    }

    fn element(&self, s: usize) -> &[f64] {
        &self.elements[s * self.rank..(s + 1) * self.rank]
    }

    /// Moves `z`, the mean of a posterior whose precision has the Cholesky factor `factor`.
    #[inline(always)]
    pub fn pull(&self, factor: &[f64], z: &mut [f64], work: &mut Pull) {
        let Pull {
            below,
            left,
            solved,
            direction,
            image,
            curved,
        } = work;
        below.clear();
        left.fill(0.0);
        for (s, v) in self.elements.chunks_exact(self.rank).enumerate() {
            let light = dot(v, z);
            if light < 0.0 {
                below.push(s);
                add_scaled(left, -self.weight * light, v);
            }
        }
        solved.copy_from_slice(left);
        linalg::cholesky_solve(factor, solved);
        direction.copy_from_slice(solved);
        image.copy_from_slice(left);
        let mut descent = dot(left, solved);
        let enough = DONE * descent;
        for _ in 0..STEPS {
            if descent.is_nan() || descent <= enough {
                break;
            }
            curved.copy_from_slice(image);
            for &s in below.iter() {
                let v = self.element(s);
                add_scaled(curved, self.weight * dot(v, direction), v);
            }
            let step = descent / dot(direction, curved);
            add_scaled(z, step, direction);
            add_scaled(left, -step, curved);
            solved.copy_from_slice(left);
            linalg::cholesky_solve(factor, solved);
            let next = dot(left, solved);
            let share = next / descent;
            descent = next;
            for k in 0..self.rank {
                direction[k] = solved[k] + share * direction[k];
                image[k] = left[k] + share * image[k];
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn wave(i: usize) -> f64 {
        (i * 7919 % 1009) as f64 / 504.0 - 1.0
    }

    /// Against the normal equations solved outright.
    #[test]
    fn conjugate_gradients_find_the_minimum() {
        let (rank, area) = (4, 9);
        let kernels: Vec<f64> = (0..rank * area).map(wave).collect();
        let mean = vec![0.5; area];
        let nonnegative = NonNegative {
            weight: 3.0,
            ..NonNegative::new(&Kernels::new(&kernels, &mean))
        };
        let mut precision = vec![0.0; rank * rank];
        for i in 0..rank {
            for j in 0..rank {
                let near = if i == j { 2.0 } else { 0.3 / (i + j) as f64 };
                precision[i * rank + j] = near;
            }
        }
        let mut factor = precision.clone();
        linalg::cholesky(&mut factor, rank).unwrap();
        let start: Vec<f64> = (50..50 + rank).map(wave).collect();
        let mut z = start.clone();
        nonnegative.pull(&factor, &mut z, &mut Pull::new(rank));

        let mut system = precision;
        let mut right = vec![0.0; rank];
        let mut below = 0;
        for s in 0..area {
            let v = nonnegative.element(s);
            let light = dot(v, &start);
            if light < 0.0 {
                below += 1;
                for i in 0..rank {
                    right[i] -= 3.0 * light * v[i];
                    for j in 0..rank {
                        system[i * rank + j] += 3.0 * v[i] * v[j];
                    }
                }
            }
        }
        assert!(below > 1 && below < area, "{below}");
        linalg::cholesky(&mut system, rank).unwrap();
        linalg::cholesky_solve(&system, &mut right);
        for k in 0..rank {
            assert!((z[k] - start[k] - right[k]).abs() < 1e-6, "{z:?}");
        }
    }

    #[test]
    fn what_is_nowhere_negative_stays() {
        let kernels: Vec<f64> = (0..18).map(|i| 0.1 + wave(i).abs()).collect();
        let nonnegative = NonNegative::new(&Kernels::new(&kernels, &[0.5; 9]));
        let mut z = vec![0.7, 0.2];
        nonnegative.pull(&[1.0, 0.0, 0.0, 1.0], &mut z, &mut Pull::new(2));
        assert_eq!(z, [0.7, 0.2]);
    }
}
