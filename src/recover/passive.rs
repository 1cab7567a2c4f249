//! The elements that an active-set solver lets above zero, with their equations kept solved.

use super::vector::{add_rows, add_scaled, dot};

/// A pivot below this share of its diagonal means that the element's column depends linearly on the
/// passive ones, to the precision of the Gram matrix: letting it in would not lower the residual.
const DEPENDENT: f64 = 1e-9;
/// Members there is room for at first; sets rarely grow beyond the number of patterns.
const ROOM: usize = 96;

/// A passive set `P` with the inverse `H = G[P, P]⁻¹` and the solutions `H b[P]` of `N` right-hand
/// sides, all updated as elements enter and leave, at `n²` products each. No step waits for the one
/// before, as in substitution through a triangular factor; what rounding the updates gather is taken
/// out by [`PassiveSet::refine`].
#[derive(Debug)]
pub(super) struct PassiveSet<'a, const N: usize> {
    /// `[k, k]`, row-major, symmetric.
    gram: &'a [f64],
    /// Elements in the order of all vectors over the set.
    members: Vec<usize>,
    is_member: Vec<bool>,
    /// `H`, row i in `inverse[i·stride..]`.
    inverse: Vec<f64>,
    stride: usize,
    solutions: [Vec<f64>; N],
    column: Vec<f64>,
    product: Vec<f64>,
}

impl<'a, const N: usize> PassiveSet<'a, N> {
    /// An empty set out of the `k` elements of `gram`, `[k, k]` row-major.
    ///
    /// # Panics
    /// If `gram` does not have `k²` entries.
    pub fn new(gram: &'a [f64], k: usize) -> Self {
        assert_eq!(gram.len(), k * k, "the Gram matrix is square");
        let stride = k.min(ROOM);
        Self {
            gram,
            members: Vec::with_capacity(stride),
            is_member: vec![false; k],
            inverse: vec![0.0; stride * stride],
            stride,
            solutions: std::array::from_fn(|_| Vec::with_capacity(stride)),
            column: Vec::with_capacity(stride),
            product: Vec::with_capacity(stride),
        }
    }

    /// The elements in the set, in the order of all vectors over it.
    #[inline(always)]
    pub fn members(&self) -> &[usize] {
        &self.members
    }

    #[inline(always)]
    pub fn contains(&self, j: usize) -> bool {
        self.is_member[j]
    }

