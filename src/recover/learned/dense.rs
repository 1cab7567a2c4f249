//! Small dense matrices, row-major: what the posterior of a light transport function takes.

use crate::recover::vector::{add_scaled, dot};

/// Rows eliminated together: each row below is then loaded and stored a quarter as often.
const BLOCK: usize = 4;

/// Factors a symmetric positive definite `[n, n]` matrix as `UᵀU` in place. Reads and writes the
/// upper triangle only. Returns the logarithm of the determinant, or `None` if the matrix is not
/// positive definite to working precision.
#[inline(always)]
pub(in crate::recover) fn cholesky(a: &mut [f64], n: usize) -> Option<f64> {
    let mut log_det = 0.0;
    for first in (0..n).step_by(BLOCK) {
        let end = (first + BLOCK).min(n);
        for k in first..end {
            for j in first..k {
                let (above, row) = a.split_at_mut(k * n);
                let u = above[j * n + k];
                add_scaled(&mut row[k..n], -u, &above[j * n + k..j * n + n]);
            }
            let pivot = a[k * n + k];
            if !(pivot > 0.0 && pivot.is_finite()) {
                return None;
            }
            log_det += pivot.ln();
            let inverse = pivot.sqrt().recip();
            a[k * n + k..k * n + n]
                .iter_mut()
                .for_each(|u| *u *= inverse);
        }
        let (done, rest) = a.split_at_mut(end * n);
        if end - first == BLOCK {
            let row = |k: usize| &done[(first + k) * n..(first + k + 1) * n];
            let (r0, r1, r2, r3) = (row(0), row(1), row(2), row(3));
            for (i, target) in (end..n).zip(rest.chunks_exact_mut(n)) {
                let (f0, f1, f2, f3) = (r0[i], r1[i], r2[i], r3[i]);
                let sources = r0[i..].iter().zip(&r1[i..]).zip(&r2[i..]).zip(&r3[i..]);
                for (t, (((a, b), c), d)) in target[i..].iter_mut().zip(sources) {
                    *t -= (f0 * a + f1 * b) + (f2 * c + f3 * d);
                }
            }
        }
    }
    Some(log_det)
}

/// Solves `UᵀU x = b` in place, `U` as [`cholesky`] leaves it.
#[inline(always)]
pub(in crate::recover) fn solve(u: &[f64], b: &mut [f64]) {
    let n = b.len();
    for k in 0..n {
        b[k] /= u[k * n + k];
        let (known, rest) = b.split_at_mut(k + 1);
        add_scaled(rest, -known[k], &u[k * n + k + 1..(k + 1) * n]);
    }
    for k in (0..n).rev() {
        let known = dot(&u[k * n + k + 1..(k + 1) * n], &b[k + 1..]);
        b[k] = (b[k] - known) / u[k * n + k];
    }
}

/// The inverse of `UᵀU`, upper triangle, into `inverse`; `scratch` is `[n, n]` too.
#[inline(always)]
pub(super) fn invert(u: &[f64], n: usize, scratch: &mut [f64], inverse: &mut [f64]) {
    // W = U⁻¹ from the last row up, then WWᵀ.
    for k in (0..n).rev() {
        let (row, below) = scratch[k * n..].split_at_mut(n);
        row.fill(0.0);
        for i in k + 1..n {
            let factor = u[k * n + i];
            let source = &below[(i - k - 1) * n + i..(i - k) * n];
            add_scaled(&mut row[i..], factor, source);
        }
        let reciprocal = u[k * n + k].recip();
        row[k + 1..].iter_mut().for_each(|w| *w *= -reciprocal);
        row[k] = reciprocal;
    }
    for i in 0..n {
        for j in i..n {
            inverse[i * n + j] = dot(
                &scratch[i * n + j..(i + 1) * n],
                &scratch[j * n + j..(j + 1) * n],
            );
        }
    }
}

/// `Ax` for a symmetric `[n, n]` matrix with both triangles.
#[inline(always)]
pub(super) fn multiply(a: &[f64], x: &[f64], y: &mut [f64]) {
    let n = x.len();
    for (y, row) in y.iter_mut().zip(a.chunks_exact(n)) {
        *y = dot(row, x);
    }
}

/// Copies the upper triangle over the lower one.
pub(super) fn mirror(a: &mut [f64], n: usize) {
    for i in 0..n {
        for j in 0..i {
            a[i * n + j] = a[j * n + i];
        }
    }
}

/// `A·B` for `A` `[rows, inner]` and `B` `[inner, columns]`, added to nothing.
pub(super) fn product(a: &[f64], b: &[f64], inner: usize, columns: usize) -> Vec<f64> {
    let mut out = vec![0.0; a.len() / inner.max(1) * columns];
    for (row, out) in a.chunks_exact(inner).zip(out.chunks_exact_mut(columns)) {
        for (&factor, b) in row.iter().zip(b.chunks_exact(columns)) {
            add_scaled(out, factor, b);
        }
    }
    out
}

/// The transpose of an `[rows, columns]` matrix.
pub(super) fn transpose(a: &[f64], columns: usize) -> Vec<f64> {
    let rows = a.len() / columns.max(1);
    (0..a.len())
        .map(|i| a[i % rows * columns + i / rows])
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A well-conditioned symmetric matrix.
    fn matrix(n: usize) -> Vec<f64> {
        let b: Vec<f64> = (0..n * n)
            .map(|i| ((i * 37) % 101) as f64 / 50.0 - 1.0)
            .collect();
        let mut a = product(&b, &transpose(&b, n), n, n);
        (0..n).for_each(|i| a[i * n + i] += 1.0);
        a
    }

    #[test]
    fn factors_solve_and_invert() {
        for n in [1, 3, 4, 5, 16, 23] {
            let a = matrix(n);
            let mut u = a.clone();
            let log_det = cholesky(&mut u, n).unwrap();
            let diagonal: f64 = (0..n).map(|i| 2.0 * u[i * n + i].ln()).sum();
            assert!((log_det - diagonal).abs() < 1e-9 * (1.0 + diagonal.abs()));
            let x: Vec<f64> = (0..n).map(|i| i as f64 - 2.5).collect();
            let mut b = vec![0.0; n];
            multiply(&a, &x, &mut b);
            solve(&u, &mut b);
            for (x, b) in x.iter().zip(&b) {
                assert!((x - b).abs() < 1e-8);
            }
            let (mut scratch, mut inverse) = (vec![0.0; n * n], vec![0.0; n * n]);
            invert(&u, n, &mut scratch, &mut inverse);
            mirror(&mut inverse, n);
            let identity = product(&a, &inverse, n, n);
            for (i, v) in identity.iter().enumerate() {
                let expected = f64::from(u8::from(i / n == i % n));
                assert!((v - expected).abs() < 1e-8, "{n}: {v}");
            }
        }
    }

    #[test]
    fn what_is_not_positive_definite_is_refused() {
        assert_eq!(cholesky(&mut [1.0, 2.0, 2.0, 1.0], 2), None);
        assert_eq!(cholesky(&mut [f64::NAN], 1), None);
    }
}
