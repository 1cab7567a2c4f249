//! Low rank: the kernel Nyström method (Wang, Dong, Tong, Lin & Guo 2009).
//!
//! Some columns of T are photographed by lighting one element each, and some rows by lighting the
//! scene from the camera's side and looking from the light's, which takes a second projector and
//! camera that a usual rig does not have. With `A` where the two cross, `T ≈ f⁻¹(f(C) f(A)⁺ f(R))`:
//! the kernel `f(x) = x^γ`, taken element by element, flattens the light so that fewer rows and
//! columns carry more of it.

use crate::executor::Executor;

/// Exponents γ to choose from.
const EXPONENTS: [f64; 5] = [1.0, 0.7, 0.5, 0.35, 0.25];
/// Ridges to choose from, as shares of the mean of the Gram matrix's diagonal.
const RIDGES: [f64; 5] = [1e-10, 1e-6, 1e-3, 1e-1, 1e1];
/// One row in so many is held out while exponent and ridge are chosen.
const HOLD_OUT_EVERY: usize = 5;

/// Rows and columns of one channel's T, as photographed.
#[derive(Clone, Debug)]
pub struct Samples {
    /// Light elements sampled.
    pub elements: Vec<usize>,
    /// What every pixel sees of each: `[N, r]`.
    pub columns: Vec<f64>,
    /// Camera pixels sampled.
    pub pixels: Vec<usize>,
    /// What each of them sees of every light element: `[c, M]`.
    pub rows: Vec<f64>,
    /// Light elements, `M`.
    pub light: usize,
}

/// A transport of low rank under a kernel.
#[derive(Clone, Debug)]
pub struct Nystrom {
    exponent: f64,
    /// `f(C)`, `[N, r]`.
    columns: Vec<f64>,
    /// `f(A)⁺ f(R)`, `[r, M]`.
    mixing: Vec<f64>,
    rank: usize,
    light: usize,
}

