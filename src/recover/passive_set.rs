//! The passive set of an active-set solver: the unknowns that are free to vary (Lawson and Hanson 1974).
//!
//! For a passive set P of n unknowns, the set keeps the inverse `H = G[P, P]⁻¹` of a part of the Gram matrix and the
//! solutions `H b[P]` of N right-hand sides, and updates all of them by rank-one terms, at n² products, when an unknown
//! is inserted or removed. No step has to wait for the one before, unlike substitution through a triangular factor;
//! [`PassiveSet::refine`] removes the rounding errors that the updates leave.
//!
//! Sets are small and of every size. A loop that ended with the set would spend most of its time on the remainder after
//! the last full vector register, so all vectors are padded with zeros to a multiple of [`LANES`].

use crate::linalg::{
    LANES, add_outer_block, add_scaled, add_scaled_rows, combine_blocks, dot, padded_len,
};

/// The values of one vector register, or of a few.
type RegisterBlock = [f64; LANES];

/// Smallest pivot, relative to its diagonal entry, of an unknown whose column is linearly independent of the passive
/// ones, to the precision of the Gram matrix. Another unknown would not lower the residual.
pub(super) const MIN_PIVOT_RATIO: f64 = 1e-9;
/// Members that a new set has memory for. Sets rarely grow beyond the number of patterns.
const INITIAL_CAPACITY: usize = 96;
/// Rows of the inverse that one pass multiplies.
const ROWS_PER_PASS: usize = 4;

/// A passive set with the inverse of its Gram matrix and the solutions of `N` right-hand sides.
#[derive(Debug)]
pub(super) struct PassiveSet<'a, const N: usize> {
    /// `G`, `[k, k]`, symmetric.
    gram: &'a [f64],
    /// The unknowns in the set, in the order of all vectors over it.
    members: Vec<usize>,
    /// `[k]`.
    is_member: Vec<bool>,
    /// `H`, `[stride, stride]`, zero beyond the members' rows and columns, in panels of [`LANES`] columns: the part of
    /// a vector that belongs to a panel stays in registers.
    inverse: Vec<RegisterBlock>,
    /// Length of the vectors below, a multiple of [`LANES`]. They are zero beyond the members.
    stride: usize,
    solutions: [Vec<f64>; N],
    /// A vector over the set, and its product with H.
    column: Vec<f64>,
    product: Vec<f64>,
}

impl<'a, const N: usize> PassiveSet<'a, N> {
    /// An empty set of the unknowns of `gram`, `[k, k]`.
    ///
    /// # Panics
    /// If `gram` does not have `k²` entries.
    pub fn new(gram: &'a [f64], k: usize) -> Self {
        // Not `assert_eq`, whose formatting code modules would have to carry.
        assert!(gram.len() == k * k, "the Gram matrix is square");
        let stride = padded_len(k.min(INITIAL_CAPACITY));
        Self {
            gram,
            members: Vec::with_capacity(stride),
            is_member: vec![false; k],
            inverse: vec![[0.0; LANES]; stride * stride / LANES],
            stride,
            solutions: std::array::from_fn(|_| vec![0.0; stride]),
            column: vec![0.0; stride],
            product: vec![0.0; stride],
        }
    }

    #[cfg_attr(target_arch = "x86_64", inline(always))]
    pub fn members(&self) -> &[usize] {
        &self.members
    }

    #[cfg_attr(target_arch = "x86_64", inline(always))]
    pub fn contains(&self, j: usize) -> bool {
        self.is_member[j]
    }

