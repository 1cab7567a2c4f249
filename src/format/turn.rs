//! The basis of a file: another one of the same span, in the order in which a reader wants it.

use crate::linalg::symmetric_eigen;
use crate::transport::{BandTile, Basis, CHANNELS};

/// Share of the largest direction's below which a direction of the span is none.
const LEAST: f64 = 1e-9;

/// An orthonormal basis, and how coefficients are turned to it.
///
/// Its first function is the constant one's image in the span: under a flat light the first component
/// is the whole picture and no other has any part in it, so that errors of the others, of which there
/// are many, do not show where eyes are best. The others are principal, the strongest first.
#[derive(Clone, Debug)]
pub struct Turn {
    /// `[rank, element]`.
    pub functions: Vec<Vec<f32>>,
    /// Squared coefficients of each component.
    pub energies: Vec<f64>,
    /// `[given, rank]`.
    rotation: Vec<f64>,
    given: usize,
}

impl Turn {
    /// From a basis, and the sums of products of coefficients over it, `[rank, rank]`.
    pub fn new(basis: &Basis, moment: &[f64]) -> Self {
        let given = basis.rank();
        let area = basis.kernels.first().map_or(0, Vec::len);
        let dot = |a: &[f32], b: &[f32]| -> f64 {
            a.iter()
                .zip(b)
                .map(|(a, b)| f64::from(*a) * f64::from(*b))
                .sum()
        };
        let gram = (0..given * given)
            .map(|i| dot(&basis.kernels[i / given], &basis.kernels[i % given]))
            .collect();
        let (values, vectors) = symmetric_eigen(gram, given);
        let rank = values
            .iter()
            .take_while(|v| **v > LEAST * values[0])
            .count();
        // From coefficients as given to those over orthonormal functions.
        let mut to_orthonormal = vec![0.0; given * rank];
        let mut orthonormal = vec![vec![0.0f64; area]; rank];
        for i in 0..rank {
            let length = values[i].sqrt();
            for k in 0..given {
                let share = vectors[i * given + k];
                to_orthonormal[k * rank + i] = share * length;
                for (q, v) in orthonormal[i].iter_mut().zip(&basis.kernels[k]) {
                    *q += share / length * f64::from(*v);
                }
            }
        }
        let moment = congruent(moment, &to_orthonormal, given, rank);
        let sums: Vec<f64> = orthonormal.iter().map(|q| q.iter().sum()).collect();
        let (turned, energies) = flat_first(&moment, &sums, rank);
        let functions = (0..rank)
            .map(|j| {
                let element = |s: usize| -> f64 {
                    (0..rank)
                        .map(|i| turned[i * rank + j] * orthonormal[i][s])
                        .sum()
                };
                (0..area).map(|s| element(s) as f32).collect()
            })
            .collect();
        Self {
            functions,
            energies,
            rotation: multiply(&to_orthonormal, &turned, rank, rank),
            given,
        }
    }

    /// Number of functions.
    pub fn rank(&self) -> usize {
        self.functions.len()
    }

    /// Squared coefficients of all components.
    pub fn energy(&self) -> f64 {
        self.energies.iter().sum()
    }

    /// How many times larger than the largest coefficient given one over this basis can be.
    pub fn gain(&self) -> f32 {
        let of_component = |j: usize| -> f64 {
            let rows = self.rotation.chunks_exact(self.rank());
            rows.map(|row| row[j].abs()).sum()
        };
        (0..self.rank()).map(of_component).fold(0.0, f64::max) as f32
    }

    /// Leaves out all components past the first `rank`.
    pub fn cut(&mut self, rank: usize) {
        let old = self.rank();
        self.functions.truncate(rank);
        self.energies.truncate(rank);
        let rows = self.rotation.chunks_exact(old);
        self.rotation = rows.flat_map(|row| &row[..rank]).copied().collect();
    }

    /// A tile's coefficients over this basis as `[pixel, component]`; none if it has none.
    pub fn coefficients(&self, tile: &BandTile) -> Vec<[f32; CHANNELS]> {
        let rank = self.rank();
        if tile.coefficients.is_empty() {
            return Vec::new();
        }
        let mut turned = vec![[0.0f32; CHANNELS]; tile.rect.extent.area() * rank];
        let rotation: Vec<f32> = self.rotation.iter().map(|r| *r as f32).collect();
        let pixels = tile.coefficients.chunks_exact(self.given);
        for (given, turned) in pixels.zip(turned.chunks_exact_mut(rank)) {
            for (c, row) in given.iter().zip(rotation.chunks_exact(rank)) {
                for (turned, share) in turned.iter_mut().zip(row) {
                    for channel in 0..CHANNELS {
                        turned[channel] += c[channel] * share;
                    }
                }
            }
        }
        turned
    }
}

/// Sums of products of a tile's coefficients, `[rank, rank]`. Those that are no numbers count for none.
pub fn moment(tile: &BandTile, rank: usize) -> Vec<f64> {
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
    for i in 0..rank {
        for j in 0..i {
            moment[i * rank + j] = moment[j * rank + i];
        }
    }
    moment
}

