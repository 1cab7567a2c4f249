//! The iterate of the interior-point method: unknowns, multipliers and the constraints' slacks.
//!
//! Notation as in [`interior_point`](super::interior_point), with coefficients `c = φᵀx`.

use super::dual_bound::BpdnConstraint;
use super::sensing_operator::SensingOperator;
use crate::linalg::{add_scaled, dot};

/// Share of the way to the nearest bound that a step goes.
const STEP_SHARE: f64 = 0.95;
/// Slack of the residual's constraint at the first iterate, as a share of the least-squares solution's, and
/// how often the brightening is halved to reach it.
const MIN_INITIAL_SLACK_SHARE: f64 = 0.5;
const MAX_HALVINGS: usize = 60;

/// Unknowns and multipliers, with what follows from them; or their changes.
#[derive(Clone)]
pub(super) struct Iterate {
    /// `[k]`.
    pub x: Vec<f64>,
    pub w: Vec<f64>,
    /// `[side²]`.
    pub t: Vec<f64>,
    pub s: Vec<f64>,
    pub lambda: f64,
    /// c, `[side²]`, and `y − Ax`, `[L]`.
    pub coefficients: Vec<f64>,
    pub residual: Vec<f64>,
    /// `½(ε² − ‖y − Ax‖²)`.
    pub slack: f64,
}

/// Changes of an iterate, to first order.
pub(super) type NewtonStep = Iterate;

/// `½(ε² − ‖residual‖²)`.
#[cfg_attr(target_arch = "x86_64", inline(always))]
fn slack(constraint: &BpdnConstraint, residual: &[f64]) -> f64 {
    let norm = dot(residual, residual).sqrt();
    0.5 * (constraint.epsilon - norm) * (constraint.epsilon + norm)
}

impl Iterate {
    /// A strictly feasible iterate: the least-squares solution plus a constant; `None` if there is none.
    #[cfg_attr(target_arch = "x86_64", inline(always))]
    pub fn new(operator: &SensingOperator, constraint: &BpdnConstraint) -> Option<Self> {
        let least_squares = constraint.least_squares;
        let max_slack = slack(constraint, &operator.residual(least_squares, constraint.y));
        let mut offset = least_squares.iter().sum::<f64>() / least_squares.len() as f64;
        for _ in 0..MAX_HALVINGS {
            let x: Vec<f64> = least_squares.iter().map(|x| x + offset).collect();
            let residual = operator.residual(&x, constraint.y);
            let slack = slack(constraint, &residual);
            if slack > MIN_INITIAL_SLACK_SHARE * max_slack && x.iter().all(|&x| x > 0.0) {
                let coefficients = operator.coefficients(&x);
                let total: f64 = coefficients.iter().map(|c| c.abs()).sum();
                let mu = total / (2 * coefficients.len() + x.len() + 1) as f64;
                let t: Vec<f64> = coefficients
                    .iter()
                    .map(|c| mu + (mu * mu + c * c).sqrt())
                    .collect();
                return Some(Self {
                    s: coefficients.iter().zip(&t).map(|(c, t)| c / t).collect(),
                    t,
                    // At most the size of φs's entries, so that steps need not shrink w first.
                    w: x.iter()
                        .map(|x| (mu / x).min(1.0 / operator.side as f64))
                        .collect(),
                    lambda: mu / slack,
                    coefficients,
                    residual,
                    slack,
                    x,
                });
            }
            offset *= 0.5;
        }
        None
    }

    /// Whether the last step kept the constraints on x and on the residual; those on t and the multipliers
    /// hold by the length of steps.
    pub fn is_strictly_feasible(&self) -> bool {
        self.slack > 0.0 && self.x.iter().all(|&x| x > 0.0)
    }

    /// The sum of all products of slacks and multipliers.
    #[cfg_attr(target_arch = "x86_64", inline(always))]
    pub fn complementarity(&self) -> f64 {
        // ½(1 + s)(t − c) + ½(1 − s)(t + c) = t − sc
        let bounds = self.t.iter().sum::<f64>() - dot(&self.s, &self.coefficients);
        bounds + dot(&self.x, &self.w) + self.lambda * self.slack
    }

