//! Exact non-negative least squares from normal equations, by active sets.
//!
//! Lawson & Hanson's method on the Gram matrix (Bro & de Jong 1997), with the inverse on the passive
//! set updated as elements enter and leave, several of them for each gradient. Every search starts
//! from nothing: of the set of a neighbouring pixel or channel so much has to leave again that it is
//! no quicker to start from, and what rounding its inverse has gathered comes along.

use super::passive_set::PassiveSet;
use crate::linalg::{LANES, padded_len, vectorise};

/// Solver for right-hand sides that share one Gram matrix.
#[derive(Debug)]
pub struct Nnls<'a> {
    k: usize,
    /// Elements allowed to be above zero; carries the right-hand side.
    passive: PassiveSet<'a, 1>,
    /// The passive elements' values now; the set itself knows where least squares puts them.
    x: Vec<f64>,
    /// `h − Gx`.
    gradient: Vec<f64>,
    /// The gradient where elements may enter, −∞ elsewhere and up to a whole number of [`LANES`].
    slopes: Vec<f64>,
}

/// Largest gradient, as a share of the largest right-hand side entry, still taken as zero.
const TOLERANCE: f64 = 1e-10;
/// Several elements may enter for each time that the whole gradient is computed, which is much work:
/// share of its gradient that one must have kept by then.
const STILL_STEEP: f64 = 0.5;

impl<'a> Nnls<'a> {
    /// A solver for `gram = AᵀA`, `[k, k]` row-major.
    ///
    /// # Panics
    /// If `gram` does not have `k²` entries.
    pub fn new(gram: &'a [f64], k: usize) -> Self {
        Self {
            k,
            passive: PassiveSet::new(gram, k),
            x: Vec::with_capacity(k),
            gradient: vec![0.0; k],
            slopes: vec![f64::NEG_INFINITY; padded_len(k)],
        }
    }

    /// Minimises `½xᵀGx − hᵀx` subject to `x ≥ 0`, with `h = Aᵀb`, `[k]`. Returns `x`, `[k]`, which
    /// is feasible always and optimal to rounding: it satisfies the Karush–Kuhn–Tucker conditions.
    pub fn solve(&mut self, h: &[f64]) -> Vec<f64> {
        vectorise(
            #[inline(always)]
            || self.search(h),
        );
        self.passive.spread(&self.x)
    }

    /// Elements above zero in the last solution: the degrees of freedom it spent.
    pub fn degrees_of_freedom(&self) -> usize {
        self.passive.members().len()
    }

    #[inline(always)]
    fn search(&mut self, h: &[f64]) {
        self.passive.clear();
        self.x.clear();
        let top = h.iter().fold(0.0f64, |m, v| m.max(v.abs()));
        if top == 0.0 {
            return;
        }
        let least = TOLERANCE * top;
        // An element that was refused, or that left at once, must not be picked again before
        // something else has changed, or rounding could make the search go round in circles.
        let mut refused = Vec::new();
        let mut rebuilt = false;
        for _ in 0..10 * self.k {
            if self.descent(h) > least {
                // Rounding has gathered in the solution: least squares on the same set once more.
                self.passive.refine(0, &self.gradient);
                self.descend();
                if self.descent(h) > least && !rebuilt {
                    rebuilt = true;
                    self.rebuild(h);
                    self.descent(h);
                }
            }
            let mut found = false;
            for (j, steep) in self.steepest(&refused) {
                if steep <= least {
                    break;
                }
                // Those that entered before have changed this one's gradient.
                let offer = self.passive.offer(j, [h[j]]);
                if offer.left[0] < STILL_STEEP * steep {
                    continue;
                }
                found = true;
                if !self.passive.accept(offer) {
                    refused.push(j);
                    continue;
                }
                self.x.push(0.0);
                self.descend();
                match self.passive.contains(j) {
                    true => refused.clear(),
                    false => refused.push(j),
                }
            }
            if !found {
                self.polish();
                break;
            }
        }
    }

