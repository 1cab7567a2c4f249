//! Symmetric positive definite systems with a narrow band, such as those of smoothness on a grid, by Cholesky's
//! factorisation `A = LLᵀ` within the band (Golub and Van Loan, *Matrix Computations*, section 4.3.5).

use super::kernels::dot;

/// The lower half of a symmetric matrix whose entries lie at most `bandwidth` columns from the diagonal.
#[derive(Clone, Debug)]
pub(crate) struct BandedMatrix {
    rows: usize,
    bandwidth: usize,
    /// `[row, bandwidth + 1]`; the last entry of a row is on the diagonal.
    entries: Vec<f64>,
}

impl BandedMatrix {
    /// A matrix of zeros.
    pub fn zeros(rows: usize, bandwidth: usize) -> Self {
        Self {
            rows,
            bandwidth,
            entries: vec![0.0; rows * (bandwidth + 1)],
        }
    }

    /// Adds `weight · aaᵀ`, where the vector `a` has these entries, all others being zero.
    ///
    /// # Panics
    /// If two of the indices are further apart than the bandwidth.
    pub fn add_square(&mut self, weight: f64, a: &[(usize, f64)]) {
        for &(i, x) in a {
            for &(j, y) in a {
                if j <= i {
                    let at = self.position(i, j);
                    self.entries[at] += weight * x * y;
                }
            }
        }
    }

    fn position(&self, row: usize, column: usize) -> usize {
        row * (self.bandwidth + 1) + self.bandwidth + column - row
    }

    /// Solves `Ax = b` in place. `None` if A is not positive definite to working precision.
    pub fn solve(mut self, b: &mut [f64]) -> Option<()> {
        for i in 0..self.rows {
            let first = i.saturating_sub(self.bandwidth);
            for j in first..=i {
                let begin = first.max(j.saturating_sub(self.bandwidth));
                let (row, other) = (self.position(i, begin), self.position(j, begin));
                let count = j - begin;
                let (own, above) = (row..row + count, other..other + count);
                let product = dot(&self.entries[own], &self.entries[above]);
                let (at, pivot) = (self.position(i, j), self.position(j, j));
                let rest = self.entries[at] - product;
                self.entries[at] = match i == j {
                    true if rest > 0.0 && rest.is_finite() => rest.sqrt(),
                    true => return None,
                    false => rest / self.entries[pivot],
                };
            }
        }
        for i in 0..self.rows {
            let first = i.saturating_sub(self.bandwidth);
            let row = self.position(i, first)..self.position(i, i);
            let product = dot(&self.entries[row], &b[first..i]);
            b[i] = (b[i] - product) / self.entries[self.position(i, i)];
        }
        for i in (0..self.rows).rev() {
            b[i] /= self.entries[self.position(i, i)];
            for j in i.saturating_sub(self.bandwidth)..i {
                b[j] -= self.entries[self.position(i, j)] * b[i];
            }
        }
        Some(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_banded_system_is_solved() {
        // Second differences and a ridge, on ten points.
        let mut a = BandedMatrix::zeros(10, 2);
        for i in 0..8 {
            a.add_square(3.0, &[(i, 1.0), (i + 1, -2.0), (i + 2, 1.0)]);
        }
        for i in 0..10 {
            a.add_square(0.1, &[(i, 1.0)]);
        }
        let x: Vec<f64> = (0..10).map(|i| f64::from(i * i % 7) - 2.0).collect();
        let entry = |i: usize, j: usize| match i.abs_diff(j) {
            0..=2 => a.entries[a.position(i.max(j), i.min(j))],
            _ => 0.0,
        };
        let mut b: Vec<f64> = (0..10)
            .map(|i| (0..10).map(|j| entry(i, j) * x[j]).sum())
            .collect();
        a.clone().solve(&mut b).unwrap();
        for (got, want) in b.iter().zip(&x) {
            assert!((got - want).abs() < 1e-9, "{got} {want}");
        }
    }

    #[test]
    fn a_singular_matrix_is_refused() {
        let mut a = BandedMatrix::zeros(3, 1);
        a.add_square(1.0, &[(0, 1.0), (1, -1.0)]);
        assert!(a.solve(&mut [1.0, 2.0, 3.0]).is_none());
    }
}
