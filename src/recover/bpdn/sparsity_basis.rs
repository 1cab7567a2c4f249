//! The orthonormal bases φ in which light transport functions may be sparse (paper, section 3, case (b)).

/// φ, in which a light transport function has few large coefficients. The command line shows the variants' descriptions.
#[derive(Clone, Copy, Debug, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
#[cfg_attr(
    all(feature = "cli", not(target_arch = "wasm32")),
    derive(clap::ValueEnum)
)]
#[serde(rename_all = "lowercase")]
pub enum SparsityBasis {
    /// The light elements themselves, for opaque objects
    Identity,
    /// Discrete cosine transform, for translucent objects
    Dct,
    /// Haar wavelets
    Haar,
}

impl SparsityBasis {
    /// The name in options and reports.
    pub fn name(self) -> &'static str {
        match self {
            Self::Identity => "identity",
            Self::Dct => "dct",
            Self::Haar => "haar",
        }
    }

    /// B, the basis along one axis, `[side, side]`, a basis vector in each row, the constant one first. The
    /// basis of a window is B ⊗ B: the coefficients of τ, as a square matrix, are B τ Bᵀ.
    ///
    /// Window sides are odd, so that Haar's intervals cannot be halved. The unbalanced Haar transform
    /// (Girardi & Sweldens 1997) is orthonormal for every length: it splits intervals as evenly as possible,
    /// and each wavelet is constant on either part, of mean zero and norm one.
    pub fn along_axis(self, side: usize) -> Vec<f64> {
        let mut basis = vec![0.0; side * side];
        match self {
            Self::Identity => (0..side).for_each(|i| basis[i * side + i] = 1.0),
            Self::Dct => {
                for (i, row) in basis.chunks_exact_mut(side).enumerate() {
                    let norm = (if i == 0 { 1.0 } else { 2.0 } / side as f64).sqrt();
                    for (j, b) in row.iter_mut().enumerate() {
                        *b = norm * crate::linalg::cos_pi(i * (2 * j + 1), 2 * side);
                    }
                }
            }
            Self::Haar => {
                let mut rows = basis.chunks_exact_mut(side);
                if let Some(constant) = rows.next() {
                    constant.fill(1.0 / (side as f64).sqrt());
                }
                // Intervals to split, by descending length.
                let mut intervals = std::collections::VecDeque::from([(0, side)]);
                while let Some((start, end)) = intervals.pop_front() {
                    if end - start < 2 {
                        continue;
                    }
                    let middle = start + (end - start).div_ceil(2);
                    let (a, b) = ((middle - start) as f64, (end - middle) as f64);
                    if let Some(row) = rows.next() {
                        row[start..middle].fill((b / (a * (a + b))).sqrt());
                        row[middle..end].fill(-(a / (b * (a + b))).sqrt());
                    }
                    intervals.extend([(start, middle), (middle, end)]);
                }
            }
        }
        basis
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn bases_are_orthonormal_for_every_side() {
        for basis in [
            SparsityBasis::Identity,
            SparsityBasis::Dct,
            SparsityBasis::Haar,
        ] {
            for side in (1..=63).step_by(2) {
                let b = basis.along_axis(side);
                for i in 0..side {
                    for j in 0..side {
                        let product: f64 =
                            (0..side).map(|s| b[i * side + s] * b[j * side + s]).sum();
                        let expected = if i == j { 1.0 } else { 0.0 };
                        assert!(
                            (product - expected).abs() < 1e-12,
                            "{basis:?} {side} {i} {j}"
                        );
                    }
                }
            }
        }
    }

    #[test]
    fn haar_of_three_elements() {
        let b = SparsityBasis::Haar.along_axis(3);
        let close = |row: usize, expected: [f64; 3]| {
            for (b, e) in b[row * 3..].iter().zip(expected) {
                assert!((b - e).abs() < 1e-12);
            }
        };
        close(0, [1.0 / 3f64.sqrt(); 3]);
        close(
            1,
            [1.0 / 6f64.sqrt(), 1.0 / 6f64.sqrt(), -2.0 / 6f64.sqrt()],
        );
        close(2, [0.5f64.sqrt(), -(0.5f64.sqrt()), 0.0]);
    }
}