    /// Moves from feasible `x` to the least-squares solution on the passive set, elements that would
    /// turn negative leaving on the way.
    #[inline(always)]
    fn descend(&mut self) {
        loop {
            let solution = self.passive.solution(0);
            // The largest step along x -> z that stays feasible.
            let mut step = 1.0f64;
            let mut blocked = usize::MAX;
            for (i, (&x, &z)) in self.x.iter().zip(solution).enumerate() {
                if z <= 0.0 {
                    let here = x / (x - z).max(f64::MIN_POSITIVE);
                    if here < step || blocked == usize::MAX {
                        (step, blocked) = (here.min(step), i);
                    }
                }
            }
            if blocked == usize::MAX {
                self.x.copy_from_slice(solution);
                return;
            }
            for (x, z) in self.x.iter_mut().zip(solution) {
                *x += step * (z - *x);
            }
            // Whoever reached zero leaves; the one that stopped the step does, rounding or not. From
            // the back, as those that leave are replaced by the last.
            for i in (0..self.x.len()).rev() {
                if i == blocked || (self.passive.solution(0)[i] <= 0.0 && self.x[i] <= 0.0) {
                    self.x.swap_remove(i);
                    self.passive.leave(i);
                }
            }
        }
    }

    /// Takes out of the solution what rounding has left of its gradient: next to nothing in `x`, but
    /// where measurements can be met exactly all of the residual.
    #[inline(always)]
    fn polish(&mut self) {
        self.passive.refine(0, &self.gradient);
        if self.passive.solution(0).iter().all(|&z| z > 0.0) {
            self.x.copy_from_slice(self.passive.solution(0));
        }
    }

    /// Lets the passive elements enter once more, one by one, into an empty set: what many updates
    /// have done to the inverse is gone.
    #[inline(always)]
    fn rebuild(&mut self, h: &[f64]) {
        let members = self.passive.members().to_vec();
        let x = std::mem::take(&mut self.x);
        self.passive.clear();
        for (&j, x) in members.iter().zip(x) {
            if self.passive.enter(j, [h[j]]) {
                self.x.push(x);
            }
        }
        self.descend();
    }

    /// Computes the gradient; returns how far from zero it is on the passive set, where it should be.
    #[inline(always)]
    fn descent(&mut self, h: &[f64]) -> f64 {
        // The sign is turned twice, so that rows are only ever added.
        for (g, h) in self.gradient.iter_mut().zip(h) {
            *g = -h;
        }
        self.passive.add_product(&mut self.gradient, &self.x);
        self.gradient.iter_mut().for_each(|g| *g = -*g);
        let on_set = self
            .passive
            .members()
            .iter()
            .map(|&j| self.gradient[j].abs());
        on_set.fold(0.0, f64::max)
    }

    /// Elements outside the passive set whose growth lowers the residual steeply, with their gradient,
    /// the steepest of all first: of every [`LANES`]-th element one.
    #[inline(always)]
    fn steepest(&mut self, refused: &[usize]) -> [(usize, f64); LANES] {
        self.slopes[..self.k].copy_from_slice(&self.gradient);
        for &j in self.passive.members().iter().chain(refused) {
            self.slopes[j] = f64::NEG_INFINITY;
        }
        // Numbers instead of indices: comparing and choosing then takes a register of either.
        let mut best = [f64::NEG_INFINITY; LANES];
        let mut at = [0.0; LANES];
        let mut number = 0.0;
        for slopes in self.slopes.as_chunks::<LANES>().0 {
            for lane in 0..LANES {
                let better = slopes[lane] > best[lane];
                best[lane] = if better { slopes[lane] } else { best[lane] };
                at[lane] = if better { number } else { at[lane] };
            }
            number += 1.0;
        }
        let mut steepest =
            std::array::from_fn(|lane| (at[lane] as usize * LANES + lane, best[lane]));
        steepest.sort_unstable_by(|a: &(usize, f64), b| b.1.total_cmp(&a.1).then(a.0.cmp(&b.0)));
        steepest
    }
}

#[cfg(all(test, not(target_arch = "wasm32")))] // where there is proptest
mod tests {
    use proptest::prelude::*;

    use super::super::test_problems::Problem;
    use super::*;

    /// The least squared residual that any non-negative x reaches, by trying every set of elements
    /// above zero: slow, and nothing like an active-set search.
    fn least_by_enumeration(problem: &Problem, y: &[f64]) -> f64 {
        let mut least = Problem::energy(y);
        for set in 1usize..1 << problem.k {
            let members: Vec<usize> = (0..problem.k).filter(|j| set >> j & 1 == 1).collect();
            let Some(z) = least_squares(problem, &members, y) else {
                continue; // dependent columns: smaller sets reach as far
            };
            if z.iter().all(|&z| z >= 0.0) {
                let mut x = vec![0.0; problem.k];
                members.iter().zip(z).for_each(|(&j, z)| x[j] = z);
                least = least.min(problem.residual(&x, y).powi(2));
            }
        }
        least
    }

