//! Exact non-negative least squares from normal equations, by active sets.
//!
//! Lawson & Hanson's method on the Gram matrix (Bro & de Jong 1997), with the Cholesky factor of the
//! passive set updated as elements enter and leave instead of refactored. The passive set of one
//! right-hand side starts the next: neighbouring pixels and channels light up nearly the same
//! elements.

use super::passive::PassiveSet;
use super::vector::{add_rows, vectorised};

/// Solver for right-hand sides that share one Gram matrix.
#[derive(Debug)]
pub struct Nnls<'a> {
    /// `[k, k]`, row-major, symmetric.
    gram: &'a [f64],
    k: usize,
    /// Elements allowed to be above zero; carries the right-hand side.
    passive: PassiveSet<1>,
    /// The passive elements' values now, and where least squares on the passive set puts them.
    x: Vec<f64>,
    z: Vec<f64>,
    /// `h − Gx`.
    gradient: Vec<f64>,
}

/// Largest gradient, as a share of the largest right-hand side entry, still taken as zero.
const TOLERANCE: f64 = 1e-10;

impl<'a> Nnls<'a> {
    /// A solver for `gram = AᵀA`, `[k, k]` row-major.
    ///
    /// # Panics
    /// If `gram` does not have `k²` entries.
    pub fn new(gram: &'a [f64], k: usize) -> Self {
        assert_eq!(gram.len(), k * k, "the Gram matrix is square");
        Self {
            gram,
            k,
            passive: PassiveSet::new(k),
            x: Vec::with_capacity(k),
            z: Vec::with_capacity(k),
            gradient: vec![0.0; k],
        }
    }

    /// Minimises `½xᵀGx − hᵀx` subject to `x ≥ 0`, with `h = Aᵀb`, `[k]`. Returns `x`, `[k]`, which
    /// is feasible always and optimal to rounding: it satisfies the Karush–Kuhn–Tucker conditions.
    pub fn solve(&mut self, h: &[f64]) -> Vec<f64> {
        vectorised(|| self.search(h));
        let mut x = vec![0.0; self.k];
        for (&j, &value) in self.passive.members().iter().zip(&self.x) {
            x[j] = value;
        }
        x
    }

    /// Elements above zero in the last solution: the degrees of freedom it spent.
    pub fn degrees_of_freedom(&self) -> usize {
        self.passive.members().len()
    }

    #[inline(always)]
    fn search(&mut self, h: &[f64]) {
        let top = h.iter().fold(0.0f64, |m, v| m.max(v.abs()));
        if top == 0.0 {
            self.passive.clear();
            self.x.clear();
            return;
        }
        // Warm start: keep of the last passive set what is positive here.
        self.passive.carry(0, h);
        loop {
            self.least_squares();
            if self.z.iter().all(|&z| z > 0.0) {
                break;
            }
            for i in (0..self.z.len()).rev() {
                if self.z[i] <= 0.0 {
                    self.passive.leave(i);
                }
            }
        }
        self.x.clone_from(&self.z);
        // An element the factor refused, or that left at once, must not be picked again before
        // something else has changed, or rounding could make the search go round in circles.
        let mut refused = vec![false; self.k];
        for _ in 0..10 * self.k {
            let Some(j) = self.steepest(h, TOLERANCE * top, &refused) else {
                break;
            };
            if !self.passive.enter(self.gram, j, [h[j]]) {
                refused[j] = true;
                continue;
            }
            self.x.push(0.0);
            self.descend();
            if self.passive.contains(j) {
                refused.fill(false);
            } else {
                refused[j] = true;
            }
        }
    }

    /// `z`, the least-squares solution on the passive set.
    #[inline(always)]
    fn least_squares(&mut self) {
        self.z.clear();
        self.z.extend_from_slice(self.passive.carried(0));
        self.passive.back_substitute(&mut self.z);
    }

    /// Moves from feasible `x` to the least-squares solution on the passive set, elements that would
    /// turn negative leaving on the way.
    #[inline(always)]
    fn descend(&mut self) {
        loop {
            self.least_squares();
            // The largest step along x -> z that stays feasible.
            let mut step = 1.0f64;
            let mut blocked = usize::MAX;
            for (i, (&x, &z)) in self.x.iter().zip(&self.z).enumerate() {
                if z <= 0.0 {
                    let here = x / (x - z).max(f64::MIN_POSITIVE);
                    if here < step || blocked == usize::MAX {
                        (step, blocked) = (here.min(step), i);
                    }
                }
            }
            if blocked == usize::MAX {
                self.x.clone_from(&self.z);
                return;
            }
            for (x, z) in self.x.iter_mut().zip(&self.z) {
                *x += step * (z - *x);
            }
            // Whoever reached zero leaves; the one that stopped the step does, rounding or not.
            for i in (0..self.x.len()).rev() {
                if i == blocked || (self.z[i] <= 0.0 && self.x[i] <= 0.0) {
                    self.x.remove(i);
                    self.passive.leave(i);
                }
            }
        }
    }

