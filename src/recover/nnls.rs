//! Non-negative least squares: `min ½xᵀGx − hᵀx` subject to `x ≥ 0`, with the Gram matrix `G = AᵀA` `[k, k]` and
//! `h = Aᵀb` `[k]` (paper, section 3, case (a)).
//!
//! An active-set method on the normal equations (Lawson and Hanson 1974; Bro and de Jong 1997): unknowns with a
//! positive gradient `h − Gx` enter the passive set, several for each gradient computed, and unknowns that would become
//! negative leave it. Each search starts from the empty set. The set of a neighbouring pixel or channel is no faster to
//! start from, since most of it leaves again, and it brings the rounding errors of its inverse.

use super::passive_set::PassiveSet;
use crate::linalg::{LANES, padded_len, vectorise};

/// Solver for right-hand sides that share one Gram matrix.
#[derive(Debug)]
pub struct Nnls<'a> {
    k: usize,
    /// Unknowns that may be positive, with the least-squares solution for `h`.
    passive: PassiveSet<'a, 1>,
    /// Feasible values of the members.
    x: Vec<f64>,
    /// `h − Gx`, `[k]`.
    gradient: Vec<f64>,
    /// The gradient of unknowns that may enter, −∞ for others, padded to a multiple of [`LANES`].
    entering: Vec<f64>,
}

/// Largest gradient that counts as zero, relative to the largest entry of `h`.
const GRADIENT_TOLERANCE: f64 = 1e-10;
/// Share of its gradient that an unknown must have kept to enter after others: the gradient of all unknowns is
/// expensive, and is computed once for several.
const MIN_REMAINING_GRADIENT: f64 = 0.5;
/// Iterations after which the search ends in any case, relative to k.
const MAX_ITERATIONS_PER_UNKNOWN: usize = 10;

impl<'a> Nnls<'a> {
    /// A solver for `gram = AᵀA`, `[k, k]`.
    ///
    /// # Panics
    /// If `gram` does not have `k²` entries.
    pub fn new(gram: &'a [f64], k: usize) -> Self {
        Self {
            k,
            passive: PassiveSet::new(gram, k),
            x: Vec::with_capacity(k),
            gradient: vec![0.0; k],
            entering: vec![f64::NEG_INFINITY; padded_len(k)],
        }
    }

    /// Returns the minimum of `½xᵀGx − hᵀx` subject to `x ≥ 0`, `[k]`. It is always feasible, and satisfies the
    /// Karush–Kuhn–Tucker conditions to rounding; an unknown whose column depends linearly on those of the passive set,
    /// to the precision of the Gram matrix, stays zero whatever its gradient.
    pub fn solve(&mut self, h: &[f64]) -> Vec<f64> {
        vectorise(
            #[cfg_attr(target_arch = "x86_64", inline(always))]
            || self.search(h),
        );
        self.passive.scatter(&self.x)
    }

    #[cfg_attr(target_arch = "x86_64", inline(always))]
    fn search(&mut self, h: &[f64]) {
        self.passive.clear();
        self.x.clear();
        let top = h.iter().fold(0.0f64, |m, v| m.max(v.abs()));
        if top == 0.0 {
            return;
        }
        let min_gradient = GRADIENT_TOLERANCE * top;
        // An unknown that was refused, or that left at once, must not be tried again before the set has changed: with
        // rounding errors the search could cycle.
        let mut refused = Vec::new();
        let mut rebuilt = false;
        for _ in 0..MAX_ITERATIONS_PER_UNKNOWN * self.k {
            if self.update_gradient(h) > min_gradient {
                // The solution has rounding errors.
                self.passive.refine(0, &self.gradient);
                self.move_to_solution();
                if self.update_gradient(h) > min_gradient && !rebuilt {
                    rebuilt = true;
                    self.rebuild(h);
                    self.update_gradient(h);
                }
            }
            let mut found = false;
            for (j, gradient) in self.largest_gradients(&refused) {
                if gradient <= min_gradient {
                    break;
                }
                // Unknowns that entered since have changed the gradient of this one.
                let candidate = self.passive.evaluate(j, [h[j]]);
                if candidate.residual[0] < MIN_REMAINING_GRADIENT * gradient {
                    continue;
                }
                found = true;
                if !self.passive.insert(candidate) {
                    refused.push(j);
                    continue;
                }
                self.x.push(0.0);
                self.move_to_solution();
                match self.passive.contains(j) {
                    true => refused.clear(),
                    false => refused.push(j),
                }
            }
            if !found {
                self.refine_solution();
                break;
            }
        }
    }

