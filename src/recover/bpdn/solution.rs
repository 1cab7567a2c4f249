//! What is asked for, what is answered, and the proof of how good the answer is.
//!
//! The dual problem is `max yᵀν − ε‖ν‖ : Aᵀν ≤ φs, ‖s‖_∞ ≤ 1`. Multipliers that nearly satisfy its
//! constraints satisfy them with a little of the constant basis vector mixed in, and then bound the
//! objective of every feasible x from below: the distance to the optimum is known at any time.

use super::window::Window;
use crate::linalg::dot;

/// Steps of the search for the best mixture in a bound.
const THIRDS: usize = 40;

/// One right-hand side of a [`super::InteriorPoint`].
#[derive(Clone, Debug)]
pub struct Constraint<'a> {
    /// Measurements, `[L]`.
    pub y: &'a [f64],
    /// The most that `‖y − Ax‖` may be.
    pub epsilon: f64,
    /// Non-negative least squares' solution, `[k]`, which decides whether the constraint can be
    /// satisfied, and keeps the answer feasible.
    pub least_squares: &'a [f64],
}

/// A solution with the proof of how good it is.
#[derive(Clone, Debug)]
pub struct Solution {
    /// `x`, `[k]`.
    pub x: Vec<f64>,
    /// `‖φᵀx‖₁`.
    pub objective: f64,
    /// A lower bound on the objective of every feasible x; zero where none is feasible.
    pub bound: f64,
}

impl Solution {
    /// How far the objective may be above the optimum, as a share of it.
    pub(super) fn gap(&self) -> f64 {
        (self.objective - self.bound) / self.bound
    }
}

impl Window {
    /// Keeps what is better than `best` of feasible points near x, and of the bound that multipliers
    /// s near the optimal ones prove.
    #[inline(always)]
    pub(super) fn record(
        &self,
        constraint: &Constraint,
        x: Vec<f64>,
        s: &[f64],
        best: &mut Solution,
    ) {
        for x in self.feasible(x, constraint) {
            let objective = self.objective(&x);
            if objective < best.objective {
                (best.x, best.objective) = (x, objective);
            }
        }
        // At the optimum ν points the residual's way.
        let residual = self.difference(&best.x, constraint.y);
        best.bound = best.bound.max(self.bound(constraint, s, &residual));
    }

    /// Points near `x` that satisfy the constraint: the darkest one along the ray through x, if that
    /// meets the ball around y, and the nearest one on the way to the least-squares solution.
    #[inline(always)]
    fn feasible(&self, x: Vec<f64>, constraint: &Constraint) -> impl Iterator<Item = Vec<f64>> {
        let &Constraint {
            y,
            epsilon,
            least_squares,
        } = constraint;
        let from = self.difference(&x, y);
        let seen: Vec<f64> = y.iter().zip(&from).map(|(y, from)| y - from).collect();
        let to = self.difference(least_squares, y);
        let step: Vec<f64> = to.iter().zip(&from).map(|(to, from)| to - from).collect();
        let minus: Vec<f64> = seen.iter().map(|s| -s).collect();
        let ray = reach(y, &minus, epsilon).map(|t| x.iter().map(|x| t * x).collect());
        let onward = reach(&from, &step, epsilon).filter(|&t| t <= 1.0).map(|t| {
            let both = x.iter().zip(least_squares);
            both.map(|(x, least)| x + t * (least - x)).collect()
        });
        ray.into_iter().chain(onward)
    }

    /// A lower bound on the objective, from multipliers s within ±1 and the direction of ν.
    #[inline(always)]
    fn bound(&self, constraint: &Constraint, s: &[f64], direction: &[f64]) -> f64 {
        let size = dot(direction, direction).sqrt();
        let gain = dot(direction, constraint.y) - constraint.epsilon * size;
        if gain <= 0.0 {
            return 0.0;
        }
        let pairs: Vec<_> = (self.correlate(direction).into_iter())
            .zip(self.synthesize(s))
            .collect();
        gain * farthest(&pairs, 1.0 / self.side() as f64)
    }
}

/// The least `t ≥ 0` at which `‖from + t step‖ ≤ ε`.
#[inline(always)]
fn reach(from: &[f64], step: &[f64], epsilon: f64) -> Option<f64> {
    let (a, b) = (dot(step, step), -dot(step, from));
    let c = dot(from, from) - epsilon * epsilon;
    if c <= 0.0 {
        return Some(0.0);
    }
    let root = b * b - a * c;
    (b > 0.0 && root >= 0.0).then(|| c / (b + root.sqrt()))
}

/// The largest t for which `t p ≤ α q + (1 − α) c` for all pairs (p, q) and some α in [0, 1].
///
/// φ turns the constant basis vector into `c = 1/side` everywhere, so that, with q = φs and
/// p = Aᵀν, the dual's constraint holds for tν and `αs` plus `1 − α` of that vector.
#[inline(always)]
fn farthest(pairs: &[(f64, f64)], c: f64) -> f64 {
    // What is allowed at α ends at `most`, and begins where p < 0 meets a negative right side.
    let along = |alpha: f64| {
        let (mut least, mut most) = (0.0f64, f64::INFINITY);
        for &(p, q) in pairs {
            let room = alpha * q + (1.0 - alpha) * c;
            if p > 0.0 {
                most = most.min(room / p);
            } else if room < 0.0 {
                least = least.max(room / p);
            }
        }
        if least <= most { most } else { -1.0 }
    };
    // Concave in α as far as anything is allowed, which it is from zero on: by thirds.
    let (mut low, mut high) = (0.0, 1.0);
    for _ in 0..THIRDS {
        let (a, b) = ((2.0 * low + high) / 3.0, (low + 2.0 * high) / 3.0);
        if along(a) < along(b) {
            low = a;
        } else {
            high = b;
        }
    }
    let best = along(low).max(along(high));
    if best.is_finite() { best.max(0.0) } else { 0.0 }
}