    /// Least squares on some columns by Gram–Schmidt: `None` if they depend on each other.
    fn least_squares(problem: &Problem, members: &[usize], y: &[f64]) -> Option<Vec<f64>> {
        let dot = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(a, b)| a * b).sum::<f64>();
        let (n, mut rest) = (members.len(), y.to_vec());
        let mut orthogonal: Vec<Vec<f64>> = Vec::new();
        let mut triangle = vec![0.0; n * n];
        let mut right = vec![0.0; n];
        for (j, &member) in members.iter().enumerate() {
            let mut column: Vec<f64> = (problem.matrix.iter().skip(member).step_by(problem.k))
                .copied()
                .collect();
            let size = dot(&column, &column).sqrt();
            for (i, q) in orthogonal.iter().enumerate() {
                triangle[i * n + j] = dot(q, &column);
                column
                    .iter_mut()
                    .zip(q)
                    .for_each(|(c, q)| *c -= triangle[i * n + j] * q);
            }
            triangle[j * n + j] = dot(&column, &column).sqrt();
            if triangle[j * n + j] < 1e-6 * size {
                return None;
            }
            column.iter_mut().for_each(|c| *c /= triangle[j * n + j]);
            right[j] = dot(&column, &rest);
            rest.iter_mut()
                .zip(&column)
                .for_each(|(r, q)| *r -= right[j] * q);
            orthogonal.push(column);
        }
        for i in (0..n).rev() {
            for j in i + 1..n {
                right[i] -= triangle[i * n + j] * right[j];
            }
            right[i] /= triangle[i * n + i];
        }
        Some(right)
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(200))]

        /// Wide and tall problems, several right-hand sides through one solver: no
        /// negative entries, no ascent directions, no gradient where an entry is above zero.
        #[test]
        fn answers_satisfy_kkt(
            k in 1usize..60, rows in 1usize..40, seed in any::<u64>(), offset in 0.0f64..2.0,
        ) {
            let problem = Problem::random(k, rows, seed, offset);
            let gram = problem.gram();
            let mut solver = Nnls::new(&gram, k);
            for y in &problem.measurements {
                let h = problem.right_hand_side(y);
                let x = solver.solve(&h);
                let top = h.iter().fold(f64::MIN_POSITIVE, |m, v| m.max(v.abs()));
                for (x, c) in x.iter().zip(problem.correlation(&x, y)) {
                    prop_assert!(*x >= 0.0 && c < 1e-7 * top, "{x} {c}");
                    prop_assert!(*x == 0.0 || c > -1e-7 * top, "{x} {c}");
                }
                prop_assert!(solver.degrees_of_freedom() >= x.iter().filter(|&&x| x > 0.0).count());
            }
        }

        #[test]
        fn nothing_is_nearer(
            k in 1usize..8, rows in 1usize..12, seed in any::<u64>(), offset in 0.0f64..2.0,
        ) {
            let problem = Problem::random(k, rows, seed, offset);
            let gram = problem.gram();
            let mut solver = Nnls::new(&gram, k);
            for y in &problem.measurements {
                let x = solver.solve(&problem.right_hand_side(y));
                let ours = problem.residual(&x, y).powi(2);
                let least = least_by_enumeration(&problem, y);
                prop_assert!((ours - least).abs() < 1e-8 * Problem::energy(y), "{ours} {least}");
            }
        }
    }

    #[test]
    fn a_non_negative_solution_is_found_exactly() {
        let truth = [0.0, 2.0, 0.0, 0.5, 1.0];
        let mut problem = Problem::random(5, 8, 3, 0.5);
        let seen = |row: &[f64]| row.iter().zip(&truth).map(|(a, t)| a * t).sum();
        problem.measurements = vec![problem.matrix.chunks_exact(5).map(seen).collect()];
        let h = problem.right_hand_side(&problem.measurements[0]);
        let x = Nnls::new(&problem.gram(), 5).solve(&h);
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
