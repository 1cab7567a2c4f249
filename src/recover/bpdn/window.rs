//! One window's equations, and the basis in which its functions are sparse.

use super::SparsityBasis;
use crate::linalg::{self, add_scaled, dot};

/// `Ax` and `φᵀx` for functions x on the unknowns of a window.
#[derive(Debug)]
pub(super) struct Window {
    side: usize,
    rows: usize,
    /// The unknowns' places in the window, `[k]`.
    slots: Vec<usize>,
    /// `Aᵀ`, `[k, rows]`.
    columns: Vec<f64>,
    /// φᵀ along one axis, and φ.
    analysis: Vec<f64>,
    synthesis: Vec<f64>,
    /// Products `b_i b_j` of a basis vector's entries, `[pairs, side]`, its transpose, and which
    /// pair i and j are, in either order, `[side, side]`.
    products: Vec<f64>,
    transposed: Vec<f64>,
    pair: Vec<usize>,
}

impl Window {
    pub fn new(
        basis: SparsityBasis,
        columns: &[f64],
        rows: usize,
        slots: &[usize],
        side: usize,
    ) -> Self {
        let analysis = basis.along_axis(side);
        let mut products = Vec::with_capacity(side * side * (side + 1) / 2);
        let mut pair = vec![0; side * side];
        for i in 0..side {
            for j in i..side {
                let number = products.len() / side;
                (pair[i * side + j], pair[j * side + i]) = (number, number);
                products.extend((0..side).map(|p| analysis[p * side + i] * analysis[p * side + j]));
            }
        }
        Self {
            side,
            rows,
            slots: slots.to_vec(),
            columns: columns.to_vec(),
            synthesis: linalg::transpose(&analysis, side),
            analysis,
            transposed: linalg::transpose(&products, side),
            products,
            pair,
        }
    }

    pub fn side(&self) -> usize {
        self.side
    }

    /// How many unknowns there are.
    pub fn unknowns(&self) -> usize {
        self.slots.len()
    }

    /// `‖φᵀx‖₁`.
    #[inline(always)]
    pub fn objective(&self, x: &[f64]) -> f64 {
        self.coefficients(x).iter().map(|c| c.abs()).sum()
    }

    /// `φᵀx`, `[side²]`.
    #[inline(always)]
    pub fn coefficients(&self, x: &[f64]) -> Vec<f64> {
        let mut window = vec![0.0; self.side * self.side];
        for (&slot, &x) in self.slots.iter().zip(x) {
            window[slot] = x;
        }
        self.transform(&self.analysis, &window)
    }

    /// φs on the unknowns, `[k]`.
    #[inline(always)]
    pub fn synthesize(&self, s: &[f64]) -> Vec<f64> {
        let window = self.transform(&self.synthesis, s);
        self.slots.iter().map(|&slot| window[slot]).collect()
    }

    /// `M input Mᵀ` with `M` along one axis.
    #[inline(always)]
    fn transform(&self, along: &[f64], input: &[f64]) -> Vec<f64> {
        let side = self.side;
        let half = linalg::multiply(along, input, side, side);
        let rows = half.chunks_exact(side);
        rows.flat_map(|row| along.chunks_exact(side).map(move |b| dot(row, b)))
            .collect()
    }

    /// `y − Ax`, `[rows]`.
    #[inline(always)]
    pub fn difference(&self, x: &[f64], y: &[f64]) -> Vec<f64> {
        let mut difference = y.to_vec();
        for (column, &x) in self.columns().zip(x) {
            if x != 0.0 {
                add_scaled(&mut difference, -x, column);
            }
        }
        difference
    }

    /// `Aᵀr`, `[k]`.
    #[inline(always)]
    pub fn correlate(&self, r: &[f64]) -> Vec<f64> {
        self.columns().map(|column| dot(column, r)).collect()
    }

    /// The upper triangle of `AᵀA`, `[k, k]`.
    #[inline(always)]
    pub fn gram(&self) -> Vec<f64> {
        let k = self.unknowns();
        let mut gram = vec![0.0; k * k];
        for (i, (row, a)) in gram
            .chunks_exact_mut(k.max(1))
            .zip(self.columns())
            .enumerate()
        {
            for (g, b) in row[i..].iter_mut().zip(self.columns().skip(i)) {
                *g = dot(a, b);
            }
        }
        gram
    }

    /// The upper triangle of `φ diag(d) φᵀ` between the unknowns, `[k, k]`.
    #[inline(always)]
    pub fn sandwich(&self, d: &[f64]) -> Vec<f64> {
        let (side, k) = (self.side, self.unknowns());
        let pairs = self.products.len() / side;
        // Along one axis for each coefficient of the other, then along that one.
        let along = linalg::multiply(d, &self.transposed, side, pairs);
        let both = linalg::multiply(&self.products, &along, side, pairs);
        let mut out = vec![0.0; k * k];
        for (i, row) in out.chunks_exact_mut(k.max(1)).enumerate() {
            let (v, u) = (self.slots[i] / side, self.slots[i] % side);
            let (across, down) = (&self.pair[u * side..], &self.pair[v * side..]);
            for (out, &slot) in row[i..].iter_mut().zip(&self.slots[i..]) {
                *out = both[down[slot / side] * pairs + across[slot % side]];
            }
        }
        out
    }

    /// A's columns, one for each unknown.
    fn columns(&self) -> impl Iterator<Item = &[f64]> {
        self.columns.chunks_exact(self.rows.max(1))
    }
}
