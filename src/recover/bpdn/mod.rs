//! Basis pursuit denoising: `min ‖φᵀτ‖₁` subject to `‖y − P̂τ‖₂ ≤ ε` and `τ ≥ 0` (paper, section 3, case (b)).
//!
//! In this module A is the weighted P̂, `[L, k]`, of one window, and x, `[k]`, the unknown τ on the window's elements
//! inside the light plane. With φ the identity, [`Homotopy`] follows the path of solutions from zero to where the
//! residual is ε; for any other orthonormal φ, [`interior_point`] applies Newton's method to the optimality conditions.
//! If ε is less than the residual of non-negative least squares (NNLS), no τ satisfies the constraint, and both return
//! the NNLS solution.

mod dual_bound;
mod homotopy;
pub(super) mod interior_point;
mod iterate;
mod newton;
mod sensing_operator;
mod sparsity_basis;
mod tolerance;

pub(super) use dual_bound::BpdnConstraint;
pub use homotopy::Homotopy;
pub(super) use sensing_operator::SensingOperator;
pub use sparsity_basis::SparsityBasis;
pub(super) use tolerance::ResidualTolerance;
