//! Basis pursuit denoising in any orthonormal basis, by a primal-dual interior-point method
//! (Boyd & Vandenberghe 2004, section 11.7) with Mehrotra's predictor and corrector (1992).
//!
//! `min Σ t : −t ≤ φᵀx ≤ t, x ≥ 0, ½(ε² − ‖y − Ax‖²) ≥ 0` has the multipliers `½(1 + s)` and
//! `½(1 − s)`, w, and λ. At the optimum `φs = w + λAᵀ(y − Ax)`, and every constraint times its
//! multiplier is zero. Newton's method takes those products to a μ that falls step by step. t, s, w
//! and λ are eliminated, which leaves one system of the window's size to factor for each of the ten
//! to twenty steps. Splitting methods, whose steps are cheap, take thousands of them: with few
//! patterns, or as ε nears ‖y‖, the problem nears a linear program.

use super::SparsityBasis;
use super::solution::{Constraint, Solution};
use super::window::Window;
use crate::linalg::{self, add_scaled, dot, vectorise};

/// Relative duality gap at which a solution is good: noise moves the objective by far more.
const GAP: f64 = 2e-3;
/// A proof is tried for where the products add up to no more than this many times the gap allowed.
const NEAR: f64 = 10.0;
/// Share of the way to the nearest bound that a step goes.
const SHORT: f64 = 0.95;
/// Steps for one right-hand side, several times what it takes.
const MOST_STEPS: usize = 60;
/// Room to the constraint's bound that the start must have, as a share of least squares', and how
/// often it is halved to get there.
const ROOM: f64 = 0.5;
const HALVINGS: usize = 60;

/// Solver for right-hand sides that share one matrix.
#[derive(Debug)]
pub struct InteriorPoint {
    window: Window,
}

impl InteriorPoint {
    /// A solver for `Aᵀ = columns`, `[k, rows]`, whose unknowns are the elements `slots` of a window
    /// of `side²`.
    pub fn new(
        basis: SparsityBasis,
        columns: &[f64],
        rows: usize,
        slots: &[usize],
        side: usize,
    ) -> Self {
        Self {
            window: Window::new(basis, columns, rows, slots, side),
        }
    }

    /// Solves for any number of right-hand sides. Every `x` is non-negative, and
    /// `‖y − Ax‖ ≤ epsilon` to rounding; where no x satisfies it, `x` is the least-squares solution.
    pub fn solve(&self, constraints: &[Constraint]) -> Vec<Solution> {
        let window = &self.window;
        let mut gram = None;
        let solve_one = |constraint: &Constraint| {
            // Where zero or nothing satisfies the constraint there is nothing to search for.
            let dark = dot(constraint.y, constraint.y).sqrt() <= constraint.epsilon;
            let x = match dark {
                true => vec![0.0; window.unknowns()],
                false => constraint.least_squares.to_vec(),
            };
            let mut best = Solution {
                objective: window.objective(&x),
                x,
                bound: 0.0,
            };
            let least = window.difference(constraint.least_squares, constraint.y);
            if !dark && dot(&least, &least).sqrt() < constraint.epsilon {
                let gram = gram.get_or_insert_with(|| {
                    vectorise(
                        #[inline(always)]
                        || window.gram(),
                    )
                });
                vectorise(
                    #[inline(always)]
                    || improve(window, gram, constraint, &mut best),
                );
            }
            best
        };
        constraints.iter().map(solve_one).collect()
    }
}

/// Improves `best`, which is feasible, until the gap is closed or no step brings more.
#[inline(always)]
fn improve(window: &Window, gram: &[f64], constraint: &Constraint, best: &mut Solution) {
    let Some(mut point) = Point::new(window, constraint) else {
        return;
    };
    for _ in 0..MOST_STEPS {
        if point.products() <= NEAR * GAP * best.objective {
            window.record(constraint, point.x.clone(), &point.s, best);
            if best.gap() <= GAP {
                return;
            }
        }
        let Some(system) = System::new(window, gram, &point) else {
            break;
        };
        let step = system.step();
        point.advance(window, constraint, &step);
        if !point.inside() {
            return;
        }
    }
    window.record(constraint, point.x.clone(), &point.s, best);
}

/// Unknowns and multipliers, with what follows from them.
struct Point {
    /// `[k]`.
    x: Vec<f64>,
    w: Vec<f64>,
    /// `[side²]`.
    t: Vec<f64>,
    s: Vec<f64>,
    lambda: f64,
    /// `φᵀx`, `[side²]`, and `y − Ax`, `[rows]`.
    coefficients: Vec<f64>,
    residual: Vec<f64>,
    /// `½(ε² − ‖y − Ax‖²)`.
    room: f64,
}

