//! A sum of matrix rows, and padding.

use super::kernels::{LANES, add_four_scaled, add_scaled};

/// Returns `n` rounded up to a multiple of [`LANES`].
#[cfg_attr(target_arch = "x86_64", inline(always))]
pub(crate) fn padded_len(n: usize) -> usize {
    n.next_multiple_of(LANES)
}

/// Computes `y += Σ_i factors[i] · matrix[rows[i]]`, for a `[_, k]` matrix and `y` `[k]`.
#[cfg_attr(target_arch = "x86_64", inline(always))]
pub(crate) fn add_scaled_rows(y: &mut [f64], matrix: &[f64], rows: &[usize], factors: &[f64]) {
    let k = y.len();
    let row = |m: usize| &matrix[m * k..(m + 1) * k];
    // Four rows a pass: y is then loaded and stored a quarter as often.
    let (fours, factor_fours) = (rows.chunks_exact(4), factors.chunks_exact(4));
    for (&m, &f) in fours.remainder().iter().zip(factor_fours.remainder()) {
        add_scaled(y, f, row(m));
    }
    for (m, f) in fours.zip(factor_fours) {
        let rows = [row(m[0]), row(m[1]), row(m[2]), row(m[3])];
        add_four_scaled(y, rows, [f[0], f[1], f[2], f[3]]);
    }
}

#[cfg(test)]
mod tests {
    use super::super::{dot, vectorise};
    use super::*;

    fn vector(n: usize, seed: usize) -> Vec<f64> {
        (0..n)
            .map(|i| ((i * 7919 + seed * 104_729) % 1009) as f64 / 97.0 - 5.0)
            .collect()
    }

    #[test]
    fn avx2_returns_the_same_bits() {
        for n in [0, 1, 7, 8, 80, 225] {
            let (a, b) = (vector(n, 1), vector(n, 2));
            assert_eq!(dot(&a, &b).to_bits(), vectorise(|| dot(&a, &b)).to_bits());
            let (matrix, factors) = (vector(7 * n, 3), vector(6, 4));
            let rows = [6, 0, 3, 2, 5, 1];
            let (mut plain, mut wide) = (a.clone(), a.clone());
            add_scaled_rows(&mut plain, &matrix, &rows, &factors);
            vectorise(|| add_scaled_rows(&mut wide, &matrix, &rows, &factors));
            assert_eq!(plain, wide);
        }
    }

    #[test]
    fn lengths_that_are_no_multiple_of_the_lanes_are_summed_whole() {
        for n in [1, 3, 7, 12, 13, 24] {
            let (a, b) = (vector(n, 1), vector(n, 2));
            let products: f64 = a.iter().zip(&b).map(|(a, b)| a * b).sum();
            assert!((products - dot(&a, &b)).abs() < 1e-9);
            let mut sum = a.clone();
            add_scaled(&mut sum, 0.5, &b);
            let expected: Vec<f64> = a.iter().zip(&b).map(|(a, b)| a + 0.5 * b).collect();
            assert_eq!(sum, expected);
        }
        assert_eq!([0, 1, 8, 9].map(padded_len), [0, 8, 8, 16]);
    }

    #[test]
    fn add_scaled_rows_sums_rows() {
        let mut y = vec![1.0, 2.0];
        let matrix: Vec<f64> = (0..12).map(f64::from).collect();
        add_scaled_rows(
            &mut y,
            &matrix,
            &[0, 1, 2, 3, 5],
            &[1.0, 1.0, 1.0, 1.0, 0.5],
        );
        assert_eq!(y, [1.0 + 12.0 + 5.0, 2.0 + 16.0 + 5.5]);
        assert_eq!(dot(&y, &[2.0, -1.0]), 36.0 - 23.5);
    }
}
