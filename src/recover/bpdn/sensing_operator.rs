//! The linear maps of one window's problem: Ax and φᵀx, their adjoints and Gram matrices.
//!
//! A, `[L, k]`, maps the unknowns, which are the window's elements inside the light plane, to measurements. φᵀ,
//! `[side², k]`, maps them to coefficients in the sparsity basis. φ is separable, `B ⊗ B` with B, `[side, side]`, along
//! one axis, so that a product costs O(side³) instead of O(side⁴).

use super::sparsity_basis::SparsityBasis;
use crate::linalg::{self, dot};
use crate::recover::gram_cache::WindowEquations;

/// A and φ of one window.
pub(in crate::recover) struct SensingOperator<'a> {
    /// A by its columns, its Gram matrix, and the slots of the unknowns.
    pub equations: &'a WindowEquations,
    pub side: usize,
    /// φᵀ along one axis, and φ.
    analysis: Vec<f64>,
    synthesis: Vec<f64>,
    /// For each pair i ≤ j of positions along an axis, the products `b_i b_j` of each basis vector's entries,
    /// `[pairs, side]`; its transpose; and the index of the pair (i, j) in either order, `[side, side]`.
    products: Vec<f64>,
    transposed_products: Vec<f64>,
    pair_indices: Vec<usize>,
}

impl<'a> SensingOperator<'a> {
    /// The operator of the equations of a window of `side²`.
    pub fn new(basis: SparsityBasis, equations: &'a WindowEquations, side: usize) -> Self {
        let analysis = basis.along_axis(side);
        let mut products = Vec::with_capacity(side * side * (side + 1) / 2);
        let mut pair_indices = vec![0; side * side];
        for i in 0..side {
            for j in i..side {
                let index = products.len() / side;
                (pair_indices[i * side + j], pair_indices[j * side + i]) = (index, index);
                products.extend((0..side).map(|p| analysis[p * side + i] * analysis[p * side + j]));
            }
        }
        Self {
            equations,
            side,
            synthesis: linalg::transpose(&analysis, side),
            analysis,
            transposed_products: linalg::transpose(&products, side),
            products,
            pair_indices,
        }
    }

    pub fn unknowns(&self) -> usize {
        self.equations.slots.len()
    }

    /// `‖φᵀx‖₁`.
    #[cfg_attr(target_arch = "x86_64", inline(always))]
    pub fn objective(&self, x: &[f64]) -> f64 {
        self.coefficients(x).iter().map(|c| c.abs()).sum()
    }

    /// `φᵀx`, `[side²]`.
    #[cfg_attr(target_arch = "x86_64", inline(always))]
    pub fn coefficients(&self, x: &[f64]) -> Vec<f64> {
        let mut window = vec![0.0; self.side * self.side];
        for (&slot, &x) in self.equations.slots.iter().zip(x) {
            window[slot] = x;
        }
        self.transform(&self.analysis, &window)
    }

    /// φs, `[k]`.
    #[cfg_attr(target_arch = "x86_64", inline(always))]
    pub fn synthesize(&self, s: &[f64]) -> Vec<f64> {
        let window = self.transform(&self.synthesis, s);
        let slots = self.equations.slots.iter();
        slots.map(|&slot| window[slot]).collect()
    }

    /// `M X Mᵀ` for a matrix M along one axis and X = `input`, all `[side, side]`.
    #[cfg_attr(target_arch = "x86_64", inline(always))]
    fn transform(&self, matrix: &[f64], input: &[f64]) -> Vec<f64> {
        let side = self.side;
        let half = linalg::multiply(matrix, input, side, side);
        let rows = half.chunks_exact(side);
        rows.flat_map(|row| matrix.chunks_exact(side).map(move |b| dot(row, b)))
            .collect()
    }

    /// `y − Ax`, `[L]`.
    #[cfg_attr(target_arch = "x86_64", inline(always))]
    pub fn residual(&self, x: &[f64], y: &[f64]) -> Vec<f64> {
        self.equations.columns.residual(y, x)
    }

    /// `Aᵀr`, `[k]`.
    #[cfg_attr(target_arch = "x86_64", inline(always))]
    pub fn correlate(&self, r: &[f64]) -> Vec<f64> {
        self.equations.columns.right_hand_side(r).collect()
    }

    /// The upper triangle of `φ diag(d) φᵀ` on the unknowns, `[k, k]`.
    #[cfg_attr(target_arch = "x86_64", inline(always))]
    pub fn weighted_gram(&self, d: &[f64]) -> Vec<f64> {
        let (side, k, slots) = (self.side, self.unknowns(), &self.equations.slots);
        let pairs = self.products.len() / side;
        // Σ over one axis for each coefficient of the other, then over the other.
        let one_axis = linalg::multiply(d, &self.transposed_products, side, pairs);
        let both_axes = linalg::multiply(&self.products, &one_axis, side, pairs);
        let mut out = vec![0.0; k * k];
        for (i, row) in out.chunks_exact_mut(k.max(1)).enumerate() {
            let [pairs_v, pairs_u] =
                [slots[i] / side, slots[i] % side].map(|at| &self.pair_indices[at * side..]);
            for (out, &slot) in row[i..].iter_mut().zip(&slots[i..]) {
                *out = both_axes[pairs_v[slot / side] * pairs + pairs_u[slot % side]];
            }
        }
        out
    }
}