    /// The element outside the passive set whose growth lowers the residual most steeply.
    #[inline(always)]
    fn steepest(&mut self, h: &[f64], least: f64, refused: &[bool]) -> Option<usize> {
        // The sign is turned twice, so that rows are only ever added.
        for (g, h) in self.gradient.iter_mut().zip(h) {
            *g = -h;
        }
        add_rows(
            &mut self.gradient,
            self.gram,
            self.passive.members(),
            &self.x,
        );
        let mut best = None;
        let mut most = least;
        for (j, &g) in self.gradient.iter().enumerate() {
            if -g > most && !self.passive.contains(j) && !refused[j] {
                (best, most) = (Some(j), -g);
            }
        }
        best
    }
}

#[cfg(all(test, not(target_arch = "wasm32")))] // where there is proptest
mod tests {
    use proptest::prelude::*;

    use super::*;

    /// How far `x` is from satisfying the Karush–Kuhn–Tucker conditions of
    /// `min ½xᵀGx − hᵀx, x ≥ 0`, as a share of the largest `|h|`: negative entries, ascent directions,
    /// and gradient where an entry is above zero.
    fn kkt_violation(gram: &[f64], h: &[f64], x: &[f64]) -> f64 {
        let k = h.len();
        let top = h.iter().fold(f64::MIN_POSITIVE, |m, v| m.max(v.abs()));
        let mut worst = 0.0f64;
        for j in 0..k {
            let gx: f64 = gram[j * k..(j + 1) * k]
                .iter()
                .zip(x)
                .map(|(g, x)| g * x)
                .sum();
            let gradient = h[j] - gx;
            let violation = if x[j] > 0.0 { gradient.abs() } else { gradient };
            if !(violation.is_finite() && x[j].is_finite()) {
                return f64::INFINITY; // `max` would overlook NaN
            }
            worst = worst.max(violation / top).max(-x[j]);
        }
        worst
    }

    /// Normal equations of a random `[rows, k]` problem.
    fn normal_equations(a: &[f64], b: &[f64], k: usize) -> (Vec<f64>, Vec<f64>) {
        let rows = || a.chunks_exact(k);
        let gram = (0..k * k).map(|ij| rows().map(|r| r[ij / k] * r[ij % k]).sum());
        let h = (0..k).map(|j| rows().zip(b).map(|(r, b)| r[j] * b).sum());
        (gram.collect(), h.collect())
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(200))]

        /// Wide and tall problems, several right-hand sides through one warm-started solver.
        #[test]
        fn answers_satisfy_kkt(
            k in 1usize..24, rows in 1usize..40, seed in any::<u64>(), offset in 0.0f64..2.0,
        ) {
            let mut state = seed | 1;
            let mut next = || {
                state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
                (state >> 11) as f64 / (1u64 << 53) as f64 - 0.5
            };
            let a: Vec<f64> = (0..rows * k).map(|_| next() + offset).collect();
            let right: Vec<Vec<f64>> = (0..4).map(|_| (0..rows).map(|_| next()).collect()).collect();
            let (gram, _) = normal_equations(&a, &right[0], k);
            let mut solver = Nnls::new(&gram, k);
            for b in &right {
                let (_, h) = normal_equations(&a, b, k);
                let x = solver.solve(&h);
                prop_assert!(kkt_violation(&gram, &h, &x) < 1e-7);
            }
        }
    }

    #[test]
    fn a_non_negative_solution_is_found_exactly() {
        let truth = [0.0, 2.0, 0.0, 0.5, 1.0];
        let a: Vec<f64> = (0..8 * 5)
            .map(|i| ((i * 37 + i * i * 11) % 17) as f64)
            .collect();
        let b: Vec<f64> = a
            .chunks_exact(5)
            .map(|row| row.iter().zip(&truth).map(|(a, t)| a * t).sum())
            .collect();
        let (gram, h) = normal_equations(&a, &b, 5);
        let x = Nnls::new(&gram, 5).solve(&h);
        for (x, t) in x.iter().zip(truth) {
            assert!((x - t).abs() < 1e-9, "{x} is not {t}");
        }
    }

    #[test]
    fn nothing_measured_gives_nothing() {
        assert_eq!(Nnls::new(&[2.0], 1).solve(&[0.0]), [0.0]);
        assert_eq!(Nnls::new(&[], 0).solve(&[]), [0.0; 0]);
        assert_eq!(Nnls::new(&[0.0], 1).solve(&[1.0]), [0.0]);
    }
}
