//! Eigenvalues and eigenvectors of a symmetric matrix: Householder reflections make it tridiagonal, then QL steps with
//! implicit shifts make it diagonal (Golub and Van Loan, *Matrix Computations*, section 8.3).

use super::kernels::{add_scaled, dot};
use super::order::{ascending_order, sort};

/// QL steps for one eigenvalue; two are usual.
const MAX_QL_STEPS: usize = 50;

/// Returns the eigenvalues of the symmetric `[n, n]` matrix `a`, largest first, and the eigenvectors as the rows of an
/// `[n, n]` matrix.
pub(crate) fn symmetric_eigen(mut a: Vec<f64>, n: usize) -> (Vec<f64>, Vec<f64>) {
    let (mut values, mut off_diagonal) = tridiagonalise(&mut a, n);
    let mut vectors = accumulate_reflections(&a, n);
    diagonalise(&mut values, &mut off_diagonal, &mut vectors);
    let order = ascending_order(values.iter().map(|value| -value));
    let rows = order.iter().flat_map(|&i| &vectors[i * n..(i + 1) * n]);
    let rows = rows.copied().collect();
    (order.iter().map(|&i| values[i]).collect(), rows)
}

/// Returns the eigenvalues of the symmetric `[n, n]` matrix `a`, largest first. They are exact to rounding relative to
/// the largest.
pub(crate) fn symmetric_eigenvalues(mut a: Vec<f64>, n: usize) -> Vec<f64> {
    let (mut values, mut off_diagonal) = tridiagonalise(&mut a, n);
    diagonalise(&mut values, &mut off_diagonal, &mut []);
    sort(&mut values);
    values.reverse();
    values
}

/// Returns the diagonal and the entries beside it, `off_diagonal[i]` between `i` and `i + 1`, of a tridiagonal matrix
/// with the eigenvalues of `a`. Leaves in row `k` of `a`, right of the diagonal, the vector `v` of the reflection
/// `I − 2vvᵀ/vᵀv` of step `k`.
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
        // The reflection maps the row to (alpha, 0, …).
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

/// The product of the reflections in `a`, transposed: its rows become the eigenvectors.
fn accumulate_reflections(a: &[f64], n: usize) -> Vec<f64> {
    let mut rows = vec![0.0; n * n];
    (0..n).for_each(|i| rows[i * n + i] = 1.0);
    for k in (0..n.saturating_sub(1)).rev() {
        let first = k + 1;
        let v = &a[k * n + first..(k + 1) * n];
        let energy = dot(v, v);
        if energy == 0.0 {
            continue;
        }
        for row in rows.chunks_exact_mut(n).skip(first) {
            let row = &mut row[first..];
            let factor = -2.0 / energy * dot(row, v);
            add_scaled(row, factor, v);
        }
    }
    rows
}

/// Replaces the diagonal of a tridiagonal matrix by its eigenvalues, and rotates the rows of `vectors` with them, unless
/// there are none.
fn diagonalise(d: &mut [f64], e: &mut [f64], vectors: &mut [f64]) {
    let n = d.len();
    for first in 0..n {
        for _ in 0..MAX_QL_STEPS {
            let is_split =
                |m: &usize| e[*m].abs() <= f64::EPSILON * (d[*m].abs() + d[*m + 1].abs());
            let last = (first..n - 1).find(is_split).unwrap_or(n - 1);
            if last == first {
                break;
            }
            ql_step(d, e, vectors, first, last);
        }
    }
}

/// One QL step with Wilkinson's shift on the rows from `first` to `last`.
fn ql_step(d: &mut [f64], e: &mut [f64], vectors: &mut [f64], first: usize, last: usize) {
    let n = d.len();
    let shift = (d[first + 1] - d[first]) / (2.0 * e[first]);
    let radius = (shift * shift + 1.0).sqrt().copysign(shift);
    let mut g = d[last] - d[first] + e[first] / (shift + radius);
    let (mut s, mut c, mut p) = (1.0, 1.0, 0.0);
    for i in (first..last).rev() {
        let (f, b) = (s * e[i], c * e[i]);
        let r = (f * f + g * g).sqrt();
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
        if !vectors.is_empty() {
            rotate(&mut vectors[i * n..(i + 2) * n], s, c);
        }
    }
    d[first] -= p;
    e[first] = g;
    e[last] = 0.0;
}

/// Rotates the two rows of a `[2, n]` matrix.
fn rotate(rows: &mut [f64], s: f64, c: f64) {
    let (upper, lower) = rows.split_at_mut(rows.len() / 2);
    for (x, y) in upper.iter_mut().zip(lower) {
        (*x, *y) = (c * *x - s * *y, s * *x + c * *y);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A positive semidefinite matrix.
    fn matrix(n: usize) -> Vec<f64> {
        let b: Vec<f64> = (0..n * n)
            .map(|i| ((i * i + 3 * i) % 13) as f64 - 5.0)
            .collect();
        let at = |i: usize, j: usize| (0..n).map(|k| b[k * n + i] * b[k * n + j]).sum::<f64>();
        (0..n * n).map(|i| at(i / n, i % n)).collect()
    }

    #[test]
    fn eigenvectors_are_orthonormal_and_diagonalise_the_matrix() {
        for n in [1, 2, 3, 24, 61] {
            let a = matrix(n);
            let (values, v) = symmetric_eigen(a.clone(), n);
            assert!(values.windows(2).all(|w| w[0] >= w[1]));
            for i in 0..n {
                for j in 0..n {
                    let rebuilt: f64 = (0..n)
                        .map(|k| values[k] * v[k * n + i] * v[k * n + j])
                        .sum();
                    assert!((rebuilt - a[i * n + j]).abs() < 1e-11 * values[0]);
                    let dot: f64 = (0..n).map(|k| v[i * n + k] * v[j * n + k]).sum();
                    assert!((dot - f64::from(u8::from(i == j))).abs() < 1e-12);
                }
            }
            assert_eq!(symmetric_eigenvalues(a, n), values);
        }
    }

    #[test]
    fn zero_and_diagonal_matrices_keep_their_diagonal() {
        assert_eq!(symmetric_eigenvalues(vec![0.0; 9], 3), [0.0; 3]);
        let diagonal = vec![1.0, 0.0, 0.0, 0.0, 5.0, 0.0, 0.0, 0.0, 3.0];
        let (values, vectors) = symmetric_eigen(diagonal, 3);
        assert_eq!(values, [5.0, 3.0, 1.0]);
        let axes: Vec<f64> = vectors.iter().map(|v| v.abs()).collect();
        assert_eq!(axes, [0.0, 1.0, 0.0, 0.0, 0.0, 1.0, 1.0, 0.0, 0.0]);
    }
}
