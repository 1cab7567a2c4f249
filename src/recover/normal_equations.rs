//! The normal equations `(WA)ᵀ(WA) x = (WA)ᵀWy` of least squares over patterns.
//!
//! `A` `[L, k]` has a row for each of L patterns and a column for each of k unknowns, and `y` `[L]` holds the
//! measurements of one pixel and channel. The weights are `W = (I − (1 − ω) wwᵀ/‖w‖²) diag(w)`: `w` `[L]` weights the
//! patterns, and ω their [`CommonModeWeight`]. W is applied to the columns of A and to y once, so that Gram matrix,
//! right-hand side and residual are plain inner products.

use super::common_mode_weight::CommonModeWeight;
use crate::job_executor::Sums;
use crate::linalg::{self, add_scaled, dot};

/// `W`.
#[derive(Clone, Debug)]
pub(super) struct EquationWeights {
    /// `w`, `[L]`.
    pub patterns: Vec<f64>,
    /// `‖w‖²`.
    pub energy: f64,
    pub common_mode: CommonModeWeight,
}

impl EquationWeights {
    pub fn new(patterns: Vec<f64>, common_mode: CommonModeWeight) -> Self {
        Self {
            energy: patterns.iter().map(|w| w * w).sum(),
            patterns,
            common_mode,
        }
    }

    pub fn uniform(patterns: usize, common_mode: CommonModeWeight) -> Self {
        Self::new(vec![1.0; patterns], common_mode)
    }

    pub fn len(&self) -> usize {
        self.patterns.len()
    }

    /// Replaces `v`, `[L]`, by `Wv`. Returns the mean of v, with `w²` as weights.
    #[cfg_attr(target_arch = "x86_64", inline(always))]
    pub fn apply(&self, v: &mut [f64]) -> f64 {
        v.iter_mut().zip(&self.patterns).for_each(|(v, w)| *v *= w);
        self.weight_common_mode(v)
    }

    /// Replaces `diag(w)v` by `Wv`. Returns the mean of v, with `w²` as weights.
    #[cfg_attr(target_arch = "x86_64", inline(always))]
    pub fn weight_common_mode(&self, v: &mut [f64]) -> f64 {
        let mean = dot(&self.patterns, v) / self.energy;
        let excess = (1.0 - self.common_mode.weight()) * mean;
        add_scaled(v, -excess, &self.patterns);
        mean
    }
}

/// The columns of `WA`.
#[derive(Clone, Debug)]
pub(super) struct WeightedColumns {
    pub weights: EquationWeights,
    /// `(WA)ᵀ`, `[k, L]`: each unknown's column in one run.
    pub columns: Vec<f64>,
    /// Mean of each of A's columns, `[k]`.
    pub means: Vec<f64>,
}

impl WeightedColumns {
    /// Applies W to `Aᵀ`, `[k, L]`.
    #[cfg_attr(target_arch = "x86_64", inline(always))]
    pub fn new(mut columns: Vec<f64>, weights: EquationWeights) -> Self {
        for column in columns.chunks_exact_mut(weights.len().max(1)) {
            let column = column.iter_mut().zip(&weights.patterns);
            column.for_each(|(a, w)| *a *= w);
        }
        Self::from_weighted(columns, weights)
    }

    /// Applies W to `Aᵀ diag(w)`, `[k, L]`.
    #[cfg_attr(target_arch = "x86_64", inline(always))]
    pub fn from_weighted(mut columns: Vec<f64>, weights: EquationWeights) -> Self {
        let means = columns.chunks_exact_mut(weights.len().max(1));
        let means = means.map(|column| weights.weight_common_mode(column));
        Self {
            means: means.collect(),
            columns,
            weights,
        }
    }

    pub fn unknowns(&self) -> usize {
        self.means.len()
    }

    pub fn iter(&self) -> impl ExactSizeIterator<Item = &[f64]> {
        self.columns.chunks_exact(self.weights.len().max(1))
    }

    #[cfg_attr(target_arch = "x86_64", inline(always))]
    pub fn column(&self, unknown: usize) -> &[f64] {
        let patterns = self.weights.len();
        &self.columns[unknown * patterns..(unknown + 1) * patterns]
    }

