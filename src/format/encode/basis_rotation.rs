//! The basis of a file: an orthonormal basis of the recovered basis's span, whose first function alone
//! responds to a flat light, and whose others are the principal components of the coefficients.

use serde::{Deserialize, Serialize};

use crate::linalg::{mirror_upper, multiply, symmetric_eigen, transpose, vectorise};
use crate::transport::{Basis, CHANNELS, FloatTile};

/// Smallest eigenvalue of the Gram matrix, relative to the largest, of a direction of the span.
const MIN_EIGENVALUE_RATIO: f64 = 1e-9;

/// An orthonormal basis, and the rotation of coefficients to it.
///
/// Function 0 is the projection of the constant function on the span: a flat light sees component 0 and no other, so
/// that errors of the others do not show under it. The other functions are principal components, the strongest first.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct BasisRotation {
    pub basis: Basis,
    /// Sum of squared coefficients of each component.
    pub energies: Vec<f64>,
    /// `[input component, component]`.
    matrix: Vec<f64>,
    input_rank: usize,
}

impl BasisRotation {
    /// The rotation for a basis whose coefficients have the given [moments](coefficient_moments); `None` if all its
    /// functions are zero.
    pub fn new(basis: &Basis, moment: &[f64]) -> Option<Self> {
        let input_rank = basis.rank();
        let area = basis.kernels.first().map_or(0, Vec::len);
        let dot = |i: usize| -> f64 {
            let [a, b] = [i / input_rank, i % input_rank].map(|k| &basis.kernels[k]);
            let products = a.iter().zip(b).map(|(a, b)| f64::from(*a) * f64::from(*b));
            products.sum()
        };
        let gram = (0..input_rank * input_rank).map(dot).collect();
        let (values, vectors) = symmetric_eigen(gram, input_rank);
        let rank = values
            .iter()
            .take_while(|v| **v > MIN_EIGENVALUE_RATIO * values[0])
            .count();
        if rank == 0 {
            return None;
        }
        // Input coefficients to coefficients over orthonormal functions.
        let mut to_orthonormal = vec![0.0; input_rank * rank];
        let mut orthonormal = vec![vec![0.0f64; area]; rank];
        for i in 0..rank {
            let length = values[i].sqrt();
            for k in 0..input_rank {
                let share = vectors[i * input_rank + k];
                to_orthonormal[k * rank + i] = share * length;
                for (q, v) in orthonormal[i].iter_mut().zip(&basis.kernels[k]) {
                    *q += share / length * f64::from(*v);
                }
            }
        }
        let moment = congruence(moment, &to_orthonormal, input_rank, rank);
        let sums: Vec<f64> = orthonormal.iter().map(|q| q.iter().sum()).collect();
        let (rotated, energies) = flat_first(&moment, &sums, rank);
        let function = |j: usize| {
            let element = |s: usize| -> f64 {
                let terms = (0..rank).map(|i| rotated[i * rank + j] * orthonormal[i][s]);
                terms.sum()
            };
            (0..area).map(|s| element(s) as f32).collect()
        };
        Some(Self {
            basis: Basis {
                kernels: (0..rank).map(function).collect(),
            },
            energies,
            matrix: multiply(&to_orthonormal, &rotated, rank, rank),
            input_rank,
        })
    }

    /// Number of functions.
    pub fn rank(&self) -> usize {
        self.basis.rank()
    }

    /// Sum of squared coefficients of all components.
    pub fn energy(&self) -> f64 {
        self.energies.iter().sum()
    }

    /// Upper bound on the ratio of a coefficient of component `j` to the largest input coefficient: the ℓ1
    /// norm of a column.
    pub fn gain(&self, j: usize) -> f64 {
        let rows = self.matrix.chunks_exact(self.rank());
        rows.map(|row| row[j].abs()).sum()
    }