impl Nystrom {
    /// Chooses exponent and ridge by how well held-out rows are predicted, then uses all rows.
    pub fn new(samples: &Samples, executor: &impl Executor) -> Self {
        let candidates: Vec<(f64, f64)> = EXPONENTS
            .iter()
            .flat_map(|&exponent| RIDGES.map(|ridge| (exponent, ridge)))
            .collect();
        let (held, kept): (Vec<usize>, Vec<usize>) =
            (0..samples.pixels.len()).partition(|i| i % HOLD_OUT_EVERY == HOLD_OUT_EVERY - 1);
        let errors = executor.map(candidates.len(), |i| {
            let (exponent, ridge) = candidates[i];
            let fit = Self::fit(samples, &kept, exponent, ridge);
            let rows = held.iter().map(|&h| {
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

    /// From the rows numbered `rows`.
    fn fit(samples: &Samples, rows: &[usize], exponent: f64, ridge: f64) -> Self {
        let (rank, light) = (samples.elements.len(), samples.light);
        let kernel = |x: f64| x.max(0.0).powf(exponent);
        // Normal equations of f(A)·X = f(R).
        let mut gram = vec![0.0; rank * rank];
        let mut mixing = vec![0.0; rank * light];
        for &i in rows {
            let row: Vec<f64> = samples.rows[i * light..(i + 1) * light]
                .iter()
                .map(|&t| kernel(t))
                .collect();
            // Of a crossing there are two photographs; that of the column also multiplies later.
            let n = samples.pixels[i];
            let crossing: Vec<f64> = samples.columns[n * rank..(n + 1) * rank]
                .iter()
                .map(|&t| kernel(t))
                .collect();
            for (a, &here) in crossing.iter().enumerate() {
                if here == 0.0 {
                    continue;
                }
                add_scaled(&mut gram[a * rank..(a + 1) * rank], here, &crossing);
                add_scaled(&mut mixing[a * light..(a + 1) * light], here, &row);
            }
        }
        let mean = (0..rank).map(|i| gram[i * rank + i]).sum::<f64>() / rank as f64;
        for i in 0..rank {
            gram[i * rank + i] += (ridge * mean).max(f64::MIN_POSITIVE);
        }
        solve_in_place(&mut gram, &mut mixing, rank, light);
        Self {
            exponent,
            columns: samples.columns.iter().map(|&t| kernel(t)).collect(),
            mixing,
            rank,
            light,
        }
    }

    /// What pixel `n` sees of every light element, `[M]`.
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

/// `sum += factor · values`.
fn add_scaled(sum: &mut [f64], factor: f64, values: &[f64]) {
    for (sum, value) in sum.iter_mut().zip(values) {
        *sum += factor * value;
    }
}

/// Replaces `right`, `[k, width]`, by the solution of `matrix · x = right`, through the Cholesky
/// factor of `matrix`, `[k, k]`, symmetric and positive definite, which it overwrites. A pivot lost
/// to rounding drops its unknown.
fn solve_in_place(matrix: &mut [f64], right: &mut [f64], k: usize, width: usize) {
    let mut dropped = vec![false; k];
    for i in 0..k {
        let whole = matrix[i * k + i];
        for j in 0..=i {
            let (above, row) = matrix.split_at(i * k);
            let other = if j < i {
                &above[j * k..j * k + j]
            } else {
                &row[..i]
            };
            let dot: f64 = row.iter().zip(other).map(|(a, b)| a * b).sum();
            let left = row[j] - dot;
            matrix[i * k + j] = match i == j {
                true if left > 1e-14 * whole => left.sqrt(),
                true => {
                    dropped[i] = true;
                    1.0
                }
                false if dropped[j] => 0.0,
                false => left / matrix[j * k + j],
            };
        }
    }
    for i in 0..k {
        let (above, row) = right.split_at_mut(i * width);
        let row = &mut row[..width];
        if dropped[i] {
            row.fill(0.0);
            continue;
        }
        for j in 0..i {
            add_scaled(row, -matrix[i * k + j], &above[j * width..(j + 1) * width]);
        }
        row.iter_mut().for_each(|x| *x /= matrix[i * k + i]);
    }
    for i in (0..k).rev() {
        let (row, below) = right[i * width..].split_at_mut(width);
        if dropped[i] {
            continue;
        }
        for j in i + 1..k {
            let x = &below[(j - i - 1) * width..(j - i) * width];
            add_scaled(row, -matrix[j * k + i], x);
        }
        row.iter_mut().for_each(|x| *x /= matrix[i * k + i]);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::executor::SequentialExecutor;

    #[test]
    fn a_matrix_of_low_rank_comes_back() {
        let (pixels, light, rank) = (40, 30, 3);
        let factor =
            |i: usize, k: usize| 0.2 + ((i * 37 + k * 101 + i * k * 13) % 29) as f64 / 29.0;
        let element = |n: usize, m: usize| -> f64 {
            (0..rank).map(|k| factor(n, k) * factor(m + 91, k)).sum()
        };
        let elements: Vec<usize> = (0..6).map(|i| i * 5).collect();
        let sampled: Vec<usize> = (0..10).map(|i| i * 4).collect();
        let samples = Samples {
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
        let nystrom = Nystrom::new(&samples, &SequentialExecutor);
        let (mut signal, mut error) = (0.0, 0.0);
        for n in 0..pixels {
            for (m, estimate) in nystrom.pixel(n).into_iter().enumerate() {
                signal += element(n, m).powi(2);
                error += (element(n, m) - estimate).powi(2);
            }
        }
        assert!(error < 1e-8 * signal, "{}", error / signal);
    }

    #[test]
    fn cholesky_solves() {
        let mut matrix = vec![4.0, 2.0, 0.4, 2.0, 5.0, 1.0, 0.4, 1.0, 3.0];
        let mut right = vec![1.0, 0.0, 2.0, 1.0, 3.0, -1.0];
        let (a, b) = (matrix.clone(), right.clone());
        solve_in_place(&mut matrix, &mut right, 3, 2);
        for i in 0..3 {
            for w in 0..2 {
                let back: f64 = (0..3).map(|j| a[i * 3 + j] * right[j * 2 + w]).sum();
                assert!((back - b[i * 2 + w]).abs() < 1e-12);
            }
        }
    }
}