    /// Moves x, which is feasible, to the least-squares solution on the passive set. Members that would become negative
    /// leave the set.
    #[cfg_attr(target_arch = "x86_64", inline(always))]
    fn move_to_solution(&mut self) {
        loop {
            let solution = self.passive.solution(0);
            // The largest feasible step from x to the solution z.
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
            // Members that reach zero leave, the blocking one in any case. In descending order: the last member
            // replaces a removed one.
            for i in (0..self.x.len()).rev() {
                if i == blocked || (self.passive.solution(0)[i] <= 0.0 && self.x[i] <= 0.0) {
                    self.x.swap_remove(i);
                    self.passive.remove(i);
                }
            }
        }
    }

    /// Removes the rounding error of the solution: next to nothing in `x`, but all of the residual if the measurements
    /// can be met exactly.
    #[cfg_attr(target_arch = "x86_64", inline(always))]
    fn refine_solution(&mut self) {
        self.passive.refine(0, &self.gradient);
        if self.passive.solution(0).iter().all(|&z| z > 0.0) {
            self.x.copy_from_slice(self.passive.solution(0));
        }
    }

    /// Inserts the members into an empty set, one by one, which removes the rounding errors of many updates from the
    /// inverse.
    #[cfg_attr(target_arch = "x86_64", inline(always))]
    fn rebuild(&mut self, h: &[f64]) {
        let members = self.passive.members().to_vec();
        let x = std::mem::take(&mut self.x);
        self.passive.clear();
        for (&j, x) in members.iter().zip(x) {
            if self.passive.evaluate_and_insert(j, [h[j]]) {
                self.x.push(x);
            }
        }
        self.move_to_solution();
    }

    /// Computes the gradient. Returns its largest magnitude on the passive set, where it should be zero.
    #[cfg_attr(target_arch = "x86_64", inline(always))]
    fn update_gradient(&mut self, h: &[f64]) -> f64 {
        self.gradient.copy_from_slice(h);
        self.passive.subtract_product(&mut self.gradient, &self.x);
        let members = self.passive.members().iter();
        members.fold(0.0, |max, &j| f64::max(max, self.gradient[j].abs()))
    }

    /// Unknowns outside the passive set with large gradients, and these gradients, in descending order. In each class
    /// of indices modulo [`LANES`], the unknown with the largest gradient.
    #[cfg_attr(target_arch = "x86_64", inline(always))]
    fn largest_gradients(&mut self, refused: &[usize]) -> [(usize, f64); LANES] {
        self.entering[..self.k].copy_from_slice(&self.gradient);
        for &j in self.passive.members().iter().chain(refused) {
            self.entering[j] = f64::NEG_INFINITY;
        }
        // Indices as floating-point numbers: a comparison then selects gradients and indices alike.
        let mut best = [f64::NEG_INFINITY; LANES];
        let mut best_index = [0.0; LANES];
        let mut index = 0.0;
        for gradients in self.entering.as_chunks::<LANES>().0 {
            for lane in 0..LANES {
                let (is_better, old) = (gradients[lane] > best[lane], best[lane]);
                best[lane] = if is_better { gradients[lane] } else { old };
                best_index[lane] = if is_better { index } else { best_index[lane] };
            }
            index += 1.0;
        }
        let mut largest =
            std::array::from_fn(|lane| (best_index[lane] as usize * LANES + lane, best[lane]));
        // Few enough for insertion; of equal ones the first element comes first.
        for end in 1..LANES {
            let mut at = end;
            while at > 0 && comes_before(largest[at], largest[at - 1]) {
                largest.swap(at, at - 1);
                at -= 1;
            }
        }
        largest
    }
}

/// Whether an element and its gradient come before another: by descending gradient.
fn comes_before(a: (usize, f64), b: (usize, f64)) -> bool {
    a.1 > b.1 || a.1 == b.1 && a.0 < b.0
}

#[cfg(all(test, not(target_arch = "wasm32")))] // where there is proptest
mod tests {
    use proptest::prelude::*;
    use proptest::test_runner::TestCaseResult;

