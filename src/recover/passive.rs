//! The elements that an active-set solver lets above zero, with their equations kept factored.

use super::vector::{add_scaled, dot};

/// A pivot below this share of its diagonal means that the element's column depends linearly on the
/// passive ones, to the precision of the Gram matrix: letting it in would not lower the residual.
const DEPENDENT: f64 = 1e-9;

/// A passive set `P` with the Cholesky factor `G[P, P] = RᵀR` and `N` right-hand sides `b` carried
/// along as `R⁻ᵀ b[P]`, all updated as elements enter and leave. Every inner loop runs along rows
/// of `R`.
#[derive(Debug)]
pub(super) struct PassiveSet<const N: usize> {
    k: usize,
    /// Elements in the order of the factor's rows.
    members: Vec<usize>,
    is_member: Vec<bool>,
    /// `R`, upper triangular, row i in `factor[i·k..]`.
    factor: Vec<f64>,
    /// `1 / R[i, i]`.
    inverse_diagonal: Vec<f64>,
    carried: [Vec<f64>; N],
    column: Vec<f64>,
}

impl<const N: usize> PassiveSet<N> {
    /// An empty set out of `k` elements.
    pub fn new(k: usize) -> Self {
        Self {
            k,
            members: Vec::with_capacity(k),
            is_member: vec![false; k],
            factor: vec![0.0; k * k],
            inverse_diagonal: Vec::with_capacity(k),
            carried: std::array::from_fn(|_| Vec::with_capacity(k)),
            column: vec![0.0; k],
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

    /// Takes all elements out.
    pub fn clear(&mut self) {
        for j in self.members.drain(..) {
            self.is_member[j] = false;
        }
        self.inverse_diagonal.clear();
        self.carried.iter_mut().for_each(Vec::clear);
    }

    /// `R⁻ᵀ b[P]` of carried right-hand side `which`.
    #[inline(always)]
    pub fn carried(&self, which: usize) -> &[f64] {
        &self.carried[which]
    }

    /// Replaces carried right-hand side `which` by `b`, `[k]`.
    #[inline(always)]
    pub fn carry(&mut self, which: usize, b: &[f64]) {
        let carried = &mut self.carried[which];
        carried.clear();
        carried.extend(self.members.iter().map(|&j| b[j]));
        forward(&self.factor, self.k, &self.inverse_diagonal, carried);
    }

    /// Adds element `j` with its entries of the carried right-hand sides, unless its column depends
    /// linearly on the set's.
    #[inline(always)]
    pub fn enter(&mut self, gram: &[f64], j: usize, b: [f64; N]) -> bool {
        let (n, k) = (self.members.len(), self.k);
        let row = &gram[j * k..(j + 1) * k];
        let column = &mut self.column[..n];
        for (c, &i) in column.iter_mut().zip(&self.members) {
            *c = row[i];
        }
        forward(&self.factor, k, &self.inverse_diagonal, column);
        let pivot = row[j] - dot(column, column);
        // Written so that NaN is refused as well.
        if pivot.partial_cmp(&(DEPENDENT * row[j])) != Some(std::cmp::Ordering::Greater) {
            return false;
        }
        let inverse = 1.0 / pivot.sqrt();
        for (carried, b) in self.carried.iter_mut().zip(b) {
            carried.push((b - dot(column, carried)) * inverse);
        }
        for (i, &c) in column.iter().enumerate() {
            self.factor[i * k + n] = c;
        }
        self.factor[n * k + n] = pivot.sqrt();
        self.inverse_diagonal.push(inverse);
        self.members.push(j);
        self.is_member[j] = true;
        true
    }

    /// Takes out the `i`-th member: the factor loses a column, and Givens rotations make it
    /// triangular again.
    #[inline(always)]
    pub fn leave(&mut self, i: usize) {
        let (n, k) = (self.members.len(), self.k);
        self.is_member[self.members.remove(i)] = false;
        for row in 0..n {
            let from = row.max(i + 1);
            self.factor
                .copy_within(row * k + from..row * k + n, row * k + from - 1);
        }
        for c in i..n - 1 {
            let (upper, lower) = self.factor[c * k..].split_at_mut(k);
            let (upper, lower) = (&mut upper[c..n - 1], &mut lower[c..n - 1]);
            let (a, b) = (upper[0], lower[0]);
            let r = (a * a + b * b).sqrt();
            let (cos, sin) = (a / r, b / r);
            for (a, b) in upper.iter_mut().zip(lower) {
                (*a, *b) = (cos * *a + sin * *b, cos * *b - sin * *a);
            }
            self.inverse_diagonal[c] = 1.0 / r;
            for carried in &mut self.carried {
                let (a, b) = (carried[c], carried[c + 1]);
                (carried[c], carried[c + 1]) = (cos * a + sin * b, cos * b - sin * a);
            }
        }
        self.inverse_diagonal.pop();
        for carried in &mut self.carried {
            carried.pop();
        }
    }

    /// `z` with `R z = w`, written over `w`: with `w = R⁻ᵀ b[P]`, the solution of `G[P, P] z = b[P]`.
    #[inline(always)]
    pub fn back_substitute(&self, w: &mut [f64]) {
        let (n, k) = (self.members.len(), self.k);
        for i in (0..n).rev() {
            let (known, after) = w.split_at_mut(i + 1);
            let row = &self.factor[i * k + i + 1..i * k + n];
            known[i] = (known[i] - dot(row, after)) * self.inverse_diagonal[i];
        }
    }
}

/// `R⁻ᵀ b` over `b`.
#[inline(always)]
fn forward(factor: &[f64], k: usize, inverse_diagonal: &[f64], b: &mut [f64]) {
    let n = b.len();
    for i in 0..n {
        let (known, after) = b.split_at_mut(i + 1);
        known[i] *= inverse_diagonal[i];
        add_scaled(after, -known[i], &factor[i * k + i + 1..i * k + n]);
    }
}