    /// An unknown's row of the Gram matrix.
    #[cfg_attr(target_arch = "x86_64", inline(always))]
    fn row(&self, j: usize) -> &'a [f64] {
        let k = self.is_member.len();
        &self.gram[j * k..(j + 1) * k]
    }

    /// Computes `y += Gx`, `[k]`, for the values `x` of the members.
    #[cfg_attr(target_arch = "x86_64", inline(always))]
    pub fn add_product(&self, y: &mut [f64], x: &[f64]) {
        add_scaled_rows(y, self.gram, &self.members, x);
    }

    /// Computes `y −= Gx`, `[k]`, for the values `x` of the members.
    #[cfg_attr(target_arch = "x86_64", inline(always))]
    pub fn subtract_product(&self, y: &mut [f64], x: &[f64]) {
        let negated: Vec<f64> = x.iter().map(|x| -x).collect();
        self.add_product(y, &negated);
    }

    /// Expands the values of the members to all unknowns, `[k]`, zero outside the set.
    pub fn scatter(&self, values: &[f64]) -> Vec<f64> {
        let mut all = vec![0.0; self.is_member.len()];
        for (&j, &value) in self.members.iter().zip(values) {
            all[j] = value;
        }
        all
    }

    #[cfg_attr(target_arch = "x86_64", inline(always))]
    pub fn clear(&mut self) {
        let width = self.padded_len();
        for panel in panels(&mut self.inverse, self.stride, width) {
            panel.fill([0.0; LANES]);
        }
        for z in &mut self.solutions {
            z[..width].fill(0.0);
        }
        for j in self.members.drain(..) {
            self.is_member[j] = false;
        }
    }

    /// Padded length of vectors over the set.
    #[cfg_attr(target_arch = "x86_64", inline(always))]
    fn padded_len(&self) -> usize {
        padded_len(self.members.len())
    }

    /// The solution of `G[P, P] z = b[P]` for right-hand side `which`.
    #[cfg_attr(target_arch = "x86_64", inline(always))]
    pub fn solution(&self, which: usize) -> &[f64] {
        &self.solutions[which][..self.members.len()]
    }

    /// Replaces right-hand side `which` by `b`, `[k]`.
    #[cfg_attr(target_arch = "x86_64", inline(always))]
    pub fn set_rhs(&mut self, which: usize, b: &[f64]) {
        self.gather(b);
        self.multiply_by_inverse();
        let width = self.padded_len();
        self.solutions[which][..width].copy_from_slice(&self.product[..width]);
    }

    /// Corrects the solution z of right-hand side `which` by its residual `b − Gz`, `[k]`.
    #[cfg_attr(target_arch = "x86_64", inline(always))]
    pub fn refine(&mut self, which: usize, residual: &[f64]) {
        self.gather(residual);
        self.multiply_by_inverse();
        let width = self.padded_len();
        let solution = &mut self.solutions[which][..width];
        add_scaled(solution, 1.0, &self.product[..width]);
    }

    /// Sets `column = b[P]`.
    #[cfg_attr(target_arch = "x86_64", inline(always))]
    fn gather(&mut self, b: &[f64]) {
        let n = self.members.len();
        let width = self.padded_len();
        for (c, &j) in self.column.iter_mut().zip(&self.members) {
            *c = b[j];
        }
        self.column[n..width].fill(0.0);
    }

    /// Sets `product = H · column`.
    #[cfg_attr(target_arch = "x86_64", inline(always))]
    fn multiply_by_inverse(&mut self) {
        let width = self.padded_len();
        // H is symmetric: its rows are its columns, so the sums need no reduction across a register.
        let factors = self.column[..width].as_chunks::<ROWS_PER_PASS>().0;
        let product = self.product.as_chunks_mut::<LANES>().0;
        let inverse = self.inverse.chunks_exact(self.stride.max(1));
        for (p, panel) in product[..width / LANES].iter_mut().zip(inverse) {
            *p = combine_blocks(panel, factors);
        }
    }

    /// Evaluates unknown `j`, with its entries `b` of the right-hand sides, as a candidate for the set.
    #[cfg_attr(target_arch = "x86_64", inline(always))]
    pub fn evaluate(&mut self, j: usize, b: [f64; N]) -> EnteringUnknown<N> {
        let row = self.row(j);
        self.gather(row);
        let column = &self.column[..self.padded_len()];
        let mut residual = b;
        for (residual, z) in residual.iter_mut().zip(&self.solutions) {
            *residual -= dot(column, &z[..column.len()]);
        }
        EnteringUnknown {
            j,
            diagonal: row[j],
            residual,
        }
    }

    /// Inserts unknown `j`, with its entries `b` of the right-hand sides. Returns false if its column depends linearly
    /// on those of the set.
    #[cfg_attr(target_arch = "x86_64", inline(always))]
    pub fn evaluate_and_insert(&mut self, j: usize, b: [f64; N]) -> bool {
        let candidate = self.evaluate(j, b);
        self.insert(candidate)
    }

    /// Inserts the candidate that was evaluated last. Returns false if its column depends linearly on those of the set.
    #[cfg_attr(target_arch = "x86_64", inline(always))]
    pub fn insert(&mut self, candidate: EnteringUnknown<N>) -> bool {
        self.multiply_by_inverse();
        let (n, before) = (self.members.len(), self.padded_len());
        let explained = dot(&self.column[..before], &self.product[..before]);
        let pivot = candidate.diagonal - explained;
        if pivot.is_nan() || pivot <= MIN_PIVOT_RATIO * candidate.diagonal {
            return false;
        }
        if n == self.stride {
            self.grow();
        }
        let inverse = 1.0 / pivot;
        for (z, residual) in self.solutions.iter_mut().zip(candidate.residual) {
            let step = residual * inverse;
            add_scaled(&mut z[..before], -step, &self.product[..before]);
            z[n] = step;
        }
        // With −1 as the new member's entry, one outer product updates all of the inverse.
        self.members.push(candidate.j);
        self.is_member[candidate.j] = true;
        let width = self.padded_len();
        self.product[before..width].fill(0.0);
        self.product[n] = -1.0;
        self.add_outer_product(inverse);
        true
    }

    /// Computes `H += factor · product productᵀ`.
    #[cfg_attr(target_arch = "x86_64", inline(always))]
    fn add_outer_product(&mut self, factor: f64) {
        let width = self.padded_len();
        let product = &self.product[..width];
        let blocks = product.as_chunks::<LANES>().0;
        let factors = product.as_chunks::<ROWS_PER_PASS>().0;
        for (panel, block) in panels(&mut self.inverse, self.stride, width).zip(blocks) {
            add_outer_block(panel, factors, block.map(|v| v * factor));
        }
    }

    /// Removes the member at position `i`; the last member moves there.
    #[cfg_attr(target_arch = "x86_64", inline(always))]
    pub fn remove(&mut self, i: usize) {
        let (last, width) = (self.members.len() - 1, self.padded_len());
        // The column of H that is removed.
        let (panel, lane) = (i / LANES * self.stride, i % LANES);
        for (p, row) in self.product[..width].iter_mut().zip(&self.inverse[panel..]) {
            *p = row[lane];
        }
        let inverse = 1.0 / self.product[i];
        for z in &mut self.solutions {
            let step = z[i] * inverse;
            add_scaled(&mut z[..width], -step, &self.product[..width]);
            z[i] = z[last];
            z[last] = 0.0;
        }
        self.add_outer_product(-inverse);
        self.move_last_to(i);
        self.is_member[self.members.swap_remove(i)] = false;
    }

    /// Moves the last row and column of H to position `i`, and fills them with zeros.
    #[cfg_attr(target_arch = "x86_64", inline(always))]
    fn move_last_to(&mut self, i: usize) {
        let (last, width, stride) = (self.members.len() - 1, self.padded_len(), self.stride);
        for panel in panels(&mut self.inverse, stride, width) {
            panel[i] = panel[last];
            panel[last] = [0.0; LANES];
        }
        let (from, to) = (last / LANES * stride, i / LANES * stride);
        for row in 0..width {
            let moved = std::mem::take(&mut self.inverse[from + row][last % LANES]);
            if i < last {
                self.inverse[to + row][i % LANES] = moved;
            }
        }
    }

    /// Doubles the number of members that the set has memory for.
    #[cold]
    fn grow(&mut self) {
        let old = self.stride;
        let new = padded_len((2 * old).min(self.is_member.len()));
        let mut inverse = vec![[0.0; LANES]; new * new / LANES];
        let panels = inverse.chunks_exact_mut(new);
        for (to, from) in panels.zip(self.inverse.chunks_exact(old.max(1))) {
            to[..old].copy_from_slice(from);
        }
        (self.inverse, self.stride) = (inverse, new);
        let vectors = [&mut self.column, &mut self.product];
        for vector in vectors.into_iter().chain(&mut self.solutions) {
            vector.resize(new, 0.0);
        }
    }
}