/// Changes of a [`Point`].
struct Step {
    x: Vec<f64>,
    w: Vec<f64>,
    t: Vec<f64>,
    s: Vec<f64>,
    lambda: f64,
    coefficients: Vec<f64>,
    residual: Vec<f64>,
}

/// What is wanted of the products of constraints and multipliers: how much each is to change.
struct Wanted {
    /// Of `½(1 + s)(t − φᵀx)` and `½(1 − s)(t + φᵀx)`, `[side²]`.
    low: Vec<f64>,
    high: Vec<f64>,
    /// Of `w x`, `[k]`, and of λ's.
    x: Vec<f64>,
    room: f64,
}

#[inline(always)]
fn room(constraint: &Constraint, residual: &[f64]) -> f64 {
    let size = dot(residual, residual).sqrt();
    0.5 * (constraint.epsilon - size) * (constraint.epsilon + size)
}

impl Point {
    /// A point inside all constraints, from the least-squares solution made a little brighter.
    #[inline(always)]
    fn new(window: &Window, constraint: &Constraint) -> Option<Self> {
        let least = constraint.least_squares;
        let most = room(constraint, &window.difference(least, constraint.y));
        let mut brighter = least.iter().sum::<f64>() / least.len() as f64;
        for _ in 0..HALVINGS {
            let x: Vec<f64> = least.iter().map(|x| x + brighter).collect();
            let residual = window.difference(&x, constraint.y);
            let room = room(constraint, &residual);
            if room > ROOM * most && x.iter().all(|&x| x > 0.0) {
                let coefficients = window.coefficients(&x);
                let total: f64 = coefficients.iter().map(|c| c.abs()).sum();
                let mu = total / (2 * coefficients.len() + x.len() + 1) as f64;
                let t: Vec<f64> = coefficients.iter().map(|c| mu + mu.hypot(*c)).collect();
                return Some(Self {
                    s: coefficients.iter().zip(&t).map(|(c, t)| c / t).collect(),
                    t,
                    // φs has entries of about this size: more would only have to be undone.
                    w: (x.iter())
                        .map(|x| (mu / x).min(1.0 / window.side() as f64))
                        .collect(),
                    lambda: mu / room,
                    coefficients,
                    residual,
                    room,
                    x,
                });
            }
            brighter *= 0.5;
        }
        None
    }

    fn inside(&self) -> bool {
        self.room > 0.0 && self.x.iter().all(|&x| x > 0.0)
    }

    /// The sum of all products of constraints and multipliers.
    #[inline(always)]
    fn products(&self) -> f64 {
        // ½(1 + s)(t − c) + ½(1 − s)(t + c) = t − sc
        let bounds = self.t.iter().sum::<f64>() - dot(&self.s, &self.coefficients);
        bounds + dot(&self.x, &self.w) + self.lambda * self.room
    }

    /// How many products there are.
    fn count(&self) -> f64 {
        (2 * self.s.len() + self.x.len() + 1) as f64
    }

    /// The largest shares of a step, up to one, that unknowns and multipliers can go.
    #[inline(always)]
    fn reach(&self, step: &Step) -> (f64, f64) {
        let limit = |value: f64, change: f64| match change < 0.0 {
            true => -value / change,
            false => 1.0,
        };
        let (mut primal, mut dual) = (1.0f64, limit(self.lambda, step.lambda).min(1.0));
        for ((x, w), (dx, dw)) in (self.x.iter().zip(&self.w)).zip(step.x.iter().zip(&step.w)) {
            primal = primal.min(limit(*x, *dx));
            dual = dual.min(limit(*w, *dw));
        }
        let values = (self.t.iter().zip(&self.s)).zip(&self.coefficients);
        let changes = (step.t.iter().zip(&step.s)).zip(&step.coefficients);
        for (((t, s), c), ((dt, ds), dc)) in values.zip(changes) {
            primal = primal.min(limit(t - c, dt - dc)).min(limit(t + c, dt + dc));
            dual = dual.min(limit(1.0 + s, *ds)).min(limit(1.0 - s, -ds));
        }
        // Where the residual is as large as may be.
        let (a, b) = (
            dot(&step.residual, &step.residual),
            dot(&step.residual, &self.residual),
        );
        if a > 0.0 {
            primal = primal.min(((b * b + 2.0 * a * self.room).sqrt() - b) / a);
        }
        (primal, dual)
    }

