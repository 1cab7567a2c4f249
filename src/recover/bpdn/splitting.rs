//! Basis pursuit denoising in any orthonormal basis, by the alternating direction method of
//! multipliers (Boyd et al. 2011).
//!
//! `min ‖φᵀx‖₁ : ‖y − Ax‖ ≤ ε, x ≥ 0` is split into `z₁ = φᵀx`, which is shrunk, `z₂ = x`, which is
//! made non-negative, and `z₃ = Ax`, which is brought within ε of y. What is left for x is one linear
//! system, the same for all right-hand sides of a window, all iterations and all penalties ρ:
//! `2I + AᵀA`, because φ is orthonormal. Woodbury's identity makes it `L x L`, factored once.
//! Right-hand sides are solved for side by side, each matrix product one for all.
//!
//! The dual problem is `max yᵀν − ε‖ν‖ : Aᵀν ≤ φs, ‖s‖_∞ ≤ 1`. The multipliers nearly satisfy its
//! constraints, and mixing in a little of the constant basis vector makes them satisfy them, so that
//! the distance to the optimum is known at any time: iterations end by it. As ε nears ‖y‖ the
//! problem nears a linear program, on which splitting can take thousands of iterations: what is then
//! still open goes to [`interior`].

use super::super::dense;
use super::super::vector::{dot, vectorised};
use super::{SparsityBasis, interior};

/// Right-hand sides solved for side by side: the four camera pixels and three channels of a window
/// at two camera pixels an element.
const PANEL: usize = 12;
/// One number for each right-hand side.
type Lanes = [f64; PANEL];
const ZERO: Lanes = [0.0; PANEL];

/// Mean eigenvalue that `AAᵀ` is scaled to: how much the equations weigh against the other splits.
/// On glass more would be a little faster, on equations with hardly any solution much slower.
const MEAN_EIGENVALUE: f64 = 10.0;
/// Over-relaxation; 1.5 to 1.8 is usual.
const RELAXATION: f64 = 1.7;
/// Iterations between looks at gap and penalty.
const CHECK_EVERY: usize = 20;
/// Past this many iterations a barrier method goes on with those right-hand sides that are open.
const MOST_ITERATIONS: usize = 1_000;
/// Relative duality gap at which a solution is good: noise moves the objective by far more.
pub(super) const GAP: f64 = 2e-3;
/// Steps of the search for the best mixture in a bound.
const THIRDS: usize = 40;
/// 1/ρ to start with, as a share of the function's total; balancing moves it from there.
const INITIAL_SHRINK: f64 = 1e-3;

/// One right-hand side of a [`Splitting`].
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
        (self.objective - self.bound) / self.objective
    }
}

/// Solver for right-hand sides that share one matrix.
#[derive(Debug)]
pub struct Splitting {
    side: usize,
    rows: usize,
    /// The unknowns' places in the window.
    slots: Vec<usize>,
    /// φᵀ along one axis, and φ.
    analysis: Vec<f64>,
    synthesis: Vec<f64>,
    /// `βA`, `[rows, side²]`, and its transpose; zero where there is no unknown.
    matrix: Vec<f64>,
    transposed: Vec<f64>,
    /// Inverse of `2I + β²AAᵀ`, `[rows, rows]`.
    inverse: Vec<f64>,
    beta: f64,
}

impl Splitting {
    /// A solver for `Aᵀ = columns`, `[k, rows]`, whose unknowns are the elements `slots` of a window
    /// of `side²`.
    pub fn new(
        basis: SparsityBasis,
        columns: &[f64],
        rows: usize,
        slots: &[usize],
        side: usize,
    ) -> Self {
        vectorised(
            #[inline(always)]
            || Self::factor(basis, columns, rows, slots, side),
        )
    }

