//! Constraint and solution of basis pursuit denoising, and the dual bound that proves a solution's quality.
//!
//! The dual problem is
//!
//! ```text
//! max yᵀν − ε‖ν‖   subject to   Aᵀν ≤ φs,   ‖s‖_∞ ≤ 1
//! ```
//!
//! Any feasible (ν, s) bounds the objective of every feasible x from below. The multipliers of an iterate
//! are nearly feasible; a scaled ν, and s mixed with a multiple of the constant basis vector, are feasible.

use super::sensing_operator::SensingOperator;
use crate::linalg::dot;

/// Steps of the ternary search for the best mixture in a bound.
const SEARCH_STEPS: usize = 40;

/// The constraint `‖y − Ax‖ ≤ ε`.
pub(in crate::recover) struct BpdnConstraint<'a> {
    /// Measurements, `[L]`.
    pub y: &'a [f64],
    /// Upper bound of `‖y − Ax‖`.
    pub epsilon: f64,
    /// The non-negative least-squares solution, `[k]`: it decides whether the constraint can be satisfied.
    pub least_squares: &'a [f64],
}

/// A solution with a bound on its distance from the optimum.
pub(in crate::recover) struct BpdnSolution {
    /// `x`, `[k]`.
    pub x: Vec<f64>,
    /// `‖φᵀx‖₁`.
    pub objective: f64,
    /// A lower bound on the objective of every feasible x; zero where none is feasible.
    pub bound: f64,
}

impl BpdnSolution {
    /// Upper bound on the objective's excess over the optimum, as a share of the optimum.
    pub(super) fn relative_gap(&self) -> f64 {
        (self.objective - self.bound) / self.bound
    }

    /// Replaces the solution by a feasible point near x, if that is better, and the bound by the one that
    /// multipliers s near the optimal ones prove, if that is higher.
    #[cfg_attr(target_arch = "x86_64", inline(always))]
    pub(super) fn record(
        &mut self,
        operator: &SensingOperator,
        constraint: &BpdnConstraint,
        x: Vec<f64>,
        s: &[f64],
    ) {
        for x in feasible_points(operator, constraint, x) {
            let objective = operator.objective(&x);
            if objective < self.objective {
                (self.x, self.objective) = (x, objective);
            }
        }
        // At the optimum ν is parallel to the residual.
        let residual = operator.residual(&self.x, constraint.y);
        let bound = dual_bound(operator, constraint, s, &residual);
        self.bound = self.bound.max(bound);
    }
}

/// Points near `x` that satisfy the constraint: the darkest multiple of x that does, and the nearest
/// point on the line to the least-squares solution.
#[cfg_attr(target_arch = "x86_64", inline(always))]
fn feasible_points(
    operator: &SensingOperator,
    constraint: &BpdnConstraint,
    x: Vec<f64>,
) -> impl Iterator<Item = Vec<f64>> {
    let (y, epsilon, least_squares) = (constraint.y, constraint.epsilon, constraint.least_squares);
    let residual = operator.residual(&x, y);
    // −Ax, the change of the residual along the multiples of x.
    let change: Vec<f64> = residual.iter().zip(y).map(|(r, y)| r - y).collect();
    let multiple = first_feasible(y, &change, epsilon).map(|t| x.iter().map(|x| t * x).collect());
    let least = operator.residual(least_squares, y);
    let change: Vec<f64> = least.iter().zip(&residual).map(|(l, r)| l - r).collect();
    let on_line = first_feasible(&residual, &change, epsilon).filter(|&t| t <= 1.0);
    let on_line = on_line.map(|t| {
        let both = x.iter().zip(least_squares);
        both.map(|(x, least)| x + t * (least - x)).collect()
    });
    multiple.into_iter().chain(on_line)
}

/// The least `t ≥ 0` at which `‖residual + t change‖ ≤ ε`.
#[cfg_attr(target_arch = "x86_64", inline(always))]
fn first_feasible(residual: &[f64], change: &[f64], epsilon: f64) -> Option<f64> {
    let (a, b) = (dot(change, change), -dot(change, residual));
    let c = dot(residual, residual) - epsilon * epsilon;
    if c <= 0.0 {
        return Some(0.0);
    }
    let discriminant = b * b - a * c;
    (b > 0.0 && discriminant >= 0.0).then(|| c / (b + discriminant.sqrt()))
}

/// A lower bound on the objective, from multipliers s within ±1 and the direction of ν.
#[cfg_attr(target_arch = "x86_64", inline(always))]
fn dual_bound(
    operator: &SensingOperator,
    constraint: &BpdnConstraint,
    s: &[f64],
    direction: &[f64],
) -> f64 {
    let norm = dot(direction, direction).sqrt();
    let gain = dot(direction, constraint.y) - constraint.epsilon * norm;
    if gain <= 0.0 {
        return 0.0;
    }
    let pairs: Vec<_> = (operator.correlate(direction).into_iter())
        .zip(operator.synthesize(s))
        .collect();
    gain * max_scale(&pairs, 1.0 / operator.side as f64)
}

/// The largest scale t with `t p ≤ α q + (1 − α) c` for all pairs (p, q) and some α in [0, 1].
///
/// With p = Aᵀν, q = φs and c = 1/side, the value of φ times the constant basis vector's unit coefficient,
/// (tν, αs plus 1 − α of that vector) is dual feasible.
#[cfg_attr(target_arch = "x86_64", inline(always))]
fn max_scale(pairs: &[(f64, f64)], c: f64) -> f64 {
    // The feasible scales at α; a negative right-hand side with p < 0 makes a lower limit.
    let max_scale_at = |alpha: f64| {
        let (mut min, mut max) = (0.0f64, f64::INFINITY);
        for &(p, q) in pairs {
            let limit = alpha * q + (1.0 - alpha) * c;
            if p > 0.0 {
                max = max.min(limit / p);
            } else if limit < 0.0 {
                min = min.max(limit / p);
            }
        }
        if min <= max { max } else { -1.0 }
    };
    // Concave in α on the feasible interval, which begins at zero: ternary search.
    let (mut low, mut high) = (0.0, 1.0);
    for _ in 0..SEARCH_STEPS {
        let (a, b) = ((2.0 * low + high) / 3.0, (low + 2.0 * high) / 3.0);
        if max_scale_at(a) < max_scale_at(b) {
            low = a;
        } else {
            high = b;
        }
    }
    let best = max_scale_at(low).max(max_scale_at(high));
    if best.is_finite() { best.max(0.0) } else { 0.0 }
}
