//! Random least-squares problems, and what may be asked of an answer to one.

/// `A`, `[rows, k]`, and several measurements `y`, `[rows]`.
pub(super) struct Problem {
    pub k: usize,
    pub matrix: Vec<f64>,
    pub measurements: Vec<Vec<f64>>,
}

impl Problem {
    /// Entries of A uniform around `offset`, of y around half of it.
    pub fn random(k: usize, rows: usize, seed: u64, offset: f64) -> Self {
        let mut state = seed | 1;
        let mut next = || {
            state = state
                .wrapping_mul(6_364_136_223_846_793_005)
                .wrapping_add(1_442_695_040_888_963_407);
            (state >> 11) as f64 / (1u64 << 53) as f64 - 0.5
        };
        Self {
            k,
            matrix: (0..rows * k).map(|_| next() + offset).collect(),
            measurements: (0..4)
                .map(|_| (0..rows).map(|_| next() + 0.5 * offset).collect())
                .collect(),
        }
    }

    fn rows(&self) -> impl Iterator<Item = &[f64]> {
        self.matrix.chunks_exact(self.k)
    }

    /// `AᵀA`.
    pub fn gram(&self) -> Vec<f64> {
        let k = self.k;
        let entry = |ij: usize| self.rows().map(|r| r[ij / k] * r[ij % k]).sum();
        (0..k * k).map(entry).collect()
    }

    /// `Aᵀy`.
    pub fn right_hand_side(&self, y: &[f64]) -> Vec<f64> {
        let entry = |j: usize| self.rows().zip(y).map(|(r, y)| r[j] * y).sum();
        (0..self.k).map(entry).collect()
    }

    /// `‖y‖²`.
    pub fn energy(y: &[f64]) -> f64 {
        y.iter().map(|y| y * y).sum()
    }

    fn differences(&self, x: &[f64], y: &[f64]) -> Vec<f64> {
        let seen = |r: &[f64]| r.iter().zip(x).map(|(a, x)| a * x).sum::<f64>();
        self.rows().zip(y).map(|(r, y)| y - seen(r)).collect()
    }

    /// `‖y − Ax‖`.
    pub fn residual(&self, x: &[f64], y: &[f64]) -> f64 {
        Self::energy(&self.differences(x, y)).sqrt()
    }

    /// `Aᵀ(y − Ax)`.
    pub fn correlation(&self, x: &[f64], y: &[f64]) -> Vec<f64> {
        self.right_hand_side(&self.differences(x, y))
    }
}