    #[inline(always)]
    fn factor(
        basis: SparsityBasis,
        columns: &[f64],
        rows: usize,
        slots: &[usize],
        side: usize,
    ) -> Self {
        let area = side * side;
        let energy = dot(columns, columns);
        let beta = match energy > 0.0 {
            true => (MEAN_EIGENVALUE * rows as f64 / energy).sqrt(),
            false => 1.0,
        };
        let mut transposed = vec![0.0; area * rows];
        for (&slot, column) in slots.iter().zip(columns.chunks_exact(rows.max(1))) {
            for (t, c) in transposed[slot * rows..].iter_mut().zip(column) {
                *t = beta * c;
            }
        }
        let matrix = transpose(&transposed, rows);
        let mut system = vec![0.0; rows * rows];
        for i in 0..rows {
            for j in 0..=i {
                let of = |l: usize| &matrix[l * area..(l + 1) * area];
                let value = dot(of(i), of(j)) + if i == j { 2.0 } else { 0.0 };
                system[i * rows + j] = value;
                system[j * rows + i] = value;
            }
        }
        let analysis = basis.along_axis(side);
        Self {
            side,
            rows,
            slots: slots.to_vec(),
            synthesis: transpose(&analysis, side),
            analysis,
            inverse: invert(system, rows),
            matrix,
            transposed,
            beta,
        }
    }

    /// Solves for any number of right-hand sides. Every `x` is non-negative, and
    /// `‖y − Ax‖ ≤ epsilon` to rounding; where no x satisfies it, `x` is the least-squares solution.
    pub fn solve(&self, constraints: &[Constraint]) -> Vec<Solution> {
        let mut solutions = Vec::with_capacity(constraints.len());
        let mut open = Vec::with_capacity(constraints.len());
        for (i, constraint) in constraints.iter().enumerate() {
            // Where zero or nothing satisfies the constraint there is nothing to search for.
            let dark = dot(constraint.y, constraint.y).sqrt() <= constraint.epsilon;
            let x = match dark {
                true => vec![0.0; self.slots.len()],
                false => constraint.least_squares.to_vec(),
            };
            let least = self.difference(constraint.least_squares, constraint.y);
            if !dark && dot(&least, &least).sqrt() < constraint.epsilon {
                open.push(i);
            }
            solutions.push(Solution {
                objective: self.objective(&x),
                x,
                bound: 0.0,
            });
        }
        for panel in open.chunks(PANEL) {
            let of_panel: Vec<_> = panel.iter().map(|&i| constraints[i].clone()).collect();
            let start: Vec<_> = panel.iter().map(|&i| solutions[i].clone()).collect();
            let found = vectorised(
                #[inline(always)]
                || self.solve_panel(&of_panel, start),
            );
            for (&i, solution) in panel.iter().zip(found) {
                solutions[i] = solution;
            }
        }
        solutions
    }

