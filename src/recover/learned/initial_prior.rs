//! The prior that training starts from: smooth variations of the mean light transport function.
//!
//! With the mean function h, `[S]`, a function τ/f is taken to vary around h with the covariance
//!
//! ```text
//! Σ(s, t) = 0.3 h(s) h(t) exp(−|s − t| / 1 element)
//! ```
//!
//! between elements s and t. The leading eigenvectors of Σ, by subspace iteration (Golub and Van Loan,
//! *Matrix Computations*, section 8.2), are the initial basis. After expectation–maximisation over that
//! basis, [`truncate_basis`] keeps the directions in which functions vary most.

use super::prior::Prior;
use crate::job_executor::Executor;
use crate::linalg::{self, add_scaled, dot};

/// Rank of the initial basis; with the mean function a whole number of vector registers.
pub(super) const MAX_INITIAL_RANK: usize = 95;
/// Rounds of subspace iteration: the basis needs to span the leading eigenvectors, not to equal them.
const SUBSPACE_ITERATIONS: usize = 4;
/// Correlation length, in elements. Twice as much is too smooth for textured glass, and training does not make up for
/// what the initial basis lacks.
const CORRELATION_LENGTH: f64 = 1.0;
/// Variance of the variations, as a share of h².
const RELATIVE_VARIANCE: f64 = 0.3;

/// The initial basis around `mean`, `[r, side²]`, orthonormal, and the prior over it.
pub(super) fn initial_prior(
    mean: &[f64],
    side: usize,
    executor: &impl Executor,
) -> (Vec<f64>, Prior) {
    let area = side * side;
    let rank = MAX_INITIAL_RANK.min(area);
    let covariance = executor.map(area, |s| {
        let (v, u) = ((s / side) as f64, (s % side) as f64);
        let row = (0..area).map(|t| {
            let (dv, du) = (v - (t / side) as f64, u - (t % side) as f64);
            let distance = (dv * dv + du * du).sqrt();
            RELATIVE_VARIANCE * mean[s] * mean[t] * libm::exp(-distance / CORRELATION_LENGTH)
        });
        row.collect::<Vec<f64>>()
    });
    let apply_covariance = |functions: &[f64]| -> Vec<f64> {
        let products = executor.map(rank, |k| {
            let function = &functions[k * area..(k + 1) * area];
            let product = covariance.iter().map(|row| dot(row, function));
            product.collect::<Vec<f64>>()
        });
        products.concat()
    };
    // Cosines of rising frequency times h are near the eigenvectors.
    let frequencies = (0..).flat_map(|sum| (0..=sum).map(move |v| (v, sum - v)));
    let cosine = |f: usize, x: usize| linalg::cos_pi(f * (2 * x + 1), 2 * side);
    let mut functions: Vec<f64> = Vec::with_capacity(rank * area);
    for (fv, fu) in frequencies.take(rank) {
        let value = |s: usize| cosine(fv, s / side) * cosine(fu, s % side) * mean[s].max(1e-9);
        functions.extend((0..area).map(value));
    }
    for _ in 0..SUBSPACE_ITERATIONS {
        functions = apply_covariance(&functions);
        orthonormalise(&mut functions, area);
    }
    let products = apply_covariance(&functions);
    let transposed = linalg::transpose(&functions, area);
    let coefficient_covariance = linalg::multiply(&products, &transposed, area, rank);
    let coefficients: Vec<f64> = functions.chunks_exact(area).map(|v| dot(v, mean)).collect();
    (functions, Prior::new(&coefficients, coefficient_covariance))
}

/// Orthonormalises the rows of a `[count, length]` matrix by Gram–Schmidt, twice against rounding. A row that depends on
/// earlier ones is replaced by a unit vector.
fn orthonormalise(rows: &mut [f64], length: usize) {
    for k in 0..rows.len() / length {
        let (before, rest) = rows.split_at_mut(k * length);
        let row = &mut rest[..length];
        for unit_vector in 0..=length {
            normalise(row);
            for _ in 0..2 {
                for other in before.chunks_exact(length) {
                    let projection = dot(other, row);
                    add_scaled(row, -projection, other);
                }
            }
            if normalise(row) > 1e-8 || unit_vector == length {
                break;
            }
            row.fill(0.0);
            row[unit_vector] = 1.0;
        }
    }
}