    /// What [`Self::products`] would be after these shares of a step.
    #[inline(always)]
    fn products_after(&self, step: &Step, (primal, dual): (f64, f64)) -> f64 {
        let mut sum = 0.0;
        let values = (self.t.iter().zip(&self.s)).zip(&self.coefficients);
        let changes = (step.t.iter().zip(&step.s)).zip(&step.coefficients);
        for (((t, s), c), ((dt, ds), dc)) in values.zip(changes) {
            sum += t + primal * dt - (s + dual * ds) * (c + primal * dc);
        }
        for ((x, w), (dx, dw)) in (self.x.iter().zip(&self.w)).zip(step.x.iter().zip(&step.w)) {
            sum += (x + primal * dx) * (w + dual * dw);
        }
        let (a, b) = (
            dot(&step.residual, &step.residual),
            dot(&step.residual, &self.residual),
        );
        let room = self.room - primal * b - 0.5 * primal * primal * a;
        sum + (self.lambda + dual * step.lambda) * room
    }

    /// Goes nearly as far along a step as it can.
    #[inline(always)]
    fn advance(&mut self, window: &Window, constraint: &Constraint, step: &Step) {
        let (primal, dual) = self.reach(step);
        let far = |reach: f64| if reach < 1.0 { SHORT * reach } else { 1.0 };
        let (primal, dual) = (far(primal), far(dual));
        add_scaled(&mut self.x, primal, &step.x);
        add_scaled(&mut self.t, primal, &step.t);
        add_scaled(&mut self.w, dual, &step.w);
        add_scaled(&mut self.s, dual, &step.s);
        self.lambda += dual * step.lambda;
        self.coefficients = window.coefficients(&self.x);
        self.residual = window.difference(&self.x, constraint.y);
        self.room = room(constraint, &self.residual);
    }
}

/// Newton's system at a point, factored.
struct System<'a> {
    window: &'a Window,
    point: &'a Point,
    /// `Aᵀ(y − Ax)`, and what is missing in `φs = w + λAᵀ(y − Ax)`, `[k]`.
    correlation: Vec<f64>,
    missing: Vec<f64>,
    /// `½(1 − s)(t − φᵀx) + ½(1 + s)(t + φᵀx)`, and how s changes with `φᵀx`, `[side²]`.
    spread: Vec<f64>,
    curvature: Vec<f64>,
    /// The upper factor of what is left for x, `[k, k]`.
    factor: Vec<f64>,
}

impl<'a> System<'a> {
    #[inline(always)]
    fn new(window: &'a Window, gram: &[f64], point: &'a Point) -> Option<Self> {
        let k = window.unknowns();
        let correlation = window.correlate(&point.residual);
        let mut missing = window.synthesize(&point.s);
        for ((m, w), c) in missing.iter_mut().zip(&point.w).zip(&correlation) {
            *m -= w + point.lambda * c;
        }
        let values = (point.t.iter().zip(&point.s)).zip(&point.coefficients);
        let spread: Vec<f64> = values.map(|((t, s), c)| t + s * c).collect();
        let curvature: Vec<f64> = (point.s.iter().zip(&spread))
            .map(|(s, spread)| (1.0 - s) * (1.0 + s) / spread)
            .collect();
        let mut factor = window.sandwich(&curvature);
        let rows = factor.chunks_exact_mut(k).zip(gram.chunks_exact(k));
        for (i, (row, gram)) in rows.enumerate() {
            let outer = point.lambda / point.room * correlation[i];
            let others = gram[i..].iter().zip(&correlation[i..]);
            for (h, (g, c)) in row[i..].iter_mut().zip(others) {
                *h += point.lambda * g + outer * c;
            }
            row[i] += point.w[i] / point.x[i];
        }
        linalg::cholesky(&mut factor, k)?;
        Some(Self {
            window,
            point,
            correlation,
            missing,
            spread,
            curvature,
            factor,
        })
    }

