//! Basis pursuit denoising with φ = I, where light transport functions themselves are sparse: the homotopy method.
//!
//! The solutions of `min ½‖y − Ax‖² + λ 1ᵀx, x ≥ 0` for all λ form a piecewise linear path (LARS, Efron et
//! al. 2004; for non-negative x Mørup et al. 2008). [`Homotopy`] follows it from x = 0, the solution for
//! large λ, towards λ = 0. On a segment the passive set P is fixed, `G[P, P] x = h[P] − λ` with `G = AᵀA` and
//! `h = Aᵀy`. ‖y − Ax‖² is quadratic in λ there, so that the λ with `‖y − Ax‖ = ε`, where x solves the
//! constrained problem, is the root of a quadratic equation.

use crate::linalg::{add_scaled, vectorise};
use crate::recover::passive_set::PassiveSet;

/// Solver for right-hand sides that share one Gram matrix.
#[derive(Debug)]
pub struct Homotopy<'a> {
    k: usize,
    /// P, with solutions for a vector of ones and, at the end of the path, for the rounding error.
    passive: PassiveSet<'a, 2>,
    /// x on P. `G[P, P]⁻¹ 1` is its slope as λ falls.
    x: Vec<f64>,
    /// `h − Gx`, and its slope: λ and 1 on P.
    correlation: Vec<f64>,
    slope: Vec<f64>,
    /// Elements whose columns depend linearly on those in P.
    dependent: Vec<bool>,
}

/// Right-hand sides of the [`PassiveSet`].
const ROUNDING_ERROR: usize = 0;
const ONES: usize = 1;
/// λ, as a share of its first value, at which the path ends.
const MIN_RELATIVE_LAMBDA: f64 = 1e-10;
/// Limit of segments for each unknown. A path has about as many segments as non-zero elements at its end.
const MAX_SEGMENTS_PER_UNKNOWN: usize = 10;

/// The end of a segment of the path.
enum HomotopyBreakpoint {
    /// The residual is ε, or λ zero.
    End,
    /// This element becomes positive.
    Insert(usize),
    /// The element at this position of the passive set becomes zero.
    Remove(usize),
}

impl<'a> Homotopy<'a> {
    /// A solver for `gram = AᵀA`, `[k, k]` row-major.
    ///
    /// # Panics
    /// If `gram` does not have `k²` entries.
    pub fn new(gram: &'a [f64], k: usize) -> Self {
        Self {
            k,
            passive: PassiveSet::new(gram, k),
            x: Vec::with_capacity(k),
            correlation: vec![0.0; k],
            slope: vec![0.0; k],
            dependent: vec![false; k],
        }
    }

    /// Minimises `1ᵀx` subject to `‖y − Ax‖ ≤ epsilon`, `x ≥ 0`, with `h = Aᵀy`, `[k]`, and
    /// `energy = ‖y‖²`. Returns `x`, `[k]`: `‖y − Ax‖ = epsilon` to rounding, unless zero satisfies
    /// the constraint or nothing does, where it is the non-negative least-squares solution.
    pub fn solve(&mut self, h: &[f64], energy: f64, epsilon: f64) -> Vec<f64> {
        vectorise(
            #[cfg_attr(target_arch = "x86_64", inline(always))]
            || self.follow_path(h, energy, epsilon * epsilon),
        );
        self.passive.scatter(&self.x)
    }

    /// Follows the path to where ‖y − Ax‖² = `max_squared_residual`.
    #[cfg_attr(target_arch = "x86_64", inline(always))]
    fn follow_path(&mut self, h: &[f64], energy: f64, max_squared_residual: f64) {
        self.passive.clear();
        self.x.clear();
        self.dependent.fill(false);
        self.correlation.copy_from_slice(h);
        let mut lambda = 0.0;
        let mut first = None;
        for (j, &h) in h.iter().enumerate() {
            if h > lambda {
                (lambda, first) = (h, Some(j));
            }
        }
        let min_lambda = MIN_RELATIVE_LAMBDA * lambda;
        let Some(first) = first.filter(|_| energy > max_squared_residual) else {
            return;
        };
        self.insert(first);
        for _ in 0..MAX_SEGMENTS_PER_UNKNOWN * self.k {
            self.slope.fill(0.0);
            let passive = &self.passive;
            passive.add_product(&mut self.slope, passive.solution(ONES));
            let squared_residual = energy - self.explained(h, lambda);
            let (step, event) = self.next_event(lambda, squared_residual - max_squared_residual);
            lambda -= step;
            add_scaled(&mut self.x, step, self.passive.solution(ONES));
            add_scaled(&mut self.correlation, -step, &self.slope);
            match event {
                HomotopyBreakpoint::End => break,
                HomotopyBreakpoint::Remove(i) => {
                    self.x.swap_remove(i);
                    self.passive.remove(i);
                    self.dependent.fill(false);
                }
                HomotopyBreakpoint::Insert(j) => self.insert(j),
            }
            if lambda <= min_lambda {
                break;
            }
        }
        self.refine(h, lambda);
    }