    /// `(WA)ᵀ(WA)`, `[k, k]`.
    #[cfg_attr(target_arch = "x86_64", inline(always))]
    pub fn gram(&self) -> Vec<f64> {
        let k = self.unknowns();
        let mut gram = vec![0.0; k * k];
        for i in 0..k {
            for j in 0..=i {
                let value = dot(self.column(i), self.column(j));
                gram[i * k + j] = value;
                gram[j * k + i] = value;
            }
        }
        gram
    }

    /// `(WA)ᵀ Wy` for weighted measurements `Wy`, `[k]`.
    #[cfg_attr(target_arch = "x86_64", inline(always))]
    pub fn right_hand_side(&self, weighted_y: &[f64]) -> impl Iterator<Item = f64> {
        self.iter().map(move |column| dot(column, weighted_y))
    }

    /// `Wy − WAx` for weighted measurements `Wy`, `[L]`.
    #[cfg_attr(target_arch = "x86_64", inline(always))]
    pub fn residual(&self, weighted_y: &[f64], x: &[f64]) -> Vec<f64> {
        let mut residual = weighted_y.to_vec();
        for (column, &x) in self.iter().zip(x).filter(|(_, x)| **x != 0.0) {
            add_scaled(&mut residual, -x, column);
        }
        residual
    }

    /// `‖Wy − WAx‖²` for weighted measurements `Wy`.
    pub fn squared_residual(&self, weighted_y: &[f64], x: &[f64]) -> f64 {
        let residual = self.residual(weighted_y, x);
        residual.iter().map(|r| r * r).sum()
    }
}

/// Sums of Gram matrices and right-hand sides over many pixels, whose equations share n unknowns.
#[derive(Clone, Debug)]
pub(super) struct NormalEquations {
    /// `[n, n]`, upper triangle.
    gram: Vec<f64>,
    /// `[n]`.
    right: Vec<f64>,
}

impl NormalEquations {
    pub fn zeros(unknowns: usize) -> Self {
        Self {
            gram: vec![0.0; unknowns * unknowns],
            right: vec![0.0; unknowns],
        }
    }

    /// Adds `factor · (WA)ᵀ(WA)` and `(WA)ᵀ Wy`. Column i of A belongs to unknown `unknowns[i]`; these rise.
    #[cfg_attr(target_arch = "x86_64", inline(always))]
    pub fn add(
        &mut self,
        columns: &WeightedColumns,
        unknowns: &[usize],
        factor: f64,
        weighted_y: &[f64],
    ) {
        let n = self.right.len();
        for (i, &row) in unknowns.iter().enumerate() {
            let a = columns.column(i);
            self.right[row] += dot(a, weighted_y);
            for (j, &column) in unknowns.iter().enumerate().skip(i) {
                self.gram[row * n + column] += factor * dot(a, columns.column(j));
            }
        }
    }

    /// The Gram matrix with both triangles, and the right-hand side.
    pub fn into_parts(mut self) -> (Vec<f64>, Vec<f64>) {
        linalg::mirror_upper(&mut self.gram, self.right.len());
        (self.gram, self.right)
    }

    /// Solves for the unknowns; `None` if the Gram matrix is singular.
    pub fn solve(mut self) -> Option<Vec<f64>> {
        linalg::cholesky(&mut self.gram, self.right.len())?;
        linalg::cholesky_solve(&self.gram, &mut self.right);
        Some(self.right)
    }
}

