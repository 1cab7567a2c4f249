//! All eigenvalues of a larger symmetric matrix, without eigenvectors: Householder reflections make it tridiagonal, then
//! QL steps with implicit shifts make it diagonal (Golub and Van Loan, *Matrix Computations*, section 8.3).

use super::vector::{add_scaled, dot};

/// QL steps for one eigenvalue; two are usual.
const MAX_QL_STEPS: usize = 50;

/// Returns the eigenvalues of the symmetric `[n, n]` matrix `a`, largest first. They are exact to rounding relative to
/// the largest.
pub(crate) fn symmetric_eigenvalues(mut a: Vec<f64>, n: usize) -> Vec<f64> {
    let (mut diagonal, mut off_diagonal) = tridiagonalise(&mut a, n);
    diagonalise(&mut diagonal, &mut off_diagonal);
    diagonal.sort_by(|a, b| b.total_cmp(a));
    diagonal
}

/// Returns the diagonal and the entries beside it, `off_diagonal[i]` between `i` and `i + 1`, of a tridiagonal matrix
/// with the eigenvalues of `a`.
fn tridiagonalise(a: &mut [f64], n: usize) -> (Vec<f64>, Vec<f64>) {
    let mut off_diagonal = vec![0.0; n];
    let mut product = vec![0.0; n];
    for k in 0..n.saturating_sub(1) {
        let first = k + 1;
        let (above, below) = a.split_at_mut(first * n);
        let v = &mut above[k * n + first..];
        let norm = dot(v, v).sqrt();
        if norm == 0.0 {
            continue;
        }
        // The reflection I − 2vvᵀ/vᵀv maps the row to (alpha, 0, …).
        let alpha = -norm.copysign(v[0]);
        v[0] -= alpha;
        off_diagonal[k] = alpha;
        let scale = 2.0 / dot(v, v);
        let size = n - first;
        let product = &mut product[..size];
        for (p, row) in product.iter_mut().zip(below.chunks_exact(n)) {
            *p = scale * dot(&row[first..], v);
        }
        let half = 0.5 * scale * dot(product, v);
        add_scaled(product, -half, v);
        for (i, row) in below.chunks_exact_mut(n).enumerate() {
            add_scaled(&mut row[first..], -v[i], product);
            add_scaled(&mut row[first..], -product[i], v);
        }
    }
    let diagonal = (0..n).map(|i| a[i * n + i]).collect();
    (diagonal, off_diagonal)
}

/// Replaces the diagonal of a tridiagonal matrix by its eigenvalues.
fn diagonalise(d: &mut [f64], e: &mut [f64]) {
    let n = d.len();
    for first in 0..n {
        for _ in 0..MAX_QL_STEPS {
            let is_split =
                |m: &usize| e[*m].abs() <= f64::EPSILON * (d[*m].abs() + d[*m + 1].abs());
            let last = (first..n - 1).find(is_split).unwrap_or(n - 1);
            if last == first {
                break;
            }
            ql_step(d, e, first, last);
        }
    }
}

/// One QL step with Wilkinson's shift on the rows from `first` to `last`.
fn ql_step(d: &mut [f64], e: &mut [f64], first: usize, last: usize) {
    let shift = (d[first + 1] - d[first]) / (2.0 * e[first]);
    let radius = libm::hypot(shift, 1.0).copysign(shift);
    let mut g = d[last] - d[first] + e[first] / (shift + radius);
    let (mut s, mut c, mut p) = (1.0, 1.0, 0.0);
    for i in (first..last).rev() {
        let (f, b) = (s * e[i], c * e[i]);
        let r = libm::hypot(f, g);
        e[i + 1] = r;
        if r == 0.0 {
            d[i + 1] -= p;
            e[last] = 0.0;
            return;
        }
        (s, c) = (f / r, g / r);
        let next = d[i + 1] - p;
        let t = (d[i] - next) * s + 2.0 * c * b;
        p = s * t;
        d[i + 1] = next + p;
        g = c * t - b;
    }
    d[first] -= p;
    e[first] = g;
    e[last] = 0.0;
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::linalg::symmetric_eigen;

    #[test]
    fn eigenvalues_agree_with_those_by_rotations() {
        for n in [1, 2, 3, 24, 61] {
            let b: Vec<f64> = (0..n * n)
                .map(|i| ((i * i + 3 * i) % 13) as f64 - 5.0)
                .collect();
            let at = |i: usize, j: usize| (0..n).map(|k| b[k * n + i] * b[k * n + j]).sum::<f64>();
            let a: Vec<f64> = (0..n * n).map(|i| at(i / n, i % n)).collect();
            let (want, _) = symmetric_eigen(a.clone(), n);
            let got = symmetric_eigenvalues(a, n);
            for (got, want_value) in got.iter().zip(&want) {
                assert!(
                    (got - want_value).abs() < 1e-11 * want[0],
                    "{n}: {got}, {want_value}"
                );
            }
        }
    }

    #[test]
    fn zero_and_diagonal_matrices_keep_their_diagonal() {
        assert_eq!(symmetric_eigenvalues(vec![0.0; 9], 3), [0.0; 3]);
        let diagonal = vec![1.0, 0.0, 0.0, 0.0, 5.0, 0.0, 0.0, 0.0, 3.0];
        assert_eq!(symmetric_eigenvalues(diagonal, 3), [5.0, 3.0, 1.0]);
    }
}
