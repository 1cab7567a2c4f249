//! The elements that an active-set solver lets above zero, with their equations kept solved.

use crate::linalg::{LANES, add_scaled_padded, add_scaled_rows, dot_padded, padded_len};

/// As many numbers as fill whole registers.
type Block = [f64; LANES];

/// A pivot below this share of its diagonal means that the element's column depends linearly on the
/// passive ones, to the precision of the Gram matrix: letting it in would not lower the residual.
const DEPENDENT: f64 = 1e-9;
/// Members there is room for at first; sets rarely grow beyond the number of patterns.
const ROOM: usize = 96;
/// Rows of the inverse that are multiplied together.
const ROWS: usize = 4;

/// A passive set `P` with the inverse `H = G[P, P]⁻¹` and the solutions `H b[P]` of `N` right-hand
/// sides, all updated as elements enter and leave, at `n²` products each. No step waits for the one
/// before, as in substitution through a triangular factor; what rounding the updates gather is taken
/// out by [`PassiveSet::refine`].
///
/// Sets are small and of every size, so that vectors which ended where the set does would spend most
/// time on what is left over of them after the last full register. All have zeros up to a full one.
#[derive(Debug)]
pub(super) struct PassiveSet<'a, const N: usize> {
    /// `[k, k]`, row-major, symmetric.
    gram: &'a [f64],
    /// Elements in the order of all vectors over the set.
    members: Vec<usize>,
    is_member: Vec<bool>,
    /// `H`, `[stride, stride]`, zero beyond the members' rows and columns, in panels of [`LANES`]
    /// columns: the part of a vector that goes with a panel stays in registers.
    inverse: Vec<Block>,
    /// A multiple of [`LANES`], and the length of the vectors below, which are zero beyond the
    /// members.
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
        let stride = padded_len(k.min(ROOM));
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
        add_scaled_rows(y, self.gram, &self.members, x);
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
        let width = self.width();
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

    /// Length of vectors over the set with the zeros that fill the last register.
    #[inline(always)]
    fn width(&self) -> usize {
        padded_len(self.members.len())
    }

    /// The solution of `G[P, P] z = b[P]` for right-hand side `which`.
    #[inline(always)]
    pub fn solution(&self, which: usize) -> &[f64] {
        &self.solutions[which][..self.members.len()]
    }

    /// Replaces right-hand side `which` by `b`, `[k]`.
    #[inline(always)]
    pub fn carry(&mut self, which: usize, b: &[f64]) {
        self.gather(b);
        self.multiply();
        let width = self.width();
        self.solutions[which][..width].copy_from_slice(&self.product[..width]);
    }

    /// Corrects the solution of right-hand side `which` by what is left of it, `b − Gz`, `[k]`.
    #[inline(always)]
    pub fn refine(&mut self, which: usize, left: &[f64]) {
        self.gather(left);
        self.multiply();
        let width = self.width();
        add_scaled_padded(
            &mut self.solutions[which][..width],
            1.0,
            &self.product[..width],
        );
    }

    /// `column = b[P]`.
    #[inline(always)]
    fn gather(&mut self, b: &[f64]) {
        let n = self.members.len();
        let width = self.width();
        for (c, &j) in self.column.iter_mut().zip(&self.members) {
            *c = b[j];
        }
        self.column[n..width].fill(0.0);
    }

    /// `product = H column`.
    #[inline(always)]
    fn multiply(&mut self) {
        let width = self.width();
        // H is symmetric: its columns are its rows, and sums along rows need no reduction.
        let factors = self.column[..width].as_chunks::<ROWS>().0;
        let product = self.product.as_chunks_mut::<LANES>().0;
        let inverse = self.inverse.chunks_exact(self.stride.max(1));
        for (p, panel) in product[..width / LANES].iter_mut().zip(inverse) {
            let mut sum = [0.0; LANES];
            for ([a, b, c, d], f) in panel.as_chunks::<ROWS>().0.iter().zip(factors) {
                for i in 0..LANES {
                    sum[i] += (f[0] * a[i] + f[1] * b[i]) + (f[2] * c[i] + f[3] * d[i]);
                }
            }
            *p = sum;
        }
    }

    /// Looks at element `j` with its entries `b` of the right-hand sides.
    #[inline(always)]
    pub fn offer(&mut self, j: usize, b: [f64; N]) -> Offer<N> {
        let row = self.row(j);
        self.gather(row);
        let column = &self.column[..self.width()];
        let mut left = b;
        for (left, z) in left.iter_mut().zip(&self.solutions) {
            *left -= dot_padded(column, &z[..column.len()]);
        }
        Offer {
            j,
            diagonal: row[j],
            left,
        }
    }

    /// Adds element `j` with its entries of the right-hand sides, unless its column depends linearly
    /// on the set's.
    #[inline(always)]
    pub fn enter(&mut self, j: usize, b: [f64; N]) -> bool {
        let offer = self.offer(j, b);
        self.accept(offer)
    }

    /// Adds the element offered last, on the same terms.
    #[inline(always)]
    pub fn accept(&mut self, offer: Offer<N>) -> bool {
        self.multiply();
        let (n, before) = (self.members.len(), self.width());
        let known = dot_padded(&self.column[..before], &self.product[..before]);
        let pivot = offer.diagonal - known;
        // NaN is refused as well.
        if pivot.is_nan() || pivot <= DEPENDENT * offer.diagonal {
            return false;
        }
        if n == self.stride {
            self.widen();
        }
        let inverse = 1.0 / pivot;
        for (z, left) in self.solutions.iter_mut().zip(offer.left) {
            let step = left * inverse;
            add_scaled_padded(&mut z[..before], -step, &self.product[..before]);
            z[n] = step;
        }
        // With −1 as the new element's entry, one outer product updates all of the inverse.
        self.members.push(offer.j);
        self.is_member[offer.j] = true;
        let width = self.width();
        self.product[before..width].fill(0.0);
        self.product[n] = -1.0;
        self.add_outer(inverse);
        true
    }

    /// `H += factor · product productᵀ`.
    #[inline(always)]
    fn add_outer(&mut self, factor: f64) {
        let width = self.width();
        let product = &self.product[..width];
        let blocks = product.as_chunks::<LANES>().0;
        let factors = product.as_chunks::<ROWS>().0;
        for (panel, block) in panels(&mut self.inverse, self.stride, width).zip(blocks) {
            let block = block.map(|v| v * factor);
            let rows = panel.as_chunks_mut::<ROWS>().0.iter_mut();
            for (rows, factors) in rows.zip(factors) {
                let mut sums = *rows;
                for (sum, v) in sums.iter_mut().zip(factors) {
                    for lane in 0..LANES {
                        sum[lane] += v * block[lane];
                    }
                }
                *rows = sums;
            }
        }
    }

    /// Takes out the `i`-th member; the last one moves to its place.
    #[inline(always)]
    pub fn leave(&mut self, i: usize) {
        let (last, width) = (self.members.len() - 1, self.width());
        // The inverse's column that goes.
        let (panel, lane) = (i / LANES * self.stride, i % LANES);
        for (p, row) in self.product[..width].iter_mut().zip(&self.inverse[panel..]) {
            *p = row[lane];
        }
        let inverse = 1.0 / self.product[i];
        for z in &mut self.solutions {
            let step = z[i] * inverse;
            add_scaled_padded(&mut z[..width], -step, &self.product[..width]);
            z[i] = z[last];
            z[last] = 0.0;
        }
        self.add_outer(-inverse);
        self.move_last_to(i);
        self.is_member[self.members.swap_remove(i)] = false;
    }

    /// Puts the last row and column of the inverse in the place of the `i`-th and zeros in theirs.
    #[inline(always)]
    fn move_last_to(&mut self, i: usize) {
        let (last, width, stride) = (self.members.len() - 1, self.width(), self.stride);
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

    /// Makes room for twice as many members.
    #[cold]
    fn widen(&mut self) {
        let (old, new) = (
            self.stride,
            padded_len((2 * self.stride).min(self.is_member.len())),
        );
        let mut inverse = vec![[0.0; LANES]; new * new / LANES];
        for (to, from) in inverse
            .chunks_exact_mut(new)
            .zip(self.inverse.chunks_exact(old.max(1)))
        {
            to[..old].copy_from_slice(from);
        }
        (self.inverse, self.stride) = (inverse, new);
        let vectors = [&mut self.column, &mut self.product];
        for vector in vectors.into_iter().chain(&mut self.solutions) {
            vector.resize(new, 0.0);
        }
    }
}

/// An element that may enter a set of `N` right-hand sides.
#[derive(Clone, Copy, Debug)]
pub(super) struct Offer<const N: usize> {
    j: usize,
    /// `G[j, j]`.
    diagonal: f64,
    /// What the set's solutions leave of its entries of the right-hand sides.
    pub left: [f64; N],
}

/// The panels of the first `width` columns of a matrix as [`PassiveSet`] keeps it, `width` rows each.
#[inline(always)]
fn panels(
    inverse: &mut [Block],
    stride: usize,
    width: usize,
) -> impl Iterator<Item = &mut [Block]> {
    let all = inverse.chunks_exact_mut(stride.max(1));
    all.take(width / LANES)
        .map(move |panel| &mut panel[..width])
}

#[cfg(all(test, not(target_arch = "wasm32")))]
mod tests {
    use super::super::test_problems::Problem;
    use super::*;
    use crate::linalg::add_scaled;

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