    use super::super::passive_set::MIN_PIVOT_RATIO;
    use super::super::test_problems::Problem;
    use super::*;

    /// The smallest squared residual of all non-negative x, by least squares on every subset of unknowns.
    fn smallest_residual_by_enumeration(problem: &Problem, y: &[f64]) -> f64 {
        let mut least = Problem::energy(y);
        for set in 1usize..1 << problem.k {
            let members: Vec<usize> = (0..problem.k).filter(|j| set >> j & 1 == 1).collect();
            let Some(z) = least_squares(problem, &members, y, 1e-6) else {
                continue; // dependent columns: a smaller subset has the same residual
            };
            if z.iter().all(|&z| z >= 0.0) {
                let mut x = vec![0.0; problem.k];
                members.iter().zip(z).for_each(|(&j, z)| x[j] = z);
                least = least.min(problem.residual(&x, y).powi(2));
            }
        }
        least
    }

    /// Least squares on some columns, by Gram–Schmidt; `None` if one depends on those before it, to so large a share of
    /// its length.
    fn least_squares(
        problem: &Problem,
        members: &[usize],
        y: &[f64],
        min_independent_share: f64,
    ) -> Option<Vec<f64>> {
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
            if triangle[j * n + j] < min_independent_share * size {
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

    /// Checks the conditions to rounding. Where a column depends on the passive ones to within [`MIN_PIVOT_RATIO`], its
    /// unknown was refused, and keeps its gradient.
    fn check_kkt_conditions(k: usize, rows: usize, seed: u64, offset: f64) -> TestCaseResult {
        let problem = Problem::random(k, rows, seed, offset);
        let gram = problem.gram();
        let mut solver = Nnls::new(&gram, k);
        for y in &problem.measurements {
            let h = problem.right_hand_side(y);
            let x = solver.solve(&h);
            let top = h.iter().fold(f64::MIN_POSITIVE, |m, v| m.max(v.abs()));
            let passive: Vec<usize> = (0..k).filter(|&j| x[j] > 0.0).collect();
            let is_dependent = |j| {
                let columns = [&passive[..], &[j]].concat();
                least_squares(&problem, &columns, y, (2.0 * MIN_PIVOT_RATIO).sqrt()).is_none()
            };
            for (j, c) in problem.correlation(&x, y).into_iter().enumerate() {
                prop_assert!(
                    x[j] >= 0.0 && (x[j] == 0.0 || c > -1e-7 * top),
                    "{} {c}",
                    x[j]
                );
                prop_assert!(
                    c < 1e-7 * top || (x[j] == 0.0 && is_dependent(j)),
                    "{} {c}",
                    x[j]
                );
            }
        }
        Ok(())
    }

    #[test]
    fn a_nearly_dependent_column_may_keep_its_gradient() {
        check_kkt_conditions(52, 6, 7_736_711_346_862_613_648, 1.085_051_663_640_369_8).unwrap();
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(200))]

        /// Wide and tall problems, several right-hand sides with one solver.
        #[test]
        fn solutions_satisfy_the_kkt_conditions(
            k in 1usize..60, rows in 1usize..40, seed in any::<u64>(), offset in 0.0f64..2.0,
        ) {
            check_kkt_conditions(k, rows, seed, offset)?;
        }

        #[test]
        fn no_feasible_point_has_a_smaller_residual(
            k in 1usize..8, rows in 1usize..12, seed in any::<u64>(), offset in 0.0f64..2.0,
        ) {
            let problem = Problem::random(k, rows, seed, offset);
            let gram = problem.gram();
            let mut solver = Nnls::new(&gram, k);
            for y in &problem.measurements {
                let x = solver.solve(&problem.right_hand_side(y));
                let ours = problem.residual(&x, y).powi(2);
                let least = smallest_residual_by_enumeration(&problem, y);
                prop_assert!((ours - least).abs() < 1e-8 * Problem::energy(y), "{ours} {least}");
            }
        }
    }

    #[test]
    fn exact_non_negative_solution_is_found() {
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
    fn zero_measurements_have_the_zero_solution() {
        assert_eq!(Nnls::new(&[2.0], 1).solve(&[0.0]), [0.0]);
        assert_eq!(Nnls::new(&[], 0).solve(&[]), [0.0; 0]);
        assert_eq!(Nnls::new(&[0.0], 1).solve(&[1.0]), [0.0]);
    }
}
