//! Exact non-negative least squares from normal equations, by active sets.
//!
//! Lawson & Hanson's method on the Gram matrix (Bro & de Jong 1997), with the Cholesky factor of the
//! passive set updated as elements enter and leave instead of refactored. The passive set of one
//! right-hand side starts the next: neighbouring pixels and channels light up nearly the same
//! elements.

/// Solver for right-hand sides that share one Gram matrix.
#[derive(Debug)]
pub struct Nnls<'a> {
    /// `[k, k]`, row-major, symmetric.
    gram: &'a [f64],
    k: usize,
    /// Elements allowed to be above zero, in the order of the factor's rows.
    passive: Vec<usize>,
    is_passive: Vec<bool>,
    /// Lower triangular Cholesky factor of `gram[passive, passive]`, row i in `factor[i·k..]`.
    factor: Vec<f64>,
    scratch: Vec<f64>,
}

/// A pivot below this share of its diagonal means that the element's column depends linearly on the
/// passive ones, to the precision of the Gram matrix: letting it in would not lower the residual.
const DEPENDENT: f64 = 1e-9;
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
            passive: Vec::with_capacity(k),
            is_passive: vec![false; k],
            factor: vec![0.0; k * k],
            scratch: vec![0.0; k],
        }
    }

    /// Minimises `½xᵀGx − hᵀx` subject to `x ≥ 0`, with `h = Aᵀb`, `[k]`. Returns `x`, `[k]`, which
    /// is feasible always and optimal to rounding: it satisfies the Karush–Kuhn–Tucker conditions.
    pub fn solve(&mut self, h: &[f64]) -> Vec<f64> {
        let top = h.iter().fold(0.0f64, |m, v| m.max(v.abs()));
        let mut x = vec![0.0; self.k];
        if top == 0.0 {
            return x;
        }
        // Warm start: keep of the last passive set what is positive here.
        loop {
            let z = self.solve_passive(h);
            let negative: Vec<usize> = (0..z.len()).filter(|&i| z[i] <= 0.0).collect();
            if negative.is_empty() {
                self.scatter(&z, &mut x);
                break;
            }
            for &i in negative.iter().rev() {
                self.leave(i);
            }
        }
        // An element the factor refused, or that left at once, must not be picked again before
        // something else has changed, or rounding could make the search go round in circles.
        let mut refused = vec![false; self.k];
        for _ in 0..10 * self.k {
            let Some(j) = self.steepest(h, &x, TOLERANCE * top, &refused) else {
                break;
            };
            if !self.enter(j) {
                refused[j] = true;
                continue;
            }
            let entered_positive = self.descend(h, &mut x);
            if entered_positive {
                refused.fill(false);
            } else {
                refused[j] = true;
            }
        }
        x
    }

    /// Moves from feasible `x` to the least-squares solution on the passive set, elements that would
    /// turn negative leaving on the way. False if the element that entered last made no progress.
    fn descend(&mut self, h: &[f64], x: &mut [f64]) -> bool {
        let entered = self.passive.last().copied();
        loop {
            let z = self.solve_passive(h);
            // The largest step along x -> z that stays feasible.
            let mut step = 1.0f64;
            for (&j, &z) in self.passive.iter().zip(&z) {
                if z <= 0.0 {
                    step = step.min(x[j] / (x[j] - z).max(f64::MIN_POSITIVE));
                }
            }
            if step >= 1.0 {
                self.scatter(&z, x);
                return entered.is_some_and(|j| x[j] > 0.0);
            }
            for (&j, &z) in self.passive.iter().zip(&z) {
                x[j] += step * (z - x[j]);
            }
            // Whoever reached zero leaves; at least one does.
            let blocked = (0..z.len())
                .filter(|&i| z[i] <= 0.0)
                .min_by(|&a, &b| x[self.passive[a]].total_cmp(&x[self.passive[b]]));
            for i in (0..self.passive.len()).rev() {
                let j = self.passive[i];
                if Some(i) == blocked || (z[i] <= 0.0 && x[j] <= 0.0) {
                    x[j] = 0.0;
                    self.leave(i);
                }
            }
        }
    }

    /// The element outside the passive set whose growth lowers the residual most steeply.
    fn steepest(&mut self, h: &[f64], x: &[f64], least: f64, refused: &[bool]) -> Option<usize> {
        let k = self.k;
        let gradient = &mut self.scratch;
        gradient.copy_from_slice(h);
        for &j in &self.passive {
            let (xj, row) = (x[j], &self.gram[j * k..(j + 1) * k]);
            for (g, r) in gradient.iter_mut().zip(row) {
                *g -= xj * r;
            }
        }
        let mut best = None;
        let mut most = least;
        for j in 0..k {
            if gradient[j] > most && !self.is_passive[j] && !refused[j] {
                (best, most) = (Some(j), gradient[j]);
            }
        }
        best
    }

    /// Solves `G[P, P] z = h[P]` with the factor.
    fn solve_passive(&self, h: &[f64]) -> Vec<f64> {
        let (n, k) = (self.passive.len(), self.k);
        let mut z = Vec::with_capacity(n);
        for i in 0..n {
            let row = &self.factor[i * k..i * k + i];
            let known: f64 = row.iter().zip(&z).map(|(l, z)| l * z).sum();
            z.push((h[self.passive[i]] - known) / self.factor[i * k + i]);
        }
        for i in (0..n).rev() {
            z[i] /= self.factor[i * k + i];
            let (above, zi) = (&self.factor[i * k..i * k + i], z[i]);
            for (z, l) in z.iter_mut().zip(above) {
                *z -= l * zi;
            }
        }
        z
    }

    fn scatter(&self, z: &[f64], x: &mut [f64]) {
        x.fill(0.0);
        for (&j, &z) in self.passive.iter().zip(z) {
            x[j] = z;
        }
    }

    /// Appends element `j` to the passive set, unless it depends linearly on it.
    fn enter(&mut self, j: usize) -> bool {
        let (n, k) = (self.passive.len(), self.k);
        let mut squares = 0.0;
        for i in 0..n {
            let (before, row) = self.factor.split_at_mut(n * k);
            let l = &before[i * k..i * k + i];
            let known: f64 = l.iter().zip(&row[..i]).map(|(a, b)| a * b).sum();
            let value = (self.gram[self.passive[i] * k + j] - known) / before[i * k + i];
            row[i] = value;
            squares += value * value;
        }
        let diagonal = self.gram[j * k + j];
        let pivot = diagonal - squares;
        if pivot <= DEPENDENT * diagonal {
            return false;
        }
        self.factor[n * k + n] = pivot.sqrt();
        self.passive.push(j);
        self.is_passive[j] = true;
        true
    }

    /// Takes row `i` out of the factor: the rows below lose a column, and Givens rotations make
    /// them triangular again.
    fn leave(&mut self, i: usize) {
        let (n, k) = (self.passive.len(), self.k);
        self.is_passive[self.passive.remove(i)] = false;
        for row in i..n - 1 {
            self.factor
                .copy_within((row + 1) * k..(row + 1) * k + row + 2, row * k);
        }
        for c in i..n - 1 {
            let (a, b) = (self.factor[c * k + c], self.factor[c * k + c + 1]);
            let r = a.hypot(b);
            let (cos, sin) = (a / r, b / r);
            for row in c..n - 1 {
                let at = row * k + c;
                let (a, b) = (self.factor[at], self.factor[at + 1]);
                self.factor[at] = cos * a + sin * b;
                self.factor[at + 1] = cos * b - sin * a;
            }
        }
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