impl Sums for NormalEquations {
    fn visit(&mut self, visitor: &mut dyn FnMut(&mut [f64])) {
        visitor(&mut self.gram);
        visitor(&mut self.right);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::job_executor::add;

    /// A `[L, k]` by its transpose, `w` and `y`.
    const PATTERNS: usize = 5;
    const COLUMNS: [f64; 10] = [0.1, 0.9, 0.4, 0.3, 0.7, 0.8, 0.2, 0.6, 0.5, 0.1];
    const WEIGHTS: [f64; PATTERNS] = [1.0, 2.0, 0.5, 1.5, 1.0];
    const Y: [f64; PATTERNS] = [0.3, 0.8, 0.2, 0.6, 0.4];

    fn columns(common_mode: CommonModeWeight) -> WeightedColumns {
        let weights = EquationWeights::new(WEIGHTS.to_vec(), common_mode);
        WeightedColumns::new(COLUMNS.to_vec(), weights)
    }

    /// Weighted mean over the patterns.
    fn mean(v: &[f64]) -> f64 {
        let (sum, energy) = v
            .iter()
            .zip(WEIGHTS)
            .fold((0.0, 0.0), |(sum, energy), (v, w)| {
                (sum + w * w * v, energy + w * w)
            });
        sum / energy
    }

    /// `‖diag(w)(v − v̄)‖² + ω²‖w‖² v̄²` for `v = y − Ax`: the definition of the weights.
    fn split_residual(x: [f64; 2], common_mode: CommonModeWeight) -> f64 {
        let [a, b] = [&COLUMNS[..PATTERNS], &COLUMNS[PATTERNS..]];
        let residual: Vec<f64> = (0..PATTERNS)
            .map(|l| Y[l] - a[l] * x[0] - b[l] * x[1])
            .collect();
        let mean = mean(&residual);
        let centred: f64 = residual
            .iter()
            .zip(WEIGHTS)
            .map(|(r, w)| (w * (r - mean)).powi(2))
            .sum();
        let energy: f64 = WEIGHTS.iter().map(|w| w * w).sum();
        centred + energy * (common_mode.weight() * mean).powi(2)
    }

    #[test]
    fn weights_split_off_the_common_mode() {
        for common_mode in [
            CommonModeWeight::FULL,
            CommonModeWeight::POOLED,
            CommonModeWeight::EXCLUDED,
        ] {
            let columns = columns(common_mode);
            assert!((columns.means[1] - mean(&COLUMNS[PATTERNS..])).abs() < 1e-12);
            let mut y = Y.to_vec();
            assert!((columns.weights.apply(&mut y) - mean(&Y)).abs() < 1e-12);
            for x in [[0.0, 0.0], [0.4, 0.7], [1.0, -0.5]] {
                let expected = split_residual(x, common_mode);
                assert!((columns.squared_residual(&y, &x) - expected).abs() < 1e-12);
            }
        }
    }

    #[test]
    fn sums_of_equations_have_the_least_squares_solution() {
        let columns = columns(CommonModeWeight::POOLED);
        let mut y = Y.to_vec();
        columns.weights.apply(&mut y);
        // Two pixels, the second at unknowns 1 and 2 of three, and twice as certain.
        let mut sums = NormalEquations::zeros(3);
        sums.add(&columns, &[0, 2], 1.0, &y);
        let mut other = NormalEquations::zeros(3);
        let twice: Vec<f64> = y.iter().map(|y| 2.0 * y).collect();
        other.add(&columns, &[1, 2], 2.0, &twice);
        add(&mut sums, &mut other);
        let x = sums.clone().solve().unwrap();
        let (gram, right) = sums.into_parts();
        for i in 0..3 {
            let product: f64 = (0..3).map(|j| gram[i * 3 + j] * x[j]).sum();
            assert!((product - right[i]).abs() < 1e-12);
            assert_eq!(gram[3 * i + (i + 1) % 3], gram[3 * ((i + 1) % 3) + i]);
        }
        // No other x leaves a smaller residual.
        let residual = |x: &[f64]| {
            columns.squared_residual(&y, &[x[0], x[2]])
                + 2.0 * columns.squared_residual(&y, &[x[1], x[2]])
        };
        for i in 0..3 {
            for step in [-1e-3, 1e-3] {
                let mut moved = x.clone();
                moved[i] += step;
                assert!(residual(&moved) > residual(&x));
            }
        }
        assert!(NormalEquations::zeros(1).solve().is_none());
    }

    #[test]
    fn gram_matrix_and_right_hand_side_are_inner_products() {
        let columns = columns(CommonModeWeight::FULL);
        let gram = columns.gram();
        let right: Vec<f64> = columns.right_hand_side(&Y).collect();
        let products = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(a, b)| a * b).sum::<f64>();
        for i in 0..2 {
            assert!((right[i] - products(columns.column(i), &Y)).abs() < 1e-12);
            for j in 0..2 {
                let expected = products(columns.column(i), columns.column(j));
                assert!((gram[i * 2 + j] - expected).abs() < 1e-12);
            }
        }
    }
}