/// An orthogonal `[n, n]` matrix whose first column points along `sums`, the others being principal,
/// and the moment along each column.
fn flat_first(moment: &[f64], sums: &[f64], n: usize) -> (Vec<f64>, Vec<f64>) {
    let length = sums.iter().map(|s| s * s).sum::<f64>().sqrt();
    if length < 1e-6 {
        // No part of the span is flat.
        let (energies, rows) = symmetric_eigen(moment.to_vec(), n);
        return (transpose(&rows, n), energies);
    }
    // The reflection that takes the first axis there takes the others to a basis of the rest.
    let mut normal: Vec<f64> = sums.iter().map(|s| s / length).collect();
    normal[0] -= 1.0;
    let square: f64 = normal.iter().map(|x| x * x).sum();
    let factor = if square > 1e-24 { 2.0 / square } else { 0.0 };
    let mirror: Vec<f64> = (0..n * n)
        .map(|i| f64::from(u8::from(i / n == i % n)) - factor * normal[i / n] * normal[i % n])
        .collect();
    let mirrored = congruent(moment, &mirror, n, n);
    let rest = n - 1;
    let block = (0..rest * rest).map(|i| mirrored[(i / rest + 1) * n + i % rest + 1]);
    let (values, rows) = symmetric_eigen(block.collect(), rest);
    let mut inner = vec![0.0; n * n];
    inner[0] = 1.0;
    for j in 0..rest {
        for i in 0..rest {
            inner[(i + 1) * n + j + 1] = rows[j * rest + i];
        }
    }
    let energies = [&mirrored[..1], &values].concat();
    (multiply(&mirror, &inner, n, n), energies)
}

/// `bᵀ a b` of a symmetric `[n, n]` and an `[n, m]` matrix.
fn congruent(a: &[f64], b: &[f64], n: usize, m: usize) -> Vec<f64> {
    let ab = multiply(a, b, n, m);
    let mut product = vec![0.0; m * m];
    for k in 0..n {
        for i in 0..m {
            for j in 0..m {
                product[i * m + j] += b[k * m + i] * ab[k * m + j];
            }
        }
    }
    product
}

/// `a b` of an `[_, inner]` and an `[inner, columns]` matrix.
fn multiply(a: &[f64], b: &[f64], inner: usize, columns: usize) -> Vec<f64> {
    let mut product = Vec::with_capacity(a.len() / inner.max(1) * columns);
    for row in a.chunks_exact(inner.max(1)) {
        for j in 0..columns {
            product.push((0..inner).map(|k| row[k] * b[k * columns + j]).sum());
        }
    }
    product
}

fn transpose(a: &[f64], n: usize) -> Vec<f64> {
    (0..n * n).map(|i| a[i % n * n + i / n]).collect()
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

    fn tile() -> BandTile {
        let extent = Extent {
            width: 6,
            height: 5,
        };
        let coefficient = |i: usize| [0.3, 1.0, -0.5].map(|c: f32| c * (i as f32 * 0.7).cos());
        BandTile {
            coefficients: (0..30 * 5).map(coefficient).collect(),
            ..BandTile::dark(TileRect { x: 0, y: 0, extent })
        }
    }

    #[test]
    fn the_same_functions_over_an_orthonormal_basis_the_flat_one_first() {
        let (basis, tile) = (basis(), tile());
        let turn = Turn::new(&basis, &moment(&tile, 5));
        assert_eq!(turn.rank(), 4);
        let turned = turn.coefficients(&tile);
        for p in 0..30 {
            for s in 0..49 {
                for c in 0..CHANNELS {
                    let sum = |coefficients: &[[f32; CHANNELS]], functions: &[Vec<f32>]| -> f32 {
                        let terms = coefficients.iter().zip(functions);
                        terms.map(|(a, v)| a[c] * v[s]).sum()
                    };
                    let want = sum(&tile.coefficients[p * 5..][..5], &basis.kernels);
                    let got = sum(&turned[p * 4..][..4], &turn.functions);
                    assert!((got - want).abs() < 1e-4, "{got} {want}");
                }
            }
        }
        for (j, a) in turn.functions.iter().enumerate() {
            for (i, b) in turn.functions.iter().enumerate() {
                let dot: f32 = a.iter().zip(b).map(|(a, b)| a * b).sum();
                assert!((dot - f32::from(u8::from(i == j))).abs() < 1e-5);
            }
            let sum: f32 = a.iter().sum();
            assert_eq!(sum > 0.01, j == 0, "function {j} sums to {sum}");
            let energy: f32 = turned
                .iter()
                .skip(j)
                .step_by(4)
                .flatten()
                .map(|c| c * c)
                .sum();
            let off = f64::from(energy) - turn.energies[j];
            assert!(
                off.abs() < 1e-4 * turn.energies[1],
                "{energy} {:?}",
                turn.energies
            );
        }
        assert!(turn.energies[1] > turn.energies[2] && turn.energies[2] > turn.energies[3]);
    }

    #[test]
    fn what_is_cut_is_the_end() {
        let (basis, tile) = (basis(), tile());
        let whole = Turn::new(&basis, &moment(&tile, 5));
        let mut cut = whole.clone();
        cut.cut(2);
        let (all, some) = (whole.coefficients(&tile), cut.coefficients(&tile));
        for (all, some) in all.chunks_exact(4).zip(some.chunks_exact(2)) {
            assert_eq!(all[..2], *some);
        }
    }
}