    /// Towards products that are all alike, and as small as a step to zero shows that they can be;
    /// that step shows, too, what a linear model leaves out.
    #[inline(always)]
    fn step(&self) -> Step {
        let point = self.point;
        let products = self.products();
        let zero = Wanted {
            low: products.low.iter().map(|p| -p).collect(),
            high: products.high.iter().map(|p| -p).collect(),
            x: products.x.iter().map(|p| -p).collect(),
            room: -products.room,
        };
        let predicted = self.towards(&zero);
        let before = point.products();
        let after = point.products_after(&predicted, point.reach(&predicted));
        let mu = (after / before).clamp(0.0, 1.0).powi(3) * before / point.count();
        let mut wanted = zero;
        let changes = (predicted.t.iter().zip(&predicted.s)).zip(&predicted.coefficients);
        let bounds = wanted.low.iter_mut().zip(&mut wanted.high);
        for ((low, high), ((dt, ds), dc)) in bounds.zip(changes) {
            *low += mu - 0.5 * ds * (dt - dc);
            *high += mu + 0.5 * ds * (dt + dc);
        }
        for ((x, dx), dw) in wanted.x.iter_mut().zip(&predicted.x).zip(&predicted.w) {
            *x += mu - dx * dw;
        }
        wanted.room += mu - predicted.lambda * dot(&self.correlation, &predicted.x)
            + 0.5 * point.lambda * dot(&predicted.residual, &predicted.residual);
        self.towards(&wanted)
    }

    /// The products of constraints and multipliers.
    #[inline(always)]
    fn products(&self) -> Wanted {
        let point = self.point;
        let values = || (point.t.iter().zip(&point.s)).zip(&point.coefficients);
        Wanted {
            low: values()
                .map(|((t, s), c)| 0.5 * (1.0 + s) * (t - c))
                .collect(),
            high: values()
                .map(|((t, s), c)| 0.5 * (1.0 - s) * (t + c))
                .collect(),
            x: point.x.iter().zip(&point.w).map(|(x, w)| x * w).collect(),
            room: point.lambda * point.room,
        }
    }

    /// The step that, to first order, changes products as wanted and leaves nothing missing.
    #[inline(always)]
    fn towards(&self, wanted: &Wanted) -> Step {
        let point = self.point;
        // How s would change if x did not.
        let mut s: Vec<f64> = (wanted.low.iter().zip(&wanted.high))
            .zip(point.s.iter().zip(&self.spread))
            .map(|((low, high), (s, spread))| ((1.0 - s) * low - (1.0 + s) * high) / spread)
            .collect();
        let mut x = self.window.synthesize(&s);
        for (i, x) in x.iter_mut().enumerate() {
            *x = wanted.x[i] / point.x[i] + self.correlation[i] * wanted.room / point.room
                - self.missing[i]
                - *x;
        }
        linalg::cholesky_solve(&self.factor, &mut x);
        let coefficients = self.window.coefficients(&x);
        for ((s, curvature), c) in s.iter_mut().zip(&self.curvature).zip(&coefficients) {
            *s += curvature * c;
        }
        let t = (wanted.low.iter().zip(&wanted.high))
            .zip(point.s.iter().zip(&point.coefficients))
            .zip(s.iter().zip(&coefficients))
            .map(|(((low, high), (s, c)), (ds, dc))| low + high + ds * c + s * dc)
            .collect();
        let w = (wanted.x.iter().zip(&x))
            .zip(point.x.iter().zip(&point.w))
            .map(|((wanted, dx), (x, w))| (wanted - w * dx) / x)
            .collect();
        let nothing = vec![0.0; point.residual.len()];
        Step {
            residual: self.window.difference(&x, &nothing),
            lambda: (wanted.room - point.lambda * dot(&self.correlation, &x)) / point.room,
            x,
            w,
            t,
            s,
            coefficients,
        }
    }
}

#[cfg(all(test, not(target_arch = "wasm32")))] // where there is proptest
mod tests {
    use proptest::prelude::*;

    use super::super::super::test_problems::Problem;
    use super::*;
    use crate::recover::{Homotopy, Nnls};

    /// Columns, slots and a solver for a window of five elements a side with `missing` first ones
    /// off the display.
    fn window(
        basis: SparsityBasis,
        rows: usize,
        missing: usize,
        seed: u64,
    ) -> (Problem, InteriorPoint) {
        let side = 5;
        let slots: Vec<usize> = (missing..side * side).collect();
        let problem = Problem::random(slots.len(), rows, seed, 0.5);
        let columns = linalg::transpose(&problem.matrix, slots.len());
        let denoiser = InteriorPoint::new(basis, &columns, rows, &slots, side);
        (problem, denoiser)
    }