/// Scales a vector other than zero to length 1. Returns its length before.
fn normalise(x: &mut [f64]) -> f64 {
    let norm = dot(x, x).sqrt();
    if norm > 0.0 {
        x.iter_mut().for_each(|x| *x /= norm);
    }
    norm
}

/// The directions in which functions vary most: the eigenvectors of the prior's second moment, C + mmᵀ, `[r, r]`, the one
/// with the largest eigenvalue first.
pub(super) fn principal_axes(prior: &Prior) -> Vec<f64> {
    let full = prior.rank;
    let mut second_moment = prior.covariance.clone();
    for mean in &prior.means {
        for i in 0..full {
            let share = mean[i] / prior.means.len() as f64;
            add_scaled(&mut second_moment[i * full..(i + 1) * full], share, mean);
        }
    }
    linalg::symmetric_eigen(second_moment, full).1
}

/// Keeps the first `rank` of the principal `axes`: basis functions, `[rank, area]`, and the prior over them.
pub(super) fn truncate_basis(
    functions: &[f64],
    prior: &Prior,
    axes: &[f64],
    rank: usize,
) -> (Vec<f64>, Prior) {
    let full = prior.rank;
    let area = functions.len() / full;
    let rotation = &axes[..rank * full];
    let rotated = linalg::multiply(rotation, &prior.covariance, full, full);
    let covariance = linalg::multiply(&rotated, &linalg::transpose(rotation, full), full, rank);
    let mut truncated = Prior::new(&vec![0.0; rank], covariance);
    truncated.noise_factor = prior.noise_factor;
    for (mean, full_mean) in truncated.means.iter_mut().zip(&prior.means) {
        let rows = rotation.chunks_exact(full);
        *mean = rows.map(|v| dot(v, full_mean)).collect();
    }
    (linalg::multiply(rotation, functions, full, area), truncated)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::job_executor::SequentialExecutor;
    use crate::recover::mean_function::smooth;

    #[test]
    fn initial_basis_is_orthonormal() {
        let side = 11;
        let mut mean = vec![0.0; side * side];
        mean[60] = 0.7;
        mean[61] = 0.3;
        let (functions, prior) = initial_prior(&smooth(&mean, side), side, &SequentialExecutor);
        for i in 0..prior.rank {
            for j in 0..=i {
                let row = |k: usize| &functions[k * 121..(k + 1) * 121];
                let expected = f64::from(u8::from(i == j));
                assert!((dot(row(i), row(j)) - expected).abs() < 1e-9);
            }
        }
    }

    #[test]
    fn truncation_keeps_the_directions_of_largest_second_moment() {
        // Second moments 1, 9 and 4: the mean's square adds to the covariance.
        let functions = [0.0, 1.0, 0.0, 0.0, 0.0, 1.0, 1.0, 0.0, 0.0];
        let prior = Prior::new(
            &[0.0, 2.0, 0.0],
            vec![1.0, 0.0, 0.0, 0.0, 5.0, 0.0, 0.0, 0.0, 4.0],
        );
        let (kept, truncated) = truncate_basis(&functions, &prior, &principal_axes(&prior), 2);
        let expected = [[0.0, 0.0, 1.0], [1.0, 0.0, 0.0]];
        for (function, expected) in kept.chunks_exact(3).zip(expected) {
            assert!(
                (dot(function, &expected).abs() - 1.0).abs() < 1e-12,
                "{kept:?}"
            );
        }
        assert!((truncated.means[0][0].abs() - 2.0).abs() < 1e-12);
        assert!((truncated.covariance[0] - 5.0).abs() < 1e-12);
        assert!((truncated.covariance[3] - 4.0).abs() < 1e-12);
    }
}
