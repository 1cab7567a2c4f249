//! Low-rank acquisition: the kernel Nyström method (Wang, Dong, Tong, Lin & Guo 2009).
//!
//! ```text
//! T ≈ f⁻¹(f(R)ᵀ f(A)⁺ᵀ f(C)),   f(x) = x^γ element by element
//! ```
//!
//! with C the columns of photographs of single elements, R the rows photographed in the other direction, and A where
//! both cross. Rows need a second projector at the camera's position and a second camera at the light's. The kernel f
//! compresses the range of values, so that a lower rank suffices.

use crate::job_executor::Executor;
use crate::linalg::{add_scaled, cholesky_solve, cholesky_with_ridge, transpose};

/// Exponents γ to choose from.
const EXPONENTS: [f64; 5] = [1.0, 0.7, 0.5, 0.35, 0.25];
/// Ridges to choose from, relative to the mean of the Gram matrix's diagonal.
const RIDGES: [f64; 5] = [1e-10, 1e-6, 1e-3, 1e-1, 1e1];
/// Every so many rows, one is held out to choose exponent and ridge.
const HOLDOUT_INTERVAL: usize = 5;

/// Photographed rows and columns of one channel of T.
#[derive(Clone, Debug)]
pub(super) struct NystromSamples {
    /// Indices of the photographed light elements.
    pub elements: Vec<usize>,
    /// Their measurements, `[N, r]`.
    pub columns: Vec<f64>,
    /// Indices of the photographed camera pixels.
    pub pixels: Vec<usize>,
    /// Their measurements of every light element, `[pixel, M]`.
    pub rows: Vec<f64>,
    /// Number of light elements, M.
    pub light: usize,
}

/// A transport with low rank under a kernel.
#[derive(Clone, Debug)]
pub(super) struct NystromTransport {
    exponent: f64,
    /// `f(C)`, `[N, r]`.
    columns: Vec<f64>,
    /// `f(A)⁺ f(R)`, `[r, M]`.
    mixing: Vec<f64>,
    rank: usize,
    light: usize,
}

impl NystromTransport {
    /// Chooses the exponent and the ridge with the smallest error on held-out rows, then fits all rows.
    pub fn new(samples: &NystromSamples, executor: &impl Executor) -> Self {
        let with_ridges = |exponent| RIDGES.map(|ridge| (exponent, ridge));
        let candidates: Vec<(f64, f64)> = EXPONENTS.into_iter().flat_map(with_ridges).collect();
        let (held_out, training): (Vec<usize>, Vec<usize>) =
            (0..samples.pixels.len()).partition(|i| i % HOLDOUT_INTERVAL == HOLDOUT_INTERVAL - 1);
        let errors = executor.map(candidates.len(), |i| {
            let (exponent, ridge) = candidates[i];
            let fit = Self::fit(samples, &training, exponent, ridge);
            let rows = held_out.iter().map(|&h| {
                let estimate = fit.pixel(samples.pixels[h]);
                let row = &samples.rows[h * samples.light..(h + 1) * samples.light];
                let squares = row.iter().zip(estimate).map(|(t, e)| (t - e).powi(2));
                squares.sum::<f64>()
            });
            rows.sum::<f64>()
        });
        let best = (0..candidates.len()).min_by(|&a, &b| errors[a].total_cmp(&errors[b]));
        let (exponent, ridge) = candidates[best.unwrap_or(0)];
        let all: Vec<usize> = (0..samples.pixels.len()).collect();
        Self::fit(samples, &all, exponent, ridge)
    }

    /// Fits the rows `row_indices`.
    fn fit(samples: &NystromSamples, row_indices: &[usize], exponent: f64, ridge: f64) -> Self {
        let (rank, light) = (samples.elements.len(), samples.light);
        let kernel = |x: &f64| x.max(0.0).powf(exponent);
        let columns: Vec<f64> = samples.columns.iter().map(kernel).collect();
        // Normal equations of f(A)·X = f(R).
        let mut gram = vec![0.0; rank * rank];
        let mut mixing = vec![0.0; rank * light];
        for &i in row_indices {
            let row = samples.rows[i * light..][..light].iter();
            let row: Vec<f64> = row.map(kernel).collect();
            // Elements of A are photographed twice. The column's photograph is also the one in f(C).
            let crossing = &columns[samples.pixels[i] * rank..][..rank];
            for (a, &here) in crossing.iter().enumerate() {
                if here == 0.0 {
                    continue;
                }
                add_scaled(&mut gram[a * rank..(a + 1) * rank], here, crossing);
                add_scaled(&mut mixing[a * light..(a + 1) * light], here, &row);
            }
        }
        let mean = (0..rank).map(|i| gram[i * rank + i]).sum::<f64>() / rank as f64;
        let mixing = solve_with_ridge(&gram, &mixing, rank, ridge * mean);
        Self {
            exponent,
            columns,
            mixing,
            rank,
            light,
        }
    }

    /// The column of pixel `n`, `[M]`.
    pub fn pixel(&self, n: usize) -> Vec<f64> {
        let mut row = vec![0.0; self.light];
        let columns = &self.columns[n * self.rank..(n + 1) * self.rank];
        for (&c, mixing) in columns.iter().zip(self.mixing.chunks_exact(self.light)) {
            add_scaled(&mut row, c, mixing);
        }
        for t in &mut row {
            *t = t.max(0.0).powf(1.0 / self.exponent);
        }
        row
    }
}

/// Solves `(matrix + ridge · I) x = right` for `right`, `[k, width]`, with a matrix `[k, k]`.
fn solve_with_ridge(matrix: &[f64], right: &[f64], k: usize, ridge: f64) -> Vec<f64> {
    let mut columns = transpose(right, right.len() / k.max(1));
    if let Some((factor, _)) = cholesky_with_ridge(matrix, k, ridge) {
        for column in columns.chunks_exact_mut(k.max(1)) {
            cholesky_solve(&factor, column);
        }
    }
    transpose(&columns, k)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::job_executor::SequentialExecutor;

    #[test]
    fn a_low_rank_matrix_is_reproduced() {
        let (pixels, light, rank) = (40, 30, 3);
        let factor =
            |i: usize, k: usize| 0.2 + ((i * 37 + k * 101 + i * k * 13) % 29) as f64 / 29.0;
        let element = |n: usize, m: usize| -> f64 {
            (0..rank).map(|k| factor(n, k) * factor(m + 91, k)).sum()
        };
        let elements: Vec<usize> = (0..6).map(|i| i * 5).collect();
        let sampled: Vec<usize> = (0..10).map(|i| i * 4).collect();
        let samples = NystromSamples {
            columns: (0..pixels)
                .flat_map(|n| elements.iter().map(move |&m| element(n, m)))
                .collect(),
            rows: sampled
                .iter()
                .flat_map(|&n| (0..light).map(move |m| element(n, m)))
                .collect(),
            elements,
            pixels: sampled,
            light,
        };
        let nystrom = NystromTransport::new(&samples, &SequentialExecutor);
        let (mut signal, mut error) = (0.0, 0.0);
        for n in 0..pixels {
            for (m, estimate) in nystrom.pixel(n).into_iter().enumerate() {
                signal += element(n, m).powi(2);
                error += (element(n, m) - estimate).powi(2);
            }
        }
        assert!(error < 1e-8 * signal, "{}", error / signal);
    }
}
