//! Basis pursuit denoising: `min ‖φᵀτ‖₁` subject to `‖y − P̂τ‖₂ ≤ ε` and `τ ≥ 0` (paper, section 3,
//! case (b)), for the constraint as written.
//!
//! With φ the identity the path of solutions over ε is followed from dark to where it meets ε
//! ([`homotopy`]); with any other orthonormal φ the constraints are split off and solved for in
//! turns ([`splitting`]). Where ε is less than non-negative least squares can reach, no τ satisfies
//! the constraint, and both return that least-squares solution.

mod homotopy;
mod interior;
mod splitting;
mod tolerance;
mod transform;

pub use homotopy::Homotopy;
pub use splitting::{Constraint, Solution, Splitting};
pub(super) use tolerance::Tolerance;
pub use transform::SparsityBasis;