    /// An element's row of the Gram matrix.
    #[inline(always)]
    pub fn row(&self, j: usize) -> &'a [f64] {
        let k = self.is_member.len();
        &self.gram[j * k..(j + 1) * k]
    }

    /// `y += Gx` for an x that is zero outside the set.
    #[inline(always)]
    pub fn add_product(&self, y: &mut [f64], x: &[f64]) {
        add_rows(y, self.gram, &self.members, x);
    }

    /// Values of the members as a vector of all elements, `[k]`.
    pub fn spread(&self, values: &[f64]) -> Vec<f64> {
        let mut all = vec![0.0; self.is_member.len()];
        for (&j, &value) in self.members.iter().zip(values) {
            all[j] = value;
        }
        all
    }

    /// Takes all elements out.
    #[inline(always)]
    pub fn clear(&mut self) {
        for j in self.members.drain(..) {
            self.is_member[j] = false;
        }
        self.solutions.iter_mut().for_each(Vec::clear);
    }

    /// The solution of `G[P, P] z = b[P]` for right-hand side `which`.
    #[inline(always)]
    pub fn solution(&self, which: usize) -> &[f64] {
        &self.solutions[which]
    }

    /// Replaces right-hand side `which` by `b`, `[k]`.
    #[inline(always)]
    pub fn carry(&mut self, which: usize, b: &[f64]) {
        self.column.clear();
        self.column.extend(self.members.iter().map(|&j| b[j]));
        self.multiply();
        self.solutions[which].clone_from(&self.product);
    }

    /// Corrects the solution of right-hand side `which` by what is left of it, `b − Gz`, `[k]`.
    #[inline(always)]
    pub fn refine(&mut self, which: usize, left: &[f64]) {
        self.column.clear();
        self.column.extend(self.members.iter().map(|&j| left[j]));
        self.multiply();
        add_scaled(&mut self.solutions[which], 1.0, &self.product);
    }

    /// `product = H column`.
    #[inline(always)]
    fn multiply(&mut self) {
        let n = self.members.len();
        self.product.clear();
        self.product.resize(n, 0.0);
        // H is symmetric: its columns are its rows, and sums along rows need no reduction.
        for (row, &c) in self
            .inverse
            .chunks_exact(self.stride.max(1))
            .zip(&self.column)
        {
            add_scaled(&mut self.product, c, &row[..n]);
        }
    }

    /// Adds element `j` with its entries of the right-hand sides, unless its column depends linearly
    /// on the set's.
    #[inline(always)]
    pub fn enter(&mut self, j: usize, b: [f64; N]) -> bool {
        let (n, row) = (self.members.len(), self.row(j));
        self.column.clear();
        self.column.extend(self.members.iter().map(|&i| row[i]));
        self.multiply();
        let pivot = row[j] - dot(&self.column, &self.product);
        // NaN is refused as well.
        if pivot.is_nan() || pivot <= DEPENDENT * row[j] {
            return false;
        }
        if n == self.stride {
            self.widen();
        }
        let (inverse, stride) = (1.0 / pivot, self.stride);
        for (z, b) in self.solutions.iter_mut().zip(b) {
            let step = (b - dot(&self.column, z)) * inverse;
            add_scaled(z, -step, &self.product);
            z.push(step);
        }
        let rows = self.inverse.chunks_exact_mut(stride);
        for (row, &v) in rows.zip(&self.product) {
            add_scaled(&mut row[..n], v * inverse, &self.product);
            row[n] = -v * inverse;
        }
        let last = &mut self.inverse[n * stride..n * stride + n + 1];
        for (h, v) in last.iter_mut().zip(&self.product) {
            *h = -v * inverse;
        }
        last[n] = inverse;
        self.members.push(j);
        self.is_member[j] = true;
        true
    }

    /// Takes out the `i`-th member; the last one moves to its place.
    #[inline(always)]
    pub fn leave(&mut self, i: usize) {
        let (last, stride) = (self.members.len() - 1, self.stride);
        self.is_member[self.members.swap_remove(i)] = false;
        // Move the last row and column to the place of those that go, and these to the end.
        for row in self.inverse.chunks_exact_mut(stride).take(last + 1) {
            row.swap(i, last);
        }
        let (before, gone) = self.inverse.split_at_mut(last * stride);
        let gone = &mut gone[..last + 1];
        if i < last {
            before[i * stride..i * stride + last + 1].swap_with_slice(gone);
        }
        let inverse = 1.0 / gone[last];
        for z in &mut self.solutions {
            let step = z.swap_remove(i) * inverse;
            add_scaled(z, -step, &gone[..last]);
        }
        for (row, &h) in before.chunks_exact_mut(stride).zip(&gone[..last]) {
            add_scaled(&mut row[..last], -h * inverse, &gone[..last]);
        }
    }

    /// Makes room for twice as many members.
    #[cold]
    fn widen(&mut self) {
        let (old, new) = (self.stride, (2 * self.stride).min(self.is_member.len()));
        let mut inverse = vec![0.0; new * new];
        for (to, from) in inverse
            .chunks_exact_mut(new)
            .zip(self.inverse.chunks_exact(old))
        {
            to[..old].copy_from_slice(from);
        }
        (self.inverse, self.stride) = (inverse, new);
    }
}

#[cfg(all(test, not(target_arch = "wasm32")))]
mod tests {
    use super::super::test_problems::Problem;
    use super::*;

    #[test]
    fn solutions_follow_the_set() {
        let k = 150;
        let problem = Problem::random(k, 200, 5, 0.5);
        let gram = problem.gram();
        let b = problem.right_hand_side(&problem.measurements[0]);
        let mut set = PassiveSet::<1>::new(&gram, k);
        for j in 0..k {
            assert!(set.enter(j, [b[j]]));
            if j % 3 == 2 {
                set.leave(j / 3 % set.members().len());
            }
        }
        assert!(set.members().len() > ROOM);
        let solution = set.solution(0).to_vec();
        let left = |z: &[f64]| {
            let mut left = b.clone();
            for (&m, z) in set.members().iter().zip(z) {
                add_scaled(&mut left, -z, &gram[m * k..(m + 1) * k]);
            }
            left
        };
        for &m in set.members() {
            assert!(left(&solution)[m].abs() < 1e-7);
        }
        let left = left(&solution);
        set.refine(0, &left);
        set.carry(0, &b);
        for (z, again) in solution.iter().zip(set.solution(0)) {
            assert!((z - again).abs() < 1e-7);
        }
        set.clear();
        assert!(set.members().is_empty() && !set.contains(0));
        // A column that is another one's double does not enter.
        let twin = [1.0, 2.0, 2.0, 4.0];
        let mut set = PassiveSet::<1>::new(&twin, 2);
        assert!(set.enter(0, [1.0]) && !set.enter(1, [2.0]));
    }
}
