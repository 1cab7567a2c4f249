//! Basis pursuit denoising where light transport functions themselves are sparse: φ = I.
//!
//! The solutions of `min ½‖y − Ax‖² + λ 1ᵀx, x ≥ 0` for all λ form a path of straight segments
//! (Efron et al. 2004, LARS; for non-negative x Mørup et al. 2008). It is followed from `x = 0`
//! down. Along a segment the residual is quadratic in the step, so that the point where
//! `‖y − Ax‖ = ε` is a root and no search over λ. At it `x` solves the constrained problem.

use super::super::passive_set::PassiveSet;
use crate::linalg::{add_scaled, vectorise};

/// Solver for right-hand sides that share one Gram matrix.
#[derive(Debug)]
pub struct Homotopy<'a> {
    k: usize,
    /// Elements above zero; solves for a vector of ones, and at the end for what rounding left.
    passive: PassiveSet<'a, 2>,
    /// The passive elements' values. The set's solution for ones is how they grow as λ falls.
    x: Vec<f64>,
    /// `h − Gx`, and how it falls as λ falls: λ and 1 on the passive set.
    correlation: Vec<f64>,
    fall: Vec<f64>,
    refused: Vec<bool>,
}

/// Right-hand sides of the [`PassiveSet`].
const RIGHT: usize = 0;
const ONES: usize = 1;
/// Correlation, as a share of the largest right-hand side entry, at which the path has ended.
const TOLERANCE: f64 = 1e-10;

/// What ends a segment of the path.
enum Event {
    /// Here the residual is ε, or λ zero.
    End,
    Enters(usize),
    /// The member at this place turns zero.
    Leaves(usize),
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
            fall: vec![0.0; k],
            refused: vec![false; k],
        }
    }

    /// Minimises `1ᵀx` subject to `‖y − Ax‖ ≤ epsilon`, `x ≥ 0`, with `h = Aᵀy`, `[k]`, and
    /// `energy = ‖y‖²`. Returns `x`, `[k]`: `‖y − Ax‖ = epsilon` to rounding, unless zero satisfies
    /// the constraint or nothing does, where it is the non-negative least-squares solution.
    pub fn solve(&mut self, h: &[f64], energy: f64, epsilon: f64) -> Vec<f64> {
        vectorise(
            #[inline(always)]
            || self.follow(h, energy, epsilon * epsilon),
        );
        self.passive.spread(&self.x)
    }

    #[inline(always)]
    fn follow(&mut self, h: &[f64], energy: f64, most: f64) {
        self.passive.clear();
        self.x.clear();
        self.refused.fill(false);
        self.correlation.copy_from_slice(h);
        let mut lambda = 0.0;
        let mut first = None;
        for (j, &h) in h.iter().enumerate() {
            if h > lambda {
                (lambda, first) = (h, Some(j));
            }
        }
        let least = TOLERANCE * lambda;
        let Some(first) = first.filter(|_| energy > most) else {
            return;
        };
        self.enter(first);
        // Each event changes the set by one element; paths have about as many as members at the end.
        for _ in 0..10 * self.k {
            self.fall.fill(0.0);
            let passive = &self.passive;
            passive.add_product(&mut self.fall, passive.solution(ONES));
            let residual = energy - self.explained(h, lambda);
            let (step, event) = self.next_event(lambda, residual - most);
            lambda -= step;
            add_scaled(&mut self.x, step, self.passive.solution(ONES));
            add_scaled(&mut self.correlation, -step, &self.fall);
            match event {
                Event::End => break,
                Event::Leaves(i) => {
                    self.x.swap_remove(i);
                    self.passive.leave(i);
                    self.refused.fill(false);
                }
                Event::Enters(j) => self.enter(j),
            }
            if lambda <= least {
                break;
            }
        }
        self.settle(h, lambda);
    }

    #[inline(always)]
    fn enter(&mut self, j: usize) {
        match self.passive.enter(j, [0.0, 1.0]) {
            true => self.x.push(0.0),
            false => self.refused[j] = true,
        }
    }

    /// `‖y‖² − ‖y − Ax‖²` at a point of the path: `h − Gx` is λ wherever x is not zero.
    #[inline(always)]
    fn explained(&self, h: &[f64], lambda: f64) -> f64 {
        let terms = self.passive.members().iter().zip(&self.x);
        terms.map(|(&j, &x)| (h[j] + lambda) * x).sum()
    }

    /// How far λ falls until something happens. `excess` is how far the squared residual now is above
    /// what is allowed.
    #[inline(always)]
    fn next_event(&self, lambda: f64, excess: f64) -> (f64, Event) {
        // The squared residual falls by 2γλs − γ²s over a step γ.
        let direction = self.passive.solution(ONES);
        let root = lambda * lambda - excess / direction.iter().sum::<f64>();
        let mut step = match root > 0.0 {
            true => lambda - root.sqrt(),
            false => lambda,
        };
        let mut event = Event::End;
        for (i, (&x, &d)) in self.x.iter().zip(direction).enumerate() {
            if d < 0.0 && x < -d * step {
                (step, event) = ((-x / d).max(0.0), Event::Leaves(i));
            }
        }
        for (j, (&c, &f)) in self.correlation.iter().zip(&self.fall).enumerate() {
            // Whether the correlation c − γf is above λ − γ before the step is over.
            if f < 1.0
                && lambda - c < (1.0 - f) * step
                && !self.passive.contains(j)
                && !self.refused[j]
            {
                (step, event) = (((lambda - c) / (1.0 - f)).max(0.0), Event::Enters(j));
            }
        }
        (step, event)
    }

    /// `x` at λ from the equations instead of from the sum of all steps: the residual of
    /// `G[P, P] x = h[P] − λ` is what rounding has gathered.
    #[inline(always)]
    fn settle(&mut self, h: &[f64], lambda: f64) {
        for _ in 0..2 {
            for (c, h) in self.correlation.iter_mut().zip(h) {
                *c = lambda - h;
            }
            self.passive.add_product(&mut self.correlation, &self.x);
            self.correlation.iter_mut().for_each(|c| *c = -*c);
            self.passive.carry(RIGHT, &self.correlation);
            add_scaled(&mut self.x, 1.0, self.passive.solution(RIGHT));
        }
        self.x.iter_mut().for_each(|x| *x = x.max(0.0));
    }
}

#[cfg(all(test, not(target_arch = "wasm32")))] // where there is proptest
mod tests {
    use proptest::prelude::*;

    use super::super::super::test_problems::Problem;
    use super::*;

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(200))]

        /// Feasible, non-negative, and optimal: with `c = Aᵀ(y − Ax)`, the constraint active and
        /// `c ≤ λ` with equality wherever `x > 0` are the Karush–Kuhn–Tucker conditions.
        #[test]
        fn answers_satisfy_kkt(
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
    fn one_element_is_as_bright_as_it_must_be() {
        // |3 − x| ≤ 1
        let x = Homotopy::new(&[1.0], 1).solve(&[3.0], 9.0, 1.0);
        assert!((x[0] - 2.0).abs() < 1e-12);
        assert_eq!(Homotopy::new(&[], 0).solve(&[], 1.0, 0.5), [0.0; 0]);
    }
}