    /// Drops all but the first `rank` components.
    pub fn truncate(&mut self, rank: usize) {
        let old_rank = self.rank();
        self.basis.kernels.truncate(rank);
        self.energies.truncate(rank);
        let rows = self.matrix.chunks_exact(old_rank);
        self.matrix = rows.flat_map(|row| &row[..rank]).copied().collect();
    }

    /// A tile's coefficients over this basis, `[pixel, component]`; empty if it has none.
    pub fn coefficients(&self, tile: &FloatTile) -> Vec<[f32; CHANNELS]> {
        let rank = self.rank();
        let pixels = tile.coefficients.len() / self.input_rank;
        let mut rotated = vec![[0.0f32; CHANNELS]; pixels * rank];
        let matrix: Vec<f32> = self.matrix.iter().map(|r| *r as f32).collect();
        // One pixel, `[channel, component]`: consecutive sums fill vector registers.
        let mut sums = vec![0.0f32; CHANNELS * rank];
        vectorise(
            #[inline(always)]
            || {
                let pixels = tile.coefficients.chunks_exact(self.input_rank);
                for (input, rotated) in pixels.zip(rotated.chunks_exact_mut(rank)) {
                    sums.fill(0.0);
                    for (coefficient, row) in input.iter().zip(matrix.chunks_exact(rank)) {
                        for (sums, value) in sums.chunks_exact_mut(rank).zip(coefficient) {
                            for (sum, weight) in sums.iter_mut().zip(row) {
                                *sum += value * weight;
                            }
                        }
                    }
                    for (k, rotated) in rotated.iter_mut().enumerate() {
                        *rotated = std::array::from_fn(|channel| sums[channel * rank + k]);
                    }
                }
            },
        );
        rotated
    }
}

/// Second moments of a tile's coefficients: Σ c cᵀ over pixels and channels, `[rank, rank]`. Values that are
/// not finite count as zero.
pub fn coefficient_moments(tile: &FloatTile, rank: usize) -> Vec<f64> {
    let mut moment = vec![0.0f64; rank * rank];
    let mut values = vec![0.0f64; rank];
    for pixel in tile.coefficients.chunks_exact(rank.max(1)) {
        for channel in 0..CHANNELS {
            for (value, c) in values.iter_mut().zip(pixel) {
                *value = match c[channel].is_finite() {
                    true => f64::from(c[channel]),
                    false => 0.0,
                };
            }
            for (i, row) in moment.chunks_exact_mut(rank).enumerate() {
                for (sum, value) in row[i..].iter_mut().zip(&values[i..]) {
                    *sum += values[i] * value;
                }
            }
        }
    }
    mirror_upper(&mut moment, rank);
    moment
}

/// An orthogonal `[n, n]` matrix whose first column points along `sums` and whose others are principal axes
/// of the rest, and the moment along each column.
fn flat_first(moment: &[f64], sums: &[f64], n: usize) -> (Vec<f64>, Vec<f64>) {
    let length = sums.iter().map(|s| s * s).sum::<f64>().sqrt();
    if length < 1e-6 {
        // The span has no function that responds to a flat light.
        let (energies, rows) = symmetric_eigen(moment.to_vec(), n);
        return (transpose(&rows, n), energies);
    }
    // The Householder reflection of the first axis to `sums` maps the others to a basis of the rest.
    let mut normal: Vec<f64> = sums.iter().map(|s| s / length).collect();
    normal[0] -= 1.0;
    let square: f64 = normal.iter().map(|x| x * x).sum();
    let factor = if square > 1e-24 { 2.0 / square } else { 0.0 };
    let reflection: Vec<f64> = (0..n * n)
        .map(|i| f64::from(u8::from(i / n == i % n)) - factor * normal[i / n] * normal[i % n])
        .collect();
    let reflected = congruence(moment, &reflection, n, n);
    let rest = n - 1;
    let block = (0..rest * rest).map(|i| reflected[(i / rest + 1) * n + i % rest + 1]);
    let (values, rows) = symmetric_eigen(block.collect(), rest);
    let mut inner = vec![0.0; n * n];
    inner[0] = 1.0;
    for j in 0..rest {
        for i in 0..rest {
            inner[(i + 1) * n + j + 1] = rows[j * rest + i];
        }
    }
    let energies = [&reflected[..1], &values].concat();
    (multiply(&reflection, &inner, n, n), energies)
}

