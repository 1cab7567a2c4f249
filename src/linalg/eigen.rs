//! Eigenvalues and eigenvectors of a symmetric matrix, by cyclic Jacobi rotations (Golub and Van Loan, *Matrix
//! Computations*, section 8.5): slower than by tridiagonal form, but short and exact to rounding.

/// Sweeps over all off-diagonal entries. The method converges quadratically, after about six.
const MAX_SWEEPS: usize = 30;
/// Squared off-diagonal entries at which the matrix counts as diagonal, relative to all squared entries.
const CONVERGED_ENERGY: f64 = 1e-24;

/// Returns the eigenvalues of the symmetric `[n, n]` matrix `a`, largest first, and the eigenvectors as the rows of an
/// `[n, n]` matrix.
pub(crate) fn symmetric_eigen(mut a: Vec<f64>, n: usize) -> (Vec<f64>, Vec<f64>) {
    let mut vectors = vec![0.0; n * n];
    (0..n).for_each(|i| vectors[i * n + i] = 1.0);
    let total: f64 = a.iter().map(|x| x * x).sum();
    for _ in 0..MAX_SWEEPS {
        let off_diagonal: f64 = (0..n)
            .flat_map(|i| (0..i).map(move |j| (i, j)))
            .map(|(i, j)| a[i * n + j] * a[i * n + j])
            .sum();
        if off_diagonal <= CONVERGED_ENERGY * total {
            break;
        }
        for p in 0..n {
            for q in p + 1..n {
                rotate(&mut a, &mut vectors, n, p, q);
            }
        }
    }
    let mut order: Vec<usize> = (0..n).collect();
    order.sort_by(|&i, &j| a[j * n + j].total_cmp(&a[i * n + i]));
    let values = order.iter().map(|&i| a[i * n + i]).collect();
    let rows = order.iter().flat_map(|&i| &vectors[i * n..(i + 1) * n]);
    (values, rows.copied().collect())
}

/// Rotates rows and columns `p` and `q` such that `a[p, q]` becomes zero.
fn rotate(a: &mut [f64], vectors: &mut [f64], n: usize, p: usize, q: usize) {
    let apq = a[p * n + q];
    if apq == 0.0 {
        return;
    }
    let theta = (a[q * n + q] - a[p * n + p]) / (2.0 * apq);
    let t = theta.signum() / (theta.abs() + libm::hypot(theta, 1.0));
    let c = 1.0 / libm::hypot(t, 1.0);
    let s = t * c;
    let rotate = |m: &mut [f64], i: usize, j: usize| {
        let (x, y) = (m[i], m[j]);
        (m[i], m[j]) = (c * x - s * y, s * x + c * y);
    };
    (0..n).for_each(|i| rotate(a, i * n + p, i * n + q));
    for i in 0..n {
        rotate(a, p * n + i, q * n + i);
        rotate(vectors, p * n + i, q * n + i);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn eigenvectors_are_orthonormal_and_diagonalise_the_matrix() {
        let n = 7;
        let b: Vec<f64> = (0..n * n)
            .map(|i| ((i * i + 3 * i) % 11) as f64 - 4.0)
            .collect();
        let at = |i: usize, j: usize| (0..n).map(|k| b[k * n + i] * b[k * n + j]).sum::<f64>();
        let a: Vec<f64> = (0..n * n).map(|i| at(i / n, i % n)).collect();
        let (values, v) = symmetric_eigen(a.clone(), n);
        assert!(values.windows(2).all(|w| w[0] >= w[1]));
        for i in 0..n {
            for j in 0..n {
                let rebuilt: f64 = (0..n)
                    .map(|k| values[k] * v[k * n + i] * v[k * n + j])
                    .sum();
                assert!((rebuilt - a[i * n + j]).abs() < 1e-9 * values[0]);
                let dot: f64 = (0..n).map(|k| v[i * n + k] * v[j * n + k]).sum();
                assert!((dot - f64::from(u8::from(i == j))).abs() < 1e-12);
            }
        }
    }
}
