//! Small vector arithmetic.
//!
//! Nothing here fuses a multiplication with an addition or depends on the width of a register, so
//! every machine, WebAssembly too, gets the same bits.

pub(super) use crate::vectorised::vectorised;

/// Partial sums that a dot product is gathered in; the compiler makes vectors of them.
pub(super) const LANES: usize = 8;

/// `n`, or the next whole number of [`LANES`].
#[inline(always)]
pub(super) fn whole_blocks(n: usize) -> usize {
    n.next_multiple_of(LANES)
}

/// `aᵀb` for vectors of whole blocks, of [`LANES`] numbers each.
#[inline(always)]
pub(super) fn dot_blocks(a: &[f64], b: &[f64]) -> f64 {
    let mut lanes = [0.0f64; LANES];
    for (a, b) in a
        .as_chunks::<LANES>()
        .0
        .iter()
        .zip(b.as_chunks::<LANES>().0)
    {
        for lane in 0..LANES {
            lanes[lane] += a[lane] * b[lane];
        }
    }
    let [a, b, c, d, e, f, g, h] = lanes;
    ((a + e) + (c + g)) + ((b + f) + (d + h))
}

/// `y += factor · x` for vectors of whole blocks.
#[inline(always)]
pub(super) fn add_blocks(y: &mut [f64], factor: f64, x: &[f64]) {
    let y = y.as_chunks_mut::<LANES>().0;
    for (y, x) in y.iter_mut().zip(x.as_chunks::<LANES>().0) {
        let mut sum = *y;
        for lane in 0..LANES {
            sum[lane] += factor * x[lane];
        }
        *y = sum;
    }
}

/// `aᵀb`.
#[inline(always)]
pub(super) fn dot(a: &[f64], b: &[f64]) -> f64 {
    let mut lanes = [0.0f64; LANES];
    let (a_lanes, b_lanes) = (a.chunks_exact(LANES), b.chunks_exact(LANES));
    let mut rest = 0.0;
    for (a, b) in a_lanes.remainder().iter().zip(b_lanes.remainder()) {
        rest += a * b;
    }
    for (a, b) in a_lanes.zip(b_lanes) {
        for lane in 0..LANES {
            lanes[lane] += a[lane] * b[lane];
        }
    }
    let [a, b, c, d, e, f, g, h] = lanes;
    ((a + e) + (c + g)) + ((b + f) + (d + h)) + rest
}

/// `y += factor · x`.
#[inline(always)]
pub(super) fn add_scaled(y: &mut [f64], factor: f64, x: &[f64]) {
    for (y, x) in y.iter_mut().zip(x) {
        *y += factor * x;
    }
}

/// `y += Σ_i factors[i] · rows[members[i]]` for the rows of a `[_, k]` matrix, `k` the length of `y`.
#[inline(always)]
pub(super) fn add_rows(y: &mut [f64], matrix: &[f64], members: &[usize], factors: &[f64]) {
    let k = y.len();
    let row = |m: usize| &matrix[m * k..(m + 1) * k];
    // Four rows a pass: y is then loaded and stored a quarter as often.
    let (fours, factor_fours) = (members.chunks_exact(4), factors.chunks_exact(4));
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
    use super::*;

    fn numbers(n: usize, seed: usize) -> Vec<f64> {
        (0..n)
            .map(|i| ((i * 7919 + seed * 104_729) % 1009) as f64 / 97.0 - 5.0)
            .collect()
    }

    #[test]
    fn wide_instructions_give_the_same_bits() {
        for n in [0, 1, 7, 8, 80, 225] {
            let (a, b) = (numbers(n, 1), numbers(n, 2));
            assert_eq!(dot(&a, &b).to_bits(), vectorised(|| dot(&a, &b)).to_bits());
            let whole = n / LANES * LANES;
            let blocks = (&a[..whole], &b[..whole]);
            assert_eq!(
                dot_blocks(blocks.0, blocks.1).to_bits(),
                vectorised(|| dot_blocks(blocks.0, blocks.1)).to_bits()
            );
            let (matrix, factors) = (numbers(7 * n, 3), numbers(6, 4));
            let members = [6, 0, 3, 2, 5, 1];
            let (mut plain, mut wide) = (a.clone(), a.clone());
            add_rows(&mut plain, &matrix, &members, &factors);
            vectorised(|| add_rows(&mut wide, &matrix, &members, &factors));
            assert_eq!(plain, wide);
        }
    }

    #[test]
    fn blocks_are_vectors() {
        let (a, b) = (numbers(24, 1), numbers(24, 2));
        assert!((dot_blocks(&a, &b) - dot(&a, &b)).abs() < 1e-9);
        let (mut whole, mut plain) = (a.clone(), a);
        add_blocks(&mut whole, 0.5, &b);
        add_scaled(&mut plain, 0.5, &b);
        assert_eq!(whole, plain);
        assert_eq!([0, 1, 8, 9].map(whole_blocks), [0, 8, 8, 16]);
    }

    #[test]
    fn rows_add_up() {
        let mut y = vec![1.0, 2.0];
        let matrix: Vec<f64> = (0..12).map(f64::from).collect();
        add_rows(
            &mut y,
            &matrix,
            &[0, 1, 2, 3, 5],
            &[1.0, 1.0, 1.0, 1.0, 0.5],
        );
        assert_eq!(y, [1.0 + 12.0 + 5.0, 2.0 + 16.0 + 5.5]);
        assert_eq!(dot(&y, &[2.0, -1.0]), 36.0 - 23.5);
    }
}