    /// Adds an element to P unless its column depends linearly on those there.
    #[cfg_attr(target_arch = "x86_64", inline(always))]
    fn insert(&mut self, j: usize) {
        match self.passive.evaluate_and_insert(j, [0.0, 1.0]) {
            true => self.x.push(0.0),
            false => self.dependent[j] = true,
        }
    }

    /// `‖y‖² − ‖y − Ax‖²` on the path, where `h − Gx = λ` on P.
    #[cfg_attr(target_arch = "x86_64", inline(always))]
    fn explained(&self, h: &[f64], lambda: f64) -> f64 {
        let terms = self.passive.members().iter().zip(&self.x);
        terms.map(|(&j, &x)| (h[j] + lambda) * x).sum()
    }

    /// How far λ falls to the end of the segment, and that end. `excess` is the squared residual minus its limit.
    #[cfg_attr(target_arch = "x86_64", inline(always))]
    fn next_event(&self, lambda: f64, excess: f64) -> (f64, HomotopyBreakpoint) {
        // With s = 1ᵀG[P, P]⁻¹1 the squared residual falls by 2γλs − γ²s over a step γ.
        let direction = self.passive.solution(ONES);
        let root = lambda * lambda - excess / direction.iter().sum::<f64>();
        let mut step = lambda - root.max(0.0).sqrt();
        let mut event = HomotopyBreakpoint::End;
        for (i, (&x, &d)) in self.x.iter().zip(direction).enumerate() {
            if d < 0.0 && x < -d * step {
                (step, event) = ((-x / d).max(0.0), HomotopyBreakpoint::Remove(i));
            }
        }
        for (j, (&c, &f)) in self.correlation.iter().zip(&self.slope).enumerate() {
            // Whether the correlation c − γf reaches λ − γ within the step.
            if f < 1.0
                && lambda - c < (1.0 - f) * step
                && !self.passive.contains(j)
                && !self.dependent[j]
            {
                (step, event) = (
                    ((lambda - c) / (1.0 - f)).max(0.0),
                    HomotopyBreakpoint::Insert(j),
                );
            }
        }
        (step, event)
    }

    /// Removes the rounding error that x has gathered over the steps, by iterative refinement of
    /// `G[P, P] x = h[P] − λ`.
    #[cfg_attr(target_arch = "x86_64", inline(always))]
    fn refine(&mut self, h: &[f64], lambda: f64) {
        for _ in 0..2 {
            for (c, h) in self.correlation.iter_mut().zip(h) {
                *c = h - lambda;
            }
            self.passive
                .subtract_product(&mut self.correlation, &self.x);
            self.passive.set_rhs(ROUNDING_ERROR, &self.correlation);
            add_scaled(&mut self.x, 1.0, self.passive.solution(ROUNDING_ERROR));
        }
        self.x.iter_mut().for_each(|x| *x = x.max(0.0));
    }
}

#[cfg(all(test, not(target_arch = "wasm32")))] // where there is proptest
mod tests {
    use proptest::prelude::*;

    use super::*;
    use crate::recover::test_problems::Problem;

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(200))]

        /// x ≥ 0, ‖y − Ax‖ = ε, and c ≤ λ with equality where x > 0 for c = Aᵀ(y − Ax).
        #[test]
        fn solutions_satisfy_the_kkt_conditions(
            k in 1usize..24, rows in 1usize..40, seed in any::<u64>(), offset in 0.0f64..2.0,
            share in 0.01f64..1.2,
        ) {
            let problem = Problem::random(k, rows, seed, offset);
            let gram = problem.gram();
            let mut solver = Homotopy::new(&gram, k);
            for y in &problem.measurements {
                let (h, energy) = (problem.right_hand_side(y), Problem::energy(y));
                let least = problem.residual(&crate::recover::Nnls::new(&gram, k).solve(&h), y);
                let epsilon = share * energy.sqrt();
                let x = solver.solve(&h, energy, epsilon);
                prop_assert!(x.iter().all(|&x| x >= 0.0));
                let residual = problem.residual(&x, y);
                if epsilon >= energy.sqrt() {
                    prop_assert!(x.iter().all(|&x| x == 0.0));
                } else if epsilon > least * (1.0 + 1e-9) {
                    prop_assert!((residual / epsilon - 1.0).abs() < 1e-7, "{residual} {epsilon}");
                    let c = problem.correlation(&x, y);
                    let lambda = c.iter().fold(f64::MIN, |m, &c| m.max(c));
                    let top = h.iter().fold(0.0f64, |m, h| m.max(h.abs()));
                    for (x, c) in x.iter().zip(&c) {
                        prop_assert!(*x == 0.0 || (lambda - c) < 1e-7 * top);
                    }
                } else {
                    prop_assert!(residual <= least * (1.0 + 1e-7) + 1e-9 * energy.sqrt());
                }
            }
        }
    }

    #[test]
    fn one_unknown_has_the_smallest_feasible_value() {
        // |3 − x| ≤ 1
        let x = Homotopy::new(&[1.0], 1).solve(&[3.0], 9.0, 1.0);
        assert!((x[0] - 2.0).abs() < 1e-12);
        assert_eq!(Homotopy::new(&[], 0).solve(&[], 1.0, 0.5), [0.0; 0]);
    }
}