    /// Solves for up to [`PANEL`] right-hand sides, from feasible points `best`.
    #[inline(always)]
    fn solve_panel(&self, constraints: &[Constraint], mut best: Vec<Solution>) -> Vec<Solution> {
        let mut state = State::new(self, constraints);
        for _ in 0..MOST_ITERATIONS / CHECK_EVERY {
            for _ in 0..CHECK_EVERY {
                state.iterate(self);
            }
            let mut open = 0;
            for (lane, (constraint, best)) in constraints.iter().zip(&mut best).enumerate() {
                if best.gap() > GAP {
                    let [s, nu] = state.multipliers(lane);
                    self.record(constraint, state.candidate(self, lane), &s, best);
                    best.bound = best.bound.max(self.bound(constraint, &s, &nu));
                }
                open += usize::from(best.gap() > GAP);
            }
            if open == 0 {
                return best;
            }
            state.balance();
        }
        let gram = self.gram();
        for (constraint, best) in constraints.iter().zip(&mut best) {
            if best.gap() > GAP {
                interior::improve(self, &gram, constraint, best);
            }
        }
        best
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

    /// `‖φᵀx‖₁` of x on the unknowns.
    #[inline(always)]
    fn objective(&self, x: &[f64]) -> f64 {
        self.coefficients(x).iter().map(|c| c.abs()).sum()
    }

    /// `φᵀx` of x on the unknowns.
    #[inline(always)]
    pub(super) fn coefficients(&self, x: &[f64]) -> Vec<f64> {
        let mut window = vec![0.0; self.side * self.side];
        for (&slot, &x) in self.slots.iter().zip(x) {
            window[slot] = x;
        }
        self.transform_one(&self.analysis, &window)
    }

    /// φs on the unknowns.
    #[inline(always)]
    pub(super) fn synthesize(&self, s: &[f64]) -> Vec<f64> {
        let window = self.transform_one(&self.synthesis, s);
        self.slots.iter().map(|&slot| window[slot]).collect()
    }

    /// `M input Mᵀ` with `M` along one axis.
    #[inline(always)]
    fn transform_one(&self, along: &[f64], input: &[f64]) -> Vec<f64> {
        let side = self.side;
        let half = dense::product(along, input, side, side);
        let rows = half.chunks_exact(side);
        rows.flat_map(|row| along.chunks_exact(side).map(move |b| dot(row, b)))
            .collect()
    }

    /// `φ diag(d) φᵀ` between the unknowns, `[k, k]`.
    #[inline(always)]
    pub(super) fn sandwich(&self, d: &[f64]) -> Vec<f64> {
        let side = self.side;
        let area = side * side;
        // Along one axis for each coefficient of the other, `[p, (u, u′)]`: then sums over p.
        let products = |b: &[f64]| -> Vec<f64> {
            let pairs = (0..side).flat_map(|i| (0..side).map(move |j| (i, j)));
            pairs
                .flat_map(|(i, j)| (0..side).map(move |p| b[p * side + i] * b[p * side + j]))
                .collect()
        };
        let pairs = products(&self.analysis);
        let along = dense::product(d, &transpose(&pairs, side), side, area);
        let both = dense::product(&pairs, &along, side, area);
        let mut out = Vec::with_capacity(self.slots.len() * self.slots.len());
        for &a in &self.slots {
            let (v, u) = (a / side, a % side);
            for &b in &self.slots {
                out.push(both[(v * side + b / side) * area + u * side + b % side]);
            }
        }
        out
    }

    /// `Aᵀr` on the unknowns.
    #[inline(always)]
    pub(super) fn correlate(&self, r: &[f64]) -> Vec<f64> {
        let column = |&slot: &usize| &self.transposed[slot * self.rows..(slot + 1) * self.rows];
        let columns = self.slots.iter().map(column);
        columns.map(|column| dot(column, r) / self.beta).collect()
    }

    /// `AᵀA` between the unknowns.
    #[inline(always)]
    fn gram(&self) -> Vec<f64> {
        let column = |&slot: &usize| &self.transposed[slot * self.rows..(slot + 1) * self.rows];
        let all = self.slots.iter().flat_map(|a| {
            let others = self.slots.iter();
            others.map(move |b| dot(column(a), column(b)) / (self.beta * self.beta))
        });
        all.collect()
    }

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
        gain * farthest(&pairs, 1.0 / self.side as f64)
    }

    /// `y − Ax`.
    #[inline(always)]
    pub(super) fn difference(&self, x: &[f64], y: &[f64]) -> Vec<f64> {
        let mut difference = y.to_vec();
        for (&slot, &x) in self.slots.iter().zip(x) {
            if x != 0.0 {
                let column = &self.transposed[slot * self.rows..(slot + 1) * self.rows];
                for (d, c) in difference.iter_mut().zip(column) {
                    *d -= c * (x / self.beta);
                }
            }
        }
        difference
    }