    fn norm_in_basis(basis: SparsityBasis, missing: usize, x: &[f64]) -> f64 {
        let side = 5;
        let b = basis.along_axis(side);
        let mut total = 0.0f64;
        for p in 0..side {
            for q in 0..side {
                let mut coefficient = 0.0;
                for (i, &x) in x.iter().enumerate() {
                    let (v, u) = ((i + missing) / side, (i + missing) % side);
                    coefficient += b[p * side + v] * b[q * side + u] * x;
                }
                total += coefficient.abs();
            }
        }
        total
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(200))]

        /// For ε from 2 % of ‖y‖ to above it: feasible to rounding, non-negative, objective as
        /// stated, and the gap to a proven bound small; least squares where nothing is feasible,
        /// dark where zero is.
        #[test]
        fn answers_are_feasible_and_the_gap_closes(
            dct in any::<bool>(), rows in 4usize..30, missing in 0usize..8, seed in any::<u64>(),
            share in 0.02f64..1.1,
        ) {
            let basis = if dct { SparsityBasis::Dct } else { SparsityBasis::Haar };
            let (problem, denoiser) = window(basis, rows, missing, seed);
            let gram = problem.gram();
            let k = 25 - missing;
            let mut solver = Nnls::new(&gram, k);
            for y in &problem.measurements {
                let least_squares = solver.solve(&problem.right_hand_side(y));
                let least = problem.residual(&least_squares, y);
                let size = Problem::energy(y).sqrt();
                let epsilon = share * size;
                let constraint = Constraint { y, epsilon, least_squares: &least_squares };
                let solution = denoiser.solve(&[constraint]).remove(0);
                prop_assert!(solution.x.iter().all(|&x| x >= 0.0));
                let objective = norm_in_basis(basis, missing, &solution.x);
                prop_assert!((objective - solution.objective).abs() <= 1e-9 * (1.0 + objective));
                if epsilon < size && epsilon <= least {
                    prop_assert_eq!(&solution.x, &least_squares);
                    continue;
                }
                let residual = problem.residual(&solution.x, y);
                prop_assert!(residual <= epsilon + 1e-9 * size, "{residual} > {epsilon}");
                prop_assert!(solution.bound <= objective * (1.0 + 1e-9));
                prop_assert!(
                    objective - solution.bound <= GAP * objective,
                    "{objective} is not near {} at {share}, least {}", solution.bound, least / size
                );
            }
        }

        /// With φ = I the homotopy is an independent solver of the same problem.
        #[test]
        fn agrees_with_the_homotopy(rows in 4usize..30, seed in any::<u64>(), share in 0.02f64..0.98) {
            let (problem, denoiser) = window(SparsityBasis::Identity, rows, 0, seed);
            let gram = problem.gram();
            for y in &problem.measurements {
                let h = problem.right_hand_side(y);
                let least_squares = Nnls::new(&gram, 25).solve(&h);
                let least = problem.residual(&least_squares, y);
                let epsilon = least + share * (Problem::energy(y).sqrt() - least);
                let exact = Homotopy::new(&gram, 25).solve(&h, Problem::energy(y), epsilon);
                let constraint = Constraint { y, epsilon, least_squares: &least_squares };
                let found = denoiser.solve(&[constraint]).remove(0);
                let best: f64 = exact.iter().sum();
                prop_assert!((found.objective - best).abs() <= GAP * best + 1e-9);
            }
        }
    }

    #[test]
    fn what_is_dark_to_within_noise_is_dark() {
        let (problem, denoiser) = window(SparsityBasis::Haar, 30, 0, 7);
        let y = &problem.measurements[0];
        let least_squares = Nnls::new(&problem.gram(), 25).solve(&problem.right_hand_side(y));
        let constraint = Constraint {
            y,
            epsilon: 1.01 * Problem::energy(y).sqrt(),
            least_squares: &least_squares,
        };
        let solution = denoiser.solve(&[constraint]).remove(0);
        assert!(solution.x.iter().all(|&x| x == 0.0) && solution.objective == 0.0);
    }

    #[test]
    fn an_impossible_constraint_gives_least_squares() {
        let (problem, denoiser) = window(SparsityBasis::Dct, 30, 0, 7);
        let y = &problem.measurements[0];
        let least_squares = Nnls::new(&problem.gram(), 25).solve(&problem.right_hand_side(y));
        let epsilon = 0.5 * problem.residual(&least_squares, y);
        let constraint = Constraint {
            y,
            epsilon,
            least_squares: &least_squares,
        };
        let solution = denoiser.solve(&[constraint]).remove(0);
        for (x, least) in solution.x.iter().zip(&least_squares) {
            assert!((x - least).abs() < 1e-9);
        }
    }
}
