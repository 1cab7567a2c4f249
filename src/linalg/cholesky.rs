//! Cholesky factorisation `A = UᵀU` of a symmetric positive definite `[n, n]` matrix, and what follows from it:
//! solutions, determinant, inverse (Golub and Van Loan, *Matrix Computations*, section 4.2).
//!
//! `A` and `U` are read and written in the upper triangle only; the lower one may hold anything.

use super::kernels::{add_four_scaled, add_scaled, dot};

/// Rows eliminated together: each row below is then loaded and stored a quarter as often.
const BLOCK: usize = 4;
/// Bound on products of pivots whose logarithm is taken at once.
const SAFE_PRODUCT: f64 = 1e150;

/// Replaces `A` by `U`. Returns the logarithm of A's determinant, or `None` if A is not positive definite to working
/// precision.
#[cfg_attr(target_arch = "x86_64", inline(always))]
pub(crate) fn cholesky(a: &mut [f64], n: usize) -> Option<f64> {
    let (mut log_det, mut determinant) = (0.0, 1.0);
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
            // One logarithm for many pivots, as long as their product is far from overflow.
            let product = determinant * pivot;
            let is_normal = (SAFE_PRODUCT.recip()..SAFE_PRODUCT).contains(&product);
            if !is_normal {
                log_det += libm::log(determinant);
            }
            determinant = if is_normal { product } else { pivot };
            let inverse = pivot.sqrt().recip();
            let row = a[k * n + k..k * n + n].iter_mut();
            row.for_each(|u| *u *= inverse);
        }
        let (done, rest) = a.split_at_mut(end * n);
        if end - first == BLOCK {
            let row = |k: usize| &done[(first + k) * n..(first + k + 1) * n];
            let (r0, r1, r2, r3) = (row(0), row(1), row(2), row(3));
            for (i, target) in (end..n).zip(rest.chunks_exact_mut(n)) {
                let factors = [-r0[i], -r1[i], -r2[i], -r3[i]];
                let sources = [&r0[i..], &r1[i..], &r2[i..], &r3[i..]];
                add_four_scaled(&mut target[i..], sources, factors);
            }
        }
    }
    Some(log_det + libm::log(determinant))
}

/// Returns the factor of `A + ridge · I` and the logarithm of its determinant. The ridge grows until the sum is positive
/// definite; `None` if A has a NaN.
pub(crate) fn cholesky_with_ridge(a: &[f64], n: usize, ridge: f64) -> Option<(Vec<f64>, f64)> {
    let mut ridge = ridge.max(f64::MIN_POSITIVE);
    while ridge.is_finite() {
        let mut u = a.to_vec();
        (0..n).for_each(|i| u[i * n + i] += ridge);
        if let Some(log_det) = cholesky(&mut u, n) {
            return Some((u, log_det));
        }
        ridge *= 10.0;
    }
    None
}

/// Replaces `b`, `[n]`, by the solution of `UᵀUx = b`.
#[cfg_attr(target_arch = "x86_64", inline(always))]
pub(crate) fn cholesky_solve(u: &[f64], b: &mut [f64]) {
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

/// Writes the upper triangle of `(UᵀU)⁻¹` into `inverse`; `scratch` is `[n, n]` too.
#[cfg_attr(target_arch = "x86_64", inline(always))]
pub(crate) fn cholesky_inverse(u: &[f64], n: usize, scratch: &mut [f64], inverse: &mut [f64]) {
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
            let [row, column] = [i, j].map(|k| &scratch[k * n + j..(k + 1) * n]);
            inverse[i * n + j] = dot(row, column);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::super::matrix::{mirror_upper, multiply, multiply_vector, transpose};
    use super::*;

    fn positive_definite_matrix(n: usize) -> Vec<f64> {
        let b: Vec<f64> = (0..n * n)
            .map(|i| ((i * 37) % 101) as f64 / 50.0 - 1.0)
            .collect();
        let mut a = multiply(&b, &transpose(&b, n), n, n);
        (0..n).for_each(|i| a[i * n + i] += 1.0);
        a
    }

    #[test]
    fn factor_solves_and_inverts() {
        for n in [1, 3, 4, 5, 16, 23] {
            let a = positive_definite_matrix(n);
            let mut u = a.clone();
            let log_det = cholesky(&mut u, n).unwrap();
            let diagonal: f64 = (0..n).map(|i| 2.0 * libm::log(u[i * n + i])).sum();
            assert!((log_det - diagonal).abs() < 1e-9 * (1.0 + diagonal.abs()));
            let x: Vec<f64> = (0..n).map(|i| i as f64 - 2.5).collect();
            let mut b = vec![0.0; n];
            multiply_vector(&a, &x, &mut b);
            cholesky_solve(&u, &mut b);
            for (x, b) in x.iter().zip(&b) {
                assert!((x - b).abs() < 1e-8);
            }
            let (mut scratch, mut inverse) = (vec![0.0; n * n], vec![0.0; n * n]);
            cholesky_inverse(&u, n, &mut scratch, &mut inverse);
            mirror_upper(&mut inverse, n);
            let identity = multiply(&a, &inverse, n, n);
            for (i, v) in identity.iter().enumerate() {
                let expected = f64::from(u8::from(i / n == i % n));
                assert!((v - expected).abs() < 1e-8, "{n}: {v}");
            }
        }
    }

    #[test]
    fn indefinite_matrices_are_refused() {
        assert_eq!(cholesky(&mut [1.0, 2.0, 2.0, 1.0], 2), None);
        assert_eq!(cholesky(&mut [f64::NAN], 1), None);
    }
}
