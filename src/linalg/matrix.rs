//! Products and transposes.

use super::kernels::{add_scaled, dot};

/// Writes `Ax` into `y`, for a square `A` `[n, n]`.
#[cfg_attr(target_arch = "x86_64", inline(always))]
pub(crate) fn multiply_vector(a: &[f64], x: &[f64], y: &mut [f64]) {
    let n = x.len();
    for (y, row) in y.iter_mut().zip(a.chunks_exact(n)) {
        *y = dot(row, x);
    }
}

/// Returns `AB`, for `A` `[rows, inner]` and `B` `[inner, columns]`.
pub(crate) fn multiply(a: &[f64], b: &[f64], inner: usize, columns: usize) -> Vec<f64> {
    let mut out = vec![0.0; a.len() / inner.max(1) * columns];
    for (row, out) in a.chunks_exact(inner).zip(out.chunks_exact_mut(columns)) {
        for (&factor, b) in row.iter().zip(b.chunks_exact(columns)) {
            add_scaled(out, factor, b);
        }
    }
    out
}

/// Returns the transpose of a `[rows, columns]` matrix.
pub(crate) fn transpose(a: &[f64], columns: usize) -> Vec<f64> {
    let rows = a.len() / columns.max(1);
    (0..a.len())
        .map(|i| a[i % rows * columns + i / rows])
        .collect()
}

/// Copies the upper triangle of an `[n, n]` matrix over the lower one.
pub(crate) fn mirror_upper(a: &mut [f64], n: usize) {
    for i in 0..n {
        for j in 0..i {
            a[i * n + j] = a[j * n + i];
        }
    }
}