    /// t, s and c for each coefficient.
    #[cfg_attr(target_arch = "x86_64", inline(always))]
    pub fn bounds(&self) -> impl Iterator<Item = [f64; 3]> {
        let values = self.t.iter().zip(&self.s).zip(&self.coefficients);
        values.map(|((t, s), c)| [*t, *s, *c])
    }

    /// Number of inequality constraints.
    pub fn constraints(&self) -> f64 {
        (2 * self.s.len() + self.x.len() + 1) as f64
    }

    /// The largest shares of a step, up to one, that keep the constraints: of the unknowns' part and of the
    /// multipliers'.
    #[cfg_attr(target_arch = "x86_64", inline(always))]
    pub fn max_step_lengths(&self, step: &NewtonStep) -> (f64, f64) {
        let limit = |value: f64, change: f64| match change < 0.0 {
            true => -value / change,
            false => 1.0,
        };
        let (mut primal, mut dual) = (1.0f64, limit(self.lambda, step.lambda).min(1.0));
        for ((x, w), (dx, dw)) in (self.x.iter().zip(&self.w)).zip(step.x.iter().zip(&step.w)) {
            primal = primal.min(limit(*x, *dx));
            dual = dual.min(limit(*w, *dw));
        }
        for ([t, s, c], [dt, ds, dc]) in self.bounds().zip(step.bounds()) {
            primal = primal.min(limit(t - c, dt - dc)).min(limit(t + c, dt + dc));
            dual = dual.min(limit(1.0 + s, ds)).min(limit(1.0 - s, -ds));
        }
        // The share at which ‖y − Ax‖ = ε.
        let a = dot(&step.residual, &step.residual);
        let b = dot(&step.residual, &self.residual);
        if a > 0.0 {
            primal = primal.min(((b * b + 2.0 * a * self.slack).sqrt() - b) / a);
        }
        (primal, dual)
    }

    /// [`complementarity`](Self::complementarity) after these shares of a step.
    #[cfg_attr(target_arch = "x86_64", inline(always))]
    pub fn complementarity_after(&self, step: &NewtonStep, (primal, dual): (f64, f64)) -> f64 {
        let mut sum = 0.0;
        for ([t, s, c], [dt, ds, dc]) in self.bounds().zip(step.bounds()) {
            sum += t + primal * dt - (s + dual * ds) * (c + primal * dc);
        }
        for ((x, w), (dx, dw)) in (self.x.iter().zip(&self.w)).zip(step.x.iter().zip(&step.w)) {
            sum += (x + primal * dx) * (w + dual * dw);
        }
        let a = dot(&step.residual, &step.residual);
        let b = dot(&step.residual, &self.residual);
        let slack = self.slack - primal * b - 0.5 * primal * primal * a;
        sum + (self.lambda + dual * step.lambda) * slack
    }

    /// Goes along a step, `share` of nearly as far as the constraints allow.
    #[cfg_attr(target_arch = "x86_64", inline(always))]
    pub fn take_step(
        &mut self,
        operator: &SensingOperator,
        constraint: &BpdnConstraint,
        step: &NewtonStep,
        share: f64,
    ) {
        let (primal, dual) = self.max_step_lengths(step);
        let shorten = |length: f64| match length < 1.0 {
            true => share * STEP_SHARE * length,
            false => share,
        };
        let (primal, dual) = (shorten(primal), shorten(dual));
        add_scaled(&mut self.x, primal, &step.x);
        add_scaled(&mut self.t, primal, &step.t);
        add_scaled(&mut self.w, dual, &step.w);
        add_scaled(&mut self.s, dual, &step.s);
        self.lambda += dual * step.lambda;
        self.coefficients = operator.coefficients(&self.x);
        self.residual = operator.residual(&self.x, constraint.y);
        self.slack = slack(constraint, &self.residual);
    }
}
