//! Basis pursuit denoising by a barrier method (Boyd & Vandenberghe 2004, sections 11.3 and 11.6):
//! some tens of factorisations of the window's size for each right-hand side, far dearer than
//! splitting, but sure to end wherever the constraint leaves room.
//!
//! `Σ t` over `|φᵀx|_i ≤ t_i`, `x > 0` and `‖y − Ax‖ < ε` is minimised with a logarithmic barrier of
//! weight μ at each of these. The best t for an x is known, `t = μ + √(μ² + c²)` for `c = φᵀx`, which
//! leaves x to Newton's method. Where that ends, `s = c / t` and `ν = 2μ (y − Ax) / (ε² − ‖y − Ax‖²)`
//! satisfy the dual's constraint `Aᵀν = φs − μ/x`, and prove how near the optimum is.

use super::super::dense;
use super::super::vector::dot;
use super::splitting::{Constraint, GAP, Solution, Splitting};

/// Factor between one weight of the barrier and the next.
const WEIGHT_STEP: f64 = 0.1;
/// Squared Newton decrement below which x is near enough to a weight's optimum: the dual's
/// constraint is violated by about the square root of it.
const CENTRED: f64 = 1e-8;
/// Newton steps for one right-hand side, many more than it takes.
const MOST_STEPS: usize = 200;
/// Share of what the gradient promises that a step has to bring.
const WORTHWHILE: f64 = 0.05;

/// x and what follows from it.
struct Point {
    x: Vec<f64>,
    /// `φᵀx`, `[side²]`, and `y − Ax`, `[rows]`.
    coefficients: Vec<f64>,
    residual: Vec<f64>,
    /// `ε² − ‖y − Ax‖²`.
    room: f64,
}

impl Point {
    #[inline(always)]
    fn new(problem: &Splitting, constraint: &Constraint, x: Vec<f64>) -> Self {
        let residual = problem.difference(&x, constraint.y);
        let size = dot(&residual, &residual).sqrt();
        Self {
            coefficients: problem.coefficients(&x),
            room: (constraint.epsilon - size) * (constraint.epsilon + size),
            residual,
            x,
        }
    }

    fn inside(&self) -> bool {
        self.room > 0.0 && self.x.iter().all(|&x| x > 0.0)
    }

    /// The function that Newton's method minimises.
    fn value(&self, weight: f64) -> f64 {
        let terms = self.coefficients.iter().map(|c| {
            let t = weight + weight.hypot(*c);
            t / weight - (2.0 * weight * t).ln()
        });
        terms.sum::<f64>() - self.x.iter().map(|x| x.ln()).sum::<f64>() - self.room.ln()
    }
}

/// Improves `best`, which is feasible, until the gap is closed.
#[inline(always)]
pub(super) fn improve(
    problem: &Splitting,
    gram: &[f64],
    constraint: &Constraint,
    best: &mut Solution,
) {
    let Some(mut point) = start(problem, constraint) else {
        return;
    };
    let k = point.x.len();
    let mut weight = best.objective / k as f64;
    for _ in 0..MOST_STEPS {
        let signs: Vec<f64> = (point.coefficients.iter())
            .map(|c| c / (weight + weight.hypot(*c)))
            .collect();
        let correlation = problem.correlate(&point.residual);
        let outward = problem.synthesize(&signs);
        // Gradient and Hessian.
        let mut step: Vec<f64> = (outward.iter().zip(&correlation).zip(&point.x))
            .map(|((o, c), x)| 1.0 / x + 2.0 * c / point.room - o / weight)
            .collect();
        let downhill = step.clone();
        let curvature: Vec<f64> = (point.coefficients.iter())
            .map(|c| 1.0 / (weight.hypot(*c) * (weight + weight.hypot(*c))))
            .collect();
        let mut hessian = problem.sandwich(&curvature);
        for (i, (row, gram)) in hessian
            .chunks_exact_mut(k)
            .zip(gram.chunks_exact(k))
            .enumerate()
        {
            let outer = 4.0 * correlation[i] / (point.room * point.room);
            for ((h, g), c) in row.iter_mut().zip(gram).zip(&correlation) {
                *h += 2.0 * g / point.room + outer * c;
            }
            row[i] += 1.0 / (point.x[i] * point.x[i]);
        }
        if dense::cholesky(&mut hessian, k).is_none() {
            return;
        }
        dense::solve(&hessian, &mut step);
        let decrement = dot(&step, &downhill);
        if !decrement.is_finite() {
            return;
        }
        if decrement <= CENTRED {
            problem.record(constraint, point.x.clone(), &signs, best);
            if best.gap() <= GAP {
                return;
            }
            weight *= WEIGHT_STEP;
            continue;
        }
        // The longest step that stays inside, then half of it until it pays.
        let blocked = point.x.iter().zip(&step).map(|(x, d)| -x / d);
        let mut length = blocked
            .filter(|&t| t > 0.0)
            .fold(1.0, |m: f64, t| m.min(0.99 * t));
        let value = point.value(weight);
        loop {
            let x = point.x.iter().zip(&step).map(|(x, d)| x + length * d);
            let next = Point::new(problem, constraint, x.collect());
            if next.inside() && next.value(weight) <= value - WORTHWHILE * length * decrement {
                point = next;
                break;
            }
            length *= 0.5;
            if length < 1e-9 {
                // As near as rounding lets it come.
                problem.record(constraint, point.x, &signs, best);
                return;
            }
        }
    }
}

/// A point well inside all constraints: the least-squares solution made a little brighter.
#[inline(always)]
fn start(problem: &Splitting, constraint: &Constraint) -> Option<Point> {
    let least = constraint.least_squares;
    let room = Point::new(problem, constraint, least.to_vec()).room;
    let mut brighter = least.iter().sum::<f64>() / least.len() as f64;
    for _ in 0..60 {
        let x = least.iter().map(|x| x + brighter).collect();
        let point = Point::new(problem, constraint, x);
        if point.inside() && point.room > 0.5 * room {
            return Some(point);
        }
        brighter *= 0.5;
    }
    None
}
