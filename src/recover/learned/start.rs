//! Where learning starts: smooth variations of the mean light transport function.

use super::prior::Prior;
use crate::executor::Executor;
use crate::linalg::{self, add_scaled, dot};

/// Kernels that learning starts with. Together with the mean a whole number of vector registers.
pub(super) const KERNELS: usize = 95;
/// Rounds of subspace iteration: the kernels need span the large directions, not be exact.
const ROUNDS: usize = 12;
/// Distance, in elements, over which variations of a function are taken to be correlated at first.
/// Twice as much is too smooth for textured glass, and what the start lacks is not learned later.
const CORRELATION: f64 = 1.0;
/// Variance of these variations, as a share of the mean's square.
const VARIANCE: f64 = 0.3;
/// Standard deviation, in elements, of the blur that takes the noise from the pooled mean.
const BLUR: f64 = 1.0;

/// Blurs a function on the window, keeping its sum near 1.
pub(super) fn blur(mean: &[f64], side: usize) -> Vec<f64> {
    let reach = (3.0 * BLUR).ceil() as i64;
    let tap = |d: i64| (-0.5 * (d as f64 / BLUR).powi(2)).exp();
    let norm: f64 = (-reach..=reach).map(tap).sum();
    let line = |values: &[f64], stride: usize, lines: usize| {
        let mut out = vec![0.0; values.len()];
        for i in 0..side {
            for line in 0..side {
                out[i * stride + line * lines] = (-reach..=reach)
                    .filter_map(|d| {
                        let j = usize::try_from(i as i64 + d).ok().filter(|&j| j < side)?;
                        Some(tap(d) / norm * values[j * stride + line * lines])
                    })
                    .sum();
            }
        }
        out
    };
    let blurred = line(&line(mean, 1, side), side, 1);
    let sum: f64 = blurred.iter().sum();
    blurred.iter().map(|m| m / sum).collect()
}

/// Kernels that span the likely variations of `mean`, `[r, element]`, orthonormal, and the prior on
/// them: covariance `0.3 h(s) h(t) exp(-|s - t|)`.
pub(super) fn first_prior(
    mean: &[f64],
    side: usize,
    executor: &impl Executor,
) -> (Vec<f64>, Prior) {
    let area = side * side;
    let rank = KERNELS.min(area);
    let rows = executor.map(area, |s| {
        let (v, u) = ((s / side) as f64, (s % side) as f64);
        (0..area)
            .map(|t| {
                let distance = (v - (t / side) as f64).hypot(u - (t % side) as f64);
                VARIANCE * mean[s] * mean[t] * (-distance / CORRELATION).exp()
            })
            .collect::<Vec<f64>>()
    });
    let apply = |kernels: &[f64]| -> Vec<f64> {
        executor
            .map(rank, |k| {
                let kernel = &kernels[k * area..(k + 1) * area];
                rows.iter()
                    .map(|row| dot(row, kernel))
                    .collect::<Vec<f64>>()
            })
            .concat()
    };
    // Start from functions of rising frequency, which the covariance's own are like.
    let mut kernels: Vec<f64> = (0..rank)
        .flat_map(|k| {
            let (fv, fu) = diagonal(k);
            let wave = move |f: usize, x: usize| {
                (std::f64::consts::PI * f as f64 * (x as f64 + 0.5) / side as f64).cos()
            };
            (0..area).map(move |s| wave(fv, s / side) * wave(fu, s % side) * mean[s].max(1e-9))
        })
        .collect();
    for _ in 0..ROUNDS {
        kernels = apply(&kernels);
        orthonormalise(&mut kernels, area);
    }
    let covariance = linalg::multiply(
        &apply(&kernels),
        &linalg::transpose(&kernels, area),
        area,
        rank,
    );
    let coefficients: Vec<f64> = kernels.chunks_exact(area).map(|v| dot(v, mean)).collect();
    (kernels, Prior::new(&coefficients, covariance))
}

/// The `k`-th pair of frequencies, by rising sum.
fn diagonal(k: usize) -> (usize, usize) {
    let mut sum = 0;
    let mut left = k;
    while left > sum {
        left -= sum + 1;
        sum += 1;
    }
    (left, sum - left)
}

/// Gram–Schmidt, twice over for the sake of rounding. Rows that depend on earlier ones are replaced
/// by single elements.
fn orthonormalise(rows: &mut [f64], length: usize) {
    let count = rows.len() / length;
    for k in 0..count {
        let (before, rest) = rows.split_at_mut(k * length);
        let row = &mut rest[..length];
        let mut spare = 0;
        loop {
            let first = dot(row, row).sqrt();
            if first > 0.0 {
                row.iter_mut().for_each(|x| *x /= first);
            }
            for _ in 0..2 {
                for other in before.chunks_exact(length) {
                    let share = dot(other, row);
                    add_scaled(row, -share, other);
                }
            }
            let norm = dot(row, row).sqrt();
            if norm > 1e-8 {
                row.iter_mut().for_each(|x| *x /= norm);
                break;
            }
            if spare == length {
                break;
            }
            row.fill(0.0);
            row[spare] = 1.0;
            spare += 1;
        }
    }
}

/// Keeps the `rank` directions, at most the prior's own number, in which functions vary most, mean and
/// all: kernels `[rank, element]` and the prior on them.
pub(super) fn cut(kernels: &[f64], prior: &Prior, rank: usize, area: usize) -> (Vec<f64>, Prior) {
    let full = prior.rank;
    let mut moment = prior.covariance.clone();
    for mean in &prior.mean {
        for i in 0..full {
            let share = mean[i] / prior.mean.len() as f64;
            add_scaled(&mut moment[i * full..(i + 1) * full], share, mean);
        }
    }
    let (_, vectors) = crate::linalg::symmetric_eigen(moment, full);
    let kept = &vectors[..rank * full];
    let rotated = linalg::multiply(kept, &prior.covariance, full, full);
    let covariance = linalg::multiply(&rotated, &linalg::transpose(kept, full), full, rank);
    let mut cut = Prior::new(&vec![0.0; rank], covariance);
    cut.noise = prior.noise;
    for (mean, old) in cut.mean.iter_mut().zip(&prior.mean) {
        *mean = kept.chunks_exact(full).map(|v| dot(v, old)).collect();
    }
    (linalg::multiply(kept, kernels, full, area), cut)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::executor::SequentialExecutor;

    #[test]
    fn first_kernels_are_orthonormal() {
        let side = 11;
        let mut mean = vec![0.0; side * side];
        mean[60] = 0.7;
        mean[61] = 0.3;
        let (kernels, prior) = first_prior(&blur(&mean, side), side, &SequentialExecutor);
        for i in 0..prior.rank {
            for j in 0..=i {
                let row = |k: usize| &kernels[k * 121..(k + 1) * 121];
                let expected = f64::from(u8::from(i == j));
                assert!((dot(row(i), row(j)) - expected).abs() < 1e-9);
            }
        }
    }
}