    /// `out = M input Mᵀ` with `M` along one axis, for windows of lanes.
    #[inline(always)]
    fn transform(&self, along: &[f64], input: &[Lanes], scratch: &mut [Lanes], out: &mut [Lanes]) {
        let side = self.side;
        for u in 0..side {
            multiply(along, side, &input[u..], side, &mut scratch[u..], side);
        }
        for v in 0..side {
            let row = v * side;
            multiply(
                along,
                side,
                &scratch[row..],
                1,
                &mut out[row..row + side],
                1,
            );
        }
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

/// Everything that iterates, with the multipliers scaled by 1/ρ as usual.
struct State {
    /// The splits `z₁ z₂ z₃` and their multipliers `u₁ u₂ u₃`.
    z: [Vec<Lanes>; 3],
    u: [Vec<Lanes>; 3],
    /// What the splits are to agree with: `φᵀx`, `x`, `Ax`.
    seen: [Vec<Lanes>; 3],
    window: [Vec<Lanes>; 2],
    equations: [Vec<Lanes>; 2],
    on_display: Vec<bool>,
    /// `βy`, `βε` and `1/ρ`.
    y: Vec<Lanes>,
    epsilon: Lanes,
    shrink: Lanes,
    sums: Sums,
}

/// Squared norms of the last iteration.
#[derive(Clone, Copy, Default)]
struct Sums {
    /// Of what splits and x disagree by, and of what x says.
    primal: Lanes,
    seen: Lanes,
    /// Of how far splits moved, and of the multipliers.
    dual: Lanes,
    multipliers: Lanes,
}

impl State {
    #[inline(always)]
    fn new(problem: &Splitting, constraints: &[Constraint]) -> Self {
        let windows = || vec![ZERO; problem.side * problem.side];
        let equations = || vec![ZERO; problem.rows];
        let mut state = Self {
            z: [windows(), windows(), equations()],
            u: [windows(), windows(), equations()],
            seen: [windows(), windows(), equations()],
            window: [windows(), windows()],
            equations: [equations(), equations()],
            on_display: vec![false; problem.side * problem.side],
            y: equations(),
            epsilon: ZERO,
            shrink: [1.0; PANEL],
            sums: Sums::default(),
        };
        for &slot in &problem.slots {
            state.on_display[slot] = true;
        }
        for (lane, constraint) in constraints.iter().enumerate() {
            for (y, value) in state.y.iter_mut().zip(constraint.y) {
                y[lane] = problem.beta * value;
            }
            state.epsilon[lane] = problem.beta * constraint.epsilon;
            let total: f64 = constraint.least_squares.iter().sum();
            state.shrink[lane] = (INITIAL_SHRINK * total).max(f64::MIN_POSITIVE);
        }
        state
    }

    #[inline(always)]
    fn iterate(&mut self, problem: &Splitting) {
        let area = problem.side * problem.side;
        let [w, helper] = &mut self.window;
        let [q, t] = &mut self.equations;
        let [coefficients, x, seen_equations] = &mut self.seen;
        // w = φ(z₁ − u₁) + (z₂ − u₂), q = z₃ − u₃
        subtract(&self.z[0], &self.u[0], coefficients);
        problem.transform(&problem.synthesis, coefficients, helper, w);
        subtract(&self.z[1], &self.u[1], x);
        for (w, x) in w.iter_mut().zip(x.iter()) {
            for lane in 0..PANEL {
                w[lane] += x[lane];
            }
        }
        subtract(&self.z[2], &self.u[2], q);
        // t = (2I + AAᵀ)⁻¹ (2q − Aw), x = ½ (w + Aᵀt), Ax = q − t
        multiply(&problem.matrix, area, w, 1, seen_equations, 1);
        for (s, q) in seen_equations.iter_mut().zip(q.iter()) {
            for lane in 0..PANEL {
                s[lane] = 2.0 * q[lane] - s[lane];
            }
        }
        multiply(&problem.inverse, problem.rows, seen_equations, 1, t, 1);
        multiply(&problem.transposed, problem.rows, t, 1, x, 1);
        for (x, w) in x.iter_mut().zip(w.iter()) {
            for lane in 0..PANEL {
                x[lane] = 0.5 * (x[lane] + w[lane]);
            }
        }
        subtract(q, t, seen_equations);
        problem.transform(&problem.analysis, x, helper, coefficients);

        self.sums = Sums::default();
        let shrink = self.shrink;
        let soft = |_: usize, lane: usize, v: f64| {
            let s: f64 = shrink[lane];
            v - v.max(-s).min(s)
        };
        update(
            &mut self.sums,
            &mut self.z[0],
            &mut self.u[0],
            coefficients,
            soft,
        );
        let on_display = &self.on_display;
        let positive = |slot: usize, _: usize, v: f64| match on_display[slot] {
            true => v.max(0.0),
            false => 0.0,
        };
        update(&mut self.sums, &mut self.z[1], &mut self.u[1], x, positive);
        // z₃ is the point of the ball around y nearest to where x and multiplier are.
        let mut squares = ZERO;
        for ((y, seen), (z, u)) in self
            .y
            .iter()
            .zip(seen_equations.iter())
            .zip(self.z[2].iter().zip(&self.u[2]))
        {
            for lane in 0..PANEL {
                let d = relaxed(seen[lane], z[lane]) + u[lane] - y[lane];
                squares[lane] += d * d;
            }
        }
        let mut inside = [1.0; PANEL];
        for lane in 0..PANEL {
            if squares[lane] > self.epsilon[lane] * self.epsilon[lane] {
                inside[lane] = self.epsilon[lane] / squares[lane].sqrt();
            }
        }
        let y = &self.y;
        let ball = |l: usize, lane: usize, v: f64| y[l][lane] + inside[lane] * (v - y[l][lane]);
        update(
            &mut self.sums,
            &mut self.z[2],
            &mut self.u[2],
            seen_equations,
            ball,
        );
    }

    /// The non-negative split of one right-hand side, on the unknowns.
    fn candidate(&self, problem: &Splitting, lane: usize) -> Vec<f64> {
        let slots = problem.slots.iter();
        slots.map(|&slot| self.z[1][slot][lane]).collect()
    }

    /// The multipliers `s = ρu₁` of one right-hand side, `[side²]`, and ν's direction.
    fn multipliers(&self, lane: usize) -> [Vec<f64>; 2] {
        let s = self.u[0].iter().map(|u| u[lane] / self.shrink[lane]);
        let nu = self.u[2].iter().map(|u| -u[lane]);
        [s.collect(), nu.collect()]
    }

    /// Moves ρ to where splits and multipliers converge alike (Wohlberg 2017).
    fn balance(&mut self) {
        for lane in 0..PANEL {
            let sums = &self.sums;
            let ratio =
                (sums.primal[lane] * sums.multipliers[lane]) / (sums.dual[lane] * sums.seen[lane]);
            if !(ratio.is_finite() && ratio > 0.0) {
                continue;
            }
            let factor = ratio.powf(0.25).clamp(0.5, 2.0);
            if (0.8..1.25).contains(&factor) {
                continue;
            }
            self.shrink[lane] /= factor;
            for u in self.u.iter_mut().flatten() {
                u[lane] /= factor;
            }
        }
    }
}

/// Between a split's old value and what x says now, beyond the latter.
#[inline(always)]
fn relaxed(seen: f64, z: f64) -> f64 {
    RELAXATION * seen + (1.0 - RELAXATION) * z
}

/// `z <- project(seen + u)` and `u <- seen + u − z`, with relaxation; `project` gets place, lane and
/// value.
#[inline(always)]
fn update(
    sums: &mut Sums,
    z: &mut [Lanes],
    u: &mut [Lanes],
    seen: &[Lanes],
    project: impl Fn(usize, usize, f64) -> f64,
) {
    for (at, ((z, u), seen)) in z.iter_mut().zip(u).zip(seen).enumerate() {
        for lane in 0..PANEL {
            let v = relaxed(seen[lane], z[lane]) + u[lane];
            let new = project(at, lane, v);
            let (apart, moved) = (seen[lane] - new, new - z[lane]);
            sums.primal[lane] += apart * apart;
            sums.seen[lane] += seen[lane] * seen[lane];
            sums.dual[lane] += moved * moved;
            z[lane] = new;
            u[lane] = v - new;
            sums.multipliers[lane] += u[lane] * u[lane];
        }
    }
}

#[inline(always)]
fn subtract(a: &[Lanes], b: &[Lanes], out: &mut [Lanes]) {
    for ((out, a), b) in out.iter_mut().zip(a).zip(b) {
        for lane in 0..PANEL {
            out[lane] = a[lane] - b[lane];
        }
    }
}

/// `out[i · out_stride] = Σ_j a[i, j] x[j · stride]` for all rows of `a`, `[_, n]`.
#[inline(always)]
fn multiply(a: &[f64], n: usize, x: &[Lanes], stride: usize, out: &mut [Lanes], out_stride: usize) {
    /// Rows at a time, that every x loaded is used for.
    const ROWS: usize = 4;
    let fours = a.chunks_exact(ROWS * n);
    let done = fours.len() * ROWS;
    for (i, row) in fours.remainder().chunks_exact(n).enumerate() {
        let mut sum = ZERO;
        for (a, x) in row.iter().zip(x.iter().step_by(stride)) {
            for lane in 0..PANEL {
                sum[lane] += a * x[lane];
            }
        }
        out[(done + i) * out_stride] = sum;
    }
    for (i, rows) in fours.enumerate() {
        let (a, rest) = rows.split_at(n);
        let (b, rest) = rest.split_at(n);
        let (c, d) = rest.split_at(n);
        let mut sums = [ZERO; ROWS];
        let coefficients = a.iter().zip(b).zip(c.iter().zip(d));
        for (((a, b), (c, d)), x) in coefficients.zip(x.iter().step_by(stride)) {
            for lane in 0..PANEL {
                sums[0][lane] += a * x[lane];
                sums[1][lane] += b * x[lane];
                sums[2][lane] += c * x[lane];
                sums[3][lane] += d * x[lane];
            }
        }
        for (r, sum) in sums.into_iter().enumerate() {
            out[(i * ROWS + r) * out_stride] = sum;
        }
    }
}

/// `[_, n]` to `[n, _]`.
fn transpose(matrix: &[f64], n: usize) -> Vec<f64> {
    let rows = matrix.len() / n.max(1);
    let columns = 0..n;
    columns
        .flat_map(|j| (0..rows).map(move |i| matrix[i * n + j]))
        .collect()
}

/// The inverse of a symmetric positive definite matrix, `[n, n]`; zero if it is not.
#[inline(always)]
fn invert(mut system: Vec<f64>, n: usize) -> Vec<f64> {
    let mut inverse = vec![0.0; n * n];
    if dense::cholesky(&mut system, n).is_some() {
        dense::invert(&system, n, &mut vec![0.0; n * n], &mut inverse);
        dense::mirror(&mut inverse, n);
    }
    inverse
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
    ) -> (Problem, Splitting) {
        let side = 5;
        let slots: Vec<usize> = (missing..side * side).collect();
        let problem = Problem::random(slots.len(), rows, seed, 0.5);
        let columns = transpose(&problem.matrix, slots.len());
        let splitting = Splitting::new(basis, &columns, rows, &slots, side);
        (problem, splitting)
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
            let (problem, splitting) = window(basis, rows, missing, seed);
            let gram = problem.gram();
            let k = 25 - missing;
            let mut solver = Nnls::new(&gram, k);
            for y in &problem.measurements {
                let least_squares = solver.solve(&problem.right_hand_side(y));
                let least = problem.residual(&least_squares, y);
                let size = Problem::energy(y).sqrt();
                let epsilon = share * size;
                let constraint = Constraint { y, epsilon, least_squares: &least_squares };
                let solution = splitting.solve(&[constraint]).remove(0);
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
            let (problem, splitting) = window(SparsityBasis::Identity, rows, 0, seed);
            let gram = problem.gram();
            for y in &problem.measurements {
                let h = problem.right_hand_side(y);
                let least_squares = Nnls::new(&gram, 25).solve(&h);
                let least = problem.residual(&least_squares, y);
                let epsilon = least + share * (Problem::energy(y).sqrt() - least);
                let exact = Homotopy::new(&gram, 25).solve(&h, Problem::energy(y), epsilon);
                let constraint = Constraint { y, epsilon, least_squares: &least_squares };
                let found = splitting.solve(&[constraint]).remove(0);
                let best: f64 = exact.iter().sum();
                prop_assert!((found.objective - best).abs() <= GAP * best + 1e-9);
            }
        }
    }

    #[test]
    fn what_is_dark_to_within_noise_is_dark() {
        let (problem, splitting) = window(SparsityBasis::Haar, 30, 0, 7);
        let y = &problem.measurements[0];
        let least_squares = Nnls::new(&problem.gram(), 25).solve(&problem.right_hand_side(y));
        let constraint = Constraint {
            y,
            epsilon: 1.01 * Problem::energy(y).sqrt(),
            least_squares: &least_squares,
        };
        let solution = splitting.solve(&[constraint]).remove(0);
        assert!(solution.x.iter().all(|&x| x == 0.0) && solution.objective == 0.0);
    }

    #[test]
    fn an_impossible_constraint_gives_least_squares() {
        let (problem, splitting) = window(SparsityBasis::Dct, 30, 0, 7);
        let y = &problem.measurements[0];
        let least_squares = Nnls::new(&problem.gram(), 25).solve(&problem.right_hand_side(y));
        let epsilon = 0.5 * problem.residual(&least_squares, y);
        let constraint = Constraint {
            y,
            epsilon,
            least_squares: &least_squares,
        };
        let solution = splitting.solve(&[constraint]).remove(0);
        for (x, least) in solution.x.iter().zip(&least_squares) {
            assert!((x - least).abs() < 1e-9);
        }
    }
}
