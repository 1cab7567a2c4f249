//! Vector arithmetic: BLAS level 1, and a sum of matrix rows.

/// Partial sums of a dot product: as many `f64` as the widest vector registers hold.
pub(crate) const LANES: usize = 8;

/// Returns `n` rounded up to a multiple of [`LANES`].
#[cfg_attr(target_arch = "x86_64", inline(always))]
pub(crate) fn padded_len(n: usize) -> usize {
    n.next_multiple_of(LANES)
}

/// Returns `aᵀb` for vectors whose length is a multiple of [`LANES`].
#[cfg_attr(target_arch = "x86_64", inline(always))]
pub(crate) fn dot_padded(a: &[f64], b: &[f64]) -> f64 {
    dot_lanes(a.as_chunks().0, b.as_chunks().0)
}

#[cfg_attr(target_arch = "x86_64", inline(always))]
fn dot_lanes(a: &[[f64; LANES]], b: &[[f64; LANES]]) -> f64 {
    let mut lanes = [0.0f64; LANES];
    for (a, b) in a.iter().zip(b) {
        for lane in 0..LANES {
            lanes[lane] += a[lane] * b[lane];
        }
    }
    let [a, b, c, d, e, f, g, h] = lanes;
    ((a + e) + (c + g)) + ((b + f) + (d + h))
}

/// Computes `y += factor · x` for vectors whose length is a multiple of [`LANES`].
#[cfg_attr(target_arch = "x86_64", inline(always))]
pub(crate) fn add_scaled_padded(y: &mut [f64], factor: f64, x: &[f64]) {
    let y = y.as_chunks_mut::<LANES>().0;
    for (y, x) in y.iter_mut().zip(x.as_chunks::<LANES>().0) {
        let mut sum = *y;
        for lane in 0..LANES {
            sum[lane] += factor * x[lane];
        }
        *y = sum;
    }
}

/// Returns `aᵀb` for vectors of one length.
#[cfg_attr(target_arch = "x86_64", inline(always))]
pub(crate) fn dot(a: &[f64], b: &[f64]) -> f64 {
    let ((a_lanes, a_rest), (b_lanes, b_rest)) = (a.as_chunks(), b.as_chunks());
    let mut rest = 0.0;
    for (a, b) in a_rest.iter().zip(b_rest) {
        rest += a * b;
    }
    dot_lanes(a_lanes, b_lanes) + rest
}

/// Computes `y += factor · x`.
#[cfg_attr(target_arch = "x86_64", inline(always))]
pub(crate) fn add_scaled(y: &mut [f64], factor: f64, x: &[f64]) {
    for (y, x) in y.iter_mut().zip(x) {
        *y += factor * x;
    }
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
        let (a, b, c, d) = (row(m[0]), row(m[1]), row(m[2]), row(m[3]));
        let rows = a.iter().zip(b).zip(c).zip(d);
        for (y, (((a, b), c), d)) in y.iter_mut().zip(rows) {
            *y += (f[0] * a + f[1] * b) + (f[2] * c + f[3] * d);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::super::vectorise;
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
            let whole = n / LANES * LANES;
            let blocks = (&a[..whole], &b[..whole]);
            assert_eq!(
                dot_padded(blocks.0, blocks.1).to_bits(),
                vectorise(|| dot_padded(blocks.0, blocks.1)).to_bits()
            );
            let (matrix, factors) = (vector(7 * n, 3), vector(6, 4));
            let rows = [6, 0, 3, 2, 5, 1];
            let (mut plain, mut wide) = (a.clone(), a.clone());
            add_scaled_rows(&mut plain, &matrix, &rows, &factors);
            vectorise(|| add_scaled_rows(&mut wide, &matrix, &rows, &factors));
            assert_eq!(plain, wide);
        }
    }

    #[test]
    fn padded_functions_agree_with_plain_ones() {
        let (a, b) = (vector(24, 1), vector(24, 2));
        assert!((dot_padded(&a, &b) - dot(&a, &b)).abs() < 1e-9);
        let (mut padded, mut plain) = (a.clone(), a);
        add_scaled_padded(&mut padded, 0.5, &b);
        add_scaled(&mut plain, 0.5, &b);
        assert_eq!(padded, plain);
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
