//! Newton's system of the interior-point method.
//!
//! Notation as in [`interior_point`](super::interior_point), with coefficients `c = φᵀx`. Linearising the
//! KKT conditions and eliminating t, s, w and λ leaves, for the step dx,
//!
//! ```text
//! H dx = right-hand side,   H = φ D φᵀ + W/X + λ (AᵀA + aaᵀ/slack),   a = Aᵀ(y − Ax)
//! ```
//!
//! with the diagonal `D = (1 − s²) / (t + sc)`, by which s changes with c.

use super::iterate::{Iterate, NewtonStep};
use super::sensing_operator::SensingOperator;
use crate::linalg::{self, dot};

/// Newton's system at an iterate, factored.
pub(super) struct NewtonSystem<'a> {
    operator: &'a SensingOperator<'a>,
    point: &'a Iterate,
    /// a, and `φs − w − λa`, `[k]`.
    correlation: Vec<f64>,
    dual_residual: Vec<f64>,
    /// `t + sc = ½(1 − s)(t − c) + ½(1 + s)(t + c)`, and D, `[side²]`.
    bound_sums: Vec<f64>,
    diagonal: Vec<f64>,
    /// The Cholesky factor of H, `[k, k]`.
    factor: Vec<f64>,
}

/// The wanted change of each product of a slack and its multiplier.
struct ComplementarityChange {
    /// Of `½(1 + s)(t − c)` and `½(1 − s)(t + c)`, `[side²]`.
    upper: Vec<f64>,
    lower: Vec<f64>,
    /// Of `w x`, `[k]`.
    x: Vec<f64>,
    /// Of `λ` times the residual's slack.
    slack: f64,
}

impl<'a> NewtonSystem<'a> {
    /// Factors H; `None` if it is singular to rounding.
    #[cfg_attr(target_arch = "x86_64", inline(always))]
    pub fn new(operator: &'a SensingOperator, point: &'a Iterate) -> Option<Self> {
        let k = operator.unknowns();
        let correlation = operator.correlate(&point.residual);
        let mut dual_residual = operator.synthesize(&point.s);
        for ((d, w), c) in dual_residual.iter_mut().zip(&point.w).zip(&correlation) {
            *d -= w + point.lambda * c;
        }
        let bound_sums: Vec<f64> = point.bounds().map(|[t, s, c]| t + s * c).collect();
        let diagonal: Vec<f64> = (point.s.iter().zip(&bound_sums))
            .map(|(s, sum)| (1.0 - s) * (1.0 + s) / sum)
            .collect();
        let mut factor = operator.weighted_gram(&diagonal);
        let gram = operator.equations.gram.chunks_exact(k);
        let rows = factor.chunks_exact_mut(k).zip(gram);
        for (i, (row, gram)) in rows.enumerate() {
            let outer = point.lambda / point.slack * correlation[i];
            let others = gram[i..].iter().zip(&correlation[i..]);
            for (h, (g, c)) in row[i..].iter_mut().zip(others) {
                *h += point.lambda * g + outer * c;
            }
            row[i] += point.w[i] / point.x[i];
        }
        linalg::cholesky(&mut factor, k)?;
        Some(Self {
            operator,
            point,
            correlation,
            dual_residual,
            bound_sums,
            diagonal,
            factor,
        })
    }

    /// Mehrotra's step. The predictor aims at products of zero; how much it lowers the complementarity
    /// determines μ. The corrector aims at products of μ and corrects for the predictor's second-order terms.
    #[cfg_attr(target_arch = "x86_64", inline(always))]
    pub fn predictor_corrector_step(&self) -> NewtonStep {
        let point = self.point;
        let upper = |[t, s, c]: [f64; 3]| -0.5 * (1.0 + s) * (t - c);
        let lower = |[t, s, c]: [f64; 3]| -0.5 * (1.0 - s) * (t + c);
        let mut change = ComplementarityChange {
            upper: point.bounds().map(upper).collect(),
            lower: point.bounds().map(lower).collect(),
            x: point.x.iter().zip(&point.w).map(|(x, w)| -x * w).collect(),
            slack: -point.lambda * point.slack,
        };
        let predictor = self.newton_step(&change);
        let before = point.complementarity();
        let after = point.complementarity_after(&predictor, point.max_step_lengths(&predictor));
        let mu = (after / before).clamp(0.0, 1.0).powi(3) * before / point.constraints();
        let bounds = change.upper.iter_mut().zip(&mut change.lower);
        for ((upper, lower), [dt, ds, dc]) in bounds.zip(predictor.bounds()) {
            *upper += mu - 0.5 * ds * (dt - dc);
            *lower += mu + 0.5 * ds * (dt + dc);
        }
        for ((x, dx), dw) in change.x.iter_mut().zip(&predictor.x).zip(&predictor.w) {
            *x += mu - dx * dw;
        }
        change.slack += mu - predictor.lambda * predictor.slack
            + 0.5 * point.lambda * dot(&predictor.residual, &predictor.residual);
        self.newton_step(&change)
    }

    /// The step that, to first order, changes the products by `change` and makes the dual residual zero.
    #[cfg_attr(target_arch = "x86_64", inline(always))]
    fn newton_step(&self, change: &ComplementarityChange) -> NewtonStep {
        let point = self.point;
        // ds for dx = 0.
        let mut s: Vec<f64> = (change.upper.iter().zip(&change.lower))
            .zip(point.s.iter().zip(&self.bound_sums))
            .map(|((upper, lower), (s, sum))| ((1.0 - s) * upper - (1.0 + s) * lower) / sum)
            .collect();
        let mut x = self.operator.synthesize(&s);
        for (i, x) in x.iter_mut().enumerate() {
            *x = change.x[i] / point.x[i] + self.correlation[i] * change.slack / point.slack
                - self.dual_residual[i]
                - *x;
        }
        linalg::cholesky_solve(&self.factor, &mut x);
        let coefficients = self.operator.coefficients(&x);
        for ((s, d), c) in s.iter_mut().zip(&self.diagonal).zip(&coefficients) {
            *s += d * c;
        }
        let t = (change.upper.iter().zip(&change.lower))
            .zip(point.s.iter().zip(&point.coefficients))
            .zip(s.iter().zip(&coefficients))
            .map(|(((upper, lower), (s, c)), (ds, dc))| upper + lower + ds * c + s * dc)
            .collect();
        let w = (change.x.iter().zip(&x))
            .zip(point.x.iter().zip(&point.w))
            .map(|((change, dx), (x, w))| (change - w * dx) / x)
            .collect();
        let zero = vec![0.0; point.residual.len()];
        let slack = dot(&self.correlation, &x);
        NewtonStep {
            residual: self.operator.residual(&x, &zero),
            lambda: (change.slack - point.lambda * slack) / point.slack,
            slack,
            x,
            w,
            t,
            s,
            coefficients,
        }
    }
}