/// `bᵀ a b` of a symmetric `[n, n]` and an `[n, m]` matrix.
fn congruence(a: &[f64], b: &[f64], n: usize, m: usize) -> Vec<f64> {
    multiply(&transpose(b, m), &multiply(a, b, n, m), n, m)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::transport::{Extent, TileRect};

    /// A basis that is neither orthogonal nor normal, one of its functions a sum of two others.
    fn basis() -> Basis {
        let wave = |k: usize| -> Vec<f32> {
            (0..49)
                .map(|s| ((s * (k + 1)) as f32 * 0.23).sin() + 0.2 * k as f32)
                .collect()
        };
        let mut kernels: Vec<Vec<f32>> = (0..4).map(wave).collect();
        kernels.push(
            kernels[0]
                .iter()
                .zip(&kernels[2])
                .map(|(a, b)| a + b)
                .collect(),
        );
        Basis { kernels }
    }

    fn tile() -> FloatTile {
        let extent = Extent::new(6, 5);
        let coefficient = |i: usize| [0.3, 1.0, -0.5].map(|c: f32| c * (i as f32 * 0.7).cos());
        FloatTile {
            coefficients: (0..30 * 5).map(coefficient).collect(),
            ..FloatTile::dark(TileRect { x: 0, y: 0, extent })
        }
    }

    #[test]
    fn the_rotated_basis_is_orthonormal_flat_first_and_gives_the_same_functions() {
        let (basis, tile) = (basis(), tile());
        let rotation = BasisRotation::new(&basis, &coefficient_moments(&tile, 5)).unwrap();
        assert_eq!(rotation.rank(), 4);
        let rotated = rotation.coefficients(&tile);
        for p in 0..30 {
            for s in 0..49 {
                for c in 0..CHANNELS {
                    let sum = |coefficients: &[[f32; CHANNELS]], functions: &[Vec<f32>]| -> f32 {
                        let terms = coefficients.iter().zip(functions);
                        terms.map(|(a, v)| a[c] * v[s]).sum()
                    };
                    let want = sum(&tile.coefficients[p * 5..][..5], &basis.kernels);
                    let got = sum(&rotated[p * 4..][..4], &rotation.basis.kernels);
                    assert!((got - want).abs() < 1e-4, "{got} {want}");
                }
            }
        }
        for (j, a) in rotation.basis.kernels.iter().enumerate() {
            for (i, b) in rotation.basis.kernels.iter().enumerate() {
                let dot: f32 = a.iter().zip(b).map(|(a, b)| a * b).sum();
                assert!((dot - f32::from(u8::from(i == j))).abs() < 1e-5);
            }
            let sum: f32 = a.iter().sum();
            assert_eq!(sum > 0.01, j == 0, "function {j} sums to {sum}");
            let energy: f32 = rotated
                .iter()
                .skip(j)
                .step_by(4)
                .flatten()
                .map(|c| c * c)
                .sum();
            let error = f64::from(energy) - rotation.energies[j];
            assert!(
                error.abs() < 1e-4 * rotation.energies[1],
                "{energy} {:?}",
                rotation.energies
            );
        }
        assert!(
            rotation.energies[1] > rotation.energies[2]
                && rotation.energies[2] > rotation.energies[3]
        );
    }

    #[test]
    fn truncation_drops_the_last_components() {
        let (basis, tile) = (basis(), tile());
        let whole = BasisRotation::new(&basis, &coefficient_moments(&tile, 5)).unwrap();
        let mut truncated = whole.clone();
        truncated.truncate(2);
        let (all, first) = (whole.coefficients(&tile), truncated.coefficients(&tile));
        for (all, first) in all.chunks_exact(4).zip(first.chunks_exact(2)) {
            assert_eq!(all[..2], *first);
        }
    }
}