/// An unknown that may be inserted.
#[derive(Clone, Copy, Debug)]
pub(super) struct EnteringUnknown<const N: usize> {
    j: usize,
    /// `G[j, j]`.
    diagonal: f64,
    /// Its entries of the residuals of the right-hand sides: the negative gradient of least squares.
    pub residual: [f64; N],
}

/// The panels of the first `width` columns of `H`, `width` rows each.
#[cfg_attr(target_arch = "x86_64", inline(always))]
fn panels(
    inverse: &mut [RegisterBlock],
    stride: usize,
    width: usize,
) -> impl Iterator<Item = &mut [RegisterBlock]> {
    let panels = inverse.chunks_exact_mut(stride.max(1)).take(width / LANES);
    panels.map(move |panel| &mut panel[..width])
}

#[cfg(all(test, not(target_arch = "wasm32")))]
mod tests {
    use super::super::test_problems::Problem;
    use super::*;
    use crate::linalg::add_scaled;

    #[test]
    fn insertions_and_removals_keep_the_solution() {
        let k = 150;
        let problem = Problem::random(k, 200, 5, 0.5);
        let gram = problem.gram();
        let b = problem.right_hand_side(&problem.measurements[0]);
        let mut set = PassiveSet::<1>::new(&gram, k);
        for j in 0..k {
            assert!(set.evaluate_and_insert(j, [b[j]]));
            if j % 3 == 2 {
                set.remove(j / 3 % set.members().len());
            }
        }
        assert!(set.members().len() > INITIAL_CAPACITY);
        let solution = set.solution(0).to_vec();
        let residual = |z: &[f64]| {
            let mut residual = b.clone();
            for (&m, z) in set.members().iter().zip(z) {
                add_scaled(&mut residual, -z, &gram[m * k..(m + 1) * k]);
            }
            residual
        };
        for &m in set.members() {
            assert!(residual(&solution)[m].abs() < 1e-7);
        }
        let residual = residual(&solution);
        set.refine(0, &residual);
        set.set_rhs(0, &b);
        for (z, again) in solution.iter().zip(set.solution(0)) {
            assert!((z - again).abs() < 1e-7);
        }
        set.clear();
        assert!(set.members().is_empty() && !set.contains(0));
        // A column that is a multiple of another one is refused.
        let dependent = [1.0, 2.0, 2.0, 4.0];
        let mut set = PassiveSet::<1>::new(&dependent, 2);
        assert!(set.evaluate_and_insert(0, [1.0]) && !set.evaluate_and_insert(1, [2.0]));
    }
}
